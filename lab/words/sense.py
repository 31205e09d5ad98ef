"""The meaning of each rule of the grammar, and of what a sentence refers to in its scene.

Derivations of a sentence are first turned into phrases, which stand for what was said, and then into intents: "it" is the object
that was named last, "the left cube" the one that is furthest left in the picture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from lab.words.meaning import (
    ALL,
    CLEAR,
    WALL,
    Again,
    Allow,
    Around,
    Avoid,
    Before,
    Finish,
    Go,
    Intent,
    Leg,
    Move,
    Never,
    Opposite,
    Own,
    Praise,
    Quiet,
    Stop,
    To,
    Undo,
    Why,
    Work,
)  # fmt: skip
from lab.words.scene import Cell, GridScene, OrderScene, Scene, SceneObject

MOST_STEPS = 1000


class Misfit(Exception):
    """A derivation that means nothing: other derivations of the sentence count."""


class Unclear(Exception):
    """A reading that is refused; its message is the reason, in one line."""


class Unresolved(Unclear):
    """A reading that refers to something that is not there: any other reading is better."""


@dataclass(frozen=True)
class Thing:
    """An object as it is named: the ids that its noun fits, adjectives; no ids: "it"."""

    ids: tuple[str, ...] = ()
    adjectives: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Post:
    """A place that is named after an object, as in "the cube on the left"."""

    place: Any


@dataclass(frozen=True)
class Amount:
    """A number of steps or a length: the number, and the length in cm of its unit (None: steps, or left out: is_bare)."""

    number: float
    unit: float | None = None
    is_bare: bool = False


@dataclass(frozen=True)
class Part:
    """A part as it is named: the parts that fit; is_any: any part at all; none: "it"."""

    parts: tuple[str, ...] = ()
    is_any: bool = False


WITHOUT = "without"  # a station that is left out
THERE = "there"  # the station that was named last


@dataclass(frozen=True)
class Said:
    """A clause before what it refers to is looked up: the rule's name and its values."""

    rule: str
    values: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Stretch:
    """A leg before its object and its number are looked up."""

    direction: str
    amount: Amount | None = None
    until: str = ""
    thing: Thing | None = None
    towards: str = ""


# ---- rules to phrases ----------------------------------------------------------------------------------------------------

DIRECTIONS = {"d_left": "left", "d_right": "right", "d_forward": "forward", "d_back": "backward"}
SIMPLE: dict[str, Intent] = {
    "good": Praise(1), "bad": Praise(-1), "again": Again(), "undo": Undo(), "own": Own(), "why": Why(),
    "quiet_stuck": Quiet("stuck"), "quiet_episode": Quiet("episode"), "quiet_always": Quiet("always"),
    "allow_all": Allow(ALL), "rules_off": Allow(ALL),
}  # fmt: skip
ADJECTIVES = ("left", "right", "up", "down", "near", "far", "big", "small", "ahead")
NOT_ON_THIS_MAP = "there is no height here: say forward or backward"


