"""Many sessions at once, for studies: settings in, what the compiled kernel made of them out.

What has no compiled form is run in the interactive session, one after the other: slower, and the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning import kernels, selection, splitmix
from lab.learning.advice_memory import places
from lab.learning.session import check_members, run_session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor
from lab.mdp import FloatArray, TabularMDP


class Batch(NamedTuple):
    """What N sessions of E episodes came to, in the order of their seeds.

    steps (N, E) int32, a failed episode as max_steps + 1; guided (N, E) bool: at least one helped step; requests,
    helped_steps, misleads (N,) int64, as in `SessionResult`; rejected_at_episode (N,) int64, 0 where none was;
    moves (N,) int64: all that were made; q (N, S, A) float64, of no sessions unless asked for.
    """

    steps: NDArray[np.int32]
    guided: NDArray[np.bool_]
    requests: NDArray[np.int64]
    helped_steps: NDArray[np.int64]
    misleads: NDArray[np.int64]
    rejected_at_episode: NDArray[np.int64]
    moves: NDArray[np.int64]
    q: FloatArray


def run_sessions(
    mdp: TabularMDP,
    learner: LearnerSettings,
    gate: GateSettings,
    advice: Advice | None,
    seeds: NDArray[np.uint64],
    *,
    keep_tables: bool = False,
) -> Batch:
    """Learns a table in each of N sessions, seeds (N,) uint64; advice None: nobody to ask.

    The same tables, step counts, requests, helped steps and misleads as `run_session` with draws `splitmix.stream(seed)` and
    a `TableAdvisor` on the same draws. Raises BadInput for an unknown learner, selection or gate, or advice of another
    shape.
    """
    check_members(learner, gate)
    if advice is not None and advice.thresholds.shape[1:] != mdp.successor.shape:
        raise BadInput(f"advice of shape {advice.thresholds.shape}: the problem has {mdp.successor.shape}")
    if not is_compiled(mdp, learner, gate):
        return _one_by_one(mdp, learner, gate, advice, seeds, keep_tables)
    rules, problem = _rules(learner, gate, advice is not None), _problem(mdp, learner.learner == "afterstate")
    size = mdp.n_states if rules.afterstate else mdp.n_states * mdp.n_actions
    sessions, episodes = len(seeds), learner.episodes
    steps, guided = np.zeros((sessions, episodes), np.int32), np.zeros((sessions, episodes), np.bool_)
    counts, kept = np.zeros(sessions, kernels.COUNTS), np.zeros((sessions if keep_tables else 0, size))
    temperatures = [selection.temperature(n, learner.beta, learner.exploration) for n in range(1, episodes + 1)]
    thresholds = np.zeros((1, 1, mdp.n_actions)) if advice is None else advice.thresholds
    region = np.zeros(mdp.n_states, np.bool_) if advice is None else advice.region
    others = np.zeros((kernels.LANES, rules.ensemble if kernels.GATES[rules.gate] == "uncertainty" else 0, size))
    kernels.run(
        problem,
        rules,
        thresholds,
        region,
        np.asarray(seeds, np.uint64),
        1.0 / np.array(temperatures),
        (0,) * mdp.n_actions,
        _scratch(mdp.n_actions, episodes),
        _memories(mdp.n_states, rules.max_moves) if gate.memory else None,
        np.zeros((kernels.LANES, size)),
        others,
        steps,
        guided,
        counts,
        kept,
    )
    return _batch(steps, guided, counts, _action_values(mdp, rules, kept))


def _batch(steps: NDArray[np.int32], guided: NDArray[np.bool_], counts: NDArray[np.void], q: FloatArray) -> Batch:
    return Batch(steps, guided, **{name: counts[name] for name in kernels.COUNTS.names or ()}, q=q)


def is_compiled(mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings) -> bool:
    """Whether the kernel knows this learner, its selection, and this gate by all of its settings."""
    known = learner.learner in kernels.LEARNERS and learner.selection == "softmax" and gate.gate in kernels.GATES
    as_printed = len(mdp.starts) < 2 and not gate.spare_best  # it judges by the plain counts alone
    return known and (as_printed or gate.gate not in kernels.JUDGING)


def _one_by_one(
    mdp: TabularMDP,
    learner: LearnerSettings,
    gate: GateSettings,
    advice: Advice | None,
    seeds: NDArray[np.uint64],
    keep_tables: bool,
) -> Batch:
    """The same sessions, each with the draws that it would have in the kernel."""
    steps, counts = np.zeros((len(seeds), learner.episodes), np.int32), np.zeros(len(seeds), kernels.COUNTS)
    q = np.zeros((len(seeds) if keep_tables else 0, *mdp.successor.shape))
    found = _batch(steps, np.zeros(steps.shape, np.bool_), counts, q)
    for n, seed in enumerate(seeds):
        draw = splitmix.stream(int(seed))
        advisor = None if advice is None else TableAdvisor(advice, draw)
        one = run_session(mdp, learner, gate, advisor, np.random.default_rng(0), draw=draw)
        if one.interrupted:
            raise KeyboardInterrupt
        found.steps[n], found.guided[n], found.moves[n] = one.steps, one.guided, one.visits.sum()
        found.requests[n], found.helped_steps[n] = one.requests, one.helped_steps
        found.misleads[n], found.rejected_at_episode[n] = one.misleads, one.rejected_at_episode or 0
        if keep_tables:
            found.q[n] = one.q
    return found


def _scratch(actions: int, episodes: int) -> kernels.Scratch:
    lanes = np.zeros(kernels.LANES, kernels.LANE)
    lanes["session"], lanes["episode"] = -1, episodes
    return kernels.Scratch(
        lanes=lanes,
        values=np.zeros(actions * kernels.LANES),
        widths=np.zeros(kernels.LANES),
        per_tau=np.zeros(kernels.LANES),
        chosen=np.zeros(kernels.LANES, np.int64),
        moves=np.zeros(kernels.LANES, np.int64),
        states=np.zeros(kernels.LANES, np.uint64),
        rng=np.zeros(kernels.LANES, np.uint64),
        fresh=np.ones(kernels.LANES, np.bool_),
        is_open=np.zeros(kernels.LANES, np.bool_),
    )


def _memories(states: int, moves: int) -> kernels.Memories:
    def blank(cells: int) -> NDArray[np.int32]:
        return np.zeros((kernels.LANES, cells), np.int32)

    said, way, on_walk, place = (blank(states) for _ in range(4))
    walk, did, own = (blank(places(states, moves)) for _ in range(3))
    return kernels.Memories(said, way, on_walk, place, walk, did, own, np.zeros(kernels.LANES, kernels.NOW))


def _problem(mdp: TabularMDP, afterstate: bool) -> kernels.Problem:
    ends = np.where(mdp.goal, 1, np.where(mdp.terminal, 2, 0)).astype(np.uint8)
    starts = np.array(mdp.starts or (mdp.start,), np.int64)
    arrival = mdp.arrival if afterstate else np.zeros(1)
    reward = 0.0 if not afterstate else mdp.step_reward
    return kernels.Problem(mdp.successor.copy(), mdp.reward.copy(), arrival, ends, starts, reward)


def _rules(learner: LearnerSettings, gate: GateSettings, somebody: bool) -> kernels.Rules:
    return kernels.Rules(
        learner.learner == "afterstate",
        float(learner.alpha),
        float(learner.discount),
        learner.max_steps - learner.count_start,
        learner.max_steps,
        int(learner.count_start),
        kernels.GATES.index(gate.gate if somebody else "never"),
        float(gate.lambda_threshold),
        gate.omega,
        gate.first_episode,
        gate.window,
        float(gate.psi),
        float(gate.spread),
        float(gate.rate),
        float(gate.enough_steps),
        gate.ensemble,
        gate.budget,
        gate.judge_unhelped and not gate.memory,
    )


def _action_values(mdp: TabularMDP, rules: kernels.Rules, tables: FloatArray) -> FloatArray:
    """Tables as (N, S, A) action values, zeros in terminal states."""
    if not rules.afterstate:
        return tables.reshape(-1, *mdp.successor.shape)
    q = (
        mdp.step_reward + rules.discount * tables[:, mdp.successor]
        if len(tables)
        else np.zeros((0, *mdp.successor.shape))
    )
    q[:, mdp.terminal] = 0.0
    return q
