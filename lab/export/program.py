"""The program of a run: the robot's motions, gripper outputs, rests and transfers, as kept in the run's folder.

Also the options of an export, and the numbers of inputs and outputs that all controllers share.
"""

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
    """The options of an export.

    positions: of job files, rectangular or in pulses. date: in their headers, yyyy/mm/dd hh:mm. any_arm: whether programs
    are also written for arms of other makers than the controller's. fps: steps a second of a dataset.
    """

    positions: Literal["rectan", "pulse"] = "rectan"
    date: str = "2000/01/01 00:00"
    any_arm: bool = False
    fps: int = 30

    def check_arm(self, form: str, maker: str, names: str, arm: str, *, level: bool) -> None:
        """Raise BadInput for an arm whose name does not match the maker's `names`, unless any arm is allowed; or a level tool."""
        if level:
            raise BadInput(
                f"--format {form}: its poses are of a tool that hangs; this run's is level: csv and json fit any"
            )
        if not self.any_arm and not re.fullmatch(names, arm, re.IGNORECASE):
            raise BadInput(
                f"--format {form}: arm '{arm}' is not made by {maker}; --any-arm writes it all the same, csv and json fit any"
            )


GRIPPER = 1  # number of its output, and of its input that reports that it holds something
PULSE_S = 0.5  # duration of a pulse on an output to a machine


def done_input(machine: int) -> int:
    """The input by which a machine, counted from 1, reports that it is done."""
    return 1 + machine


def start_output(machine: int) -> int:
    """The output that tells a machine, counted from 1, to begin."""
    return 2 * machine


def reset_output(machine: int) -> int:
    """The output that tells a machine, counted from 1, that its part was taken out."""
    return 2 * machine + 1


# ---- the program as kept in the run's folder ----------------------------------------------------------------------------


PROGRAM, TRAJECTORY = "program.json", "trajectory.npz"
MAX_TEXT_BYTES, MAX_BYTES = 20_000_000, 200_000_000  # largest sizes of `program.json`, and of `trajectory.npz` unpacked
_ARRAYS = {"at_s": 1, "joints": 2, "closed": 1, "seen_at_s": 1, "seen": 2}  # number of dimensions of each array

_HEADS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}  # by version

Array = NDArray[np.float64]
At = Annotated[float, Field(ge=0)]
Row = Annotated[int, Field(ge=0)]


class Motion(Record):
    """A motion from rest to rest through `poses` (x, y, z [m], yaw [rad] each), with corners rounded by `blend_m` [m].

    It covers rows `first` to `last` of the program's joints, and rows `seen_first` to `seen_last` of `seen`. complete: False
    for a motion that was aborted; its last row is then the arm's position when the next action began.
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


class ArmRest(Record):
    """The arm stays, as over a cell that it covers."""

    what: Literal["rest"] = "rest"
    at_s: At
    seconds: At


Action = Annotated[Motion | Press | ArmRest, Field(discriminator="what")]


class ProgramTransfer(Record):
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
        """The transfer in words, for people."""
        what = self.part if self.carries == "part" else f"pallet of {self.part}"
        return f"{what}: {self.origin} to {self.target}"


class ProgramDocument(Record):
    """The content of `program.json`; its row numbers refer to the arrays of `trajectory.npz`.

    folder: of an arm that is a URDF file. batches: the machines that process all parts in them together.
    """

    version: Literal[1] = 1
    task: str
    seed: int
    robot: RobotSettings
    folder: str
    machines: tuple[str, ...]
    batches: tuple[str, ...] = ()
    transfers: tuple[ProgramTransfer, ...]
    actions: tuple[Action, ...]


@dataclass(frozen=True, eq=False)
class Program:
    """The program of one robot in one run; all times are [s] since the scene was ready.

    joints (n, k) [rad]: the arm's targets at times at_s (n,), and whether the gripper was closed (n,). seen (m, 7): the
    finger tips' pose in physics at times seen_at_s (m,): x, y, z [m] and quaternion xyzw, x out of the gripper, y across it.
    """

    carried: ProgramDocument
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
        """The tool poses (n, 4), x, y, z [m] and unwrapped yaw [rad], of the rows `first` to `last` of the joints."""
        poses = self.arm.tools(self.joints[first:last])
        poses[:, 2] += self.arm.base_up_m
        poses[:, 3] = np.unwrap(poses[:, 3])
        return poses

    def save(self, folder: Path) -> None:
        """Write the two files into an existing folder. Raises OSError."""
        text = self.carried.model_dump_json(indent=1)
        (folder / PROGRAM).write_text(f"{text}\n", encoding="utf-8")
        joints, seen = np.asarray(self.joints, np.float32), np.asarray(self.seen, np.float32)
        np.savez_compressed(
            folder / TRAJECTORY, at_s=self.at_s, joints=joints, closed=self.closed, seen_at_s=self.seen_at_s, seen=seen
        )

    @classmethod
    def load(cls, folder: Path) -> "Program":
        """The program in a run's folder. BadInput says what is missing or damaged."""
        paths = [folder / name for name in (PROGRAM, TRAJECTORY)]
        for path in paths:
            if not path.is_file():
                raise BadInput(f"'{folder}' (RUN): no {path.name} in it; give the folder of a `lab run` (its --out)")
        try:
            carried = ProgramDocument.model_validate_json(read_limited(paths[0], MAX_TEXT_BYTES))
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
            arrays = {name: np.asarray(stored[name], bool if name == "closed" else float) for name in _ARRAYS}
    except Exception as error:  # any error of the readers of zip files and arrays, for a file of unknown origin
        raise BadInput(f"'{path}': not a run's trajectory: {error}") from None
    for name, dimensions in _ARRAYS.items():
        if arrays[name].ndim != dimensions or not np.isfinite(arrays[name]).all():
            raise BadInput(f"'{path}': '{name}' is not an array of {dimensions} dimensions of finite numbers")
    return list(arrays.values())


def _check_sizes(content: bytes) -> None:
    """Raise ValueError, before unpacking, unless the arrays' sizes match their headers and are within MAX_BYTES."""
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
    """Raise BadInput unless the arrays have all rows that the motions refer to, and a column for each joint of the arm."""
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
