"""Sub-tasks that are found: bottlenecks from a learner's own moves, beside the doors given by hand, and a flat learner."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from lab.learning import splitmix
from lab.learning.bottlenecks import METHODS, Bottleneck, Experience, bottlenecks
from lab.learning.settings import LearnerSettings
from lab.learning.two_levels import ROOM, SubProblem, TwoLevels, lesson, optimistic, practised, sub_problem
from lab.learning.values import fewest_moves
from lab.mdp import Rewards, TabularMDP
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, those, varying_row
from lab.studies.runner import Job, seeds_of
from lab_studies.comparisons.advice_bench.common_learner import COMMON
from lab_studies.comparisons.advice_bench.families import STEPS, rooms
from lab_studies.comparisons.advice_bench.layouts import (
    EMPTY_ROWS,
    FAR_DOOR_ROWS,
    FOUR_ROOMS_ROWS,
    WON,
    At,
    minigrid_moves,
    numbered,
)

CHAIN_ROWS = ("S...#....#....", "....#....#....", "..............", "....#....#...G")
COMPASS = ("north", "south", "west", "east")
LEARNER: LearnerSettings = replace(COMMON, episodes=400)
TASKS = 10  # in each session
FAR_APART = 5  # least moves from the start of a task to its goal
LOOKS = (250, 500, 1000, 2000, 4000)  # moves after which bottlenecks are looked for
LOOKING_SESSIONS = 10  # at most
BESIDE = 1  # moves between a door and what counts as that door

MEASURES = (
    f"A session is a series of {TASKS} tasks in the same rooms, each from a drawn state to a drawn cell at least {FAR_APART} "
    f"moves away. A lesson ends when its path has at most {ROOM} times the fewest moves, or after {LEARNER.episodes} episodes. "
    "Episodes and moves are all that were made in the session: 'found' learns its first task as the flat learner does, finds "
    "bottlenecks in just those moves, and learns the ways to them; 'hand-made' is given the doors, and learns the ways first. "
    "Where no known way leads to a goal, the task is learned flat, and bottlenecks are looked for again. A way's lesson begins "
    "each episode anywhere in its region, as in a prepared scene; that of a task's last way begins at the task's start. "
    "'off-policy': ways have no lessons, but are learned from all moves that were made, whatever for. 'with memory': each lesson "
    "begins with the values of all moves made so far. 'optimistic': the flat learner with the start values that ways have. "
    "'random': as many states as spectral cuts find, drawn. later: in the second half of the tasks. times_flat and so on: "
    "geometric means of the ratios to those of another way of learning, session by session."
)
LOOKING = (
    f"doors_percent: the doors that a method finds (at most {BESIDE} move beside), false: its other proposals, after so many "
    f"moves of a flat learner, in at most {LOOKING_SESSIONS} sessions. 'far-door' has a key to pick up and a door to open, which "
    "count as doors."
)


@dataclass(frozen=True, eq=False)
class Floor:
    """Rooms without a goal: the moves in them, the doors by hand, where tasks may begin, and the states of each cell."""

    mdp: TabularMDP
    doors: tuple[Bottleneck, ...]
    starts: tuple[int, ...]
    cells: tuple[Bottleneck, ...]


class Task(NamedTuple):
    """A task: its start, and the states of its goal."""

    start: int
    goal: Bottleneck


@dataclass(frozen=True)
class Setting:
    """A floor, and how its tasks are learned."""

    floor: str
    how: str


class Cost(NamedTuple):
    """What a session cost: episodes and moves; of its tasks, how many were solved; the mean ratio of paths to the shortest."""

    episodes: int
    moves: int
    solved: int
    ratio: float
    later_episodes: int
    later_moves: int


# ---- floors ----------------------------------------------------------------------------------------------------------


def compass_floor(rows: Sequence[str]) -> Floor:
    """The floor of a text grid; a door is a free cell between two free ones and two walls, on opposite sides each."""
    free = {(r, c) for r, row in enumerate(rows) for c, mark in enumerate(row) if mark != "#"}
    cells = sorted(free)
    number = {cell: n for n, cell in enumerate(cells)}
    around = {cell: [(cell[0] + down, cell[1] + right) for down, right in STEPS] for cell in cells}
    successor = np.array([[number.get(to, number[cell]) for to in around[cell]] for cell in cells], np.int32)
    doors = []
    for cell in cells:
        north, south, west, east = (to in free for to in around[cell])
        if (north and south and not (west or east)) or (west and east and not (north or south)):
            doors.append((number[cell],))
    return _floor(successor, COMPASS, tuple(doors), range(len(cells)), [(n,) for n in range(len(cells))])


def key_floor(rows: Sequence[str]) -> Floor:
    """The floor of a MiniGrid layout: its doors are taking the key, opening the door, and the open door."""
    start, actions, leads = minigrid_moves([row.replace("G", ".") for row in rows])
    numbers, successor = numbered(start, len(actions), leads)
    states: list[At] = list(numbers)
    door = next((r, c) for r, row in enumerate(rows) for c, mark in enumerate(row) if mark == "D")
    entered = [(a, int(b)) for a, onward in enumerate(successor) for b in onward]
    taken = {b for a, b in entered if states[b].has_key and not states[a].has_key}
    opened = {b for a, b in entered if states[b].is_open and not states[a].is_open}
    inside = {n for n, at in enumerate(states) if (at.row, at.column) == door}
    doors = tuple(tuple(sorted(group)) for group in (taken, opened, inside))
    places = sorted({(at.row, at.column) for at in states})
    cells = [tuple(n for n, at in enumerate(states) if (at.row, at.column) == place) for place in places]
    return _floor(successor, actions, doors, [n for n, at in enumerate(states) if not at.has_key], cells)


def _floor(
    successor: Any, actions: Sequence[str], doors: tuple[Bottleneck, ...], starts: Sequence[int], cells: Sequence[Any]
) -> Floor:
    none = np.zeros(len(successor), np.bool_)
    reward = np.full(successor.shape, Rewards().step)
    return Floor(TabularMDP(successor, reward, none, none, 0, tuple(actions)), doors, tuple(starts), tuple(cells))


def drawn_rows(number: int) -> list[str]:
    """The rows of a drawn instance of AdviceBench's family "rooms", without start and goal."""
    (start,), _, leads = rooms(np.random.default_rng([number]))
    free, queue = {start}, [start]
    for cell in queue:
        for action, (down, right) in enumerate(STEPS):
            (entered,) = leads(cell, action)
            there = (cell[0] + down, cell[1] + right) if entered == WON else entered
            if there not in free:
                free.add(there)
                queue.append(there)
    height, width = (1 + max(cell[axis] for cell in free) for axis in (0, 1))
    return ["".join("." if (r, c) in free else "#" for c in range(width)) for r in range(height)]


