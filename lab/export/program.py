"""What a robot carried out in a run: its motions, gripper outputs, rests and transfers, as the run's folder keeps them."""

import re
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from lab.errors import BadInput
from lab.files import read_limited
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.tasks.record import Record
from lab.tasks.robot_fields import RobotSettings

POSITIONS = ("rectan", "pulse")


@dataclass(frozen=True)
class Options:
    """positions: of job files, rectangular or in pulses. date: that they bear, yyyy/mm/dd hh:mm.

    any_arm: programs are also written for arms of other makers than the controller's.
    """

    positions: Literal["rectan", "pulse"] = "rectan"
    date: str = "2000/01/01 00:00"
    any_arm: bool = False

    def check_arm(self, form: str, maker: str, names: str, arm: str, *, level: bool) -> None:
        """BadInput for an arm that is none of a controller's maker, whose names match `names`, unless any will do; or level."""
        if level:
            raise BadInput(
                f"--format {form}: its poses are of a tool that hangs; this run's is level: csv and json fit any"
            )
        if not self.any_arm and not re.fullmatch(names, arm, re.IGNORECASE):
            raise BadInput(
                f"--format {form}: arm '{arm}' is not made by {maker}; --any-arm writes it all the same, csv and json fit any"
            )


GRIPPER = 1  # its output, and its input that says that it holds something
PULSE_S = 0.5  # of an output that a machine waits for


def done_input(machine: int) -> int:
    """By which a machine, counted from 1, says that it is done."""
    return 1 + machine


def start_output(machine: int) -> int:
    """By which a machine, counted from 1, is told to begin."""
    return 2 * machine


def reset_output(machine: int) -> int:
    """By which a machine, counted from 1, is told that its part was taken out."""
    return 2 * machine + 1


# ---- program ----------------------------------------------------------------------------------------------------------


PROGRAM, TRAJECTORY = "program.json", "trajectory.npz"
MAX_TEXT_BYTES, MAX_BYTES = 20_000_000, 200_000_000  # of the two files, the second one unpacked
_ARRAYS = {"at_s": 1, "joints": 2, "closed": 1, "seen_at_s": 1, "seen": 2}  # and how many dimensions they have

_HEADS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}  # by version

Array = NDArray[np.float64]
At = Annotated[float, Field(ge=0)]
Row = Annotated[int, Field(ge=0)]


class Motion(Record):
    """The tool's way along `poses` (x, y, z [m], yaw [rad], each), rounded by `blend_m`, from rest to rest.

    Rows `first` to `last` of the joints were driven, `seen_first` to `seen_last` of what was seen. complete: to the end; if
    not, it was broken off, and its last row is where the arm was when it went on.
    """

    what: Literal["motion"] = "motion"
    at_s: At
    poses: tuple[tuple[float, float, float, float], ...]
    blend_m: Annotated[float, Field(ge=0)]
    first: Row
    last: Row
    seen_first: Row
    seen_last: Row
    complete: bool


class Press(Record):
    """The fingers close, or open."""

    what: Literal["gripper"] = "gripper"
    at_s: At
    closed: bool


class Rest(Record):
    """The arm stays, as over a cell that it covers."""

    what: Literal["rest"] = "rest"
    at_s: At
    seconds: At


Action = Annotated[Motion | Press | Rest, Field(discriminator="what")]


class Transfer(Record):
    """One move of the sequence: the robot leaves `start`, reaches the part at `origin`, sets it down at `target`.

    waits_for: the machine that must have finished before the part is taken out; None: none. mass_kg: of what is carried, a
    pallet with its part on it; 0: not known.
    """

    part: str
    carries: Literal["part", "pallet"]
    start: str
    origin: str
    target: str
    leave_s: At
    reach_s: At
    drop_s: At
    waits_for: str | None
    mass_kg: Annotated[float, Field(ge=0)] = 0.0

    @property
    def words(self) -> str:
        """What it does, for people."""
        what = self.part if self.carries == "part" else f"pallet of {self.part}"
        return f"{what}: {self.origin} to {self.target}"


class Carried(Record):
    """What `program.json` says; the rows that it counts stand in `trajectory.npz`. folder: of an arm that is a URDF file.

    batches: the machines that work on all parts in them together.
    """

    version: Literal[1] = 1
    task: str
    seed: int
    robot: RobotSettings
    folder: str
    machines: tuple[str, ...]
    batches: tuple[str, ...] = ()
    transfers: tuple[Transfer, ...]
    actions: tuple[Action, ...]


