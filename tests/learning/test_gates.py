"""When gates open, ask, stop and reject: step counts worked out by hand; good and bad advisors at each gate."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
import pytest

from lab.advice.advisors import AdvisorName
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.gates import GATES, Gate, Surroundings, deviation, improvement
from lab.learning.gates.gate import evidence
from lab.learning.members import Member
from lab.learning.requests import TooSlow
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES, Update
from lab.mdp import grid

LIMIT = 200
FAILED = LIMIT + 1
SETTINGS = GateSettings(first_episode=5, window=2, omega=1, lambda_threshold=0.05, psi=0.5)


def gate(name: str, settings: GateSettings = SETTINGS, episodes: int = 100) -> Gate:
    return GATES[name].make(settings, episodes, LIMIT, None)


def opened(one: Gate, steps: Sequence[int]) -> list[int]:
    """The episodes that open when these are the results; no episode is judged."""
    return [episode for episode in range(1, len(steps) + 2) if one.opens(episode, steps[: episode - 1])]


def test_improvement_by_hand() -> None:
    assert improvement([8, 8, 6], 2) is None
    found = improvement([99, 8, 8, 6, 4], 2)
    assert found is not None
    assert (found.rate, found.current_mean, found.previous_mean) == (0.375, 5.0, 8.0)


@pytest.mark.parametrize("name", ["ccrl", "combined"])
def test_ccrl_asks_while_the_ratio_of_the_means_exceeds_one_minus_lambda(name: str) -> None:
    # before episode 5 the means are 100 and 96 (ratio .96 > .95), before 6: 98 and 93 (.949), before 7: 96 and 96
    assert opened(gate(name), [100, 100, 96, 96, 90, 102]) == [5, 7]


def test_ccrl_waits_for_episode_x_and_for_two_windows() -> None:
    flat = [FAILED] * 12
    assert opened(gate("ccrl", GateSettings(first_episode=8, window=2)), flat) == [8, 9, 10, 11, 12, 13]
    with pytest.raises(BadInput, match=r"first_episode = 9: the gate 'ccrl' compares two windows of 5.*at least 10"):
        GateSettings(first_episode=9, window=5)


def test_ccrl_leaves_the_last_episode_to_the_learner() -> None:
    assert opened(gate("ccrl", episodes=8), [FAILED] * 7) == [5, 6, 7]


def test_ccrl_stops_after_more_than_2k_equal_results() -> None:
    # the result before episode 5 is remembered, those before 6..10 equal it: the fifth is more than 2K = 4
    one = gate("ccrl")
    assert opened(one, [20] * 14) == [5, 6, 7, 8, 9]
    assert one.converged
    assert not one.opens(20, [*[20] * 14, 100, 100])  # for good


def test_ccrl_never_calls_failure_convergence() -> None:
    one = gate("ccrl")
    assert opened(one, [FAILED] * 14) == list(range(5, 16))
    assert not one.converged


@pytest.mark.parametrize("name", ["ccrl", "combined"])
def test_a_helped_episode_that_is_not_better_is_a_mislead(name: str) -> None:
    one = gate(name)
    one.judges([10, 10, 9], opened=True)
    assert one.misleads == 0
    one.judges([10, 10, 10], opened=True)  # equal is not better
    assert (one.misleads, one.rejected) == (1, False)
    one.judges([10, 10, 11], opened=False)
    assert (one.misleads, one.rejected) == (1, False)
    one.judges([10, 20, 16], opened=True)
    assert (one.misleads, one.rejected) == (2, True)
    assert not one.opens(50, [FAILED] * 49)


def test_as_good_as_the_best_so_far_may_be_spared() -> None:
    # 10 is the best of episodes 1 and 2; episode 3 equals it, 4 does not, 5 is better than before, 6 failed
    results, printed = [10, 10, 10, 12, 9, FAILED], gate("ccrl")
    spared = gate("ccrl", replace(SETTINGS, spare_best=True))
    verdicts: dict[Gate, list[str]] = {printed: [], spared: []}
    for one, found in verdicts.items():
        for n in range(1, len(results) + 1):
            one.judges(results[:n], opened=n > 2)
            found.append(one.verdict)
    assert verdicts[printed] == ["", "", "misled", "misled", "", ""]  # rejected by then
    assert verdicts[spared] == ["", "", "best", "misled", "better", "misled"]
    assert (spared.misleads, spared.rejected) == (2, True)


def corridor_walks(one: Gate, starts: Sequence[int], opened: int, extra: Sequence[int] = ()) -> Sequence[str]:
    """Walks to cell 0 from these cells, some with steps in place at their start; the verdicts, open from episode n on."""
    results, found = list[int](), []
    for n, start in enumerate(starts, start=1):
        one.begins(start)
        wasted = extra[n - 1] if extra else 0
        for cell in [*[start] * wasted, *range(start, 0, -1)]:
            one.saw(cell, 0, -0.1, 1.0, cell - 1, 0)
        results.append(start + wasted)
        one.judges(results, opened=n >= opened)
        found.append(one.verdict)
    return found


@pytest.mark.parametrize("name", ["ccrl", "combined"])
def test_walks_from_different_starts_are_compared_by_how_far_the_goal_was(name: str) -> None:
    several = Surroundings(lambda: 0.0, lambda count: [], several_starts=True)

    def made(spare_best: bool) -> Gate:
        return GATES[name].make(replace(SETTINGS, spare_best=spare_best), 100, LIMIT, several)

    # the first two waste 2 steps each; 9 cells in 10 steps are better than that, though 10 is more than 3 and 4
    assert corridor_walks(made(False), [1, 2, 9], 3, [2, 2, 1]) == ["", "", "better"]
    # 2 cells in 5 steps waste more, though 5 is less than 9 and 8
    assert corridor_walks(made(True), [9, 8, 2], 3, [0, 0, 3]) == ["", "", "misled"]
    # nobody wastes a step: no better than before, as printed, but nobody could be
    assert corridor_walks(made(False), [9, 8, 2, 6], 3) == ["", "", "misled", "misled"]
    assert corridor_walks(made(True), [9, 8, 2, 6], 3) == ["", "", "best", "best"]


def test_a_failed_episode_is_a_mislead_wherever_it_began() -> None:
    several = Surroundings(lambda: 0.0, lambda count: [], several_starts=True)
    one = GATES["ccrl"].make(replace(SETTINGS, spare_best=True), 100, LIMIT, several)
    for n in range(1, 5):
        one.begins(n)
        one.saw(n, 0, -0.1, 1.0, n, 0)
        one.judges([FAILED] * n, opened=n > 2)
    assert one.misleads == 2


@pytest.mark.parametrize("name", ["ia", "combined"])
def test_introspection_asks_where_the_values_lie_close(name: str) -> None:
    one = gate(name)
    assert one.asks(0, [0.0, 0.0, 0.0])
    assert one.asks(0, [0.0, 0.5])
    assert not one.asks(0, [0.0, 0.51])


def test_introspection_begins_at_episode_x_and_never_rejects() -> None:
    one = gate("ia")
    assert [episode for episode in range(1, 8) if one.opens(episode, [])] == [5, 6, 7]
    one.judges([1, 1, 9], opened=True)
    assert not one.rejected


def test_always_and_never() -> None:
    assert opened(gate("always"), [20] * 3) == [1, 2, 3, 4]
    assert gate("always").asks(0, [0.0, 9.0])
    assert opened(gate("never"), [FAILED] * 20) == []


def taught(name: str, advisor: str, seed: int) -> SessionResult:
    blocked = np.zeros((6, 6), bool)
    blocked[1:5, 2] = blocked[2, 4] = True
    mdp = grid((6, 6), blocked, (2, 0), (3, 5))
    settings = GateSettings(name, first_episode=10, window=3, omega=2, rate=0.3)
    adviser = TableLevel(mdp, 0.99, np.random.default_rng([seed, 1])).advisor(AdvisorName.of(advisor))
    return Session(mdp, LearnerSettings("q", episodes=80), settings, adviser, np.random.default_rng(seed)).run()


@pytest.mark.parametrize("name", GATES)
def test_experts_and_novices_at_every_gate(name: str) -> None:
    experts, novices = ([taught(name, advisor, seed) for seed in range(6)] for advisor in ("expert", "novice"))
    helped = sum(result.helped_steps for result in experts)
    assert (helped > 0) == (name != "never")
    if name in ("ccrl", "combined"):
        assert sum(result.rejected_at_episode is not None for result in novices) >= 4
        assert all(result.misleads <= 3 for result in novices)
        assert all(not result.guided[-1] for result in experts)
    else:
        assert all(result.rejected_at_episode is None and result.misleads == 0 for result in novices)
    if name not in ("never", "novelty"):  # that one asks once a state, and has the rest to learn
        assert all(result.solved for result in experts)
        late = [np.mean([result.steps[9:40] for result in results]) for results in (experts, novices)]
        assert late[0] < late[1]


def test_cq_asks_while_the_mean_is_above_a_constant() -> None:
    one = gate("cq", GateSettings("cq", first_episode=3, window=2, enough_steps=10.0))
    assert opened(one, [FAILED, 11, 10, 10, 9, 12]) == [3, 4, 7]  # means before 3..7: 106, 10.5, 10, 9.5, 10.5
    assert str(one.why) == "the last 2 episodes took 10.5 steps, more than 10"


def test_importance_asks_where_the_values_lie_far_apart() -> None:
    one = gate("importance")
    assert [one.asks(0, values) for values in ([0.0, 0.4], [0.0, 0.5], [0.5, 0.0])] == [False, True, True]


def test_random_asks_at_its_rate() -> None:
    draws = iter([0.05, 0.5, 0.15, 0.0])
    around = Surroundings(draws.__next__, lambda count: [])
    one = GATES["random"].make(GateSettings(rate=0.1), 10, LIMIT, around)
    assert [one.asks(0, [0.0]) for _ in range(4)] == [True, False, False, True]


def test_the_deviation_of_tables_by_hand() -> None:
    # action 0: values 0 and 2, variance 1; action 1: 3 and 3, variance 0; the root of their mean
    assert deviation([[0.0, 3.0], [2.0, 3.0]]) == 0.5**0.5


def test_uncertainty_falls_where_the_learner_has_been() -> None:
    mdp = grid((1, 6), np.zeros((1, 6), bool), (0, 0), (0, 5))
    rng = np.random.default_rng(0)

    def tables(count: int) -> list[Update]:
        made = [UPDATES["q"].make(np.zeros((6, 4)).tolist(), LearnerSettings("q"), mdp) for _ in range(count)]
        for table in made:
            table.scatter(rng.random)
        return made

    one = GATES["uncertainty"].make(GateSettings(spread=0.05), 10, LIMIT, Surroundings(rng.random, tables))
    one.begins(3)
    assert one.asks(3, [])
    for _ in range(40):
        for action in range(4):
            entered = int(mdp.successor[3, action])
            one.saw(3, action, -0.1, 0.0, entered, 0)
    assert not one.asks(3, [])
    assert one.asks(2, [])


@pytest.mark.parametrize("learner", UPDATES)
def test_the_ensemble_learns_as_the_learner_does(learner: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table that learns from every step and starts as the learner does ends as the learner; some episodes break off."""
    mdp, settings, made = (
        grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2)),
        LearnerSettings(learner, episodes=9, max_steps=5),
        [],
    )

    def ensemble(of: GateSettings, episodes: int, max_steps: int, around: Surroundings | None) -> Gate:
        tables = [UPDATES[learner].make(np.zeros((6, 4)).tolist(), settings, mdp) for _ in range(of.ensemble)]
        made.extend(tables)
        return GATES["uncertainty"].make(of, episodes, max_steps, Surroundings(lambda: 0.0, lambda count: tables))

    monkeypatch.setitem(GATES, "certain", Member(ensemble, "certain"))
    adviser = TableLevel(mdp, 0.99, np.random.default_rng(1)).advisor(AdvisorName.of("novice"))
    asks = GateSettings("certain", first_episode=3, spread=0.0, ensemble=2)
    result = Session(mdp, settings, asks, adviser, np.random.default_rng(0)).run()
    assert result.helped_steps > 0
    for table in made:
        np.testing.assert_array_equal(list(table.q), result.q)


