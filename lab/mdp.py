"""Small deterministic Markov decision processes in tables: builders for grids and coverage boards, exact solutions, paths."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal, get_type_hints

import numpy as np
from annotated_types import Ge, Gt, Le, Lt, doc
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput, WorkFailed, check_value, shortened

MAX_COVERAGE_CELLS = 12
MAX_SWEEPS = 100_000
COVERAGE_LABELS = ("up", "down", "left", "right")

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Rewards:
    """The rewards of the moves on a grid, dimensionless. Source: thesis, sections 8.3 and 9.7.

    goal: for entering a goal, above 0; collision: for entering an obstacle, below 0; step: for any other move, -1000 to 0.
    Raises BadInput for other values.

        >>> import lab
        >>> board = lab.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2), lab.Rewards(step=-0.5))
        >>> board.step_reward, board.arrival.tolist()
        (-0.5, [0.0, 0.0, 1.5])
    """

    goal: Annotated[float, Gt(0), doc("the reward for entering a goal")] = 1.5
    collision: Annotated[float, Lt(0), doc("the reward for entering an obstacle")] = -1.0
    step: Annotated[float, Le(0), Ge(-1000), doc("the reward for any other step")] = -0.1

    def __post_init__(self) -> None:
        for name, allowed in get_type_hints(Rewards, include_extras=True).items():
            check_value(name, getattr(self, name), allowed, "lab.Rewards")


class NoPath(BadInput):
    """No path joins start and goal.

    enclosing: the index tuples of the blocked cells around the smaller of the two regions, that of the start or that of the goal.
    around: which of the two that is.
    """

    def __init__(self, message: str, enclosing: tuple[tuple[int, ...], ...], around: Literal["goal", "start"]):
        super().__init__(message)
        self.enclosing = enclosing
        self.around = around

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.enclosing, self.around)  # so that it comes back from a worker process


@dataclass(frozen=True, eq=False)
class TabularMDP:
    """A deterministic Markov decision process with S states and A actions, as arrays.

    successor: (S, A) int32, the state that each action leads to.
    reward: (S, A) float64, its reward.
    terminal: (S,) bool, the states that end an episode.
    goal: (S,) bool, those of them that are goals.
    start: the state in which episodes begin.
    action_labels: A names.
    shape: the shape of the grid whose cells the states are, numbered in C order (`ravel_multi_index`); () if they are no grid.
    coverage_shape: (rows, columns) of a coverage problem (see `coverage`), otherwise ().
    starts: if not empty, each episode begins in one of these states, drawn at random; `shortest_steps` then counts from `start`.

    The arrays are copied and made read-only. Raises BadInput if they do not fit together.

        >>> import lab
        >>> mdp = lab.TabularMDP([[0, 1], [1, 1]], [[-1, 0], [0, 0]], [False, True], [False, True], 0, ("stay", "go"))
        >>> mdp.n_states, mdp.n_actions, mdp.state_label(0)
        (2, 2, '0')
    """

    successor: IntArray
    reward: FloatArray
    terminal: BoolArray
    goal: BoolArray
    start: int
    action_labels: tuple[str, ...]
    shape: tuple[int, ...] = ()
    coverage_shape: tuple[int, ...] = ()
    starts: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name, dtype in (
            ("successor", np.int32),
            ("reward", np.float64),
            ("terminal", np.bool_),
            ("goal", np.bool_),
        ):
            given = getattr(self, name)
            try:
                array = np.array(given, dtype=dtype, order="C")
            except (TypeError, ValueError):
                kind = np.dtype(dtype).name
                raise BadInput(
                    f"decision problem: {name} {shortened(repr(given))}: wanted an array of {kind}"
                ) from None
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        reason = self._what_does_not_fit()
        if reason:
            raise BadInput(f"decision problem: {reason}")

    def _what_does_not_fit(self) -> str | None:
        if self.successor.ndim != 2 or 0 in self.successor.shape:
            return f"successor has shape {self.successor.shape}, allowed (states, actions), none of them 0"
        states, actions = self.successor.shape
        if self.reward.shape != (states, actions) or self.terminal.shape != (states,) or self.goal.shape != (states,):
            return f"reward, terminal and goal must have shapes ({states}, {actions}), ({states},) and ({states},)"
        labels: object = self.action_labels
        if not isinstance(labels, Sequence):
            return f"action_labels {labels!r}: wanted a name for each action"
        if len(self.action_labels) != actions:
            return f"{len(self.action_labels)} action labels for {actions} actions"
        if self.successor.min() < 0 or self.successor.max() >= states:
            return f"successor names a state outside 0..{states - 1}"
        if not np.isfinite(self.reward).all():
            return "a reward is not finite"
        if bool((self.goal & ~self.terminal).any()):
            return "a goal state is not terminal"
        start: object = self.start
        if not isinstance(start, int | np.integer):
            return f"start {start!r} is no state: wanted a whole number"
        if not 0 <= self.start < states:
            return f"start {self.start} is outside 0..{states - 1}"
        if self.terminal[self.start]:
            return f"start {self.start} is a terminal state"
        for state in self.starts:
            if not 0 <= state < states or self.terminal[state]:
                return f"start {state} is terminal or outside 0..{states - 1}"
        if self.shape and int(np.prod(self.shape)) != states:
            return f"shape {self.shape} does not hold {states} states"
        return None

    @property
    def n_states(self) -> int:
        """The number of states S."""
        return int(self.successor.shape[0])

    @property
    def n_actions(self) -> int:
        """The number of actions A."""
        return int(self.successor.shape[1])

    @property
    def cells(self) -> tuple[int, ...]:
        """The shape of the grid that tile coding uses; () if the states are no grid."""
        return self.shape

    @cached_property
    def signature(self) -> str:
        """The first 16 hex digits of a SHA-256 over everything that defines the problem; equal problems have equal signatures."""
        head = (self.start, self.starts, self.action_labels, self.shape, self.coverage_shape, self.successor.shape)
        digest = hashlib.sha256(repr(head).encode())
        for array, code in ((self.successor, "<i4"), (self.reward, "<f8"), (self.terminal, "?"), (self.goal, "?")):
            digest.update(array.astype(code, order="C").tobytes())
        return digest.hexdigest()[:16]

    @cached_property
    def step_reward(self) -> float:
        """The common reward of all moves that enter no terminal state. Raises BadInput if their rewards differ."""
        ordinary = ~self.terminal[:, None] & ~self.terminal[self.successor]
        return _common_reward(self.reward[ordinary], "the moves that enter no terminal state")

    @cached_property
    def arrival(self) -> FloatArray:
        """The reward for entering each terminal state, (S,) float64, 0 for all other states.

        Raises BadInput if it depends on the state from which a terminal state is entered.
        """
        moves = ~self.terminal[:, None] & self.terminal[self.successor]
        entered, rewards = self.successor[moves], self.reward[moves]
        lowest, highest = np.full(self.n_states, np.inf), np.full(self.n_states, -np.inf)
        np.minimum.at(lowest, entered, rewards)
        np.maximum.at(highest, entered, rewards)
        for state in np.flatnonzero(lowest < highest)[:1].tolist():
            _common_reward(rewards[entered == state], f"the moves into {self.state_label(state)}")
        return np.where(np.isfinite(lowest), lowest, 0.0)

    def state_cell(self, state: int) -> tuple[int, ...]:
        """The index of a state's grid cell (in a coverage problem, that of the head); () if the states are no grid."""
        if self.coverage_shape:
            cells = int(np.prod(self.coverage_shape))
            return tuple(int(i) for i in np.unravel_index(state >> cells, self.coverage_shape))
        if not self.shape:
            return ()
        return tuple(int(i) for i in np.unravel_index(state, self.shape))

    def covered(self, state: int) -> BoolArray:
        """The cells that are covered in a state of a coverage problem, (rows, columns) bool; empty for other problems."""
        cells = int(np.prod(self.coverage_shape)) if self.coverage_shape else 0
        return np.array([state >> i & 1 for i in range(cells)], bool).reshape(self.coverage_shape or (0,))

    def state_label(self, state: int) -> str:
        """A state as text: "(3, 4)" on a grid, "(0, 1) covered 4 of 9" in a coverage problem, otherwise its number."""
        if not 0 <= state < self.n_states:
            raise BadInput(f"state {state} is outside 0..{self.n_states - 1}")
        if self.coverage_shape:
            covered = self.covered(state)
            return f"{self.state_cell(state)} covered {int(covered.sum())} of {covered.size}"
        return str(self.state_cell(state)) if self.shape else str(state)


