"""Parts on pallets, in physics: taken up with their pallet, lifted off, set down on it; what falls off is said."""

from collections.abc import Callable
from math import hypot
from typing import Any

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.sim.scene.scene import pallet_of
from lab.skills import Grasp, PlacePart, Transfer
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
ON = "rook on pallet"
ROOK, PALLET = "rook 1", "rook 1's pallet"
FLAT = (np.sin(np.pi / 4), 0.0, 0.0, np.cos(np.pi / 4))


@pytest.fixture(scope="module")
def cell(cells: dict[str, Any]) -> Surveys:
    found: Surveys = cells["fms-arm"].surveys
    return found


@pytest.fixture
def ready(cell: Surveys, stage: Stage, optimal: PolicyOf) -> Callable[..., tuple[Bench, Policy]]:
    """A skill set up and put where it begins: ready(skill, off=...)."""

    def make_ready(skill: Skill, **more: object) -> tuple[Bench, Policy]:
        policy = optimal(skill.setup(cell))
        return stage(skill, **more), policy

    return make_ready


Ready = Callable[..., tuple[Bench, Policy]]


def above(bench: Bench, body: str, other: str) -> tuple[float, float]:
    """How far a body is beside another [m], and how far its middle is above the other's [m]."""
    at, under = (bench.scene.world.pose(name)[0] for name in (body, other))
    return hypot(*(at - under)[:2]), float(at[2] - under[2])


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.010, 0.004, 0.06), (-0.010, 0.004, -0.06)])
def test_a_pallet_is_lifted_with_its_part_on_it(
    off: tuple[float, float, float], fms: Task, ready: Ready, run: Run
) -> None:
    grasp = Grasp(fms, ON, "incoming")
    bench, policy = ready(grasp, off=off)
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason
    assert bench.held == PALLET
    assert bench.holds(PALLET)
    beside, high = above(bench, ROOK, PALLET)
    assert beside < 0.003
    assert high == pytest.approx(0.010 + 0.025, abs=1e-3)
    assert bench.upright(ROOK) > 0.999
    assert bench.fallen_off(ROOK, ON) == ""


def test_a_part_is_lifted_off_and_its_pallet_stays(fms: Task, cell: Surveys, ready: Ready, run: Run) -> None:
    grasp = Grasp(fms, "rook", "lathe-1-in")
    bench, policy = ready(grasp, off=(0.008, -0.003, 0.4))
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason
    assert bench.held == ROOK
    spot = cell.places.spots(fms.station("lathe-1-in"))[0]
    assert bench.stands(PALLET, spot, 0.002)
    assert bench.scene.world.pose(ROOK)[0][2] > 0.15


@pytest.mark.parametrize(("kind", "station"), [("rook", "lathe-1-out"), ("sign", "mill-out")])
def test_a_part_is_set_down_on_its_pallet(
    kind: str, station: str, fms: Task, cell: Surveys, ready: Ready, run: Run
) -> None:
    place = PlacePart(fms, kind, station)
    bench, policy = ready(place)
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    name = f"{kind} 1"
    spot = cell.places.spots(fms.station(station))[0]
    assert bench.stands(pallet_of(name), spot, 0.002)
    assert bench.stands(name, spot.raised(0.020), 0.003)
    assert bench.scene.world.touching(name, pallet_of(name))
    assert bench.held is None


def test_a_pallet_that_stands_elsewhere_is_where_its_part_is_set_down(
    fms: Task, cell: Surveys, ready: Ready, run: Run
) -> None:
    """Within what setting it down leaves, 8 mm aside: the rook stands in the pallet's middle, not in the spot's."""
    place = PlacePart(fms, "rook", "lathe-1-out")
    bench, policy = ready(place)
    spot = cell.places.spots(fms.station("lathe-1-out"))[0]
    bench.scene.world.put(PALLET, (spot.x + 0.008, spot.y, spot.z + 0.010))
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    assert above(bench, ROOK, PALLET)[0] < 0.003


def test_a_pallet_is_set_down_with_its_part_and_goes_on_empty(fms: Task, cell: Surveys, ready: Ready, run: Run) -> None:
    for kind, station in ((ON, "lathe-1-in"), ("pallet", "lathe-1-out")):
        place = PlacePart(fms, kind, station)
        bench, policy = ready(place)
        assert run(place, bench, policy) is Status.SUCCESS, place.reason
        assert bench.stands(PALLET, cell.places.spots(fms.station(station))[0], 0.003)
        assert (ROOK in bench.scene.kind_of) is (kind == ON)
        assert bench.fallen_off(ROOK, kind) == ""


def test_a_part_stands_in_a_machine_without_its_pallet(fms: Task, cell: Surveys, ready: Ready, run: Run) -> None:
    place = PlacePart(fms, "sign", "mill")
    bench, policy = ready(place)
    assert "sign 1's pallet" not in bench.scene.kind_of
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    assert bench.stands("sign 1", cell.places.spots(fms.station("mill"))[0], 0.003)


def test_carried_at_the_files_speed_a_part_stays_on_its_pallet(ready: Ready, run: Run) -> None:
    transfer = Transfer("incoming", "lathe-1-in", ON)
    bench, policy = ready(transfer)
    before = above(bench, ROOK, PALLET)[0]
    assert run(transfer, bench, policy) is Status.SUCCESS, transfer.reason
    assert bench.holds(PALLET)
    assert above(bench, ROOK, PALLET)[0] == pytest.approx(before, abs=2e-3)
    assert bench.upright(ROOK) > 0.999


def test_a_part_that_falls_off_on_the_way_is_missed(ready: Ready) -> None:
    transfer = Transfer("incoming", "lathe-1-in", ON)
    bench, policy = ready(transfer)
    transfer.start(bench, policy)
    for step in range(10_000):
        if step == 100:
            bench.scene.world.put(ROOK, (0.6, 0.2, 0.03), FLAT)
        if transfer.step() is not Status.RUNNING:
            break
        bench.scene.world.step()
    assert transfer.status is Status.FAILURE
    assert transfer.reason == "rook 1 has fallen off rook 1's pallet on the way to 'lathe-1-in'"
    assert bench.holds(PALLET)


def test_a_part_that_falls_off_as_its_pallet_is_set_down_is_missed(fms: Task, ready: Ready) -> None:
    place = PlacePart(fms, ON, "lathe-1-in")
    bench, policy = ready(place)
    place.start(bench, policy)
    while place.step() is Status.RUNNING:
        bench.scene.world.step()
        if bench.held is None:
            bench.scene.world.put(ROOK, (0.6, 0.2, 0.03), FLAT)
    assert place.status is Status.FAILURE
    assert place.reason == "rook 1 does not stand on rook 1's pallet at 'lathe-1-in'"
    assert bench.fallen_off(ROOK, "rook") == ""  # alone it is carried on nothing
