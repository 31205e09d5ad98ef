"""The teaching page's document: what it says of a lesson, and which parts of it are new."""

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.learning.requests import AdviceRequest, Standing, TooSlow
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    Event,
    Improvement,
    Verdict,
)
from lab.learning.settings import GateSettings
from lab.mdp import TabularMDP, grid
from lab.seat.page.page_question import picture_of
from lab.seat.page.page_state import (
    MOST,
    PARTS,
    CostCurve,
    PageContent,
    Pending,
    ShownLesson,
    hear,
    layer_of,
    standing_of,
)

LABELS = ("up", "down", "left", "right")


class Drawn:
    def picture(self, state: int) -> str:
        return "\x1b[41mS\x1b[0mF\n\x1b[1;34mG\x1b[0m\x07"


@pytest.fixture
def mdp() -> TabularMDP:
    return grid((1, 4), [[0, 0, 0, 1]], (0, 1), (0, 2), action_labels=LABELS)


@pytest.fixture
def known(mdp: TabularMDP) -> PageContent:
    gate = GateSettings(window=2, first_episode=4, omega=1)
    return PageContent("the page", ShownLesson("maze", mdp=mdp, gate=gate, episodes=9))


def request_in(mdp: TabularMDP) -> AdviceRequest:
    q = [[0.0] * 4, [0.0, 0.0, 0.0, 1.0], [0.0] * 4, [0.0] * 4]
    return AdviceRequest(
        mdp=mdp,
        q=q,
        state=1,
        episode=30,
        step=2,
        own=3,
        reason=TooSlow(-0.25, 0.05),
        temperature=1.0,
        selection="greedy",
        improvement=Improvement(-0.25, 50.0, 40.0),
        allowed=range(mdp.n_actions),
    )


def document(known: PageContent, now_s: float = 0.0, layer: int | None = None) -> dict[str, Any]:
    """All that the page shows, with the slice of one layer, by default the robot's."""
    return {name: part(known, now_s) for name, part in PARTS.items()} | {"slice": layer_of(known, layer)}


def tell(known: PageContent, events: Sequence[Event]) -> list[str]:
    """The notices after these events."""
    for event in events:
        known.changed(*hear(known.learning, event))
    return [notice["text"] for notice in document(known)["notices"]]


def ended(episode: int, steps: int, helped: int = 0, reached: bool = True) -> EpisodeEnded:
    return EpisodeEnded(episode, steps, helped > 0, helped, None, reached)


# ---- the document


def test_the_document_is_plain_json_at_every_stage(known: PageContent, mdp: TabularMDP) -> None:
    empty = document(PageContent("the page"))
    assert set(empty) == {*PARTS, "slice"}
    assert json.loads(json.dumps(empty, allow_nan=False)) == empty
    known.pending = Pending(request_in(mdp), 10.0, 100.0, number=7)
    assert json.loads(json.dumps(document(known), allow_nan=False)) == document(known)


def test_a_question_says_where_what_and_why(known: PageContent, mdp: TabularMDP) -> None:
    known.pending = Pending(replace(request_in(mdp), undoable=True), 10.0, 100.0, number=7)
    asked = document(known, now_s=96.5)["question"]
    assert asked["title"] == "Episode 30, step 2: at (0, 1)"
    assert (asked["number"], asked["kind"], asked["own"], asked["at"]) == (7, "step", 3, [0, 1, 0])
    assert (asked["why"], asked["rate"]) == ("its improvement is -25.0%, below 5%", -0.25)
    assert asked["left_s"] == 3.5
    assert asked["words"] == ["skip", "auto", "quit", "undo"]
    assert [move["leads"] for move in asked["moves"]] == ["nowhere", "nowhere", "", "to the goal"]
    assert [move["chance"] for move in asked["moves"]] == [0.0, 0.0, 0.0, 1.0]
    assert [move["direction"] for move in asked["moves"]] == [0, 1, 2, 3]


