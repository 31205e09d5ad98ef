"""Learning sessions compiled with numba, in the simulation of `kernels`; tests hold them equal to `session_readable`."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import splitmix
from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods import session_updates as updates
from lab.sequencing.methods.state_keys import Keys
from lab.sequencing.simulate.cell_arrays import CellArrays, Flags, Floats, Ints, RunArrays, most_moves, run_arrays
from lab.sequencing.simulate.kernels import cost, list_allowed, move, reset
from lab.sequencing.simulate.room_kernels import fraction, mixed, uniform

LEARNER_CODES = {"random": 0, "srl": 1, "mc": 2}
DENSE_KEYS = 2**18  # up to so many keys a table is an array by key; above, it is a hash table


class ValueTable(NamedTuple):
    """Values by key. Rows are filled from 1; row 0 holds the value of every key that is not in the table.

    rows: the row by key where `dense`, else a hash table of rows with open addressing. visits: by row, for averages. used (1,):
    the last row filled.
    """

    rows: NDArray[np.int32]
    keys: Ints
    values: Floats
    visits: Ints
    used: Ints
    dense: bool


class LearningRules(NamedTuple):
    """The parameters of a session's updates. learner: one of LEARNER_CODES.

    log_keep, log_take: the logarithms of 1 - alpha and of alpha times discount. end_keep, end_add: the last value of a finished
    episode is multiplied by the first and increased by the second. type_a: whether the reward factor is of type A. offset: see
    `gain`.
    """

    learner: int
    log_keep: float
    log_take: float
    end_keep: float
    end_add: float
    type_a: bool
    offset: float


class Method(NamedTuple):
    """The keys of a session's values and the parameters of its updates."""

    keys: Keys
    rules: LearningRules


class LearningSetup(NamedTuple):
    """The cell in which sessions learn, the same cell without chance, and the method."""

    cell: CellArrays
    calm: CellArrays
    method: Method


class SessionOutcomes(NamedTuple):
    """The results of N sessions of E episodes of up to L moves.

    costs, complete (N, E): of each episode. sequences (N, L): the best decisions so far, then zeros. ends (N, 2): the cost of
    the best sequence and of the final greedy policy.
    """

    costs: Floats
    complete: Flags
    sequences: Ints
    ends: Floats

    @classmethod
    def room(cls, sessions: int, episodes: int, moves: int) -> "SessionOutcomes":
        """Empty arrays for the results."""
        shape = sessions, episodes
        ends = np.zeros((sessions, 2))
        return cls(np.zeros(shape), np.zeros(shape, np.bool_), np.zeros((sessions, moves), np.int64), ends)


class SessionArrays(NamedTuple):
    """The buffers of a session of sequences of up to L moves.

    values: those of the allowed decisions. trail, sequence (L,): the rows and decisions of the present episode. best (L,): the
    incumbent's decisions, then zeros; best_cost (1,): inf without one. stream (1,): the state of the random number generator.
    """

    run: RunArrays
    memory: ValueTable
    values: Floats
    trail: Ints
    sequence: Ints
    best: Ints
    best_cost: Floats
    stream: NDArray[np.uint64]


def value_table(keys: int, rows: int, first: float) -> ValueTable:
    """An empty table for `keys` keys and up to `rows` rows; first: the value of keys that were never visited."""
    rows = min(rows, keys)
    dense = keys <= DENSE_KEYS
    values = np.zeros(rows + 1)
    values[0] = first
    return ValueTable(
        rows=np.zeros(keys if dense else 1 << (2 * rows).bit_length(), np.int32),
        keys=np.zeros(rows + 1, np.int64),
        values=values,
        visits=np.zeros(rows + 1, np.int64),
        used=np.zeros(1, np.int64),
        dense=dense,
    )


def session_arrays(cell: Cell, memory: ValueTable) -> SessionArrays:
    """Empty buffers for a session; `advance` initialises them."""
    run, moves = run_arrays(cell), most_moves(cell)
    trail, sequence, best = np.zeros((3, moves), np.int64)
    return SessionArrays(
        run, memory, np.zeros(len(run.allowed)), trail, sequence, best, np.zeros(1), np.zeros(1, np.uint64)
    )


