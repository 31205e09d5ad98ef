"""The one session: what every learner must do, what is reported, and how it ends early."""

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

from lab.advice.advisors import PEOPLE, AdvisorName, named
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.environment import Judged, Step, TableEnvironment
from lab.learning.gates import GATES, Gate
from lab.learning.requests import AdviceRequest, AdvisorLeft, Walked
from lab.learning.selection import SELECTIONS, Draw
from lab.learning.session import Session
from lab.learning.session_events import (
    AdviceEnded,
    AdviceRejected,
    AdviceRemembered,
    EpisodeEnded,
    Event,
    Improvement,
)
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES, Row
from lab.learning.updates.update import OnTable
from lab.mdp import FloatArray, Rewards, TabularMDP, coverage, greedy_path, grid, optimal_values
from lab.testing.contracts import EARLY, SHORT, board, check_advisor, check_gate, check_learner, check_session, session

WHOLE_WAYS = ("q-lambda", "sarsa-lambda", "monte-carlo", "dyna-q")  # with lambda 1 they learn a whole way at once


def corridor(length: int) -> TabularMDP:
    return grid((length,), np.zeros(length, bool), (0,), (length - 1,), action_labels=("left", "right"))


class Scripted:
    """Answers with what a function of the request says, and remembers the requests."""

    def __init__(self, answer: Any):
        self.answer, self.requests = answer, list[AdviceRequest]()

    def advise(self, request: AdviceRequest) -> int | None:
        self.requests.append(request)
        answer: int | None = self.answer(request)
        return answer


@pytest.mark.parametrize("learner", UPDATES)
def test_every_learner_solves_small_boards_with_an_expert(learner: str) -> None:
    check_learner(learner)


@pytest.mark.parametrize("gate", GATES)
def test_every_gate_keeps_its_contract(gate: str) -> None:
    check_gate(gate)


@pytest.mark.parametrize("memory", [False, True])
@pytest.mark.parametrize("learner", UPDATES)
@pytest.mark.parametrize("gate", GATES)
def test_results_fit_together_and_repeat(learner: str, gate: str, memory: bool) -> None:
    check_session(learner, gate, memory)


@pytest.mark.parametrize("advisor", [name for name in named() if name not in PEOPLE])
def test_every_simulated_advisor_can_help(advisor: str) -> None:
    check_advisor(advisor)
    result, _ = session(board(3), advisor, gate="always", episodes=20)
    assert (result.helped_steps > 0) == (advisor != "none")
    assert result.helped_steps in (0, result.visits.sum())


def test_another_seed_gives_another_session() -> None:
    assert session(board(4), seed=1)[0].steps.tolist() != session(board(4), seed=2)[0].steps.tolist()


def test_a_failed_episode_counts_one_more_than_the_limit() -> None:
    walls = grid(
        (1, 3), np.array([[True, False, False]]), (0, 1), (0, 2), action_labels=("up", "down", "left", "right")
    )
    into_the_wall, to_the_goal, still = (Scripted(lambda request, a=action: a) for action in (2, 3, 0))
    always = GateSettings(gate="always")
    few = LearnerSettings(episodes=2, max_steps=4)
    for advisor, expected in ((into_the_wall, [5, 5]), (to_the_goal, [1, 1]), (still, [5, 5])):
        result = Session(walls, few, always, advisor, np.random.default_rng(0)).run()
        assert result.steps.tolist() == expected
    assert result.helped_steps == len(still.requests) == 8  # nobody is asked for a move that is never made


@pytest.mark.parametrize("learner", [name for name in UPDATES if name != "afterstate"])
def test_advice_is_learned_as_if_it_were_the_learners_own(learner: str) -> None:
    # alpha 1, gamma 1: cell 1 learns 1.5; cell 0 learns -.1 + 1.5 an episode later, with traces of lambda 1 at once
    settings = LearnerSettings(learner, alpha=1.0, discount=1.0, trace=1.0, episodes=2)
    right = Scripted(lambda request: 1)
    result = Session(corridor(3), settings, GateSettings("always"), right, np.random.default_rng(0)).run()
    np.testing.assert_allclose(result.q, [[0.0, 1.4], [0.0, 1.5], [0.0, 0.0]], atol=1e-12)
    assert result.visits.tolist() == [[0, 2], [0, 2], [0, 0]]
    once = Session(
        corridor(3), replace(settings, episodes=1), GateSettings("always"), right, np.random.default_rng(0)
    ).run()
    np.testing.assert_allclose(once.q[0, 1], 1.4 if learner in WHOLE_WAYS else -0.1, atol=1e-12)


