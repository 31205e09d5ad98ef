"""A run as a URScript program of movej, movel, set_digital_out, sleep and waits on get_digital_in; and the way back.

Poses p[x, y, z, rx, ry, rz] [m], rotation vector [rad], are those of the finger tips in the arm's base frame, z out of the
gripper, as set by `set_tcp`. Source: Universal Robots' script manual (movej, movel, set_digital_out, get_digital_in, sleep,
sync, set_tcp). The programs have not been tested on a controller; the lab has no arm of that family, so a UR reaches these
poses with other joints.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, sin

import numpy as np

from lab.errors import BadInput, unknown
from lab.export.commands import (
    Await,
    Check,
    Command,
    GripperOutput,
    JointMove,
    Path,
    Pause,
    Payload,
    Reset,
    Start,
    jobs_of,
    step_between,
)
from lab.export.program import GRIPPER, PULSE_S, Array, Options, Program, done_input, reset_output, start_output
from lab.sim.arms.arm import Arm
from lab.sim.arms.tool_path import ROUNDINGS_M, YAW_ARM

AXES = 6
MAKER, NAMES = "Universal Robots", r"ur\d+e?([_-].*)?"
MOST_SHARE = 0.49  # largest blend, as a share of the shorter line, so that blends do not overlap
JOINT_SPEED, JOINT_ACCELERATION = 0.3, 1.0  # [rad/s], [rad/s2] of the move to a transfer's start
_NUMBER = r"-?\d+\.\d+"
_POSE = rf"p\[({_NUMBER}(?:, {_NUMBER}){{5}})\]"
_JOINTS = rf"\[({_NUMBER}(?:, {_NUMBER}){{5}})\]"


def warnings(program: Program) -> list[str]:
    """What a person must know before such a program runs."""
    if re.fullmatch(NAMES, program.arm.name, re.IGNORECASE):
        return [
            "urscript: no controller has run this program; set_payload tells the part's mass, without the gripper's"
        ]
    return [
        f"urscript: '{program.arm.name}' is no arm of Universal Robots: on one, check reach, joint limits and which of its "
        "elbow and wrist configurations it takes; the base must stand where this arm's foot does"
    ]


def write(program: Program, options: Options) -> dict[str, str]:
    """The text of the only file, by its name. BadInput for an arm that does not have six axes."""
    arm = program.arm
    if len(arm.joints) != AXES:
        raise BadInput(
            f"--format urscript: arm '{arm.name}' has {len(arm.joints)} axes; URScript is for arms with {AXES}"
        )
    options.check_arm("urscript", MAKER, NAMES, arm.name, level=arm.level is not None)
    name = re.sub(r"[^a-z0-9]", "_", program.carried.task.lower())
    acceleration = program.carried.robot.acceleration_m_s2
    tool_m = float(np.linalg.norm(arm.tip[:3, 3]))
    lines = [f"set_tcp({_pose_text((0.0, 0.0, tool_m), (0.0, 0.0, 0.0))})", f"set_digital_out({GRIPPER}, False)"]
    writer = _ScriptWriter(arm, acceleration, lines)
    for number, job in enumerate(jobs_of(program), start=1):
        lines.append(f"# {number}: {job.words}")
        for command in job.commands:
            writer.add(command)
    body = "".join(f"  {line}\n" for line in lines)
    return {f"{name}.script": f"def run_{name}():\n{body}end\nrun_{name}()\n"}


@dataclass
class _ScriptWriter:
    """Writes commands as text, and keeps the tool's pose along the way."""

    arm: Arm
    acceleration: float
    lines: list[str]
    pose: Array | None = None

    def add(self, command: Command) -> None:
        if isinstance(command, JointMove):
            pose = self.arm.forward(np.array(command.joints))
            self.pose = np.array([pose.x, pose.y, pose.z, pose.yaw])
            self.lines.append(f"movej({self._text(self.pose)}, a={JOINT_ACCELERATION:.3f}, v={JOINT_SPEED:.3f})")
        elif isinstance(command, Path):
            assert self.pose is not None
            lines = np.diff(np.vstack([self.pose, command.points])[:, :3], axis=0)
            far = [*np.linalg.norm(lines, axis=1).tolist(), 0.0]
            for number, pose in enumerate(command.points):
                rounded = min(float(command.roundings[number]), MOST_SHARE * min(far[number], far[number + 1]))
                v = _tool_speed(step_between(self.pose, pose), float(command.speeds[number]))
                self.lines.append(f"movel({self._text(pose)}, a={self.acceleration:.3f}, v={v:.5f}, r={rounded:.4f})")
                self.pose = pose
        elif isinstance(command, GripperOutput):
            self.lines.append(f"set_digital_out({GRIPPER}, {command.closed})")
        elif isinstance(command, Pause):
            self.lines.append(f"sleep({command.seconds:.3f})")
        elif isinstance(command, Await):
            self.lines.append(f"# {command.station} done")
            self._wait(command.machine, "False")
        elif isinstance(command, Check):
            self.lines += [f"if (get_digital_in({GRIPPER}) == False):"]
            self.lines += ['  popup("nothing in the gripper", error=True, blocking=True)', "  halt", "end"]
        elif isinstance(command, Payload):
            self.lines.append(f"set_payload({command.mass_kg:.3f})")
        else:
            starts = isinstance(command, Start)
            output = start_output(command.machine) if starts else reset_output(command.machine)
            self.lines.append(f"# {'start' if starts else 'reset'} {command.station}")
            self.lines += [
                f"set_digital_out({output}, True)",
                f"sleep({PULSE_S:.3f})",
                f"set_digital_out({output}, False)",
            ]
            self._wait(command.machine, "True")

    def _wait(self, machine: int, until_not: str) -> None:
        self.lines += [f"while (get_digital_in({done_input(machine)}) == {until_not}):", "  sync()", "end"]

    def _text(self, pose: Array) -> str:
        x, y, z, yaw = pose.tolist()
        return _pose_text((x, y, z - self.arm.base_up_m), _down(yaw))


