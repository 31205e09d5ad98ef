"""How a run goes on, written to a console: phases, each skill's learning curve, when it asked and what came of it."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from statistics import mean

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from lab.learning.session import AdviceRejected, AdviceRequested, Event
from lab.listener import Listener
from lab.sequencing.events import Move, SequenceResult
from lab.sequencing.exact import Optimum
from lab.teaching import Lesson

BARS = "▁▂▃▄▅▆▇█"
PHASES = {
    "learn": "Find or learn the skills",
    "measure": "Time every move in simulation",
    "sequence": "Find the order of the transfers",
    "carry out": "Make toast in physics",
    "draw": "Draw the pictures",
}
_WIDTH = 16


class RunProgress(Listener):
    """Writes lines and a progress bar to `console`, which is not stdout; use it as a context manager."""

    def __init__(self, console: Console) -> None:
        self.console = console
        columns = (TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(), TimeElapsedColumn())
        self._progress = Progress(*columns, console=console, transient=True)
        self._task: TaskID | None = None
        self._asked: dict[str, list[int]] = defaultdict(list)
        self._rejected: dict[str, AdviceRejected] = {}

    def __enter__(self) -> "RunProgress":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal to somebody else, such as the teaching prompt."""
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()

    def phase(self, name: str, parts: int) -> None:
        if self._task is not None:
            self._progress.remove_task(self._task)
        title = PHASES.get(name, name)
        self._say(f"[bold]{title}[/bold]")
        self._task = self._progress.add_task(title, total=parts)

    def skipped(self, what: str) -> None:
        self._say(f"  [yellow]skipped:[/yellow] {_plain(what)}")

    def learning(self, name: str, event: Event) -> None:
        if isinstance(event, AdviceRequested):
            self._asked[name].append(event.episode)
        elif isinstance(event, AdviceRejected):
            self._rejected[name] = event

    def lesson(self, name: str, lesson: Lesson) -> None:
        policy, result = lesson.policy, lesson.result
        if result is None:
            self._say(f"  [green]{'reused':9}[/green] {name}")
        else:
            curve = sparkline(result.steps.tolist())
            steps = f"{policy.final_steps or '?'} of {policy.optimal_steps} steps"
            self._say(f"  [cyan]{lesson.source:9}[/cyan] {name:52} {curve} {steps:>15}  {self._advice(name, lesson)}")
        self._advance()

    def _advice(self, name: str, lesson: Lesson) -> str:
        result = lesson.result
        if result is None or not result.requests:
            return "never asked"
        asked = self._asked.get(name, [])
        when = f" from episode {asked[0]} on" if asked else ""
        text = f"asked {result.requests} x{when}, {result.helped_steps} helped steps"
        rejected = self._rejected.get(name)
        if rejected is not None:
            text += f"; [yellow]rejected its advisor[/yellow] after {rejected.misleads} misleads in episode {rejected.episode}"
        return text

    def measured(self, name: str, seconds: float) -> None:
        self._say(f"  {name:52} {seconds:6.2f} s")
        self._advance()

    def sequenced(self, best: SequenceResult, proven: Optimum) -> None:
        gap = best.makespan_s / proven.makespan_s - 1.0
        what = "proven optimum" if proven.proven else "best bound"
        self._say(
            f"  toasts {' '.join(map(str, best.sequence))}: {best.makespan_s:.1f} s, "
            f"{what} {proven.makespan_s:.1f} s, gap {gap:.1%} ({len(best.episode_makespans_s)} episodes)"
        )
        self._advance()

    def moved(self, move: Move) -> None:
        waited = move.pick_s - move.reach_s
        wait = f", waited {waited:.1f} s" if waited > 0.05 else ""
        self._say(f"  {move.drop_s:7.1f} s  toast {move.toast}: {move.origin} to {move.target}{wait}")
        self._advance()

    def retried(self, text: str) -> None:
        self._say(f"  [yellow]failed, trying again:[/yellow] {_plain(text)}")

    def _say(self, markup: str) -> None:
        self.console.print(Text.from_markup(markup), soft_wrap=True)

    def _advance(self) -> None:
        if self._task is not None:
            self._progress.advance(self._task)


def sparkline(steps: Sequence[int], width: int = _WIDTH) -> str:
    """A learning curve as `width` characters: the mean steps of equal stretches of episodes, full height for the largest."""
    if not steps:
        return " " * width
    edges = [round(i * len(steps) / width) for i in range(width + 1)]
    means = [mean(steps[a:b] or steps[min(a, len(steps) - 1) :][:1]) for a, b in pairwise(edges)]
    top = max(means)
    return "".join(BARS[min(len(BARS) - 1, int(height / top * len(BARS)))] for height in means)


def _plain(text: str) -> str:
    return text.replace("[", "\\[")
