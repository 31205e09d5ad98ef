"""The operator's commands: their table, the parsing of a typed line, and the immediate ones.

Terminal, page and pipe all send these words.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Literal

from lab.errors import BadInput, unknown
from lab.production.controls import Controls

Argument = str | float | tuple[float, float, float] | tuple[int, ...] | None
How = Literal["at once", "by hand", "in turn", "console"]
MOST_POINT_MM = 10_000.0
MOST_MM, MOST_DEGREES, MOST_SPEED = 500.0, 180.0, 100.0
AXES = {"x": 0, "y": 1, "z": 2}
_SIGN = re.compile(r"([+-])([xyz])")
OPERATOR = "operator"


@dataclass(frozen=True)
class OperatorCommand:
    """A command: its arguments as they are typed ("": none), its description, and when it is carried out.

    how: "at once": immediately; "by hand": a motion of the arm, when nothing moves, also in a pause; "in turn": after the
    commands before it; "console": it concerns the console, not the run. read: parses the argument from words.
    """

    arguments: str
    help: str
    how: How
    read: Callable[[str], Argument]


@dataclass(frozen=True)
class Spoken:
    """A parsed line: the command's word and argument; words: the line in its canonical form."""

    word: str
    argument: Argument
    words: str

    @property
    def how(self) -> How:
        """When the command is carried out."""
        return COMMANDS[self.word].how


def spoken(line: str) -> Spoken:
    """The command of a typed line; BadInput for a line that is none."""
    words = line.split()
    if not words:
        raise BadInput("no command: help lists them")
    word = words[0].lower()
    if word not in COMMANDS:
        raise unknown("command", words[0][:80], COMMANDS, "typed")
    rest = " ".join(words[1:])
    try:
        argument = COMMANDS[word].read(rest)
    except BadInput as error:
        raise BadInput(f"{word}: {error}") from None
    return Spoken(word, argument, f"{word} {rest}".strip())


def _nothing(rest: str) -> None:
    if rest:
        raise BadInput(f"'{rest[:80]}' after it: wanted nothing")


def _name(rest: str) -> str:
    if not rest:
        raise BadInput("no name after it")
    return rest


def _parts(rest: str) -> str:
    if "=" not in rest:
        raise BadInput(f"'{rest[:80]}': wanted kind=number, such as slice=2,cup=1")
    return ",".join(rest.replace(",", " ").split())


def _number(text: str, most: float, unit: str, least: float = -inf) -> float:
    """A number with a magnitude of at least `least` and at most `most`."""
    try:
        number = float(text)
    except ValueError:
        raise BadInput(f"'{text[:80]}' is no number of {unit}") from None
    if not abs(number) <= most or number < least:
        low = -most if least == -inf else least
        raise BadInput(f"{text[:40]}: allowed are {low:g} to {most:g} {unit}")
    return number


def _jog(rest: str) -> tuple[float, float, float]:
    """The displacement [m] along the world's axes; "+x 10" means ten millimetres."""
    axis, _, far = rest.partition(" ")
    sign = _SIGN.fullmatch(axis.lower())
    if sign is None:
        raise BadInput(
            f"'{axis[:80]}' is no direction: wanted +x, -x, +y, -y, +z or -z, then millimetres, such as +x 10"
        )
    length_m = _number(far, MOST_MM, "mm", least=0.0) / 1000
    way = [0.0, 0.0, 0.0]
    way[AXES[sign[2]]] = length_m if sign[1] == "+" else -length_m
    return way[0], way[1], way[2]


def _speed(rest: str) -> float | None:
    if rest == "max":
        return None
    return _number(rest, MOST_SPEED, "times real time, or max", least=0.1)


def pace(text: str) -> float | None:
    """The simulated seconds per second of an option `--speed`; None: unlimited. Raises BadInput."""
    try:
        return _speed(text)
    except BadInput as error:
        raise BadInput(f"speed: {error}") from None


def _place(rest: str) -> str | tuple[float, float, float]:
    """A station's name, or a point [m] from millimetres."""
    words = rest.split()
    if len(words) != 3:
        return _name(rest)
    x, y, z = (_number(word, MOST_POINT_MM, "mm") / 1000 for word in words)
    return x, y, z