# ---- Compiled sessions ------------------------------------------------------------------------------------------------


RANDOM, SRL, MONTE_CARLO = (LEARNER_CODES[name] for name in ("random", "srl", "mc"))
_explore, _best_of, _log_sum = inner(updates.explore), inner(updates.best_of), inner(updates.log_sum)
_following = inner(splitmix.following, inline="always")
_gain, _log_factor, _average = inner(updates.gain), inner(updates.log_factor), inner(updates.average)


@inner
def _next_uniform(stream: Any) -> float:
    """`splitmix.stream`."""
    stream[0] = _following(stream[0])
    return float(fraction(mixed(stream[0])))


@inner
def _episode_seed(seed: Any, episode: int) -> Any:
    """`session_readable.episode_seed`."""
    return np.uint64(uniform(~seed, episode) * 2.0**53)


@inner
def _find(memory: Any, key: int) -> Any:
    """The row of a key; 0 when it has none."""
    if memory.dense:
        return np.int64(memory.rows[key])
    mask = np.uint64(len(memory.rows) - 1)
    at = mixed(np.uint64(key)) & mask
    while memory.rows[at] != 0 and memory.keys[memory.rows[at]] != key:
        at = (at + np.uint64(1)) & mask
    return np.int64(memory.rows[at])


@inner
def _add(memory: Any, key: int, value: float, visits: int) -> Any:
    """The new row of a key that has none."""
    row = memory.used[0] + 1
    memory.used[0], memory.keys[row], memory.values[row], memory.visits[row] = row, key, value, visits
    at = np.uint64(key)
    if not memory.dense:
        mask = np.uint64(len(memory.rows) - 1)
        at = mixed(at) & mask
        while memory.rows[at] != 0:
            at = (at + np.uint64(1)) & mask
    memory.rows[at] = row
    return row


@without_refcounts
def copy_rows(memory: Any, larger: Any) -> None:
    """Copies all rows of a table into a larger empty one."""
    for row in range(1, memory.used[0] + 1):
        _add(larger, memory.keys[row], memory.values[row], memory.visits[row])


@inner
def _begin(work: Any, seed: Any) -> None:
    """Clears the values of a session and starts its random numbers from a seed (uint64)."""
    memory = work.memory
    if memory.dense:
        for row in range(1, memory.used[0] + 1):
            memory.rows[memory.keys[row]] = 0
    else:
        memory.rows[:] = 0
    memory.used[0], work.stream[0] = 0, seed
    work.best[:], work.best_cost[0] = 0, np.inf


@inner
def _state_number(keys: Any, run: Any) -> int:
    number = 0
    for part in range(len(run.locations)):
        number += keys.weight[part, run.locations[part]]
        if keys.merged and run.ready_s[part] <= run.clock[0]:
            number += keys.done[run.locations[part]]
    return number


@inner
def _key(cell: Any, keys: Any, run: Any, state: int, i: int) -> Any:
    """`state_keys.key_of` for the i-th allowed decision in the state with this number."""
    part, o = (run.allowed[i] - 1) % len(run.locations), run.options[i]
    here, there = run.locations[part], cell.to[o]
    if keys.pairs:
        label = here + cell.choice[o] * len(cell.begins) if keys.merged else run.allowed[i] - 1
        return state * keys.labels + label
    after = state - keys.weight[part, here] + keys.weight[part, there]
    if keys.merged and run.ready_s[part] <= run.clock[0]:
        after -= keys.done[here]
        if not cell.begins[there]:
            after += keys.done[there]
    return after


