"""Sessions that learn the values of decisions in episodes: the readable form; `session_kernels` holds the compiled one.

Each choice takes the next of the session's uniform numbers, and the chance of each episode has its own seed, so both forms give
the same sequences, costs and values. The compiled form is used wherever a state fits in 63 bits.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import log

import numpy as np

from lab.errors import BadInput
from lab.learning.splitmix import MASK, stream, uniform
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.methods import session_kernels
from lab.sequencing.methods import session_kernels as arrays
from lab.sequencing.methods.session_updates import best_of, explore, log_of
from lab.sequencing.methods.state_keys import Key, Keys, State, decoded, key_of, keys_of, no_keys
from lab.sequencing.search import Log, Search, SrlSettings
from lab.sequencing.simulate.cell_arrays import cell_arrays, most_moves
from lab.sequencing.simulate.run import Run

Table = dict[State, dict[int, float]]
END_REWARD = 1.5  # the reward of the last state in the thesis's listings, which keep values per state
BLOCK = 256  # episodes of a compiled session between two reports to the listener
ROWS = 2**16  # initial rows of a table, which grows when they are full


@dataclass
class Values:
    """Values by state and decision; first: the value of keys that were never visited."""

    first: float
    held: dict[Key, float] = field(default_factory=dict)

    def __getitem__(self, key: Key) -> float:
        return self.held.get(key, self.first)

    def __setitem__(self, key: Key, value: float) -> None:
        self.held[key] = value

    def table(self) -> Table:
        """The values by state, then by decision."""
        table: Table = {}
        for (state, decision), value in self.held.items():
            table.setdefault(state, {})[decision] = value
        return table


class SessionLearner:
    """The update rules of a session. This base class learns nothing and draws decisions uniformly: random search."""

    name = "random"
    first = 0.0

    def __init__(self, search: Search) -> None:
        self._search = search
        settings, keep = search.settings, log_of(1 - search.settings.alpha)
        per_state = settings.values == "states"
        self.rules = arrays.LearningRules(
            learner=arrays.LEARNER_CODES[self.name],
            log_keep=keep,
            log_take=log_of(settings.alpha * settings.discount),
            end_keep=log_of(settings.discount) if per_state else keep,
            end_add=log(END_REWARD) if per_state else log_of(0.0),
            type_a=settings.factor == "A",
            offset=0.0 if search.objective == MAKESPAN else 1.0,
        )

    def learning(self, cell: Cell, keys: Keys) -> arrays.LearningSetup:
        """The parameters of the compiled session in a cell; keys: those of its settings."""
        there = cell_arrays(cell, self._search.objective, self._search.chance)
        return arrays.LearningSetup(there, cell_arrays(cell, self._search.objective), arrays.Method(keys, self.rules))

    def epsilon(self, episode: int) -> float:
        """The probability of a random decision in an episode, numbered from 1."""
        return 1.0

    @staticmethod
    def keys(cell: Cell, settings: SrlSettings) -> Keys | None:
        """The keys of its values when compiled; None when they do not fit in 63 bits."""
        return no_keys(cell)

    def check(self, cost: float) -> None:
        """BadInput for a cost that it cannot learn from."""

    def step(self, values: Values, key: Key, following: Key | None, complete: bool) -> None:
        """Updates a value once the following decision is chosen; following None: the episode is over, `complete` or not."""

    def end(self, values: Values, trail: list[Key], cost: float, best_before: float) -> None:
        """Updates values after an episode; trail: the visited keys, in order."""


class GreedyLearner(SessionLearner):
    """A learner that keeps values and chooses epsilon-greedily by them, with falling epsilon."""

    def __init__(self, search: Search) -> None:
        super().__init__(search)
        self.beta = search.settings.beta

    def epsilon(self, episode: int) -> float:
        """The probability of a random decision, eq. 5.1."""
        return float(episode**-self.beta)

    @staticmethod
    def keys(cell: Cell, settings: SrlSettings) -> Keys | None:
        """The keys by pairs or by next states, as the settings say."""
        return keys_of(cell, settings.values, settings.state)

    def check(self, cost: float) -> None:
        """BadInput for a makespan of 0 s, of which there is no 1 / T."""
        if self.rules.offset + cost <= 0:
            raise BadInput(f"makespan {cost} s: {self.name} learns from 1 / T and needs one above 0")


@dataclass(frozen=True)
class LearnedSession:
    """The results of a session: its episodes, the final greedy policy's cost, and the values."""

    log: Log
    final_cost: float
    table: Table


class Guide:
    """A hook that may replace decisions of a readable session; this base class replaces none."""

    def begins(self, episode: int) -> None:
        """An episode begins, numbered from 1."""

    def decide(self, run: Run, allowed: tuple[int, ...], own: int) -> int:
        """The allowed decision to take; `own` is the learner's."""
        return own

    def ends(self, cost: float) -> None:
        """The episode has ended with this cost."""


@dataclass
class _Session:
    """The state of a readable session."""

    cell: Cell
    search: Search
    learner: SessionLearner
    draw: Callable[[], float]
    values: Values
    guide: Guide = field(default_factory=Guide)


