"""The teaching seat in a real browser: a person's whole session by keys, and by clicks. Skipped without Chromium."""

import contextlib
import socket
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lab.advice.advisors import Person
from lab.advice.journal import Undo
from lab.learning.praise import Judging
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, Reply
from lab.learning.session import Session
from lab.learning.session_events import AdviceEnded, Event, MoveJudged
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.seat.page.teaching_page import SeatPage
from lab.sim.frames import Body, Frame, Shape
from lab.teaching.events import LessonBegan, LessonEvent
from lab.teaching.lesson_plan import LessonPlan

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

Until = Callable[["Page", str], None]
LABELS = ("up", "down", "left", "right")
ROBOT = (Body("robot", (Shape("sphere", (0.1,)),)),)


@dataclass
class Teaching:
    """A session in a thread of its own that asks the page about every step, on a board of 2 x 3 cells with one wall.

    S . .
    # . G
    """

    page: SeatPage
    episodes: int = 2
    events: list[Event] = field(default_factory=list)
    undone: threading.Event = field(default_factory=threading.Event)
    judging: Judging | None = None

    def __post_init__(self) -> None:
        blocked = np.array([[0, 0, 0], [1, 0, 0]], bool)
        self.mdp: TabularMDP = grid((2, 3), blocked, (0, 0), (1, 2), action_labels=LABELS)
        self.learner = LearnerSettings("q", episodes=self.episodes, max_steps=12)
        self.gate = GateSettings("always", first_episode=1)

    def start(self) -> "Future[SessionResult]":
        self.page.show(ROBOT)
        about = Problem("board", "world", self.mdp)
        self.page.hear(LessonBegan(LessonPlan(about, self.learner, self.gate, "")))
        return ThreadPoolExecutor(1).submit(self._learn)

    def _learn(self) -> SessionResult:
        def hear(event: Event) -> None:
            self.events.append(event)
            self.page.hear(LessonEvent("board", event))

        rng = np.random.default_rng(0)
        result = Session(self.mdp, self.learner, self.gate, Person(self._ask, self.judging), rng).run(hear)
        self.page.finished("The lesson is over.")
        return result

    def _ask(self, request: AdviceRequest) -> Reply:
        row, column = self.mdp.state_cell(request.state)
        self.page.update(Frame(0.0, {"robot": (float(column), float(-row), 0.0, 0.0, 0.0, 0.0, 1.0)}))
        try:
            return self.page.ask(replace(request, undoable=True))
        except Undo:
            self.undone.set()
            return self.page.ask(request)


def says(step: int, episode: int = 1) -> str:
    """The learner asks about a step of an episode, and may be answered."""
    return f"says(document, {episode}, {step})".replace(
        "says(document, ",
        "((e, s) => document.getElementById('says').textContent.startsWith(`Episode ${e}, step ${s}:`) && "
        "document.querySelector('#moves button:enabled'))(",
    )


def robot(tab: "Page") -> list[float]:
    found: list[float] = tab.evaluate("viewer.scene_tree.find(['lab', 'robot']).object.position.toArray()")
    return found


ASKED = (
    "document.querySelector('#moves button:enabled')"  # a question that can be answered; the words are refused without
)
OVER = "document.getElementById('says').textContent === 'The lesson is over.'"


def test_a_whole_session_by_keys(tab: "Page", page: SeatPage, until: Until) -> None:
    session = Teaching(page).start()
    until(tab, says(1))
    assert tab.inner_text("#chair") == "You answer here"
    assert "drawn at random: all moves are alike to it here (25% each)" in tab.inner_text("#detail")
    for step, key in enumerate(["ArrowRight", "ArrowRight", "ArrowDown"], start=1):
        until(tab, says(step))
        tab.keyboard.press(key)
    until(tab, says(1, 2))
    assert "1 row" not in tab.inner_text("#notices")
    assert "Episode 1 reached the goal in 3 steps" in tab.inner_text("#notices")
    tab.keyboard.press("s")  # this one is the learner's own
    until(tab, "document.getElementById('standing').textContent.includes('1 left to it')")
    until(tab, ASKED)
    tab.keyboard.press("q")  # as in the terminal it ends the session, once it is sure
    until(tab, "document.querySelector('[data-word=quit]').classList.contains('armed')")
    tab.keyboard.press("a")
    until(tab, "document.querySelector('[data-word=auto]').classList.contains('armed')")
    assert not session.done()
    tab.keyboard.press("a")
    until(tab, OVER)
    result = session.result(20)
    assert result.steps[0] == 3
    assert result.guided.tolist() == [True, False]
    assert "guided" in (tab.get_attribute("#curve", "aria-label") or "")


