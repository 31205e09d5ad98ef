"""The text of a new task file, with the comments that explain its fields."""

from collections.abc import Sequence
from math import ceil, floor, hypot, inf

from lab.tasks.new_task import (
    AROUND_PART_M,
    CELL_M,
    LEVELS,
    MACHINE_HIGH_M,
    Around,
    NewPart,
    NewTask,
    PlacedStation,
    heights_m,
)
from lab.tasks.robot_fields import MODELS

COLORS = ((0.62, 0.42, 0.22), (0.25, 0.45, 0.70), (0.35, 0.60, 0.35), (0.80, 0.65, 0.25), (0.65, 0.35, 0.45))
FINISHES = ((0.70, 0.42, 0.16), (0.85, 0.30, 0.20), (0.20, 0.40, 0.55), (0.45, 0.55, 0.20))


def text_of(new: NewTask, placed: Sequence[PlacedStation], around: Around, opening_m: float | None = None) -> str:
    """The task file; opening_m: the largest opening of the fingers; None: as wide as they open."""
    parts = "\n".join(_part(new, part, number) for number, part in enumerate(new.parts))
    stations = "\n".join(_station(new, station) for station in placed)
    return "\n".join([_head(new, opening_m), parts, _workspace(new, placed, around), stations, _OBSTACLES, _LEARNING])


def _head(new: NewTask, opening_m: float | None) -> str:
    way = " -> ".join(["input", *(machine.name for machine in new.machines), "output"])
    kinds = ", ".join(f"{part.count} x {part.name}" for part in new.parts)
    opening = "" if opening_m is None else f"\nopening_m = {opening_m:<16}# between the open fingers"
    return f"""\
# {kinds}: {way}
# Change a number, move a station, and look: lab task check {new.name}.toml --plot cell.png    Then: lab run {new.name}.toml
# Units: metres, radians, seconds, kilograms, newtons. The robot stands at the origin; z = 0 is the table top.
# An editor for TOML completes the keys: lab task schema --out task-schema.json, and as the first line here
# #:schema task-schema.json

name = "{new.name}"
title = "{new.name}: {way}"

[robot]
model = "{new.arm}"               # {", ".join(MODELS)}, or a URDF file beside this one
start = "input"             # where the arm waits at time 0
speed_m_s = 0.5             # along the path
acceleration_m_s2 = 2.0
# grip_force_n = 25.0       # of each finger, at most; by default chosen from what the parts weigh and their friction{opening}
"""


def _part(new: NewTask, part: NewPart, number: int) -> str:
    sizes = "x, y, z" if part.shape == "box" else "diameter and height"
    stages = []
    for machine in new.machines:
        buffer = f', buffer = "{machine.name}_buffer"' if new.buffers else ""
        stages.append(f'{{ station = "{machine.name}"{buffer} }}' if buffer else f'"{machine.name}"')
    route = "\n".join(f"  {stage}," for stage in ['"input"', *stages, '"output"'])
    area = (0.004, 0.004, 0.06 if part.shape == "box" else 0.0)
    return f"""\
[[parts]]                   # a kind of part
name = "{part.name}"
count = {part.count}                   # unless --parts {part.name}=N says otherwise
shape = "{part.shape}"
size_m = {_list(part.size_m)}  # {sizes}
mass_kg = {part.mass_kg}
friction = {part.friction}
color = {_list(COLORS[number % len(COLORS)])}
area = {_list(area)}  # it stands on its spot at the start within +- x, +- y [m], +- yaw [rad]
# its route; a buffer is used only when the machine ahead of it is busy
routes = [[
{route}
]]
"""


