"""SRL over time where times are left to chance: it goes on learning from wherever the work has got to, and reacts."""

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.srl_time import TimeLearner
from lab.sequencing.simulate.execution import Choose, Observed, Policy

PRACTICE = 20  # simulated episodes before each decision


def reacting(cell: Cell, objective: str = MAKESPAN, seed: int = 0) -> Policy:
    """A policy that, before each decision, learns in a few simulated episodes from what can be seen to the end.

    It sees what stands where and for how long machines have been at work, and takes the mean for what is left. The table
    is the one of `srl_time`, and it is kept from decision to decision and from episode to episode, so that little is
    learned twice. Source: learning real-time A* (Korf 1990), as `srl_time`; certainty equivalence for the times.
    """
    learner = TimeLearner(cell, objective, np.random.default_rng(seed))

    def choose(seen: Observed, allowed: tuple[int, ...]) -> int:
        """The decision that serves the position of least cost to come; of alike parts the one that is ready first."""
        if len(allowed) == 1:
            return allowed[0]
        here = learner.merged.of_run(seen)
        for _ in range(PRACTICE):
            learner.episode(here)
        place, choice, wanted = learner.greedy(here)
        parts = cell.parts
        fitting = [
            d for d in allowed if choice_of(d, parts) == choice and seen.locations[part_of(d, parts) - 1] == place
        ]
        named = [d for d in fitting if part_of(d, parts) == wanted]
        return min(named or fitting, key=lambda d: (seen.ready_s[part_of(d, parts) - 1], d))

    def policy(_cell: Cell) -> Choose:
        return choose

    return policy