FLOORS = {
    "four-rooms": lambda: compass_floor(FOUR_ROOMS_ROWS),
    "three-room chain": lambda: compass_floor(CHAIN_ROWS),
    "rooms 1": lambda: compass_floor(drawn_rows(1)),
    "rooms 2": lambda: compass_floor(drawn_rows(2)),
    "far-door": lambda: key_floor(FAR_DOOR_ROWS),
}
EMPTY = "empty"  # a single room, in which nothing is to be found


@cache
def floor_of(name: str) -> Floor:
    """The floor of that name."""
    return compass_floor(EMPTY_ROWS) if name == EMPTY else FLOORS[name]()


def tasks_of(floor: Floor, rng: np.random.Generator, n: int = TASKS) -> list[Task]:
    """Drawn tasks whose goal can be reached from the start in at least FAR_APART moves."""
    tasks: list[Task] = []
    while len(tasks) < n:
        task = Task(
            floor.starts[int(rng.integers(len(floor.starts)))], floor.cells[int(rng.integers(len(floor.cells)))]
        )
        if FAR_APART <= shortest(floor, task) < np.inf:
            tasks.append(task)
    return tasks


def flat_problem(floor: Floor, task: Task) -> SubProblem:
    """The whole floor as the problem of one task."""
    return sub_problem(floor.mdp, np.ones(floor.mdp.n_states, np.bool_), task.goal, [task.start])


def shortest(floor: Floor, task: Task) -> float:
    """The fewest moves of a task, 0 if it begins at its goal, inf if that cannot be reached."""
    return 0.0 if task.start in task.goal else float(fewest_moves(flat_problem(floor, task).mdp)[task.start])


def true_neighbours(floor: Floor) -> dict[int, set[int]]:
    """Which states are one move apart, as whoever gives the doors by hand knows."""
    whole = Experience(floor.mdp.n_states, floor.mdp.n_actions)
    whole.entered[:] = floor.mdp.successor
    return whole.neighbours()


# ---- a session -------------------------------------------------------------------------------------------------------