def test_afterstates_learn_advice_by_hand() -> None:
    # alpha 1, gamma 1; episode 1: V(0) = V(1) = -.1, then the goal shows its 1.5; episode 2: V(0) = -.2, V(1) = 1.4
    settings = LearnerSettings("afterstate", alpha=1.0, discount=1.0, episodes=2)
    right = Scripted(lambda request: 1)
    result = Session(corridor(3), settings, GateSettings("always"), right, np.random.default_rng(0)).run()
    np.testing.assert_allclose(result.q, [[-0.3, 1.3], [-0.3, 1.4], [0.0, 0.0]], atol=1e-12)


def test_the_start_may_count_as_a_step() -> None:
    right, still = (Scripted(lambda request, a=action: a) for action in (1, 0))
    always, settings = GateSettings("always"), LearnerSettings(episodes=1, max_steps=4, count_start=True)
    moved = Session(corridor(4), settings, always, right, np.random.default_rng(0)).run()
    assert (moved.steps.tolist(), moved.visits.sum()) == ([4], 3)  # three moves are four steps
    stayed = Session(corridor(4), settings, always, still, np.random.default_rng(0)).run()
    assert (stayed.steps.tolist(), stayed.visits.sum()) == ([5], 3)


def test_the_gate_says_why_and_keeps_to_its_budget() -> None:
    right = Scripted(lambda request: 1)
    gate = GateSettings("always", budget=4)
    result = Session(corridor(4), LearnerSettings(episodes=5), gate, right, np.random.default_rng(0)).run()
    assert result.helped_steps == len(right.requests) == 4
    assert {str(request.reason) for request in right.requests} == {"it asks about every step"}


def test_an_expert_on_the_shortest_way_misleads_as_printed_but_not_where_the_best_is_spared() -> None:
    settings, events = LearnerSettings("q", episodes=30, max_steps=20), list[Event]()
    for spare_best in (False, True):
        # Lambda 1: it asks until 2K + 1 results were the same; nobody can be better than 3 steps
        gate = GateSettings(first_episode=4, window=2, omega=3, lambda_threshold=1.0, spare_best=spare_best)
        right = Scripted(lambda request: 1)
        result = Session(corridor(4), settings, gate, right, np.random.default_rng(0)).run(events.append)
        assert (result.misleads > 0) == (not spare_best)
        verdicts = {one.verdict for one in events if isinstance(one, EpisodeEnded) and one.guided}
        assert ("misled" in verdicts, "best" in verdicts) == (not spare_best, spare_best)
        events.clear()


@pytest.mark.parametrize(("advisor", "rejected"), [("expert", False), ("wrong", True)])
def test_who_is_rejected_does_not_hang_on_where_episodes_begin(advisor: str, rejected: bool) -> None:
    open_field = grid((8, 8), np.zeros((8, 8), bool), (0, 0), (7, 7))
    anywhere = replace(open_field, starts=tuple(np.flatnonzero(~open_field.terminal).tolist()))
    settings, gate = LearnerSettings(episodes=120, max_steps=60), GateSettings(spare_best=True)
    results = []
    for seed in range(8):
        adviser = TableLevel(anywhere, settings.discount, np.random.default_rng([seed, 1])).advisor(
            AdvisorName.of(advisor)
        )
        results.append(Session(anywhere, settings, gate, adviser, np.random.default_rng(seed)).run())
    assert all((result.rejected_at_episode is not None) == rejected for result in results)


@pytest.mark.parametrize("selection", SELECTIONS)
def test_every_selection_learns_a_corridor(selection: str) -> None:
    settings = LearnerSettings("q", selection=selection, exploration=0.5, episodes=60)
    assert Session(corridor(4), settings, GateSettings("never"), None, np.random.default_rng(0)).run().solved


