"""Families of drawn problems, which AdviceBench holds out: nobody looked at how any rule does on them when constants were chosen.

An instance is drawn by numpy's generator, seeded by (seed, family, number), until it is fit for measuring (see `drawn`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any
from zlib import crc32

import numpy as np

from lab.gym.transition_model import TransitionModel
from lab.learning.chance_table import ChanceTable, Outcome
from lab.learning.environment import Judged
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, Rewards, TabularMDP
from lab_studies.comparisons.advice_bench.layouts import LOST, WON

SEED = 2026  # of the instances, if a run names no other
LEAST_STEPS, MOST_STEPS = 5, 100  # mean steps of an instance's best policy
SURE = 0.99  # the least chance with which the best policy reaches a goal within an episode
WAY_OF_MAZE = (36, 44)  # moves from start to goal, "about 40"
COMPASS = ("north", "south", "west", "east")
STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1))  # row and column of each move
SAME_WORTH = 1.01  # a policy with at most this ratio of mean steps to the best one's solves a stochastic problem

Cell = tuple[int, int]
Leads = Callable[
    [Any, int], Mapping[Any, float]
]  # (state, action) -> the chance of each next state; WON and LOST are ends


@dataclass(frozen=True, eq=False)
class Drawn:
    """An instance: its table (of the likeliest moves), its model, its optimal values (S, A), its environment if moves vary."""

    mdp: TabularMDP
    model: TransitionModel
    values: FloatArray
    chances: "DrawnChances | None"


class DrawnChances(ChanceTable):
    """The environment of an instance with stochastic moves, which judges a policy by its exact mean steps."""

    def __init__(
        self, mdp: TabularMDP, outcomes: Sequence[Sequence[Outcome]], best: FloatArray, model: TransitionModel
    ):
        super().__init__(mdp, outcomes, best)
        self._exact = model

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """Solved: the greedy policy reaches the goal as surely as is asked of the best one, in at most 1 % more mean steps."""
        own, best = (
            self._exact.worth(table.argmax(axis=1), learner.max_steps - learner.count_start)
            for table in (q, self._best)
        )
        final, optimal = (
            round(worth.steps) + learner.count_start if worth.reaches >= SURE else None for worth in (own, best)
        )
        return Judged(final, optimal, final is not None and own.steps <= SAME_WORTH * best.steps)


def drawn(family: str, number: int, learner: LearnerSettings, seed: int = SEED) -> Drawn:
    """The instance of that number. One that is not fit is drawn again from the same generator.

    Fit is an instance whose best policy reaches a goal within an episode with a chance of SURE, in LEAST_STEPS to MOST_STEPS
    mean steps, over all starts. learner: its discount and its step limit count, nothing else.
    """
    rng = np.random.default_rng([seed, crc32(family.encode()), number])
    while True:
        parts = FAMILIES[family](rng)
        instance = None if parts is None else _explored(*parts, learner.discount)
        if instance is None:
            continue
        worth = instance.model.worth(instance.values.argmax(axis=1), learner.max_steps)
        if worth.reaches >= SURE and LEAST_STEPS <= worth.steps <= MOST_STEPS:
            return instance


Parts = tuple[Sequence[Any], Sequence[str], Leads]  # the starts, the names of the actions, where they lead


def _explored(starts: Sequence[Any], actions: Sequence[str], leads: Leads, discount: float) -> Drawn | None:
    """The instance of all states that can be reached, numbered as they are met; None if a start never leads to a goal."""
    rewards, queue = Rewards(), list(dict.fromkeys(starts))
    numbers = {state: number for number, state in enumerate(queue)}
    rows: list[list[tuple[float, int]]] = []
    for state in queue:
        for action in range(len(actions)):
            row = []
            for entered, chance in ({state: 1.0} if state in (WON, LOST) else leads(state, action)).items():
                if entered not in numbers:
                    numbers[entered] = len(numbers)
                    queue.append(entered)
                row.append((chance, numbers[entered]))
            rows.append(row)
    size, width = len(queue), len(actions)
    leads_on, count = {numbers[WON]} if WON in numbers else set(), -1
    while count < (count := len(leads_on)):
        leads_on |= {number // width for number, row in enumerate(rows) if any(to in leads_on for _, to in row)}
    if not leads_on.issuperset(range(len(set(starts)))):
        return None
    goal, lost = (np.array([state == end for state in queue]) for end in (WON, LOST))
    terminal = goal | lost
    gain = np.where(goal, rewards.goal, np.where(lost, rewards.collision, rewards.step)).tolist()
    outcomes: list[list[Outcome]] = [
        [(chance, entered, 0.0 if terminal[number // width] else gain[entered]) for chance, entered in row]
        for number, row in enumerate(rows)
    ]
    successor = np.array([max(row, key=lambda outcome: outcome[0])[1] for row in rows], np.int32).reshape(size, width)
    reward = np.where(terminal[:, None], 0.0, np.array(gain)[successor])
    several = tuple(range(len(set(starts)))) if len(set(starts)) > 1 else ()
    mdp = TabularMDP(successor, reward, terminal, goal, 0, tuple(actions), starts=several)
    first = np.zeros(size)
    first[list(several or (0,))] = 1.0 / max(1, len(several))
    steps = {
        state: {
            action: [(*outcome, bool(terminal[outcome[1]])) for outcome in outcomes[state * width + action]]
            for action in range(width)
        }
        for state in range(size)
    }
    model = TransitionModel(steps, first, width)
    values = model.optimal(discount)
    varies = any(len(row) > 1 for row in rows)
    return Drawn(mdp, model, values, DrawnChances(mdp, outcomes, values, model) if varies else None)


def _certain(leads: Callable[[Any, int], Any]) -> Leads:
    return lambda state, action: {leads(state, action): 1.0}


def _summed(outcomes: Iterable[tuple[Any, float]]) -> dict[Any, float]:
    """The chance of each next state, where several outcomes lead to the same."""
    chances: dict[Any, float] = {}
    for entered, chance in outcomes:
        chances[entered] = chances.get(entered, 0.0) + chance
    return chances


def _two_of(rng: np.random.Generator, cells: Sequence[Any]) -> tuple[Any, Any]:
    first, second = rng.choice(len(cells), 2, replace=False).tolist()
    return cells[first], cells[second]


def _moved(cell: Cell, action: int) -> Cell:
    down, right = STEPS[action]
    return cell[0] + down, cell[1] + right


# ---- the families ---------------------------------------------------------------------------------------------------


def rooms(rng: np.random.Generator) -> Parts:
    """2 to 4 by 2 to 4 rooms of 2 to 4 by 2 to 4 cells: a tree of doors joins all, and a fifth of the other walls has one."""
    heights, widths = (rng.integers(2, 5, size=rng.integers(2, 5)).tolist() for _ in range(2))
    tops, lefts = ([sum(sizes[:n]) + n for n in range(len(sizes))] for sizes in (heights, widths))
    free = {
        (top + down, left + right)
        for top, height in zip(tops, heights, strict=True)
        for left, width in zip(lefts, widths, strict=True)
        for down in range(height)
        for right in range(width)
    }
    cells = sorted(free)
    grid = [(i, j) for i in range(len(heights)) for j in range(len(widths))]
    walls = [(room, _moved(room, action)) for room in grid for action in (1, 3) if _moved(room, action) in grid]
    joined = {room: number for number, room in enumerate(grid)}
    for number in rng.permutation(len(walls)).tolist():
        (i, j), other = walls[number]
        apart, opens = joined[i, j] != joined[other], rng.random() < 0.2
        if not (apart or opens):
            continue
        old, new = joined[other], joined[i, j]
        joined = {room: new if mark == old else mark for room, mark in joined.items()}
        if other[0] > i:
            free.add((tops[other[0]] - 1, lefts[j] + int(rng.integers(widths[j]))))
        else:
            free.add((tops[i] + int(rng.integers(heights[i])), lefts[other[1]] - 1))
    start, goal = _two_of(rng, cells)

    def leads(cell: Cell, action: int) -> Any:
        entered = _moved(cell, action)
        return WON if entered == goal else entered if entered in free else cell

    return [start], COMPASS, _certain(leads)


def hanoi(rng: np.random.Generator) -> Parts | None:
    """The towers of Hanoi with 3 to 5 discs on 3 or 4 pegs, from one legal state to another; an illegal move stays."""
    discs, pegs = int(rng.integers(3, 6)), int(rng.integers(3, 5))
    start, goal = (
        tuple(rng.integers(pegs, size=discs).tolist()) for _ in range(2)
    )  # the peg of each disc, small ones first
    moves = list(permutations(range(pegs), 2))
    if start == goal:
        return None

    def leads(on: tuple[int, ...], action: int) -> Any:
        origin, target = moves[action]
        if origin not in on or (target in on and on.index(target) < on.index(origin)):
            return on
        disc = on.index(origin)
        entered = (*on[:disc], target, *on[disc + 1 :])
        return WON if entered == goal else entered

    return [start], [f"peg {origin + 1} to {target + 1}" for origin, target in moves], _certain(leads)


def one_way_towns(rng: np.random.Generator) -> Parts:
    """5 to 10 by 5 to 10 crossings of one-way streets, a tenth of whose blocks are closed; 6 to 12 starts, one goal."""
    height, width = rng.integers(5, 11, size=2).tolist()
    east, south = rng.random(height) < 0.5, rng.random(width) < 0.5  # the direction of each street
    closed = (
        rng.random((height, width, 2)) < 0.1
    ).tolist()  # the block that leaves a crossing along the row, the column
    crossings = [(i, j) for i in range(height) for j in range(width)]
    drawn_cells = rng.choice(len(crossings), 1 + int(rng.integers(6, 13)), replace=False).tolist()
    goal, *starts = (crossings[number] for number in drawn_cells)

    def leads(at: Cell, action: int) -> Any:
        entered, along = _moved(at, action), 0 if action >= 2 else 1
        allowed = east[at[0]] == (action == 3) if along == 0 else south[at[1]] == (action == 1)
        inside = 0 <= entered[0] < height and 0 <= entered[1] < width
        if not (allowed and inside) or closed[at[0]][at[1]][along]:
            return at
        return WON if entered == goal else entered

    return starts, COMPASS, _certain(leads)


def windy_grids(rng: np.random.Generator) -> Parts:
    """5 to 8 by 7 to 12 cells; in some columns a wind of 1 or 2 cells blows, a third of the time one less, a third one more.

    Source: Sutton and Barto 2018, exercise 6.10, with drawn sizes, winds, starts and goals. The wind is that of the column left.
    """
    height, width = int(rng.integers(5, 9)), int(rng.integers(7, 13))
    winds = rng.choice([0, 0, 1, 1, 2], size=width).tolist()
    up = -1 if rng.random() < 0.5 else 1
    cells = [(i, j) for i in range(height) for j in range(width)]
    start, goal = _two_of(rng, cells)

    def leads(cell: Cell, action: int) -> Mapping[Any, float]:
        down, right = _moved(cell, action)
        wind = winds[cell[1]]
        outcomes: list[tuple[Any, float]] = []
        for strength in (wind, wind - 1, wind + 1) if wind else (0,):
            entered = min(max(down + up * strength, 0), height - 1), min(max(right, 0), width - 1)
            outcomes.append((WON if entered == goal else entered, 1.0 / 3.0 if wind else 1.0))
        return _summed(outcomes)

    return [start], COMPASS, leads


def long_mazes(rng: np.random.Generator) -> Parts | None:
    """Perfect mazes of 8 to 12 by 8 to 12 cells, with exactly one path of about 40 moves from start to goal."""
    height, width = rng.integers(8, 13, size=2).tolist()
    cells = [(i, j) for i in range(height) for j in range(width)]
    start = cells[int(rng.integers(len(cells)))]
    joined: set[tuple[Cell, Cell]] = set()
    depth, path = {start: 0}, [start]
    while path:
        at = path[-1]
        new = [cell for action in range(4) if (cell := _moved(at, action)) in cells and cell not in depth]
        if not new:
            path.pop()
            continue
        cell = new[int(rng.integers(len(new)))]
        joined |= {(at, cell), (cell, at)}
        depth[cell] = depth[at] + 1
        path.append(cell)
    far = [cell for cell in cells if WAY_OF_MAZE[0] <= depth[cell] <= WAY_OF_MAZE[1]]
    if not far:
        return None
    goal = far[int(rng.integers(len(far)))]

    def leads(cell: Cell, action: int) -> Any:
        entered = _moved(cell, action)
        if (cell, entered) not in joined:
            return cell
        return WON if entered == goal else entered

    return [start], COMPASS, _certain(leads)


def traps(rng: np.random.Generator) -> Parts | None:
    """6 to 10 by 6 to 10 cells: of those beside a drawn shortest path two thirds are deadly, of the others a tenth."""
    height, width = rng.integers(6, 11, size=2).tolist()
    cells = [(i, j) for i in range(height) for j in range(width)]
    start, goal = _two_of(rng, cells)
    rows, columns = goal[0] - start[0], goal[1] - start[1]
    moves = rng.permutation([1 if rows > 0 else 0] * abs(rows) + [3 if columns > 0 else 2] * abs(columns)).tolist()
    way = [start]
    for action in moves:
        way.append(_moved(way[-1], action))
    beside = {_moved(cell, action) for cell in way for action in range(4)} - {*way}
    deadly = {cell for cell in cells if cell not in way and rng.random() < (2.0 / 3.0 if cell in beside else 0.1)}
    if not deadly:
        return None

    def leads(cell: Cell, action: int) -> Any:
        entered = _moved(cell, action)
        if entered in deadly:
            return LOST
        inside = 0 <= entered[0] < height and 0 <= entered[1] < width
        return WON if entered == goal else entered if inside else cell

    return [start], COMPASS, _certain(leads)


def inventory(rng: np.random.Generator) -> Parts:
    """A shop that sells 8 to 15 pieces in as few days as possible, with room for 4 to 8. A step is a day.

    Each day the order of the day before arrives, and is refused whole if it does not fit; then customers ask for 0 to 3 pieces,
    and what is not there is not sold; an action orders for the next day.
    """
    room, wanted = int(rng.integers(4, 9)), int(rng.integers(8, 16))
    sizes = (0, *sorted((1 + rng.choice(room, 3, replace=False)).tolist()))
    weights = rng.integers(1, 6, size=4)
    demand = (weights / weights.sum()).tolist()

    def leads(day: tuple[int, int, int], action: int) -> Mapping[Any, float]:
        stock, ordered, sold = day
        stock += ordered if stock + ordered <= room else 0
        outcomes: list[tuple[Any, float]] = []
        for asked, chance in enumerate(demand):
            sells = min(asked, stock)
            entered = WON if sold + sells >= wanted else (stock - sells, sizes[action], sold + sells)
            outcomes.append((entered, chance))
        return _summed(outcomes)

    return [(int(rng.integers(room + 1)), 0, 0)], [f"order {size}" for size in sizes], leads


def queues(rng: np.random.Generator) -> Parts:
    """One server for 2 or 3 queues of up to 3 customers, who serves 6 to 12 customers in as few steps as possible.

    An action goes to a queue, or, if the server is there, serves its first customer, which succeeds with the queue's own chance.
    In each step at most one customer arrives; one whose queue is full leaves.
    """
    count, most = int(rng.integers(2, 4)), 3
    wanted = int(rng.integers(6, 13 if count == 2 else 10))
    served_by = (rng.integers(4, 10, size=count) / 10).tolist()
    weights = rng.integers(1, 5, size=count + 1)
    arrives = (weights / weights.sum()).tolist()  # the last one: nobody
    start = (tuple(rng.integers(most + 1, size=count).tolist()), int(rng.integers(count)), 0)

    def leads(state: tuple[tuple[int, ...], int, int], action: int) -> Mapping[Any, float]:
        waiting, at, served = state
        serves = served_by[action] if at == action and waiting[action] else 0.0
        outcomes: list[tuple[Any, float]] = []
        for done, chance in ((1, serves), (0, 1.0 - serves)):
            if served + done >= wanted and chance:
                outcomes.append((WON, chance))
                continue
            left = tuple(number - done * (queue == action) for queue, number in enumerate(waiting))
            for where, share in enumerate(arrives):
                if chance:
                    after = tuple(min(most, number + (queue == where)) for queue, number in enumerate(left))
                    outcomes.append(((after, action, served + done), chance * share))
        return _summed(outcomes)

    return [start], [f"queue {number + 1}" for number in range(count)], leads


FAMILIES: Mapping[str, Callable[[np.random.Generator], Parts | None]] = {
    "rooms": rooms,
    "hanoi": hanoi,
    "one-way-towns": one_way_towns,
    "windy-grids": windy_grids,
    "long-mazes": long_mazes,
    "traps": traps,
    "inventory": inventory,
    "queues": queues,
}
