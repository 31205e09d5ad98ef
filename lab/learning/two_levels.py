"""A two-level hierarchy over bottlenecks: a policy for each way from a region to a bottleneck, and an order of them for a task.

The lower level is learned by the lab's own learners, in sub-problems with a goal of their own (options: Sutton, Precup and Singh
1999). The upper level is a shortest path through a small graph, whose edges are as long as the learned ways.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import count

import numpy as np

from lab.errors import BadInput
from lab.learning.bottlenecks import Bottleneck, Experience, Neighbours, RecordedTable
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.values import fewest_moves, greedy_moves, known_values
from lab.mdp import BoolArray, FloatArray, IntArray, Rewards, TabularMDP, greedy_path

ROOM = 1.1  # a way counts as learned if it is at most so many times as long as the shortest one
LOOKED = 5  # episodes between two looks at whether a way is learned from all of its starts
NEVER = -1e3  # value of a move whose outcome is not known, below that of any path
UNSEEN, APART = -1, -2  # labels of states that are in no region: never entered; a bottleneck, or an end of episodes

Way = tuple[int, int]  # the numbers of the region that it leads through, and of the bottleneck that it leads to


@dataclass(eq=False)
class Learned:
    """A learned policy: its problem, its action values (S, A), the states it may start in, and what it cost."""

    problem: TabularMDP
    q: FloatArray
    starts: frozenset[int]
    episodes: int = 0
    moves: int = 0
    result: SessionResult | None = None

    def walk(self, start: int) -> float:
        """The number of moves from `start` to the goal, inf if they miss it."""
        return float(greedy_moves(self.q, self.problem)[start])


@dataclass(eq=False)
class TwoLevels:
    """The hierarchy over these bottlenecks of a problem.

    mdp: the problem; near: which states are one move apart, as far as is known; groups: the bottlenecks.
    experience: receives the moves of all lessons. learner: the settings of each lesson, whose start values are `optimistic`.
    remembers: whether a lesson begins with the values of the moves that are already known, so that it only learns what they leave
    open. off_policy: whether ways have no lessons of their own, but are learned from all moves that were made, whatever for
    (intra-option learning: Sutton, Precup and Singh 1998, with replay). ways: the learned ways, see `learn_ways`; before: ways
    learned before, by the signature of their problem, to use again.
    """

    mdp: TabularMDP
    near: Neighbours
    groups: Sequence[Bottleneck]
    experience: Experience
    learner: LearnerSettings
    remembers: bool = False
    off_policy: bool = False
    ways: dict[Way, Learned] = field(default_factory=dict)
    before: Mapping[str, Learned] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.regions = regions(self.mdp.n_states, self.near, self.groups)
        self.borders = [
            [n for n, group in enumerate(self.groups) if any(self.regions[b] == r for a in group for b in self.near[a])]
            for r in range(int(self.regions.max(initial=-1)) + 1)
        ]

    def problem(self, region: int, goal: Collection[int], starts: Collection[int] | None = None) -> "SubProblem":
        """The problem of reaching `goal` within a region and the bottlenecks around it. Raises BadInput if nothing leads there.

        starts: where its episodes begin; default: all of these states. States from which the known moves do not lead to the goal
        are left out. A move into another region is like one against a wall.
        """
        inside = self.regions == region
        around = np.flatnonzero(inside).tolist()
        for number in self.borders[region]:
            inside[list(self.groups[number])] = True
            around += self.groups[number]
        leads = _leading(self.near, self.mdp, around, goal)
        begins = sorted({*(around if starts is None else starts)} & leads - {*goal})
        if not begins:
            raise BadInput(f"sub-task: no known move leads to the states {sorted(goal)} from region {region}")
        return sub_problem(self.mdp, inside, goal, begins)

    def learn_ways(self, draw: Draw) -> tuple[int, int]:
        """The episodes and the moves in which the ways are learned: from each region to each bottleneck around it.

        Off-policy these are none, and a way starts in the states from which the moves made so far lead to its bottleneck.
        """
        episodes = moves = 0
        for region, numbers in enumerate(self.borders):
            for number in numbers:
                try:
                    sub = self.problem(region, self.groups[number])
                except BadInput:
                    continue  # nobody has gone there from here, as through a door that lets people out only
                way = self._off_policy(sub) if self.off_policy else self.before.get(sub.mdp.signature)
                if way is None:
                    way = self._learned(sub, draw)
                    episodes, moves = episodes + way.episodes, moves + way.moves
                self.ways[region, number] = way
        return episodes, moves

    def by_signature(self) -> dict[str, Learned]:
        """The ways by the signature of their problem, for the `before` of a later hierarchy."""
        return {**self.before, **{way.problem.signature: way for way in self.ways.values()}}

    def solve(self, start: int, goal: Collection[int], draw: Draw) -> tuple[list[int], Learned | None]:
        """(states, last): the path to a goal by the ways learned and a last one, which is learned now; [] if there is none.

        Each episode of the last way begins at `start`: the moves to its region count, too. `last` is None without a region.
        """
        if self.off_policy:
            self.learn_ways(draw)  # from what was moved since
        reached = self._reached(start)
        flat = sub_problem(self.mdp, np.ones(self.mdp.n_states, np.bool_), goal, [start]).mdp
        enough = float(np.floor(ROOM * fewest_moves(flat)[start]))
        target = {int(self.regions[state]) for state in goal} - {UNSEEN, APART}
        in_groups = [n for n, group in enumerate(self.groups) if set(goal) & set(group)]
        target |= {r for r, numbers in enumerate(self.borders) if set(numbers) & set(in_groups)}
        best: tuple[list[int], Learned | None] = [], None
        for region in sorted(target):
            entries = {s for n in self.borders[region] for s in self.groups[n] if s in reached}
            entries |= {start} if self.regions[start] == region else set()
            entries -= set(goal)
            try:
                sub = self.problem(region, goal, entries)
            except BadInput:
                continue
            last = self._learned(sub, draw, {state: len(reached[state]) - 1 for state in starts_of(sub.mdp)}, enough)
            for entry in starts_of(sub.mdp):
                states, _, is_there = greedy_path(last.q, last.problem, self.learner.max_steps, entry)
                whole = reached[entry] + states[1:]
                if is_there and (not best[0] or len(whole) < len(best[0])):
                    best = whole, last
        return best

    def _reached(self, start: int) -> dict[int, list[int]]:
        """The path by learned ways from `start` to each state in which one ends, the shortest first; `start` itself included."""
        paths: dict[int, list[int]] = {}
        tie = count()
        queue: list[tuple[int, int, list[int]]] = [(0, next(tie), [start])]
        while queue:
            _, _, path = heappop(queue)
            if path[-1] in paths:
                continue
            paths[path[-1]] = path
            for way in self.ways.values():
                if path[-1] in way.starts:
                    states, _, is_there = greedy_path(way.q, way.problem, self.learner.max_steps, path[-1])
                    if is_there and states[-1] not in paths:
                        heappush(queue, (len(path) + len(states) - 2, next(tie), path + states[1:]))
        return paths

    def _off_policy(self, sub: "SubProblem") -> Learned:
        """The policy of a sub-problem by the moves made so far; it starts where they alone lead to the goal."""
        q = practised(sub, self.experience, self.learner.discount, unknown=NEVER)
        own = np.arange(sub.mdp.n_states)[:, None]
        made = np.where(self.experience.entered >= 0, sub.mdp.successor, own)
        walks = greedy_moves(q, replace(sub.mdp, successor=made.astype(np.int32)))
        return Learned(sub.mdp, q, frozenset(state for state in starts_of(sub.mdp) if np.isfinite(walks[state])))

    def _learned(
        self, sub: "SubProblem", draw: Draw, approach: dict[int, int] | None = None, enough: float = 0.0
    ) -> Learned:
        """The policy of a sub-problem, learned until it is good; approach, enough: see `lesson`."""
        q0 = practised(sub, self.experience, self.learner.discount) if self.remembers else None
        return lesson(sub, optimistic(self.learner), self.experience, draw, q0, approach, enough)


@dataclass(frozen=True, eq=False)
class SubProblem:
    """A sub-problem, and (S, A) bool, which of its moves are walled: they would lead out of it, and are not made."""

    mdp: TabularMDP
    walled: BoolArray


def regions(n_states: int, near: Neighbours, groups: Sequence[Bottleneck]) -> IntArray:
    """The number of each state's region, (S,) int32: what is connected without the bottlenecks; otherwise UNSEEN or APART."""
    label = np.full(n_states, UNSEEN, np.int32)
    apart = {state for group in groups for state in group}
    label[list(apart)] = APART
    number = 0
    for first in sorted(near):
        if label[first] != UNSEEN:
            continue
        frontier = {first}
        while frontier:
            label[list(frontier)] = number
            frontier = {other for state in frontier for other in near[state] if label[other] == UNSEEN}
        number += 1
    return label


