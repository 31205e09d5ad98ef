"""INFORM II job files as text: the instructions and positions that the lab writes and reads.

Source of the dialect: the listings of the thesis (Appendix VI; an XRC controller), which use /JOB, //NAME, //POS, ///NPOS,
///TOOL, ///POSTYPE PULSE or ROBOT, ///PULSE or ///RECTAN, ///RCONF, C00000=..., //INST, ///DATE, ///ATTR SC,RW, ///GROUP1 RB1,
NOP, MOVJ, TIMER, CALL JOB and END; in addition MOVL with V, VR and PL, DOUT and PULSE OT#, WAIT and PAUSE IF IN#, ///COMM
and comments, as in Yaskawa's manuals of job data and INFORM II (XRC, NX100: HW0481924, section 4.1). These files have not
been tested on a controller.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lab.errors import BadInput, unknown

MOST_POSITIONS = 998  # steps of one job
MOST_TEXT = 32  # characters of a comment
MOST_TIMER_S = 655.35
NAME = re.compile(r"[A-Z0-9][A-Z0-9_-]{0,7}")  # eight characters, as the XRC and NX100 take
_NUMBER = r"-?\d+(?:\.\d+)?"


@dataclass(frozen=True)
class MoveJ:
    """Moves to position `c` with interpolated joints, at a share of their speed [%]."""

    c: int
    percent: float

    def __str__(self) -> str:
        return f"MOVJ C{self.c:05d} VJ={self.percent:.2f}"


@dataclass(frozen=True)
class MoveL:
    """Moves to position `c` in a straight line: "V" at a speed in mm/s, or "VR", a turn at a speed in degrees/s.

    level: of rounding at the position, from 0 (the tool stops) to 8 (most).
    """

    c: int
    unit: Literal["V", "VR"]
    speed: float
    level: int

    def __str__(self) -> str:
        return f"MOVL C{self.c:05d} {self.unit}={self.speed:.1f} PL={self.level}"


@dataclass(frozen=True)
class Dout:
    """Sets an output."""

    output: int
    on: bool

    def __str__(self) -> str:
        return f"DOUT OT#({self.output}) {'ON' if self.on else 'OFF'}"


@dataclass(frozen=True)
class InformWait:
    """Waits for an input to be on, or off."""

    input: int
    on: bool = True

    def __str__(self) -> str:
        return f"WAIT IN#({self.input})={'ON' if self.on else 'OFF'}"


@dataclass(frozen=True)
class Pulse:
    """Sets an output for some seconds, without waiting."""

    output: int
    seconds: float

    def __str__(self) -> str:
        return f"PULSE OT#({self.output}) T={self.seconds:.2f}"


@dataclass(frozen=True)
class PauseIfOff:
    """Pauses the job, until a person continues it, if an input is off."""

    input: int

    def __str__(self) -> str:
        return f"PAUSE IF IN#({self.input})=OFF"


@dataclass(frozen=True)
class Timer:
    """Waits for some seconds."""

    seconds: float

    def __str__(self) -> str:
        return f"TIMER T={self.seconds:.2f}"


@dataclass(frozen=True)
class Call:
    """Calls another job, and continues after it."""

    job: str

    def __str__(self) -> str:
        return f"CALL JOB:{self.job}"


@dataclass(frozen=True)
class Comment:
    """A line for people."""

    text: str

    def __str__(self) -> str:
        return f"'{self.text}"


Instruction = MoveJ | MoveL | Dout | InformWait | Pulse | PauseIfOff | Timer | Call | Comment
_INSTRUCTIONS: dict[
    str, tuple[str, Callable[..., Instruction]]
] = {  # first word -> pattern of the whole line, and its class
    "MOVJ": (rf"MOVJ C(\d{{5}}) VJ=({_NUMBER})", lambda c, v: MoveJ(int(c), float(v))),
    "MOVL": (
        rf"MOVL C(\d{{5}}) (VR?)=({_NUMBER}) PL=([0-8])",
        lambda c, unit, v, level: MoveL(int(c), unit, float(v), int(level)),
    ),
    "DOUT": (r"DOUT OT#\((\d{1,4})\) (ON|OFF)", lambda n, on: Dout(int(n), on == "ON")),
    "WAIT": (r"WAIT IN#\((\d{1,4})\)=(ON|OFF)", lambda n, on: InformWait(int(n), on == "ON")),
    "PULSE": (rf"PULSE OT#\((\d{{1,4}})\) T=({_NUMBER})", lambda n, seconds: Pulse(int(n), float(seconds))),
    "PAUSE": (r"PAUSE IF IN#\((\d{1,4})\)=OFF", lambda n: PauseIfOff(int(n))),
    "TIMER": (rf"TIMER T=({_NUMBER})", lambda seconds: Timer(float(seconds))),
    "CALL": (rf"CALL JOB:({NAME.pattern})", Call),
}


@dataclass(frozen=True)
class InformPosition:
    """Six pulses, or x, y, z [mm] and Rx, Ry, Rz [degrees] with the manipulator's type (8,), see ///RCONF."""

    numbers: tuple[float, ...]
    configuration: tuple[int, ...] | None = None  # None: pulses
    tool: int = 0


