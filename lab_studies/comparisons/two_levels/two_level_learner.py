"""The kitchen of `flat_world` on two levels: every transfer is learned by itself, then their order from their durations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import greedy_path
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.rules import dispatch
from lab.sequencing.methods.srl_time import srl_time
from lab.sequencing.search import Search
from lab.sequencing.simulate.run import Run
from lab_studies.comparisons.two_levels.kitchen import DROP, PICK, FlatWorld, Kitchen, Way

# Optimistic initial values of 0, as every step costs, make greedy choices explore, as for the flat learner.
LEARNER = LearnerSettings("q", selection="greedy", max_steps=100)
EPISODES = (5, 10, 15, 20, 25, 30, 40, 50)  # stages of learning, in each of which all sub-tasks have as many episodes
TRIES = 50  # the most simulated passes of the sequencer


@dataclass(frozen=True)
class LearnedTransfer:
    """A sub-task after some episodes: the steps that they took, and the learned moves; None if they miss the goal."""

    steps: int
    moves: tuple[int, ...] | None


@dataclass(frozen=True)
class BudgetOutcome:
    """The result of a budget: the makespan in the flat world, None if the task was not finished, and the steps used."""

    makespan: int | None
    used: int


def learned_stages(kitchen: Kitchen, way: Way, seed: Sequence[int]) -> tuple[LearnedTransfer, ...]:
    """A sub-task after each number of EPISODES.

    Each is the lab's own session with the same seed, so that a longer one begins as a shorter one.
    """
    mdp, skills = kitchen.way(way), []
    for episodes in EPISODES:
        learner = replace(LEARNER, episodes=episodes)
        learned = Session(mdp, learner, GateSettings("never"), None, np.random.default_rng(seed)).run()
        _, moves, reached = greedy_path(learned.q, mdp, learner.max_steps)
        skills.append(LearnedTransfer(int(learned.visits.sum()), tuple(moves) if reached else None))
    return tuple(skills)


def steps_in_flat_world(
    world: FlatWorld, cell: Cell, sequence: Sequence[int], moves: Mapping[Way, Sequence[int]], cap: int
) -> int:
    """The steps that a sequence of decisions takes in the flat world if each transfer makes its moves.

    The robot picks again and again until the machine is done. The result is above `cap` if the task is not finished.
    """
    successor, state, steps, run = world.mdp.successor, world.mdp.start, 0, Run(cell)
    for decision in sequence:
        move = run.move(decision)
        for way, action in (((move.start, move.origin), PICK), ((move.origin, move.target), DROP)):
            for step in moves[way] if way[0] != way[1] else ():
                state, steps = int(successor[state, step]), steps + 1
            before = world.carried[state]
            while world.carried[state] == before and steps <= cap:
                state, steps = int(successor[state, action]), steps + 1
    return steps if world.mdp.goal[state] else cap + 1


class TwoLevels:
    """One session: its learned sub-tasks, and the outcome of each budget of steps.

    skills: those of the needed transfers, as `learned_stages` returns them.
    """

    def __init__(
        self,
        kitchen: Kitchen,
        world: FlatWorld,
        parts: int,
        skills: Mapping[Way, tuple[LearnedTransfer, ...]],
        seed: Sequence[int],
    ) -> None:
        self._kitchen, self._world, self._parts, self._seed = kitchen, world, parts, seed
        self._skills = {way: skills[way] for ways in kitchen.needed(parts) for way in ways}
        self._tried: dict[tuple[int, int], BudgetOutcome] = {}

    def outcome(self, budget: int, cap: int, count_simulated: bool) -> BudgetOutcome:
        """The outcome of a budget of steps; a makespan above `cap` counts as None.

        count_simulated: the sequencer's simulated steps count as well, and half of the budget is kept for them; else all
        of it is for the sub-tasks. They all get the same number of episodes, as many as fit.
        """
        fitting = [n for n, used in enumerate(self._low_steps) if used <= (budget // 2 if count_simulated else budget)]
        if not fitting:
            return BudgetOutcome(None, 0)
        stage, tries, low = fitting[-1], TRIES, self._low_steps[fitting[-1]]
        if count_simulated:  # the policy at the end is one pass more
            tries = min(TRIES, (budget - low) // serial_makespan(self._cell(stage, cap)) - 1)
        if tries < 1:
            return BudgetOutcome(None, low)
        if (stage, tries) not in self._tried:
            self._tried[stage, tries] = self._sequenced(stage, tries, cap)
        outcome = self._tried[stage, tries]
        return replace(outcome, used=low + outcome.used * count_simulated)

    @cached_property
    def _low_steps(self) -> list[int]:
        """The steps of all sub-tasks together, by stage (see EPISODES)."""
        return [sum(skill[stage].steps for skill in self._skills.values()) for stage in range(len(EPISODES))]

    def _cell(self, stage: int, cap: int) -> Cell:
        """The cell with the durations learned so far; a transfer that misses its goal takes `cap` steps."""
        moves = {way: skill[stage].moves for way, skill in self._skills.items()}
        return self._kitchen.cell(self._parts, {way: cap if m is None else len(m) for way, m in moves.items()})

    def _sequenced(self, stage: int, tries: int, cap: int) -> BudgetOutcome:
        cell = self._cell(stage, cap)
        learned = srl_time(cell, Search(tries), np.random.default_rng(self._seed))
        simulated = round(sum(learned.episode_costs) + learned.final_cost)
        if learned.cost > cap:
            return BudgetOutcome(None, simulated)
        moves = {way: skill[stage].moves or () for way, skill in self._skills.items()}
        makespan = steps_in_flat_world(self._world, cell, learned.sequence, moves, cap)
        return BudgetOutcome(makespan if makespan <= cap else None, simulated)


def serial_makespan(cell: Cell) -> int:
    """The makespan if every toast is finished before the next one is begun."""
    run = Run(cell)
    dispatch(run, lambda run, allowed: allowed[0])
    return round(run.now_s)
