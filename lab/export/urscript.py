"""A run as a URScript program of movej, movel, set_digital_out, sleep and waits on get_digital_in, and such text as commands.

Poses p[x, y, z, rx, ry, rz] [m], axis times angle [rad], are the finger tips' in the arm's base, z out of the gripper, as
`set_tcp` says. Source: Universal Robots' script manual (movej, movel, set_digital_out, get_digital_in, sleep, sync, set_tcp).
No controller has run what is written here; the lab has no arm of that family, so a UR reaches these poses with other joints.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, sin

import numpy as np

from lab.errors import BadInput, unknown
from lab.export.commands import Await, Command, Grip, Joint, Path, Pause, jobs_of, step_between
from lab.export.options import Options
from lab.export.program import Array, Program
from lab.sim.arms.arm import Arm
from lab.sim.arms.tool_path import YAW_ARM

AXES = 6
GRIPPER = 1  # its digital output
THROUGH_M = 0.0005  # blend radius of a pose that is passed without a stop
JOINT_SPEED, JOINT_ACCELERATION = 0.3, 1.0  # [rad/s], [rad/s2] to where a transfer begins
_NUMBER = r"-?\d+\.\d+"
_POSE = rf"p\[({_NUMBER}(?:, {_NUMBER}){{5}})\]"
_JOINTS = rf"\[({_NUMBER}(?:, {_NUMBER}){{5}})\]"


def warnings(program: Program) -> list[str]:
    """What a person must know before such a program runs."""
    return [
        f"urscript: '{program.arm.name}' is no arm of Universal Robots: on one, check reach, joint limits and which of its "
        "elbow and wrist configurations it takes; the base must stand where this arm's foot does"
    ]


def write(program: Program, options: Options) -> dict[str, str]:
    """One file. BadInput for an arm that has not six axes."""
    arm = program.arm
    if len(arm.joints) != AXES:
        raise BadInput(
            f"--format urscript: arm '{arm.name}' has {len(arm.joints)} axes; URScript is for arms with {AXES}"
        )
    name = re.sub(r"[^a-z0-9]", "_", program.carried.task.lower())
    acceleration = program.carried.robot.acceleration_m_s2
    tool_m = float(np.linalg.norm(arm.tip[:3, 3]))
    lines = [f"set_tcp({_pose_text((0.0, 0.0, tool_m), (0.0, 0.0, 0.0))})", f"set_digital_out({GRIPPER}, False)"]
    writer = _Writer(arm, acceleration, lines)
    for number, job in enumerate(jobs_of(program), start=1):
        lines.append(f"# {number}: {job.words}")
        for command in job.commands:
            writer.add(command)
    body = "".join(f"  {line}\n" for line in lines)
    return {f"{name}.script": f"def run_{name}():\n{body}end\nrun_{name}()\n"}


@dataclass
class _Writer:
    """Writes commands down, and knows where the tool is meanwhile."""

    arm: Arm
    acceleration: float
    lines: list[str]
    pose: Array | None = None

    def add(self, command: Command) -> None:
        if isinstance(command, Joint):
            pose = self.arm.forward(np.array(command.joints))
            self.pose = np.array([pose.x, pose.y, pose.z, pose.yaw])
            self.lines.append(f"movej({self._text(self.pose)}, a={JOINT_ACCELERATION:.3f}, v={JOINT_SPEED:.3f})")
        elif isinstance(command, Path):
            assert self.pose is not None
            for number, pose in enumerate(command.points):
                rounded = 0.0 if number == len(command.points) - 1 else THROUGH_M
                speeds = (
                    f"a={self.acceleration:.3f}, v={_tool_speed(step_between(self.pose, pose), command.speed_m_s):.5f}"
                )
                self.lines.append(f"movel({self._text(pose)}, {speeds}, r={rounded:.4f})")
                self.pose = pose
        elif isinstance(command, Grip):
            self.lines.append(f"set_digital_out({GRIPPER}, {command.closed})")
        elif isinstance(command, Pause):
            self.lines.append(f"sleep({command.seconds:.3f})")
        else:
            self.lines += [f"# {command.station} done", f"while (get_digital_in({command.machine}) == False):"]
            self.lines += ["  sync()", "end"]

    def _text(self, pose: Array) -> str:
        x, y, z, yaw = pose.tolist()
        return _pose_text((x, y, z - self.arm.base_up_m), _down(yaw))


def _pose_text(place: tuple[float, ...], turn: tuple[float, ...]) -> str:
    return f"p[{', '.join(f'{round(number, 6) + 0.0:.6f}' for number in (*place, *turn))}]"


def _down(yaw: float) -> tuple[float, float, float]:
    """Axis times angle of a tool that points straight down, turned by `yaw`: half a turn about an axis that lies flat."""
    yaw = (yaw + pi) % (2 * pi) - pi
    return (pi * cos(yaw / 2), pi * sin(yaw / 2), 0.0)


def _tool_speed(step: Array, way_m_s: float) -> float:
    """v of one straight piece (4,): of a mere turn, which movel times by its angle [rad/s], else of the tool [m/s]."""
    far, turn = hypot(*step[:3]), abs(step[3])
    return way_m_s / YAW_ARM if far < 1e-6 else way_m_s * far / hypot(far, YAW_ARM * turn)


def _way_speed(step: Array, v: float) -> float:
    """The speed of the way [m/s] that `_tool_speed` was told."""
    far, turn = hypot(*step[:3]), abs(step[3])
    return v * YAW_ARM if far < 1e-6 else v * hypot(far, YAW_ARM * turn) / far


def read(files: Mapping[str, str], arm: Arm) -> list[Command]:
    """The commands of the one file. BadInput names the line that is no part of this dialect."""
    if len(files) != 1:
        raise BadInput(f"wanted one URScript file, found {', '.join(files) or 'none'}")
    ((name, text),) = files.items()
    return _Reader(arm, name).read(text)


@dataclass
class _Reader:
    """Reads line by line, and knows where the tool is meanwhile."""

    arm: Arm
    where: str
    number: int = 0
    found: list[Command] = field(default_factory=list)
    pose: Array | None = None
    points: list[Array] = field(default_factory=list)  # since the last stop
    speeds: list[float] = field(default_factory=list)

    def read(self, text: str) -> list[Command]:
        lines = [line.strip() for line in text.splitlines()]
        head = re.fullmatch(r"def (\w+)\(\):", lines[0]) if lines else None
        if head is None or lines[-2:] != ["end", f"{head[1]}()"]:
            raise BadInput(f"{self.where}: wanted one program, from 'def NAME():' to 'end' and 'NAME()'")
        waiting = False
        for self.number, line in enumerate(lines[1:-2], start=2):
            if waiting and line in ("sync()", "end"):
                waiting = line != "end"
            elif waiting:
                raise self._fault(f"'{line}' within a wait: wanted sync() and end")
            elif line and not line.startswith("#"):
                waiting = self._line(line)
        if waiting:
            raise self._fault("a wait has no end")
        self._stop()
        return self.found

    def _fault(self, what: str) -> BadInput:
        return BadInput(f"{self.where}, line {self.number}: {what}")

    def _line(self, line: str) -> bool:
        """Read one line; whether a wait begins with it."""
        word = re.split(r"[ (]", line, maxsplit=1)[0]
        if word not in _LINES:
            raise unknown("instruction", word, _LINES, f"{self.where}, line {self.number}")
        for pattern, act in _LINES[word]:
            if match := re.fullmatch(pattern, line):
                if word != "movel":
                    self._stop()
                act(self, match)
                return word == "while"
        raise self._fault(f"'{line}' is not how {word} is written here")

    def _stop(self) -> None:
        if self.points:
            self.found.append(Path(np.array(self.points), min(self.speeds)))
            self.points, self.speeds = [], []

    def joint_pose(self, match: "re.Match[str]") -> None:
        pose = self._read_pose(match[1])
        joints = self.arm.inverse_each(pose[None])[0]
        if np.isnan(joints[0]):
            raise self._fault(f"out of reach of arm '{self.arm.name}'")
        self.pose = pose
        self.found.append(Joint(tuple(joints.tolist())))

    def joint_list(self, match: "re.Match[str]") -> None:
        joints = np.array([float(number) for number in match[1].split(", ")])
        pose = self.arm.forward(joints)
        self.pose = np.array([pose.x, pose.y, pose.z, pose.yaw])
        self.found.append(Joint(tuple(joints.tolist())))

    def straight(self, match: "re.Match[str]") -> None:
        if self.pose is None:
            raise self._fault("a straight line before any movej has said where it begins")
        way = step_between(self.pose, self._read_pose(match[1]))
        self.speeds.append(_way_speed(way, float(match[3])))
        self.pose = self.pose + way
        self.points.append(self.pose)
        if float(match[4]) == 0.0:
            self._stop()

    def _read_pose(self, text: str) -> Array:
        x, y, z, rx, ry, rz = (float(number) for number in text.split(", "))
        if abs(rz) > 1e-4 or abs(hypot(rx, ry) - pi) > 1e-4:
            raise self._fault(
                "the lab's tool points straight down: rx, ry, rz is half a turn about an axis that lies flat"
            )
        return np.array([x, y, z + self.arm.base_up_m, 2.0 * atan2(ry, rx)])


_Act = Callable[[_Reader, "re.Match[str]"], None]
_LINES: dict[str, list[tuple[str, _Act]]] = {  # first word -> the forms of the whole line, and what each means
    "set_tcp": [(rf"set_tcp\({_POSE}\)", lambda reader, match: None)],
    "movej": [
        (rf"movej\({_POSE}, a=({_NUMBER}), v=({_NUMBER})\)", _Reader.joint_pose),
        (rf"movej\({_JOINTS}, a=({_NUMBER}), v=({_NUMBER})\)", _Reader.joint_list),
    ],
    "movel": [(rf"movel\({_POSE}, a=({_NUMBER}), v=({_NUMBER}), r=({_NUMBER})\)", _Reader.straight)],
    "set_digital_out": [
        (
            rf"set_digital_out\({GRIPPER}, (True|False)\)",
            lambda reader, match: reader.found.append(Grip(match[1] == "True")),
        )
    ],
    "sleep": [(rf"sleep\(({_NUMBER})\)", lambda reader, match: reader.found.append(Pause(float(match[1]))))],
    "while": [
        (
            r"while \(get_digital_in\((\d{1,2})\) == False\):",
            lambda reader, match: reader.found.append(Await(int(match[1]))),
        )
    ],
}
