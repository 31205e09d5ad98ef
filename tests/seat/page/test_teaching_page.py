"""The teaching seat between a session and its pages, without a browser: who is asked, who may answer, what is lost: nothing."""

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lab.advice.advisors import Person
from lab.advice.journal import Undo
from lab.errors import BadInput, WorkFailed
from lab.learning.praise import Judgement
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, AdvisorLeft, Reason, TooSlow
from lab.learning.session import Session
from lab.learning.session_events import EpisodeEnded, Event, Improvement
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.seat.page.teaching_page import SeatPage
from lab.seat.replay_pace import ReplayPace
from lab.sequencing.cell.schedule import Move
from lab.sequencing.search import EpisodeSequenced, Reference, SequenceRequest, SequenceResult
from lab.sequencing.simulate.follow import follow
from lab.tasks.task_file import load_cell
from lab.teaching.events import (
    ORDER,
    LessonBegan,
    LessonEvent,
    MoveMade,
    MoveRetried,
    MoveTimed,
    PhaseBegan,
    RecordSkipped,
    SequenceFound,
    SequencingBegan,
)
from lab.teaching.lesson_plan import LessonPlan

if TYPE_CHECKING:
    Opens = Callable[..., AbstractContextManager[Any]]

RIGHT = 3
LEARNER = LearnerSettings("q", episodes=3, max_steps=20)
ALWAYS = GateSettings("always", first_episode=1)


@pytest.fixture
def mdp() -> TabularMDP:
    """Three cells in a row, the goal on the right."""
    return grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("up", "down", "left", "right"))


@pytest.fixture
def page() -> Iterator[SeatPage]:
    with SeatPage() as running:
        yield running


@pytest.fixture
def request_1(mdp: TabularMDP) -> AdviceRequest:
    return AdviceRequest(
        mdp=mdp,
        q=[[0.0] * 4 for _ in range(3)],
        state=0,
        episode=1,
        step=1,
        own=2,
        reason=Reason(),
        allowed=range(mdp.n_actions),
    )


def meanwhile(function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
    """The session's thread: what it returns or raises."""
    return ThreadPoolExecutor(1).submit(function, *arguments)


def question(seat: dict[str, Any]) -> Any:
    return seat.get("question")


def asked_again(before: int) -> Callable[[dict[str, Any]], Any]:
    return lambda seat: seat.get("question") and seat["question"]["number"] > before


def answer(page: Any, number: int | None = None, **what: Any) -> None:
    """Answer the question that the page knows."""
    page.say({"answer": {"question": number or page.hear_until(question)["question"]["number"], **what}})


# ---- questions and answers


def test_a_whole_session_is_advised_from_the_page(page: SeatPage, mdp: TabularMDP, opens: "Opens") -> None:
    problem = Problem("row", "world", mdp)
    page.hear(LessonBegan(LessonPlan(problem, LEARNER, ALWAYS, "")))

    def hear(event: Event) -> None:
        page.hear(LessonEvent("row", event))

    def session() -> SessionResult:
        rng = np.random.default_rng(0)
        return Session(mdp, LEARNER, ALWAYS, Person(page.ask), rng).run(hear)

    with opens(page) as browser:
        result = meanwhile(session)
        number = 0
        for _ in range(6):  # three episodes of two moves
            number = browser.hear_until(asked_again(number))["question"]["number"]
            answer(browser, number, action=RIGHT)
        assert result.result(20).steps.tolist() == [2, 2, 2]
        assert result.result(20).helped_steps == 6
        seat = browser.hear_until(lambda seat: seat["curve"]["count"] == 3 and not seat["question"])
        assert seat["curve"]["guided"] == [1, 1, 1]
        assert seat["lesson"]["optimal"] == 2
        assert seat["standing"]["taken"] == 6
        assert seat["slice"]["prefers"][0][:2] == [0, RIGHT]


@pytest.mark.parametrize(
    ("word", "outcome"), [("skip", None), ("auto", AdvisorLeft), ("quit", KeyboardInterrupt), ("undo", Undo)]
)
def test_words(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens", word: str, outcome: type[BaseException] | None
) -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, replace(request_1, undoable=True))
        answer(browser, word=word)
        if outcome is None:
            assert asked.result(20) is None
        else:
            assert isinstance(asked.exception(20), outcome)
        assert browser.hear_until(lambda seat: not seat["question"])["question"] is None


