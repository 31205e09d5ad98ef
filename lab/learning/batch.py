"""Many sessions at once, for studies: `run_sessions` prepares the arrays of the compiled kernel and returns its results.

Settings without a compiled form run in the interactive session, one after the other: slower, with the same results.
"""

import warnings
from collections.abc import Callable, Sequence
from functools import cache, partial
from math import log
from multiprocessing import current_process
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, Notice
from lab.learning import selection, splitmix
from lab.learning.advice_memory import Memory, places
from lab.learning.compiled import NotCompilable, inner, not_kept
from lab.learning.environment import Environment, Step, TableEnvironment
from lab.learning.gates import GATES
from lab.learning.gates.gate import ASKS_WHERE_TABLES_DIFFER, WEIGHS_NOTHING, WEIGHS_TRUST
from lab.learning.gates.heard import Heard
from lab.learning.kernels import linear_loop, records
from lab.learning.kernels.records import LANES
from lab.learning.kernels.session_loop import run
from lab.learning.physics.cells import CellTable
from lab.learning.selection import SELECTIONS, Draw
from lab.learning.session import Session
from lab.learning.session_result import check_members
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import SPEAKS_ALWAYS, SPEAKS_AS_EXPECTED, Advice, TableAdvisor
from lab.learning.tiles import TileCoding
from lab.learning.updates import LINEAR, UPDATES
from lab.learning.updates.linear import TileSarsa
from lab.learning.updates.tabular import TRACE_FLOOR
from lab.learning.updates.update import AFTERSTATE, DYNA, OWN_RULE, Q_TRACES, SARSA, SARSA_TRACES, Q, plain_rule
from lab.mdp import FloatArray, IntArray, TabularMDP

Outcome = tuple[float, int, float]  # chance, state entered, reward
WALKS = 10  # episodes that measure a greedy policy where they differ
GREEDY_EVERY = 10  # episodes between the measurements of studies
TIMES_SLOWER = 250  # the session beside the kernel: 275 times with q, 222 with q-lambda, 160 with dyna-q
WORTH_COMPILING = 20_000  # episodes of a learner with a rule of its own: fewer take less time one by one than compiling
_compiled_rules: dict[Any, Any] = {}  # None: numba cannot compile it
_told: set[tuple[str, str]] = set()
SPARE_TRACES = 32  # room for new traces before the kernel has to move the others to the beginning