def sub_problem(mdp: TabularMDP, inside: BoolArray, goal: Collection[int], starts: Sequence[int]) -> SubProblem:
    """The problem of reaching one of the states `goal` without leaving `inside` (S,), with the lab's default rewards.

    The problem's own goals are walled like all states outside; its other terminal states end an episode as they do there.
    """
    rewards, own = Rewards(), np.arange(mdp.n_states, dtype=np.int32)[:, None]
    goals = np.zeros(mdp.n_states, np.bool_)
    goals[list(goal)] = True
    lost = mdp.terminal & ~mdp.goal & ~goals
    inside = inside & ~mdp.terminal & ~goals
    walled = ~(inside | goals | lost)[mdp.successor]
    successor = np.where(walled | ~inside[:, None], own, mdp.successor).astype(np.int32)
    reward = np.where(goals[successor], rewards.goal, np.where(lost[successor], rewards.collision, rewards.step))
    reward[~inside] = 0.0
    several = tuple(starts) if len(starts) > 1 else ()
    table = TabularMDP(successor, reward, ~inside, goals, starts[0], mdp.action_labels, mdp.shape, (), several)
    return SubProblem(table, walled)


def optimistic(learner: LearnerSettings) -> LearnerSettings:
    """The settings with the highest reward as start value; from many starts, a learner would otherwise keep to detours."""
    return replace(learner, start_value=Rewards().goal)


