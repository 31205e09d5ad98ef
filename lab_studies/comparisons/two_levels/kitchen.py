"""A small kitchen for toast on a grid, as one flat problem and as a cell of two levels.

One step is one unit of time: a move, a pick, a drop or a wait. The rules are those of `lab.sequencing.Cell`: a toast is
dropped at the next station when that is free, else in its buffer, and is not picked before the machine is done.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.mdp import BoolArray, IntArray, TabularMDP, grid
from lab.sequencing.cell.cell import Cell, needed_moves
from lab.sequencing.cell.stations import Product as Toast
from lab.sequencing.cell.stations import Route, Stage, Station, one_robot

ACTIONS = ("up", "down", "left", "right", "pick", "drop", "wait")  # the first four as `lab.mdp.grid` orders them
PICK, DROP, WAIT = 4, 5, 6
LETTERS = {
    "P": "plate",
    "t": "toaster buffer",
    "T": "toaster",
    "b": "butter buffer",
    "B": "butter applier",
    "F": "finished plate",
}
START = "t"  # where the robot waits at time 0 (thesis, rules of the tables of ch. 7)
ROUTE: Route = (
    Stage(LETTERS["P"]),
    Stage(LETTERS["T"], LETTERS["t"]),
    Stage(LETTERS["B"], LETTERS["b"]),
    Stage(LETTERS["F"]),
)
HANDLING = 2  # additional steps of a loaded transfer: the pick and the drop

Way = tuple[str, str]  # station names, from and to
Count = NDArray[np.int64]


@dataclass(frozen=True)
class Kitchen:
    """A grid of cells, rows of text: a letter of LETTERS is a station, "#" an obstacle; machine times in steps."""

    rows: tuple[str, ...]
    toaster_steps: int
    butter_steps: int

    @cached_property
    def blocked(self) -> BoolArray:
        """Where obstacles are (rows, columns)."""
        return np.array([[letter == "#" for letter in row] for row in self.rows])

    @cached_property
    def places(self) -> dict[str, tuple[int, int]]:
        """The cell (row, column) of each station, by its name."""
        cells = {letter: (r, c) for r, row in enumerate(self.rows) for c, letter in enumerate(row)}
        return {name: cells[letter] for letter, name in LETTERS.items()}

    def needed(self, parts: int) -> tuple[tuple[Way, ...], tuple[Way, ...]]:
        """The transfers that some allowed order of so many toasts may contain: empty ones and loaded ones."""
        moves = needed_moves(self._stations(parts), (Toast("toast", (ROUTE,)),), one_robot(LETTERS[START]), parts)
        return moves.empty, moves.loaded

    def way(self, way: Way) -> TabularMDP:
        """The sub-task of one transfer, as `lab.mdp.grid` makes it: running into an obstacle ends the episode."""
        return grid(self.rows_and_columns, self.blocked, self.places[way[0]], self.places[way[1]])

    @property
    def rows_and_columns(self) -> tuple[int, int]:
        """The grid's shape."""
        return len(self.rows), len(self.rows[0])

    def cell(self, parts: int, steps: dict[Way, int]) -> Cell:
        """The high level: a cell whose transfers take the given steps, and HANDLING more when loaded."""
        stations = self._stations(parts)
        names = [station.name for station in stations]
        empty = np.full((len(names), len(names)), np.nan)
        loaded = empty.copy()
        for table, ways, more in zip((empty, loaded), self.needed(parts), (0, HANDLING), strict=True):
            for origin, target in ways:
                table[names.index(origin), names.index(target)] = steps[origin, target] + more
        return Cell.alike(stations, ROUTE, empty, loaded, LETTERS[START], parts)

    def _stations(self, parts: int) -> tuple[Station, ...]:
        machines = {"T": self.toaster_steps, "B": self.butter_steps}
        kinds: dict[str, Any] = {"P": "storage", "F": "storage", "t": "buffer", "b": "buffer"}
        return tuple(
            Station(name, "machine", 1, machines[letter]) if letter in machines else Station(name, kinds[letter], parts)
            for letter, name in LETTERS.items()
        )


@dataclass(frozen=True, eq=False)
class FlatWorld:
    """The whole task as one decision problem, and what the robot carries in each state.

    mdp: has the ACTIONS, each of one step with reward -1; an impossible one is a wait. carried (S,) int: 0 for nothing, else
    1 + the number of machines that the toast has passed.
    """

    mdp: TabularMDP
    carried: IntArray