FLAT, OPTIMISTIC, HAND, FOUND, RANDOM = "flat", "flat, optimistic", "hand-made", "found", "random"
REMEMBERS, OFF = " with memory", ", off-policy"
BOTH = f"{OFF}{REMEMBERS}"
HOWS = (
    *(FLAT, OPTIMISTIC, HAND, FOUND, RANDOM),
    *(f"{how}{OFF}" for how in (HAND, FOUND, RANDOM)),
    *(f"{FLAT}{REMEMBERS}", f"{HAND}{BOTH}", f"{FOUND}{BOTH}"),
)
METHOD = "spectral"  # that finds them in a series


def session_of(floor: Floor, how: str, seed: int) -> Cost:
    """The cost of a session; all ways of learning have the same tasks for the same seed."""
    how, remembers = how.removesuffix(REMEMBERS), how.endswith(REMEMBERS)
    how, off_policy = how.removesuffix(OFF), how.endswith(OFF)
    rng, draw = np.random.default_rng(seed), splitmix.stream(seed)
    tasks = tasks_of(floor, rng)
    experience, levels = Experience(floor.mdp.n_states, floor.mdp.n_actions), None
    episodes = moves = solved = later_episodes = later_moves = 0
    ratios = []
    for number, task in enumerate(tasks):
        until = episodes, moves
        if how == HAND and levels is None:
            levels = TwoLevels(
                floor.mdp, true_neighbours(floor), floor.doors, experience, LEARNER, remembers, off_policy
            )
            episodes, moves = levels.learn_ways(draw)
        path, last = ([], None) if levels is None else levels.solve(task.start, task.goal, draw)
        if last is not None:
            episodes, moves = episodes + last.episodes, moves + last.moves
        length: float = len(path) - 1
        if not path:
            sub = flat_problem(floor, task)
            q0 = practised(sub, experience, LEARNER.discount) if remembers else None
            flat = lesson(sub, optimistic(LEARNER) if how == OPTIMISTIC else LEARNER, experience, draw, q0)
            episodes, moves = episodes + flat.episodes, moves + flat.moves
            length = flat.walk(task.start)
            if how in (FOUND, RANDOM):
                groups, before = _found(how, experience, rng), {} if levels is None else levels.by_signature()
                near = experience.neighbours()
                levels = TwoLevels(floor.mdp, near, groups, experience, LEARNER, remembers, off_policy, before=before)
                more = levels.learn_ways(draw)
                episodes, moves = episodes + more[0], moves + more[1]
        solved += length < np.inf
        ratios.append(length / shortest(floor, task))
        if number >= TASKS // 2:
            later_episodes, later_moves = later_episodes + episodes - until[0], later_moves + moves - until[1]
    reached = [ratio for ratio in ratios if ratio < np.inf]
    return Cost(episodes, moves, solved, float(np.mean(reached)), later_episodes, later_moves)


def _found(how: str, experience: Experience, rng: np.random.Generator) -> list[Bottleneck]:
    if how != RANDOM:
        return bottlenecks(experience, METHOD)
    known = sorted(experience.neighbours())
    number = min(len(bottlenecks(experience, METHOD)), len(known))
    return [(known[n],) for n in sorted(rng.choice(len(known), number, replace=False).tolist())]


# ---- looking for doors -----------------------------------------------------------------------------------------------


class Looked(NamedTuple):
    """What a method found after so many moves: the share of the doors, and how many proposals are none."""

    moves: int
    method: str
    doors: float
    false: int