def test_the_request_shows_where_the_learner_is() -> None:
    right = Scripted(lambda request: 1)
    settings = LearnerSettings(episodes=3)
    gate = GateSettings("always", window=1)
    Session(corridor(4), settings, gate, right, np.random.default_rng(0)).run()
    first, last = right.requests[0], right.requests[-1]
    assert [(r.episode, r.step, r.state) for r in right.requests[:4]] == [(1, 1, 0), (1, 2, 1), (1, 3, 2), (2, 1, 0)]
    assert (first.improvement, last.improvement) == (None, Improvement(0.0, 3.0, 3.0))
    assert all(request.own in (0, 1) for request in right.requests)
    assert np.shape(first.q) == (4, 2)


def test_no_answer_leaves_the_step_to_the_learner() -> None:
    shy = Scripted(lambda request: None)
    alone, _ = session(board(3), "none", gate="always", learner="q")
    result = Session(
        board(3), replace(SHORT, learner="q"), replace(EARLY, gate="always"), shy, np.random.default_rng(0)
    ).run()
    np.testing.assert_array_equal(result.q, alone.q)
    assert (result.helped_steps, bool(result.guided.any()), result.requests, alone.requests) == (0, False, 60, 0)


def test_an_advisor_that_leaves_is_not_asked_again() -> None:
    def leave(request: AdviceRequest) -> int:
        if request.episode == 2 and request.step == 2:
            raise AdvisorLeft
        return 1

    events: list[Event] = []
    advisor = Scripted(leave)
    result = Session(corridor(4), SHORT, GateSettings("always"), advisor, np.random.default_rng(0)).run(events.append)
    assert (result.helped_steps, len(advisor.requests), len(result.steps)) == (4, 5, 60)
    assert [event for event in events if isinstance(event, AdviceEnded)] == [AdviceEnded(2, "advisor left")]
    assert result.guided[:3].tolist() == [True, True, False]


@pytest.mark.parametrize("learner", UPDATES)
def test_an_interruption_loses_nothing(learner: str) -> None:
    def interrupt(request: AdviceRequest) -> int:
        if request.episode == 3 and request.step == 2:
            raise KeyboardInterrupt
        return 1

    settings = replace(SHORT, learner=learner)
    advisor = Scripted(interrupt)
    result = Session(corridor(4), settings, GateSettings("always"), advisor, np.random.default_rng(0)).run()
    assert (result.interrupted, result.steps.tolist(), result.guided.tolist()) == (True, [3, 3], [True, True])
    assert result.visits[:, 1].tolist() == [3, 2, 2, 0]  # the step under way counts too
    assert result.q[2, 1] > 1.0
    assert (result.requests, result.helped_steps) == (2, 6)  # those of the episode under way are not booked


def test_an_interruption_while_reporting_keeps_the_episode() -> None:
    def interrupt(event: Event) -> None:
        if event.episode == 4:
            raise KeyboardInterrupt

    result = Session(corridor(4), SHORT, GateSettings("never"), None, np.random.default_rng(0)).run(interrupt)
    assert (result.interrupted, len(result.steps), len(result.guided)) == (True, 4, 4)


def test_a_misleading_advisor_is_rejected_with_the_numbers() -> None:
    events: list[Event] = []
    back = Scripted(lambda request: 0)
    gate = GateSettings(first_episode=5, window=2, omega=1, lambda_threshold=1.0)
    result = Session(corridor(4), SHORT, gate, back, np.random.default_rng(0)).run(events.append)
    rejections = [event for event in events if isinstance(event, AdviceRejected)]
    mean = (result.steps[3] + result.steps[4]) / 2
    assert rejections == [AdviceRejected(6, 2, 1, 31, mean)]
    assert (result.rejected_at_episode, result.misleads, result.requests, result.helped_steps) == (6, 2, 2, 60)
    assert not result.guided[6:].any()


def test_equal_results_end_the_requests() -> None:
    result, events = session(corridor(4), gate="ccrl", lambda_threshold=1.0)
    ended = [event for event in events if isinstance(event, AdviceEnded)]
    assert [event.reason for event in ended] == ["converged"]
    assert not result.guided[ended[0].episode - 1 :].any()


def test_start_values_are_used_and_checked() -> None:
    mdp = corridor(3)
    known = np.array([[0.0, 1.4], [0.0, 1.5], [9.0, 9.0]])
    settings = LearnerSettings(episodes=1, beta=0.0)
    result = Session(mdp, settings, GateSettings("never"), None, np.random.default_rng(0), known).run()
    assert result.solved
    assert not result.q[2].any()  # a terminal state is worth nothing more
    for bad in (np.zeros((2, 2)), np.full((3, 2), np.nan)):
        with pytest.raises(BadInput, match="start values"):
            Session(mdp, settings, GateSettings(), None, np.random.default_rng(0), bad)


