"""Known problems as tables: MiniGrid's empty, door-key and lava layouts, and the order of toasts."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from lab.mdp import IntArray, Rewards, TabularMDP

AHEAD = ((0, 1), (1, 0), (0, -1), (-1, 0))  # right, down, left, up: row and column
LEFT, RIGHT, FORWARD, PICK_UP, TOGGLE = range(5)
TURNS = ("left", "right", "forward", "pick up", "toggle")
EMPTY_ROWS = ("S.....", "......", "......", "......", "......", ".....G")
DOOR_KEY_ROWS = ("S.#.", "..#.", "k.D.", "..#G")
FAR_DOOR_ROWS = ("S..#..", "...#..", "..k#..", "...D..", "...#..", "...#.G")
FOUR_ROOMS_ROWS = ("S..#....", "...#....", "........", "...#....", "#.####.#", "...#....", "........", "...#...G")
CROSSING_ROWS = ("S.~....", "..~....", "....~..", "..~.~..", "..~.~..", "..~.~..", "..~.~.G")
LAVA_ROWS = ("S..~...", "...~...", "...~...", "...~...", ".......", "...~...", "...~..G")
WON, LOST = "won", "lost"
ENDS = {"G": WON, "~": LOST}

Leads = Callable[[Any, int], Any]  # (hashable state, action) -> the next state; WON and LOST end an episode


class At(NamedTuple):
    """The state of a MiniGrid agent: row, column, heading (an index of AHEAD), whether it has the key, and the door is open."""

    row: int
    column: int
    facing: int = 0
    has_key: bool = False
    is_open: bool = False


def explored(start: Any, actions: Sequence[str], leads: Leads) -> TabularMDP:
    """The decision problem of all states that can be reached from `start`, numbered as they are met, with the lab's rewards."""
    rewards = Rewards()
    numbers, successor = numbered(start, len(actions), leads)
    goal, lost = (np.array([state == end for state in numbers]) for end in (WON, LOST))
    reward = np.where(goal[successor], rewards.goal, np.where(lost[successor], rewards.collision, rewards.step))
    reward[goal | lost] = 0.0
    return TabularMDP(successor, reward, goal | lost, goal, 0, tuple(actions))


def numbered(start: Any, n_actions: int, leads: Leads) -> tuple[dict[Any, int], IntArray]:
    """The number of each state that can be reached from `start`, as they are met, and the number that each action leads to."""
    queue, rows = [start], []
    numbers: dict[Any, int] = {start: 0}
    for state in queue:
        row = []
        for action in range(n_actions):
            entered = state if state in (WON, LOST) else leads(state, action)
            if entered not in numbers:
                numbers[entered] = len(numbers)
                queue.append(entered)
            row.append(numbers[entered])
        rows.append(row)
    return numbers, np.array(rows, np.int32)


def minigrid(rows: Sequence[str]) -> TabularMDP:
    """The problem of a layout: S start (facing right), G goal, # wall, ~ lava, k key, D locked door; walls surround it.

    Actions turn left and right and go forward, with a door also pick up and toggle; one without effect stays. Lava ends the
    episode. A key blocks its cell until it is picked up; toggling from the front with the key opens the door. Source: the
    rules of Chevalier-Boisvert et al. 2023; rewards are the lab's, as MiniGrid's depend on the time.
    """
    return explored(*minigrid_moves(rows))


def minigrid_moves(rows: Sequence[str]) -> tuple[At, tuple[str, ...], Leads]:
    """The start, the actions and the moves of a layout, see `minigrid`."""
    cells = {(r, c): mark for r, row in enumerate(rows) for c, mark in enumerate(row)}
    (start,) = (cell for cell, mark in cells.items() if mark == "S")
    doors = "D" in cells.values()

    def leads(at: At, action: int) -> At | str:
        if action in (LEFT, RIGHT):
            return at._replace(facing=(at.facing + (1 if action == RIGHT else -1)) % len(AHEAD))
        down, right = AHEAD[at.facing]
        ahead = at.row + down, at.column + right
        mark = cells.get(ahead, "#")
        if action == PICK_UP:
            return at._replace(has_key=at.has_key or mark == "k")
        if action == TOGGLE:
            return at._replace(is_open=at.is_open or (mark == "D" and at.has_key))
        if mark in ENDS:
            return ENDS[mark]
        shut = mark == "#" or (mark == "k" and not at.has_key) or (mark == "D" and not at.is_open)
        return at if shut else at._replace(row=ahead[0], column=ahead[1])

    return At(*start), TURNS if doors else TURNS[:3], leads


TOASTS, TOASTING, BUTTERING, SLOTS = 3, 4, 2, 2  # times in steps of 10 s
BREAD, IN_TOASTER, TOASTED, IN_APPLIER, BUTTERED, DONE = range(6)


Toasts = tuple[tuple[int, int], ...]  # the stage of each toast, and the steps that it still stays there


def toast_order() -> TabularMDP:
    """The problem of the order in which the robot moves three toasts. A step is 10 s, and the fewest steps are the makespan.

    Each toast is bread, in the toaster (two slots, 40 s), toasted, under the butter applier (one, 20 s), buttered, done. An
    action moves one toast to its next stage, or waits; a move that cannot be made is a wait. The model has no more.
    """

    def leads(toasts: Toasts, action: int) -> Toasts | str:
        moved = None
        if action < TOASTS:
            stage, _ = toasts[action]
            room = sum(toast[0] in (IN_TOASTER, TOASTED) for toast in toasts) < SLOTS
            free = all(toast[0] not in (IN_APPLIER, BUTTERED) for toast in toasts)
            if stage == BREAD and room:
                moved = (IN_TOASTER, TOASTING)
            elif stage == TOASTED and free:
                moved = (IN_APPLIER, BUTTERING)
            elif stage == BUTTERED:
                moved = (DONE, 0)
        after = []
        for number, (stage, left) in enumerate(toasts):
            if number == action and moved is not None:
                after.append(moved)
            elif stage in (IN_TOASTER, IN_APPLIER):
                after.append((stage, left - 1) if left > 1 else (stage + 1, 0))
            else:
                after.append((stage, left))
        return WON if all(stage == DONE for stage, _ in after) else tuple(after)

    moves = tuple(f"move toast {number + 1}" for number in range(TOASTS))
    return explored(((BREAD, 0),) * TOASTS, (*moves, "wait"), leads)