@pytest.mark.parametrize(
    ("said", "means"),
    [
        ({"action": RIGHT}, ["move"]),
        ({"path": [RIGHT, RIGHT]}, ["path", "path goes on"]),
        ({"word": "skip"}, ["skip"]),
        ({"word": "+"}, ["praise"]),
    ],
)
def test_the_means_of_an_answer_are_known(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens", said: dict[str, Any], means: list[str]
) -> None:
    """A question that an earlier path answers is not shown, and has no latency."""
    with opens(page) as browser:
        asked = meanwhile(page.ask, replace(request_1, judgement="also"))
        answer(browser, **said)
        asked.result(20)
        assert page.asking.means == means[0]
        assert page.asking.shown is not None
        assert page.asking.latency_s is not None
        for later in means[1:]:
            page.ask(replace(request_1, state=1, step=2))
            now = page.asking
            assert (now.means, now.shown, now.latency_s) == (later, None, None)


@pytest.mark.parametrize(("word", "value"), [("+", 1), ("-", -1)])
def test_a_judgement(page: SeatPage, request_1: AdviceRequest, opens: "Opens", word: str, value: int) -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, replace(request_1, judgement="only"))
        answer(browser, word=word)
        assert asked.result(20) == Judgement(value)


def test_auto_says_so(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, request_1)
        answer(browser, word="auto")
        assert str(asked.exception(20)) == "auto"