def _common_reward(values: FloatArray, moves: str) -> float:
    """The single value among the rewards of these moves, 0.0 if there are none. Raises BadInput if there are several."""
    different = np.unique(values)
    if len(different) > 1:
        raise BadInput(f"decision problem: {moves} have the rewards {different[0]:g} to {different[-1]:g}: wanted one")
    return float(different[0]) if len(different) else 0.0


def _neighbours(shape: tuple[int, ...]) -> IntArray:
    """The cell that each move leads to, (cells, 2 * axes) int32: -axis0, +axis0, -axis1, ...; moves stop at the border."""
    cells = np.indices(shape).reshape(len(shape), -1)
    columns = []
    for axis, length in enumerate(shape):
        for move in (-1, 1):
            moved = cells.copy()
            moved[axis] = np.clip(cells[axis] + move, 0, length - 1)
            columns.append(np.ravel_multi_index(tuple(moved), shape))
    return np.stack(columns, axis=1).astype(np.int32)


def distances(successor: IntArray, closed: BoolArray, source: int) -> IntArray:
    """The moves needed from `source` to each state, (S,) int32, -1 if unreachable; no path leaves a `closed` (S,) state."""
    distance = np.full(len(successor), -1, np.int32)
    frontier = np.array([source])
    steps = 0
    while frontier.size:
        distance[frontier] = steps
        steps += 1
        reached = np.unique(successor[frontier[~closed[frontier]]])
        frontier = reached[distance[reached] < 0]
    return distance


