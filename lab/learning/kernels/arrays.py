"""The records of the kernel, made for a problem, a learner, a gate and an advisor."""

from functools import lru_cache
from math import log
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import selection
from lab.learning.advice_memory import Memory, places
from lab.learning.chance_table import ChanceTable
from lab.learning.environment import Environment
from lab.learning.gates import GATES
from lab.learning.gates.gate import WEIGHS_NOTHING
from lab.learning.gates.heard import Heard
from lab.learning.kernels import records
from lab.learning.kernels.records import LANES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import SPEAKS_ALWAYS, SPEAKS_AS_EXPECTED, Advice
from lab.learning.updates import UPDATES
from lab.learning.updates.tabular import TRACE_FLOOR
from lab.learning.updates.update import AFTERSTATE, DYNA, OWN_RULE, Q_TRACES, SARSA, SARSA_TRACES, Q
from lab.mdp import FloatArray, TabularMDP

SPARE_TRACES = 32  # room for new traces before the kernel has to move the others to the beginning


def hearing_of(
    mdp: TabularMDP, asking: records.Asking, advice: Advice | None, learner: LearnerSettings
) -> records.Hearing | None:
    """The arrays for gates that weigh advice and for advisors that hold back; None if neither is the case."""
    weighs = asking.gate.weighs != WEIGHS_NOTHING
    if advice is None or (not weighs and speaks_at_once(advice)):
        return None
    states, actions = mdp.successor.shape if weighs else (1, 1)
    moves = learner.max_steps if weighs else 1
    table = states * actions
    cells = (np.zeros((LANES, size), np.int32) for size in (states, table, table, table, states, moves, states, states))
    told = Heard._make(
        (*cells, np.zeros((LANES, table)), np.zeros((LANES, 2 * states)), np.zeros(LANES, records.HEARD_NOW))
    )
    chose = np.zeros((LANES, mdp.n_states if advice.speaks == SPEAKS_AS_EXPECTED else 0), np.int32)
    return records.Hearing(
        heard=told,
        values=np.zeros((LANES, mdp.n_actions)),
        u=np.zeros(LANES),
        before=np.zeros(LANES, np.int64),
        chose=chose,
        late=advice.late,
        speaks=advice.speaks,
        several=float(bool(mdp.starts)),
    )


def walks_for(
    mdp: TabularMDP, asking: records.Asking, learning: records.CompiledLearner, episodes: int
) -> records.Walks | None:
    """The arrays for gates that judge episodes which begin in different states; None otherwise."""
    if not asking.gate.judges or len(mdp.starts) < 2:
        return None
    walk, begun = np.zeros((LANES, learning.max_moves), np.int32), np.zeros((LANES, episodes), np.int32)
    return records.Walks(np.full((LANES, mdp.n_states), np.inf), walk, begun)


def chances_of(place: Environment) -> records.Chances | None:
    return records.Chances(place.below, place.entered, place.reward) if isinstance(place, ChanceTable) else None


def lookahead_of(mdp: TabularMDP, learner: LearnerSettings, moves: int) -> records.Lookahead | None:
    """The arrays of learners that need the next action; None for others."""
    form, numbers = UPDATES[learner.learner].compiled, mdp.successor.size
    by_rule = form == OWN_RULE and UPDATES[learner.learner].make.lookahead  # type: ignore[attr-defined]
    if form not in (SARSA, Q_TRACES, SARSA_TRACES) and not by_rule:
        return None
    decay, most = 0.0 if form in (SARSA, OWN_RULE) else learner.discount * learner.trace, min(moves, numbers)
    if decay < 1.0:  # a trace of at most 1 / (1 - decay) is soon below the floor
        lasts = log(TRACE_FLOOR * (1.0 - decay)) / log(decay) if decay else 0.0
        most = min(most, int(lasts) + 2)
    most += SPARE_TRACES
    return records.Lookahead(
        number=np.zeros(LANES, np.uint64),
        reward=np.zeros(LANES),
        listed=np.zeros((LANES, most), np.uint32),
        strength=np.zeros((LANES, most)),
        first=np.zeros(LANES, np.uint64),
        last=np.zeros(LANES, np.uint64),
        decay=decay,
        growing=not learner.replacing,
        on_policy=form != Q_TRACES,
    )


def model_of(mdp: TabularMDP, learner: LearnerSettings) -> records.Model | None:
    """The arrays of Dyna-Q; None for other learners."""
    if UPDATES[learner.learner].compiled != DYNA:
        return None
    size = LANES, mdp.successor.size
    return records.Model(
        entered=np.full(size, -1, np.int32),
        reward=np.zeros(size),
        moves=np.zeros(size, np.int32),
        known=np.zeros(LANES, np.int64),
        turn=np.zeros(LANES, np.int64),
        planning=learner.planning,
    )


class Kept(NamedTuple):
    """What of many sessions is kept besides their steps: tables, returns, and the greedy policy each so many episodes.

    walks: the episodes that measure the policy once.
    """

    tables: bool = False
    returns: bool = False
    greedy_every: int = 0
    walks: int = 1


