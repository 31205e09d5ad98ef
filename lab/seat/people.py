"""Who sits in a lesson: the person at the terminal, the page, and the progress lines, as one audience."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from lab.advice.advising import Watch, Watched
from lab.advice.entries import Answer
from lab.advice.journal import Journal
from lab.advice.panel import Panel
from lab.advice.receipt import receipt
from lab.errors import counted
from lab.learning.events import EpisodeEnded, Event
from lab.learning.problem import Problem
from lab.learning.requests import Advisor, Ask, Request
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.kept_session import known_values
from lab.teaching.listener import Both, Listener
from lab.teaching.teacher import Audience
from lab.toolbox.policy import Policy
from lab.view.progress import RunProgress

if TYPE_CHECKING:
    from lab.seat.lesson_scene import LessonScene
    from lab.seat.page.teaching_page import SeatPage

WORTH_S = 2.0  # the shortest time between two receipts of one lesson
PAGE_S = 30.0  # how long a replay waits for a browser
SEEN_S = 0.05  # the shortest time between two pictures of a lesson that nobody at the page is asked in


class Classroom(Audience):
    """Tells progress, prompt and page what happens, and asks the person at one of them.

    The page shows the scene as well: the robot stands where the learner asks. `prompt` and `page`: None when not there.
    """

    def __init__(self, progress: RunProgress, prompt: TeachingPrompt | None, page: "SeatPage | None") -> None:
        self.progress, self._prompt, self._page = progress, prompt, page
        self._stage: LessonScene | None = None
        self._pause_s: float | None = None  # between two answers of a replay
        self._asked_here = False  # the last question was put to somebody here, and was shown
        self._shown_s = 0.0  # when the page was last shown a question that is not put to it
        self._journal: Journal | None = None
        self._panel: Panel | None = None
        self._problem: Problem | None = None
        self._gate = GateSettings()
        self._discount = 1.0
        self._valued: Problem | None = None  # whose optimal values these are
        self._values: FloatArray | None = None
        self._worth_s = -WORTH_S  # when the receipt was made last

    @property
    def passing(self) -> Watch | None:
        """Who is shown the questions that others answer; None without a page, which costs nothing."""
        return None if self._page is None else self.passes

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

    @property
    def listener(self) -> Listener:
        """Who hears how a run goes on."""
        return self.progress if self._page is None else Both(self.progress, self._page.listener())

    def _ask_terminal(self, request: Request) -> int | None:
        assert self._prompt is not None
        self._asked_here = True
        if self._page is None:
            with self.progress.paused():
                return self._prompt(request)
        self.shows(request)
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
        self.shows(request)
        return self._page.ask(request)

    def shows(self, request: Request) -> None:
        """Moves the robot of the page's scene to where the learner asks."""
        if self._page is not None and self._stage is not None:
            self._page.update(self._stage.frame(request.state))

    def stands(self, where: Any, problem: Problem) -> None:
        self.leave()
        if self._page is None:
            return
        from lab.seat.lesson_scene import lesson_scene_of

        self._stage = lesson_scene_of(where, problem)
        if self._stage is not None:
            self._page.show(self._stage.bodies(), self._stage.camera)

    def begins(self, problem: Problem, learner: LearnerSettings, gate: GateSettings, journal: Journal) -> None:
        self._journal, self._problem, self._gate = journal, problem, gate
        self._discount = learner.discount
        if self._page is not None:
            self._page.begin(problem, learner, gate)

    def goes_on(self, unfinished: Policy) -> None:
        told = f"'{unfinished.name}' was left unfinished after {counted(len(unfinished.curve), 'episode')}: it is learned on"
        self.progress.console.print(told, soft_wrap=True)

    def meets(self, advisor: Advisor | None) -> None:
        inner = advisor.advisor if isinstance(advisor, Watched) else advisor
        self._panel = inner if isinstance(inner, Panel) else None

    def hears(self, name: str, event: Event, is_new: bool) -> None:
        if is_new or self._pause_s is not None:
            self.progress.learning(name, event)
            if self._prompt is not None:
                self._prompt.on_event(event, name)
        if self._page is not None:
            self._page.on_event(event, name)
            if isinstance(event, EpisodeEnded) and self._panel is not None:
                self._page.members(self._panel.standing())
            if isinstance(event, EpisodeEnded) and event.guided and is_new:
                self._show_worth()

    def _show_worth(self) -> None:
        """The receipt so far, on the page; of people's answers only, which come slowly enough for it."""
        entries = [] if self._journal is None else self._journal.entries
        now_s = time.monotonic()
        if self._page is None or self._problem is None or now_s - self._worth_s < WORTH_S:
            return
        if not any(isinstance(entry, Answer) for entry in entries):
            return
        if self._valued is not self._problem:
            self._valued, self._values = self._problem, known_values(self._problem, self._discount)
        certain = self._problem.environment is None
        worth = receipt(entries, self._problem.mdp, self._values, self._gate.window, certain=certain)
        self._worth_s = time.monotonic()
        self._page.receipt(worth.to_json() | {"lines": worth.lines()})

    def replaying(self, pause_s: float) -> "Classroom":
        """The same room for a session that is shown again: everything is told, `pause_s` between two answers."""
        self._pause_s = pause_s
        if self._page is not None:
            self._page.wait_for_page(PAGE_S)
        return self

    def watch(self, request: Request, action: int | None) -> None:
        """Shows a question of a replay and its answer."""
        self.passes(request, action)
        if self._prompt is not None:
            self._prompt.show(request)
            self._prompt.told(request, action)
        if self._pause_s:
            time.sleep(self._pause_s)

    def passes(self, request: Request, action: int | None) -> None:
        """Shows on the page where somebody else is asked, not oftener than it can be seen."""
        asked_here, self._asked_here = self._asked_here, False
        now_s = time.monotonic()
        if self._page is not None and not asked_here and (now_s - self._shown_s >= SEEN_S or self._pause_s):
            self._shown_s = now_s
            self.shows(request)
            self._page.look(request)

    def stay(self) -> None:
        """Keeps serving the page until Ctrl-C; returns at once when there is none."""
        while self._page is not None:
            time.sleep(3600)

    def ends(self, document: Mapping[str, Any]) -> None:
        """The lesson, or its replay, is over: the page shows what the advice was worth."""
        if self._page is not None:
            self._page.receipt(document["receipt"])
            self._page.finished("The lesson is over.")

    def leave(self) -> None:
        """The scene is taken down."""
        if self._stage is not None:
            with suppress(Exception):
                self._stage.close()
            self._stage = None