class Senses:
    """The value of each rule in a scene; `of` applies one, and raises Misfit or Unclear."""

    def __init__(self, scene: Scene, names: dict[str, object]) -> None:
        self.scene, self.names = scene, names
        self.actions = scene.actions if isinstance(scene, GridScene) else ()

    def of(self, rule: str, values: tuple[Any, ...]) -> Any:
        """The value of a rule with the values of its parts."""
        if rule in SIMPLE:
            return SIMPLE[rule]
        if rule.startswith("a_") and not values and rule[2:] in ADJECTIVES:
            return rule[2:]
        if rule.startswith("d_"):
            return self._direction(rule, values)
        method: Callable[..., Any] | None = getattr(self, f"_{rule}", None)
        return Said(rule, values) if method is None else method(*values)

    def token(self, kind: str, text: str) -> tuple[Any, ...]:
        """The value of a word that has one, as a tuple of it; () for all others."""
        if kind == "NUM":
            return (float(text),)
        if kind == "LENGTH":
            number, unit = text.split("cm")
            return (Amount(float(number), float(unit)),)
        if kind in ("ACT", "ACTKIND") and isinstance(self.names[text], tuple):
            return (self.names[text][kind == "ACTKIND"],)  # type: ignore[index]
        return (self.names[text],) if kind in ("NAME", "PART", "KIND", "STATION", "ACT") else ()

    # directions and amounts

    def _direction(self, rule: str, values: tuple[Any, ...]) -> str:
        if rule == "d_same":
            return str(values[0])
        has_height = isinstance(self.scene, GridScene) and self.scene.has_height
        if rule in ("d_higher", "d_lower"):
            if not has_height:
                raise Unclear(NOT_ON_THIS_MAP)
            direction = "up" if rule == "d_higher" else "down"
        elif rule in ("d_up", "d_down"):
            picture = "forward" if rule == "d_up" else "backward"
            direction = rule[2:] if has_height or picture not in self.actions else picture
        else:
            direction = DIRECTIONS[rule]
            if direction not in self.actions:  # some maps call them up and down
                direction = {"forward": "up", "backward": "down"}.get(direction, direction)
        return self._action(direction)

    def _action(self, name: str) -> str:
        if name not in self.actions:
            raise Unclear(f"there is no action '{name}' here: say {_listed(self.actions)}")
        return name

    def _dir(self, direction: str) -> str:
        return direction

    def _turn_cw(self) -> str:
        return "right"

    def _turn_left_or_cw(self, *values: str) -> str:
        return self._turned("turn right" if values else "turn left")

    def _turn_right(self) -> str:
        return self._turned("turn right")

    def _turn_ccw(self) -> str:
        return self._turned("turn left")

    def _turned(self, action: str) -> str:
        if action not in self.actions:
            raise Unclear(f"it cannot turn here: say {_listed(self.actions)}")
        return action

    def _steps(self, number: float) -> Amount:
        return Amount(number, is_bare=True)

    def _steps_said(self, number: float) -> Amount:
        return Amount(number)

    def _steps_one(self) -> Amount:
        return Amount(1)

    def _length(self, amount: Amount) -> Amount:
        return amount

    def _degrees(self, number: float) -> Amount:
        raise Unclear(f"{number:g} degrees: angles are not understood, say a number of steps")

    # legs

    def _leg_one(self, direction: str) -> tuple[Stretch, ...]:
        return (Stretch(direction, Amount(1)),)

    _leg_one_d = _leg_one

    def _leg_steps(self, direction: str, amount: Amount) -> tuple[Stretch, ...]:
        return (Stretch(direction, amount),)

    def _leg_steps_before(self, amount: Amount, direction: str) -> tuple[Stretch, ...]:
        return (Stretch(direction, amount),)

    def _leg_until(self, direction: str, until: Stretch) -> tuple[Stretch, ...]:
        return (replace(until, direction=direction),)

    def _leg_until_before(self, until: Stretch, direction: str) -> tuple[Stretch, ...]:
        return (replace(until, direction=direction),)

    def _leg_turn(self, amount: Amount, *values: str) -> tuple[Stretch, ...]:
        return (Stretch(self._turned("turn right" if values else "turn left"), amount),)

    def _leg_turn_right(self, amount: Amount) -> tuple[Stretch, ...]:
        return (Stretch(self._turned("turn right"), amount),)

    def _leg_wall_until(self, direction: str, until: Stretch) -> tuple[Stretch, ...]:
        return (replace(until, direction=direction),)

    def _leg_wall(self, direction: str) -> tuple[Stretch, ...]:
        return (Stretch(direction, until=WALL),)

    def _leg_wall_d(self, direction: str) -> tuple[Stretch, ...]:
        return self._leg_wall(direction)

    def _leg_wall_same(self, direction: str, edge: str) -> tuple[Stretch, ...]:
        if direction != edge:
            raise Unclear(f"{direction} does not lead to the {edge} edge")
        return self._leg_wall(direction)

    def _leg_far_wall(self) -> tuple[Stretch, ...]:
        return self._leg_wall(self._direction("d_forward", ()))

    def _leg_topmost(self, *values: str) -> tuple[Stretch, ...]:
        return self._leg_wall_same(values[0] if values else self._direction("d_up", ()), self._direction("d_up", ()))

    def _leg_bottommost(self, *values: str) -> tuple[Stretch, ...]:
        return self._leg_wall_same(
            values[0] if values else self._direction("d_down", ()), self._direction("d_down", ())
        )

    def _leg_top(self) -> tuple[Stretch, ...]:
        return self._leg_wall(self._direction("d_higher", ()))

    def _leg_deep(self) -> tuple[Stretch, ...]:
        return self._leg_wall(self._direction("d_lower", ()))

    def _until_wall(self, edge: str = "") -> Stretch:
        return Stretch("", until=WALL, towards="")

    def _until_object(self, thing: Thing) -> Stretch:
        return Stretch("", until="object", thing=thing)

    def _until_past(self, thing: Thing) -> Stretch:
        return Stretch("", until=CLEAR, thing=thing)

    def _until_past_it(self) -> Stretch:
        return Stretch("", until=CLEAR)

    def _until_clear(self, direction: str = "") -> Stretch:
        return Stretch("", until=CLEAR, towards=direction)

    def _run_after(self, *values: Any) -> tuple[Stretch, ...]:
        return tuple(Stretch(d, Amount(n, is_bare=True)) for d, n in zip(values[::2], values[1::2], strict=True))

    def _run_before(self, *values: Any) -> tuple[Stretch, ...]:
        return tuple(Stretch(d, Amount(n, is_bare=True)) for n, d in zip(values[::2], values[1::2], strict=True))

    def _run_ones(self, *values: str) -> tuple[Stretch, ...]:
        return tuple(Stretch(d, Amount(1)) for d in values)

    def _go(self, legs: tuple[Stretch, ...]) -> Said:
        return Said("go", legs)

    def _go_each(self, *values: Any) -> Said:
        return Said("go", tuple(Stretch(d, values[-1]) for d in values[:-1]))

    def _go_each_after(self, *values: Any) -> Said:
        return Said("go", tuple(Stretch(d, values[0]) for d in values[1:]))

    def _go_each_one(self, *values: str) -> Said:
        return Said("go", self._run_ones(*values))

    # objects

    def _same(self, value: Any) -> Any:
        return value

    def _no_opposite(self, *values: Any) -> Intent:
        return Opposite()

    def _named(self, ids: tuple[str, ...]) -> Thing:
        return Thing(ids)

    def _adjectives(self, *values: Any) -> tuple[Any, ...]:
        return values

    def _named_as(self, adjectives: tuple[Any, ...], ids: tuple[str, ...]) -> Thing:
        return Thing(ids, adjectives)

    def _named_post(self, ids: tuple[str, ...], post: Any) -> Thing:
        return Thing(ids, (Post(post),))

    def _named_both(self, adjectives: tuple[Any, ...], ids: tuple[str, ...], post: Any) -> Thing:
        return Thing(ids, (*adjectives, Post(post)))

    def _named_one(self, adjectives: tuple[Any, ...], number: float) -> Thing:
        if number != 1 or not isinstance(self.scene, GridScene):
            raise Misfit
        several = [ids for ids in self.names.values() if isinstance(ids, tuple) and len(ids) > 1]
        kinds = {frozenset(ids) for ids in several}
        names = {name for thing in self.scene.objects for name in thing.names}
        alike = {frozenset(o.id for o in self.scene.objects if name in o.names) for name in names}
        fitting = [ids for ids in kinds if ids in alike and len(ids) > 1]
        if len(fitting) != 1:
            raise Unresolved("'the one' may be any of several objects: name it")
        return Thing(tuple(sorted(fitting[0])), adjectives)

    def _a_beside(self, thing: Thing) -> Thing:
        return thing

    def _it(self) -> Thing:
        return Thing()

    def _to_object_then(self, thing: Thing) -> Said:
        return Said("to", (thing,))

    def _around_named(self, thing: Thing, side: str | None = None) -> Said:
        return Said("around", (thing, side))

    def _around(self, thing: Thing, side: str | None = None) -> Said:
        return Said("around", (thing, side))

    def _around_before(self, side: str, thing: Thing) -> Said:
        return Said("around", (thing, side))

    _around_before_d = _around_before

    def _around_over(self, thing: Thing) -> Said:
        return Said("around", (thing, self._direction("d_higher", ())))

    def _around_under(self, thing: Thing) -> Said:
        return Said("around", (thing, self._direction("d_lower", ())))

    def _around_behind(self, thing: Thing) -> Said:
        return Said("around", (thing, self._direction("d_forward", ())))

    def _avoid_bare(self, thing: Thing) -> Said:
        return Said("avoid", (thing,))

    def _avoid_it(self) -> Said:
        return Said("avoid", (Thing(),))

    def _allow_it(self) -> Said:
        return Said("allow", (Thing(),))

    def _reason(self, *values: Any) -> Said:
        return Said("reason")

    def _quiet_steps(self, number: float) -> Quiet:
        if number != int(number) or not 1 <= number <= MOST_STEPS:
            raise Unclear(f"{number:g} steps: wanted a whole number from 1 to {MOST_STEPS}")
        return Quiet(int(number))

    # the order

    def _part(self, part: str, *rest: Any) -> Part:
        return Part((part,))

    def _part_kind(self, *values: Any) -> Part:
        if any(isinstance(value, float) and value != 1 for value in values):
            raise Misfit
        return Part(values[-1], is_any=True)

    def _part_any(self, *values: Any) -> Part:
        return Part(self.scene.parts if isinstance(self.scene, OrderScene) else (), is_any=True)

    _any_part = _part_any

    def _part_it(self, *values: Any) -> Part:
        return Part()

    def _station(self, station: str) -> str:
        return station

    def _station_there(self) -> str:
        return THERE

    _from_station = _station

    def _order_first(self, said: Any) -> Any:
        return said

    def _move(self, said: Any) -> Any:
        return said

    def _move_station(self, said: Any) -> Any:
        return said

    def _move_to(self, part: Part, *stations: str) -> Said:
        named = [station for station in stations if station != WITHOUT]
        return Said("move", (part, named[0] if len(named) > 1 else None, named[-1]))

    def _without(self, station: str) -> str:
        return WITHOUT

    def _move_from_to(self, part: Part, origin: str, target: str, *rest: str) -> Said:
        return Said("move", (part, origin, target))

    def _move_stations(self, origin: str, target: str, part: Part | None = None) -> Said:
        every = Part(self.scene.parts if isinstance(self.scene, OrderScene) else (), is_any=True)
        return Said("move", (part or every, origin, target))

    def _move_station_first(self, station: str, part: Part) -> Said:
        return Said("move", (part, None, station))

    def _move_part(self, part: Part, *rest: str) -> Said:
        return Said("move", (part, None, None))

    def _move_part_from(self, part: Part, origin: str, *rest: str) -> Said:
        return Said("move", (part, origin, None))

    def _move_act(self, station: str, part: Part, *rest: str) -> Said:
        return Said("move", (part, None, station))

    def _move_act_after(self, part: Part, station: str, *rest: str) -> Said:
        return Said("move", (part, None, station))

    def _never(self, part: Part, station: str) -> Said:
        return Said("never", (part, station))

    _never_in = _never_any = _never_no = _never

    def _never_waiting(self, *values: Any) -> Said:
        part = values[0] if len(values) > 1 else Part((), is_any=True)
        return Said("never", (part, values[-1]))

    def _never_station_first(self, station: str, part: Part) -> Said:
        return Said("never", (part, station))

    _never_station_first_any = _never_station_first_part = _never_station_first

    def _never_there(self, part: Part) -> Said:
        return Said("never", (part, THERE))

    def _work_part(self, part: Part) -> Said:
        return Said("work", (part, None))

    def _work_station(self, *values: str) -> Said:
        return Said("work", (None, values[0]))

    def _work_station_only(self, station: str) -> Said:
        return Said("work", (None, station))

    def _work_station_kind(self, station: str, kind: Any) -> Said:
        return Said("work", (None, station))

    def _work_both(self, station: str, part: Part) -> Said:
        return Said("work", (part, station))

    _work_both_station = _work_both

    def _work_both_after(self, part: Part, station: str) -> Said:
        return Said("work", (part, station))

    _work_to = _work_both_after

    def _after(self, later: Said, earlier: Said) -> Said:
        return Said("before", (earlier, later))

    def _grid(self, *values: Any) -> tuple[Any, ...]:
        return values

    _order = _grid


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else "".join(names)