def test_the_combined_gate_says_both_of_its_reasons() -> None:
    one = gate("combined")
    assert one.opens(5, [100, 100, 96, 96])
    assert one.asks(0, [0.0, 0.25])
    assert str(one.why) == "its improvement is +4.0%, below 5%, and the values here span 0.25, at most 0.5"


def test_each_reason_is_a_record_of_its_figures() -> None:
    one = gate("ccrl")
    assert one.opens(5, [100, 100, 96, 96])
    assert isinstance(one.why, TooSlow)
    assert (round(one.why.rate, 9), one.why.threshold) == (0.04, 0.05)


def test_evidence_by_hand() -> None:
    """Times longer than its own, times 2/3, less log 3 where the goal was reached; between -log 50 and what it comes to."""
    assert evidence(0.0, 60, 100.0, 5, failed=False, throughout=True) == pytest.approx(3 * 2 / 3 - log(3))
    assert evidence(0.0, 20, 100.0, 5, failed=False, throughout=True) == pytest.approx(2 / 3 - log(3))
    assert evidence(0.0, FAILED, 5 * FAILED, 1, failed=True, throughout=False) == pytest.approx(2 / 3 / 5)
    assert evidence(0.0, FAILED, 5 * FAILED, 0, failed=True, throughout=True) == pytest.approx(2)  # counts three times
    assert evidence(0.0, FAILED, 5 * FAILED, 0, failed=True, throughout=False) == 0.0
    assert evidence(-3.9, 1, 100.0, 5, failed=False, throughout=True) == -log(50)


def test_by_evidence_two_failures_by_advice_reject_and_own_episodes_do_not_count() -> None:
    """2 + 2 exceeds log 50 = 3.91; a success between them, as long as the learner's own, takes log 3 - 2/3 = 0.43 off."""

    def judged(*results: int) -> Gate:
        one = gate("ccrl", replace(SETTINGS, by_evidence=True))
        steps = [10, 10]
        for n in (1, 2):
            one.judges(steps[:n], False)
        for result in results:
            one.begins(0)
            for _ in range(min(result, LIMIT)):
                one.takes(0, 0, 0)
                one.saw(0, 0, 0.0, 1.0, 0, 0)
            steps.append(result)
            one.judges(steps, True)
        return one

    assert not judged(10, 10, 10, 10).misleads
    assert judged(FAILED).rejected  # 20 times as long as its own
    slow = judged(29)  # 2.9 * 2/3 - log 3 = 0.83
    assert (slow.misleads, slow.verdict, slow.rejected) == (1, "misled", False)
    assert judged(*[29] * 5).rejected  # 5 * 0.83 > 3.91
    assert not judged(*[29] * 4).rejected