@dataclass(frozen=True)
class InformJob:
    """One job; its positions are either all pulses or all rectangular."""

    name: str
    comment: str
    date: str
    positions: tuple[InformPosition, ...]
    instructions: tuple[Instruction, ...]

    def text(self) -> str:
        """The text of the job file, with the line ends that controllers expect."""
        lines = ["/JOB", f"//NAME {self.name}", "//POS", f"///NPOS {len(self.positions)},0,0,0,0,0"]
        before: tuple[int, ...] | None = None
        tool = -1
        for number, position in enumerate(self.positions):
            if position.tool != tool:
                pulses = position.configuration is None
                sort = ("PULSE", "PULSE") if pulses else ("ROBOT", "RECTAN")
                lines += [f"///TOOL {position.tool}", f"///POSTYPE {sort[0]}", f"///{sort[1]}"]
                tool, before = position.tool, None
            if position.configuration is not None and position.configuration != before:
                before = position.configuration
                lines.append(f"///RCONF {','.join(map(str, before))}")
            lines.append(f"C{number:05d}={','.join(_written(position))}")
        lines += ["//INST", f"///DATE {self.date}", *([f"///COMM {self.comment}"] if self.comment else [])]
        lines += ["///ATTR SC,RW", "///GROUP1 RB1", "NOP", *map(str, self.instructions), "END"]
        return "".join(f"{line}\r\n" for line in lines)


def _written(position: InformPosition) -> list[str]:
    if position.configuration is None:
        return [str(int(pulses)) for pulses in position.numbers]
    millimetres, degrees = position.numbers[:3], position.numbers[3:]
    return [f"{round(mm, 3) + 0.0:.3f}" for mm in millimetres] + [f"{round(turn, 2) + 0.0:.2f}" for turn in degrees]


class _Lines:
    """A reader of a file's lines, which knows the line number for error messages."""

    def __init__(self, text: str, where: str) -> None:
        self.lines, self.where, self.number = text.splitlines(), where, 0

    def fault(self, what: str) -> BadInput:
        return BadInput(f"{self.where}, line {self.number}: {what}")

    def next(self) -> str:
        self.number += 1
        if self.number > len(self.lines):
            raise self.fault("the file ends before END")
        return self.lines[self.number - 1].rstrip()

    def peek(self) -> str:
        return self.lines[self.number].rstrip() if self.number < len(self.lines) else ""

    def matched(self, pattern: str, wanted: str) -> "re.Match[str]":
        line = self.next()
        match = re.fullmatch(pattern, line)
        if match is None:
            raise self.fault(f"'{line}', wanted {wanted}")
        return match