def grid(
    shape: Sequence[int],
    blocked: ArrayLike,
    start: Sequence[int],
    goal: Sequence[int],
    rewards: Rewards | None = None,
    action_labels: Sequence[str] | None = None,
    *,
    deadly: bool = True,
) -> TabularMDP:
    """The problem of reaching a goal on a grid of any dimension with obstacles.

    shape: the number of cells along each axis.
    blocked: the obstacles, a bool array of `shape`.
    start, goal: cells, as indices.
    rewards: default `Rewards()`. Entering a blocked cell yields `collision`, entering the goal yields `goal`, and both end the
    episode; any other move yields `step`, also one against the border, which does not change the state.
    action_labels: the names of the actions -axis0, +axis0, -axis1, ...; default these words.
    deadly: false: a blocked cell is a wall, and a move against it is like one against the border.

    Raises BadInput if start or goal is outside, blocked or the same cell, and NoPath if no path joins them.
    Source: thesis, sections 8.3 and 9.7.

        >>> import lab
        >>> mdp = lab.grid((3, 3), [[0, 0, 0], [1, 1, 0], [0, 0, 0]], start=(0, 0), goal=(2, 0))
        >>> mdp.n_states, mdp.action_labels
        (9, ('-axis0', '+axis0', '-axis1', '+axis1'))
    """
    shape = _whole_numbers("grid shape", shape)
    if not shape or min(shape) < 1:
        raise BadInput(f"grid shape {shape}: each axis needs at least one cell")
    rewards = rewards or Rewards()
    if not isinstance(rewards, Rewards):
        raise BadInput(f"rewards {rewards!r} (lab.grid): wanted lab.Rewards")
    wall = np.asarray(blocked, dtype=bool)
    if wall.shape != shape:
        raise BadInput(f"blocked cells have shape {wall.shape}, the grid has {shape}")
    if action_labels is not None and not isinstance(action_labels, Sequence):
        raise BadInput(f"action_labels {action_labels!r} (lab.grid): wanted a name for each action")
    labels = tuple(action_labels or (f"{sign}axis{axis}" for axis in range(len(shape)) for sign in "-+"))
    closed = wall.ravel()
    first, last = _free_cell("start", start, wall), _free_cell("goal", goal, wall)
    if first == last:
        raise BadInput(f"start and goal are the same cell {tuple(goal)}")
    moves = _neighbours(shape)
    _require_path(moves, wall, first, last)
    goals = np.zeros(closed.size, bool)
    goals[last] = True
    check_value("deadly", deadly, bool, "lab.grid")
    if not deadly:
        moves = np.where(closed[moves], np.arange(closed.size, dtype=np.int32)[:, None], moves)
    terminal = closed | goals
    reward = np.where(closed[moves], rewards.collision, np.where(goals[moves], rewards.goal, rewards.step))
    reward[terminal] = 0.0
    successor = np.where(terminal[:, None], np.arange(closed.size)[:, None], moves).astype(np.int32)
    return TabularMDP(successor, reward, terminal, goals, first, labels, shape)