def sessions_of(learner: LearnerSettings, seeds: NDArray[np.uint64], size: int, kept: Kept) -> records.KernelSessions:
    """The inputs and empty results of sessions with these seeds; size: of a table, flat."""
    shape, every = (len(seeds), learner.episodes), kept.greedy_every
    return records.KernelSessions(
        seeds=np.asarray(seeds, np.uint64),
        warm=_temperatures(learner.episodes, learner.beta, learner.exploration),
        steps=np.zeros(shape, np.int32),
        guided=np.zeros(shape, np.bool_),
        counts=np.zeros(len(seeds), records.COUNTS),
        kept=np.zeros((len(seeds) if kept.tables else 0, size)),
        greedy=np.zeros((len(seeds), learner.episodes // every if every else 0)),
        every=max(1, every),
        walks=kept.walks,
        walk_rng=np.zeros(1, np.uint64),
        walk_moves=np.zeros(size, np.int64),
        returns=np.zeros((len(seeds) if kept.returns else 0, learner.episodes)),
    )


@lru_cache
def _temperatures(episodes: int, beta: float, exploration: float) -> FloatArray:
    """The temperature, or epsilon, of each episode, (E,); nobody writes to it, as it is made once for many calls."""
    return np.array([selection.temperature(n, beta, exploration) for n in range(1, episodes + 1)])


def lanes_of(actions: int, episodes: int, size: int, ensemble: int) -> records.Lanes:
    lane = np.zeros(LANES, records.LANE)
    lane["session"], lane["episode"] = -1, episodes
    return records.Lanes(
        lane=lane,
        values=np.zeros(actions * LANES),
        best=np.zeros(LANES),
        widths=np.zeros(LANES),
        warm=np.ones(LANES),
        per_tau=np.zeros(LANES),
        chosen=np.zeros(LANES, np.int64),
        moves=np.zeros(LANES, np.int64),
        states=np.zeros(LANES, np.uint64),
        rng=np.zeros(LANES, np.uint64),
        fresh=np.ones(LANES, np.bool_),
        is_open=np.zeros(LANES, np.bool_),
        returned=np.zeros(LANES),
        tables=np.zeros((LANES, size)),
        others=np.zeros((LANES, ensemble, size)),
    )


def memories_of(states: int, actions: int, moves: int) -> Memory:
    walk = places(states, moves)
    sizes = (states * actions, states, states, states, states, states, walk, walk)  # as the fields of Memory
    cells = (np.zeros((LANES, size), np.int32) for size in sizes)
    return Memory._make((*cells, np.zeros(LANES, records.NOW)))


def is_afterstate(learner: LearnerSettings) -> bool:
    return bool(UPDATES[learner.learner].compiled == AFTERSTATE) and learner.tilings == 1


def problem_of(mdp: TabularMDP, learner: LearnerSettings) -> records.ProblemArrays:
    ends = np.where(mdp.goal, 1, np.where(mdp.terminal, 2, 0)).astype(np.uint8)
    starts = np.array(mdp.starts or (mdp.start,), np.int64)
    arrival, step_reward = (mdp.arrival, mdp.step_reward) if is_afterstate(learner) else (np.zeros(1), 0.0)
    return records.ProblemArrays(mdp.successor.flatten(), mdp.reward.flatten(), arrival, ends, starts, step_reward)


def learning_of(mdp: TabularMDP, learner: LearnerSettings) -> records.CompiledLearner:
    given = vars(learner) | {
        "afterstate": is_afterstate(learner),
        "max_moves": learner.max_steps - learner.count_start,
        "selection": SELECTIONS[learner.selection].compiled,
        "replays": UPDATES[learner.learner].compiled in (Q, AFTERSTATE, DYNA),
        "actions": (0,) * mdp.n_actions,
    }
    return records.CompiledLearner(**{name: given[name] for name in records.CompiledLearner._fields})


def asking_of(gate: GateSettings, somebody: bool, max_steps: int) -> records.Asking:
    rules: Any = GATES[gate.gate if somebody else "never"].compiled
    judges_unhelped = gate.judge_unhelped and not (gate.memory or gate.by_evidence)
    return records.Asking(rules, numbers_of(records.GateNumbers, gate), judges_unhelped, max_steps)


def numbers_of(kind: Any, settings: LearnerSettings | GateSettings) -> Any:
    """The numbers of settings as a record of that kind."""
    return kind(**{field: getattr(settings, field) for field in kind._fields})


def action_values(mdp: TabularMDP, learning: records.CompiledLearner, tables: FloatArray) -> FloatArray:
    """Tables as (N, S, A) action values, zeros in terminal states."""
    if not learning.afterstate:
        return tables.reshape(-1, *mdp.successor.shape)
    q = (
        mdp.step_reward + learning.discount * tables[:, mdp.successor]
        if len(tables)
        else np.zeros((0, *mdp.successor.shape))
    )
    q[:, mdp.terminal] = 0.0
    return q


def speaks_at_once(advice: Advice) -> bool:
    return not advice.late and advice.speaks == SPEAKS_ALWAYS