def read_job(text: str, where: str) -> InformJob:
    """The job in a file's text; `where`: the file's name. BadInput names a line that is not part of this dialect."""
    lines = _Lines(text, where)
    lines.matched("/JOB", "/JOB")
    name = lines.matched(rf"//NAME ({NAME.pattern})", "//NAME and up to 8 capital letters and digits")[1]
    lines.matched("//POS", "//POS")
    count = int(lines.matched(r"///NPOS (\d{1,5}),0,0,0,0,0", "///NPOS n,0,0,0,0,0")[1])
    positions = _read_positions(lines, count) if count else []
    lines.matched("//INST", "//INST")
    date = lines.matched(r"///DATE (\d{4}/\d\d/\d\d \d\d:\d\d)", "///DATE yyyy/mm/dd hh:mm")[1]
    comment = lines.next()[len("///COMM ") :] if lines.peek().startswith("///COMM ") else ""
    lines.matched("///ATTR SC,RW", "///ATTR SC,RW")
    lines.matched("///GROUP1 RB1", "///GROUP1 RB1")
    lines.matched("NOP", "NOP")
    instructions: list[Instruction] = []
    while (line := lines.next()) != "END":
        instructions.append(_read_instruction(lines, line, count))
    if lines.peek():
        lines.next()
        raise lines.fault("something follows END")
    return InformJob(name, comment, date, tuple(positions), tuple(instructions))


def _read_positions(lines: _Lines, count: int) -> list[InformPosition]:
    tool, pulses = _read_sort(lines)
    positions: list[InformPosition] = []
    configuration: tuple[int, ...] | None = None
    number = r"-?\d{1,9}" if pulses else _NUMBER
    while len(positions) < count:
        if lines.peek().startswith("///TOOL"):
            tool, other = _read_sort(lines)
            configuration = None
            if other != pulses:
                raise lines.fault("positions of two sorts in one job")
            continue
        if not pulses and lines.peek().startswith("///RCONF"):
            bits = lines.matched(r"///RCONF ([01](?:,[01]){7})", "///RCONF and eight times 0 or 1")[1]
            configuration = tuple(map(int, bits.split(",")))
            continue
        at = rf"C{len(positions):05d}=({number}(?:,{number}){{5}})"
        numbers = lines.matched(at, f"C{len(positions):05d}= and six {'pulses' if pulses else 'numbers'}")[1]
        if not pulses and configuration is None:
            raise lines.fault("a position before any ///RCONF")
        positions.append(InformPosition(tuple(map(float, numbers.split(","))), configuration, tool))
    return positions


def _read_sort(lines: _Lines) -> tuple[int, bool]:
    """The tool number of the positions that follow, and whether they are pulses."""
    tool = int(lines.matched(r"///TOOL (\d{1,2})", "///TOOL and its number")[1])
    pulses = lines.matched("///POSTYPE (PULSE|ROBOT)", "///POSTYPE PULSE or ROBOT")[1] == "PULSE"
    sort = "///PULSE" if pulses else "///RECTAN"
    lines.matched(sort, sort)
    return tool, pulses


def _read_instruction(lines: _Lines, line: str, positions: int) -> Instruction:
    if line.startswith("'"):
        return Comment(line[1:])
    word = line.partition(" ")[0]
    if word not in _INSTRUCTIONS:
        raise unknown("instruction", word, [*_INSTRUCTIONS, "END"], f"{lines.where}, line {lines.number}")
    pattern, make = _INSTRUCTIONS[word]
    match = re.fullmatch(pattern, line)
    if match is None:
        raise lines.fault(f"'{line}' is not how {word} is written here")
    made = make(*match.groups())
    if isinstance(made, MoveJ | MoveL) and made.c >= positions:
        raise lines.fault(f"'{line}': the job has {positions} positions")
    return made
