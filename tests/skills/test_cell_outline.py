"""A task's cell from above: what stands where, also of a task that a check refuses."""

from math import hypot

import numpy as np
import pytest

from lab.skills.cell_outline import outline
from lab.tasks.task import Task
from lab.tasks.task_file import load

TOAST = load("toast")


def with_station(name: str, **fields: object) -> Task:
    stations = tuple(s.model_copy(update=fields) if s.name == name else s for s in TOAST.stations)
    return TOAST.model_copy(update={"stations": stations})


def with_obstacle(name: str, **fields: object) -> Task:
    obstacles = tuple(o.model_copy(update=fields) if o.name == name else o for o in TOAST.obstacles)
    return TOAST.model_copy(update={"obstacles": obstacles})


def test_the_toast_cell() -> None:
    plan = outline(TOAST, 3, 0)
    assert (plan.title, plan.fault, plan.at_fault) == ("Toast making with one robot", "", frozenset())
    assert plan.height_m == pytest.approx(0.30)
    assert plan.reach is not None
    assert plan.reach.nearest_m == pytest.approx(0.36, abs=1e-3)
    stations = {station.name: station for station in plan.stations}
    assert [*stations] == [station.name for station in TOAST.stations]
    assert {name: len(station.spots) for name, station in stations.items()} == {
        s.name: s.capacity for s in TOAST.stations
    }
    plate = stations["plate"]
    assert sum(spot.used for spot in plate.spots) == 4
    assert all(spot.reached for spot in plate.spots)
    assert (stations["toaster"].body.x, stations["toaster"].body.y) == (0.975, 0.175)
    assert (stations["toaster"].body.length, stations["toaster"].body.width) == (0.2, 0.13)
    tower = next(obstacle for obstacle in plan.obstacles if obstacle.name == "tower left")
    assert (tower.stays_in.length, tower.stays_in.width) == pytest.approx((0.14, 0.14))  # 0.06 and 0.04 to both sides
    assert np.all(tower.stands.corners() <= tower.stays_in.corners().max(axis=0) + 1e-9)
    assert np.all(tower.stands.corners() >= tower.stays_in.corners().min(axis=0) - 1e-9)
    assert plan.blocked is not None
    assert {"", "out of reach", "tower left", "cubes A"} <= {*np.unique(plan.blocked.causes)}
    assert {approach.station for approach in plan.approaches} == {*stations, "insert"}
    assert [camera.start for camera in plan.cameras] == [(0.575, -0.225)]
    assert all(approach.dock and hypot(*np.subtract(approach.dock, approach.at)) < 0.2 for approach in plan.approaches)


def test_another_seed_moves_obstacles_within_their_areas_only() -> None:
    one, other = outline(TOAST, 3, 0), outline(TOAST, 3, 1)
    assert [o.stays_in for o in one.obstacles] == [o.stays_in for o in other.obstacles]
    assert all(a.stands != b.stands for a, b in zip(one.obstacles, other.obstacles, strict=True))


def test_a_station_out_of_reach_is_drawn_with_its_spot_marked() -> None:
    far = with_station("butter_applier", pose=(1.3, -0.62, 0.0))
    plan = outline(far, None, 0, "station 'butter_applier' is out of reach: its spot at (1.30, -0.62) m")
    assert plan.at_fault == {"butter_applier"}
    lost = {s.name for s in plan.stations if not all(spot.reached for spot in s.spots)}
    assert lost == {"butter_applier"}
    assert [approach.station for approach in plan.approaches if approach.dock is None] == ["butter_applier"]


def test_of_parts_that_cannot_be_gripped_what_is_known_is_drawn() -> None:
    """Without a grip there are no spots; the reach and the obstacles are there."""
    parts = tuple(part.model_copy(update={"size_m": (0.12, 0.06, 0.12)}) for part in TOAST.parts)
    plan = outline(TOAST.model_copy(update={"parts": parts}), None, 0)
    assert [station.name for station in plan.stations] == [station.name for station in TOAST.stations]
    assert not any(station.spots for station in plan.stations)
    assert (plan.reach, plan.blocked is None) == (outline(TOAST, None, 0).reach, True)
    assert len(plan.obstacles) == len(TOAST.obstacles)


def test_an_obstacle_on_a_station_is_drawn_where_the_file_has_it() -> None:
    plan = outline(with_obstacle("tower right", position_m=(0.42, -0.52)), None, 0)
    tower = next(obstacle for obstacle in plan.obstacles if obstacle.name == "tower right")
    assert (tower.stands.x, tower.stands.y) == (0.42, -0.52)
    assert [approach.station for approach in plan.approaches if approach.dock is None] == ["butter_buffer"]


@pytest.mark.parametrize(
    ("fault", "named"),
    [
        ("the goal is enclosed by: cubes A, tower left", {"cubes A", "tower left"}),
        ("station 'toaster_buffer' is out of reach", {"toaster_buffer"}),  # and not the toaster
        ("transfer plate to insert with slice: no path", {"plate"}),
        ("robot.speed_m_s: too fast", set()),
    ],
)
def test_what_a_fault_names_is_at_fault(fault: str, named: set[str]) -> None:
    assert outline(TOAST, 1, 0, fault).at_fault == named
