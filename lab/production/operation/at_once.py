"""What a person says to a run while it goes on: the stops and the pace, in words, and what came of them."""

from dataclasses import dataclass

from lab.production.controls import Controls
from lab.production.operation.commands import Spoken

OPERATOR = "operator"


@dataclass(frozen=True)
class Done:
    """What came of a command: refused, why it was not begun; failed, why it did not come to its end; said, what it came to."""

    words: str
    refused: str = ""
    failed: str = ""
    said: str = ""

    @property
    def well(self) -> bool:
        """Whether it was carried out."""
        return not (self.refused or self.failed)


def press(controls: Controls, said: Spoken, by: str = OPERATOR) -> str:
    """Do a command that is done at once, in any thread; why it may not be, "" when it was."""
    match said.word:
        case "stop":
            controls.emergency(by=by)
        case "pause":
            controls.pause(by)
        case "reset":
            return controls.reset()
        case "go":
            return controls.go_on()
        case "step":
            return controls.step()
        case "speed":
            assert not isinstance(said.argument, str | tuple)
            controls.set_speed(said.argument)
    return ""