def learn(cell: Cell, search: Search, seed: int, kind: type[SessionLearner]) -> LearnedSession:
    """The results of a session; it is compiled unless its states do not fit in 63 bits. seed: 0 to 2**64 - 1.

    Raises BadInput for an objective that the cell lacks data for, and for a cost of 0 where the learner needs 1 / T.
    """
    search.check(cell)
    keys = kind.keys(cell, search.settings)
    if keys is None:
        return learn_readably(cell, search, seed, kind)
    return learn_compiled(cell, search, seed, kind, keys)


def learn_readably(
    cell: Cell, search: Search, seed: int, kind: type[SessionLearner], guide: Guide | None = None
) -> LearnedSession:
    """`learn` in Python, one move after the other; a guide may replace every decision and is told each episode's cost."""
    learner = kind(search)
    session = _Session(cell, search, learner, stream(seed), Values(learner.first))
    session.guide = guide or session.guide
    noted = Log(search)
    for episode in range(1, search.episodes + 1):
        times = Episode(cell, search.chance, episode_seed(seed, episode))
        session.guide.begins(episode)
        run, sequence, trail = walk(session, times, learner.epsilon(episode), learns=True)
        value = cost(run, search.objective)
        learner.check(value)
        learner.end(session.values, trail, value, noted.best_cost)
        noted.note(tuple(sequence), value, run.done)
        session.guide.ends(value)
    session.guide = Guide()
    run, _, _ = walk(session, Episode(cell), 0.0, learns=False)
    return LearnedSession(noted, cost(run, search.objective), session.values.table())


def walk(session: _Session, times: Episode, epsilon: float, learns: bool) -> tuple[Run, list[int], list[Key]]:
    """The run of one episode, its decisions, and the keys of their values."""
    run, sequence, trail = Run(session.cell, times), list[int](), list[Key]()
    while allowed := run.allowed():
        keys = [key_of(run, decision, session.search.settings) for decision in allowed]
        chosen = choose(keys, session.values, epsilon, session.draw)
        chosen = allowed.index(session.guide.decide(run, allowed, allowed[chosen]))
        if learns and trail:
            session.learner.step(session.values, trail[-1], keys[chosen], complete=False)
        trail.append(keys[chosen])
        sequence.append(allowed[chosen])
        run.move(allowed[chosen])
    if learns and trail:
        session.learner.step(session.values, trail[-1], None, run.done)
    return run, sequence, trail


def choose(keys: list[Key], values: Values, epsilon: float, draw: Callable[[], float]) -> int:
    """The index of a random decision with probability epsilon, else of one of highest value; nothing is drawn for a single key.

    One uniform number decides whether to explore and, rescaled, which decision to take. Source: thesis eq. 5.1.
    """
    if len(keys) == 1:
        return 0
    u = draw()
    if u < epsilon:
        return explore(u, epsilon, len(keys))
    return best_of([values[key] for key in keys], len(keys), (u - epsilon) / (1.0 - epsilon))


def episode_seed(seed: int, episode: int) -> int:
    """The seed of the chance in an episode of a session."""
    return int(uniform(~seed & MASK, episode) * 2.0**53)


def learn_compiled(cell: Cell, search: Search, seed: int, kind: type[SessionLearner], keys: Keys) -> LearnedSession:
    """`learn`, compiled; keys: those of its settings."""
    learner, noted, longest = kind(search), Log(search), most_moves(cell)
    learning = learner.learning(cell, keys)
    memory = arrays.value_table(keys.size, min(search.episodes * longest, max(ROWS, BLOCK * longest)), learner.first)
    work, seeds = arrays.session_arrays(cell, memory), np.array([seed], np.uint64)
    final_cost = 0.0
    for first in range(1, search.episodes + 1, BLOCK):
        numbers = range(first, min(first + BLOCK, search.episodes + 1))
        work = _with_room(work, keys, len(numbers) * longest)
        outcomes = arrays.SessionOutcomes.room(1, len(numbers), longest)
        epsilons = np.array([learner.epsilon(episode) for episode in numbers])
        session_kernels.advance(learning, work, seeds, epsilons, first, outcomes)
        sequence, final_cost = tuple(outcomes.sequences[outcomes.sequences > 0].tolist()), float(outcomes.ends[0, 1])
        for value, done in zip(outcomes.costs[0].tolist(), outcomes.complete[0].tolist(), strict=True):
            learner.check(value)
            noted.note(sequence, value, done)
    return LearnedSession(noted, final_cost, _table(keys, work.memory))


def _with_room(work: arrays.SessionArrays, keys: Keys, rows: int) -> arrays.SessionArrays:
    """The buffers with a table that has room for `rows` more rows, or for all keys."""
    memory, full = work.memory, int(work.memory.used[0]) + rows
    if full < len(memory.keys) or len(memory.keys) > keys.size:
        return work
    larger = arrays.value_table(keys.size, 2 * full, float(memory.values[0]))
    session_kernels.copy_rows(memory, larger)
    return work._replace(memory=larger)


def _table(keys: Keys, memory: arrays.ValueTable) -> Table:
    """The values of a compiled table by state and decision, as in `key_of`."""
    table: Table = {}
    filled = slice(1, int(memory.used[0]) + 1)
    for key, value in zip(memory.keys[filled].tolist(), memory.values[filled].tolist(), strict=True):
        state, label = decoded(keys, key)
        table.setdefault(state, {})[label + 1 if keys.pairs else 0] = value
    return table