class ChanceTable(TableEnvironment):
    """An environment with stochastic moves; one uniform number per step decides the outcome.

    mdp: the likeliest outcome of each move, and the terminal states; outcomes: those of each of the S * A moves, at most K;
    best: the optimal values (S, A), which `values` returns for any discount.
    below: (S * A, K) float64, the cumulative probabilities, 2 where a move has fewer outcomes; entered: (S * A, K) int32; reward:
    (S * A, K) float64. Raises BadInput for outcomes whose probabilities do not sum to 1.
    """

    def __init__(self, mdp: TabularMDP, outcomes: Sequence[Sequence[Outcome]], best: FloatArray):
        super().__init__(mdp)
        width = max(len(row) for row in outcomes)
        shape = len(outcomes), width
        self.below: FloatArray = np.full(shape, 2.0)
        self.entered: IntArray = np.zeros(shape, np.int32)
        self.reward: FloatArray = np.zeros(shape)
        self._best = best
        for number, row_outcomes in enumerate(outcomes):
            total = 0.0
            for k, (chance, entered, reward) in enumerate(row_outcomes):
                total += chance
                self.below[number, k], self.entered[number, k], self.reward[number, k] = total, entered, reward
            if abs(total - 1.0) > 1e-9:
                raise BadInput(f"outcomes of move {number}: their chances sum to {total:g}: wanted 1")
            self.below[number, len(row_outcomes) - 1] = 2.0  # the last outcome, even if the sum was rounded down

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The step that one uniform number selects among the move's outcomes."""
        number, u, k = state * self.mdp.n_actions + action, draw(), 0
        while u >= self.below[number, k]:
            k += 1
        entered = int(self.entered[number, k])
        over, won = bool(self.mdp.terminal[entered]), bool(self.mdp.goal[entered])
        return Step(float(self.reward[number, k]), entered, over, won)

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) that the table was made with."""
        return self._best


# ---- many sessions at once --------------------------------------------------------------------------------------------


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
    steps_known = keeps_steps(place) or isinstance(mdp, CellTable)
    by_chance_on_tiles = isinstance(place, ChanceTable) and learner.tilings > 1
    if by_chance_on_tiles or not (steps_known and is_compiled(mdp, learner, gate, advice)):
        tell_uncompiled(learner.learner, gate.gate)
        return _one_by_one(place, learner, gate, advice, seeds, keep_tables, greedy_every, keep_returns)
    asking = _asking(gate, advice is not None, learner.max_steps)
    learning, arrays = _learning(mdp, learner), _problem(mdp, learner)
    advice_arrays = (np.zeros((1, 1, mdp.n_actions)), np.zeros(mdp.n_states, np.bool_))
    if advice is not None:
        advice_arrays = advice.thresholds, advice.region
    if learner.tilings > 1:
        sessions = _sessions(learner, seeds, TileCoding(mdp.cells, learner.tilings).count * mdp.n_actions, keep_tables)
        sessions = sessions._replace(returns=_returns(learner, seeds, keep_returns))
        lanes = _lanes(mdp.n_actions, learner.episodes, 0, 0)
        learning = learning._replace(actions=np.zeros(mdp.n_actions))  # of any length: compiled once for all
        return _on_tiles(mdp, learner, records.Work(arrays, learning, asking, *advice_arrays, sessions, lanes))
    size = mdp.n_states * (1 if _is_afterstate(learner) else mdp.n_actions)
    sessions = _sessions(learner, seeds, size, keep_tables, greedy_every, walks_of(place))
    sessions = sessions._replace(returns=_returns(learner, seeds, keep_returns))
    ensemble = gate.ensemble if asking.gate.asks == ASKS_WHERE_TABLES_DIFFER else 0
    lanes = _lanes(mdp.n_actions, learner.episodes, sessions.kept.shape[1], ensemble)
    memories = _memories(mdp.n_states, mdp.n_actions, learning.max_moves) if gate.memory else None
    lookahead = _lookahead(mdp, learner, learning.max_moves)
    hearing, walks = _hearing(mdp, asking, advice, learner), _walks(mdp, asking, learning, learner.episodes)
    work = records.Work(arrays, learning, asking, *advice_arrays, sessions, lanes)
    optional = memories, hearing, _chances(place), walks, lookahead, _model(mdp, learner)
    if UPDATES[learner.learner].compiled != OWN_RULE:
        run(work, *optional, None)
    elif not _runs_by_rule(work, optional, mdp, learner):
        return _one_by_one(place, learner, gate, advice, seeds, keep_tables, greedy_every, keep_returns)
    tables = _action_values(mdp, learning, sessions.kept)
    return _batch(sessions, tables)


def _runs_by_rule(work: records.Work, optional: tuple[Any, ...], mdp: TabularMDP, learner: LearnerSettings) -> bool:
    """Runs the sessions of an added learner by its compiled rule; returns False if they have to run one by one.

    That is so if there are too few for what compiling takes, if the rule cannot be compiled, which a notice says, or if it fails:
    then the session shows in which line. Raises BadInput for values that are not finite.
    """
    name, make = learner.learner, UPDATES[learner.learner].make
    rule, episodes = plain_rule(make), work.sessions.steps.size  # type: ignore[arg-type]
    if rule not in _compiled_rules and episodes < WORTH_COMPILING:
        return False
    if rule not in _compiled_rules:
        _compiled_rules[rule] = inner(rule, boundscheck=True)
    if _compiled_rules[rule] is None:
        return False
    shape, tables = mdp.successor.shape, work.lanes.tables
    own = records.OwnRule(
        rule=_compiled_rules[rule],
        settings=records.NumberSettings(**{field: getattr(learner, field) for field in records.NumberSettings._fields}),
        q=tables.reshape(LANES, *shape),
        others=work.lanes.others.reshape(LANES, -1, *shape) if work.lanes.others.size else np.zeros((LANES, 0, *shape)),
        wrong=np.zeros(1, np.int64),
    )
    try:
        _run_by_rule()(work, *optional, own)
    except NotCompilable:
        _compiled_rules[rule] = None
        tell_uncompiled(name, "never", ": numba cannot compile its rule")
        return False
    except Exception:  # whatever the rule raises
        return False
    if own.wrong[0]:
        raise BadInput(f"learner '{name}': {own.wrong[0]} of its action values are not finite")
    return True


@cache
def _run_by_rule() -> Callable[..., None]:
    return not_kept(run)


class Uncompiled(Notice):
    """The notice that an added member runs in the session only."""


def tell_uncompiled(learner: str, gate: str, why: str = "") -> None:
    """Tells once for each added learner and gate without a compiled form that its sessions are slow; not in worker processes."""
    for kind, family, name in (("learner", UPDATES, learner), ("gate", GATES, gate)):
        slow = family.is_added(name) and (why or family[name].compiled is None)
        if slow and (kind, name) not in _told and current_process().name == "MainProcess":
            _told.add((kind, name))
            text = f"{kind} '{name}' runs uncompiled, about {TIMES_SLOWER} times slower than shipped ones{why}"
            warnings.warn(text, Uncompiled, stacklevel=3)


def _batch(sessions: records.KernelSessions, q: FloatArray) -> Batch:
    counts = {name: sessions.counts[name] for name in records.COUNTS.names or ()}
    return Batch(sessions.steps, sessions.guided, **counts, q=q, greedy=sessions.greedy, returns=sessions.returns)


def _returns(learner: LearnerSettings, seeds: NDArray[np.uint64], keep: bool) -> FloatArray:
    return np.zeros((len(seeds) if keep else 0, learner.episodes))


def keeps_steps(place: Environment) -> bool:
    """Whether an environment begins and steps by the methods of its table, which are the only ones that the kernel knows."""
    kind = type(place)
    by_table = isinstance(place, TableEnvironment) and kind.reset is TableEnvironment.reset
    return by_table and kind.step in (TableEnvironment.step, ChanceTable.step)  # type: ignore[attr-defined]


def walks_of(place: Environment) -> int:
    """How many episodes of a greedy policy measure it: one where all are the same, WALKS where starts or steps may be drawn."""
    alike = keeps_steps(place) and not isinstance(place, ChanceTable) and not place.mdp.starts
    return 1 if alike else WALKS


def greedy_every(problem: TabularMDP | Environment, learner: LearnerSettings) -> int:
    """The episodes between two measurements of the greedy policy in a study: GREEDY_EVERY, or all if there are fewer.

    0, for no measurement, where steps are in no table or values are in tiles.
    """
    on_table = isinstance(problem, TabularMDP | TableEnvironment) and not isinstance(problem, CellTable)
    return min(GREEDY_EVERY, learner.episodes) if on_table and learner.tilings == 1 else 0


def greedy_steps(place: TableEnvironment, q: FloatArray, learner: LearnerSettings, draw: Draw, walks: int) -> float:
    """The mean steps of that many episodes of the greedy policy of q (S, A), a failed one as max_steps + 1.

    Ties go to the lowest action; starts and steps that are left to chance come from `draw`.
    """
    greedy, total = q.argmax(axis=1).tolist(), 0
    for _ in range(walks):
        state, reached, moves = place.reset(1, draw), False, 0
        while moves < learner.max_steps - learner.count_start and not place.mdp.terminal[state]:
            step = place.step(state, greedy[state], draw)
            state, reached, moves = step.state, step.reached, moves + 1
        total += moves + learner.count_start if reached else learner.max_steps + 1
    return total / walks


def is_compiled(mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings, advice: Advice | None = None) -> bool:
    """Whether a kernel implements this combination of problem, learner, selection, gate and advice."""
    rules = GATES[gate.gate].compiled
    if rules is None:
        return False
    if learner.tilings > 1:
        known = learner.learner in LINEAR and SELECTIONS[learner.selection].compiled is not None and not gate.memory
        plain = rules.weighs == WEIGHS_NOTHING and (advice is None or _speaks_at_once(advice))
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


def _speaks_at_once(advice: Advice) -> bool:
    return not advice.late and advice.speaks == SPEAKS_ALWAYS


def _hearing(
    mdp: TabularMDP, asking: records.Asking, advice: Advice | None, learner: LearnerSettings
) -> records.Hearing | None:
    """The arrays for gates that weigh advice and for advisors that hold back; None if neither is the case."""
    weighs = asking.gate.weighs != WEIGHS_NOTHING
    if advice is None or (not weighs and _speaks_at_once(advice)):
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


def _walks(
    mdp: TabularMDP, asking: records.Asking, learning: records.CompiledLearner, episodes: int
) -> records.Walks | None:
    """The arrays for gates that judge episodes which begin in different states; None otherwise."""
    if not asking.gate.judges or len(mdp.starts) < 2:
        return None
    walk, begun = np.zeros((LANES, learning.max_moves), np.int32), np.zeros((LANES, episodes), np.int32)
    return records.Walks(np.full((LANES, mdp.n_states), np.inf), walk, begun)


def _chances(place: Environment) -> records.Chances | None:
    return records.Chances(place.below, place.entered, place.reward) if isinstance(place, ChanceTable) else None


def _lookahead(mdp: TabularMDP, learner: LearnerSettings, moves: int) -> records.Lookahead | None:
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


def _model(mdp: TabularMDP, learner: LearnerSettings) -> records.Model | None:
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


def _one_by_one(
    place: Environment,
    learner: LearnerSettings,
    gate: GateSettings,
    advice: Advice | None,
    seeds: NDArray[np.uint64],
    keep_tables: bool,
    greedy_every: int,
    keep_returns: bool,
) -> Batch:
    """The same sessions without the kernel, each with the draws that it would have there."""
    batch = _batch(
        _sessions(learner, seeds, 0, False, greedy_every)._replace(returns=_returns(learner, seeds, keep_returns)),
        np.zeros((len(seeds) if keep_tables else 0, *place.mdp.successor.shape)),
    )
    for n, seed in enumerate(seeds):
        draw = splitmix.stream(int(seed))
        advisor = None if advice is None else TableAdvisor(advice, draw)
        session = Session(place, learner, gate, advisor, draw)
        result = session.run(enough=partial(measure_greedy, session, int(seed), greedy_every, batch.greedy[n]))
        if result.interrupted:
            raise KeyboardInterrupt
        batch.steps[n], batch.guided[n], batch.moves[n] = result.steps, result.guided, result.visits.sum()
        batch.requests[n], batch.helped_steps[n] = result.requests, result.helped_steps
        batch.misleads[n], batch.rejected_at_episode[n] = result.misleads, result.rejected_at_episode or 0
        if keep_tables:
            batch.q[n] = result.q
        if keep_returns:
            batch.returns[n] = result.returns
    return batch


def measure_greedy(session: Session, seed: int, every: int, greedy: FloatArray) -> bool:
    """False, as the session goes on: the `enough` of one whose greedy policy is measured after each `every`-th episode.

    greedy: (K,), receives the mean steps that `run_sessions` has in `Batch.greedy`; seed: the session's; every: 0 for never.
    """
    number, left = divmod(session.episode, every) if every else (0, 1)
    if not left and isinstance(session.environment, TableEnvironment):
        draw, place = splitmix.stream(splitmix.apart(seed, number)), session.environment
        greedy[number - 1] = greedy_steps(place, session.update.table(), session.settings, draw, walks_of(place))
    return False


def _on_tiles(mdp: TabularMDP, learner: LearnerSettings, work: records.Work) -> Batch:
    """The results of sessions of a learner with tile coding."""
    coding, rule = TileCoding(mdp.cells, learner.tilings), LINEAR[learner.learner]
    size, episodes = coding.count * mdp.n_actions, range(1, learner.episodes + 1)
    linear = linear_loop.Linear(
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
    linear_loop.run(work, linear, _world(mdp))
    sessions, tables = work.sessions, work.sessions.kept.reshape(-1, coding.count, mdp.n_actions)
    q = np.array([coding.values(weights) for weights in tables]).reshape(-1, *mdp.successor.shape)
    return _batch(sessions, q)


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


def _sessions(
    learner: LearnerSettings, seeds: NDArray[np.uint64], size: int, keep: bool, every: int = 0, walks: int = 1
) -> records.KernelSessions:
    shape = (len(seeds), learner.episodes)
    warm = [selection.temperature(n, learner.beta, learner.exploration) for n in range(1, learner.episodes + 1)]
    return records.KernelSessions(
        seeds=np.asarray(seeds, np.uint64),
        warm=np.array(warm),
        steps=np.zeros(shape, np.int32),
        guided=np.zeros(shape, np.bool_),
        counts=np.zeros(len(seeds), records.COUNTS),
        kept=np.zeros((len(seeds) if keep else 0, size)),
        greedy=np.zeros((len(seeds), learner.episodes // every if every else 0)),
        every=max(1, every),
        walks=walks,
        walk_rng=np.zeros(1, np.uint64),
        returns=np.zeros((0, learner.episodes)),
    )


def _lanes(actions: int, episodes: int, size: int, ensemble: int) -> records.Lanes:
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


def _memories(states: int, actions: int, moves: int) -> Memory:
    walk = places(states, moves)
    sizes = (states * actions, states, states, states, states, states, walk, walk)  # as the fields of Memory
    cells = (np.zeros((LANES, size), np.int32) for size in sizes)
    return Memory._make((*cells, np.zeros(LANES, records.NOW)))


def _is_afterstate(learner: LearnerSettings) -> bool:
    return bool(UPDATES[learner.learner].compiled == AFTERSTATE) and learner.tilings == 1


def _problem(mdp: TabularMDP, learner: LearnerSettings) -> records.ProblemArrays:
    ends = np.where(mdp.goal, 1, np.where(mdp.terminal, 2, 0)).astype(np.uint8)
    starts = np.array(mdp.starts or (mdp.start,), np.int64)
    arrival, step_reward = (mdp.arrival, mdp.step_reward) if _is_afterstate(learner) else (np.zeros(1), 0.0)
    return records.ProblemArrays(mdp.successor.flatten(), mdp.reward.flatten(), arrival, ends, starts, step_reward)


def _learning(mdp: TabularMDP, learner: LearnerSettings) -> records.CompiledLearner:
    given = vars(learner) | {
        "afterstate": _is_afterstate(learner),
        "max_moves": learner.max_steps - learner.count_start,
        "selection": SELECTIONS[learner.selection].compiled,
        "replays": UPDATES[learner.learner].compiled in (Q, AFTERSTATE, DYNA),
        "actions": (0,) * mdp.n_actions,
    }
    return records.CompiledLearner(**{name: given[name] for name in records.CompiledLearner._fields})


def _asking(gate: GateSettings, somebody: bool, max_steps: int) -> records.Asking:
    rules = GATES[gate.gate if somebody else "never"].compiled
    given = vars(gate) | {
        "gate": rules,
        "judge_unhelped": gate.judge_unhelped and not (gate.memory or gate.by_evidence),
    }
    given["max_steps"] = max_steps
    return records.Asking(**{name: given[name] for name in records.Asking._fields})


def _action_values(mdp: TabularMDP, learning: records.CompiledLearner, tables: FloatArray) -> FloatArray:
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
