"""A terminal console that is safe against control codes: text from a file cannot move the cursor or change the terminal."""

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
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