def looks_of(name: str, seed: int) -> list[Looked]:
    """What each method finds after each of LOOKS moves of a flat learner on task after task."""
    floor, draw = floor_of(name), splitmix.stream(seed)
    experience, rng, looked = Experience(floor.mdp.n_states, floor.mdp.n_actions), np.random.default_rng(seed), []
    near = true_neighbours(floor)
    for most in LOOKS:
        while experience.moves < most:
            (task,) = tasks_of(floor, rng, 1)
            room = most - experience.moves
            lesson(flat_problem(floor, task), replace(LEARNER, episodes=max(1, room // 100)), experience, draw)
        for method in METHODS:
            groups = bottlenecks(experience, method)
            hit = [any(_beside(near, door, group) for group in groups) for door in floor.doors]
            false = sum(not any(_beside(near, door, group) for door in floor.doors) for group in groups)
            looked.append(Looked(most, method, float(np.mean(hit)) if hit else 0.0, false))
    return looked


def _beside(near: Mapping[int, set[int]], door: Bottleneck, group: Bottleneck) -> bool:
    around = set(door)
    for _ in range(BESIDE):
        around |= {other for state in around for other in near[state]}
    return bool(around & set(group))


# ---- the study -------------------------------------------------------------------------------------------------------


def found_subtasks(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every floor and every way of learning; the reading has no effect."""
    settings = [Setting(floor, how) for floor in FLOORS for how in HOWS]
    costs = job.each(partial(costs_of, sessions=job.sessions, seed=job.seed), settings)
    rows = [row for setting in settings for row in rows_of(setting, costs)]
    names = [*FLOORS, EMPTY]
    looks = job.each(partial(all_looks, sessions=min(job.sessions, LOOKING_SESSIONS), seed=job.seed), names)
    rows += [row for name in names for row in looking_rows(name, looks[name])]
    return Findings(rows, in_short(rows), {"Moves of a series of tasks": picture(rows)}, (MEASURES, LOOKING))


def costs_of(setting: Setting, *, sessions: int, seed: int) -> list[Cost]:
    """The costs of the sessions of a setting."""
    seeds = seeds_of(replace(setting, how=""), sessions, seed).tolist()
    return [session_of(floor_of(setting.floor), setting.how, own) for own in seeds]


def all_looks(name: str, *, sessions: int, seed: int) -> list[list[Looked]]:
    """What was found on a floor in each of the sessions."""
    return [looks_of(name, own) for own in seeds_of(Setting(name, ""), sessions, seed).tolist()]


def rows_of(setting: Setting, costs: Mapping[Setting, list[Cost]]) -> list[Row]:
    """The measures of a setting; times_flat and so on: its moves and episodes over those of its rivals, session by session."""
    named: Row = {"problem": setting.floor, "how": setting.how}
    own = np.array(costs[setting])
    rows = [
        varying_row(named, measure, own[:, column])
        for measure, column in (
            ("episodes", 0),
            ("moves", 1),
            ("later_episodes", 4),
            ("later_moves", 5),
            ("path_ratio", 3),
        )
    ]
    rows.append(varying_row(named, "solved_percent", 100.0 * own[:, 2] / TASKS))
    for other in rivals_of(setting.how):
        rival = np.array(costs[Setting(setting.floor, other)])
        for measure, column in (("episodes", 0), ("moves", 1)):
            ratios = np.log(np.maximum(own[:, column], 1) / np.maximum(rival[:, column], 1))
            means = varying_row(named, f"{measure}_times_{other}", ratios)
            ends = means["ci95"] and [float(np.exp(end)) for end in means["ci95"]]
            rows.append({**means, "value": float(np.exp(means["value"])), "ci95": ends})
    return rows


def rivals_of(how: str) -> list[str]:
    """The ways of learning that one is compared with: flat and hand-made, also those of its own kind."""
    same = how.replace(FOUND, HAND).replace(RANDOM, HAND)
    remembering = [f"{FLAT}{REMEMBERS}"] if how.endswith(REMEMBERS) else []
    return [other for other in dict.fromkeys((FLAT, HAND, same, *remembering)) if other != how and other in HOWS]


def looking_rows(name: str, looks: Sequence[Sequence[Looked]]) -> list[Row]:
    """The measures of each method on a floor after so many moves."""
    rows: list[Row] = []
    for at, first in enumerate(looks[0]):
        named: Row = {"problem": name, "method": first.method, "after_moves": first.moves}
        if name != EMPTY:
            rows.append(varying_row(named, "doors_percent", [100.0 * look[at].doors for look in looks]))
        rows.append(varying_row(named, "false", [look[at].false for look in looks]))
    return rows


def in_short(rows: Sequence[Row]) -> Row:
    """The summary: for each way of learning, how many times the flat and the hand-made moves and episodes, by geometric mean."""
    summary: Row = {}
    for how in HOWS:
        told = []
        for other in rivals_of(how):
            for measure in ("episodes", "moves"):
                of = [row["value"] for row in those(rows, how=how, measure=f"{measure}_times_{other}")]
                if of:
                    told.append(f"{float(np.exp(np.log(of).mean())):.2f} of the {measure} of {other}")
        summary[how] = ", ".join(told)
    return summary


def picture(rows: Sequence[Row]) -> bytes:
    """The moves of a series, by floor, without memory."""
    lines = {
        how: [those(rows, problem=floor, how=how, measure="moves")[0] for floor in FLOORS]
        for how in (FLAT, HAND, FOUND, f"{HAND}{OFF}", f"{FOUND}{OFF}", f"{RANDOM}{OFF}")
    }
    return bars(list(FLOORS), lines, f"moves of {TASKS} tasks")
