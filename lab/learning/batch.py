"""Many sessions at once, for studies: `run_sessions` prepares the arrays of the compiled kernel and returns its results.

Settings without a compiled form run in the interactive session, one after the other: slower, with the same results.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning import selection, splitmix
from lab.learning.chance_table import ChanceTable, keeps_steps
from lab.learning.environment import Environment, TableEnvironment
from lab.learning.gates import GATES
from lab.learning.gates.gate import ASKS_WHERE_TABLES_DIFFER, WEIGHS_NOTHING, WEIGHS_TRUST
from lab.learning.greedy import measure_greedy, walks_of
from lab.learning.kernels import arrays as made
from lab.learning.kernels import linear_loop, records
from lab.learning.kernels.arrays import Kept
from lab.learning.kernels.session_loop import run
from lab.learning.own_rules import runs_compiled, tell_uncompiled
from lab.learning.physics.cells import CellTable
from lab.learning.selection import SELECTIONS
from lab.learning.session import Session
from lab.learning.session_result import check_members
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor
from lab.learning.tiles import TileCoding
from lab.learning.updates import LINEAR, UPDATES
from lab.learning.updates.linear import TileSarsa
from lab.learning.updates.update import AFTERSTATE, OWN_RULE, SARSA, Q
from lab.mdp import FloatArray, TabularMDP


class Batch(NamedTuple):
    """The results of N sessions of E episodes, in the order of their seeds.

    steps: (N, E) int32, a failed episode counts as max_steps + 1; guided: (N, E) bool, episodes with a helped step; requests,
    helped_steps, misleads: (N,) int64, as in `SessionResult`; rejected_at_episode: (N,) int64, 0 if no advisor was rejected;
    moves: (N,) int64, all moves made; q: (N, S, A) float64, or (0, S, A) unless the tables were asked for; greedy: (N, K), see
    `run_sessions`; returns: (N, E) float64, the sums of rewards, or (0, E) unless they were asked for.
    """

    steps: NDArray[np.int32]
    guided: NDArray[np.bool_]
    requests: NDArray[np.int64]
    helped_steps: NDArray[np.int64]
    misleads: NDArray[np.int64]
    rejected_at_episode: NDArray[np.int64]
    moves: NDArray[np.int64]
    q: FloatArray
    greedy: FloatArray = np.zeros((0, 0))
    returns: FloatArray = np.zeros((0, 0))


def run_sessions(
    problem: TabularMDP | Environment,
    learner: LearnerSettings,
    gate: GateSettings,
    advice: Advice | None,
    seeds: NDArray[np.uint64],
    *,
    keep_tables: bool = False,
    keep_returns: bool = False,
    greedy_every: int = 0,
) -> Batch:
    """The results of N sessions, one per seed.

    problem: a table, or the environment in which steps are made; compiled are tables, `ChanceTable` and the worlds of `physics`,
    but no class that makes starts or steps of its own.
    advice: None if there is nobody to ask; seeds: (N,) uint64; keep_tables, keep_returns: whether the results include
    the learned tables, and the returns.
    greedy_every: after each so-manyth episode the greedy policy is measured without advice, in episodes that nobody learns from;
    `Batch.greedy` has their mean steps, a failed one as max_steps + 1 (see `greedy_steps`). 0: it is not measured.

    The results equal those of `Session.run` with the draws `splitmix.stream(seed)` and a `TableAdvisor` on the same draws.
    Raises BadInput for an unknown learner, selection or gate, for advice of another shape, and to measure a greedy policy in
    steps that no table holds.
    """
    check_members(learner, gate)
    place = TableEnvironment(problem) if isinstance(problem, TabularMDP) else problem
    mdp = place.mdp
    if advice is not None and advice.thresholds.shape[1:] != mdp.successor.shape:
        raise BadInput(f"advice of shape {advice.thresholds.shape}: the problem has {mdp.successor.shape}")
    if greedy_every and not (isinstance(place, TableEnvironment) and learner.tilings == 1):
        raise BadInput(f"greedy_every {greedy_every}: the greedy policy is measured along the way on tables only")
    kept = Kept(keep_tables, keep_returns, greedy_every, walks_of(place))
    steps_known = keeps_steps(place) or isinstance(mdp, CellTable)
    by_chance_on_tiles = isinstance(place, ChanceTable) and learner.tilings > 1
    if by_chance_on_tiles or not (steps_known and is_compiled(mdp, learner, gate, advice)):
        tell_uncompiled(learner.learner, gate.gate)
        return _one_by_one(place, learner, gate, advice, seeds, kept)
    asking = made.asking_of(gate, advice is not None, learner.max_steps)
    learning, arrays = made.learning_of(mdp, learner), made.problem_of(mdp, learner)
    advice_arrays = (np.zeros((1, 1, mdp.n_actions)), np.zeros(mdp.n_states, np.bool_))
    if advice is not None:
        advice_arrays = advice.thresholds, advice.region
    if learner.tilings > 1:
        size = TileCoding(mdp.cells, learner.tilings).count * mdp.n_actions
        sessions = made.sessions_of(learner, seeds, size, kept)
        lanes = made.lanes_of(mdp.n_actions, learner.episodes, 0, 0)
        learning = learning._replace(actions=np.zeros(mdp.n_actions))  # of any length: compiled once for all
        work, linear = records.Work(arrays, learning, asking, *advice_arrays, sessions, lanes), _linear(mdp, learner)
        if not runs_compiled(linear_loop.run, work, (linear, _world(mdp)), mdp, learner, gate):
            return _one_by_one(place, learner, gate, advice, seeds, kept)
        return _batch(sessions, _values_of_tiles(mdp, learner, sessions.kept))
    size = mdp.n_states * (1 if made.is_afterstate(learner) else mdp.n_actions)
    sessions = made.sessions_of(learner, seeds, size, kept)
    ensemble = gate.ensemble if asking.gate.asks == ASKS_WHERE_TABLES_DIFFER else 0
    lanes = made.lanes_of(mdp.n_actions, learner.episodes, sessions.kept.shape[1], ensemble)
    memories = made.memories_of(mdp.n_states, mdp.n_actions, learning.max_moves) if gate.memory else None
    lookahead = made.lookahead_of(mdp, learner, learning.max_moves)
    hearing, walks = (
        made.hearing_of(mdp, asking, advice, learner),
        made.walks_for(mdp, asking, learning, learner.episodes),
    )
    work = records.Work(arrays, learning, asking, *advice_arrays, sessions, lanes)
    optional = memories, hearing, made.chances_of(place), walks, lookahead, made.model_of(mdp, learner)
    if not runs_compiled(run, work, optional, mdp, learner, gate):
        return _one_by_one(place, learner, gate, advice, seeds, kept)
    tables = made.action_values(mdp, learning, sessions.kept)
    return _batch(sessions, tables)


def is_compiled(mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings, advice: Advice | None = None) -> bool:
    """Whether a kernel implements this combination of problem, learner, selection, gate and advice."""
    rules = GATES[gate.gate].compiled
    if rules is None:
        return False
    if learner.tilings > 1:
        known = learner.learner in LINEAR and SELECTIONS[learner.selection].compiled is not None and not gate.memory
        plain = rules.weighs == WEIGHS_NOTHING and (advice is None or made.speaks_at_once(advice))
        simple = rules.asks != ASKS_WHERE_TABLES_DIFFER and (not rules.judges or len(mdp.starts) < 2)
        return known and plain and simple
    if isinstance(mdp, CellTable) or learner.start_value:
        return False  # only the kernel for tile coding makes these steps
    form = UPDATES[learner.learner].compiled
    if form == OWN_RULE and rules.weighs == WEIGHS_TRUST:
        return False  # the kernel learns again from known steps by the shipped rules only
    in_a_table = form in (Q, AFTERSTATE, SARSA, OWN_RULE)  # several of the others need more than a table each
    side_by_side = in_a_table or rules.asks != ASKS_WHERE_TABLES_DIFFER
    return form is not None and side_by_side and SELECTIONS[learner.selection].compiled is not None


def _one_by_one(
    place: Environment,
    learner: LearnerSettings,
    gate: GateSettings,
    advice: Advice | None,
    seeds: NDArray[np.uint64],
    kept: Kept,
) -> Batch:
    """The same sessions without the kernel, each with the draws that it would have there."""
    q = np.zeros((len(seeds) if kept.tables else 0, *place.mdp.successor.shape))
    batch = _batch(made.sessions_of(learner, seeds, 0, kept._replace(tables=False)), q)
    for n, seed in enumerate(seeds):
        draw = splitmix.stream(int(seed))
        advisor = None if advice is None else TableAdvisor(advice, draw)
        session = Session(place, learner, gate, advisor, draw)
        result = session.run(enough=partial(measure_greedy, session, int(seed), kept.greedy_every, batch.greedy[n]))
        if result.interrupted:
            raise KeyboardInterrupt
        batch.steps[n], batch.guided[n], batch.moves[n] = result.steps, result.guided, result.visits.sum()
        batch.requests[n], batch.helped_steps[n] = result.requests, result.helped_steps
        batch.misleads[n], batch.rejected_at_episode[n] = result.misleads, result.rejected_at_episode or 0
        if kept.tables:
            batch.q[n] = result.q
        if kept.returns:
            batch.returns[n] = result.returns
    return batch


def _linear(mdp: TabularMDP, learner: LearnerSettings) -> linear_loop.Linear:
    """The arrays of a learner with tile coding."""
    coding, rule = TileCoding(mdp.cells, learner.tilings), LINEAR[learner.learner]
    size, episodes = coding.count * mdp.n_actions, range(1, learner.episodes + 1)
    return linear_loop.Linear(
        active=coding.active,
        weights=np.zeros(size),
        listed=np.zeros(size, np.int64),
        strength=np.zeros(size),
        place=np.full(size, -1, np.int64),
        traces=np.zeros(1, np.int64),
        values=np.zeros(mdp.n_actions),
        warm=np.array([selection.temperature(n, learner.beta, learner.exploration) for n in episodes]),
        start=learner.start_value / learner.tilings,
        alpha=learner.alpha / learner.tilings,
        decay=learner.discount * learner.trace if rule.decays else 0.0,
        growing=not learner.replacing,
        on_policy=issubclass(rule, TileSarsa),
        lookahead=rule.lookahead,
        selection=SELECTIONS[learner.selection].compiled,
    )


def _values_of_tiles(mdp: TabularMDP, learner: LearnerSettings, kept: FloatArray) -> FloatArray:
    """The action values (N, S, A) of weights (N, size) of tiles."""
    coding = TileCoding(mdp.cells, learner.tilings)
    tables = kept.reshape(-1, coding.count, mdp.n_actions)
    return np.array([coding.values(weights) for weights in tables]).reshape(-1, *mdp.successor.shape)


def _world(mdp: TabularMDP) -> linear_loop.LinearWorld:
    if not isinstance(mdp, CellTable):
        none, cells = np.zeros(1), np.ones(1, np.int64)
        return linear_loop.LinearWorld(linear_loop.TABLE, none, none, none, cells, 0.0, 0.0, False)
    physics, bounds = mdp.physics, mdp.physics.bounds
    ends, cells = (np.array(bounds.low), np.array(bounds.high)), np.array(bounds.shape)
    rewards = physics.reward, physics.last_reward
    return linear_loop.LinearWorld(
        physics.number, np.zeros(len(cells)), *ends, cells, *rewards, physics.longer_is_better
    )


def play(mdp: CellTable, policy: NDArray[np.int64], drawn: FloatArray, most: int) -> NDArray[np.int64]:
    """The number of moves (N,) of a policy (S,) from N starts, negated where the episode had not ended after `most` moves.

    drawn: (N, D), uniform numbers in [0, 1), from which the world makes its starts.
    """
    starts, moves = drawn.copy(), np.zeros(len(drawn), np.int64)
    for start in starts:
        mdp.physics.begin(start)
    linear_loop.play(_world(mdp), policy, starts, most, moves)
    return moves


def _batch(sessions: records.KernelSessions, q: FloatArray) -> Batch:
    counts = {name: sessions.counts[name] for name in records.COUNTS.names or ()}
    return Batch(sessions.steps, sessions.guided, **counts, q=q, greedy=sessions.greedy, returns=sessions.returns)
