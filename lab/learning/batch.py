"""Many sessions at once, for studies: settings in, what the compiled kernel made of them out."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.advice.advisors import Advice
from lab.advice.memory import places
from lab.errors import BadInput, unknown
from lab.learning import kernels, selection
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, TabularMDP

LEARNERS = ("afterstate", "q")  # those that chapter 9 needs


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
    a `TableAdvisor` on the same draws. Raises BadInput for a learner outside LEARNERS, a selection other than softmax,
    an unknown gate, or advice of another shape.
    """
    if learner.learner not in LEARNERS:
        raise unknown("learner", learner.learner, LEARNERS, "compiled sessions")
    if learner.selection != "softmax":
        raise unknown("selection", learner.selection, ["softmax"], "compiled sessions")
    if gate.gate not in kernels.GATE_CODES:
        raise unknown("gate", gate.gate, kernels.GATE_CODES, "gate settings")
    if advice is not None and advice.thresholds.shape[1:] != mdp.successor.shape:
        raise BadInput(f"advice of shape {advice.thresholds.shape}: the problem has {mdp.successor.shape}")
    rules, problem = _rules(learner, gate, advice is not None), _problem(mdp, learner.learner == "afterstate")
    size = mdp.n_states if rules.afterstate else mdp.n_states * mdp.n_actions
    sessions, episodes = len(seeds), learner.episodes
    steps, guided = np.zeros((sessions, episodes), np.int32), np.zeros((sessions, episodes), np.bool_)
    counts, kept = np.zeros(sessions, kernels.COUNTS), np.zeros((sessions if keep_tables else 0, size))
    temperatures = [selection.temperature(n, learner.beta, learner.exploration) for n in range(1, episodes + 1)]
    thresholds = np.zeros((1, 1, mdp.n_actions)) if advice is None else advice.thresholds
    region = np.zeros(mdp.n_states, np.bool_) if advice is None else advice.region
    others = np.zeros((kernels.LANES, rules.ensemble if rules.gate == kernels.GATE_CODES["uncertainty"] else 0, size))
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
    return Batch(
        steps, guided, **{name: counts[name] for name in kernels.COUNTS.names or ()}, q=_action_values(mdp, rules, kept)
    )


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
        kernels.GATE_CODES[gate.gate] if somebody else kernels.GATE_CODES["never"],
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
