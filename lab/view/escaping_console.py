"""The terminal, as safe as plain text: what comes from a file cannot move its cursor, colour it or name its window."""

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from lab.errors import escaped


class EscapingConsole(Console):
    """A console of rich that shows as escapes whatever cannot be printed; only rich's own control codes reach the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """What all that is shown becomes on its way out."""
        for segment in super().render(renderable, options):
            if segment.control is None and not segment.text.isprintable():
                yield Segment(escaped(segment.text), segment.style)
            else:
                yield segment