def practised(sub: SubProblem, experience: Experience, discount: float, unknown: float = Rewards().goal) -> FloatArray:
    """The action values (S, A) of a sub-problem by the moves already made; unknown: of others, by default the highest reward."""
    known = (experience.entered >= 0) | sub.walled | sub.mdp.terminal[:, None]
    return known_values(sub.mdp, known, np.full(sub.mdp.successor.shape, unknown), discount)


def lesson(
    sub: SubProblem,
    learner: LearnerSettings,
    experience: Experience,
    draw: Draw,
    q0: FloatArray | None = None,
    approach: dict[int, int] | None = None,
    enough: float = 0.0,
) -> Learned:
    """The policy of a sub-problem, learned alone until its greedy path from every start is good, or for `learner.episodes`.

    Good is a path of at most ROOM times the fewest moves. q0: (S, A), the start values; if they are good, nothing is learned.
    approach: the moves to each start, which each episode that begins there costs, too; default: none. enough: the lesson ends,
    too, when the path from one start has at most so many moves, its approach included.
    """
    mdp = sub.mdp
    starts = np.array(starts_of(mdp))
    most = np.floor(ROOM * fewest_moves(mdp)[starts])
    ahead = np.array([(approach or {}).get(state, 0) for state in starts.tolist()])

    def good(q: FloatArray) -> bool:
        walks = greedy_moves(q, mdp)[starts]
        return bool((walks <= most).all() or (ahead + walks <= enough).any())

    everywhere = frozenset(starts.tolist())
    if q0 is not None and good(q0):
        return Learned(mdp, q0, everywhere)
    place = _Placed(mdp, experience, sub.walled, approach or {})
    session = Session(place, learner, GateSettings(gate="never"), None, draw, q0)
    every = 1 if approach or len(starts) == 1 else LOOKED
    result = session.run(enough=lambda: session.episode % every == 0 and good(session.update.table()))
    if result.interrupted:
        raise KeyboardInterrupt
    moves = int(result.visits.sum()) + place.approached
    return Learned(mdp, result.q, everywhere, len(result.steps), moves, result)


class _Placed(RecordedTable):
    """The environment of a lesson, which adds up the moves to the states in which its episodes begin."""

    def __init__(self, mdp: TabularMDP, experience: Experience, walled: BoolArray, approach: dict[int, int]) -> None:
        super().__init__(mdp, experience, walled)
        self.approach, self.approached = approach, 0

    def reset(self, episode: int, draw: Draw) -> int:
        state = super().reset(episode, draw)
        self.approached += self.approach.get(state, 0)
        return state


def starts_of(mdp: TabularMDP) -> tuple[int, ...]:
    """The states in which episodes may begin."""
    return mdp.starts or (mdp.start,)


def _leading(near: Neighbours, mdp: TabularMDP, among: Collection[int], goal: Collection[int]) -> set[int]:
    """The states among these from which moves between states that are known lead to the goal."""
    known = {*among, *goal} & {*near}
    before: dict[int, set[int]] = {}
    for state in known:
        for entered in set(mdp.successor[state].tolist()) & known & near[state]:
            before.setdefault(entered, set()).add(state)
    reached = frontier = {*goal} & known
    while frontier:
        frontier = {state for entered in frontier for state in before.get(entered, ())} - reached
        reached = reached | frontier
    return reached
