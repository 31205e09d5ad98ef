"""A run as INFORM II jobs, one for each transfer and a master that calls them; and the way back from jobs to commands.

As in the thesis (Appendix VI), each transfer is a job, and the gripper's OPEN and CLOSE are jobs of their own, which a site
adapts. Rectangular positions are those of the finger tips in the robot's axes, from its foot: `///TOOL 0` must be set to
the tool's length, with z pointing out of the gripper. PULSES is assumed: for a real arm, read it from its parameters.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, degrees, hypot, pi, radians
from typing import Literal

import numpy as np

from lab.errors import BadInput, counted
from lab.export.commands import (
    GRIP_S,
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
    TransferJob,
    jobs_of,
    step_between,
)
from lab.export.inform import (
    MOST_POSITIONS,
    MOST_TEXT,
    MOST_TIMER_S,
    Call,
    Comment,
    Dout,
    InformJob,
    InformPosition,
    InformWait,
    Instruction,
    MoveJ,
    MoveL,
    PauseIfOff,
    Pulse,
    Timer,
    read_job,
)
from lab.export.program import GRIPPER, PULSE_S, Array, Options, Program, done_input, reset_output, start_output
from lab.sim.arms.arm import Arm
from lab.sim.arms.tool_path import ROUNDINGS_M, YAW_ARM

PULSES = {
    "up6": tuple(n * 4096 / (2 * pi) for n in (120.0, 120.0, 120.0, 50.0, 50.0, 30.0))
}  # by arm, pulses/rad, assumed
MAKER, NAMES = "Yaskawa", r"up\d+|motoman.*|yaskawa.*|(gp|hc|hp|mh|ma|ar|sia)\d+.*"
_TOOL = re.compile(r"TOOL (\d+): (\d+\.\d{3}) KG")  # the comment that gives the mass carried from there on
_ALMOST_M = 1e-6
_OWN = re.compile(r"M\d{3}|OPEN|CLOSE")


def warnings(program: Program) -> list[str]:
    """What a person must know before such jobs run."""
    return [
        f"jbi: no controller has read these files; tool 0 and those that carry must have the tool of '{program.arm.name}' and "
        "their payload, and the pulses of pulse positions are assumed, not a real arm's",
        f"jbi: set the radii of position levels 1 to 8 to {', '.join(f'{1000 * cut:g}' for cut in ROUNDINGS_M)} mm",
    ]


def _tools(program: Program) -> dict[float, int]:
    """The tool number for each carried mass [kg], rounded as in the comments; tool 0 carries nothing."""
    masses = sorted({round(transfer.mass_kg, 3) for transfer in program.carried.transfers} - {0.0})
    return {0.0: 0} | {mass: number for number, mass in enumerate(masses, start=1)}


def write(program: Program, options: Options) -> dict[str, str]:
    """The jobs' texts by file name, the master first. BadInput for pulse positions of an arm whose PULSES are not known."""
    arm = program.arm
    options.check_arm("jbi", MAKER, NAMES, arm.name, level=arm.level is not None)
    if options.positions == "pulse" and arm.name not in PULSES:
        raise BadInput(f"--positions pulse: pulses of arm '{arm.name}' are not known; known: {', '.join(PULSES)}")
    jobs = [(f"M{number:03d}", job) for number, job in enumerate(jobs_of(program), start=1)]
    master = re.sub(r"[^A-Z0-9]", "", program.carried.task.upper())[:8]
    transfers = [_Writer(arm, options, _tools(program)).job(name, job) for name, job in jobs]
    calls = (Call("OPEN"), *(Call(name) for name, _ in jobs))
    called = {*calls, *(step for job in transfers for step in job.instructions)}
    grips = [
        InformJob(name, f"gripper {name.lower()}", options.date, (), (Dout(GRIPPER, on), Timer(GRIP_S)))
        for name, on in (("OPEN", False), ("CLOSE", True))
        if Call(name) in called
    ]
    name = "RUN" if _OWN.fullmatch(master) else master
    made = [InformJob(name, program.carried.task[:MOST_TEXT], options.date, (), calls), *grips, *transfers]
    return {f"{job.name}.JBI": job.text() for job in made}


