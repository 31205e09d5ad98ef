"""A panel: whose word counts, who is asked, who is dropped and heard again, and that it all repeats."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pytest

from lab.advice.advisors import AdvisorName
from lab.advice.panel import ASKED, DECISIONS, Panel, PanelSettings, decided, members_of
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest, Advisor, AdvisorLeft, Walked
from lab.learning.selection import uniforms
from lab.learning.session import Session
from lab.learning.session_events import AdviceGiven, AdvisorDropped, AdvisorReadmitted, AdvisorsDisagreed, Event
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid

LEFT, RIGHT = 0, 1


def corridor() -> TabularMDP:
    """States 0-1-2-3, the goal is 3; a move out of it stays."""
    return grid((4,), np.zeros(4, bool), (0,), (3,), action_labels=("left", "right"))


class Says:
    """An advisor that says what a list holds, one after the other, and counts how often it was asked; "leave" leaves."""

    def __init__(self, *answers: int | str | None):
        self.answers, self.asked = answers, 0

    def advise(self, request: AdviceRequest) -> int | None:
        answer = self.answers[min(self.asked, len(self.answers) - 1)]
        self.asked += 1
        if isinstance(answer, str):
            raise AdvisorLeft
        return answer


def request(state: int = 0, episode: int = 1, step: int = 1, own: int = LEFT) -> AdviceRequest:
    mdp = corridor()
    return AdviceRequest(
        mdp=mdp, q=[[0.0] * 2] * 4, state=state, episode=episode, step=step, own=own, allowed=range(mdp.n_actions)
    )


def panel(members: dict[str, Advisor], told: list[Event] | None = None, **words: Any) -> Panel:
    draw = words.pop("draw", lambda: 0.5)
    settings = PanelSettings(**{"decide": "majority"} | words)
    return Panel(members, 4, settings, draw=draw, tell=(told if told is not None else []).append)


def to_the_goal(episode: int) -> Walked:
    return Walked(episode, [(0, RIGHT, 1), (1, RIGHT, 2), (2, RIGHT, 3)], True, 3, 10.0)


def ask_all_the_way(panel: Panel, episode: int) -> list[int | None]:
    """Asked in 0, 1 and 2, and then the goal was reached by going right, whatever was said."""
    said = [panel.advise(request(state, episode, state + 1)) for state in (0, 1, 2)]
    panel.followed(to_the_goal(episode))
    return said


VOTES = {"a": 1, "b": 1, "c": 2}


@pytest.mark.parametrize(
    ("trusts", "expected"),
    [
        ((0.4, 0.4, 0.75), {"majority": 1, "best-trusted": 2, "trust-weighted": 2}),
        ((0.7, 0.7, 0.8), {"majority": 1, "best-trusted": 2, "trust-weighted": 1}),  # log odds .85 + .85 against 1.39
        ((0.7, 0.7, 0.9), {"majority": 1, "best-trusted": 2, "trust-weighted": 2}),  # against 2.20
        ((0.9, 0.1, 0.6), {"majority": 1, "best-trusted": 1, "trust-weighted": 2}),  # 2.20 - 2.20 against 0.41
    ],
)
def test_whose_word_counts(trusts: tuple[float, float, float], expected: dict[str, int]) -> None:
    known = dict(zip("abc", trusts, strict=True))
    assert {name: decided(VOTES, known, 0, decide) for name, decide in DECISIONS.items()} == expected


def test_between_four_actions_those_who_are_right_in_less_than_half_of_the_cases_still_tell_much() -> None:
    known = {"a": 0.45, "b": 0.45, "c": 0.6}  # log odds over those of 1/4: 0.90 + 0.90 against 1.50
    decide = DECISIONS["trust-weighted"]
    assert decided(VOTES, known, 0, decide, among=4) == 1
    assert decided(VOTES, known, 0, decide, among=2) == 2  # -0.20 - 0.20 against 0.41


@pytest.mark.parametrize("decide", DECISIONS.values(), ids=[*DECISIONS])
def test_ties(decide: Callable[[Sequence[float], float], float]) -> None:
    votes = {"a": 3, "b": 2}
    assert decided(votes, {"a": 0.6, "b": 0.7}, 3, decide) == 2  # the more trusted one
    assert decided(votes, {"a": 0.6, "b": 0.6}, 3, decide) == 3  # the learner's own choice
    assert decided(votes, {"a": 0.6, "b": 0.6}, 0, decide) == 2  # nobody's own: the lowest


def test_a_conflict_is_told() -> None:
    told: list[Event] = []
    three = panel({"a": Says(LEFT), "b": Says(RIGHT), "c": Says(RIGHT), "d": Says(None)}, told)
    assert three.advise(request(1, 7, 3)) == RIGHT
    assert told == [AdvisorsDisagreed(7, 3, 1, (("a", LEFT), ("b", RIGHT), ("c", RIGHT)), RIGHT)]
    told.clear()
    assert panel({"a": Says(LEFT), "b": Says(LEFT)}, told).advise(request()) == LEFT
    assert told == []


def test_who_says_nothing_does_not_vote() -> None:
    assert panel({"a": Says(None), "b": Says(RIGHT)}).advise(request()) == RIGHT
    assert panel({"a": Says(None), "b": Says(None)}).advise(request()) is None


def test_who_leaves_is_asked_no_more() -> None:
    one, other = Says("leave"), Says(RIGHT, "leave")
    both = panel({"a": one, "b": other})
    assert both.advise(request()) == RIGHT
    assert [member.name for member in both.standing()] == ["b"]
    with pytest.raises(AdvisorLeft):
        both.advise(request(1, step=2))
    assert (one.asked, other.asked) == (1, 2)


def test_in_turn_one_is_asked_an_episode() -> None:
    a, b, c = Says(LEFT), Says(RIGHT), Says(None)
    told: list[Event] = []
    three = panel({"a": a, "b": b, "c": c}, told, asked="in-turn")
    for episode in (1, 2, 3):
        for step in (1, 2):
            three.advise(request(0, episode, step))
    assert (a.asked, b.asked, c.asked) == (4, 2, 2)  # c says nothing: the next one is asked
    assert three.advise(request(0, 4)) == LEFT
    assert told == []


def test_trust_is_learned_from_what_followed() -> None:
    """b says right, which leads to the goal; a said left in 1, where it was tried, and in 2, where nobody has tried it."""
    two = panel({"a": Says(RIGHT, LEFT, LEFT), "b": Says(RIGHT)})
    two.advise(request(0, 1, 1))
    two.advise(request(1, 1, 2))
    two.advise(request(2, 1, 5))
    two.followed(Walked(1, [(0, RIGHT, 1), (1, LEFT, 0), (0, RIGHT, 1), (1, RIGHT, 2), (2, RIGHT, 3)], True, 5, 10.0))
    a, b = two.standing()
    assert (a.good, a.bad, a.trust) == (1, 1, 0.5)
    assert (b.good, b.bad, b.trust) == (3, 0, 4 / 5)
    assert 0.0 < a.low < a.trust < a.high < 1.0
    assert two.advise(request(1, 2)) == RIGHT
    two.followed(to_the_goal(2))
    two.followed(Walked(3, [], False, 11, 10.0))  # an episode of no step


def test_an_advisor_that_misleads_is_dropped() -> None:
    """Left in 0 stays where it is; a's ten bad answers, three an episode, are enough after four episodes."""
    told: list[Event] = []
    bad, good = Says(LEFT), Says(RIGHT)
    two = panel({"bad": bad, "good": good}, told, decide="best-trusted")
    two.followed(
        Walked(
            1, [(0, LEFT, 0), (0, RIGHT, 1), (1, LEFT, 0), (0, RIGHT, 1), (1, RIGHT, 2), (2, LEFT, 1)], False, 11, 11.0
        )
    )
    two.followed(to_the_goal(1))  # now every step of the corridor has been tried
    for episode in range(2, 6):
        ask_all_the_way(two, episode)
    assert [type(event) for event in told if not isinstance(event, AdvisorsDisagreed)] == [AdvisorDropped]
    assert told[-1] == AdvisorDropped(
        5, "bad", 1 / 14, "0 of its 12 answers that could be judged led nearer to the goal"
    )
    told.clear()
    assert ask_all_the_way(two, 6) == [RIGHT] * 3
    assert bad.asked == 12  # draws of .5: it is not asked any more
    assert [(member.name, member.dropped) for member in two.standing()] == [("bad", True), ("good", False)]
    assert told == []  # and it is no conflict


