"""Many sessions for studies: each has its own random numbers, whatever runs it, and with however many others."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import MAKESPAN, check_objective
from lab.sequencing.methods import session_kernels
from lab.sequencing.methods.monte_carlo import MonteCarloAverage
from lab.sequencing.methods.session_kernels import SessionOutcomes, session_arrays, value_table
from lab.sequencing.methods.session_readable import SessionLearner, learn
from lab.sequencing.methods.srl import Srl
from lab.sequencing.methods.state_keys import Keys
from lab.sequencing.search import Search
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import Floats, Ints, cell_arrays, most_moves, run_arrays

METHODS: Mapping[str, type[SessionLearner]] = MappingProxyType(
    {kind.name: kind for kind in (Srl, MonteCarloAverage, SessionLearner)}
)
CHUNK = 2**20  # episodes at once, whose costs take 8 MiB
MOST_ROWS = 2**22  # sessions with a larger table are run one by one, with a table that grows


class Sessions(NamedTuple):
    """The results of N sessions of E episodes, in the order of their numbers.

    best_cost (N,): of the best episode, inf if all ended in deadlocks; sequences (N, L): its decisions, then zeros.
    final_cost (N,): of the final greedy policy with the cell's own times; NaN for random search, which has none.
    convergence (N,): the first episode from which the cost stays the same to the end (eq. 7.1). costs (N, E): empty unless
    asked for.
    """

    best_cost: Floats
    final_cost: Floats
    convergence: Ints
    sequences: Ints
    costs: Floats


def run_sessions(
    cell: Cell, method: str, search: Search, sessions: int, seed: int, *, keep_costs: bool = False
) -> Sessions:
    """The results of so many sessions of a seed by a method of METHODS; `search.on_episode` is not called.

    Session n has the same random numbers however many there are. With chance, every episode of every session has its own
    times. Raises BadInput for an unknown method, for fewer than 1 session, and as `learn` does.
    """
    if method not in METHODS:
        raise unknown("method", method, METHODS, "sessions")
    if sessions < 1:
        raise BadInput(f"sessions = {sessions}: allowed are whole numbers from 1")
    search.check(cell)
    seeds = session_seeds(seed, sessions)
    size = max(1, CHUNK // search.episodes)
    chunks = []
    for n in range(0, sessions, size):
        chunk = _chunk(cell, METHODS[method], search, seeds[n : n + size])
        chunks.append(chunk if keep_costs else chunk._replace(costs=chunk.costs[:0]))
    return Sessions(*(np.concatenate(parts) for parts in zip(*chunks, strict=True)))


def evaluate(
    cell: Cell,
    sequences: Sequence[Sequence[int]],
    seeds: Sequence[int],
    chance: Chance = NO_CHANCE,
    objective: str = MAKESPAN,
) -> Floats:
    """The costs (N, M) of N sequences in M episodes; an episode's seed gives the same times as in `chance.Episode`.

    An incomplete sequence costs as much as a deadlock. Raises BadInput for an objective that the cell does not have, and for
    a sequence that it cannot carry out.
    """
    check_objective(objective, cell)
    lengths = np.array([len(sequence) for sequence in sequences], np.int64)
    rows = np.zeros((len(sequences), lengths.max(initial=0)), np.int64)
    for row, sequence in zip(rows, sequences, strict=True):
        row[: len(sequence)] = sequence
    costs = np.zeros((len(sequences), len(seeds)))
    arrays = cell_arrays(cell, objective, chance)
    kernels.follow_all(arrays, run_arrays(cell), rows, lengths, np.array(seeds, np.uint64), costs)
    for sequence in (sequences[n] for n in np.flatnonzero(np.isnan(costs).any(axis=1)).tolist()):
        raise BadInput(f"sequence {list(sequence)}: it has a decision that is not allowed where it stands")
    return costs


def session_seeds(seed: int, sessions: int) -> NDArray[np.uint64]:
    """The seeds of sessions 0 to `sessions` - 1."""
    return np.asarray(SeedSequence(seed).generate_state(sessions, np.uint64), np.uint64)


def _chunk(cell: Cell, kind: type[SessionLearner], search: Search, seeds: NDArray[np.uint64]) -> Sessions:
    """The results of some sessions, with all their costs."""
    keys, moves = kind.keys(cell, search.settings), most_moves(cell)
    if keys is None or min(keys.size, search.episodes * moves) > MOST_ROWS:
        outcomes = SessionOutcomes.room(len(seeds), search.episodes, moves)
        for n, seed in enumerate(seeds.tolist()):
            learned = learn(cell, replace(search, on_episode=None), seed, kind)
            outcomes.costs[n], outcomes.ends[n] = learned.log.costs, (learned.log.best_cost, learned.final_cost)
            outcomes.sequences[n, : len(learned.log.best)] = learned.log.best
    else:
        outcomes = _together(cell, kind(search), search, keys, seeds)
    if kind is SessionLearner:
        outcomes.ends[:, 1] = np.nan
    return Sessions(
        outcomes.ends[:, 0], outcomes.ends[:, 1], _convergence(outcomes.costs), outcomes.sequences, outcomes.costs
    )


def _together(
    cell: Cell, learner: SessionLearner, search: Search, keys: Keys, seeds: NDArray[np.uint64]
) -> SessionOutcomes:
    """The outcomes of sessions in one compiled call."""
    moves, epsilons = most_moves(cell), [learner.epsilon(episode) for episode in range(1, search.episodes + 1)]
    outcomes = SessionOutcomes.room(len(seeds), search.episodes, moves)
    work = session_arrays(cell, value_table(keys.size, search.episodes * moves, learner.first))
    session_kernels.advance(learner.learning(cell, keys), work, seeds, np.array(epsilons), 1, outcomes)
    learner.check(float(outcomes.costs.min()))
    return outcomes


def _convergence(costs: Floats) -> Ints:
    """The first episode (N,) of each session's last episodes of equal cost. Source: thesis eq. 7.1 and its listing."""
    changes = costs[:, 1:] != costs[:, :-1]
    episode = np.arange(2, costs.shape[1] + 1)
    return np.asarray(np.max(np.where(changes, episode, 1), axis=1, initial=1), np.int64)