@dataclass(frozen=True, eq=False)
class Program:
    """One run of one robot; all times [s] since its floor was ready.

    joints (n, k) [rad]: the arm's targets at at_s (n,), with the gripper closed (n,) or not; seen (m, 7): where the finger
    tips were in physics at seen_at_s (m,): x, y, z [m] and their frame's quaternion xyzw, x out of the gripper, y across it.
    """

    carried: Carried
    at_s: Array
    joints: Array
    closed: NDArray[np.bool_]
    seen_at_s: Array
    seen: Array

    @cached_property
    def arm(self) -> Arm:
        """The arm that carried it out."""
        return arm_of(self.carried.robot, Path(self.carried.folder))

    @property
    def motions(self) -> list[Motion]:
        """Its motions, in order."""
        return [action for action in self.carried.actions if isinstance(action, Motion)]

    def tools(self, first: int, last: int) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (n, 4) that these rows of joints hold; the yaw goes on without jumps."""
        poses = self.arm.tools(self.joints[first:last])
        poses[:, 2] += self.arm.base_up_m
        poses[:, 3] = np.unwrap(poses[:, 3])
        return poses

    def save(self, folder: Path) -> None:
        """Write its two files into a folder that is there. Raises OSError."""
        text = self.carried.model_dump_json(indent=1)
        (folder / PROGRAM).write_text(f"{text}\n", encoding="utf-8")
        joints, seen = np.asarray(self.joints, np.float32), np.asarray(self.seen, np.float32)
        np.savez_compressed(
            folder / TRAJECTORY, at_s=self.at_s, joints=joints, closed=self.closed, seen_at_s=self.seen_at_s, seen=seen
        )

    @classmethod
    def load(cls, folder: Path) -> "Program":
        """What a run left in its folder. BadInput says what is missing or damaged."""
        paths = [folder / name for name in (PROGRAM, TRAJECTORY)]
        for path in paths:
            if not path.is_file():
                raise BadInput(f"'{folder}' (RUN): no {path.name} in it; give the folder of a `lab run` (its --out)")
        try:
            carried = Carried.model_validate_json(read_limited(paths[0], MAX_TEXT_BYTES))
        except OSError as error:
            raise BadInput(f"'{paths[0]}': {error.strerror or error}") from None
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"])) or "the document"
            raise BadInput(f"'{paths[0]}': {place}: {first['msg']}") from None
        program = cls(carried, *_arrays(paths[1]))
        _check_rows(program, paths[0])
        return program


def _arrays(path: Path) -> list[Any]:
    try:
        content = read_limited(path, MAX_BYTES)
        _check_sizes(content)
        with np.load(BytesIO(content), allow_pickle=False) as stored:
            found = {name: np.asarray(stored[name], bool if name == "closed" else float) for name in _ARRAYS}
    except Exception as error:  # whatever the readers of zip files and arrays come to over a stranger's file
        raise BadInput(f"'{path}': not a run's trajectory: {error}") from None
    for name, dimensions in _ARRAYS.items():
        if found[name].ndim != dimensions or not np.isfinite(found[name]).all():
            raise BadInput(f"'{path}': '{name}' is not an array of {dimensions} dimensions of finite numbers")
    return list(found.values())


def _check_sizes(content: bytes) -> None:
    """ValueError unless the arrays, unpacked, are as large as they say, and no larger than a run's: nothing is unpacked."""
    with ZipFile(BytesIO(content)) as archive:
        entries = archive.infolist()
        if (total := sum(entry.file_size for entry in entries)) > MAX_BYTES:
            raise ValueError(f"unpacked it has {total} bytes, allowed are {MAX_BYTES}")
        for entry in entries:
            with archive.open(entry) as file:
                read_head = _HEADS.get(np.lib.format.read_magic(file))
                if read_head is None:
                    raise ValueError(f"'{entry.filename}' is an array of an unknown version")
                shape, _, kind = read_head(file)
                if 8 * prod(shape) > MAX_BYTES:
                    raise ValueError(f"'{entry.filename}' holds {prod(shape)} numbers, allowed are {MAX_BYTES // 8}")
                if file.tell() + kind.itemsize * prod(shape) != entry.file_size:
                    raise ValueError(f"'{entry.filename}' does not hold an array of {shape}")


def _check_rows(program: Program, path: Path) -> None:
    """BadInput unless all rows that the motions count by are there, and the arm has so many joints."""
    rows, seen, axes = len(program.joints), len(program.seen), len(program.arm.joints)
    if program.joints.shape[1] != axes or program.seen.shape[1] != 7:
        raise BadInput(f"'{path}': its trajectory is not of the arm '{program.arm.name}' with {axes} joints")
    if not rows == len(program.at_s) == len(program.closed) or seen != len(program.seen_at_s):
        raise BadInput(f"'{path}': the columns of its trajectory are not equally long")
    for number, motion in enumerate(program.motions, start=1):
        if not (motion.first < motion.last <= rows and motion.seen_first < motion.seen_last <= seen):
            raise BadInput(f"'{path}': motion {number} counts rows that its trajectory does not have")
    for number, transfer in enumerate(program.carried.transfers, start=1):
        if transfer.waits_for is not None and transfer.waits_for not in program.carried.machines:
            raise BadInput(f"'{path}': transfer {number} waits for '{transfer.waits_for}', which is no machine of it")
