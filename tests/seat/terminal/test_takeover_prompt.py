"""The takeover's questions at the terminal."""

from io import StringIO

import pytest
from rich.console import Console

from lab.cloning.person import Situation
from lab.errors import WorkFailed
from lab.seat.terminal.takeover_prompt import takeover_prompt

SEEN = Situation(
    "distance: its doubt is 3, above 2", "The part is 3.0 cm ahead.", "The fingers are open.", "Wanted: it."
)


def test_a_wrong_line_is_asked_again_and_the_end_of_the_input_says_how_to_go_on() -> None:
    lines, shown = iter(["ahed", "ahead 2"]), StringIO()

    def read(question: str) -> str:
        try:
            return next(lines)
        except StopIteration:
            raise EOFError from None

    ask = takeover_prompt(read, Console(file=shown, width=200))
    assert ask(SEEN).moved[0] == pytest.approx(0.02)
    told = shown.getvalue()
    assert "turn-left" in told
    assert SEEN.why in told
    assert "3.0 cm ahead. The fingers are open. Wanted: it." in told
    assert "did you mean 'ahead'" in told
    with pytest.raises(WorkFailed, match="--resume"):
        ask(SEEN)
    assert shown.getvalue().count("degrees (10)") == 1  # the words are told once