def _workspace(new: NewTask, placed: Sequence[PlacedStation], around: Around) -> str:
    low = round(heights_m(new)[1] - CELL_M / 2, 3)
    ahead = max(hypot(station.x, station.y) for station in placed)  # paths between the two sides pass there
    lower, shape = [], []
    behind = -floor(around.nearest_m / CELL_M)  # no cell is free right behind the arm, where it cannot turn through
    for axis, others, least in ((0, [ahead], behind), (1, [0.0], -inf)):
        at = [((station.x, station.y)[axis], station.half_m(new.foot_m)[axis] + CELL_M) for station in placed]
        first = max(least, floor(min(x - half for x, half in at) / CELL_M))
        lower.append(round(CELL_M * first, 3))
        shape.append(ceil(max(*others, *(x + half for x, half in at)) / CELL_M) - first)
    return f"""\
[workspace]                 # the grid in which carrying is learned: where the finger tips may go between stations
lower_m = {_list((*lower, low))}
cell_m = {_list((CELL_M,) * 3)}
shape = [{shape[0]}, {shape[1]}, {LEVELS}]

# ---- stations: pose = [x, y, yaw]; a part stands there with its x axis along the yaw ------------------------------
"""


def _station(new: NewTask, station: PlacedStation) -> str:
    lines = [
        "[[stations]]",
        f'name = "{station.name}"',
        f'kind = "{station.kind}"',
        f"pose = {_list((station.x, station.y, 0.0))}",
        f"capacity = {station.capacity}",
    ]
    if station.name in new.batches:
        lines.append("batch = true                # all parts in it begin and end together")
    if station.lists_spots:
        lines.append("spots = [                   # where parts stand: x, y, yaw off the pose")
        lines += [f"  {_list((*spot, 0.0))}," for spot in station.spots]
        lines.append("]")
    order = [machine.name for machine in new.machines]
    if station.name in order:
        number = order.index(station.name)
        out = [
            2 * max(abs(spot[axis]) for spot in station.spots) for axis in (0, 1)
        ]  # from the pose to all spots, twice
        edges = (foot + AROUND_PART_M + more for foot, more in zip(new.foot_m, out, strict=True))
        size = (*(round(edge, 3) for edge in edges), MACHINE_HIGH_M)
        lines += [
            f"processing_s = {float(new.machines[number].processing_s)}",
            'body = "box"                # or a URDF or mesh file beside this one; parts stand on top of a box',
            f"size_m = {_list(size)}",
            f"finish = {_list(FINISHES[number % len(FINISHES)])} # the colour of parts that are done here",
        ]
    return "\n".join([*lines, ""])


def _list(numbers: Sequence[float]) -> str:
    return f"[{', '.join(str(round(float(number), 4)) for number in numbers)}]"


_OBSTACLES = """\
# ---- obstacles: remove the # to add one ----------------------------------------------------------------------------
# [[obstacles]]
# name = "tower"
# position_m = [0.5, 0.3]
# cubes = 7                 # stacked, 6 cm each; or size_m = [0.4, 0.02, 0.2] and yaw, for a wall
# area = [0.04, 0.04]       # it stands within +- x, +- y of its position, drawn from the seed
"""

_LEARNING = """\
# ---- how each sub-task is learned ----------------------------------------------------------------------------------

[subtasks.transfer]
rewards = { goal = 1.5, step = -0.1 }
learner = { learner = "dyna-q", alpha = 0.95, discount = 0.99, beta = 1.3, episodes = 200, max_steps = 200 }
gate = { gate = "ccrl", lambda_threshold = 0.05, omega = 7, first_episode = 10, window = 5, by_evidence = true }

[subtasks.grasp]
rewards = { goal = 1.5, step = -0.1 }
learner = { learner = "dyna-q", alpha = 0.95, discount = 0.99, beta = 1.3, episodes = 1500, max_steps = 200 }
gate = { gate = "ccrl", lambda_threshold = 0.05, omega = 7, first_episode = 30, window = 5, by_evidence = true, budget = 1000 }

[subtasks.place]
rewards = { goal = 1.5, step = -0.1 }
learner = { learner = "dyna-q", alpha = 0.95, discount = 0.99, beta = 1.3, episodes = 200, max_steps = 200 }
gate = { gate = "ccrl", lambda_threshold = 0.05, omega = 7, first_episode = 10, window = 5, by_evidence = true, budget = 500 }

# ---- the order of the robot's transfers ----------------------------------------------------------------------------

[sequencing]
method = "srl-time"
episodes = 1000
"""