# ---- phrases to intents ----------------------------------------------------------------------------------------------------


class Referents:
    """Turns the clauses of a sentence into intents; it remembers what was named last."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._thing: SceneObject | None = None
        self._part: str | None = None
        self._station: str | None = None
        self._unit: float | None = None
        self.redundant = 0  # the places that were named of objects that are the only ones of their kind

    def intents(self, clauses: Sequence[Any]) -> tuple[Intent, ...]:
        """The intents of the clauses, in order. Raises Unclear or Misfit."""
        found: list[Intent] = []
        for clause in clauses:
            intent = self._intent(clause, found)
            if intent is None:
                continue
            if isinstance(intent, Go) and found and isinstance(found[-1], Go):
                found[-1] = Go((*found[-1].legs, *intent.legs))
            elif not (found and found[-1] == intent):
                found.append(intent)
        if not found:
            raise Misfit
        for intent in found:
            if isinstance(intent, Go):
                _check_clear(intent.legs)
        return tuple(found)

    def _intent(self, clause: Any, before: Sequence[Intent]) -> Intent | None:
        if not isinstance(clause, Said):
            assert not isinstance(clause, tuple)
            return clause  # type: ignore[no-any-return]
        values = clause.values
        has_moved = bool(before) and isinstance(before[-1], Go | To | Around)
        match clause.rule:
            case "reason":
                return None
            case "reason_object":
                self._object(values[0])
                return None
            case "reason_part":
                self._parts(values[0])
                return None
            case "stop":
                return Stop()
            case "stop_bare" | "stop_there":
                if not has_moved and clause.rule == "stop_there":
                    raise Misfit
                return None if has_moved else Stop()
            case "go":
                return Go(tuple(self._leg(stretch) for stretch in values))
            case "to":
                return To(self._object(values[0]).id)
            case "around":
                return Around(self._object(values[0]).id, values[1])
            case "avoid":
                thing = self._object(values[0])
                if self.redundant:
                    raise Unresolved("say only which object to keep away from")
                return Avoid(thing.id)
            case "allow":
                return Allow(self._object(values[0]).id)
        return self._of_order(clause)

    # the map

    def _leg(self, stretch: Stretch) -> Leg:
        until = stretch.until
        towards = stretch.towards
        past = ""
        if stretch.thing is not None:
            thing = self._object(stretch.thing)
            if until == CLEAR:
                past = thing.id
            else:
                until = thing.id
        if until:
            return Leg(stretch.direction, None, until, towards, past)
        assert stretch.amount is not None
        return Leg(stretch.direction, self._steps(stretch.amount))

    def _steps(self, amount: Amount) -> int:
        """The number of steps of an amount; a bare number after a length may be one of the same unit."""
        assert isinstance(self.scene, GridScene)
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
            unit = "" if cell_cm == 1.0 and "steps" in said else f" of {cell_cm:g} cm"
            raise Unclear(f"{said}: wanted a whole number of steps{unit}, from 1 to {MOST_STEPS}")
        return int(cells)

    def _object(self, thing: Thing) -> SceneObject:
        """The object that is meant; it is the one that was named last from now on. Raises Unclear if several fit."""
        assert isinstance(self.scene, GridScene)
        if not thing.ids:
            if self._thing is None:
                raise Unresolved("'it' is no object that was named: name it")
            return self._thing
        objects = [self.scene.object(id_) for id_ in thing.ids]
        every = objects
        for adjective in thing.adjectives:
            if isinstance(adjective, Post):
                self.redundant += len(objects) == 1
                there = self._fitting(every, adjective.place)
                objects = [thing for thing in objects if thing in there]
                if not objects:
                    raise Misfit
            else:
                objects = self._fitting(objects, adjective)
        if len(objects) != 1:
            names = _listed(
                [f"the {word} {objects[0].names[0] if objects else 'object'}" for word in ("left", "nearest")]
            )
            raise Unclear(f"{len(objects)} objects fit: say which, such as {names}")
        self._thing = objects[0]
        return objects[0]

    def _fitting(self, objects: Sequence[SceneObject], adjective: Any) -> list[SceneObject]:
        if len(objects) < 2:
            return list(objects)
        robot = self.scene.robot if isinstance(self.scene, GridScene) else None
        if isinstance(adjective, Thing):
            there = Referents(self.scene)._object(adjective)
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

    # the order

    def _of_order(self, clause: Said) -> Intent:
        assert isinstance(self.scene, OrderScene), clause
        values = clause.values
        match clause.rule:
            case "move_number":
                numbers = {move.number for move in self.scene.moves}
                if values[0] not in numbers:
                    raise Unclear(f"{values[0]:g} is none of the moves: {_listed([str(n) for n in sorted(numbers)])}")
                return Move(int(values[0]))
            case "move":
                return self._move(*values)
            case "finish":
                return Finish(self._single(values[0]))
            case "never":
                part, station = values
                return Never(self._part_or_any(part), self._place(station))
            case "before":
                first, second = (self._work(work) for work in values)
                if first == second or Work() in (first, second):
                    raise Misfit
                if first.part and second.part and (first.station is None) != (second.station is None):
                    raise Unclear(f"say the station of both {first.part} and {second.part}, or of neither")
                return Before(first, second)
        raise AssertionError(clause)

    def _place(self, station: str) -> str:
        if station == THERE:
            if self._station is None:
                raise Unresolved("'there' is no station that was named: name it")
            return self._station
        self._station = station
        return station

    def _parts(self, part: Part) -> tuple[str, ...]:
        if not part.parts and not part.is_any:
            if self._part is None:
                raise Unresolved("'it' is no part that was named: name it")
            return (self._part,)
        if len(part.parts) == 1:
            self._part = part.parts[0]
        return part.parts

    def _single(self, part: Part) -> str:
        parts = self._parts(part)
        if len(parts) != 1:
            raise Unclear(f"several parts fit: say which of {_listed(parts)}")
        return parts[0]

    def _part_or_any(self, part: Part | None) -> str | None:
        return None if part is None or part.is_any else self._single(part)

    def _move(self, part: Part, origin: str | None, target: str | None) -> Move:
        assert isinstance(self.scene, OrderScene)
        parts = self._parts(part)
        origin = None if origin is None else self._place(origin)
        target = None if target is None else self._place(target)
        fitting = [
            move for move in self.scene.moves
            if move.part in parts and origin in (None, move.origin) and target in (None, move.target)
        ]  # fmt: skip
        if len(fitting) != 1:
            among = fitting or [move for move in self.scene.moves if move.part in parts] or self.scene.moves
            known = _listed([f"{move.number} ({move.part}, {move.origin} to {move.target})" for move in among[:4]])
            said = "several moves fit" if fitting else "that is none of the moves now"
            raise Unresolved(f"{said}: {known}")
        self._part = fitting[0].part
        return Move(fitting[0].number)

    def _work(self, work: Said) -> Work:
        part, station = work.values
        return Work(self._part_or_any(part), None if station is None else self._place(station))


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