@pytest.mark.parametrize("learner", UPDATES)
def test_with_memory_one_showing_is_enough(learner: str) -> None:
    right = Scripted(lambda request: 1)
    gate, events = GateSettings("always", memory=True), list[Event]()
    settings = LearnerSettings(learner, episodes=40, max_steps=30)
    result = Session(corridor(6), settings, gate, right, np.random.default_rng(0)).run(events.append)
    assert (result.helped_steps, result.requests, len(right.requests)) == (5, 1, 5)
    assert [request.state for request in right.requests] == [0, 1, 2, 3, 4]
    assert result.solved
    told = [event for event in events if isinstance(event, AdviceRemembered)]
    assert all(34 <= event.episode < 40 for event in told)  # practice, if any, is in the last 15 %


def test_a_showing_that_missed_the_goal_is_asked_for_again_three_in_all() -> None:
    shy = Scripted(lambda request: 1 if request.state < 2 else None)  # speaks in the first two cells only
    settings, gate = LearnerSettings(episodes=12, max_steps=4), GateSettings("always", window=3, memory=True)
    result = Session(corridor(9), settings, gate, shy, np.random.default_rng(3)).run()
    assert set(result.steps.tolist()) == {5}  # nine cells are too far for four steps
    assert np.flatnonzero(result.guided).tolist() == [0, 3, 6]
    assert result.requests == 3


@pytest.mark.parametrize("learner", UPDATES)
def test_with_memory_nothing_is_tried_out_in_the_last_episodes(learner: str) -> None:
    settings = LearnerSettings(learner, episodes=40, max_steps=60, beta=0.0)  # as warm as ever to the end
    for seed in range(5):
        draw = np.random.default_rng(seed)
        result = Session(corridor(5), settings, GateSettings("never", memory=True), None, draw).run()
        assert result.steps[-1] == 4
        assert result.solved


def test_with_memory_a_wrong_advisor_loses_its_trust_at_once() -> None:
    back = Scripted(lambda request: 0)  # into the wall, in the first cell
    gate, events = GateSettings("always", memory=True), list[Event]()
    result = Session(corridor(4), SHORT, gate, back, np.random.default_rng(0)).run(events.append)
    assert result.helped_steps == 2  # a point of trust for each, and it began with one
    ended = [event for event in events if isinstance(event, AdviceEnded)]
    assert ended == [AdviceEnded(1, "misled by what was remembered")]
    assert not result.guided[1:].any()


def test_with_memory_only_episodes_with_help_are_judged() -> None:
    gate = GateSettings(first_episode=5, window=2, omega=1, lambda_threshold=1.0)
    silent = Scripted(lambda request: None)
    settings = replace(SHORT, max_steps=4)  # too few for the way: no episode is better than those before
    plain = Session(corridor(9), settings, gate, silent, np.random.default_rng(0)).run()
    kept = Session(corridor(9), settings, replace(gate, memory=True), silent, np.random.default_rng(0)).run()
    assert (plain.misleads, plain.rejected_at_episode) == (2, 6)
    assert (kept.misleads, kept.rejected_at_episode) == (0, None)


def test_memory_keeps_to_the_budget() -> None:
    right = Scripted(lambda request: 1)
    gate = GateSettings("always", budget=3, memory=True)
    result = Session(corridor(6), LearnerSettings(episodes=9), gate, right, np.random.default_rng(0)).run()
    assert result.helped_steps == len(right.requests) == 3


class Slides:
    """A corridor of four cells, no table's: steps are made here, and now and then the floor sends the learner back."""

    def __init__(self) -> None:
        self.mdp = corridor(4)

    def reset(self, episode: int, draw: Draw) -> int:
        return 0

    def step(self, state: int, action: int, draw: Draw) -> Step:
        entered = max(0, state - 1) if draw() < 0.1 else int(self.mdp.successor[state, action])
        return Step(-0.1 if entered < 3 else 1.5, entered, entered == 3, entered == 3)

    def picture(self, state: int) -> str:
        return ""

    def values(self, discount: float) -> FloatArray:
        return optimal_values(self.mdp, discount)

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        return TableEnvironment(self.mdp).judge(q, learner)


