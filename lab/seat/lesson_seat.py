"""The seat of a lesson: passes its events to progress lines, terminal and page, and its questions to the person there."""

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lab.advice.answer_times import AnswerTimes
from lab.advice.entries import Answer, Praise
from lab.advice.journal import Undo
from lab.advice.panel import Panel
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, Ask, Reply, Request
from lab.learning.session_events import EpisodeEnded
from lab.mdp import FloatArray
from lab.seat.grid_text import skill_of
from lab.seat.page.page_state import LESSON_OVER
from lab.seat.replay_pace import ReplayPace
from lab.seat.run_progress import RunProgress
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.terminal.prompt import TeachingPrompt
from lab.seat.timed_answers import TimedAsk
from lab.teaching.events import AdvisorGathered, Event, LessonBegan, LessonEvent, QuestionAnswered, ScenePrepared
from lab.teaching.kept_session import known_values, receipt_of

if TYPE_CHECKING:
    from lab.seat.language_model import LanguageModel
    from lab.seat.lesson_scene import LessonScene
    from lab.seat.page.teaching_page import SeatPage
    from lab.seat.team import Team

WORTH_S = 2.0  # least time between two receipts of one lesson
PAGE_S = 30.0  # time that a replay waits for a browser
SEEN_S = 0.05  # least time between two pictures of a lesson whose questions go elsewhere


class SpokenAsk:
    """Asks a person, and keeps with the answers what the person has said in sentences that holds from then on."""

    def __init__(self, ask: Ask, spoken: SpokenAnswers) -> None:
        self._ask, self._spoken = ask, spoken
        self._before: tuple[dict[str, Any], ...] = ()  # what held before the last answer

    def __call__(self, request: Request) -> Reply:
        """The person's answer; what was said with an answer that is taken back does not hold any more."""
        before = self._spoken.held()
        try:
            answer = self._ask(request)
        except Undo:
            self._spoken.hold_again(self._before)
            raise
        self._before = before
        return answer

    def holding(self) -> tuple[dict[str, Any], ...]:
        """What has been said and holds, for the journal."""
        return self._spoken.held()

    def recall(self, request: Request, holds: tuple[dict[str, Any], ...]) -> None:
        """Take over what a journal has of what was said."""
        self._before = self._spoken.held()
        self._spoken.hold_again(holds)


