"""Random cells with every feature of a task file, laid out as an engineer would do after reading the documentation.

Stations are placed around the arm, and the sizes of machines and workspace are computed from the parts, until all stations
are apart and within reach. Nothing else is checked; a cell without such a layout keeps the last one.
"""

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from math import ceil, cos, floor, hypot, sin
from pathlib import Path
from typing import Any

import numpy as np

from devtools.drawn_features import FEATURES, DrawnCell, evenly
from devtools.drawn_parts import DrawnPart, Rng, Table, drawn_part
from lab.errors import BadInput
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import beside
from lab.sim.scene.ground_plan import ring_of
from lab.sim.scene.places import Places
from lab.sim.scene.scene_check import check_apart, places_of
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.task import Task
from lab.tasks.task_file import task_of_text

ARMS = ("up6", "up6", "panda", "iiwa", "xarm6")
CELL_M = {"up6": 0.12, "panda": 0.08, "iiwa": 0.1, "xarm6": 0.08}  # the edge of the workspace's grid cells
FOOT_UP_M = {"xarm6": 0.15}  # the base of a low arm is raised
SPEED_M_S, ACCELERATION_M_S2 = (0.15, 0.8), (0.5, 4.0)  # drawn log-uniformly
PROCESSING_S, MACHINE_HIGH_M = (3.0, 40.0), (0.03, 0.09)
FINGERS_M = 0.016  # how far the fingers open beyond the widest part
BODY_M = 0.06  # how far a machine's body reaches beyond its parts
EDGE_M, OVER_M = 0.03, 0.015  # the edge of the reach that is not used; the clearance over what stands
TURNS, SHARES = (75, 60, 90, 105), (0.45, 0.55, 0.35, 0.65, 0.75)
TRIES = 24  # the most layouts that are tried


def drawn_cell(rng: Rng, folder: Path) -> tuple[str, str]:
    """The text of a random task file, and its features in words; its meshes are written to `folder`."""
    arm = str(rng.choice(ARMS))
    opening_m = arm_of(RobotSettings(model=arm, start="in")).gripper.opening_m
    kinds = int(rng.choice([1, 1, 2, 3]))
    parts = [drawn_part(rng, number, opening_m, folder) for number in range(1, kinds + 1)]
    for part in parts:
        part.table["count"] = int(rng.integers(1, 4 if kinds < 3 else 3))
    cell = _through_machines(rng, arm, parts)
    for name, (share, add) in FEATURES.items():
        if rng.random() < share and add(cell):
            cell.features.append(name)
    cell.features = [cell.robot["model"], *(part.form for part in parts), *cell.features]
    text = laid_out(cell, folder / "drawn.toml")
    return text, ", ".join(cell.features)


def _through_machines(rng: Rng, arm: str, parts: list[DrawnPart]) -> DrawnCell:
    """A cell whose parts go from one storage through machines to another."""
    count = sum(part.table["count"] for part in parts)
    machines = [f"machine-{number}" for number in range(1, 1 + int(rng.choice([0, 1, 1, 2])))]
    stations: dict[str, Table] = {"in": {"kind": "storage", "capacity": count}}
    for name in machines:
        seconds = round(float(rng.uniform(*PROCESSING_S)), 1)
        high = round(float(rng.uniform(*MACHINE_HIGH_M)), 3)
        stations[name] = {"kind": "machine", "capacity": 1, "processing_s": seconds, "high_m": high}
    stations["out"] = {"kind": "storage", "capacity": count}
    speeds = {"speed_m_s": evenly(rng, SPEED_M_S), "acceleration_m_s2": evenly(rng, ACCELERATION_M_S2)}
    robot = {"model": arm, "start": "in", **speeds}
    if arm in FOOT_UP_M:
        robot["base_up_m"] = FOOT_UP_M[arm]
    return DrawnCell(rng, parts, robot, stations, ["in", *machines, "out"])


# ---- layout -----------------------------------------------------------------------------------------------------------


def laid_out(cell: DrawnCell, path: Path) -> str:
    """The file's text with the first layout whose stations are apart and within reach, else with the last one."""
    text = ""
    for poses in layouts(cell):
        text = cell_text(cell, poses, None)
        try:
            text = cell_text(cell, poses, places_of(task_of_text(path, text)))
            if _is_fit(task_of_text(path, text)):
                break
        except BadInput:
            continue
    return text


def layouts(cell: DrawnCell) -> Iterator[dict[str, list[float]]]:
    """Poses of the stations, a layout at a time: on an arc around the arm in the order of the route; a furnace has one layout."""
    if "furnace" in cell.stations:
        out = float(cell.rng.uniform(0.55, 0.65))
        yield {"in": [out, -0.5, 0.0], "furnace": [0.95, 0.0, 0.0], "out": [out, 0.5, 0.0]}
        return
    arm = _arm(cell)
    rings = [ring_of(arm.inverse, high, arm.nearest_m) for high in (0.04, 0.3)]
    if any(ring is None for ring in rings):
        return
    nearest = max(ring.nearest_m for ring in rings if ring) + EDGE_M
    farthest = min(ring.farthest_m for ring in rings if ring) - EDGE_M
    turned, names = cell.rng.random() < 0.4, list(cell.stations)
    names.sort(key=lambda name: _along(cell, name))
    ways = list(product(TURNS, SHARES, (0.0, 0.25)))
    for number in cell.rng.permutation(len(ways))[:TRIES]:
        degrees, share, zigzag = ways[int(number)]
        poses = {}
        for at, name in enumerate(names):
            angle = np.radians(degrees) * (1 - 2 * at / (len(names) - 1))
            far = nearest + min(1.0, max(0.0, share + (zigzag if at % 2 else -zigzag))) * (farthest - nearest)
            yaw = round(angle, 3) if turned else 0.0
            poses[name] = [round(far * cos(angle), 3), round(far * sin(angle), 3), yaw]
        yield poses


