"""Ways through a problem's table for what a sentence means: moves from a state, or a refusal in words.

A way enters no obstacle, no cell that is to be avoided, and the goal only as its end. It follows the table's own transitions.
"""

from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from lab.words.meaning import CLEAR, WALL, Again, Around, Go, Intent, Leg, Opposite, To
from lab.words.scene_map import SceneMap, Spot

OPPOSITES = {
    first: second
    for pair in (("left", "right"), ("forward", "backward"), ("up", "down"), ("turn left", "turn right"))
    for first, second in (pair, pair[::-1])
}
MOST_MOVES = 1000
Motion = Go | To | Around | Opposite | Again


class NoWay(Exception):
    """There is no way for what was said; the message says why, in one line."""


@dataclass(frozen=True)
class Before:
    """What was done before a sentence: the action that it may be against, and the moves that it may repeat, () for none."""

    action: int
    moves: tuple[int, ...] = ()


def way(
    intents: Sequence[Intent], known: SceneMap, state: int, before: Before, avoided: frozenset[int]
) -> tuple[int, ...]:
    """The moves from a state for what was said, one motion after the other; () if none of it is a motion. Raises NoWay.

    avoided: states that the way does not enter, unless it is in them already.
    """
    walk = _Walk(known, state, avoided)
    for intent in intents:
        match intent:
            case Go(legs):
                for leg, following in zip(legs, (*legs[1:], None), strict=True):
                    walk.leg(leg, following)
            case To(id_):
                walk.to(id_)
            case Around(id_, side):
                walk.around(id_, side)
            case Opposite():
                walk.opposite(before.action)
            case Again():
                walk.again(before.moves)
    if not walk.moves and any(isinstance(intent, Motion) for intent in intents):
        raise NoWay("that is where it is already")
    return tuple(walk.moves)