def test_the_way_into_an_obstacle_is_said(known: PageContent) -> None:
    near = grid((2, 2), [[0, 1], [0, 0]], (0, 0), (1, 1), action_labels=LABELS)
    known.pending = Pending(
        AdviceRequest(mdp=near, q=[[0.0] * 4] * 4, state=0, episode=1, step=1, own=3, allowed=range(near.n_actions))
    )
    assert [move["leads"] for move in document(known)["question"]["moves"]] == [
        "nowhere",
        "",
        "nowhere",
        "into an obstacle",
    ]


def test_where_no_table_says_where_moves_lead_the_page_does_not_either(known: PageContent) -> None:
    """Of an environment without a model: its table stays where it is, and has no goal."""
    stays, no = np.array([[0, 0], [1, 1]]), np.zeros(2, bool)
    unknown = TabularMDP(stays, np.zeros((2, 2)), no, no, 0, ("hit", "stick"))
    known.pending = Pending(
        AdviceRequest(mdp=unknown, q=[[0.0] * 2] * 2, state=0, episode=1, step=1, own=1, allowed=range(2))
    )
    assert [move["leads"] for move in document(known)["question"]["moves"]] == ["", ""]


def test_an_environments_own_drawing_keeps_its_colours(mdp: TabularMDP, known: PageContent) -> None:
    known.pending = Pending(replace(request_in(mdp), environment=Drawn()))
    asked = document(known)["question"]
    assert asked["picture"] == [[["S", "bg-1"], ["F", ""]], [["G", "bold fg-4"]]]
    assert {move["leads"] for move in asked["moves"]} == {""}  # chance may decide
    assert picture_of(" \n ") == []


def test_the_lesson_and_the_map_are_there_before_any_question(known: PageContent) -> None:
    shown = document(known)
    assert shown["lesson"] == {
        "title": "maze",
        "page": "the page",
        "asks": True,
        "kind": "steps",
        "unit": "steps",
        "episodes": 9,
        "optimal": None,
        "proven": True,
        "method": "",
        "learned": [],
        "threshold": 0.05,
    }
    assert shown["slice"]["marks"] == "..G#"
    assert shown["robot"] is None
    assert document(known, layer=99)["slice"]["layer"] == 0


def test_a_problem_without_a_grid_has_no_map() -> None:
    mdp = TabularMDP(np.array([[1], [1]]), np.zeros((2, 1)), np.array([0, 1]), np.array([0, 1]), 0, ("go",))
    known = PageContent("", ShownLesson("steps", mdp=mdp))
    assert document(known)["place"] is None
    assert document(known)["slice"] is None


# ---- what has changed


def test_only_what_has_changed_is_new(known: PageContent) -> None:
    seen = dict.fromkeys(PARTS, known.settle())
    assert known.since({}) == list(PARTS)
    assert known.since(seen) == []
    known.changed("curve", "standing")
    version = known.settle()
    assert known.since(seen) == ["curve", "standing"]
    assert known.settle() == version  # nothing more


# ---- events


def test_the_curve_holds_every_episode_and_marks_the_guided_ones(known: PageContent) -> None:
    tell(known, [ended(1, 30), ended(2, 20, helped=4), ended(3, 10)])
    assert document(known)["curve"] == {"per": 1, "count": 3, "means": [30.0, 20.0, 10.0], "guided": [0, 1, 0]} | {
        "bests": [30.0, 20.0, 10.0],
        "best": [10, 3],
    }


def test_the_averages_are_of_the_last_two_windows(known: PageContent) -> None:
    tell(known, [ended(n, steps) for n, steps in enumerate([99, 40, 20, 10, 6], start=1)])
    standing = document(known)["standing"]
    assert (standing["current"], standing["previous"]) == (8.0, 30.0)


def test_answers_are_counted(known: PageContent) -> None:
    given = [AdviceGiven(4, 1, 0, 3, 2), AdviceGiven(4, 2, 1, None, 2)]
    tell(known, [AdviceRequested(4, -0.1, 9.0, 8.0), *given, AdviceRemembered(4, 7)])
    standing = document(known)["standing"]
    counts = [standing[name] for name in ("requests", "taken", "skipped", "helped_steps", "remembered")]
    assert counts == [1, 1, 1, 1, 7]
    assert (standing["current"], standing["previous"]) == (9.0, 8.0)
    assert document(known)["robot"] == [0, 1, 0]


