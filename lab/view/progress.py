"""How a run goes on, written to a console: phases, each skill's learning curve, when it asked and what came of it."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from statistics import mean

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from lab.errors import counted
from lab.learning.events import AdviceRejected, AdviceRequested, Event
from lab.sequencing.cell.schedule import Move
from lab.sequencing.search import Reference, SequenceResult
from lab.teaching.listener import Listener
from lab.teaching.teacher import Lesson
from lab.view.figures import beside, gap_of

BARS = "▁▂▃▄▅▆▇█"
PLAIN_BARS = "_.-:=+*#"
PHASES = {
    "learn": "Find or learn the skills",
    "measure": "Time every move in simulation",
    "sequence": "Find the order of the transfers",
    "carry out": "Make toast in physics",
    "draw": "Draw the pictures",
}
_CURVE = 10
_NAME = 52
_INDENT = 12
_LONGEST_LIST = 8
_SHOWN_MOVES = 24
_UNLIMITED = 1000


@contextmanager
def counting(console: Console, what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal, nothing elsewhere; yields what is told (done, total)."""
    columns = (TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class RunProgress(Listener):
    """Writes lines to `console`, which is not stdout, and on a terminal a progress bar below them.

    Use it as a context manager for the bar; the lines come without it, too.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        columns = (TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(), TimeElapsedColumn())
        self._progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._bars = bars_for(console)
        self._running = False
        self._task: TaskID | None = None
        self._asked: dict[str, list[int]] = defaultdict(list)
        self._rejected: dict[str, AdviceRejected] = {}
        self._reused: list[tuple[str, str]] = []  # skill, sub-task

    def __enter__(self) -> "RunProgress":
        self._running = True
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._tell_reused()
        self._progress.stop()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal to somebody else, such as the teaching prompt."""
        if not self._running:
            yield
            return
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()

    def phase(self, name: str, parts: int) -> None:
        self._tell_reused()
        if self._task is not None:
            self._progress.remove_task(self._task)
        title = PHASES.get(name, name)
        self._say((title, "bold"))
        self._task = self._progress.add_task(title, total=parts)

    def skipped(self, what: str) -> None:
        self._say(("  skipped: ", "yellow"), what)

    def learning(self, name: str, event: Event) -> None:
        """Something happened in a lesson; told in the line that `lesson` writes."""
        if isinstance(event, AdviceRequested):
            self._asked[name].append(event.episode)
        elif isinstance(event, AdviceRejected):
            self._rejected[name] = event

    def lesson(self, name: str, lesson: Lesson) -> None:
        policy, result = lesson.policy, lesson.result
        if result is None:
            self._reused.append((name, policy.subtask))
        else:
            reached = "?" if policy.final_steps is None else str(policy.final_steps)
            curve = sparkline(result.steps.tolist(), bars=self._bars)
            head = Text.assemble("  ", (f"{lesson.source:9}", "cyan"), f" {name:{_NAME}}")
            parts = [
                f"{curve} {reached + '/' + str(policy.optimal_steps or '?'):>5} steps",
                *self._advice(name, result.requests, result.helped_steps),
            ]
            if policy.final_steps is not None and policy.final_steps > (policy.optimal_steps or policy.final_steps):
                parts.insert(1, "not the shortest way")
            self._pack([head, *map(Text, parts)])
        self._advance()

    def _advice(self, name: str, requests: int, helped_steps: int) -> list[str]:
        if not requests:
            return ["never asked"]
        asked = self._asked.get(name, [])
        when = f" from episode {asked[0]}" if asked else ""
        parts = [f"asked {requests} x{when}, {counted(helped_steps, 'helped step')}"]
        rejected = self._rejected.get(name)
        if rejected is not None:
            after = counted(rejected.misleads, "mislead")
            parts.append(f"rejected its advisor in episode {rejected.episode} after {after}")
        return parts

    def _tell_reused(self) -> None:
        """In few lines, all skills that were there already."""
        reused, self._reused = self._reused, []
        if not reused:
            return
        names = [name for name, _ in reused]
        if len(names) > _LONGEST_LIST:
            counts = Counter(subtask for _, subtask in reused)
            names = [f"{len(reused)} skills: " + ", ".join(f"{count} x {name}" for name, count in counts.items())]
        parts = [Text(name + ",") for name in names[:-1]] + [Text(names[-1])]
        self._pack([Text.assemble("  ", (f"{'reused':9}", "green"), " ") + parts[0], *parts[1:]], gap=" ")

    def measured(self, name: str, seconds: float) -> None:
        self._say(f"  {name:{_NAME}} {seconds:6.2f} s")
        self._advance()

    def sequenced(self, best: SequenceResult, known: Reference | None) -> None:
        order = " ".join(map(str, best.sequence[:_SHOWN_MOVES]))
        more = f" and {len(best.sequence) - _SHOWN_MOVES} more" if len(best.sequence) > _SHOWN_MOVES else ""
        shown, reference = _beside(known, best.cost)
        found = f"{shown} found in episode {best.episode_costs.index(best.cost) + 1} of {len(best.episode_costs)}"
        parts = [f"  parts {order}{more}:", f"{found}, {reference}"]
        self._pack(list(map(Text, parts)), gap=" ")
        self._advance()

    def moved(self, move: Move) -> None:
        waited = move.pick_s - move.reach_s
        wait = f", waited {waited:.1f} s" if waited > 0.05 else ""
        self._say(f"  {move.drop_s:7.1f} s  toast {move.part}: {move.origin} to {move.target}{wait}")
        self._advance()

    def retried(self, text: str) -> None:
        self._say(("  failed, trying again: ", "yellow"), text)

    def _say(self, *parts: str | tuple[str, str]) -> None:
        self.console.print(Text.assemble(*parts), soft_wrap=True)

    def _pack(self, parts: Sequence[Text], gap: str = "  ") -> None:
        """Write parts side by side; one that does not fit begins another line. What is no terminal has no width."""
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

    def _advance(self) -> None:
        if self._task is not None:
            self._progress.advance(self._task)


def bars_for(console: Console) -> str:
    """The eight heights of a sparkline that this console can show."""
    return BARS if console.encoding.lower().startswith("utf") else PLAIN_BARS


def sparkline(steps: Sequence[int], width: int = _CURVE, bars: str = BARS) -> str:
    """A learning curve as `width` characters: the mean steps of equal stretches of episodes, full height for the largest."""
    if not steps:
        return " " * width
    edges = [i * len(steps) // width for i in range(width + 1)]
    means = [mean(steps[a : max(b, a + 1)]) for a, b in pairwise(edges)]
    top = max(means) or 1
    return "".join(bars[min(len(bars) - 1, int(height / top * len(bars)))] for height in means)


def _beside(known: Reference | None, cost: float) -> tuple[str, str]:
    """A cost, and what it stands beside: None, it was drawn, and there is nothing to compare it with."""
    if known is None:
        return f"{cost:.1f} s", "its luckiest drawn episode"
    gap = known.gap(cost)
    found, bound = beside(cost, known.bound, known.unit, 1)
    what = "proven optimum" if known.proven else "proven bound"
    return found, f"{what} {bound}" + ("" if gap is None else f", gap {gap_of(gap, 1)}")
