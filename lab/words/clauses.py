"""Slots to clauses: a sentence is cut into the groups of slots that mean something, at the least cost.

The order of the slots of a group hardly counts: it means what its kinds of words allow, and nothing if one of them is left over.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from lab.words.meaning import ALL, Again, Allow, Intent, Opposite, Own, Praise, Quiet, Stop, Undo, Why
from lab.words.slots import Amount, Slot
from lab.words.vocabulary import clause_kinds

SEPARATORS = {"COMMA": 1.5, "AND": 1.5, "BUT": 1.6, "DOT": 4.0, "THEN": 6.0}  # kind -> its cost inside of a group
ABUTTING = 2.0  # the cost of a group that begins without a separator
ABUTTING_VERB = 0.7  # the same if it begins with a verb
MOST_CUTS = 6  # of a rest of a sentence
LONGEST = 14  # slots of a group
FREE = frozenset(
    ["YES", "OK", "IT", "ITS", "TO", "ON", "OF", "AGAIN", "PRETTY", "INSTEAD", "EVER", "FIRST", "IS", *SEPARATORS]
)


class Misfit(Exception):
    """A clause that means nothing in its scene: other ways to put the sentence together count."""


class Unclear(Exception):
    """A clause that is refused; the message is the reason, in one line."""


@dataclass(frozen=True)
class Said:
    """A clause before what it refers to is looked up: the name of what it means, and values."""

    rule: str
    values: tuple[Any, ...] = ()


Clause = Intent | Said
STOPS = Said("stop", (True,))
GOES_ON = Said("goes on")  # its own choice, or nothing before a command, as in "go on, two more to the right"
NO_COMMAND = Said("reason")  # it adds nothing to other clauses, and means nothing alone


class Group:
    """Some slots that follow each other."""

    def __init__(self, slots: Sequence[Slot]) -> None:
        self.slots = tuple(slots)

    @cached_property
    def kinds(self) -> frozenset[str]:
        """All kinds of slots."""
        return frozenset(slot.kind for slot in self.slots)

    @cached_property
    def content(self) -> frozenset[str]:
        """The kinds that have to be understood."""
        return self.kinds - FREE

    def has(self, *kinds: str) -> bool:
        """Whether there is a slot of one of these kinds."""
        return not self.kinds.isdisjoint(kinds)

    def only(self, *kinds: str) -> bool:
        """Whether nothing else has to be understood."""
        return self.content <= set(kinds)

    def all(self, kind: str) -> list[Any]:
        """The values of the slots of a kind, in order."""
        return [slot.value for slot in self.slots if slot.kind == kind]

    def at(self, *kinds: str) -> int:
        """The place of the first slot of these kinds, -1 for none."""
        return next((n for n, slot in enumerate(self.slots) if slot.kind in kinds), -1)

    @property
    def negated(self) -> bool:
        """Whether there is a word such as "not"."""
        return self.has("NOT", "NO", "NEVER", "NOTHING", "NOLONGER")

    @property
    def conditions(self) -> frozenset[str]:
        """The words of its conditions."""
        return frozenset(item for items in self.all("until") for item in items if isinstance(item, str))

    def is_one(self) -> bool:
        """Whether its amounts are nothing but "one" or "step"."""
        ones = all(amount == Amount(1.0, is_bare=amount.is_bare) for amount in self.all("amount"))
        return ones and all(number == 1.0 for number in self.all("numbered"))


Meaning = Callable[[Group], Iterator[tuple[float, Clause]]]


def cuts(slots: tuple[Slot, ...], meaning: Meaning) -> list[tuple[float, tuple[Clause, ...]]]:
    """The cheapest ways to cut slots into groups that mean something, with their clauses."""
    best: dict[int, list[tuple[float, tuple[Clause, ...]]]] = {len(slots): [(0.0, ())]}
    for at in range(len(slots) - 1, -1, -1):
        found: dict[tuple[Clause, ...], float] = {}
        if slots[at].kind in SEPARATORS:
            for cost, rest in best[at + 1]:
                found[rest] = min(cost, found.get(rest, 99.0))
        else:
            for end in range(at + 1, min(len(slots), at + LONGEST) + 1):
                states = slots[end : end + 1] != () and slots[end].kind in ("IS", "WAS")  # "going left was wrong"
                if not best[end] or slots[end - 1].kind in SEPARATORS or states:
                    continue
                inside = sum(SEPARATORS.get(slot.kind, 0.0) for slot in slots[at:end])
                for price, clause in meaning(Group(slots[at:end])):
                    if _joint(slots, end) and (isinstance(clause, Why | Undo | Again) or clause in (STOPS, NO_COMMAND)):
                        continue  # "why did you go left?", "stop going left"
                    if isinstance(clause, Praise) and slots[end : end + 1] != () and slots[end].kind == "TO":
                        continue  # "it would be wrong to go left"
                    for cost, rest in best[end]:
                        if isinstance(clause, Own) and _joint(slots, end) and not isinstance(rest[0], Quiet):
                            continue  # "you pick one"
                        total = cost + price + inside + _joint(slots, end)
                        found[clause, *rest] = min(total, found.get((clause, *rest), 99.0))
        ordered = sorted(((cost, clauses) for clauses, cost in found.items()), key=lambda pair: pair[0])
        best[at] = ordered[:MOST_CUTS]
    return best[0]


def _joint(slots: tuple[Slot, ...], end: int) -> float:
    """The cost of a group that begins at a slot and not at a separator."""
    if end >= len(slots) or slots[end].kind in SEPARATORS:
        return 0.0
    return ABUTTING_VERB if slots[end].kind in ("GO", "MOVE", "TURN", "PUT", "AVOID") else ABUTTING


# ---- what can be said anywhere ---------------------------------------------------------------------------------------------

CALLED = {"silly", "stupid", "dummy", "idiot", "fool", "moron", "you idiot", "you fool", "you dummy", "dumb", "dimwit"}


def common(group: Group) -> Iterator[tuple[float, Clause]]:
    """What a group means in any scene, each with a cost."""
    has, only = group.has, group.only
    asks = has("ASKS") and not all(text in ("what", "how") for text in group.all("ASKS"))
    judges = has("GOOD") != has("BAD") and only(*clause_kinds("praise"), "NO", "ASKS", "WAS") and group.is_one()
    if judges and not asks and not has("TO") and not (has("GOOD") and has("NO")):
        yield 0.0, Praise(1 if has("GOOD") != has("NOT", "NEVER", "NOTTHAT") else -1)
    if has("BAD") and has("NO") and only("BAD", "NO") and not has("IT") and set(group.all("BAD")) <= CALLED:
        yield -1.0, NO_COMMAND  # "no, silly"
    if has("OPPOSITE") and only(
        "OPPOSITE", "NO", "NOTTHAT", "GO", "MOVE", "WAY", "TURN", "JUDGED", "PUT", "CAN", "WAS", "DOIT"
    ):
        yield 0.0, Opposite()
    if group.all("dir") == ["reverse"] and has("NO", "NOTTHAT") and only("dir", "NO", "NOTTHAT", "GO", "MOVE"):
        yield 0.0, Opposite()
    if has("SAME") and only(*clause_kinds("again")) and group.is_one():
        yield 0.0, Again()
    if has("AGAIN") and only("MORE", "PUT", "MOVE", "LAST", "DOIT"):
        yield 0.5, Again()
    if _takes_back(group):
        yield 0.0, Undo()
    if has("GOON") and only("GOON", "WAY"):
        yield 0.0, GOES_ON
    elif _leaves_it(group):
        yield (-1.0 if has("GOAHEAD") and has("YES", "OK") else 0.0 if group.content else 3.0), Own()
    if has("WHY") and only("WHY", "ASK", "LAST", "NO", "ASKS", "STUCK", "GO", "part", "ANYPART", "MORE"):
        yield 0.0, Why()
    if (until := _quiet(group)) is not None:
        yield 0.0, Quiet(until)
    if has("STAY") and only("STAY"):
        yield 0.0, Said("stay")
    if has("STOP", "END", "BYE", "FINISH") and _ends(group):
        yield 0.0, Said("stop", (not has("END", "BYE", "SESSION"),))
    if _lifts_all(group) or (has("LIFTALL") and only("LIFTALL", "CAN")):
        yield 0.0, Allow(ALL)
    if has("NO", "NOTTHAT", "REST") and only(
        "NO", "NOTTHAT", "REST", "LET", "WAIT", "PUT", "GOON", "GO", "ONLYTHEN", "LASTLY"
    ):
        yield 1.0, NO_COMMAND


def _takes_back(group: Group) -> bool:
    objects = (*clause_kinds("undo"), "SAME")
    if not group.is_one() or (group.all("part") and not group.all("part")[0].is_any):
        return False
    if group.all("CANCEL") == ["cancel"] and group.only("CANCEL"):
        return True
    if group.has("UNDO", "SCRATCH"):
        return group.only("UNDO", "SCRATCH", "NO", "CORRECT", *objects)
    return (
        group.has("CANCEL")
        and group.has("ANSWER", "LAST", "MOVE", "JUDGED", "SAME")
        and group.only("CANCEL", "NO", *objects)
    )


def _leaves_it(group: Group) -> bool:
    if group.has("OWN", "DUNNO", "DOIT") and not (group.has("AGAIN") and group.only("DOIT", "MORE")):
        return group.only(*clause_kinds("own"))
    if group.has("GOAHEAD"):
        return group.only("GOON", "GOAHEAD", "WAY")
    return group.has("YES", "OK") and not group.content and not group.has("TO", "ON", "OF", "AGAIN")


def _quiet(group: Group) -> Any:
    """Until when no questions are wanted, None if that is not what a group says."""
    silent = group.has("QUIET", "NOT", "NO", "NEVER", "STOP", "NOTHING", "NOLONGER", "HOLD") or any(
        part.is_none for part in group.all("part")
    )
    if not group.only(*clause_kinds("quiet")) or not group.has("ASK", "QUIET", "ONLY"):
        return None
    words = group.conditions
    stuck = group.has("STUCK", "BLOCKED", "DUNNO") or not words.isdisjoint(("STUCK", "BLOCKED"))
    things = [item for items in group.all("until") for item in items if isinstance(item, tuple)]
    if stuck and (silent or group.has("IF", "ONLY", "until", "UNTIL", "AFTER", "BEFORE", "ONLYTHEN", "BUT")):
        return "stuck"
    others = words - {"NOT", "NO", "EVER", "AGAIN", "IT", "MORE"}
    if not silent or things or others or (group.has("IF") and not group.has("ONLY")):
        return None
    numbers = [*group.all("amount"), *(Amount(number) for number in group.all("numbered"))]
    if group.has("EPISODE"):
        return "episode" if not numbers else None
    if numbers:
        amount = numbers[0]
        fits = len(numbers) == 1 and amount.unit is None and amount.number == int(amount.number) and amount.number >= 1
        return int(amount.number) if fits else None
    if group.has("IF", "until", "UNTIL", "AFTER"):
        return None
    return "always"


def _ends(group: Group) -> bool:
    if group.has("FINISH"):
        return group.has("SESSION") and group.only("FINISH", "SESSION", "EVERYTHING", "BYE")
    if not group.only("STOP", "END", "BYE", "SESSION", "EVERYTHING", "MORE", "NO", "ANYPART", "part", "EPISODE"):
        return False
    if group.has("EPISODE"):
        return False
    return all(part.is_any for part in group.all("part"))


def _lifts_all(group: Group) -> bool:
    has = group.has
    lifting = clause_kinds("lifts")
    rest = clause_kinds("lifted")
    if any(not part.is_any for part in group.all("part")) or not group.only(*lifting, *rest):
        return False
    anything = has("EVERYTHING") or bool(group.all("part"))
    if has("RULE"):
        return has(*lifting) or (has("NOTHING") and has("MORE"))
    if has("AVOID"):
        return has("CANCEL", "UNDO", "NOLONGER", "STOP") and not has("NEAR")
    if anything and not group.negated and group.only(*rest):
        return (
            has("OK", "CAN", "PERMIT") and group.at("OK", "CAN", "PERMIT") >= 0 and not group.only("EVERYTHING")
        ) or (has("OK") and group.at("OK") > max(group.at("EVERYTHING"), group.at("part")) >= 0)
    return has("CANCEL") and anything and group.only("CANCEL", "EVERYTHING", "part", "LAST", "ANYPART")


def without_going_on(clauses: Sequence[Clause]) -> Iterator[Clause]:
    """The clauses, with "go on" as the learner's own choice where no command comes after it."""
    for clause, following, before in zip(clauses, (*clauses, None)[1:], (None, *clauses)[:-1], strict=True):
        if isinstance(clause, Quiet) and clause.until == "always" and isinstance(before, Quiet):
            continue  # "only ask when you are stuck, no questions else"
        if clause != GOES_ON:
            yield clause
        elif following is None or isinstance(following, Praise | Why | Stop | Undo) or following == NO_COMMAND:
            yield Own()


def listed(names: Sequence[str]) -> str:
    """Names with "or" before the last one."""
    return f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else "".join(names)