def test_a_question_waits_for_a_page_to_come(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    asked = meanwhile(page.ask, request_1)
    with opens(page) as browser:
        answer(browser, action=1)
        assert asked.result(20) == 1


def test_a_lost_connection_loses_nothing(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    page.hear(LessonEvent("row", EpisodeEnded(1, 20, False, 0, None, False)))
    asked = meanwhile(page.ask, request_1)
    with opens(page) as browser:
        before = dict(browser.hear_until(question))
    with opens(page) as browser:
        after = browser.hear_until(question)
        assert after["question"] == before["question"]
        assert after["curve"]["means"] == [20]
        assert after["you"]["seat"]
        answer(browser, action=1)
        assert asked.result(20) == 1


def test_nobody_answers_in_time(mdp: TabularMDP, request_1: AdviceRequest, opens: "Opens") -> None:
    with SeatPage(wait_s=0.05) as page:
        for _ in range(2):  # counted anew
            with pytest.raises(AdvisorLeft, match=r"^no answer within 0\.05 s$"):
                page.ask(request_1)
        with opens(page) as browser:
            assert browser.hear_until(lambda seat: "question" in seat)["question"] is None


def test_the_time_that_is_left_is_told(request_1: AdviceRequest, opens: "Opens") -> None:
    with SeatPage(wait_s=1000.0) as page:
        asked = meanwhile(page.ask, request_1)
        with opens(page) as browser:
            shown = browser.hear_until(question)["question"]
            assert 900.0 < shown["left_s"] <= 1000.0
            answer(browser, action=0)
        assert asked.result(20) == 0


@pytest.mark.parametrize("wait_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_time_that_is_none_is_refused(wait_s: float) -> None:
    with pytest.raises(BadInput, match="time to wait for an answer"):
        SeatPage(wait_s=wait_s)


def test_ctrl_c_is_heard_while_it_waits(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    """The question has come to the page, so the main thread waits: then Ctrl-C."""

    def interrupt() -> None:
        with opens(page) as browser:
            browser.hear_until(question)
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background ignore Ctrl-C
    try:
        other = meanwhile(interrupt)
        with pytest.raises(KeyboardInterrupt):
            page.ask(request_1)
        other.result(20)
    finally:
        signal.signal(signal.SIGINT, before)
    with opens(page) as browser:
        assert browser.hear_until(lambda seat: "question" in seat)["question"] is None


def test_a_closed_page_lets_nobody_wait(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, request_1)
        browser.hear_until(question)
        page.close()
        assert str(asked.exception(20)) == "the page was closed"


def test_outside_its_context_nothing_is_asked(request_1: AdviceRequest) -> None:
    with pytest.raises(WorkFailed, match="not running"):
        SeatPage().ask(request_1)


# ---- who may answer


def test_one_page_advises_and_the_others_watch(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    with opens(page) as first:
        first.hear_until(lambda seat: "you" in seat)
        with opens(page) as second:
            asked = meanwhile(page.ask, request_1)
            shown = second.hear_until(question)
            assert shown["you"] == {"seat": False, "free": False, "pages": 2}
            assert second.refused({"answer": {"question": shown["question"]["number"], "action": 0}}) == (
                "This page only watches."
            )
            assert "has to hand over first" in second.refused({"seat": "take"})
            answer(first, action=1)
            assert asked.result(20) == 1


def test_another_page_takes_over_when_the_advisors_has_gone(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens"
) -> None:
    with opens(page) as second:
        pass
    with opens(page) as first, opens(page) as second:
        first.hear_until(lambda seat: "you" in seat)
        asked = meanwhile(page.ask, request_1)
        first.socket.close()
        number = second.hear_until(lambda seat: seat.get("you", {}).get("free") and seat["question"])["question"][
            "number"
        ]
        assert "No page answers yet" in second.refused({"answer": {"question": number, "action": 0}})
        second.say({"seat": "take"})
        second.hear_until(lambda seat: seat["you"]["seat"])
        answer(second, action=2)
        assert asked.result(20) == 2


def test_the_seat_is_handed_over(page: SeatPage, opens: "Opens") -> None:
    with opens(page) as first:
        first.hear_until(lambda seat: seat.get("you", {}).get("seat"))
        with opens(page) as second:
            first.say({"seat": "give"})
            second.hear_until(lambda seat: seat.get("you", {}).get("free"))
            second.say({"seat": "take"})
            second.hear_until(lambda seat: seat["you"]["seat"])
            assert first.hear_until(lambda seat: not seat["you"]["free"] and not seat["you"]["seat"])


def test_advice_outside_a_request_is_ignored(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    late = "This question waits no more: the answer came too late."
    with opens(page) as browser:
        assert browser.refused({"answer": {"question": 1, "action": 0}}) == late
        asked = meanwhile(page.ask, request_1)
        number = browser.hear_until(question)["question"]["number"]
        for wrong in (number - 1, number + 1, -1):
            assert browser.refused({"answer": {"question": wrong, "action": 0}}) == late
        assert not asked.done()
        answer(browser, number, action=1)
        assert browser.refused({"answer": {"question": number, "action": 0}}) == late  # a second press
        assert asked.result(20) == 1


def test_answers_that_are_none_are_ignored(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, request_1)
        number = browser.hear_until(question)["question"]["number"]
        for action in (-1, 4, 10**30):
            assert browser.refused({"answer": {"question": number, "action": action}}) == "There is no such move here."
        assert "taken back" in browser.refused({"answer": {"question": number, "word": "undo"}})
        for message in ("", "no json", b"\x00", '{"answer": 1}', "x" * 5000, "[" * 1000):
            assert browser.refused(message).startswith("That was no message of this page")
        assert not asked.done()
        answer(browser, number, action=3)
        assert asked.result(20) == 3


def test_a_whole_way_answers_the_questions_along_it(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, request_1)
        first = browser.hear_until(question)["question"]["number"]
        answer(browser, first, path=[RIGHT, RIGHT])
        assert asked.result(20) == RIGHT
        assert page.ask(replace(request_1, state=1, step=2)) == RIGHT  # nobody has to answer
        again = meanwhile(page.ask, replace(request_1, episode=2))
        answer(browser, browser.hear_until(asked_again(first))["question"]["number"], path=[RIGHT, 2, RIGHT])
        assert again.result(20) == RIGHT
        elsewhere = meanwhile(page.ask, replace(request_1, episode=2, step=2))  # it stayed in state 0
        seat = browser.hear_until(lambda seat: seat["question"] and "dropped" in str(seat["notices"]))
        assert seat["notices"][-1]["text"].startswith("The rest of your path is dropped (2 moves)")
        assert browser.refused({"answer": {"question": seat["question"]["number"], "path": [RIGHT, 4]}})
        answer(browser, seat["question"]["number"], path=[0])
        assert elsewhere.result(20) == 0


def test_a_replay_shows_the_answer_and_is_paced_from_the_page(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens"
) -> None:
    pace = ReplayPace(3600.0)
    with opens(page) as browser:
        assert browser.refused({"replay": "step"}) == "Nothing is shown again here."
        page.paced(pace)
        page.replayed(request_1, RIGHT)
        seat = browser.hear_until(lambda seat: seat["question"] and seat["replay"])
        assert (seat["replay"]["action"], seat["replay"]["said"]) == (RIGHT, "The answer was → right.")
        assert "only shown" in browser.refused({"answer": {"question": seat["question"]["number"], "action": 1}})
        waits = meanwhile(pace.wait)
        browser.say({"replay": "step"})
        assert waits.result(20) is None
        browser.say({"replay": "faster"})
        seat = browser.hear_until(lambda seat: seat["replay"]["speed"] == 2.0)
        assert seat["replay"]["paused"]
        page.replayed(replace(request_1, state=1, own=0), None)
        seat = browser.hear_until(lambda seat: seat["replay"]["action"] is None)
        assert seat["replay"]["said"] == "Left to the learner: it chose ↑ up; that leads nowhere."


# ---- page and terminal together


def test_an_offered_question_is_answered_in_a_word(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    words: list[str] = []
    heard = threading.Event()

    def told(word: str) -> None:
        words.append(word)
        heard.set()

    with opens(page) as browser:
        number = 0
        for what, word in (
            ({"action": RIGHT}, "right"),
            ({"path": [RIGHT, 0, 2]}, "path →↑←"),
            ({"word": "skip"}, "skip"),
            ({"word": "auto"}, "auto"),
        ):
            page.offer(request_1, told)
            number = browser.hear_until(asked_again(number))["question"]["number"]
            assert browser.seat["question"]["offered"]
            answer(browser, number, **what)
            assert heard.wait(20)
            heard.clear()
            assert words[-1] == word
            page.withdraw()  # the terminal does, once it has the answer
        page.offer(request_1)
        browser.hear_until(asked_again(number))
        page.withdraw()
        assert browser.hear_until(lambda seat: not seat["question"])["question"] is None


def test_a_session_that_is_only_shown_takes_no_answers(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens"
) -> None:
    with opens(page) as browser:
        page.offer(request_1)
        number = browser.hear_until(question)["question"]["number"]
        assert "only shown" in browser.refused({"answer": {"question": number, "action": 1}})


# ---- the high level


def order_request(*decisions: int) -> SequenceRequest:
    run = follow(load_cell("toast-case-1").cell(3), decisions)
    return SequenceRequest(
        run=run,
        allowed=run.allowed(),
        own=1,
        episode=30,
        reason=TooSlow(0.012, 0.05),
        improvement=Improvement(0.012, 606.0, 613.4),
        step=1,
        state=0,
        made=decisions,
    )


def test_the_order_is_asked_and_the_work_shown(page: SeatPage, opens: "Opens") -> None:
    with opens(page) as browser:
        page.hear(SequencingBegan(100, Reference(213.0, True, "A*"), GateSettings(window=4, first_episode=8)))
        number = 0
        for decisions, said in (((), 1), ((1,), 2)):
            asked = meanwhile(page.ask, order_request(*decisions))
            number = browser.hear_until(asked_again(number))["question"]["number"]
            assert "no such move" in browser.refused({"answer": {"question": number, "action": 9}})
            answer(browser, number, action=said)
            assert asked.result(20) == said
        assert browser.seat["work"]["rows"] == ["robot", "toaster"]
        assert browser.seat["work"]["now_s"] == 57.0
        for order, helped in (
            (EpisodeSequenced(30, 250.0, 250.0, (1, 2)), 2),
            (EpisodeSequenced(31, 240.0, 240.0, (2, 1)), 0),
        ):
            page.hear(LessonEvent(ORDER, EpisodeEnded(order.episode, order.cost, helped > 0, helped, None, True)))
            page.hear(order)
        seat = browser.hear_until(lambda seat: seat["curve"]["count"] == 2)
        assert seat["curve"]["guided"] == [1, 0]
        assert (seat["lesson"]["optimal"], seat["lesson"]["kind"]) == (213.0, "order")


def test_an_order_may_be_left_to_the_learner(page: SeatPage, opens: "Opens") -> None:
    with opens(page) as browser:
        asked = meanwhile(page.ask, order_request())
        answer(browser, word="skip")
        assert asked.result(20) is None


# ---- lessons, and what is shown beside


def test_a_lesson_that_begins_again_begins_anew(page: SeatPage, mdp: TabularMDP, opens: "Opens") -> None:
    page.hear(LessonBegan(LessonPlan(Problem("row", "world", mdp), LEARNER, ALWAYS, "")))
    ended: Event = EpisodeEnded(1, 7, True, 1, None, True)
    page.hear(LessonEvent("row", ended))
    with opens(page) as browser:
        browser.hear_until(lambda seat: seat.get("curve", {}).get("count") == 1 and seat["notices"])
        page.hear(LessonBegan(LessonPlan(Problem("row", "world", mdp), LEARNER, ALWAYS, "")))
        seat = browser.hear_until(lambda seat: seat["curve"]["count"] == 0)
        assert seat["notices"] == []
        assert seat["lesson"]["title"] == "row"
        assert seat["place"]["columns"] == 3
        page.hear(LessonEvent("another", ended))
        seat = browser.hear_until(lambda seat: seat["lesson"]["title"] == "another")
        assert seat["place"] is None


def test_a_question_of_another_problem_brings_its_map(page: SeatPage, request_1: AdviceRequest, opens: "Opens") -> None:
    page.offer(request_1)
    other = grid((2, 2), np.zeros((2, 2), bool), (0, 0), (1, 1))
    page.offer(
        AdviceRequest(mdp=other, q=[[0.0] * 4] * 4, state=0, episode=1, step=1, own=0, allowed=range(other.n_actions))
    )
    with opens(page) as browser:
        assert browser.hear_until(question)["place"]["rows"] == 2


def test_pages_look_at_different_layers(page: SeatPage, opens: "Opens") -> None:
    labels = ("left", "right", "backward", "forward", "down", "up")
    space = grid((2, 2, 3), np.zeros((2, 2, 3), bool), (0, 0, 1), (1, 1, 2), action_labels=labels)
    page.hear(LessonBegan(LessonPlan(Problem("space", "world", space), LEARNER, ALWAYS, "")))
    with opens(page) as first, opens(page) as second:
        assert first.hear_until(lambda seat: seat.get("slice"))["slice"]["layer"] == 1
        second.say({"layer": 2})
        assert second.hear_until(lambda seat: seat.get("slice", {"layer": 1})["layer"] == 2)["slice"]["marks"] == ".G.."
        second.say({"layer": 99})
        second.say({"layer": None})
        second.hear_until(lambda seat: seat["slice"]["layer"] == 1)
        assert first.seat["slice"]["layer"] == 1


@dataclass(frozen=True)
class Trusted:
    name: str
    trust: float
    low: float
    high: float
    dropped: bool


def test_receipt_advisors_and_the_end_are_shown(page: SeatPage, opens: "Opens") -> None:
    with opens(page) as browser:
        page.receipt({"requests": 3, "own_tau": float("inf"), "next_time": ["less"]})
        page.members([Trusted("ann", 0.5, 0.25, 0.75, False)])
        page.finished("The lesson is over.")
        seat = browser.hear_until(lambda seat: seat.get("ended"))
        assert seat["receipt"] == {"requests": 3, "own_tau": None, "next_time": ["less"]}
        ann = {"name": "ann", "trust": 0.5, "low": 0.25, "high": 0.75, "dropped": False}
        assert seat["members"] == [ann]


def test_a_whole_run_is_told_in_the_panel(page: SeatPage, opens: "Opens") -> None:
    with opens(page) as browser:
        page.hear(PhaseBegan("measure", 2))
        page.hear(MoveTimed("grasp at plate", 1.5))
        page.hear(RecordSkipped("a damaged file"))
        page.hear(SequenceFound(SequenceResult((1, 2), 213.0, (250.0, 213.0))))
        page.hear(MoveRetried("a slice was dropped"))
        seat = browser.hear_until(lambda seat: seat.get("progress") and len(seat["progress"]["lines"]) == 5)
        assert seat["progress"]["lines"] == [
            "Time every move in simulation",
            "grasp at plate: 1.50 s",
            "skipped: a damaged file",
            "parts 1 2: 213.0 s found in episode 2 of 2, its luckiest drawn episode",
            "failed, trying again: a slice was dropped",
        ]
        assert (seat["progress"]["done"], seat["progress"]["parts"]) == (2, 2)
        page.hear(PhaseBegan("carry out", 1))
        page.hear(MoveMade(Move(1, "plate", "plate", "toaster", 0.0, 0.0, 1.0, 4.0, 60.0), "slice 1"))
        seat = browser.hear_until(lambda seat: seat["work"])
        last = seat["work"]["measured"][-1]
        assert (last["resource"], last["kind"], last["part"], last["start_s"], last["end_s"]) == (
            "toaster",
            "process",
            1,
            4.0,
            64.0,
        )


def test_a_sentence_counts_once_what_was_understood_is_agreed_to(
    page: SeatPage, request_1: AdviceRequest, opens: "Opens"
) -> None:
    """What is understood is shown in words and as cells; dropped it leads to nothing, agreed to it is a path."""
    with opens(page) as browser:
        asked = meanwhile(page.ask, request_1)
        number = browser.hear_until(question)["question"]["number"]

        def after(**what: Any) -> dict[str, Any]:
            nonlocal number
            answer(browser, number, **what)
            shown: dict[str, Any] = browser.hear_until(asked_again(number))["question"]
            number = shown["number"]
            return shown

        assert after(say="go to the fridge")["heard"]["refused"].startswith("'fridge': not understood")
        assert after(say="two steps right, please")["heard"] == {
            "text": "right 2",
            "path": [[0, 0, 0], [0, 1, 0], [0, 2, 0]],
        }
        assert after(agree=False)["heard"] is None
        assert after(say="go to the goal")["heard"]["text"] == "to the goal"
        answer(browser, number, agree=True)
        assert asked.result(20) == RIGHT
        said = ["go to the fridge", "two steps right, please", "go to the goal"]
        assert (page.asking.means, page.asking.said) == ("sentence", said)
        assert page.ask(replace(request_1, state=1, step=2)) == RIGHT  # the rest of the path
        assert page.asking.means == "path goes on"
