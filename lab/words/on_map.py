"""What groups of words mean on a map: legs, objects to go to, around, and to keep away from; and which object is meant."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from lab.words.clauses import NO_COMMAND, Clause, Group, Said, common
from lab.words.meaning import ALL, CLEAR, WALL
from lab.words.slots import Amount, Thing
from lab.words.vocabulary import clause_kinds

IT = Thing(("it",))  # the object that was named last
DIAGONALS = {
    "northwest": ("forward", "left"),
    "northeast": ("forward", "right"),
    "southwest": ("back", "left"),
    "southeast": ("back", "right"),
}


@dataclass(frozen=True)
class Stretch:
    """A leg before its object and its number are looked up; the direction is a word of the grammar."""

    way: str
    turns: bool = False
    amount: Amount | None = None
    until: str = ""
    thing: Thing | None = None
    towards: str = ""


def meanings(group: Group) -> Iterator[tuple[float, Clause]]:
    """What a group means on a map, each with a cost."""
    yield from common(group)
    if group.has("unclear") and group.has("dir", "GO", "MOVE", "TURN"):
        yield 0.0, Said("unclear", tuple(group.all("unclear")))
    if (rule := _rule(group)) is not None:
        yield 0.0, rule
    if [slot.value for slot in group.slots] == ["end"]:
        yield 0.0, Said("stop", (False,))
    redundant = float(sum(_says_too_much(thing) for thing in group.all("thing")))
    if (way := _around(group)) is not None:
        yield redundant, way
    if _goes_to(group):
        redundant += any(not thing.ids for thing in group.all("thing")) and not group.has("TO")
        yield redundant, Said("to", (_thing(group),))
    if group.all("thing") and group.only("thing", "NO") and len(group.all("thing")) == 1 and not group.has("NO"):
        yield 1.0, Said("also", (_thing(group),))
    goes = group.has("GO", "MOVE", "GOON") and group.only("GO", "MOVE", "until", "GOON", "CAN")
    untils = [_until(items) for items in group.all("until")] if goes else []
    if untils and untils[0] and untils[0][0] == "object":
        yield 0.0, Said("to", (untils[0][1],))
    yield from _legs(group)
    if (reason := _reason(group)) is not None:
        yield 1.0, reason
    if group.has("TURNAROUND") and not group.all("thing"):
        yield 0.0, Said("unclear", ("turning around is no move here",))


def _says_too_much(thing: Thing) -> bool:
    """Whether a place is said of what is named already: it may be the side on which to pass it."""
    return bool(thing.posts) and (len(thing.ids) == 1 or bool(thing.adjectives))


def _thing(group: Group) -> Thing:
    """The only object that a group names, else what was named last."""
    things = group.all("thing")
    return things[0] if len(things) == 1 else IT


# ---- rules -----------------------------------------------------------------------------------------------------------------


def _rule(group: Group) -> Said | None:
    """A rule to keep away from an object, or its end; None if a group says neither."""
    has = group.has
    if not group.only(*clause_kinds("rule")) or len(group.all("thing")) > 1:
        return None
    if has("CAN", "PERMIT", "AGAIN") and has("EVERYTHING") and not group.all("thing") and not group.negated:
        return (
            Said("allow", (ALL,)) if group.only("CAN", "PERMIT", "EVERYTHING", "GO", "MOVE", "NEAR", "VISIT") else None
        )
    if has("EVERYTHING", "SOMETHING") and not group.all("thing"):
        return None
    thing = _thing(group)
    lifted = has("CANCEL", "UNDO", "HARMLESS", "PERMIT", "NOLONGER", "STOP", "END") or (has("NOT") and has("ANYMORE"))
    gives = has("BERTH") and (has("GIVES", "KEEP") or not group.negated)
    near = has("NEAR", "HIT", "NEXTTO", "VISIT") or (has("GO", "FROM") and has("CROSSED", "OVER"))
    if has("RULE"):
        return Said("allow", (thing,)) if lifted and group.all("thing") else None
    if has("AVOID", "OFFLIMITS") or (has("ALONE") and has("GIVES", "KEEP")) or (gives and not near):
        if lifted or (has("NOT", "NO") and not has("NEAR", "HIT")):
            return Said("allow", (thing,)) if lifted or has("NOT") or has("OFFLIMITS") else None
        return None if has("NEVER", "CAN", "NOTHING") and not near else Said("avoid", (thing,))
    if has("CANCEL"):
        return Said("allow", (thing,)) if group.all("thing") and group.only("CANCEL", "thing", "EVERYTHING") else None
    if near and has("NOT", "NO", "NEVER", "NOTHING", "NOLONGER"):
        return None if has("STOP", "CANCEL", "DANGER") else Said("avoid", (thing,))
    if (near or has("EVERYTHING")) and has("CAN", "PERMIT"):
        return Said("allow", (thing,))
    if has("CAN") and has("AGAIN") and has("GO") and group.all("thing"):
        return Said("allow", (thing,))
    if has("STOP") and near:
        return None
    if not group.all("thing"):
        return None
    after = group.at("OK", "CAN") > group.at("thing")
    lifts = (has("OK", "CAN") and after) or (has("NOT", "NOLONGER") and has("DANGER")) or has("PERMIT")
    if lifts and group.only(*clause_kinds("lift")):
        return Said("allow", (thing,))
    return None


def _reason(group: Group) -> Said | None:
    """What is said about an object and commands nothing."""
    if not group.has("DANGER", "HARMLESS", "INWAY", "INFRONT", "AHEADOF", "TOO", "BECAUSE", "BEHIND", "OK"):
        return None
    listed = clause_kinds("reason")
    if group.has("OK") and not group.content:
        return NO_COMMAND
    if group.only(*listed) and group.content and len(group.all("thing")) <= 1:
        return Said("reason", tuple(group.all("thing")))
    if group.has("TOO") and group.only("TOO", "LEVEL", "dir", "NEAR", "FARTHEST", "thing", "VAGUE"):
        return NO_COMMAND
    return None


# ---- ways to objects -------------------------------------------------------------------------------------------------------


PASSING = ("AROUND", "PASS", "PAST", "TURN", "TURNAROUND")


def _around(group: Group) -> Said | None:
    """A way past an object, with the word of its side."""
    listed = clause_kinds("around")
    if group.has("IS", "EVER") or not group.only(*listed) or len(group.all("thing")) > 1:
        return None
    if not group.all("thing") and not group.has("IT", "ITS"):
        return None
    if group.has("TURN") and not any("round" in str(text) for text in group.all("TURN")):
        return None  # "turn off the toaster"
    sides = [*group.all("dir"), *group.all("side")]
    vertical = ["higher"] * group.has("OVER") + ["lower"] * group.has("UNDER") + ["forward"] * group.has("BEHIND")
    if not group.has(*PASSING) and (not vertical or sides or not group.all("thing")):
        return None
    if group.has(*PASSING) and 0 <= group.at("dir") < group.at(*PASSING) and not group.has("AROUND"):
        return None  # "left past the cube" is a leg
    sides = list(dict.fromkeys([*sides, *vertical]))
    if len(sides) > 1:
        return None
    return Said("around", (_thing(group), sides[0] if sides else None))


def _goes_to(group: Group) -> bool:
    """Whether a group sends the robot to an object."""
    if group.has("IS") and not group.has("NEXTSTOP"):
        return False
    if not group.only(*clause_kinds("to")):
        return False
    up_to = group.at("UPTO")  # "right up to the toaster" may be a way to it, or a leg to the right
    dirs = [
        s.value for n, s in enumerate(group.slots) if s.kind == "dir" and not (s.value == "right" and n == up_to - 1)
    ]
    if set(dirs) - {"back"} or len(group.all("thing")) > 1:
        return False
    if group.has("KEEP", "STOP") and not group.has("GO", "MOVE", "NEXTTO"):
        return False
    if group.all("until") and not _repeats(group):
        return False
    if not group.all("thing"):  # "go there"
        goes = group.has("GO", "VISIT", "NEAR") and group.only("GO", "VISIT", "NEAR", "NEXTTO", "BACK", "UPTO")
        return group.has("IT") and goes and not group.all("dir")
    going = group.has("GO", "VISIT", "NEAR", "HIT", "NEXTSTOP", "NEXTTO", "GOON")
    return going or group.has("TO", "UPTO", "UNTIL")


# ---- legs ------------------------------------------------------------------------------------------------------------------


def _legs(group: Group) -> Iterator[tuple[float, Clause]]:
    """The legs that a group says: one, or one for each direction with the same amount."""
    listed = (
        *clause_kinds("moving"),
        *clause_kinds("leg"),
    )
    if group.has("IS") or not group.only(*listed) or len(group.all("amount")) > 1 or len(group.all("until")) > 1:
        return
    ways = [*group.all("dir"), *(group.all("side") if not group.has("dir") else ())]
    ways += ["higher"] * group.has("ASHIGH") + ["lower"] * group.has("ASLOW")
    if not ways and group.has("TOP", "BOTTOM"):
        ways = ["up" if group.has("TOP") else "down"]
    if ways and group.has("TOP", "BOTTOM") and ways[0] in ("left", "right"):
        return  # a corner
    if not ways and group.has("UPTO") and group.has("WALL"):
        ways = ["up"]
    if not ways and group.has("WALL", "SIDE") and group.has("FARTHEST"):
        ways = ["forward"]
    if any(text.startswith(("you", "last time")) for text in group.all("LAST")):
        return  # "you went left"
    if group.has("NO") and (group.at("NO") > 0 or group.at("amount") == 1):
        return
    cost = 1.0 if group.at("GO", "MOVE") > max(0, group.at("dir")) else 0.0
    if group.has("side") and not group.has("amount", "until", "WALL", "ALLWAY"):
        return
    if group.has("TURN") and 0 <= group.at("TURN") < group.at("GO", "MOVE"):
        return
    if (len(ways) == 1 and ways[0] in DIAGONALS) or (len(ways) > 1 and group.has("EACH", "DIAGONAL")):
        if group.only(*clause_kinds("moving"), "dir", "side", "amount", "EACH", "DIAGONAL"):
            each = [way for named in ways for way in DIAGONALS.get(named, (named,))]
            amount = (group.all("amount") or [Amount(1.0)])[0]
            yield cost, Said("go", tuple(Stretch(way, amount=amount) for way in each))
        return
    if len(ways) == 1 and not group.has("EACH", "DIAGONAL") and (leg := _leg(group, ways[0])) is not None:
        yield cost, Said("go", (leg,))


def _leg(group: Group, way: str) -> Stretch | None:
    turns = group.has("TURN") or way in ("cw", "ccw")
    if turns and way not in ("left", "right", "cw", "ccw"):
        return None
    limits = group.has("WALL", "TOP", "BOTTOM", "ALLWAY", "ASHIGH", "ASLOW", "BLOCKED")
    limits = limits or (group.has("SIDE") and group.has("FARTHEST"))  # "the far side"
    amounts, untils, things = group.all("amount"), group.all("until"), group.all("thing")
    untils = [] if _repeats(group) else untils
    if group.has("FREE", "STOP", "INFRONT", "SIDE", "FARTHEST") and not (limits or untils or things):
        return None
    if way == "reverse" and not (amounts or untils or limits):
        return None
    if amounts:
        if limits or untils or things or group.has("PAST", "PASS", "HIT", "NEXTTO", "NEAR", "VISIT"):
            return None
        return Stretch(way, turns, amounts[0])
    if untils:
        found = _until(untils[0])
        if things or found is None or group.has("PAST", "PASS"):
            return None
        until, thing, towards = found
        return Stretch(way, turns, None, until, thing, towards)
    if things:
        if len(things) > 1 or way == "back":
            return None
        if group.has("PAST", "PASS"):
            return (
                Stretch(way, turns, None, CLEAR, things[0]) if 0 <= group.at("dir") < group.at("PAST", "PASS") else None
            )
        if not group.has("TO", "UPTO", "HIT", "NEXTTO", "NEAR", "VISIT", "INFRONT"):
            return None
        in_order = (
            group.at("dir") < group.at("TO", "UPTO", "HIT", "NEXTTO", "NEAR", "VISIT", "INFRONT") < group.at("thing")
        )
        return Stretch(way, turns, None, "object", things[0]) if in_order else None
    if group.has("PAST", "PASS"):
        return Stretch(way, turns, None, CLEAR, IT) if group.has("IT") else None
    if limits:
        return Stretch(way, turns, None, WALL)
    if group.has("HIT", "NEXTTO", "NEAR", "VISIT", "UPTO"):
        return None
    return Stretch(way, turns, Amount(1.0))


def _repeats(group: Group) -> bool:
    """Whether a condition only says again where an object ends the way: "up to the cube until you are next to it"."""
    untils = [_until(items) for items in group.all("until")]
    return untils == [("object", IT, "")] and len(group.all("thing")) == 1 and group.at("thing") < group.at("until")


def _until(items: Sequence[Any]) -> tuple[str, Thing | None, str] | None:
    """What a condition waits for, the object of it, and the direction that gets free; None if it is not understood."""
    words = {item for item in items if isinstance(item, str)}
    things = [item[1] for item in items if isinstance(item, tuple) and item[0] == "thing"]
    ways = [item[1] for item in items if isinstance(item, tuple) and item[0] == "way"]
    negated = not words.isdisjoint(("NOT", "NO", "NOLONGER", "NOTHING", "NEVER"))
    thing = things[0] if things else None
    if len(things) > 1 or len(ways) > 1:
        return None
    towards = ways[0] if ways else ""
    blocking = not words.isdisjoint(("INWAY", "INFRONT", "AHEADOF"))
    if "PAST" in words or "PASS" in words or ("BEHIND" in words and not negated):
        return (CLEAR, thing or (IT if "IT" in words else None), "") if not negated and not ways else None
    if blocking and negated:
        return CLEAR, thing or IT, ""
    if "FREE" in words and not negated:
        return CLEAR, thing, towards
    if "SOMETHING" in words or (blocking and thing is None and "IT" not in words):
        return (WALL, None, "") if not negated or "BLOCKED" in words or "FREE" in words else None
    if negated and not things and not ways and words <= {"NOT", "NOLONGER", "ANYMORE", "CAN", "MORE"}:
        return WALL, None, ""
    if "BLOCKED" in words or "STUCK" in words:
        return (WALL, None, "") if thing is None else ("object", thing, "")
    if negated and ("FREE" in words or words & {"GO", "MOVE", "CAN", "WAY"}):
        return (WALL, None, "") if thing is None else None
    if words & {"WALL", "TOP", "BOTTOM"} and not negated:
        return (WALL, None, "") if thing is None else None
    if "CAN" in words and not negated and thing is None:
        return CLEAR, None, towards
    if (thing is not None or ("IT" in words and words & {"HIT", "NEXTTO", "NEAR"})) and not negated and not ways:
        return "object", thing or IT, ""
    if "HIT" in words and not negated and not ways:
        return WALL, None, ""
    return None
