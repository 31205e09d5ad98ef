"""Compiled sessions equal the interactive one, number by number, and do not depend on their company."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.advice.advisors import Advice, TableAdvisor, skill
from lab.advice.gates import GATES
from lab.errors import BadInput
from lab.learning.batch import LEARNERS, run_sessions
from lab.learning.kernels import LANES
from lab.learning.selection import splitmix
from lab.learning.session import SessionResult, run_session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid, optimal_values

SHORT = LearnerSettings("afterstate", episodes=40, max_steps=40, count_start=True)
EAGER = GateSettings(first_episode=6, window=3, omega=1, psi=0.4, spread=0.2, rate=0.3, enough_steps=12.0, budget=60)


def board() -> TabularMDP:
    blocked = np.zeros((5, 5), bool)
    blocked[1, 1:4] = blocked[3, 2] = True
    return grid((5, 5), blocked, (0, 0), (4, 4))


def advice(mdp: TabularMDP, tau: Any = 0.2, region: Any = None) -> Advice:
    return Advice.of(skill(optimal_values(mdp, 0.99), tau), region)


def alone(
    mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings, who: Advice | None, seed: int
) -> SessionResult:
    """The interactive session with the numbers that the kernel draws for this seed."""
    draw = splitmix(seed)
    advisor = None if who is None else TableAdvisor(who, draw)
    return run_session(mdp, learner, gate, advisor, np.random.default_rng(0), draw=draw)


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("learner", LEARNERS)
def test_compiled_and_interactive_sessions_are_the_same(learner: str, gate: str) -> None:
    mdp, settings, how = board(), replace(SHORT, learner=learner), replace(EAGER, gate=gate)
    who = advice(mdp, [1.0, 0.1], np.arange(25) > 4)
    seeds = np.arange(100, 100 + LANES + 6, dtype=np.uint64)
    batch = run_sessions(mdp, settings, how, who, seeds, keep_tables=True)
    for n in (0, 7, LANES + 5):
        one = alone(mdp, settings, how, who, int(seeds[n]))
        np.testing.assert_array_equal(batch.steps[n], one.steps)
        np.testing.assert_array_equal(batch.guided[n], one.guided)
        np.testing.assert_array_equal(batch.q[n], one.q)
        counted = (
            batch.requests[n],
            batch.helped_steps[n],
            batch.misleads[n],
            batch.rejected_at_episode[n],
            batch.moves[n],
        )
        assert counted == (one.requests, one.helped_steps, one.misleads, one.rejected_at_episode or 0, one.visits.sum())
    assert (batch.helped_steps.sum() > 0) == (gate != "never")


def test_unhelped_episodes_may_be_left_unjudged() -> None:
    mdp, blind = board(), advice(board(), 0.2, np.zeros(25, bool))
    for judged in (True, False):
        how = replace(EAGER, judge_unhelped=judged, lambda_threshold=1.0)
        batch = run_sessions(mdp, SHORT, how, blind, np.array([3], np.uint64))
        one = alone(mdp, SHORT, how, blind, 3)
        assert batch.misleads[0] == one.misleads
        assert (one.misleads > 0) == judged


def test_episodes_may_begin_anywhere() -> None:
    mdp = board()
    anywhere = replace(mdp, starts=tuple(np.flatnonzero(~mdp.terminal).tolist()))
    settings = replace(SHORT, count_start=False)
    batch = run_sessions(anywhere, settings, GateSettings("never"), None, np.array([5], np.uint64), keep_tables=True)
    one = alone(anywhere, settings, GateSettings("never"), None, 5)
    np.testing.assert_array_equal(batch.steps[0], one.steps)
    np.testing.assert_array_equal(batch.q[0], one.q)


def test_a_session_does_not_depend_on_its_company() -> None:
    mdp, how = board(), replace(EAGER, gate="combined")
    seeds = np.arange(3 * LANES + 1, dtype=np.uint64)
    together = run_sessions(mdp, SHORT, how, advice(mdp), seeds)
    apart = [run_sessions(mdp, SHORT, how, advice(mdp), part) for part in np.array_split(seeds, 4)]
    for name in ("steps", "guided", "requests", "helped_steps", "misleads", "rejected_at_episode", "moves"):
        np.testing.assert_array_equal(getattr(together, name), np.concatenate([getattr(one, name) for one in apart]))


def test_without_an_advisor_nobody_is_asked() -> None:
    batch = run_sessions(board(), SHORT, GateSettings("always"), None, np.arange(3, dtype=np.uint64))
    assert (batch.requests.sum(), batch.helped_steps.sum(), batch.q.shape) == (0, 0, (0, 25, 4))
    none = run_sessions(board(), SHORT, GateSettings("always"), None, np.zeros(0, np.uint64))
    assert none.steps.shape == (0, 40)


def test_what_the_kernel_cannot_do_is_refused() -> None:
    mdp, seeds = board(), np.arange(1, dtype=np.uint64)
    with pytest.raises(BadInput, match="unknown learner 'sarsa'"):
        run_sessions(mdp, replace(SHORT, learner="sarsa"), EAGER, None, seeds)
    with pytest.raises(BadInput, match="unknown selection 'greedy'"):
        run_sessions(mdp, replace(SHORT, selection="greedy"), EAGER, None, seeds)
    with pytest.raises(BadInput, match="unknown gate 'maybe'"):
        run_sessions(mdp, SHORT, replace(EAGER, gate="maybe"), None, seeds)
    with pytest.raises(BadInput, match=r"advice of shape \(1, 9, 4\): the problem has \(25, 4\)"):
        run_sessions(mdp, SHORT, EAGER, Advice.of(np.full((9, 4), 0.25)), seeds)
