"""A sentence in a scene to what it means, or a refusal in words with the nearest sentence that would be understood."""

import re
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from itertools import product
from typing import Any

from lab.lazy import lark
from lab.words.meaning import Intent, Refusal
from lab.words.reader import MOST_WORDS, Reading, kinds_of_words, names_of, read, words_of
from lab.words.said import examples, in_words
from lab.words.scene import GridScene, Scene
from lab.words.sense import Misfit, Referents, Senses, Unclear, Unresolved

MOST_READINGS = 200  # of one part of a sentence
TOO_LONG = "that is too long: say it in shorter sentences"


def listen(text: str, scene: Scene, corrects: bool = True) -> list[Intent] | Refusal:
    """The intents of a sentence in the order in which they are to be done, or a refusal of one line.

    corrects: whether words with typing errors are corrected. Derivations with different meanings, a word that nobody knows, and
    a name that fits several objects are refused.
    """
    named, means = names_of(scene)
    words = words_of(text)
    if not words:
        return Refusal(_hint("nothing was said", scene, text))
    if len(words) > MOST_WORDS or len(text) > 1000:
        return Refusal(TOO_LONG)
    reading = read(text, scene, named, corrects)
    if reading.unknown:
        return _unknown(reading, scene, dict(means), text)
    return _meant(reading.text, scene, dict(means), text)


def _unknown(reading: Reading, scene: Scene, names: dict[str, object], said_text: str) -> Refusal:
    """The refusal of a sentence with unknown words; the rest of it is the hint if it means something."""
    said = ", ".join(f"'{word[:20]}'" for word in reading.unknown[:3])
    rest = _meant(re.sub(r"\?\S+ ?", "", reading.text).strip(), scene, names, said_text)
    reason = f"{said}: not understood"
    return Refusal(
        _hint(reason, scene, said_text)
        if isinstance(rest, Refusal)
        else f"{reason}; without it: {in_words(rest, scene)}?"
    )


def _meant(text: str, scene: Scene, names: dict[str, object], said: str) -> list[Intent] | Refusal:
    """The only meaning of words of the grammar, or a refusal."""
    try:
        found = _clauses(text, scene, names)
    except Unclear as unclear:
        return Refusal(str(unclear))
    found_in: dict[int, dict[tuple[Intent, ...], None]] = {}
    refused: dict[str, None] = {}
    unresolved: dict[str, None] = {}
    for clauses in found:
        if isinstance(clauses, Refusal):
            (unresolved if isinstance(clauses, Weak) else refused)[clauses.reason] = None
            continue
        try:
            referents = Referents(scene)
            meaning = referents.intents(clauses)
            found_in.setdefault(referents.redundant, {})[meaning] = None
        except Misfit:
            continue
        except Unresolved as unclear:
            unresolved[str(unclear)] = None
        except Unclear as unclear:
            refused[str(unclear)] = None
    meanings = found_in[min(found_in)] if found_in else {}
    if len(meanings) == 1 and not refused:
        return list(next(iter(meanings)))
    if len(meanings) > 1:
        first, second = list(meanings)[:2]
        return Refusal(f"that may mean two things: {in_words(first, scene)}, or {in_words(second, scene)}?")
    refused |= unresolved
    return Refusal(next(iter(refused)) if refused else _hint("that is not understood", scene, said))


# ---- the grammar -----------------------------------------------------------------------------------------------------------


@cache
def grammar(start: str) -> Any:
    """The parser of a kind of scenes, "grid" or "order" (a `lark.Lark`), with a terminal for each kind of words."""
    text = _flat(files("lab.words").joinpath("grammar.lark").read_text(encoding="utf-8"))
    rows = {
        **{
            kind: f"(?:{'|'.join(map(re.escape, phrases))})".replace("\\ ", " ")
            for kind, phrases in kinds_of_words().items()
        },
        **{kind: f"{kind.lower()}[0-9]+x" for kind in ("NAME", "PART", "KIND", "STATION", "ACTKIND")},
        "ACT": "act(?:kind)?[0-9]+x",
        "NUM": r"[0-9]+(?:\.[0-9]+)?",
        "LENGTH": r"[0-9.e+-]+cm[0-9.]+",
    }
    lines = [text, *(f"{kind}: /{pattern}(?![^ ])/" for kind, pattern in rows.items()), "%ignore FILLER", '%ignore " "']
    return lark.Lark("\n".join(lines), parser="earley", lexer="dynamic", ambiguity="forest", start=start)


