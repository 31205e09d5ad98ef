"""A policy or a list, carried out in episodes whose times are drawn: once, or in many with the same times for all."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode, drawn_seed
from lab.sequencing.cell.objectives import MAKESPAN, check_objective, cost
from lab.sequencing.simulate.execution import Execution, Policy, one_by_one
from lab.sequencing.simulate.run import Run
from lab.sequencing.simulate.several import dispatched


def carry_out(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """What a policy makes of one episode, to the end or to a deadlock; several robots or servers as `several.Dispatch` says."""
    if not cell.serial:
        return dispatched(cell, policy, times)
    return one_by_one(cell, policy, times)


def _followed(cell: Cell, sequence: Sequence[int], times: Episode) -> Run:
    """The run of a list of decisions, to where one would pick its part too late by these times."""
    run = Run(cell, times)
    for decision in sequence:
        if run.spoils(decision):
            break
        run.move(decision)
    return run


def replicate(
    cell: Cell, how: Policy | Sequence[int], chance: Chance, episodes: int, seed: int, objective: str = MAKESPAN
) -> NDArray[np.float64]:
    """The cost of a policy, or of a fixed list, in each of so many episodes (episodes,); in seconds, for most objectives.

    Episode n meets the same times whatever is carried out, and however many episodes there are: common random numbers,
    so compare two policies by their differences. A deadlock costs `stuck_cost`, and so does a part that a list would pick
    too late. Raises BadInput for fewer than 1
    episode, a negative seed, an objective that the cell does not allow, and a list that is not one of the cell's.
    Source: thesis App. III (50 replications).
    """
    check_objective(objective, cell)
    for name, value, least in (("episodes", episodes, 1), ("seed", seed, 0)):
        if value < least:
            raise BadInput(f"{name} = {value}: allowed are whole numbers from {least}")
    rng, costs = np.random.default_rng(seed), np.empty(episodes)
    for number in range(episodes):
        times = Episode(cell, chance, drawn_seed(rng))
        run = carry_out(cell, how, times).run if callable(how) else _followed(cell, how, times)
        if not run.done and not callable(how) and run.allowed() and not cell.has_windows:
            raise BadInput(f"the sequence ends after {counted(len(how), 'move')}, but not every part is finished")
        costs[number] = cost(run, objective)
    return costs