def _whole_numbers(name: str, given: Sequence[int]) -> tuple[int, ...]:
    """The given numbers as a tuple. Raises BadInput for anything else."""
    try:
        numbers = tuple(int(n) for n in given)
        if numbers == tuple(given):
            return numbers
    except (TypeError, ValueError):
        pass
    raise BadInput(f"{name} {shortened(repr(given))} (lab.grid): wanted a whole number for each axis")


def _free_cell(name: str, cell: Sequence[int], wall: BoolArray) -> int:
    """The number of a cell. Raises BadInput if it is outside the grid or blocked."""
    index = _whole_numbers(name, cell)
    if len(index) != wall.ndim or any(not 0 <= i < n for i, n in zip(index, wall.shape, strict=True)):
        raise BadInput(f"{name} {index} is outside the grid: allowed {' x '.join(f'0..{n - 1}' for n in wall.shape)}")
    if wall[index]:
        raise BadInput(f"{name} {index} is blocked by an obstacle")
    return int(np.ravel_multi_index(index, wall.shape))


def _require_path(moves: IntArray, wall: BoolArray, start: int, goal: int) -> None:
    """Raises NoPath if no path joins start and goal; it names the obstacles around the smaller of their two regions."""
    closed = wall.ravel()
    from_goal = distances(moves, closed, goal) >= 0
    if from_goal[start]:
        return
    from_start = distances(moves, closed, start) >= 0
    around: Literal["goal", "start"] = (
        "goal" if (from_goal & ~closed).sum() <= (from_start & ~closed).sum() else "start"
    )
    walls = np.flatnonzero((from_goal if around == "goal" else from_start) & closed)
    cells = tuple(tuple(int(i) for i in np.unravel_index(w, wall.shape)) for w in walls)
    shown = ", ".join(str(c) for c in cells[:8]) + (f" and {len(cells) - 8} more" if len(cells) > 8 else "")
    ends = [tuple(int(i) for i in np.unravel_index(s, wall.shape)) for s in (start, goal)]
    raise NoPath(f"no path from {ends[0]} to {ends[1]}: the {around} is enclosed by {shown}", cells, around)