def _pose_text(place: tuple[float, ...], turn: tuple[float, ...]) -> str:
    return f"p[{', '.join(f'{round(number, 6) + 0.0:.6f}' for number in (*place, *turn))}]"


def _down(yaw: float) -> tuple[float, float, float]:
    """The rotation vector [rad] of a tool that points straight down with a yaw [rad]: half a turn about a horizontal axis."""
    yaw = (yaw + pi) % (2 * pi) - pi
    return (pi * cos(yaw / 2), pi * sin(yaw / 2), 0.0)


def _tool_speed(step: Array, way_m_s: float) -> float:
    """The `v` of movel for one straight line (4,): [rad/s] for a pure turn, else the tool's speed [m/s]."""
    far, turn = hypot(*step[:3]), abs(step[3])
    return way_m_s / YAW_ARM if far < 1e-6 else way_m_s * far / hypot(far, YAW_ARM * turn)


def _nearest_rounding(radius_m: float) -> float:
    """The rounding of ROUNDINGS_M that a blend radius stands for, as MOST_SHARE may have reduced it; others unchanged."""
    nearest = min(ROUNDINGS_M, key=lambda cut: abs(cut - radius_m))
    return nearest if abs(nearest - radius_m) < 0.03 * nearest else radius_m


def _way_speed(step: Array, v: float) -> float:
    """The path speed [m/s]: the inverse of `_tool_speed`."""
    far, turn = hypot(*step[:3]), abs(step[3])
    return v * YAW_ARM if far < 1e-6 else v * hypot(far, YAW_ARM * turn) / far


def read(files: Mapping[str, str], arm: Arm) -> list[Command]:
    """The commands of the only file. BadInput names a line that is not part of this dialect."""
    if len(files) != 1:
        raise BadInput(f"wanted one URScript file, found {', '.join(files) or 'none'}")
    ((name, text),) = files.items()
    return _ScriptReader(arm, name).read(text)


