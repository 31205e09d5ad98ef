"""Grid worlds to cross from a start to a goal (thesis ch. 9): from task files, from text grids, or drawn at random."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from lab.errors import BadInput, counted
from lab.lazy import scipy
from lab.mdp import BoolArray, NoPath, TabularMDP, grid, shortest_steps
from lab.tasks.record import Learned, Name, Record, as_tuple, read_text, walking, write_whole

MAX_AXIS = {2: 1200, 3: 112}  # the most cells along an axis by the number of axes, about 1.4 million in all
_ALLOWED = " or ".join(f"{axes} axes of 1 to {most} cells" for axes, most in MAX_AXIS.items())
MAX_DENSITY = 0.6
RANDOM = "random:"
ACTIONS = {  # of worlds with 2 and 3 axes, as `lab.mdp.grid` orders them: -axis 0, +axis 0, -axis 1, ...
    2: ("up", "down", "left", "right"),  # rows run down, columns to the right
    3: ("left", "right", "backward", "forward", "down", "up"),  # x, y, z as seen from above
}
_AXES = """\
Drawn at random. Cells are counted from 0; with two axes they are [row, column], row 0 on top, with three [x, y, z], y
away from you and z up.
"""
_TRIES = 10  # draws of obstacles before a path is kept free
_ALONE: dict[str, Any] = {"learner": "afterstate", "beta": 1.0, "episodes": 500}
_FAR = 300  # moves to a goal that no learner finds by chance, and that the usual discount makes worthless
_SHOWN: dict[str, Any] = {"learner": "monte-carlo", "alpha": 1.0, "beta": 3.0, "episodes": 60}
_MOST_STEPS = 1_000_000  # of an episode, see `LearnerSettings`
_ROOM = 4  # the step limit of a drawn world, in lengths of the shortest path
_WANTED = "wanted random:SHAPE:DENSITY:SEED, such as random:10x10x10:0.06:7"

Ints = NDArray[np.int_]
Coordinates = tuple[int, ...]
GridCell = Annotated[Coordinates, BeforeValidator(as_tuple)]
Length = Annotated[int, Field(ge=1, le=max(MAX_AXIS.values()))]
GridShape = Annotated[tuple[Length, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=3)]


class AdvisorView(Record):
    """The block of cells in which an advisor with a limited view sees the robot, from corner to corner, both inside."""

    lower: GridCell
    """One corner of the block, such as `[4, 4]`."""
    upper: GridCell
    """The opposite corner of the block, such as `[7, 7]`."""


class GridWorld(Learned):
    """A world of cells, counted from 0, with obstacles and the settings of its learner.

    Two axes: rows running down and columns to the right, as in a text grid. Three axes: x to the right, y forward, z
    up. An advisor with a limited view sees the robot in `view` only.
    """

    kind: Literal["world"] = "world"
    """The kind of the file; always "world"."""
    name: Name
    """The world's name, such as `"maze"`: 1 to 40 letters, digits, spaces, - and _."""
    title: str = ""
    """A title in one line, such as `"A maze with one path"`."""
    shape: GridShape
    """The number of cells along each axis, such as `[12, 12]` or `[10, 10, 10]`."""
    start: GridCell
    """The cell where every episode begins, such as `[0, 0]`."""
    goal: GridCell
    """The cell that the learner must reach, such as `[11, 11]`."""
    obstacles: Annotated[tuple[GridCell, ...], BeforeValidator(as_tuple)] = ()
    """The cells that are blocked, such as `[[3, 4], [3, 5]]`."""
    deadly: bool = True
    """Whether entering an obstacle ends the episode; false: the obstacle blocks, and a move against it costs a step."""
    view: AdvisorView | None = None
    """The region in which an advisor with a limited view sees the robot; left out: everywhere."""

    @model_validator(mode="after")
    def _cells_fit(self) -> Self:
        if max(self.shape) > MAX_AXIS[len(self.shape)]:
            raise ValueError(f"shape {_words(self.shape)}: allowed are {_ALLOWED}")
        for what, cell in self._cells():
            _require_inside(what, cell, self.shape)
        closed = set[Coordinates]()
        for cell in self.obstacles:
            if cell in closed:
                raise ValueError(f"obstacle {cell} stands twice in the file")
            closed.add(cell)
        for what, cell in (("start", self.start), ("goal", self.goal)):
            if cell in closed:
                raise ValueError(f"{what} {cell} is blocked by an obstacle: a free cell is wanted")
        if self.start == self.goal:
            raise ValueError(f"start and goal are the same cell {self.start}: two cells are wanted")
        if self.view is not None:
            for axis, (low, high) in enumerate(zip(self.view.lower, self.view.upper, strict=True)):
                if low > high:
                    raise ValueError(f"view.lower {low} on axis {axis} is above view.upper: allowed are 0..{high}")
        self.check_members()
        return self

    def _cells(self) -> Iterator[tuple[str, Coordinates]]:
        yield from (("start", self.start), ("goal", self.goal))
        yield from (("obstacle", cell) for cell in self.obstacles)
        if self.view is not None:
            yield from (("view.lower", self.view.lower), ("view.upper", self.view.upper))

    def blocked(self) -> BoolArray:
        """A mask of the obstacles; bool of `shape`."""
        return _marked(self.obstacles, self.shape)

    def region(self) -> BoolArray:
        """The states (S,) bool in which an advisor with a limited view sees the robot; all where there is no `view`."""
        seen = np.ones(self.shape, bool)
        if self.view is not None:
            seen[:] = False
            seen[tuple(slice(a, b + 1) for a, b in zip(self.view.lower, self.view.upper, strict=True))] = True
        return seen.ravel()

    def mdp(self) -> TabularMDP:
        """The decision problem of the world, from `lab.mdp.grid`; raises NoPath when obstacles separate start and goal."""
        try:
            cells, labels = (self.shape, self.blocked(), self.start, self.goal), ACTIONS[len(self.shape)]
            return grid(*cells, self.rewards, labels, deadly=self.deadly)
        except NoPath as error:
            raise NoPath(f"world '{self.name}': {error}", error.enclosing, error.around) from None

    def worth(self, moves: int, end: float) -> float:
        """The discounted return of `moves` moves when the last one gives `end` and each other one the step reward."""
        discount = self.learner.discount
        last = discount ** (moves - 1)
        before = moves - 1 if discount == 1.0 else (1.0 - last) / (1.0 - discount)
        return self.rewards.step * before + last * end

    def check(self) -> TabularMDP:
        """The decision problem, if it can be learned; raises NoPath, and BadInput when the best policy does not reach the goal.

        That is the case when the shortest path has more steps than an episode, or when the rewards make it better to run into the
        nearest obstacle.
        """
        mdp, collision, most = self.mdp(), self.rewards.collision, self.learner.max_steps
        moves = shortest_steps(mdp)
        steps = moves + self.learner.count_start
        if steps > most:
            need = f"the shortest path has {counted(moves, 'move')} and needs {counted(steps, 'step')}"
            raise BadInput(f"world '{self.name}': learner.max_steps = {most}: {need}")
        if not self.obstacles or not self.deadly:
            return mdp
        near = int(np.abs(np.subtract(self.obstacles, self.start)).sum(axis=1).min())
        crash, way = self.worth(near, collision), self.worth(moves, self.rewards.goal)
        if crash >= way:
            worth = (
                f"running into an obstacle is worth {crash:.2f} and the path of {counted(moves, 'move')} only {way:.2f}"
            )
            raise BadInput(
                f"world '{self.name}': rewards.collision = {collision}: at the start, {worth}: "
                "wanted a lower one, or more for the goal"
            )
        return mdp

    def to_toml(self, comment: str = "") -> str:
        """The text of a task file with this world, below a comment of any number of lines."""
        head = ("name", "kind", "title", "shape", "start", "goal")
        lines = [f"# {line}" for line in comment.splitlines()]
        lines += [f"{key} = {json.dumps(getattr(self, key))}" for key in head]
        lines += ["obstacles = [", *(f"  {json.dumps(cell)}," for cell in self.obstacles), "]"]
        lines += [] if self.deadly else ["deadly = false"]
        tables = {"view": self.view.model_dump()} if self.view is not None else {}
        tables |= {"rewards": asdict(self.rewards), "learner": asdict(self.learner), "gate": asdict(self.gate)}
        for name, table in tables.items():
            lines += ["", f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
        return "\n".join(lines) + "\n"


def _require_inside(what: str, cell: Coordinates, shape: Coordinates) -> None:
    if len(cell) != len(shape):
        raise ValueError(f"{what} {cell} has {len(cell)} coordinates: {len(shape)} are wanted")
    if not all(0 <= i < n for i, n in zip(cell, shape, strict=True)):
        allowed = " x ".join(f"0..{n - 1}" for n in shape)
        raise ValueError(f"{what} {cell} is outside the world: allowed are {allowed}")


def _marked(cells: Sequence[Coordinates], shape: Coordinates) -> BoolArray:
    marked = np.zeros(shape, bool)
    if cells:
        marked[tuple(np.transpose(cells))] = True
    return marked


def _check_shape(shape: Coordinates, where: str) -> None:
    if not all(1 <= n <= MAX_AXIS.get(len(shape), 0) for n in shape):
        raise BadInput(f"{where}: shape {_words(shape)}: allowed are {_ALLOWED}")


def _words(shape: Coordinates) -> str:
    return "x".join(map(str, shape))


def parse_shape(text: str, where: str) -> Coordinates:
    """The shape in a text such as "10x10x10"; raises BadInput when it is not the shape of a world."""
    if not re.fullmatch(r"[0-9]{1,9}(x[0-9]{1,9})*", text):
        raise BadInput(f"{where}: shape '{text}': wanted {_ALLOWED}, such as 10x10x10")
    shape = tuple(map(int, text.split("x")))
    _check_shape(shape, where)
    return shape


def from_text(path: Path) -> GridWorld:
    """The world of a text grid in a file, see `from_rows`."""
    name = re.sub(r"[^A-Za-z0-9 _-]", "-", path.stem).lstrip(" _-")[:40] or "world"
    return from_rows(read_text(path), name, str(path))


def from_rows(text: str, name: str, where: str, deadly: bool = False) -> GridWorld:
    """The world of a text grid: rows of equal length with '.' free, '#' obstacle, one 'S' start and one 'G' goal.

    Obstacles block, unless `deadly` is true or the first line is "deadly = true": then they end the episode.
    `lab see --json` writes such rows as "grid". Raises BadInput with the place, line and column, and NoPath.
    """
    rows = [row.removesuffix("\r") for row in text.rstrip("\r\n").split("\n")]
    if rows == [""]:
        raise BadInput(f"{where}: it is empty: wanted rows of . # S G")
    head = re.fullmatch(r"deadly *= *(true|false) *", rows[0])
    above = 0 if head is None else 1
    if head is not None:
        deadly = head[1] == "true"
    rows = rows[above:]
    if not rows:
        raise BadInput(f"{where}: line 2 is missing: wanted rows of . # S G")
    cells: dict[str, list[Coordinates]] = {"#": [], "S": [], "G": []}
    for i, row in enumerate(rows):
        for j, mark in enumerate(row):
            if mark != "." and mark not in cells:
                raise BadInput(f"{where}: line {i + 1 + above}, column {j + 1}: {mark!r}: allowed are . # S G")
            if mark in ("S", "G") and cells[mark]:
                (first,) = cells[mark]
                place = f"line {first[0] + 1 + above}, column {first[1] + 1}"
                raise BadInput(
                    f"{where}: line {i + 1 + above}, column {j + 1}: a second '{mark}', the first is in {place}"
                )
            if mark != ".":
                cells[mark].append((i, j))
        if len(row) != len(rows[0]):
            raise BadInput(
                f"{where}: line {i + 1 + above}: {counted(len(row), 'cell')}, line {1 + above} has {len(rows[0])}: "
                "wanted the same number"
            )
    _check_shape((len(rows), len(rows[0])), where)
    for mark, what in (("S", "start"), ("G", "goal")):
        if not cells[mark]:
            raise BadInput(f"{where}: no '{mark}' ({what}) in {len(rows)} lines: exactly one is wanted")
    shape, (start,), (goal,) = (len(rows), len(rows[0])), cells["S"], cells["G"]
    return _fitted(
        GridWorld(name=name, shape=shape, start=start, goal=goal, obstacles=tuple(cells["#"]), deadly=deadly)
    )


def from_words(word: str) -> GridWorld:
    """The random world of a word such as "random:10x10x10:0.06:7": shape, density, seed. Raises BadInput."""
    match = re.fullmatch(r"random:([^:]*):([0-9.eE+-]{1,20}):([0-9]{1,18})", word)
    try:
        density = float(match[2]) if match else None
    except ValueError:
        density = None
    if match is None or density is None:
        raise BadInput(f"world '{word}': {_WANTED}")
    return random_world(parse_shape(match[1], f"world '{word}'"), density, int(match[3]))


def random_world(shape: Sequence[int], density: float, seed: int) -> GridWorld:
    """A random world with the share `density` of obstacles, 0 to 0.6, and always a path from start to goal.

    Start and goal are at least half as many moves apart as opposite corners. Obstacles are drawn uniformly until they leave a
    path; after several failed draws one path is kept free. Raises BadInput for values outside their range, and when fewer cells
    are free than the path needs.
    """
    shape = tuple(int(n) for n in shape)
    where = f"random world {_words(shape)}"
    _check_shape(shape, where)
    if not 0.0 <= density <= MAX_DENSITY:
        raise BadInput(f"{where}: density {density}: allowed are 0 to {MAX_DENSITY}")
    if seed < 0:
        raise BadInput(f"{where}: seed {seed}: allowed is 0 or more")
    count = round(density * prod(shape))
    free = prod(shape) - count
    far = max(1, (sum(n - 1 for n in shape) + 1) // 2)
    if free <= far:
        raise BadInput(
            f"{where}: density {density} leaves {counted(free, 'cell')} free, start and goal far apart need {far + 1}"
        )
    rng = np.random.default_rng(seed)
    cells = np.indices(shape).reshape(len(shape), -1).T  # (cells, axes)
    start = cells[rng.integers(len(cells))]
    apart = np.abs(cells - start).sum(axis=1)
    goal = cells[rng.choice(np.flatnonzero((apart >= far) & (apart < free)))]
    wall = _obstacles(shape, count, start, goal, rng)
    return _fitted(
        GridWorld(
            name=f"random-{_words(shape)}-{density:g}-{seed}".replace(".", "_").replace("+", "")[:40],
            title=f"Random world of {_words(shape)} cells, density {density:g}, seed {seed}",
            shape=shape,
            start=tuple(start.tolist()),
            goal=tuple(goal.tolist()),
            obstacles=tuple(map(tuple, np.argwhere(wall).tolist())),
        )
    )


def _obstacles(shape: Coordinates, count: int, start: Ints, goal: Ints, rng: np.random.Generator) -> BoolArray:
    """A mask of `count` random obstacles that leave a path from start to goal; bool of `shape`."""

    def scattered(kept: Ints) -> BoolArray:
        """A mask of random obstacles outside the kept cells (n, axes)."""
        wall = np.zeros(prod(shape), bool)
        others = np.setdiff1d(np.arange(wall.size), np.ravel_multi_index(tuple(kept.T), shape))
        wall[rng.choice(others, count, replace=False)] = True
        return wall.reshape(shape)

    for _ in range(_TRIES):
        wall = scattered(np.stack([start, goal]))
        rooms, _ = scipy.ndimage.label(~wall)
        if rooms[tuple(start)] == rooms[tuple(goal)]:
            return wall
    return scattered(_staircase(start, goal, rng))


def _staircase(start: Ints, goal: Ints, rng: np.random.Generator) -> Ints:
    """The cells (n, axes) of a shortest path from start to goal, its moves in random order."""
    order = rng.permutation(np.repeat(np.arange(len(start)), np.abs(goal - start)))
    moves = (np.eye(len(start), dtype=np.int_) * np.sign(goal - start))[order]
    way: Ints = start + np.vstack([np.zeros_like(start), np.cumsum(moves, axis=0)])
    return way


def _fitted(world: GridWorld) -> GridWorld:
    """The world with settings of its learner that fit: to find a path alone or, to a far goal, to learn a path it is shown."""
    moves, learner = shortest_steps(world.mdp()), world.learner
    room = min(max(learner.max_steps, _ROOM * moves), _MOST_STEPS)
    if moves > _FAR:
        learner = replace(learner, **_SHOWN, discount=1.0 - 1.0 / (10.0 * moves), max_steps=room)
        lost = round(walking(world.rewards.step, learner), 6)
        learner, collision = (
            replace(learner, start_value=lost),
            lost - world.rewards.goal,
        )  # pessimistic: exploits advice
        gate, rewards = replace(world.gate, window=2, first_episode=4), replace(world.rewards, collision=collision)
        return world.model_copy(update={"learner": learner, "gate": gate, "rewards": rewards})
    learner = replace(learner, **_ALONE, max_steps=room)
    return world.model_copy(update={"learner": learner})


def write_random(shape: str, density: float, seed: int, out: Path) -> dict[str, Any]:
    """Writes a random world as a new task file; returns the document of `lab task random --json`."""
    if out.suffix != ".toml":
        raise BadInput(f"task file '{out}' (--out): its name must end in .toml")
    world = random_world(parse_shape(shape, "SHAPE"), density, seed)
    if out.exists():
        raise BadInput(f"task file '{out}' (--out): there is one already: choose another name, or remove it")
    write_whole(out, world.to_toml(_AXES))
    return {
        "file": str(out),
        "name": world.name,
        "shape": list(world.shape),
        "density": density,
        "seed": seed,
        "start": list(world.start),
        "goal": list(world.goal),
        "obstacles": len(world.obstacles),
        "optimal_steps": shortest_steps(world.mdp()),
    }
