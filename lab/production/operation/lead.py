"""A path along which a person leads the arm by hand, read as a demonstration: moves of the problem of one skill.

Source: thesis, section 4.2: a low-level task may be demonstrated by the operator's own steps, or learned with help.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from lab.errors import BadInput, counted
from lab.learning.values import fewest_moves, greedy_moves
from lab.mdp import TabularMDP, distances
from lab.sim.arms.kinematics import ToolPose
from lab.sim.world import Array
from lab.skills import Skill
from lab.skills.state_words import away_in_words
from lab.teaching.lesson_plan import Lesson

OUTSIDE = -1  # of the problem's grid
EVERY = 12  # physics steps between two samples of the tool's pose
NEAR = 2  # most moves between a station's approach and the nearest cell
END, DROP = "end", "drop"


@dataclass(frozen=True)
class Demonstration:
    """A demonstration: moves (state, action) from a start of the problem, without loops, and the state where they end.

    first: the first state, if no start was near the path. left: how often the tool left the grid in between; blocked: the
    visited cells that are not free; the moves lead around both.
    """

    skill: Skill
    moves: dict[int, int]
    first: int
    last: int
    left: int
    blocked: tuple[str, ...]

    @property
    def said(self) -> dict[str, str]:
        """The moves by their labels, in the form of a file of answers."""
        mdp = self.skill.problem.mdp
        return {mdp.state_label(state): mdp.action_labels[action] for state, action in self.moves.items()}

    def judged(self, lesson: Lesson) -> dict[str, Any]:
        """The verdict on it: the numbers of its moves, the learned policy's and the fewest; and whether it was believed."""
        mdp, result = self.skill.problem.mdp, lesson.result
        assert result is not None
        begins = self.first in (mdp.starts or (mdp.start,))
        start = self.first if begins else mdp.start
        learned, fewest = (float(moves[start]) for moves in (greedy_moves(lesson.policy.q, mdp), fewest_moves(mdp)))
        dropped = result.rejected_at_episode
        return {
            "skill": self.skill.name,
            "led_moves": len(self.moves),
            "begins_at_start": begins,
            "reached": bool(mdp.goal[self.last]),
            "left_grid": self.left,
            "blocked": list(self.blocked),
            "learned_moves": int(learned) if learned < np.inf else None,
            "fewest_moves": int(fewest) if fewest < np.inf else None,
            "verdict": "dropped" if dropped is not None else "believed" if result.helped_steps else "not asked for",
            "guided_episodes": int(result.guided.sum()),
            "helped_steps": result.helped_steps,
            "misleads": result.misleads,
            "rejected_at_episode": dropped,
            "policy": lesson.policy.name,
            "advisor": lesson.policy.advisor,
            "failure": lesson.failure,
        }


@dataclass
class Lead:
    """A demonstration in progress: the states in which the tool was seen, without repetitions; OUTSIDE for none."""

    skill: Skill
    visited: list[int] = field(default_factory=list)
    _last: "Seen | None" = None

    @classmethod
    def of(cls, skill: Skill, where: str) -> "Lead":
        """The demonstration for a skill whose states are cells of the tool; BadInput for another skill."""
        if not (skill.moves_arm and skill.problem.mdp.shape):
            raise BadInput(f"{where}: '{skill.name}' is no path through a grid of cells: it cannot be led")
        return cls(skill)

    def see(self, pose: ToolPose) -> None:
        """Adds the present tool pose."""
        self._last = Seen.of(self.skill, pose)
        state = self._last.state
        if not self.visited or self.visited[-1] != state:
            self.visited.append(state)

    def where(self) -> str:
        """The tool's last position, in words."""
        assert self._last is not None
        skill, mdp, (state, cell, beside_m) = self.skill, self.skill.problem.mdp, self._last
        if state != OUTSIDE:
            return skill.in_words(state) + (" That cell is blocked." if mdp.terminal[state] > mdp.goal[state] else "")
        goal = mdp.state_cell(int(np.flatnonzero(mdp.goal)[0]))
        by = [here - there for here, there in zip(cell, goal, strict=True)]
        words = away_in_words(*skill.way_in_words(), by, mdp.action_labels, skill.cell_steps())
        off = f" The grid's plane is {100 * beside_m:.0f} cm away." if beside_m > 0.01 else ""
        return f"Outside the grid: {words[:1].lower()}{words[1:]}{off}"

    def demonstration(self) -> Demonstration:
        """The moves that were led, up to the goal. Gaps between two visited cells are filled with free neighbours.

        A path within NEAR moves of a start begins there, and one that ends within NEAR moves of the goal ends there, because a
        skill moves straight to its start and from its end. Raises BadInput when fewer than two free cells were seen.
        """
        mdp = self.skill.problem.mdp
        free, blocked, left, gone = list[int](), dict[str, None](), 0, False
        for state in self.visited:
            if state == OUTSIDE:
                gone = bool(free)
                continue
            left, gone = left + gone, False
            if mdp.terminal[state] and not mdp.goal[state]:
                blocked[mdp.state_label(state)] = None
                continue
            free.append(state)
            if mdp.goal[state]:
                break
        if free:
            free = _from_start(mdp, free)
            if 0 < fewest_moves(mdp)[free[-1]] <= NEAR:
                free.append(int(np.flatnonzero(mdp.goal)[0]))
        said, at = dict[int, int](), free[0] if free else OUTSIDE
        for state in free[1:]:
            way = _moves_between(mdp, at, state)
            if way is None:
                blocked[mdp.state_label(state)] = None
            else:
                said, at = said | way, state
        moves, state = dict[int, int](), free[0] if free else OUTSIDE
        while state in said and state not in moves:  # the last move in each state leads out of every loop
            moves[state] = said[state]
            state = int(mdp.successor[state, said[state]])
        if not moves:
            raise BadInput(f"lead: the tool was in fewer than two free cells of '{self.skill.name}': {self.where()}")
        return Demonstration(self.skill, moves, free[0], state, left, tuple(blocked))