def coverage(shape: Sequence[int], rewards: Rewards | None = None, start: Sequence[int] = (0, 0)) -> TabularMDP:
    """The problem of covering every cell of a small board with a moving head: the butter sub-task.

    shape: (rows, columns); start: the head's first cell, which counts as covered.
    A state is head cell * 2**cells + mask, where bit i of the mask says whether cell i (C order) is covered. The actions are up,
    down, left, right (axis 0 points down, axis 1 right); a move against the border does not move the head. The goals are the
    states in which all cells are covered. A board of 3 x 3 has 4608 states and takes 8 moves.

    Raises BadInput for a board of 1 or more than 12 cells and for a start outside it.
    """
    shape = tuple(int(n) for n in shape)
    cells = int(np.prod(shape))
    if len(shape) != 2 or min(shape) < 1 or not 2 <= cells <= MAX_COVERAGE_CELLS:
        raise BadInput(f"coverage board {shape}: allowed are 2 axes and 2..{MAX_COVERAGE_CELLS} cells")
    rewards = rewards or Rewards()
    head = _free_cell("start", start, np.zeros(shape, bool))
    masks = np.arange(1 << cells)
    heads = _neighbours(shape)[:, None, :]  # (cells, 1, A)
    after = masks[None, :, None] | (1 << heads)  # (cells, masks, A)
    successor = ((heads << cells) | after).reshape(-1, 4)
    goals = np.tile(masks == masks[-1], cells)
    reward = np.where(goals[successor], rewards.goal, rewards.step)
    reward[goals] = 0.0
    successor = np.where(goals[:, None], np.arange(goals.size)[:, None], successor).astype(np.int32)
    first = (head << cells) | (1 << head)
    return TabularMDP(successor, reward, goals, goals, first, COVERAGE_LABELS, (), shape)


def optimal_values(mdp: TabularMDP, discount: float, guess: FloatArray | None = None) -> FloatArray:
    """The optimal action values by value iteration, (S, A) float64, 0 in terminal states.

    guess: (S, A), the values that the iteration starts from; default the rewards.
    Raises WorkFailed if the values do not converge, as with a discount of 1 where some states never reach an end.
    """
    onward = discount * ~mdp.terminal[mdp.successor]
    q: FloatArray = np.where(mdp.terminal[:, None], 0.0, mdp.reward) if guess is None else guess
    for _ in range(MAX_SWEEPS):
        values = q.max(axis=1)
        updated: FloatArray = mdp.reward + onward * values[mdp.successor]
        updated[mdp.terminal] = 0.0
        change = float(np.abs(updated - q).max())
        q = updated
        if change < 1e-12:
            return q
    raise WorkFailed(f"value iteration with discount {discount} did not settle in {MAX_SWEEPS} sweeps")


def shortest_steps(mdp: TabularMDP) -> int:
    """The length in moves of a shortest path from the start to a goal that enters no other terminal state. Raises NoPath."""
    distance = distances(mdp.successor, mdp.terminal, mdp.start)[mdp.goal]
    if not (distance >= 0).any():
        raise NoPath(f"no goal can be reached from {mdp.state_label(mdp.start)}", (), "goal")
    return int(distance[distance >= 0].min())


def shortest_path(mdp: TabularMDP) -> list[int]:
    """The states of a shortest path from the start to a goal, both included. Raises NoPath."""
    moves = shortest_steps(mdp)
    distance = distances(mdp.successor, mdp.terminal, mdp.start)
    path = [int(np.flatnonzero(mdp.goal & (distance == moves))[0])]
    for steps in range(moves - 1, -1, -1):
        before = np.flatnonzero((distance == steps) & ~mdp.terminal)
        path.append(int(before[np.any(mdp.successor[before] == path[-1], axis=1)][0]))
    return path[::-1]


def greedy_path(
    q: FloatArray, mdp: TabularMDP, max_steps: int, start: int | None = None
) -> tuple[list[int], list[int], bool]:
    """The path of the greedy policy of action values q (S, A): its states, its actions, and whether it reaches a goal.

    start: default the problem's. There is one state more than actions; ties go to the lowest action. The path ends at a terminal
    state, after `max_steps` moves, or at a state visited before, from which it would repeat itself.
    """
    states: list[int] = [mdp.start if start is None else start]
    actions: list[int] = []
    seen = set(states)
    while not mdp.terminal[states[-1]] and len(actions) < max_steps:
        action = int(np.argmax(q[states[-1]]))
        actions.append(action)
        states.append(int(mdp.successor[states[-1], action]))
        if states[-1] in seen:
            break
        seen.add(states[-1])
    return states, actions, bool(mdp.goal[states[-1]])
