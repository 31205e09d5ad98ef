"""What a list of decisions, and a policy that reacts, come to where times are drawn."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lab.sequencing import SEQUENCERS, carried_reaction, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.search import Search, SequenceResult

REPLICATIONS = 200  # drawn episodes in which a list and a policy are compared
PLANNED = 2000  # of a policy that plans at every decision so many by parts squared, at least FEWEST: it takes its time
FEWEST = 20


def stochastic(
    cell: Cell, method: str, search: Search, found: SequenceResult, chance: Chance, seed: int
) -> dict[str, Any]:
    """The list as it is and a policy that reacts, in the same drawn episodes; means with 95 % intervals."""
    from lab.sequencing.simulate.several import replicate

    fixed = _planned(cell, method, search, found, seed)
    reaction = SEQUENCERS[method].react(cell, search.objective, seed, fixed)
    if search.policy is not None:
        reaction = carried_reaction(search.policy)
    episodes = max(FEWEST, min(REPLICATIONS, PLANNED // cell.parts**2)) if reaction.replans else REPLICATIONS
    costs = [replicate(cell, how, chance, episodes, seed, search.objective) for how in (fixed, reaction.policy)]
    difference = costs[0] - costs[1]
    return {
        "processing": chance.processing,
        "arrivals": chance.arrivals if cell.arrivals else None,
        "spread": chance.spread,
        "robot_breaks_every_s": chance.robot_breaks_every_s,
        "robot_repair_s": chance.robot_repair_s,
        "replications": episodes,
        "fixed": _mean(costs[0]) | {"sequence": list(fixed)},
        "reacting": _mean(costs[1]) | {"policy": reaction.words, "replans": reaction.replans},
        "saved_by_reacting": _mean(difference),
    }


def _planned(cell: Cell, method: str, search: Search, found: SequenceResult, seed: int) -> Sequence[int]:
    """The list to carry out as it is: what the method finds with the mean times."""
    if search.chance == NO_CHANCE:
        return found.sequence
    return find_sequence(cell, method, replace(search, chance=NO_CHANCE, on_episode=None), seed).sequence


def _mean(values: "np.ndarray[Any, np.dtype[np.float64]]") -> dict[str, Any]:
    from lab.statistics import interval

    mean, low, high = interval(values)
    return {"mean": mean, "ci95": [low, high]}