def test_memory_works_where_steps_are_left_to_chance() -> None:
    right, gate = Scripted(lambda request: 1), GateSettings("always", memory=True)
    result = Session(Slides(), SHORT, gate, right, np.random.default_rng(0)).run()
    assert result.solved
    assert 3 <= result.helped_steps == len(right.requests) < 60


def test_unknown_names_and_actions() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(BadInput, match=r"unknown learner 'q-lamda'.*did you mean 'q-lambda'"):
        Session(corridor(3), LearnerSettings("q-lamda"), GateSettings(), None, rng).run()
    with pytest.raises(BadInput, match=r"unknown gate 'crl'.*did you mean 'ccrl'"):
        Session(corridor(3), LearnerSettings(), GateSettings("crl"), None, rng).run()
    with pytest.raises(BadInput, match="advisor named action 2: allowed 0"):
        Session(corridor(3), LearnerSettings(), GateSettings("always"), Scripted(lambda request: 2), rng).run()


class TakesOne(Gate):
    """Takes what is an action's equal, and none."""

    def takes(self, state: int, own: int, answer: int | None) -> Any:
        return 1.0


class Halves(OnTable):
    """Keeps half of the table."""

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self.q = self.q[: mdp.n_states // 2]


class Diverges(OnTable):
    """Learns no numbers."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        self.q[s_tm1][a_tm1] = float("nan")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"gate": GATES.named(TakesOne)}, r"gate 'TakesOne' named action 1\.0: allowed 0\.\.1"),
        ({"learner": UPDATES.named(Halves)}, r"learner 'Halves': its `q` has the shape \(1, 2\): wanted \(3, 2\)"),
        ({"learner": UPDATES.named(Diverges)}, r"learner 'Diverges': 2 of its 6 action values are not finite"),
    ],
)
def test_what_an_added_member_does_wrong_is_said_with_its_name(changes: dict[str, str], line: str) -> None:
    learner = replace(SHORT, learner=changes.get("learner", "q"))
    gate = GateSettings(changes.get("gate", "always"))
    with pytest.raises(BadInput, match=line):
        Session(corridor(3), learner, gate, Scripted(lambda request: 1), np.random.default_rng(0)).run()


def test_episodes_begin_at_each_of_several_starts() -> None:
    mdp = replace(board(4), starts=(0, 3, 12))
    starts: set[int] = set()

    def note(request: AdviceRequest) -> None:
        if request.step == 1:
            starts.add(request.state)

    result = Session(mdp, SHORT, GateSettings("always"), Scripted(note), np.random.default_rng(0)).run()
    assert starts == {0, 3, 12}
    assert result.solved == all(greedy_path(result.q, mdp, 99, start)[2] for start in mdp.starts)


def test_the_butter_board_is_covered_in_the_fewest_moves() -> None:
    mdp = coverage((3, 3), Rewards())
    advisor = TableLevel(mdp, 0.99, np.random.default_rng(1)).advisor(AdvisorName.of("expert"))
    result = Session(mdp, LearnerSettings(), GateSettings(), advisor, np.random.default_rng(0)).run()
    assert (result.solved, result.final_steps) == (True, 8)


class AtRandom:
    """Answers by a generator of the session."""

    def __init__(self, rng: np.random.Generator):
        self.rng = rng

    def advise(self, request: AdviceRequest) -> int:
        """Any action."""
        return int(self.rng.integers(len(request.allowed)))


def test_an_advisor_that_takes_a_generator_is_held_to_its_contract() -> None:
    check_advisor(AtRandom)


def test_episodes_may_be_played_one_by_one_and_all_of_them_followed() -> None:
    class Follower(Scripted):
        follows_all = True
        walked: ClassVar[list[int]] = []

        def followed(self, walked: Walked) -> None:
            self.walked.append(walked.episode)

    settings = LearnerSettings(episodes=4, max_steps=9), GateSettings("never")
    whole = Session(corridor(4), *settings, None, np.random.default_rng(1)).run()
    session = Session(corridor(4), *settings, Follower(lambda request: None), np.random.default_rng(1))
    for episode in range(1, 5):
        session.play(episode)
    assert session.result(interrupted=False).steps.tolist() == whole.steps.tolist()
    assert Follower.walked == [1, 2, 3, 4]