def dropped_alone(answers: Iterable[int], told: list[Event], draw: Callable[[], float]) -> tuple[Panel, Says]:
    """One advisor that has said left twelve times, and then what the list says."""
    only = Says(*[LEFT] * 12, *answers)
    one = panel({"only": only}, told, draw=draw)
    one.advise(request())
    one.followed(
        Walked(
            1, [(0, LEFT, 0), (0, RIGHT, 1), (1, LEFT, 0), (0, RIGHT, 1), (1, RIGHT, 2), (2, RIGHT, 3)], True, 6, 9.0
        )
    )
    for step in range(1, 12):
        one.advise(request(0, 2, step))
    one.followed(Walked(2, [(0, LEFT, 0)] * 11, False, 11, 9.0))
    assert isinstance(told[-1], AdvisorDropped)
    told.clear()
    return one, only


def test_a_dropped_advisor_is_asked_one_question_in_ten() -> None:
    rng = np.random.default_rng(0)
    one, only = dropped_alone([LEFT], [], uniforms(rng))
    assert [one.advise(request(0, 3, step)) for step in range(1, 1001)] == [None] * 1000  # nobody is followed
    assert 70 <= only.asked - 12 <= 130


def test_a_dropped_advisor_is_heard_again_after_good_answers() -> None:
    """Five of five answers led nearer, which is beyond doubt; what it said before is forgotten."""
    told: list[Event] = []
    one, _ = dropped_alone([RIGHT], told, lambda: 0.05)
    assert ask_all_the_way(one, 3) == [None] * 3
    assert told == []
    assert ask_all_the_way(one, 4) == [None] * 3
    why = "asked now and then, 6 of its 6 answers led nearer to the goal"
    assert told == [AdvisorReadmitted(4, "only", 7 / 8, why)]
    assert ask_all_the_way(one, 5) == [RIGHT] * 3
    assert [(member.good, member.bad, member.dropped) for member in one.standing()] == [(9, 0, False)]