def _along(cell: DrawnCell, name: str) -> tuple[float, str]:
    """The position of a station along the route, and its name; a buffer comes just before its machine."""
    for at, own in enumerate(cell.route):
        table = cell.stations[own]
        if name == table.get("buffer"):
            return at - 0.5, name
        if name in table.get("parallel", [own]):
            return float(at), name
    return float(len(cell.route)), name


def _arm(cell: DrawnCell) -> Arm:
    return arm_of(RobotSettings.model_validate(cell.robot))


def _is_fit(task: Task) -> bool:
    """Whether the arm reaches all spots and the points above them. Raises BadInput if stations overlap."""
    check_apart(task, len(task.order()))
    arm, places = arm_of(task.robot, task.folder), places_of(task)
    above = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    for station in task.stations:
        for kind in places.kinds_at(station.name):
            for spot in places.spots(station, kind.name):
                pose = kind.held_at(spot)
                if any(arm.inverse(ToolPose(pose.x, pose.y, z, pose.yaw)) is None for z in (pose.z, above)):
                    return False
    return True


def cell_text(cell: DrawnCell, poses: dict[str, list[float]], places: Places | None) -> str:
    """The file's text with stations at `poses`; sizes that follow from the parts are computed if `places` is known."""
    parts = [{**part.table, "routes": cell.routes()} for part in cell.parts]
    parts += [cell.more["pallet"]] if "pallet" in cell.more else []
    stations = [_station(cell, name, poses[name], places) for name in cell.stations]
    robot = dict(cell.robot)
    if places is not None:
        widest = max(kind.grip.width_m for kind in places.kinds.values())
        most = _arm(cell).gripper.opening_m
        robot |= {"opening_m": round(widest + FINGERS_M, 4)} if widest + FINGERS_M < most else {}
    more = {name: table for name, table in cell.more.items() if name != "pallet"}
    if "obstacles" in more:
        more["obstacles"] = [{**obstacle, "position_m": _midway(poses)} for obstacle in more["obstacles"]]
    workspace = _workspace(cell, poses, places)
    tables = {"robot": robot, "parts": parts, "workspace": workspace, "stations": stations, **more}
    return "\n".join(['name = "drawn"', "", *_lines(tables)])


def _midway(poses: dict[str, list[float]]) -> list[float]:
    """The point (x, y) [m] between the two neighbouring stations that are farthest apart, moved outwards a little."""
    at = list(poses.values())
    here, there = max(pairwise(at), key=lambda pair: hypot(pair[0][0] - pair[1][0], pair[0][1] - pair[1][1]))
    return [round(0.55 * (a + b), 3) for a, b in zip(here[:2], there[:2], strict=True)]


def _station(cell: DrawnCell, name: str, pose: list[float], places: Places | None) -> Table:
    own = cell.stations[name]
    keys = ("kind", "capacity", "processing_s", "process", "at_most_s", "places", "body", "floor_m", "approach")
    table = {"name": name, "pose": pose, **{key: own[key] for key in keys if key in own}}
    if "high_m" not in own:
        return table
    length, width = (0.2, 0.2) if places is None else _fitted(places, name, pose)
    return table | {
        "body": "box",
        "size_m": [round(length + own.get("ahead_m", 0.0), 3), round(width, 3), own["high_m"]],
    }


def _fitted(places: Places, name: str, pose: Sequence[float]) -> tuple[float, float]:
    """Length and width [m] of a body that lies below all spots of a station and BODY_M beyond."""
    reach = [0.0, 0.0]
    for kind in places.kinds_at(name):
        for spot in places.spots(places.task.station(name), kind.name):
            off, foot = beside((0.0, 0.0), -pose[2], (spot.x - pose[0], spot.y - pose[1])), kind.footprint_m()
            reach = [max(most, abs(at) + own) for most, at, own in zip(reach, off, foot, strict=True)]
    return 2 * reach[0] + BODY_M, 2 * reach[1] + BODY_M


def _workspace(cell: DrawnCell, poses: dict[str, list[float]], places: Places | None) -> Table:
    """The workspace's grid above all stations, as low as carried parts clear the stations."""
    if "furnace" in cell.stations:
        return {"lower_m": [0.36, -0.8, 0.34], "cell_m": [0.08] * 3, "shape": [8, 20, 2]}
    edge = CELL_M[str(cell.robot["model"])]
    low = 0.3
    if places is not None:
        top = max(places.top_m(station) for station in places.task.stations)
        low = top + OVER_M + max(kind.grip.up_m for kind in places.kinds.values())
    lower, shape = [], []
    for axis in (0, 1):
        at = [pose[axis] for pose in poses.values()] + ([0.5] if axis == 0 else [])
        first, last = floor((min(at) - edge) / edge), ceil((max(at) + edge) / edge)
        lower.append(round(first * edge, 3))
        shape.append(last - first)
    return {"lower_m": [*lower, ceil(1000 * (low - edge / 2)) / 1000], "cell_m": [edge] * 3, "shape": [*shape, 3]}


# ---- TOML -------------------------------------------------------------------------------------------------------------


def _lines(tables: Table) -> Iterator[str]:
    for name, table in tables.items():
        for entry in table if isinstance(table, list) else [table]:
            yield f"[[{name}]]" if isinstance(table, list) else f"[{name}]"
            yield from (f"{key} = {_value(value)}" for key, value in entry.items())
            yield ""


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(_value(inner) for inner in value)}]"
    return json.dumps(value)
