"""What clauses about a map refer to in their scene: objects, actions, and numbers of steps."""

from collections.abc import Callable, Sequence
from typing import Any

from lab.words.clauses import Clause, Misfit, Said, Unclear, listed, without_going_on
from lab.words.meaning import ALL, CLEAR, Allow, Around, Avoid, Go, Intent, Leg, Stop, To
from lab.words.on_map import IT, Stretch
from lab.words.scene import Cell, GridScene, SceneObject
from lab.words.slots import Amount, Thing

MOST_STEPS = 1000


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
                raise Unclear(f"it cannot turn here: say {listed(scene.actions)}")
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
            raise Unclear(f"there is no action '{action}' here: say {listed(scene.actions)}")
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
            names = listed(
                [f"the {word} {objects[0].names[0] if objects else 'object'}" for word in ("left", "nearest")]
            )
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