def test_a_dropped_advisor_that_stays_bad_stays_dropped() -> None:
    told: list[Event] = []
    one, only = dropped_alone([LEFT], told, lambda: 0.05)
    for episode in range(3, 9):
        assert ask_all_the_way(one, episode) == [None] * 3
    assert only.asked == 12 + 18
    assert told == []


def test_an_episode_that_was_broken_off_does_not_count() -> None:
    two = panel({"a": Says(LEFT)})
    two.advise(request(0, 1))
    two.advise(request(1, 2))  # nothing was heard of episode 1
    two.followed(to_the_goal(2))
    assert [(member.good, member.bad) for member in two.standing()] == [(0, 0)]


def test_bad_panels_and_names() -> None:
    with pytest.raises(BadInput, match="no member"):
        panel({})
    with pytest.raises(BadInput, match=r"unknown .*'majorty'.*did you mean 'majority'"):
        panel({"a": Says(0)}, decide="majorty")
    with pytest.raises(BadInput, match=r"unknown .*'turn'.*known: in-turn, together"):
        panel({"a": Says(0)}, asked="turn")
    names = ("expert", "wrong", "expert", "none", "expert")
    found = members_of(names, [Says(0), Says(1), Says(2), None, Says(3)])
    assert [*found] == ["expert", "wrong", "expert 2", "expert 3"]
    assert members_of(("none",), [None]) == {}


def board() -> TabularMDP:
    blocked = np.zeros((5, 5), bool)
    blocked[2, 1:4] = True
    return grid((5, 5), blocked, (0, 0), (4, 4))


def session(names: Sequence[str], decide: str, asked: str, seed: int) -> tuple[SessionResult, list[Event], Panel]:
    mdp, told = board(), list[Event]()
    *streams, own, last = np.random.default_rng(seed).spawn(len(names) + 2)
    members = [
        TableLevel(mdp, 0.99, rng).advisor(AdvisorName.of(name)) for name, rng in zip(names, streams, strict=True)
    ]
    settings = PanelSettings(asked, decide)
    of = Panel(members_of(names, members), mdp.n_states, settings, draw=uniforms(own), tell=told.append)
    learner = LearnerSettings(episodes=40, max_steps=40)
    result = Session(mdp, learner, GateSettings("always"), of, last).run(told.append)
    return result, told, of


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("decide", DECISIONS)
def test_every_way_in_a_session(decide: str, asked: str) -> None:
    """One expert, two that are wrong on purpose: these are dropped, nobody else is, and it all repeats."""
    names = ("wrong", "expert", "wrong")
    result, told, of = session(names, decide, asked, 1)
    standing = {member.name: member.dropped for member in of.standing()}
    assert standing == {"wrong": True, "expert": False, "wrong 2": True}
    assert result.solved
    assert {event.advisor for event in told if isinstance(event, AdvisorDropped)} == {"wrong", "wrong 2"}
    disputes = [n for n, event in enumerate(told) if isinstance(event, AdvisorsDisagreed)]
    assert bool(disputes) == (asked == "together")
    for n in disputes:
        dispute, given = told[n], told[n + 1]
        assert isinstance(dispute, AdvisorsDisagreed)
        assert isinstance(given, AdviceGiven)
        assert (given.state, given.action) == (dispute.state, dispute.followed)
        assert dispute.followed in dict(dispute.said).values()
    again, told_again, of_again = session(names, decide, asked, 1)
    assert told_again == told
    assert of_again.standing() == of.standing()
    np.testing.assert_array_equal(again.q, result.q)


def test_experts_are_not_dropped_for_going_other_ways() -> None:
    """Two experts often say different things, since several ways are as short."""
    for seed in range(5):
        _, told, of = session(("expert", "expert"), "trust-weighted", "together", seed)
        assert not any(member.dropped for member in of.standing())
        assert any(isinstance(event, AdvisorsDisagreed) for event in told)
