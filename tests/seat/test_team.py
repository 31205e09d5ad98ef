"""Several people advise one learner: who is asked at once, who is waited for, who is not."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lab.learning.requests import AdviceRequest, AdvisorLeft, Reason
from lab.mdp import grid
from lab.seat.page.teaching_page import SeatPage
from lab.seat.team import Team

if TYPE_CHECKING:
    Opens = Callable[..., AbstractContextManager[Any]]

ANN, BEN = "web:ann", "web:ben"
LEFT, RIGHT = 2, 3


@pytest.fixture
def request_1() -> AdviceRequest:
    """In the first of three cells in a row, the goal on the right."""
    mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("up", "down", "left", "right"))
    q = [[0.0] * 4 for _ in range(3)]
    return AdviceRequest(mdp=mdp, q=q, state=0, episode=1, step=1, own=LEFT, reason=Reason(), allowed=range(4))


@pytest.fixture
def pages() -> Iterator[dict[str, SeatPage]]:
    with SeatPage() as ann, SeatPage() as ben:
        yield {ANN: ann, BEN: ben}


def meanwhile(function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
    return ThreadPoolExecutor(1).submit(function, *arguments)


def answers(browser: Any, number: int = 1, **what: Any) -> None:
    """Answer the question with a number, counted from 1, once a browser sees it."""
    browser.hear_until(lambda seat: (seat.get("question") or {}).get("number") == number)
    browser.say({"answer": {"question": number, **what}})


def test_all_see_the_question_at_once_and_answer_in_any_order(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann, opens(pages[BEN]) as ben:
        said = meanwhile(team.ask, ANN, request_1)
        answers(ben, action=LEFT)  # though ann is asked first
        ben.hear_until(lambda seat: seat.get("waits_for") == ["ann"])
        assert not said.done()
        answers(ann, action=RIGHT)
        assert said.result() == RIGHT
        assert team.ask(BEN, request_1) == LEFT
        ben.hear_until(lambda seat: seat.get("waits_for") == [])


def test_the_next_step_is_another_question(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann, opens(pages[BEN]) as ben:
        for step in (1, 2):
            said = meanwhile(team.ask, ANN, replace(request_1, step=step))
            answers(ann, step, action=step)
            answers(ben, step, word="skip")
            assert said.result() == step
            assert team.ask(BEN, replace(request_1, step=step)) is None


def test_whoever_is_not_there_is_not_waited_for(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann:
        said = meanwhile(team.ask, ANN, request_1)
        answers(ann, action=RIGHT)
        assert said.result() == RIGHT
        assert team.ask(BEN, request_1) is None


def test_when_nobody_is_there_the_question_waits(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team:
        said = meanwhile(team.ask, ANN, request_1)
        with opens(pages[BEN]) as ben:
            answers(ben, action=RIGHT)
            assert said.result() is None  # ann, who is not there
            assert team.ask(BEN, request_1) == RIGHT


def test_the_others_have_a_time_limit_once_one_has_answered(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages, within_s=0.2) as team, opens(pages[ANN]) as ann, opens(pages[BEN]) as ben:
        said = meanwhile(team.ask, ANN, request_1)
        answers(ben, action=RIGHT)
        assert ann.hear_until(lambda seat: (seat.get("question") or {}).get("left_s") is not None)
        assert said.result() is None
        assert team.ask(BEN, request_1) == RIGHT


def test_who_is_silent_is_asked_alone_and_later(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann, opens(pages[BEN]) as ben:
        team.silent = lambda: [BEN]
        said = meanwhile(team.ask, ANN, request_1)
        answers(ann, action=RIGHT)
        assert said.result() == RIGHT
        said = meanwhile(team.ask, BEN, request_1)  # as a panel asks now and then whom it has dropped
        answers(ben, action=LEFT)
        assert said.result() == LEFT


def test_who_quits_leaves_and_the_others_go_on(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann, opens(pages[BEN]) as ben:
        said = meanwhile(team.ask, ANN, request_1)
        answers(ann, word="quit")
        answers(ben, action=RIGHT)
        with pytest.raises(AdvisorLeft):
            said.result()
        assert team.ask(BEN, request_1) == RIGHT


def test_nothing_is_taken_back_because_others_have_answered_since(
    pages: dict[str, SeatPage], request_1: AdviceRequest, opens: "Opens"
) -> None:
    with Team(pages) as team, opens(pages[ANN]) as ann:
        said = meanwhile(team.ask, ANN, replace(request_1, undoable=True))
        asked = ann.hear_until(lambda seat: seat.get("question"))["question"]
        assert "undo" not in asked["words"]
        ann.say({"answer": {"question": asked["number"], "action": RIGHT}})
        assert said.result() == RIGHT