@dataclass
class _ScriptReader:
    """Reads line by line, and keeps the tool's pose along the way."""

    arm: Arm
    where: str
    number: int = 0
    found: list[Command] = field(default_factory=list)
    pose: Array | None = None
    points: list[Array] = field(default_factory=list)  # since the last stop
    roundings: list[float] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)

    def read(self, text: str) -> list[Command]:
        lines = [line.strip() for line in text.splitlines()]
        head = re.fullmatch(r"def (\w+)\(\):", lines[0]) if lines else None
        if head is None or lines[-2:] != ["end", f"{head[1]}()"]:
            raise BadInput(f"{self.where}: wanted one program, from 'def NAME():' to 'end' and 'NAME()'")
        block = ""  # the block that has begun and not ended
        for self.number, line in enumerate(lines[1:-2], start=2):
            if block and (line == "end" or re.fullmatch(_WITHIN[block], line)):
                block = "" if line == "end" else block
            elif block:
                raise self._fault(f"'{line}' within {block}: wanted {_WITHIN[block]} and end".replace("\\", ""))
            elif line and not line.startswith("#"):
                block = self._line(line)
        if block:
            raise self._fault(f"'{block}' has no end")
        self._stop()
        return self.found

    def _fault(self, what: str) -> BadInput:
        return BadInput(f"{self.where}, line {self.number}: {what}")

    def _line(self, line: str) -> str:
        """The word that begins a block in this line, or ""; reads the line."""
        word = re.split(r"[ (]", line, maxsplit=1)[0]
        if word not in _LINES:
            raise unknown("instruction", word, _LINES, f"{self.where}, line {self.number}")
        for pattern, act in _LINES[word]:
            if match := re.fullmatch(pattern, line):
                if word != "movel":
                    self._stop()
                act(self, match)
                return word if word in _WITHIN else ""
        raise self._fault(f"'{line}' is not how {word} is written here")

    def _stop(self) -> None:
        if self.points:
            self.found.append(Path(np.array(self.points), np.array(self.roundings), np.array(self.speeds)))
            self.points, self.roundings, self.speeds = [], [], []

    def joint_pose(self, match: "re.Match[str]") -> None:
        pose = self._read_pose(match[1])
        joints = self.arm.inverse_each(pose[None])[0]
        if np.isnan(joints[0]):
            raise self._fault(f"out of reach of arm '{self.arm.name}'")
        self.pose = pose
        self.found.append(JointMove(tuple(joints.tolist())))

    def joint_list(self, match: "re.Match[str]") -> None:
        joints = np.array([float(number) for number in match[1].split(", ")])
        pose = self.arm.forward(joints)
        self.pose = np.array([pose.x, pose.y, pose.z, pose.yaw])
        self.found.append(JointMove(tuple(joints.tolist())))

    def straight(self, match: "re.Match[str]") -> None:
        if self.pose is None:
            raise self._fault("a straight line before any movej has said where it begins")
        way = step_between(self.pose, self._read_pose(match[1]))
        self.speeds.append(_way_speed(way, float(match[3])))
        self.pose = self.pose + way
        self.points.append(self.pose)
        self.roundings.append(_nearest_rounding(float(match[4])))

    def output(self, match: "re.Match[str]") -> None:
        number, on = int(match[1]), match[2] == "True"
        machine = number // 2
        if number == GRIPPER:
            self.found.append(GripperOutput(on))
        elif on:
            self.found.append(Start(machine) if number == start_output(machine) else Reset(machine))

    def _read_pose(self, text: str) -> Array:
        x, y, z, rx, ry, rz = (float(number) for number in text.split(", "))
        if abs(rz) > 1e-4 or abs(hypot(rx, ry) - pi) > 1e-4:
            raise self._fault(
                "the lab's tool points straight down: rx, ry, rz is half a turn about an axis that lies flat"
            )
        return np.array([x, y, z + self.arm.base_up_m, 2.0 * atan2(ry, rx)])


_Act = Callable[[_ScriptReader, "re.Match[str]"], None]
_LINES: dict[str, list[tuple[str, _Act]]] = {  # first word -> patterns of the whole line, and what each does
    "set_tcp": [(rf"set_tcp\({_POSE}\)", lambda reader, match: None)],
    "movej": [
        (rf"movej\({_POSE}, a=({_NUMBER}), v=({_NUMBER})\)", _ScriptReader.joint_pose),
        (rf"movej\({_JOINTS}, a=({_NUMBER}), v=({_NUMBER})\)", _ScriptReader.joint_list),
    ],
    "movel": [(rf"movel\({_POSE}, a=({_NUMBER}), v=({_NUMBER}), r=({_NUMBER})\)", _ScriptReader.straight)],
    "set_digital_out": [(r"set_digital_out\((\d{1,2}), (True|False)\)", _ScriptReader.output)],
    "set_payload": [
        (rf"set_payload\(({_NUMBER})\)", lambda reader, match: reader.found.append(Payload(float(match[1]))))
    ],
    "if": [
        (rf"if \(get_digital_in\({GRIPPER}\) == False\):", lambda reader, match: reader.found.append(Check())),
    ],
    "sleep": [(rf"sleep\(({_NUMBER})\)", lambda reader, match: reader.found.append(Pause(float(match[1]))))],
    "while": [
        (
            r"while \(get_digital_in\((\d{1,2})\) == False\):",
            lambda reader, match: reader.found.append(Await(int(match[1]) - done_input(0))),
        ),
        (r"while \(get_digital_in\((\d{1,2})\) == True\):", lambda reader, match: None),
    ],
}
_WITHIN = {
    "while": r"sync\(\)",
    "if": r'popup\(".*", error=True, blocking=True\)|halt',
}  # pattern of the lines inside a block