def _order(rest: str) -> tuple[int, ...] | str:
    """The numbers of an order, or its moves in words."""
    words = rest.replace(",", " ").split()
    if not words:
        raise BadInput("no entries: wanted one number a move, such as 1 2 1 3")
    if not words[0].isdecimal() and len(words) > 1:
        return rest
    for number, word in enumerate(words, start=1):
        if not (word.isascii() and word.isdecimal() and len(word) <= 6 and int(word) > 0):
            raise BadInput(f"entry {number}, '{word[:40]}': wanted the number of a part, from 1")
    return tuple(int(word) for word in words)


COMMANDS: dict[str, OperatorCommand] = {
    "parts": OperatorCommand(
        "slice=2,cup=1", "choose how many parts of each kind; lays the scene out anew", "in turn", _parts
    ),
    "policy": OperatorCommand("", "find or learn the skills, time them, and find the best order", "in turn", _nothing),
    "run": OperatorCommand("", "carry the plan out from where it stands", "in turn", _nothing),
    "pause": OperatorCommand("", "stop when the move under way has ended", "at once", _nothing),
    "step": OperatorCommand("", "carry one move out, then pause", "at once", _nothing),
    "go": OperatorCommand("", "go on after a pause or a protective stop", "at once", _nothing),
    "stop": OperatorCommand("", "emergency stop: the arm holds at once, until it is reset", "at once", _nothing),
    "reset": OperatorCommand("", "release the emergency stop; then go", "at once", _nothing),
    "speed": OperatorCommand("1|4|max", "simulated seconds per second", "at once", _speed),
    "jog": OperatorCommand("+x 10", "move the tool so many mm along +x -x +y -y +z or -z", "by hand", _jog),
    "rotate": OperatorCommand(
        "15", "turn the gripper so many degrees", "by hand", lambda rest: _number(rest, MOST_DEGREES, "degrees")
    ),
    "move": OperatorCommand(
        "plate|300 -100 450", "move the tool straight over a station, or to x y z in mm", "by hand", _place
    ),
    "open": OperatorCommand("", "open the gripper", "by hand", _nothing),
    "close": OperatorCommand("", "close the gripper", "by hand", _nothing),
    "home": OperatorCommand("", "bring the arm home, over everything", "by hand", _nothing),
    "grasp": OperatorCommand(
        "", "take up the part that is nearest to the gripper, wherever that is", "by hand", _nothing
    ),
    "order": OperatorCommand(
        "1 2 1 3", "make this sequence the plan, checked move by move; also in words", "in turn", _order
    ),
    "learn": OperatorCommand("NAME", "learn a skill, or a family of skills, and keep it", "in turn", _name),
    "execute": OperatorCommand("NAME [PART]", "carry one skill out now", "by hand", _name),
    "lead": OperatorCommand(
        "NAME|end|drop", "what you do by hand from now on shows a skill; end: learn from it", "by hand", _name
    ),
    "status": OperatorCommand("", "say where everything stands", "console", _nothing),
    "help": OperatorCommand("", "list the commands", "console", _nothing),
    "quit": OperatorCommand("", "keep everything and leave", "console", _nothing),
}


def help_lines() -> list[str]:
    """The commands, one per line."""
    width = max(len(f"{word} {command.arguments}") for word, command in COMMANDS.items())
    return [f"{f'{word} {command.arguments}':{width}}  {command.help}" for word, command in COMMANDS.items()]


@dataclass(frozen=True)
class Done:
    """The result of a command: refused: why it was not begun; failed: why it was not completed; said: its result in words."""

    words: str
    refused: str = ""
    failed: str = ""
    said: str = ""

    @property
    def well(self) -> bool:
        """Whether the command was carried out."""
        return not (self.refused or self.failed)


def press(controls: Controls, said: Spoken, by: str = OPERATOR) -> str:
    """Carries out an immediate command, in any thread; returns why it was refused, or ""."""
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
