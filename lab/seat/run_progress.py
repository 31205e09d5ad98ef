"""The progress of a run on a console: phases, each skill's learning curve, when it asked, and the results."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import TaskID
from rich.text import Text

from lab.learning.session_events import AdviceRejected, AdviceRequested
from lab.seat.event_text import PARTS_DONE, lesson_parts, move_text, run_text, saved_text, sequence_parts
from lab.teaching.events import (
    Event,
    KeptBeside,
    LessonContinued,
    LessonEvent,
    MoveMade,
    MoveRetried,
    MoveTimed,
    OrderChosen,
    PhaseBegan,
    PolicyAdvises,
    RecordSkipped,
    SequenceFound,
    SequencingStands,
    SkillReady,
)
from lab.teaching.lesson_plan import Lesson
from lab.view.progress import bars_for, progress_bar, sparkline

_NAME = 52
_INDENT = 12
_LONGEST_LIST = 8
_UNLIMITED = 1000
ALL_FREE = "their paths are free here, and none is longer than one learned anew"


class RunProgress:
    """Writes lines to `console`, which is not stdout, and on a terminal a progress bar below them.

    The bar needs the context manager; the lines do not. The state of a search is shown in front of the bar and updated in
    place; the last state becomes a line, unless the found order is reported.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        self._progress, self._bars = progress_bar(console), bars_for(console)
        self._running = False
        self._task: TaskID | None = None
        self._stands = ""  # shown in front of the bar instead of the phase
        self._first_asked: dict[str, int] = {}  # skill -> episode
        self._rejected: dict[str, AdviceRejected] = {}
        self._reused: list[tuple[str, Lesson]] = []  # by skill

    def __enter__(self) -> "RunProgress":
        self._running = True
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._tell_reused()
        self._tell_stands()
        self._progress.stop()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Release the terminal, as for the teaching prompt."""
        if not self._running:
            yield
            return
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()

    def hear(self, event: Event) -> None:
        """Write an event; a learner's own events are summarized in the line of its lesson."""
        match event:
            case LessonEvent(lesson=name, event=AdviceRequested() as asked):
                self._first_asked.setdefault(name, asked.episode)
            case LessonEvent(lesson=name, event=AdviceRejected() as rejected):
                self._rejected[name] = rejected
            case PhaseBegan():
                self._begin(run_text(event), event.parts)
            case LessonContinued() | PolicyAdvises():
                self._say(run_text(event))
            case RecordSkipped() | MoveRetried() | KeptBeside():
                self._say((f"  {run_text(event)}", "yellow"))
            case SkillReady():
                self._lesson(event.name, event.lesson)
            case MoveTimed():
                self._say(f"  {event.name:{_NAME}} {event.seconds:6.2f} s")
            case SequenceFound():
                self._stands = ""  # which this line contains
                order, cost = sequence_parts(event)
                self._pack([Text(f"  {order}"), Text(cost)], gap=" ")
            case OrderChosen():
                self._say(f"  {run_text(event)}")
            case SequencingStands() if self._running and self._task is not None and self.console.is_terminal:
                self._stands = run_text(event)
                self._progress.update(self._task, description=self._stands)
            case SequencingStands():
                self._say(f"  {run_text(event)}")
            case MoveMade():
                self._say(f"  {event.move.drop_s:7.1f} s  {move_text(event)}")
        if self._task is not None and isinstance(event, PARTS_DONE):
            self._progress.advance(self._task)

    def _begin(self, title: str, parts: int) -> None:
        self._tell_reused()
        self._tell_stands()
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._say((title, "bold"))
        self._task = self._progress.add_task(title, total=parts)

    def _tell_stands(self) -> None:
        """Write the last state of a search, if no order has been reported since."""
        if self._stands:
            self._say(f"  {self._stands}")
        self._stands = ""

    def _lesson(self, name: str, lesson: Lesson) -> None:
        if lesson.source == "reused":
            self._reused.append((name, lesson))
            return
        steps, *rest = lesson_parts(lesson, self._first_asked.get(name), self._rejected.get(name))
        curve = sparkline([] if lesson.result is None else lesson.result.steps.tolist(), bars=self._bars)
        head = Text.assemble("  ", (f"{lesson.source:9}", "cyan"), f" {name:{_NAME}}")
        self._pack([head, *map(Text, [f"{curve} {steps:>11}", *rest])])

    def _tell_reused(self) -> None:
        """Write all reused skills in few lines, those of another problem separately."""
        reused, self._reused = self._reused, []
        elsewhere = [skill for skill in reused if skill[1].fitness is not None]
        self._tell_found([skill for skill in reused if skill[1].fitness is None])
        self._tell_found(elsewhere, f" (of another problem: {ALL_FREE})")
        arms = Counter(lesson.other_arm for _, lesson in reused if lesson.other_arm)
        for arm, count in arms.items():
            self._say(f"{'':{_INDENT}}{count} of them learned with another arm, {arm}")
        saved = (sum(lesson.saved[n] for _, lesson in reused) for n in (0, 1))
        if text := saved_text(*saved):
            self._say(f"{'':{_INDENT}}{text}")

    def _tell_found(self, reused: Sequence[tuple[str, Lesson]], where: str = "") -> None:
        if not reused:
            return
        names = [name for name, _ in reused]
        if len(names) > _LONGEST_LIST:
            counts = Counter(lesson.policy.subtask for _, lesson in reused)
            names = [f"{len(reused)} skills: " + ", ".join(f"{count} x {name}" for name, count in counts.items())]
        parts = [Text(name + ",") for name in names[:-1]] + [Text(names[-1] + where)]
        self._pack([Text.assemble("  ", (f"{'reused':9}", "green"), " ") + parts[0], *parts[1:]], gap=" ")

    def _say(self, *parts: str | tuple[str, str]) -> None:
        self.console.print(Text.assemble(*parts), soft_wrap=True)

    def _pack(self, parts: Sequence[Text], gap: str = "  ") -> None:
        """Write parts side by side, wrapped to the terminal's width; without a terminal there is no wrapping."""
        width = self.console.width if self.console.is_terminal else _UNLIMITED
        line = parts[0]
        for part in parts[1:]:
            if line.cell_len + len(gap) + part.cell_len > width:
                self._print(line)
                line = Text(" " * _INDENT) + part
            else:
                line = line + gap + part
        self._print(line)

    def _print(self, line: Text) -> None:
        line.rstrip()
        self.console.print(line, soft_wrap=True)
