"""What groups of words mean on a map: legs, objects to go to, around, and to keep away from; and which object is meant."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from lab.words.clauses import NO_COMMAND, Clause, Group, Said, common, without_going_on
from lab.words.meaning import ALL, CLEAR, WALL, Allow, Around, Avoid, Go, Intent, Leg, Stop, To
from lab.words.scene import Cell, GridScene, SceneObject
from lab.words.slots import Amount, Slot, Thing

MOST_STEPS = 1000
IT = Thing(("it",))  # the object that was named last
DIAGONALS = {
    "northwest": ("forward", "left"), "northeast": ("forward", "right"),
    "southwest": ("back", "left"), "southeast": ("back", "right"),
}  # fmt: skip
VERBS = ("GO", "MOVE", "GOON", "CAN", "NO", "MORE", "UPTO", "WAY")


class Misfit(Exception):
    """A clause that means nothing here: other ways to put the sentence together count."""


class Unclear(Exception):
    """A clause that is refused; the message is the reason, in one line."""


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
    redundant = float(sum(len(thing.ids) == 1 and bool(thing.posts) or bool(thing.posts and thing.adjectives) for thing in group.all("thing")))
    if (way := _around(group)) is not None:
        yield redundant, way
    if _goes_to(group):
        redundant += any(not thing.ids for thing in group.all("thing")) and not group.has("TO")
        yield redundant, Said("to", (_thing(group),))
    if group.all("thing") and group.only("thing", "NO") and len(group.all("thing")) == 1 and not group.has("NO"):
        yield 1.0, Said("also", (_thing(group),))
    untils = [_until(items) for items in group.all("until")] if group.has("GO", "MOVE", "GOON") and group.only("GO", "MOVE", "until", "GOON", "CAN") else []
    if untils and untils[0] and untils[0][0] == "object":
        yield 0.0, Said("to", (untils[0][1],))
    yield from _legs(group)
    if (reason := _reason(group)) is not None:
        yield 1.0, reason
    if group.has("TURNAROUND") and not group.all("thing"):
        yield 0.0, Said("unclear", ("turning around is no move here",))


def _thing(group: Group) -> Thing:
    """The only object that a group names, else what was named last."""
    things = group.all("thing")
    return things[0] if len(things) == 1 else IT


# ---- rules -----------------------------------------------------------------------------------------------------------------

RULES = (
    "thing", "AVOID", "NEAR", "HIT", "NEXTTO", "GO", "MOVE", "NOT", "NO", "NEVER", "NOLONGER", "NOTHING", "STOP", "OFFLIMITS", "BERTH",
    "GIVES", "ALONE", "CAN", "PERMIT", "CANCEL", "RULE", "UNDO", "FROM", "VISIT", "ANYMORE", "MORE", "TOO", "HARMLESS", "EVERYTHING",
    "KEEP", "LAST", "FARTHEST", "NEAREST", "BETWEEN", "WAY", "FREE", "SOMETHING", "OVER", "CROSSED", "INFRONT", "DANGER", "AROUND", "END", "EACH",
)  # fmt: skip


def _rule(group: Group) -> Said | None:
    """A rule to keep away from an object, or its end; None if a group says neither."""
    has = group.has
    if not group.only(*RULES) or len(group.all("thing")) > 1:
        return None
    if has("CAN", "PERMIT") and has("EVERYTHING") and not group.all("thing") and not group.negated:
        return Said("allow", (ALL,)) if group.only("CAN", "PERMIT", "EVERYTHING", "GO", "MOVE", "NEAR", "VISIT") else None
    if has("EVERYTHING", "SOMETHING") and not group.all("thing"):
        return None
    thing = _thing(group)
    lifted = has("CANCEL", "UNDO", "HARMLESS", "PERMIT", "NOLONGER", "STOP", "END") or (has("NOT") and has("ANYMORE"))
    gives = has("BERTH") and (has("GIVES", "KEEP") or not group.negated)
    near = has("NEAR", "HIT", "NEXTTO", "VISIT") or (has("GO", "FROM") and has("CROSSED", "OVER"))
    if has("RULE"):
        return Said("allow", (thing,)) if lifted and group.all("thing") else None
    if has("AVOID", "OFFLIMITS") or (has("ALONE") and has("GIVES", "KEEP")) or (gives and not near):
        if lifted or has("NOT", "NO") and not has("NEAR", "HIT"):
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
    if lifts and group.only("thing", "NOT", "NOLONGER", "DANGER", "ANYMORE", "PERMIT", "HARMLESS", "NEAR", "CAN", "MORE", "EVERYTHING"):
        return Said("allow", (thing,))
    return None


def _reason(group: Group) -> Said | None:
    """What is said about an object and commands nothing."""
    if not group.has("DANGER", "HARMLESS", "INWAY", "INFRONT", "AHEADOF", "TOO", "BECAUSE", "BEHIND", "OK"):
        return None
    listed = ("WAS", "thing", "DANGER", "HARMLESS", "INWAY", "INFRONT", "AHEADOF", "TOO", "LEVEL", "BEHIND", "SOMETHING", "MORE", "LAST", "BECAUSE")
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
    listed = ("AROUND", "PASS", "PAST", "thing", "dir", "side", "GO", "MOVE", "KEEP", "WAY", "INWAY", "SIDE", "FROM", "OVER", "UNDER", "BEHIND", "FREE", "NO", "ALLWAY", "BERTH", "TURN", "TURNAROUND")
    if group.has("IS") or not group.only(*listed) or len(group.all("thing")) > 1 or not (group.all("thing") or group.has("IT", "ITS")):
        return None
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
    if not group.only("thing", "GO", "MOVE", "NEXTTO", "VISIT", "NEAR", "HIT", "NEXTSTOP", "UPTO", "WAY", "ALLWAY", "INFRONT", "LAST", "GOON", "BACK", "dir", "KEEP", "UNTIL", "FROM", "STOP"):
        return False
    if set(group.all("dir")) - {"back"} or len(group.all("thing")) > 1:
        return False
    if group.has("KEEP", "STOP") and not group.has("GO", "MOVE", "NEXTTO"):
        return False
    if group.all("until"):
        return False
    if not group.all("thing"):
        return group.has("IT") and group.has("GO", "VISIT", "NEAR") and group.only("GO", "VISIT", "NEAR", "NEXTTO", "BACK", "UPTO") and not group.all("dir")
    going = group.has("GO", "VISIT", "NEAR", "HIT", "NEXTSTOP", "NEXTTO", "GOON")
    return going or group.has("TO", "UPTO", "UNTIL")


# ---- legs ------------------------------------------------------------------------------------------------------------------


def _legs(group: Group) -> Iterator[tuple[float, Clause]]:
    """The legs that a group says: one, or one for each direction with the same amount."""
    listed = (
        *VERBS, "dir", "side", "amount", "until", "TURN", "WALL", "TOP", "BOTTOM", "ALLWAY", "ASHIGH", "ASLOW", "thing", "PAST", "PASS",
        "HIT", "NEXTTO", "NEAR", "VISIT", "EACH", "DIAGONAL", "FARTHEST", "SIDE", "BLOCKED", "INFRONT", "FREE", "OVER", "STOP",
    )  # fmt: skip
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
    if group.has("NO") and (group.at("NO") > 0 or group.at("amount") == 1):
        return
    cost = 1.0 if group.at("GO", "MOVE") > max(0, group.at("dir")) else 0.0
    if group.has("side") and not group.has("amount", "until", "WALL", "ALLWAY"):
        return
    if group.has("TURN") and 0 <= group.at("TURN") < group.at("GO", "MOVE"):
        return
    if len(ways) == 1 and ways[0] in DIAGONALS or len(ways) > 1 and group.has("EACH", "DIAGONAL"):
        if group.only(*VERBS, "dir", "side", "amount", "EACH", "DIAGONAL"):
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
    limits = (group.has("SIDE") and group.has("FARTHEST")) or group.has("WALL", "TOP", "BOTTOM", "ALLWAY", "ASHIGH", "ASLOW", "BLOCKED")
    amounts, untils, things = group.all("amount"), group.all("until"), group.all("thing")
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
            return Stretch(way, turns, None, CLEAR, things[0]) if 0 <= group.at("dir") < group.at("PAST", "PASS") else None
        if not group.has("TO", "UPTO", "HIT", "NEXTTO", "NEAR", "VISIT", "INFRONT"):
            return None
        in_order = group.at("dir") < group.at("TO", "UPTO", "HIT", "NEXTTO", "NEAR", "VISIT", "INFRONT") < group.at("thing")
        return Stretch(way, turns, None, "object", things[0]) if in_order else None
    if group.has("PAST", "PASS"):
        return Stretch(way, turns, None, CLEAR, IT) if group.has("IT") else None
    if limits:
        return Stretch(way, turns, None, WALL)
    if group.has("HIT", "NEXTTO", "NEAR", "VISIT", "UPTO"):
        return None
    return Stretch(way, turns, Amount(1.0))


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
    if (thing is not None or "IT" in words and words & {"HIT", "NEXTTO", "NEAR"}) and not negated and not ways:
        return "object", thing or IT, ""
    if "HIT" in words and not negated and not ways:
        return WALL, None, ""
    return None


# ---- what is referred to -------------------------------------------------------------------------------------------------


class MapReferents:
    """Turns the clauses of a sentence into intents on a map; it remembers what was named last."""

    def __init__(self, scene: GridScene) -> None:
        self.scene = scene
        self._thing: SceneObject | None = None
        self._unit: float | None = None

    def intents(self, clauses: Sequence[Clause]) -> tuple[Intent, ...]:
        """The intents of the clauses, in order. Raises Unclear or Misfit."""
        found: list[Intent] = []
        for clause in without_going_on(clauses):
            if isinstance(clause, Said) and clause.rule in ("avoid", "allow"):
                found += [intent for intent in self._rules(clause) if intent not in found[-1:]]
                continue
            intent = self._intent(clause, found) if isinstance(clause, Said) else clause
            if intent is None or (found and found[-1] == intent and not isinstance(intent, Go)):
                continue
            if isinstance(intent, Go) and found and isinstance(found[-1], Go):
                intent = Go((*found.pop().legs, *intent.legs))  # type: ignore[union-attr]
            found.append(intent)
        if not found:
            raise Misfit
        for intent in found:
            if isinstance(intent, Go):
                _check_clear(intent.legs)
        return tuple(found)

    def _intent(self, clause: Said, before: Sequence[Intent]) -> Intent | None:
        values = clause.values
        match clause.rule:
            case "unclear":
                raise Unclear(str(values[0]))
            case "reason":
                if values:
                    self._object(values[0])
                return None
            case "stay":
                if not before or not isinstance(before[-1], Go | To | Around):
                    raise Misfit
                return None
            case "stop":
                has_moved = bool(before) and isinstance(before[-1], Go | To | Around)
                return None if has_moved and values[0] else Stop()
            case "go":
                return Go(tuple(self._leg(stretch) for stretch in values))
            case "to":
                return To(self._object(values[0]).id)
            case "around":
                thing = self._object(values[0])
                return Around(thing.id, None if values[1] is None else self._action(values[1]))
            case "also":  # "keep away from the toaster and the left cube"
                if not before or not isinstance(before[-1], To | Around | Avoid | Allow):
                    raise Misfit
                id_ = self._object(values[0]).id
                return Around(id_, before[-1].side) if isinstance(before[-1], Around) else type(before[-1])(id_)
        raise AssertionError(clause)

    def _rules(self, clause: Said) -> list[Intent]:
        """The rules that a clause makes or ends: one, or one for each of "the cubes"."""
        made = Avoid if clause.rule == "avoid" else Allow
        thing = clause.values[0]
        if thing == ALL:
            return [Allow(ALL)]
        if thing.is_plural and len(thing.ids) > 1 and not thing.adjectives and not thing.posts:
            return [made(id_) for id_ in thing.ids]
        return [made(self._object(thing).id)]

    def _action(self, way: str, turns: bool = False) -> str:
        """The action of a direction. Raises Unclear if there is none."""
        scene = self.scene
        if turns:
            action = f"turn {'left' if way in ('left', 'ccw') else 'right'}"
            if action not in scene.actions:
                raise Unclear(f"it cannot turn here: say {_listed(scene.actions)}")
            return action
        if way in ("higher", "lower") and not scene.has_height:
            raise Unclear("there is no height here: say forward or backward")
        flat = {"up": "forward", "down": "backward"}
        action = {"back": "backward", "reverse": "backward", "higher": "up", "lower": "down"}.get(way, way)
        if action in flat and not scene.has_height and flat[action] in scene.actions:
            action = flat[action]
        if action not in scene.actions:  # some maps call them up and down
            action = {"forward": "up", "backward": "down"}.get(action, action)
        if action not in scene.actions:
            raise Unclear(f"there is no action '{action}' here: say {_listed(scene.actions)}")
        return action

    def _leg(self, stretch: Stretch) -> Leg:
        direction = self._action(stretch.way, stretch.turns)
        until, past = stretch.until, ""
        towards = self._action(stretch.towards) if stretch.towards else ""
        if stretch.thing is not None:
            if until == CLEAR and stretch.thing == IT and self._thing is None:
                return Leg(direction, None, CLEAR, towards)
            thing = self._object(stretch.thing)
            until, past = (CLEAR, thing.id) if until == CLEAR else (thing.id, "")
        if until:
            return Leg(direction, None, until, towards, past)
        assert stretch.amount is not None
        return Leg(direction, self._steps(stretch.amount))

    def _steps(self, amount: Amount) -> int:
        """The number of steps of an amount; a bare number after a length may be one of the same unit."""
        number = amount.number
        if amount.unit is not None:
            self._unit = amount.unit
            return self._whole(number, self.scene.cell_cm, f"{number:g} cm")
        if amount.is_bare and self._unit is not None and self.scene.cell_cm:
            cells = number * self._unit / self.scene.cell_cm
            fits_length = cells == int(cells) and 1 <= cells <= self.scene.extent
            fits_steps = number == int(number) and 1 <= number <= self.scene.extent
            if fits_length and fits_steps and cells != number:
                raise Unclear(f"{number:g} may be steps or a length: say which")
            if fits_length:
                return int(cells)
        return self._whole(number, 1.0, f"{number:g} steps")

    def _whole(self, number: float, cell_cm: float | None, said: str) -> int:
        if not cell_cm:
            raise Unclear(f"{said}: the size of a step is unknown here, say a number of steps")
        cells = round(number / cell_cm, 6)
        if cells != int(cells) or not 1 <= cells <= MOST_STEPS:
            unit = "" if "steps" in said else f" of {cell_cm:g} cm"
            raise Unclear(f"{said}: wanted a whole number of steps{unit}, from 1 to {MOST_STEPS}")
        return int(cells)

    # objects

    def _object(self, thing: Thing) -> SceneObject:
        """The object that is meant; it is the one that was named last from now on. Raises Unclear if several fit."""
        if thing == IT:
            if self._thing is None:
                raise Unclear("'it' is no object that was named: name it")
            return self._thing
        ids = thing.ids or self._alike()
        objects = [self.scene.object(id_) for id_ in ids]
        every = objects
        for adjective in thing.adjectives:
            objects = self._fitting(objects, adjective)
        for post in thing.posts:
            there = self._fitting(every, post)
            objects = [thing for thing in objects if thing in there]
            if not objects:
                raise Misfit
        if len(objects) != 1:
            names = _listed([f"the {word} {objects[0].names[0] if objects else 'object'}" for word in ("left", "nearest")])
            raise Unclear(f"{len(objects)} objects fit: say which, such as {names}")
        self._thing = objects[0]
        return objects[0]

    def _alike(self) -> tuple[str, ...]:
        """The objects that "one" may mean: those of the only name that several have."""
        names = {name for thing in self.scene.objects for name in thing.names}
        groups = {tuple(o.id for o in self.scene.objects if name in o.names) for name in names}
        several = [ids for ids in groups if len(ids) > 1]
        if len(several) != 1:
            raise Misfit
        return several[0]

    def _fitting(self, objects: Sequence[SceneObject], adjective: Any) -> list[SceneObject]:
        if len(objects) < 2:
            return list(objects)
        robot = self.scene.robot
        if isinstance(adjective, tuple):
            there = MapReferents(self.scene)._object(adjective[1])
            objects = [thing for thing in objects if thing.id != there.id]
            return _least(objects, lambda thing: min(_steps_between(a, b) for a in thing.cells for b in there.cells))
        if adjective in ("near", "far", "ahead") and robot is None:
            raise Unclear("where the robot is cannot be seen here: say which object in another way")
        if adjective == "ahead":
            assert robot is not None
            ahead = [thing for thing in objects if any(c == robot[1] and r < robot[0] for r, c in thing.cells)]
            return _least(
                ahead, lambda thing: min(robot[0] - r for r, c in thing.cells if c == robot[1] and r < robot[0])
            )
        keys: dict[str, Callable[[SceneObject], float]] = {
            "left": lambda thing: _middle(thing, 1),
            "right": lambda thing: -_middle(thing, 1),
            "up": lambda thing: _middle(thing, 0),
            "down": lambda thing: -_middle(thing, 0),
            "near": lambda thing: min(_steps_between(robot or (0, 0), cell) for cell in thing.cells),
            "far": lambda thing: -min(_steps_between(robot or (0, 0), cell) for cell in thing.cells),
            "big": lambda thing: -len(thing.cells),
            "small": lambda thing: len(thing.cells),
        }
        return _least(objects, keys[adjective])


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else "".join(names)


def _check_clear(legs: Sequence[Leg]) -> None:
    """Raises Unclear if a leg ends where another direction gets free than that of the next leg."""
    for leg, following in zip(legs, (*legs[1:], None), strict=True):
        if leg.until == CLEAR and leg.towards and following is not None and leg.towards != following.direction:
            raise Unclear(f"the way {leg.towards} gets free, but then it goes {following.direction}: say one of them")


def _least(objects: Sequence[SceneObject], key: Callable[[SceneObject], float]) -> list[SceneObject]:
    least = min(map(key, objects), default=0.0)
    return [thing for thing in objects if key(thing) == least]


def _middle(thing: SceneObject, axis: int) -> float:
    return sum(cell[axis] for cell in thing.cells) / len(thing.cells)


def _steps_between(first: Cell, second: Cell) -> int:
    return abs(first[0] - second[0]) + abs(first[1] - second[1])
