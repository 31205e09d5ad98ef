"""New tasks: the cell is laid out around its arm and every sub-task is checked before the file is written."""

import re
from dataclasses import replace
from itertools import islice
from pathlib import Path

from lab.errors import BadInput
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.parts.grip import grip_of
from lab.sim.parts.part_shape import shape_of
from lab.sim.scene.ground_plan import ring_of
from lab.skills.prepared_scene import prepare
from lab.tasks.new_task import HEAVIEST_KG, LIGHTEST_KG, Around, NewPart, NewTask, does_not_fit, heights_m, layouts
from lab.tasks.new_task_text import text_of
from lab.tasks.part_fields import PartFields
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.task import Task
from lab.tasks.task_file import task_of_text

FINGERS_M = 0.016  # by which the fingers open wider than the widest part
ROOM_M = 0.08  # between parts, where the stations' own spacing leaves the gripper too little room
MOST_TRIES = 4  # layouts whose sub-tasks are surveyed, for each spacing
NOT_HELD = "is not held"  # in the message about a part that slips, turns or falls over in a trial
OTHER_MASSES = (0.5, 0.2, 0.1, 0.05, 2, 5, 10)  # factors of its own mass that are tried for such a part


def new_cell(new: NewTask, path: Path) -> tuple[str, Task]:
    """The text of a task file for `path`, and its task; every sub-task of it has a solution.

    BadInput when no layout works. For parts that slip, it names a mass with which they would be held, if there is one.
    """
    try:
        return _laid_out(new, path)
    except BadInput as error:
        said = re.sub(rf"^{re.escape(str(path))}: (line \d+: )?", "", str(error))  # there is no such file yet
        if NOT_HELD not in said:
            raise BadInput(said) from None
        raise BadInput(f"{said.partition(';')[0]}: {_what_holds(new, path)}") from None


def _what_holds(new: NewTask, path: Path) -> str:
    """The masses with which all parts would be held, as command line options."""
    for times in OTHER_MASSES:
        parts = [
            replace(part, given_kg=min(max(round(times * part.mass_kg, 3), LIGHTEST_KG), HEAVIEST_KG))
            for part in new.parts
        ]
        try:
            _laid_out(replace(new, parts=tuple(parts)), path)
        except BadInput:
            continue
        return "held with " + " ".join(f"--mass {part.name}={part.mass_kg:g}" for part in parts)
    return "wanted another --mass, --friction, or size (--part)"


def _laid_out(new: NewTask, path: Path) -> tuple[str, Task]:
    arm = arm_of(RobotSettings(model=new.arm, start="input"))
    widest = max(_grip_width(part, arm, path.parent) for part in new.parts)
    opening = round(widest + FINGERS_M, 4)  # fully open fingers would need more room between parts
    around = _around(new, arm)
    refused: BadInput = does_not_fit(new, around)
    closer, wider = (islice(layouts(new, around, between), MOST_TRIES) for between in (None, ROOM_M))
    for placed in (*closer, *wider):
        text = text_of(new, placed, around, opening if opening < arm.gripper.opening_m else None)
        task = task_of_text(path, text)
        try:
            prepare(task, task.order(), 0)
        except BadInput as error:
            refused = error
        else:
            return text, task
    raise refused


def _grip_width(part: NewPart, arm: Arm, folder: Path) -> float:
    """The distance between the fingers that hold a part [m]; BadInput when they cannot hold it."""
    fields = PartFields(name=part.name, shape=part.shape, size_m=part.size_m, mass_kg=part.mass_kg)  # type: ignore[arg-type]
    return grip_of(shape_of(fields, folder), arm.gripper, part.friction).width_m


def _around(new: NewTask, arm: Arm) -> Around:
    """The region in which the arm reaches both the parts at a station and the path above them."""
    rings = [ring_of(arm.inverse, height, arm.nearest_m) for height in heights_m(new)]
    known = [ring for ring in rings if ring is not None]
    if len(known) < len(rings):
        raise BadInput(
            f"parts {heights_m(new)[1]:.2f} m above the table are out of the reach of the arm '{new.arm}': lower ones"
        )
    return Around(
        max(ring.nearest_m for ring in known),
        min(ring.farthest_m for ring in known),
        min(min(ring.right_rad, ring.left_rad) for ring in known),
    )
