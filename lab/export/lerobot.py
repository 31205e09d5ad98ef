"""A run as a LeRobot dataset: an episode for each transfer, with joints, gripper, the task in words and camera pictures."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.export.program import Array, Options, Program, ProgramTransfer
from lab.export.recorder import closed_at
from lab.recordings.episode import Episode, Pictures
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import Writer

CAMERA, GRIPPER = "overhead", "gripper_closed"
MOST_STEPS = 1_000_000  # of a run
MOST_PICTURE_OFF = 8.0  # of 255: largest mean difference of a picture that was compressed


class Film(Protocol):
    """What a camera saw of a run."""

    def pictures(self, times_s: Array) -> Pictures:
        """The pictures at times (n,) [s] since the scene was ready."""


@dataclass(frozen=True)
class RunRecord:
    """What is known of a run beside its program. by_hand_s: from when until when [s] a person moved the arm."""

    film: Film | None = None
    by_hand_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class DatasetCheck:
    """How a dataset that was read back differs from what was to be written. faults: what is unequal, in words.

    picture_off: the largest mean difference of an episode's first picture, of 255; None: there are no pictures.
    """

    episodes: int
    steps: int
    corrected_steps: int
    picture_off: float | None
    faults: tuple[str, ...]


def task_words(transfer: ProgramTransfer) -> str:
    """The task of an episode in words, as a policy that understands language is told it."""
    what = transfer.part if transfer.carries == "part" else f"the pallet of {transfer.part}"
    origin, target = (name.replace("_", " ") for name in (transfer.origin, transfer.target))
    return f"carry {what} from the {origin} to the {target}"


def episodes(program: Program, options: Options, record: RunRecord) -> Iterator[Episode]:
    """The episodes of a run, a transfer each, from when the part before was set down, at `options.fps` steps a second.

    States (n, k + 1): the joints' targets [rad], to which physics kept the arm, and whether the gripper was told to close (1)
    or open (0). Actions: the same one step later. A step was corrected if a person moved the arm then. Raises BadInput for a
    run without transfers, or of more than MOST_STEPS steps.
    """
    transfers = program.carried.transfers
    if not transfers or not len(program.joints):
        raise BadInput("--format lerobot: the run has no transfer: wanted one that the robot carried out")
    if transfers[-1].drop_s * options.fps > MOST_STEPS:
        raise BadInput(f"--fps {options.fps}: more than {MOST_STEPS} steps: wanted fewer a second")
    begins_s = [0.0, *(transfer.drop_s for transfer in transfers)]
    for begin_s, transfer in zip(begins_s, transfers, strict=False):
        steps = max(0, int((transfer.drop_s - begin_s) * options.fps + 1e-6)) + 1
        times_s = begin_s + np.arange(steps + 1) / options.fps
        rows = _joints_and_gripper(program, times_s)
        corrected = np.zeros(steps, np.bool_)
        for from_s, until_s in record.by_hand_s:
            corrected |= (times_s[:-1] >= from_s - 1e-9) & (times_s[:-1] < until_s - 1e-9)
        pictures = {} if record.film is None else {CAMERA: record.film.pictures(times_s[:-1])}
        yield Episode(task_words(transfer), rows[:-1], rows[1:], corrected, True, pictures)


def _joints_and_gripper(program: Program, times_s: Array) -> NDArray[np.float32]:
    """The joints' targets and the gripper's command (n, k + 1) at times (n,) [s]; between two motions the arm stays."""
    joints = [np.interp(times_s, program.at_s, column) for column in program.joints.T]
    closed = closed_at(program.carried.actions, times_s + 1e-9)
    return np.column_stack([*joints, closed]).astype(np.float32)


def write(program: Program, options: Options, record: RunRecord, folder: Path) -> None:
    """Writes the dataset to a new folder. Raises as `episodes` and `Writer` do."""
    names = (*program.arm.joints, GRIPPER)
    with Writer(folder, options.fps, program.arm.name, names, names) as writer:
        for episode in episodes(program, options, record):
            writer.add(episode)


def check(program: Program, options: Options, record: RunRecord, folder: Path) -> DatasetCheck:
    """The differences of the dataset in a folder from the run: numbers and tasks must be equal, pictures near."""
    found, faults, off, steps, corrected = read(folder), list[str](), list[float](), 0, 0
    wanted = list(episodes(program, options, record))
    if (len(found.episodes), found.fps) != (len(wanted), options.fps):
        faults.append(f"{len(found.episodes)} episodes at {found.fps} steps a second")
    for number, (own, other) in enumerate(zip(wanted, found.episodes, strict=False)):
        steps, corrected = steps + len(other), corrected + int(other.corrected.sum())
        rows = [(name, getattr(own, name), getattr(other, name)) for name in ("states", "actions", "corrected")]
        faults += [f"episode {number}: {name}" for name, one, two in rows if not np.array_equal(one, two)]
        if (own.task, own.success) != (other.task, other.success):
            faults.append(f"episode {number}: task '{other.task}', success {other.success}")
        for camera, pictures in own.pictures.items():
            off.append(float(np.abs(pictures[0].astype(float) - other.pictures[camera][0]).mean()))
            if off[-1] > MOST_PICTURE_OFF:
                faults.append(f"episode {number}: its first picture is {off[-1]:.1f} of 255 off")
    return DatasetCheck(len(found.episodes), steps, corrected, max(off, default=None), tuple(faults))