@dataclass
class _Writer:
    """Writes one job: its positions, its instructions, and the arm's pose along the way."""

    arm: Arm
    options: Options
    tools: Mapping[float, int] = field(default_factory=lambda: {0.0: 0})
    tool: int = 0
    positions: list[InformPosition] = field(default_factory=list)
    instructions: list[Instruction] = field(default_factory=list)
    joints: Array | None = None
    pose: Array | None = None  # (4,)

    def job(self, name: str, job: TransferJob) -> InformJob:
        before: Command | None = None
        for command in job.commands:
            if not (
                isinstance(command, Pause) and isinstance(before, GripperOutput)
            ):  # which the gripper's jobs contain
                self._add(command)
            before = command
        if len(self.positions) > MOST_POSITIONS:
            most = f"a job holds {MOST_POSITIONS}"
            raise BadInput(f"job {name} ({job.words}): {counted(len(self.positions), 'position')}; {most}")
        comment = job.words[:MOST_TEXT]
        return InformJob(name, comment, self.options.date, tuple(self.positions), tuple(self.instructions))

    def _add(self, command: Command) -> None:
        if isinstance(command, JointMove):
            self.joints = np.array(command.joints)
            self.pose = _tool(self.arm, self.joints)
            self.instructions.append(MoveJ(self._at(self.pose, self.joints), command.percent))
        elif isinstance(command, Path):
            self._follow(command)
        elif isinstance(command, GripperOutput):
            self.instructions.append(Call("CLOSE" if command.closed else "OPEN"))
        elif isinstance(command, Await):
            self.instructions += [
                Comment(f"{command.station} done"[:MOST_TEXT]),
                InformWait(done_input(command.machine)),
            ]
        elif isinstance(command, Start | Reset):
            starts = isinstance(command, Start)
            output = start_output(command.machine) if starts else reset_output(command.machine)
            comment = Comment(f"{'start' if starts else 'reset'} {command.station}"[:MOST_TEXT])
            self.instructions += [comment, Pulse(output, PULSE_S), InformWait(done_input(command.machine), on=False)]
        elif isinstance(command, Check):
            self.instructions.append(PauseIfOff(GRIPPER))
        elif isinstance(command, Payload):
            mass = round(command.mass_kg, 3)
            self.tool = self.tools.get(mass, 0)
            self.instructions.append(Comment(f"TOOL {self.tool}: {mass:.3f} KG"))
        else:
            times = max(1, ceil(command.seconds / MOST_TIMER_S))
            self.instructions += [Timer(command.seconds / times)] * times

    def _follow(self, path: Path) -> None:
        assert self.pose is not None
        poses = np.vstack([self.pose, path.points])
        joints = self.arm.inverse_path(poses, self.joints)
        for number, pose in enumerate(path.points):
            unit, speed = _spoken_speed(step_between(self.pose, pose), float(path.speeds[number]))
            level = _level(float(path.roundings[number]))
            at = self._at(pose, joints[number + 1])
            self.instructions.append(MoveL(at, unit, speed, level))
            self.pose = pose
        self.joints = joints[-1]

    def _at(self, pose: Array, joints: Array) -> int:
        """The number of a new position."""
        if self.options.positions == "pulse":
            pulses = joints * np.array(PULSES[self.arm.name])
            self.positions.append(InformPosition(tuple(float(round(p)) for p in pulses), None, self.tool))
        else:
            x, y, z = (1000.0 * (pose[:3] - [0.0, 0.0, self.arm.base_up_m])).tolist()
            yaw = round(degrees(_wrapped(pose[3])), 2)
            self.positions.append(InformPosition((x, y, z, 180.0, 0.0, yaw), _configuration(joints), self.tool))
        return len(self.positions) - 1


def _level(rounding_m: float) -> int:
    """The position level whose radius is closest to a rounding [m]; 0 for a stop."""
    return 0 if rounding_m == 0.0 else 1 + int(np.argmin(np.abs(np.array(ROUNDINGS_M) - rounding_m)))


def _spoken_speed(step: Array, speed_m_s: float) -> tuple[Literal["V", "VR"], float]:
    """The unit and the speed of one straight line (4,) for a path speed [m/s]: "V" [mm/s], or "VR" [degrees/s] of a pure turn."""
    far, turn = hypot(*step[:3]), abs(step[3])
    way = hypot(far, YAW_ARM * turn)
    if far < max(_ALMOST_M, 1e-3 * YAW_ARM * turn):
        return "VR", max(0.1, round(degrees(speed_m_s / YAW_ARM), 1))
    return "V", max(0.1, round(1000.0 * speed_m_s * far / way, 1))


def _way_speed(step: Array, move: MoveL) -> float:
    """The path speed [m/s]: the inverse of `_spoken_speed`."""
    far, turn = hypot(*step[:3]), abs(step[3])
    if move.unit == "VR":
        return radians(move.speed) * YAW_ARM
    return move.speed / 1000.0 * (hypot(far, YAW_ARM * turn) / far if far > _ALMOST_M else 1.0)


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi


def _tool(arm: Arm, joints: Array) -> Array:
    pose = arm.forward(joints)
    return np.array([pose.x, pose.y, pose.z, pose.yaw])


def _configuration(joints: Array) -> tuple[int, ...]:
    """The manipulator type: no flip, upper arm, front; then whether R, T and S are at least half a turn from zero."""
    far = [int(not -pi < float(joint) <= pi) for joint in (joints[3], joints[-1], joints[0])]
    return (0, 0, 0, *far, 0, 0)