class LessonSeat:
    """Passes events to progress, prompt and page, and asks the person at one of them.

    The page also shows the scene, with the robot in the state of the question. `prompt`, `page`: None for a seat without.
    models: the language models that are asked, by the name of the advisor. team: several people with a page each; all pages show
    the same. times: where the times of people's answers are kept.
    """

    def __init__(
        self,
        progress: RunProgress,
        prompt: TeachingPrompt | None,
        page: "SeatPage | None",
        models: "Mapping[str, LanguageModel]" = MappingProxyType({}),
        team: "Team | None" = None,
        times: AnswerTimes | None = None,
    ) -> None:
        self._team = team
        self._pages = (*([] if page is None else [page]), *([] if team is None else team.pages.values()))
        self.progress, self._prompt, self.page, self.models = progress, prompt, page, models
        self._scene: LessonScene | None = None
        self._scene_of: Problem | None = None
        self._place: Any = None  # the prepared task or the world of the lessons
        self._pace: ReplayPace | None = None  # of a replay
        self._asked_here = False  # whether the last question went to somebody here, and was shown
        self._shown_s = 0.0  # when the page last showed a question that goes elsewhere
        self._times = times
        self._lesson: LessonBegan | None = None
        self._panel: Panel | None = None
        self._values: tuple[object, FloatArray | None] = (None, None)  # a problem and its optimal values
        self._worth_s = -WORTH_S  # when the receipt was last computed

    # ---- events

    def hear(self, event: Event) -> None:
        """Pass an event to progress, prompt and page; repeated events go to the page only, except in a replay."""
        if not isinstance(event, QuestionAnswered):
            for page in self._pages:
                page.hear(event)
        for model in self.models.values():
            model.hear(event)
        match event:
            case LessonEvent():
                self._hear_session(event)
            case QuestionAnswered():
                self._show_answer(event.request, event.action)
            case LessonBegan():
                self._lesson = event
                self._about(event.plan.problem)
            case AdvisorGathered():
                self._panel = event.advisor if isinstance(event.advisor, Panel) else None
                if self._team is not None:
                    self._team.silent = self._silent
            case ScenePrepared():
                self._place = event.scene
                self._show_scene(event.problem)
            case _:
                self.progress.hear(event)

    def _about(self, problem: Problem) -> None:
        """Take over the problem being learned: questions use the words of its skill, and another problem's scene is removed."""
        if self._scene_of not in (None, problem):
            self.clear_scene()
        skill = skill_of(self._place, problem.name)
        if self._prompt is not None:
            self._prompt.about(skill)
        for page in self._pages:
            page.about(skill)

    def _hear_session(self, event: LessonEvent) -> None:
        if event.is_new or self._pace is not None:
            self.progress.hear(event)
            if self._prompt is not None:
                self._prompt.hear(event)
        if self._pages and isinstance(event.event, EpisodeEnded):
            if self._panel is not None:
                for page in self._pages:
                    page.members(self._panel.standing())
            if event.event.guided and event.is_new:
                self._show_worth()

    def _show_worth(self) -> None:
        """Show the receipt so far; only for people's answers, which are slow enough for it."""
        lesson = self._lesson
        if lesson is None or time.monotonic() - self._worth_s < WORTH_S:
            return
        if not any(isinstance(entry, Answer | Praise) for entry in lesson.journal.entries):
            return
        if self._values[0] is not lesson.plan.problem:
            self._values = (lesson.plan.problem, known_values(lesson.plan))
        worth = receipt_of(lesson.plan, lesson.journal, self._values[1])
        self._worth_s = time.monotonic()
        for page in self._pages:
            page.receipt(worth.to_json() | {"lines": worth.lines()})

    def _show_answer(self, request: Request, action: Reply) -> None:
        """Show on the page a question that goes to somebody else, at most every SEEN_S; in a replay, show all."""
        asked_here, self._asked_here = self._asked_here, False
        if self._pace is not None:
            self._replay(request, action, self._pace)
        elif self._pages and not asked_here:
            now_s = time.monotonic()
            if now_s - self._shown_s >= SEEN_S:
                self._shown_s = now_s
                self._show_state(request)
                for page in self._pages:
                    page.look(request)

    def _replay(self, request: Request, action: Reply, pace: ReplayPace) -> None:
        """Show a question with its answer, until the next one is due."""
        if self.page is not None:
            self._set_scene(request)
            self._show_state(request)
            self.page.replayed(request, action)
        if self._prompt is not None:
            self._prompt.show(request)
            self._prompt.told(request, action)
        pace.wait()

    def lesson_over(self, document: Mapping[str, Any]) -> None:
        """The lesson, or its replay, is over: show the final receipt on the page."""
        for page in self._pages:
            if (worth := document.get("receipt")) is not None:
                page.receipt(worth)
            page.finished(LESSON_OVER)

    # ---- questions

    def people(self) -> Mapping[str, Ask]:
        """The functions that ask people and language models, by the name of the advisor."""
        people: dict[str, Ask] = {**self.models}
        if self._prompt is not None:
            people["terminal"] = self._timed("terminal", self._ask_terminal, self._prompt, dict)
        if self.page is not None:
            people["web"] = self._timed("web", self._ask_page, self.page, self.page.shown)
        for name, page in {} if self._team is None else self._team.pages.items():
            people[name] = self._timed(name, partial(self._ask_team, name), page, page.shown)
        return people

    def _timed(self, by: str, ask: Ask, way: "TeachingPrompt | SeatPage", shown: Callable[[], dict[str, Any]]) -> Ask:
        """A function that asks a person, and keeps what they say, and on request the times."""
        spoken = SpokenAsk(ask, way.spoken)
        return spoken if self._times is None else TimedAsk(by, spoken, self._times, lambda: way.asking, shown)

    def _ask_terminal(self, request: Request) -> Reply:
        """The answer from the terminal; a page shows the question as well, and can answer it."""
        assert self._prompt is not None
        self._asked_here = True
        self._set_scene(request)
        self._show_state(request)
        if self.page is not None:
            self._offer(request)
            self._prompt.on_heard = self._offer
        try:
            with self.progress.paused():
                return self._prompt(request)
        finally:
            if self.page is not None:
                self.page.withdraw()

    def _offer(self, request: Request, text: str = "", moves: tuple[int, ...] = ()) -> None:
        """Show on the page what is asked at the terminal, and what was understood there and waits for agreement."""
        assert self.page is not None
        assert self._prompt is not None
        self.page.offer(request, self._prompt.answer_from_outside, text, moves)

    def _ask_page(self, request: Request) -> Reply:
        assert self.page is not None
        self._asked_here = True
        self._set_scene(request)
        self._show_state(request)
        return self.page.ask(request)

    def _ask_team(self, name: str, request: Request) -> Reply:
        assert self._team is not None
        self._asked_here = True
        self._set_scene(request)
        self._show_state(request)
        return self._team.ask(name, request)

    def _silent(self) -> Collection[str]:
        """The people of the team to whom a question about a step does not go."""
        assert self._team is not None
        if self._panel is None:
            return ()
        heard = self._panel.heard()
        return [name for name in self._team.pages if name not in heard]

    # ---- the scene

    def _show_state(self, request: Request) -> None:
        """Move the robot of the page's scene to the state of the question."""
        if self._pages and self._scene is not None:
            frame = self._scene.frame(request.state)
            for page in self._pages:
                page.update(frame)

    def _set_scene(self, request: Request) -> None:
        """Set up the scene of a lesson at its first question in a run; questions on the order have no scene."""
        if not isinstance(request, AdviceRequest):
            self.clear_scene()
        elif self._scene is None and self._lesson is not None and self._place is not None:
            self._show_scene(self._lesson.plan.problem)

    def _show_scene(self, problem: Problem | None) -> None:
        self.clear_scene()
        if not self._pages or problem is None:
            return
        from lab.seat.lesson_scene import lesson_scene_of

        self._scene, self._scene_of = lesson_scene_of(self._place, problem), problem
        if self._scene is not None:
            for page in self._pages:
                page.show(self._scene.bodies, self._scene.camera)

    def clear_scene(self) -> None:
        """Remove the scene."""
        if self._scene is not None:
            with suppress(Exception):
                self._scene.close()
            self._scene = self._scene_of = None

    # ---- replays

    def replaying(self, pause_s: float) -> ReplayPace:
        """The pace of a replay that begins now: all events are shown, `pause_s` [s] between two answers unless changed."""
        self._pace = ReplayPace(pause_s)
        if self.page is not None:
            self.page.paced(self._pace)
            self.page.wait_for_page(PAGE_S)
        return self._pace

    def stay(self) -> None:
        """Keep serving the page until Ctrl-C; returns at once when there is none."""
        while self.page is not None:
            time.sleep(3600)