def _flat(text: str) -> str:
    """The grammar with a rule of its own for each part that may be left out or repeated, which keeps it small."""
    forms = {"?": "{0}: {1} |", "*": "{0}: {0} ({1}) |", "+": "{0}: {1} | {0} ({1})", "": "{0}: {1}"}
    made: dict[tuple[str, str], str] = {}  # part and suffix -> the name of its rule

    def named(match: re.Match[str]) -> str:
        return made.setdefault((match[1].strip(), match[2]), f"_part{len(made)}") + " "

    def without_suffixes(part: str) -> str:
        return re.sub(r"\b(\w+)([?*+])", named, part)

    text = re.sub("//.*", "", text)
    while "(" in text:
        text = re.sub(r"\(([^()]*)\)([?*+]?)", named, text)
    rules = [without_suffixes(text)]
    groups = list(made.items())
    written = 0
    while written < len(groups):
        (part, suffix), name = groups[written]
        inner = part if part.isidentifier() else without_suffixes(part)
        rules.append(forms[suffix].format(name, inner))
        written += 1
        groups = list(made.items())
    return "\n".join(rules)


def _clauses(text: str, scene: Scene, names: Mapping[str, object]) -> list[Any]:
    """All readings of a text: a tuple of clauses each, or a refusal. Raises Unclear if there are too many."""
    start = "grid" if isinstance(scene, GridScene) else "order"
    try:
        root = grammar(start).parse(text)
    except lark.exceptions.LarkError:
        return []
    return [value for (value,) in _Forest(Senses(scene, dict(names))).values(root)]


class Weak(Refusal):
    """The refusal of a reading that counts only if there is no other."""


class _Forest:
    """The values of the nodes of a parse forest; each is found once, however many derivations share it."""

    def __init__(self, senses: Senses) -> None:
        self._senses = senses
        self._known: dict[int, list[tuple[Any, ...]]] = {}

    def values(self, node: Any) -> list[tuple[Any, ...]]:
        """The different values of a node: a tuple of those of its parts in a rule that has no value of its own."""
        if node is None:
            return [()]
        if isinstance(node, lark.parsers.earley_forest.TokenNode):
            return [self._senses.token(node.token.type, str(node.token))]
        if id(node) not in self._known:
            self._known[id(node)] = []  # a circle adds nothing
            found: dict[tuple[Any, ...], None] = {}
            for packed in node.children:
                for left, right in product(self.values(packed.left), self.values(packed.right)):
                    for value in self._of(node, packed.rule, (*left, *right)):
                        found[value] = None
            if len(found) > MOST_READINGS:
                raise Unclear(TOO_LONG)
            self._known[id(node)] = list(found)
        return self._known[id(node)]

    def _of(self, node: Any, rule: Any, values: tuple[Any, ...]) -> list[tuple[Any, ...]]:
        name = rule.alias or rule.origin.name
        if node.is_intermediate or name.startswith("_"):
            return [values]
        if (refusal := next((value for value in values if isinstance(value, Refusal)), None)) is not None:
            return [(refusal,)]
        if rule.options is not None and rule.options.expand1 and not rule.alias and len(values) == 1:
            return [values]
        try:
            return [(self._senses.of(str(name), values),)]
        except Misfit:
            return []
        except Unresolved as unclear:
            return [(Weak(str(unclear)),)]
        except Unclear as unclear:
            return [(Refusal(str(unclear)),)]


# ---- hints -----------------------------------------------------------------------------------------------------------------


def _hint(reason: str, scene: Scene, text: str = "") -> str:
    """The reason with the nearest sentence that would be understood."""
    known = examples(scene)
    near = get_close_matches(text.lower(), known, n=1, cutoff=0.3) or known[:1]
    return f"{reason}; what would be: {near[0]}" if near else reason