def read(files: Mapping[str, str], arm: Arm) -> list[Command]:
    """The commands of jobs (texts by file name), starting at the job that no other calls. BadInput names fault and line."""
    jobs: dict[str, InformJob] = {}
    for file, text in files.items():
        job = read_job(text, file)
        if job.name in jobs:
            raise BadInput(f"{file}: there are two jobs '{job.name}'")
        jobs[job.name] = job
    called = {step.job for job in jobs.values() for step in job.instructions if isinstance(step, Call)}
    if missing := sorted(called - jobs.keys()):
        raise BadInput(f"job '{missing[0]}' is called, but is in none of the files")
    masters = [name for name in jobs if name not in called]
    if len(masters) != 1:
        raise BadInput(f"wanted one job that no other calls, found {', '.join(masters) or 'none'}")
    return _Reader(arm, jobs).read(masters[0])


@dataclass
class _Reader:
    """Reads jobs along their calls, and keeps the arm's pose along the way."""

    arm: Arm
    jobs: Mapping[str, InformJob]
    found: list[Command] = field(default_factory=list)
    pose: Array | None = None
    points: list[Array] = field(default_factory=list)  # since the last stop
    roundings: list[float] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)

    def read(self, master: str) -> list[Command]:
        for job, step in self._steps(master, ()):
            if isinstance(step, MoveL):
                self._straight(job, step)
                continue
            self._stop()
            if isinstance(step, MoveJ):
                joints = self._joints(job.positions[step.c], f"job {job.name}, C{step.c:05d}")
                self.pose = _tool(self.arm, joints)
                self.found.append(JointMove(tuple(joints.tolist()), step.percent))
            elif isinstance(step, Dout) and step.output == GRIPPER:
                self.found.append(GripperOutput(step.on))
            elif isinstance(step, Timer):
                self.found.append(Pause(step.seconds))
            elif isinstance(step, InformWait) and step.on:
                self.found.append(Await(step.input - done_input(0)))
            elif isinstance(step, Pulse):
                machine = step.output // 2
                self.found.append(Start(machine) if step.output == start_output(machine) else Reset(machine))
            elif isinstance(step, PauseIfOff):
                self.found.append(Check())
            elif isinstance(step, Comment) and (told := _TOOL.fullmatch(step.text)):
                self.found.append(Payload(float(told[2])))
        self._stop()
        return self.found

    def _steps(self, name: str, within: Sequence[str]) -> Iterator[tuple[InformJob, Instruction]]:
        if name in within:
            raise BadInput(f"job '{name}' calls itself, by way of {' and '.join(within)}")
        for step in self.jobs[name].instructions:
            if isinstance(step, Call):
                yield from self._steps(step.job, (*within, name))
            else:
                yield self.jobs[name], step

    def _straight(self, job: InformJob, step: MoveL) -> None:
        where = f"job {job.name}, C{step.c:05d}"
        if self.pose is None:
            raise BadInput(f"{where}: a straight line before any MOVJ has said where it begins")
        position = job.positions[step.c]
        pose = (
            _tool(self.arm, self._joints(position, where)) if position.configuration is None else self._tool(position)
        )
        way = step_between(self.pose, pose)
        self.speeds.append(_way_speed(way, step))
        self.pose = self.pose + way
        self.points.append(self.pose)
        self.roundings.append(0.0 if step.level == 0 else ROUNDINGS_M[step.level - 1])

    def _stop(self) -> None:
        if self.points:
            self.found.append(Path(np.array(self.points), np.array(self.roundings), np.array(self.speeds)))
            self.points, self.roundings, self.speeds = [], [], []

    def _tool(self, position: InformPosition) -> Array:
        x, y, z, rx, ry, rz = position.numbers
        if abs(abs(rx) - 180.0) > 0.01 or abs(ry) > 0.01:
            raise BadInput(f"Rx = {rx}, Ry = {ry}: the lab's tool points straight down, Rx = 180 and Ry = 0")
        return np.array([x / 1000.0, y / 1000.0, z / 1000.0 + self.arm.base_up_m, radians(rz)])

    def _joints(self, position: InformPosition, where: str) -> Array:
        """The joints of a position: from its pulses, or from the tool's pose and whether T is half a turn from zero."""
        if position.configuration is None:
            if self.arm.name not in PULSES:
                raise BadInput(f"{where}: pulses of arm '{self.arm.name}' are not known; known: {', '.join(PULSES)}")
            return np.asarray(np.array(position.numbers) / np.array(PULSES[self.arm.name]))
        joints = self.arm.inverse_each(self._tool(position)[None])[0]
        if np.isnan(joints[0]):
            raise BadInput(f"{where}: out of reach of arm '{self.arm.name}'")
        if position.configuration[4]:
            turned = joints[-1] - 2 * pi * np.sign(joints[-1] or 1.0)
            if self.arm.lower[-1] <= turned <= self.arm.upper[-1]:
                joints[-1] = turned
        return np.asarray(joints)
