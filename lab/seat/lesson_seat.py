"""Who hears of lessons and is asked in them: the person at the terminal or the page, and the progress lines."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from lab.advice.entries import Answer
from lab.advice.panel import Panel
from lab.learning.requests import Ask, Request
from lab.learning.session_events import EpisodeEnded
from lab.mdp import FloatArray
from lab.seat.run_progress import RunProgress
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.events import (
    AdvisorGathered,
    Event,
    LessonBegan,
    LessonEvent,
    QuestionAnswered,
    ScenePrepared,
)
from lab.teaching.kept_session import known_values, receipt_of

if TYPE_CHECKING:
    from lab.seat.lesson_scene import LessonScene
    from lab.seat.page.teaching_page import SeatPage

WORTH_S = 2.0  # the shortest time between two receipts of one lesson
PAGE_S = 30.0  # how long a replay waits for a browser
SEEN_S = 0.05  # the shortest time between two pictures of a lesson that nobody at the page is asked in


class LessonSeat:
    """Tells progress, prompt and page what happens, and asks the person at one of them.

    The page shows the scene as well: the robot stands where the learner asks. `prompt` and `page`: None when not there.
    """

    def __init__(self, progress: RunProgress, prompt: TeachingPrompt | None, page: "SeatPage | None") -> None:
        self.progress, self._prompt, self._page = progress, prompt, page
        self._stage: LessonScene | None = None
        self._pause_s: float | None = None  # between two answers of a replay
        self._asked_here = False  # the last question was put to somebody here, and was shown
        self._shown_s = 0.0  # when the page was last shown a question that is not put to it
        self._lesson: LessonBegan | None = None
        self._panel: Panel | None = None
        self._values: tuple[object, FloatArray | None] = (None, None)  # a problem and its optimal values
        self._worth_s = -WORTH_S  # when the receipt was made last

    # ---- what happens

    def hear(self, event: Event) -> None:
        """Tell everybody who is here what happened; what is told again is news to the page alone, or in a replay."""
        if self._page is not None and not isinstance(event, QuestionAnswered):
            self._page.hear(event)
        match event:
            case LessonEvent():
                self._hear_session(event)
            case QuestionAnswered():
                self._show_answer(event.request, event.action)
            case LessonBegan():
                self._lesson = event
            case AdvisorGathered():
                self._panel = event.advisor if isinstance(event.advisor, Panel) else None
            case ScenePrepared():
                self._show_stage(event)
            case _:
                self.progress.hear(event)

    def _hear_session(self, event: LessonEvent) -> None:
        if event.is_new or self._pause_s is not None:
            self.progress.hear(event)
            if self._prompt is not None:
                self._prompt.hear(event)
        if self._page is not None and isinstance(event.event, EpisodeEnded):
            if self._panel is not None:
                self._page.members(self._panel.standing())
            if event.event.guided and event.is_new:
                self._show_worth(self._page)

    def _show_worth(self, page: "SeatPage") -> None:
        """The receipt so far; of people's answers only, which come slowly enough for it."""
        lesson = self._lesson
        if lesson is None or time.monotonic() - self._worth_s < WORTH_S:
            return
        if not any(isinstance(entry, Answer) for entry in lesson.journal.entries):
            return
        if self._values[0] is not lesson.plan.problem:
            self._values = (lesson.plan.problem, known_values(lesson.plan))
        worth = receipt_of(lesson.plan, lesson.journal, self._values[1])
        self._worth_s = time.monotonic()
        page.receipt(worth.to_json() | {"lines": worth.lines()})

    def _show_answer(self, request: Request, action: int | None) -> None:
        """Show on the page where somebody else is asked, not oftener than it can be seen; in a replay show all."""
        asked_here, self._asked_here = self._asked_here, False
        if self._page is not None and not asked_here:
            now_s = time.monotonic()
            if now_s - self._shown_s >= SEEN_S or self._pause_s:
                self._shown_s = now_s
                self._show_state(request)
                self._page.look(request)
        if self._pause_s is None:
            return
        if self._prompt is not None:
            self._prompt.show(request)
            self._prompt.told(request, action)
        if self._pause_s:
            time.sleep(self._pause_s)

    def lesson_over(self, document: Mapping[str, Any]) -> None:
        """The lesson, or its replay, is over: the page shows what the advice was worth."""
        if self._page is not None:
            self._page.receipt(document["receipt"])
            self._page.finished("The lesson is over.")

    # ---- who is asked

    def people(self) -> Mapping[str, Ask]:
        """Who can be asked, by name."""
        people: dict[str, Ask] = {}
        if self._prompt is not None:
            people["terminal"] = self._ask_terminal
        if self._page is not None:
            people["web"] = self._ask_page
        return people

    @property
    def viewer(self) -> "SeatPage | None":
        """Who watches a run's scene live."""
        return self._page

    def _ask_terminal(self, request: Request) -> int | None:
        assert self._prompt is not None
        self._asked_here = True
        if self._page is None:
            with self.progress.paused():
                return self._prompt(request)
        self._show_state(request)
        with self._offered(request, self._prompt.answer_from_outside), self.progress.paused():
            return self._prompt(request)

    @contextmanager
    def _offered(self, request: Request, hear: Callable[[str], None]) -> Iterator[None]:
        """The page shows a question that the terminal asks, and may answer it there."""
        if self._page is None:
            yield
            return
        self._page.on_word = hear
        self._page.offer(request)
        try:
            yield
        finally:
            self._page.withdraw()

    def _ask_page(self, request: Request) -> int | None:
        assert self._page is not None
        self._asked_here = True
        self._show_state(request)
        return self._page.ask(request)

    # ---- the scene

    def _show_state(self, request: Request) -> None:
        """Moves the robot of the page's scene to where the learner asks."""
        if self._page is not None and self._stage is not None:
            self._page.update(self._stage.frame(request.state))

    def _show_stage(self, event: ScenePrepared) -> None:
        self.clear_stage()
        if self._page is None:
            return
        from lab.seat.lesson_scene import lesson_scene_of

        self._stage = lesson_scene_of(event.scene, event.problem)
        if self._stage is not None:
            self._page.show(self._stage.bodies(), self._stage.camera)

    def clear_stage(self) -> None:
        """The scene is taken down."""
        if self._stage is not None:
            with suppress(Exception):
                self._stage.close()
            self._stage = None

    # ---- a replay

    def replaying(self, pause_s: float) -> "LessonSeat":
        """The same seat for a session that is shown again: everything is told, `pause_s` between two answers."""
        self._pause_s = pause_s
        if self._page is not None:
            self._page.wait_for_page(PAGE_S)
        return self

    def stay(self) -> None:
        """Keeps serving the page until Ctrl-C; returns at once when there is none."""
        while self._page is not None:
            time.sleep(3600)