class _Walk:
    """A way that grows: its moves, and the state to which they lead."""

    def __init__(self, known: SceneMap, state: int, avoided: frozenset[int]) -> None:
        self.known, self.state, self.avoided = known, state, avoided
        self.moves: list[int] = []

    def _action(self, name: str) -> int:
        if name not in self.known.actions:
            raise NoWay(f"there is no action '{name}' here")
        return self.known.actions.index(name)

    def _free(self, state: int, action: int) -> int | None:
        """The state that a move leads to, None if it leads nowhere, into an obstacle or where it must not."""
        entered = int(self.known.mdp.successor[state, action])
        if entered == state or self.known.closed[entered]:
            return None
        return None if entered in self.avoided and state not in self.avoided else entered

    def _step(self, action: int) -> bool:
        """Goes one step on if it is free; returns whether it was."""
        if self._is_over() or (entered := self._free(self.state, action)) is None:
            return False
        self.moves.append(action)
        self.state = entered
        if len(self.moves) > MOST_MOVES:
            raise NoWay(f"that takes more than {MOST_MOVES} moves")
        return True

    def _is_over(self) -> bool:
        return bool(self.known.mdp.goal[self.state])

    def leg(self, leg: Leg, following: Leg | None) -> None:
        """Goes along a leg."""
        action, begun = self._action(leg.direction), len(self.moves)
        if leg.steps is not None:
            for _ in range(leg.steps):
                if not self._step(action) and not self._is_over():
                    made = len(self.moves) - begun
                    raise NoWay(
                        f"{leg.direction} {leg.steps}: {self._why_not(action)} after {made} of {leg.steps} steps"
                    )
            return
        if leg.until == WALL:
            while self._step(action):
                pass
            if len(self.moves) == begun:
                raise NoWay(f"{leg.direction} until the wall: {self._why_not(action)}")
        elif leg.until == CLEAR:
            self._clear(leg, following, action)
        else:
            while not self._is_beside(leg.until, action):
                if not self._step(action):
                    raise NoWay(
                        f"{leg.direction} until {leg.until}: it does not come next to it, {self._why_not(action)}"
                    )

    def _why_not(self, action: int) -> str:
        entered = int(self.known.mdp.successor[self.state, action])
        if entered == self.state:
            return "it does not go on"
        if self.known.closed[entered]:
            return "there is an obstacle"
        return "it would come close to what it keeps away from"

    def _is_beside(self, id_: str, action: int) -> bool:
        row, column, level = self.known.spots[self.state]
        there = self.known.spots_of[id_]
        if id_ == "goal":
            return (row, column, level) in there
        beside = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
        return any((row + r, column + c, level + z) in there for r, c, z in beside)

    def _clear(self, leg: Leg, following: Leg | None, action: int) -> None:
        """Goes on until the direction named next, or that of the next leg, is free; of an object: until it is left behind."""
        towards = leg.towards or (following.direction if following is not None else "")
        if not towards and not leg.past:
            raise NoWay(f"{leg.direction} until it is free: say which way is free then")
        onward = self._action(towards) if towards else None
        while not (
            self._is_past(leg.past, onward, action) if leg.past else self._free(self.state, onward or 0) is not None
        ):
            if not self._step(action):
                raise NoWay(
                    f"{leg.direction} until it is free {towards}: {self._why_not(action)} before".replace("  ", " ")
                )

    def _is_past(self, id_: str, onward: int | None, action: int) -> bool:
        """Whether an object is not ahead: in the direction `onward`, or on either side of the direction of the leg."""
        there, spot = self.known.spots_of[id_], self.known.spots[self.state]
        for turn in (
            [onward] if onward is not None else [n for n in range(len(self.known.actions)) if n // 2 != action // 2]
        ):
            name = self.known.actions[turn]
            by = _step_of(self.known.actions, name)
            ahead = spot
            for _ in range(max(self.known.mdp.shape) if any(by) else 0):
                ahead = (ahead[0] + by[0], ahead[1] + by[1], ahead[2] + by[2])
                if ahead in there:
                    return False
        return True

    def to(self, id_: str) -> None:
        """Goes a shortest way to the goal, or next to an object."""
        if id_ == "goal":
            self._shortest([lambda state: bool(self.known.mdp.goal[state])], "to the goal")
            return
        if not self._is_beside(id_, 0):
            there = self.known.spots_of[id_]
            beside = {
                (row + r, column + c, level)
                for row, column, level in there
                for r, c in ((1, 0), (-1, 0), (0, 1), (0, -1))
            } - there
            self._shortest([lambda state: self.known.spots[state] in beside], f"to {id_}")

    def around(self, id_: str, side: str | None) -> None:
        """Goes past an object on a side; None: on the side of the shortest way."""
        sides = [side] if side is not None else self._sides(id_)
        found: list[list[int]] = []
        said = f"around {id_}" + (f" on its {side} side" if side else "")
        for one in sides:
            for stages in self._past(id_, one):
                if (moves := self._search(stages)) is not None:
                    found.append(moves)
                    break
        if not found:
            raise NoWay(f"{said}: there is no free way")
        for action in min(found, key=len):
            self._step(action)

    def _sides(self, id_: str) -> list[str]:
        """The sides on which an object may be passed from here: beside what is in the way."""
        rows, columns = _extent(self.known.spots_of[id_])
        row, column, _ = self.known.spots[self.state]
        sides = {0: ["left", "right"], 1: ["forward", "backward"]}
        names = [*sides[0] * (not rows[0] <= row <= rows[1]), *sides[1] * (not columns[0] <= column <= columns[1])]
        return [name for name in names if _action_of(self.known.actions, name) is not None] or sides[0] + sides[1]

    def _past(self, id_: str, side: str) -> list[list[Callable[[int], bool]]]:
        """The stages of the ways past an object on a side, the likeliest way first: beside it, then beyond it."""
        spots = self.known.spots
        there = self.known.spots_of[id_]
        (top, bottom), (left, right) = _extent(there)
        levels = [level for _, _, level in there]
        row, column, _ = spots[self.state]
        beyond_rows = [lambda s: spots[s][0] < top, lambda s: spots[s][0] > bottom]  # towards the far side, and back
        beyond_columns = [lambda s: spots[s][1] > right, lambda s: spots[s][1] < left]
        first = row >= top if not top <= row <= bottom else self._goal_lies(0, (top + bottom) / 2)
        rows = beyond_rows if first else beyond_rows[::-1]
        first = column <= right if not left <= column <= right else not self._goal_lies(1, (left + right) / 2)
        columns = beyond_columns if first else beyond_columns[::-1]
        flat = {} if "forward" in self.known.actions else {"up": "forward", "down": "backward"}
        name = flat.get(side, side)
        beside: dict[str, Callable[[int], bool]] = {
            "left": lambda s: top <= spots[s][0] <= bottom and spots[s][1] < left,
            "right": lambda s: top <= spots[s][0] <= bottom and spots[s][1] > right,
            "forward": lambda s: left <= spots[s][1] <= right and spots[s][0] < top,
            "backward": lambda s: left <= spots[s][1] <= right and spots[s][0] > bottom,
            "up": lambda s: spots[s][2] > max(levels) and left <= spots[s][1] <= right and top <= spots[s][0] <= bottom,
            "down": lambda s: (
                spots[s][2] < min(levels) and left <= spots[s][1] <= right and top <= spots[s][0] <= bottom
            ),
        }
        if name not in beside:
            raise NoWay(f"around {id_}: '{side}' is no side")
        ends = (
            rows
            if name in ("left", "right")
            else columns
            if name in ("forward", "backward")
            else [*rows[:1], *columns[:1]]
        )
        return [[beside[name], end] for end in ends[: 2 if name in ("up", "down") else 1]]

    def _goal_lies(self, axis: int, middle: float) -> bool:
        """Whether the goal lies above (axis 0) or left of (axis 1) the middle of an object; true without a goal."""
        goals = self.known.spots_of["goal"]
        return not goals or min(spot[axis] for spot in goals) < middle

    def opposite(self, action: int) -> None:
        """Goes one step against an action."""
        name = OPPOSITES.get(self.known.actions[action])
        if name is None or name not in self.known.actions:
            raise NoWay(f"'{self.known.actions[action]}' has no opposite here")
        if not self._step(self._action(name)):
            raise NoWay(f"the other way, {name}: {self._why_not(self._action(name))}")

    def again(self, moves: Sequence[int]) -> None:
        """Makes moves again."""
        if not moves:
            raise NoWay("nothing was answered here before")
        for action in moves:
            if not self._step(action) and not self._is_over():
                raise NoWay(f"the same again: {self._why_not(action)}")

    def _shortest(self, stages: Sequence[Callable[[int], bool]], said: str) -> None:
        moves = self._search(stages)
        if moves is None:
            raise NoWay(f"{said}: there is no free way")
        for action in moves:
            self._step(action)

    def _search(self, stages: Sequence[Callable[[int], bool]]) -> list[int] | None:
        """The actions of a shortest way that meets the stages one after the other, None if there is none; lower actions first."""
        first = (self.state, 0)
        came: dict[tuple[int, int], tuple[tuple[int, int], int] | None] = {first: None}
        pending = deque([first])
        while pending:
            node = pending.popleft()
            state, stage = node
            if stage == len(stages):
                moves = []
                at = came[node]
                while at is not None:
                    moves.append(at[1])
                    at = came[at[0]]
                return moves[::-1]
            if self.known.mdp.goal[state]:
                continue
            for action in range(len(self.known.actions)):
                entered = self._free(state, action)
                if entered is None:
                    continue
                following = (entered, stage + bool(stages[stage](entered)))
                if following not in came:
                    came[following] = (node, action)
                    pending.append(following)
        return None


_STEPS: Mapping[str, Spot] = {
    "left": (0, -1, 0),
    "right": (0, 1, 0),
    "forward": (-1, 0, 0),
    "backward": (1, 0, 0),
    "up": (0, 0, 1),
    "down": (0, 0, -1),
}


def _step_of(actions: Sequence[str], name: str) -> Spot:
    """The change of row, column and level by an action; without the action forward, up and down are those of the picture."""
    flat = {} if "forward" in actions else {"up": "forward", "down": "backward"}
    return _STEPS.get(flat.get(name, name), (0, 0, 0))


def _action_of(actions: Sequence[str], name: str) -> str | None:
    flat = {"forward": "up", "backward": "down"}
    return name if name in actions else flat.get(name) if flat.get(name) in actions else None


def _extent(spots: Collection[Spot]) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first and last row, and the first and last column."""
    rows, columns = [row for row, _, _ in spots], [column for _, column, _ in spots]
    return (min(rows), max(rows)), (min(columns), max(columns))