def test_a_whole_session_by_clicks(tab: "Page", page: SeatPage, until: Until) -> None:
    teaching = Teaching(page)
    session = teaching.start()
    until(tab, says(1))
    tab.click("#moves >> text=right")
    until(tab, says(2))
    assert robot(tab) == pytest.approx([1, 0, 0])
    tab.click("text=You choose")
    until(tab, "document.getElementById('standing').textContent.includes('1 left to it')")
    until(tab, ASKED)
    tab.click("text=Why?")
    assert "softmax" in tab.inner_text("#because")
    tab.click("text=Good: do that")
    until(tab, "document.getElementById('standing').textContent.includes('Moves helped2')")
    until(tab, ASKED)
    tab.click("text=End the session")
    tab.click("text=Sure? Once more")
    until(tab, OVER)
    assert session.result(20).interrupted
    assert not any(isinstance(event, AdviceEnded) for event in teaching.events)


def test_moves_are_judged(tab: "Page", page: SeatPage, until: Until) -> None:
    """By a key, by a click, and Enter says nothing; the moves themselves cannot be chosen."""
    teaching = Teaching(page, judging=Judging(only=True))
    session = teaching.start()
    can = "document.querySelector('#words button[data-word=\"-\"]:enabled')"
    until(tab, can)
    assert "How is that: good (+) or bad (-)?" in tab.inner_text("#detail")
    assert tab.is_hidden("#words [data-word=own]")
    assert tab.locator("#moves button:enabled").count() == 0
    tab.keyboard.press("+")
    until(tab, "document.getElementById('standing').textContent.includes('Moves helped1')")
    until(tab, can)
    tab.click("text=That was bad")
    until(tab, "document.getElementById('standing').textContent.includes('Moves helped2')")
    until(tab, can)
    tab.keyboard.press("Enter")
    until(tab, "document.getElementById('standing').textContent.includes('1 left to it')")
    until(tab, can)
    tab.keyboard.press("q")
    until(tab, "document.querySelector('[data-word=quit]').classList.contains('armed')")
    tab.keyboard.press("q")
    until(tab, OVER)
    assert session.result(20).interrupted
    assert [event.value for event in teaching.events if isinstance(event, MoveJudged)] == [1, -1]


def test_a_click_in_the_map_is_the_move_there(tab: "Page", page: SeatPage, until: Until) -> None:
    Teaching(page).start()
    until(tab, says(1))
    until(tab, "!document.getElementById('map').hidden")
    box = tab.locator("#grid").bounding_box()
    assert box is not None
    cell = box["width"] / 3
    tab.mouse.click(box["x"] + 2.5 * cell, box["y"] + 0.5 * cell)  # two cells away: nothing
    tab.mouse.click(box["x"] + 1.5 * cell, box["y"] + 0.5 * cell)
    until(tab, says(2))
    assert robot(tab) == pytest.approx([1, 0, 0])
    tab.mouse.move(box["x"] + 2.5 * cell, box["y"] + 1.5 * cell)
    assert tab.inner_text("#readout") == "row 2, column 3: goal"


def test_a_whole_way_is_drawn_shown_discarded_and_sent(tab: "Page", page: SeatPage, until: Until) -> None:
    session = Teaching(page, episodes=3).start()
    until(tab, says(1))
    until(tab, "!document.getElementById('map').hidden")
    box = tab.locator("#grid").bounding_box()
    assert box is not None
    cell = box["width"] / 3

    def draw(*cells: tuple[int, int]) -> None:
        for number, (row, column) in enumerate(cells):
            tab.mouse.move(box["x"] + (column + 0.5) * cell, box["y"] + (row + 0.5) * cell)
            if number == 0:
                tab.mouse.down()
        tab.mouse.up()

    draw((0, 0), (0, 2), (1, 2))
    assert tab.inner_text("#way-text") == "A path of 3 moves"
    tab.keyboard.press("Escape")
    assert tab.is_hidden("#way")
    draw((0, 0), (1, 0), (0, 1))  # not through the wall
    draw((0, 1), (0, 2), (1, 2))  # on from where it ends
    assert tab.inner_text("#way-text") == "A path of 3 moves"
    tab.click("#way-send")
    until(tab, says(1, 2))
    assert "Episode 1 reached the goal in 3 steps" in tab.inner_text("#notices")
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft", "ArrowRight", "ArrowDown"):  # one of them back, and on again
        tab.keyboard.press(f"Shift+{key}")
    assert tab.inner_text("#way-text") == "A path of 3 moves"
    tab.keyboard.press("Enter")
    until(tab, says(1, 3))
    tab.keyboard.press("a")
    tab.keyboard.press("a")
    assert session.result(20).steps[:2].tolist() == [3, 3]


