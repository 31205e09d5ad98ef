"""Progress in one line of text: a progress bar, and a learning curve of a few characters."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from statistics import mean

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.segment import Segment

from lab.errors import escaped


class EscapingConsole(Console):
    """A rich console that prints unprintable characters as escapes; only rich's own control codes reach the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """The segments of a renderable, with unprintable characters escaped."""
        for segment in super().render(renderable, options):
            if segment.control is None and not segment.text.isprintable():
                yield Segment(escaped(segment.text), segment.style)
            else:
                yield segment


# ---- the bar of a long work -------------------------------------------------------------------------------------------


BARS = "▁▂▃▄▅▆▇█"
PLAIN_BARS = "_.-:=+*#"
CURVE = 10  # characters


def progress_bar(console: Console) -> Progress:
    """A progress bar with counts and time, shown only on a terminal."""
    columns = (TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


@contextmanager
def counting(console: Console, what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal, nothing elsewhere; yields the function to call with (done, total)."""
    with progress_bar(console) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def bars_for(console: Console) -> str:
    """The eight heights of a sparkline that this console can show."""
    return BARS if console.encoding.lower().startswith("utf") else PLAIN_BARS


def sparkline(steps: Sequence[int], width: int = CURVE, bars: str = BARS) -> str:
    """A learning curve as `width` characters: mean steps of equally long blocks of episodes, relative to the largest."""
    if not steps:
        return " " * width
    edges = [i * len(steps) // width for i in range(width + 1)]
    means = [mean(steps[a : max(b, a + 1)]) for a, b in pairwise(edges)]
    top = max(means) or 1
    return "".join(bars[min(len(bars) - 1, int(height / top * len(bars)))] for height in means)