def test_a_guided_episode_is_told_and_an_unguided_one_is_not(known: PageContent) -> None:
    assert tell(known, [ended(1, 30), ended(2, 20, helped=4), ended(3, 201, helped=2, reached=False)]) == [
        "Episode 2 reached the goal in 20 steps; moves advised: 4.",
        "Episode 3 did not reach the goal: 201 steps; moves advised: 2.",
    ]


def test_a_guided_episode_is_as_good_as_its_verdict(known: PageContent) -> None:
    verdicts: tuple[Verdict, ...] = ("better", "best", "misled")
    told = tell(known, [replace(ended(n, 16, helped=1), verdict=verdict) for n, verdict in enumerate(verdicts)])
    assert told == [
        "Episode 0 reached the goal in 16 steps, better than before; moves advised: 1.",
        "Episode 1 reached the goal in 16 steps, as good as the best so far; moves advised: 1.",
        "Episode 2 reached the goal in 16 steps, no better than before; moves advised: 1.",
    ]
    assert [notice["tone"] for notice in document(known)["notices"]] == ["good", "good", "bad"]


def test_a_rejection_is_told_with_its_numbers(known: PageContent) -> None:
    asked = [AdviceRequested(n, None, None, None) for n in range(4)]
    (text,) = tell(known, [*asked, AdviceRejected(33, 3, 2, 50, 41.25)])
    assert text == (
        "The learner takes no more advice (episodes misled: 3, tolerated: 2). "
        "Episode 33 counted 50 steps, those before it 41.2."
    )
    assert document(known)["standing"]["verdict"] == "rejected"


def test_the_end_of_advice_is_told(known: PageContent) -> None:
    (text,) = tell(known, [AdviceEnded(9, "converged")])
    assert text == "Episode 9: the same result again and again; the learner asks no more."
    assert document(known)["standing"]["verdict"] == "converged"


def test_disagreement_dropping_and_readmission_are_told(known: PageContent) -> None:
    events: list[Event] = [
        AdvisorsDisagreed(5, 1, 1, (("ann", 0), ("bob", 3)), 3),
        AdvisorDropped(6, "ann", 0.25, "4 of 5 did not help"),
        AdvisorReadmitted(9, "ann", 0.75, "it was right lately"),
    ]
    assert tell(known, events) == [
        "Step 1 at (0, 1): ann says up, bob says right; it follows bob.",
        "Episode 6: ann is heard no more (trust 25%): 4 of 5 did not help.",
        "Episode 9: ann is heard again (trust 75%): it was right lately.",
    ]


def test_what_is_said_again_at_once_is_counted(known: PageContent) -> None:
    again = AdvisorsDisagreed(5, 1, 1, (("ann", 0),), 3)
    tell(known, [again, again, again])
    (notice,) = document(known)["notices"]
    assert notice["times"] == 3


def test_a_mislead_is_told_when_the_learner_asks_again(known: PageContent) -> None:
    standing_of(known.learning, Standing(4, 100, 1, 7, 0.05))
    standing_of(known.learning, Standing(5, 100, 1, 7, 0.05))
    assert [notice["text"] for notice in document(known)["notices"]] == [
        "The last lesson did not help: 1 so far, 7 are tolerated."
    ]
    assert document(known)["standing"]["helped_steps"] == 5


# ---- long sessions


def test_a_curve_stays_short() -> None:
    """One episode more than fits: pairs are put together, and the last one stands alone."""
    curve = CostCurve()
    for number in range(MOST + 1):
        curve.add(number, number == 3)
    shown = curve.document()
    assert (shown["per"], shown["count"], len(shown["means"])) == (2, MOST + 1, MOST // 2 + 1)
    assert shown["means"][:3] == [0.5, 2.5, 4.5]
    assert shown["means"][-1] == MOST
    assert shown["guided"][:3] == [0, 1, 0]


def test_notices_do_not_pile_up(known: PageContent) -> None:
    texts = tell(known, [ended(n, 10, helped=1) for n in range(1000)])
    assert len(texts) == 60
    assert texts[-1].startswith("Episode 999")