@inner
def _choose(cell: Any, keys: Any, work: Any, state: int, count: int, epsilon: float) -> int:
    """`session_readable.choose`: the index of the chosen decision; no number is drawn where only one is allowed."""
    if count == 1:
        return 0
    u = _next_uniform(work.stream)
    if u < epsilon:
        return int(_explore(u, epsilon, count))
    for i in range(count):
        work.values[i] = work.memory.values[_find(work.memory, _key(cell, keys, work.run, state, i))]
    return int(_best_of(work.values, count, (u - epsilon) / (1.0 - epsilon)))


@inner
def _episode(cell: Any, method: Any, work: Any, epsilon: float, seed: Any, learns: bool) -> int:
    """`session_readable.walk`: the number of moves of one episode; with `learns`, SRL updates values after each step."""
    run, memory, keys, rules = work.run, work.memory, method.keys, method.rules
    reset(cell, run, seed)
    moves, row, state = 0, 0, 0
    count = list_allowed(cell, run)
    while count > 0:
        if rules.learner != RANDOM:
            state = _state_number(keys, run)
        i = _choose(cell, keys, work, state, count, epsilon)
        if learns:
            key = _key(cell, keys, run, state, i)
            following = _find(memory, key)
            if following == 0:
                following = _add(memory, key, memory.values[0], 0)
            if rules.learner == SRL and moves > 0:
                value = memory.values[row] + rules.log_keep
                memory.values[row] = _log_sum(value, memory.values[following] + rules.log_take)
            work.trail[moves] = row = following
        work.sequence[moves] = run.allowed[i]
        moves += 1
        move(cell, run, i, seed)
        count = list_allowed(cell, run)
    if learns and moves > 0 and rules.learner == SRL:
        if run.whole[1] == 0:
            memory.values[row] = _log_sum(memory.values[row] + rules.end_keep, rules.end_add)
        else:
            memory.values[row] += rules.log_keep
    return moves


@inner
def _learn(rules: Any, work: Any, moves: int, value: float, best_before: float) -> None:
    """`SessionLearner.end`: updates the values of the visited keys by the episode's cost, once for each visit."""
    memory = work.memory
    if rules.learner == SRL:
        factor = _log_factor(value, best_before, rules.type_a, rules.offset)
        for m in range(moves):
            memory.values[work.trail[m]] += factor
    elif rules.learner == MONTE_CARLO:
        worth = _gain(value, rules.offset)
        for m in range(moves):
            row = work.trail[m]
            memory.values[row] = _average(memory.values[row], memory.visits[row], worth)
            memory.visits[row] += 1


@inner
def _keep(work: Any, value: float, moves: int) -> None:
    """Keeps the present episode as the best so far."""
    work.best_cost[0] = value
    for m in range(len(work.best)):
        work.best[m] = work.sequence[m] if m < moves else 0


@without_refcounts
def advance(learning: Any, work: Any, seeds: Any, epsilons: Any, first: int, found: Any) -> None:
    """Runs a session for each of the seeds (N,) and writes its E episodes and the greedy policy's final cost into `found`.

    first: the number of the first episode: 1, or the next one of a session that is resumed from `work`. epsilons (E,). It is the
    only entry to the compiled sessions, since each further entry would take seconds to compile.
    """
    cell, calm, method = learning.cell, learning.calm, learning.method
    rules = method.rules
    for n in range(len(seeds)):
        if first == 1:
            _begin(work, seeds[n])
        for e in range(len(epsilons)):
            times = _episode_seed(seeds[n], first + e)
            moves = _episode(cell, method, work, epsilons[e], times, rules.learner != RANDOM)
            value, complete = cost(cell, work.run), work.run.whole[1] == 0
            found.costs[n, e], found.complete[n, e] = value, complete
            _learn(rules, work, moves, value, work.best_cost[0])
            if complete and value < work.best_cost[0]:
                _keep(work, value, moves)
        stream = work.stream[0]
        _episode(calm, method, work, 0.0, seeds[n], False)
        work.stream[0] = stream
        found.ends[n, 0], found.ends[n, 1] = work.best_cost[0], cost(calm, work.run)
        for m in range(len(work.best)):
            found.sequences[n, m] = work.best[m]
