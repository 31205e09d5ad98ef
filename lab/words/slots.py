"""Tokens to slots: names with what tells them apart, directions, amounts and conditions, by the grammar in `grammar.lark`.

A sentence may be put together in several ways ("the left cube" is one name, or a direction and a name): all are found.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product
from typing import Any

from lab.lazy import lark
from lab.words.reader import Token
from lab.words.vocabulary import READ, clause_kinds, rows

MOST_READINGS = 256


@dataclass(frozen=True)
class Slot:
    """A part of a sentence: its kind, and its value, which is the text of a single word.

    The kinds in small letters are the grammar's: dir, side, amount, until, thing, part, station, work, numbered, unclear.
    """

    kind: str
    value: Any = None


@dataclass(frozen=True)
class Thing:
    """An object as it is named: the ids that its noun fits (() for "one"), adjectives, and places that follow it."""

    ids: tuple[str, ...]
    adjectives: tuple[Any, ...] = ()
    posts: tuple[Any, ...] = ()
    is_plural: bool = False


@dataclass(frozen=True)
class Amount:
    """A number of steps or a length: the number, and the length in cm of its unit (None: steps); is_bare: without a unit."""

    number: float
    unit: float | None = None
    is_bare: bool = False


@dataclass(frozen=True)
class Part:
    """A part as it is named: the parts that fit, or any part at all; is_none: no part; is_next: the next one."""

    parts: tuple[str, ...] = ()
    is_any: bool = False
    is_none: bool = False
    is_next: bool = False


class TooLong(Exception):
    """There are too many ways to put the sentence together."""


def slots_of(tokens: Sequence[Token], start: str) -> list[tuple[Slot, ...]]:
    """The different ways to put tokens together, fewest slots first; start: "map" or "order". Raises TooLong."""
    try:
        root = _parser(start).parse(tuple(tokens))
    except lark.exceptions.LarkError:
        return []
    found = _Forest().values(root)
    return sorted(found, key=len)


@cache
def _kinds() -> tuple[str, ...]:
    return tuple(dict.fromkeys((*rows("common"), *rows("map"), *rows("order"), *READ)))


@cache
def _parser(start: str) -> Any:
    """The parser of a kind of scenes (a `lark.Lark`)."""
    kinds = _kinds()
    text = files("lab.words").joinpath("grammar.lark").read_text(encoding="utf-8")
    marks = " | ".join(kind for kind in kinds if kind not in clause_kinds("never alone"))

    class Words(lark.lexer.Lexer):
        """Hands on the tokens as they are."""

        def __init__(self, conf: object) -> None:
            pass

        def lex(self, tokens: Any, parser_state: Any = None) -> Iterator[Any]:
            for token in tokens:
                yield lark.Token(token.kind, token)

    grammar = f"{text}\nmark: {marks}\n%declare {' '.join(kinds)}\n"
    return lark.Lark(grammar, parser="earley", lexer=Words, ambiguity="forest", start=start)


class _Forest:
    """The values of the nodes of a parse forest; each is found once, however many derivations share it."""

    def __init__(self) -> None:
        self._known: dict[int, list[Any]] = {}

    def values(self, node: Any) -> list[Any]:
        """The different values of a node; a tuple of the values of its parts while its rule is not complete."""
        if node is None:
            return [()]
        if isinstance(node, lark.parsers.earley_forest.TokenNode):
            return [(node.token.value,)]
        if id(node) not in self._known:
            self._known[id(node)] = []  # a circle adds nothing
            found: dict[Any, None] = {}
            for packed in node.children:
                for left, right in product(self.values(packed.left), self.values(packed.right)):
                    for value in self._of(node, packed.rule, (*left, *right)):
                        found[value] = None
            if len(found) > MOST_READINGS:
                raise TooLong
            self._known[id(node)] = list(found)
        return self._known[id(node)]

    def _of(self, node: Any, rule: Any, parts: tuple[Any, ...]) -> list[Any]:
        name = rule.alias or str(rule.origin.name)
        if node.is_intermediate or name.startswith("_") or name in ("map", "order"):
            return [] if any(map(_is_torn, parts, parts[1:])) else [parts]
        if rule.options is not None and rule.options.expand1 and not rule.alias and len(parts) == 1:
            return [parts]
        return [(made,) for made in _value(name, parts)]


def _is_torn(first: Any, second: Any) -> bool:
    """Whether two slots that follow each other belong together, which another reading has."""
    if not isinstance(first, Slot) or not isinstance(second, Slot):
        return False
    if first.kind == "UNTIL":
        return second.kind in clause_kinds("condition") or second.kind in ("dir", "thing")
    if second.kind == "thing" and first.kind in ("dir", "FARTHEST", "NEAREST", "BIG", "SMALL", "TOP", "BOTTOM"):
        return True
    if first.kind == "TO" and second.kind == "amount":
        return True
    if first.kind == "until" and second.kind == "side":
        return isinstance(first.value[-1], tuple)
    if first.kind == "until":
        return second.kind in clause_kinds("condition") and second.kind not in ("GO", "MOVE")
    if second.kind == "dir":
        return first.kind in ("TO", "ON", "ITS", "FROM")
    return first.kind == "dir" and second.kind == "OF"


# ---- the value of each rule ------------------------------------------------------------------------------------------------


def _value(name: str, parts: tuple[Any, ...]) -> tuple[Any, ...]:
    """The value of a rule by its name, as a tuple of it, () if its parts do not fit."""
    values = [part for part in parts if not isinstance(part, Token)]
    tokens = [part for part in parts if isinstance(part, Token)]
    match name:
        case "dir" | "side":
            return (Slot(name, values[0]),)
        case "side_up" | "side_down":
            return (Slot("side", name.removeprefix("side_")),)
        case "same" | "post" | "word" if values:
            return (values[0],)
        case "word" | "mark":
            return (tokens[-1].kind if name == "word" else Slot(tokens[0].kind, tokens[0].text),)
        case "number":
            return (tokens[0].value,)
        case "bare_steps":
            return (Slot("amount", Amount(values[0], is_bare=True)),)
        case "steps":
            return (Slot("amount", Amount(values[0])),)
        case "one_step":
            return (Slot("amount", Amount(1.0)),)
        case "length":
            number, unit = next(token.value for token in tokens if token.kind == "LENGTH")
            return (Slot("amount", Amount(number, unit)),)
        case "angle" | "vague":
            return (Slot("unclear", "angles are not understood" if name == "angle" else "that is no number of steps"),)
        case "thing" | "one":
            wanted = "NAME" if name == "thing" else "ONE"
            at = next(n for n, part in enumerate(parts) if isinstance(part, Token) and part.kind == wanted)
            adjectives = tuple(part for part in parts[:at] if not isinstance(part, Token))
            is_plural = wanted == "NAME" and parts[at].text.endswith("s")
            ids = parts[at].value if wanted == "NAME" else ()
            return (Slot("thing", Thing(ids, adjectives, parts[at + 1 :], is_plural)),)
        case "beside":
            return (("beside", values[0].value),)
        case "named":
            return (("thing", values[0].value),)
        case "towards":
            return (("way", values[0]),)
        case "until":
            return (Slot("until", tuple(values)),)
    if name in ORDER_RULES:
        return (ORDER_RULES[name](tokens),)
    return (name,)


def _named(tokens: Sequence[Token], *kinds: str) -> Any:
    return next(token.value for token in tokens if token.kind in kinds)


ORDER_RULES: Mapping[str, Callable[[Sequence[Token]], Slot]] = {
    "part": lambda tokens: Slot("part", Part((tokens[0].value,))),
    "kind": lambda tokens: Slot("part", Part(_named(tokens, "KIND"))),
    "kind_of_work": lambda tokens: Slot("part", Part(_named(tokens, "ACTKIND")[1])),
    "no_part": lambda tokens: Slot("part", Part(is_any=True, is_none=True)),
    "no_kind": lambda tokens: Slot("part", Part(is_any=True, is_none=True)),
    "any_part": lambda tokens: Slot("part", Part(is_any=True)),
    "next_part": lambda tokens: Slot("part", Part(is_any=True, is_next=True)),
    "station": lambda tokens: Slot("station", tokens[0].value),
    "act": lambda tokens: Slot("work", (tokens[0].value, tokens[0].text)),
    "act_of_kind": lambda tokens: Slot("work", (tokens[0].value[0], tokens[0].text)),
    "numbered": lambda tokens: Slot("numbered", _named(tokens, "NUM", "ONE", "ORDINAL")),
    "numbered_first": lambda tokens: Slot("numbered", 1.0),
}