def test_an_answer_is_taken_back(tab: "Page", page: SeatPage, until: Until) -> None:
    teaching = Teaching(page)
    teaching.start()
    until(tab, says(1))
    tab.keyboard.press("u")
    assert teaching.undone.wait(20)
    until(tab, "document.querySelector('[data-word=undo]').disabled && document.querySelector('#moves button:enabled')")
    tab.keyboard.press("u")
    until(tab, "document.getElementById('refusal').textContent.includes('taken back')")


def test_a_reload_in_the_middle_loses_nothing(tab: "Page", page: SeatPage, until: Until) -> None:
    Teaching(page).start()
    until(tab, says(1))
    tab.keyboard.press("ArrowRight")
    until(tab, says(2))
    before = tab.inner_text("#question")
    tab.reload()
    until(tab, says(2))
    assert tab.inner_text("#question") == before
    assert robot(tab) == pytest.approx([1, 0, 0])
    tab.keyboard.press("ArrowRight")
    until(tab, says(3))


def test_a_second_viewer_watches_and_takes_over(tab: "Page", page: SeatPage, browser: "Browser", until: Until) -> None:
    Teaching(page).start()
    until(tab, says(1))
    other = browser.new_page()
    other.goto(page.url)
    until(other, "document.getElementById('chair').textContent.startsWith('You are watching: another page answers')")
    until(other, "document.getElementById('says').textContent.startsWith('Episode 1, step 1')")
    assert other.locator("#moves button:enabled").count() == 0
    other.keyboard.press("ArrowRight")
    until(other, "document.getElementById('refusal').textContent === 'This page only watches.'")
    tab.goto("about:blank")
    until(other, "!document.getElementById('chair-button').hidden")
    other.click("text=Answer here")
    until(other, says(1))
    other.keyboard.press("ArrowRight")
    until(other, says(2))
    other.close()


def test_a_page_without_the_token_shows_nothing(page: SeatPage, browser_page: "Page") -> None:
    answer = browser_page.goto(page.url.partition("?")[0])
    assert answer is not None
    assert answer.status == 403
    assert "needs the token" in browser_page.inner_text("body")


def test_time_is_up_and_the_learner_goes_on_alone(browser_page: "Page", until: Until) -> None:
    with SeatPage(wait_s=2.0) as page:
        browser_page.goto(page.url)
        until(browser_page, "document.querySelector('#chair.yours')")
        teaching = Teaching(page)
        session = teaching.start()
        until(browser_page, "document.getElementById('countdown').textContent.startsWith('It waits')")
        until(browser_page, OVER)
        assert len(session.result(20).steps) == 2
        assert AdviceEnded(1, "advisor left") in teaching.events
        assert "the learner goes on alone" in browser_page.inner_text("#notices")


class Tunnel:
    """What ssh -L does: another port of this computer that leads to the page's, until the line is cut."""

    def __init__(self, port: int) -> None:
        self._to, self._lines = port, list[socket.socket]()
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._door.getsockname()[1]
        threading.Thread(target=self._open, daemon=True).start()

    def _open(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, far = self._door.accept()[0], socket.create_connection(("127.0.0.1", self._to))
                self._lines += [near, far]
                for one, other in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=(one, other), daemon=True).start()

    def _carry(self, one: socket.socket, other: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := one.recv(1 << 16):
                other.sendall(data)
            other.shutdown(socket.SHUT_WR)

    def cut(self) -> None:
        """Every connection breaks; new ones can be made."""
        lines, self._lines = self._lines, []
        for line in lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()

    def close(self) -> None:
        """No more connections."""
        self._door.shutdown(socket.SHUT_RDWR)
        self._door.close()
        self.cut()


def test_through_a_forwarded_port_and_after_the_line_was_cut(
    browser_page: "Page", page: SeatPage, until: Until
) -> None:
    tunnel = Tunnel(page.port)
    try:
        Teaching(page).start()
        browser_page.goto(page.url.replace(str(page.port), str(tunnel.port)))
        until(browser_page, says(1))
        browser_page.keyboard.press("ArrowRight")
        until(browser_page, says(2))
        tunnel.cut()
        until(browser_page, "document.getElementById('chair-text').textContent === 'connection lost: trying again'")
        until(browser_page, says(2))
        assert robot(browser_page) == pytest.approx([1, 0, 0])
        browser_page.keyboard.press("ArrowRight")
        until(browser_page, says(3))
    finally:
        tunnel.close()


def test_a_sentence_is_shown_as_a_path_before_it_counts(page: SeatPage, tab: "Page", until: Until) -> None:
    """Typed in the page's field, agreed to with Enter, and done move by move."""
    teaching = Teaching(page, episodes=1)
    learned = teaching.start()
    until(tab, says(1))
    tab.fill("#say-text", "two steps right, then one down")
    tab.press("#say-text", "Enter")
    until(tab, "document.getElementById('heard-text').textContent.startsWith('Understood: right 2, then down 1')")
    tab.press("#say-text", "Enter")
    assert learned.result(20).steps[0] == 3