class Seen(NamedTuple):
    """The tool's position in a skill's grid: the state, or OUTSIDE; the nearest cell, also beyond the border; and the distance
    from that cell's line or plane [m] in a grid of one or two axes."""

    state: int
    cell: tuple[int, ...]
    beside_m: float

    @classmethod
    def of(cls, skill: Skill, pose: ToolPose) -> "Seen":
        """The position of a tool pose; the states' poses lie at equal steps along each axis."""
        shape = skill.problem.mdp.shape
        cells = [(0,) * len(shape), *np.eye(len(shape), dtype=int)]
        first, *others = (
            _numbers(skill.pose(int(np.ravel_multi_index(tuple(cell), shape, mode="clip")))) for cell in cells
        )
        steps = np.stack(others, axis=1) - first[:, None]  # (x, y, z, yaw; axes)
        off = _numbers(pose) - first
        off[3] = (off[3] + np.pi / 2) % np.pi - np.pi / 2  # the gripper is symmetric under half a turn
        along = np.linalg.pinv(steps) @ off
        cell = tuple(np.rint(along).astype(int).tolist())
        beside_m = float(np.linalg.norm((off - steps @ along)[:3]))
        near = beside_m < np.linalg.norm(steps[:3], axis=0).max()
        inside = near and all(0 <= at < size for at, size in zip(cell, shape, strict=True))
        return cls(int(np.ravel_multi_index(cell, shape)) if inside else OUTSIDE, cell, beside_m)


def _from_start(mdp: TabularMDP, states: list[int]) -> list[int]:
    """The states from the one nearest to a start on, with that start first; all states if none is near a start."""
    starts = [*(mdp.starts or (mdp.start,))]
    far = np.where(np.isin(states, starts), 0, distances(mdp.successor, mdp.terminal, mdp.start)[states])
    least = int(far[far >= 0].min(initial=NEAR + 1))
    if least > NEAR:
        return states
    last = int(np.flatnonzero(far == least)[-1])
    return states[last:] if least == 0 else [mdp.start, *states[last:]]


def _numbers(pose: ToolPose) -> Array:
    return np.array([pose.x, pose.y, pose.z, pose.yaw])


def _moves_between(mdp: TabularMDP, start: int, end: int) -> dict[int, int] | None:
    """The moves (state, action) of a shortest path through free states, or None."""
    before: dict[int, tuple[int, int]] = {start: (start, 0)}
    pending = deque([start])
    while pending and end not in before:
        state = pending.popleft()
        for action, entered in enumerate(mdp.successor[state].tolist()):
            if entered not in before and (entered == end or not mdp.terminal[entered]):
                before[entered] = state, action
                pending.append(entered)
    if end not in before:
        return None
    moves, state = list[tuple[int, int]](), end
    while state != start:
        moves.append(before[state])
        state = before[state][0]
    return dict(reversed(moves))


def led_in_words(row: dict[str, Any]) -> str:
    """The text of `Demonstration.judged`, in one line."""
    learned, fewest = row["learned_moves"], row["fewest_moves"]
    said = f"led {counted(row['led_moves'], 'move')}{'' if row['begins_at_start'] else ', not from the start'}"
    said += f"{'' if row['reached'] else ', not to the goal'}"
    said += f"; learned: {'no path' if learned is None else learned}, fewest: {fewest}"
    notes: Sequence[str] = (
        row["left_grid"] and f"it left the grid {counted(row['left_grid'], 'time')}",
        row["blocked"] and f"blocked cells on it: {', '.join(row['blocked'][:4])}",
    )
    for note in filter(None, notes):
        said += f"; {note}: led around through free cells"
    guided, misleads = counted(row["guided_episodes"], "episode"), counted(row["misleads"], "mislead")
    verdict = {
        "believed": f"believed: followed in {guided}, {counted(row['helped_steps'], 'step')}",
        "dropped": f"dropped in episode {row['rejected_at_episode']} after {misleads}",
        "not asked for": "not asked for: the learner found a path before",
    }[row["verdict"]]
    failed = f"; in physics it failed: {row['failure']}" if row["failure"] else ""
    return f"{said}; {verdict}; kept as '{row['policy']}', {row['advisor']}{failed}"