def flat_world(kitchen: Kitchen, parts: int) -> FlatWorld:
    """The problem of all states that can be reached from the start: all toasts on the plate, the robot at the toaster buffer.

    A state is the robot's cell, what it carries, the numbers of toasts on the plate and in each buffer, and for each machine
    whether it is empty or the steps that it still needs; toasts are alike.
    """
    rules = _Transitions(kitchen, parts)
    start = rules.code(rules.first)
    known = frontier = np.array([start])
    while frontier.size:
        going = frontier[~rules.done(frontier)]
        entered = np.unique(np.concatenate([rules.after(going, action) for action in range(len(ACTIONS))]))
        frontier = np.setdiff1d(entered, known, assume_unique=True)
        known = np.union1d(known, frontier)
    over = rules.done(known)
    columns = [np.searchsorted(known, rules.after(known, action)) for action in range(len(ACTIONS))]
    successor = np.where(over[:, None], np.arange(len(known))[:, None], np.stack(columns, axis=1)).astype(np.int32)
    reward = np.where(over[:, None], 0.0, -np.ones(successor.shape))
    first = int(np.searchsorted(known, start))
    carried = rules.state(known)[1].astype(np.int32)
    return FlatWorld(TabularMDP(successor, reward, over, over, first, ACTIONS), carried)


class _Transitions:
    """The effects of actions on many states at once, as columns: robot cell, carried, plate, buffer, machine, buffer, machine.

    A machine is 0 if it is empty, 1 if it is done, n + 1 if it needs n more steps.
    """

    def __init__(self, kitchen: Kitchen, parts: int) -> None:
        free = [(int(r), int(c)) for r, c in np.argwhere(~kitchen.blocked)]
        number = {cell: index for index, cell in enumerate(free)}
        self._at = {letter: number[kitchen.places[name]] for letter, name in LETTERS.items()}
        ways = ((-1, 0), (1, 0), (0, -1), (0, 1))
        self._moved = np.array([[number.get((r + dr, c + dc), number[r, c]) for dr, dc in ways] for r, c in free])
        self._full = (kitchen.toaster_steps + 1, kitchen.butter_steps + 1)
        self._sizes = (len(free), 4, parts + 1, parts + 1, self._full[0] + 1, parts + 1, self._full[1] + 1)
        self.first = [np.array(value) for value in (self._at[START], 0, parts, 0, 0, 0, 0)]

    def code(self, state: list[Count]) -> Count:
        """One number for each state."""
        return np.asarray(np.ravel_multi_index(tuple(state), self._sizes))

    def state(self, code: Count) -> list[Count]:
        """The columns of each state."""
        return list(np.unravel_index(code, self._sizes))

    def done(self, code: Count) -> BoolArray:
        """Whether all toasts are on the finished plate."""
        return np.asarray(sum(self.state(code)[1:]) == 0)

    def after(self, code: Count, action: int) -> Count:
        """The states one step later; those after a done state have no meaning."""
        cell, carried, plate, *line = self.state(code)
        before = list(line)
        for machine in (1, 3):
            line[machine] = line[machine] - (line[machine] > 1)
        if action < PICK:
            cell = self._moved[cell, action]
        elif action == PICK:
            carried, plate = self._pick(cell, carried, plate, before, line)
        elif action == DROP:
            carried = self._drop(cell, carried, before, line)
        return self.code([cell, carried, plate, *line])

    def _pick(
        self, cell: Count, carried: Count, plate: Count, before: list[Count], line: list[Count]
    ) -> tuple[Count, Count]:
        free = carried == 0
        taken = free & (cell == self._at["P"]) & (plate > 0)
        plate, carried = plate - taken, carried + taken
        for place, letter, worth in ((0, "t", 1), (1, "T", 2), (2, "b", 2), (3, "B", 3)):
            ready = before[place] == 1 if place in (1, 3) else before[place] > 0
            taken = free & (cell == self._at[letter]) & ready
            line[place] = np.where(taken, before[place] - 1, line[place])
            carried = carried + worth * taken
        return carried, plate

    def _drop(self, cell: Count, carried: Count, before: list[Count], line: list[Count]) -> Count:
        left = (carried == 3) & (cell == self._at["F"])
        for buffer, machine, letters, worth in ((0, 1, "tT", 1), (2, 3, "bB", 2)):
            busy = before[machine] > 0
            stored = (carried == worth) & (cell == self._at[letters[0]]) & busy
            begun = (carried == worth) & (cell == self._at[letters[1]]) & ~busy
            line[buffer] = line[buffer] + stored
            line[machine] = np.where(begun, self._full[machine // 2], line[machine])
            left = left | stored | begun
        return np.where(left, 0, carried)
