"""What stands at a station: slabs, boxes, URDFs and meshes, in their place, and as large as they are said to be."""

from collections.abc import Callable
from math import pi
from pathlib import Path

import pytest
import trimesh

from lab.errors import BadInput
from lab.sim.scene.scene_check import places_of
from lab.sim.scene.station_bodies import bounds, build
from lab.sim.world import World
from lab.tasks.task import Task
from lab.tasks.task_fields import Station

Moved = Callable[..., Task]
NO_SLAB = (0.1, 0.1, 0.1), (0.0, 0.0, -5.0)


def machine(**fields: object) -> Station:
    given = {"name": "press", "kind": "machine", "pose": (0.5, 0.2, 0.0), "capacity": 1, "processing_s": 1.0}
    return Station.model_validate({**given, **fields})


@pytest.fixture
def wedge(tmp_path: Path) -> Path:
    """A folder with a mesh, 20 cm long, 10 cm wide and 6 cm high, whose origin is in the middle of its left end, below."""
    box = trimesh.creation.box((0.2, 0.1, 0.06))
    box.apply_translation((0.1, 0.0, 0.03))
    box.export(tmp_path / "wedge.obj")
    box.export(tmp_path / "wedge.stl")
    return tmp_path


def top(world: World, x: float, y: float) -> float | None:
    """How high what stands there is [m], as a ray straight down meets it; None: nothing does."""
    hit = world.ray((x, y, 0.5), (x, y, -0.5))
    return None if hit is None else float(hit[1][2])


@pytest.mark.parametrize("body", ["slab", "box"])
def test_slabs_and_boxes_have_their_size_turned_as_the_station(world: World, body: str) -> None:
    station = machine(body=body, size_m=(0.3, 0.1, 0.06), pose=(0.5, 0.2, pi / 2))
    build(world, station, ((0.3, 0.1, 0.06), (0.5, 0.2, 0.03)), Path())
    assert top(world, 0.5, 0.2 + 0.149) == pytest.approx(0.06)
    assert top(world, 0.5, 0.2 + 0.151) is None
    assert top(world, 0.5 + 0.049, 0.2) == pytest.approx(0.06)
    assert top(world, 0.5 + 0.051, 0.2) is None


@pytest.mark.parametrize("file", ["wedge.obj", "wedge.stl"])
def test_a_mesh_stands_with_its_origin_at_the_stations_pose(world: World, wedge: Path, file: str) -> None:
    station = machine(body=file, floor_m=0.06, pose=(0.5, 0.2, pi / 2))
    build(world, station, NO_SLAB, wedge)
    assert top(world, 0.5, 0.2 + 0.199) == pytest.approx(0.06, abs=1e-4)
    assert top(world, 0.5, 0.2 - 0.001) is None
    low, high = bounds(station, wedge)
    assert low == pytest.approx((0.0, -0.05, 0.0))
    assert high == pytest.approx((0.2, 0.05, 0.06))


def test_a_urdf_of_the_labs_own_is_found_where_the_folder_has_none(world: World, tmp_path: Path) -> None:
    station = machine(body="toaster.urdf", floor_m=0.015)
    build(world, station, NO_SLAB, tmp_path)
    low, high = bounds(station, tmp_path)
    assert low[:2] == pytest.approx((-0.1, -0.065))
    assert high[:2] == pytest.approx((0.1, 0.065))
    assert top(world, 0.5, 0.2) == pytest.approx(0.015, abs=1e-4)  # the slot's bottom


def test_the_appliers_ground_is_as_large_as_its_body(task: Task, world: World) -> None:
    """The corners of what is kept free are the body's own: a ray 2 mm inside meets it, 2 mm outside it does not."""
    station = task.station("butter_applier")
    build(world, station, NO_SLAB, task.folder)
    world.step()
    ground = places_of(task).body(station, 1)
    for side_x, side_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        for inside in (True, False):
            off = 0.002 if inside else -0.002
            x = ground.x + side_x * (ground.half_along - off)
            y = ground.y + side_y * (ground.half_across - off)
            assert (top(world, x, y) is not None) is inside


def test_a_comment_in_latin_1_is_no_fault(wedge: Path) -> None:
    path = wedge / "wedge.obj"
    before = bounds(machine(body=path.name, floor_m=0.1), wedge)
    (wedge / "other.obj").write_bytes("# Prüfteil\n".encode("latin-1") + path.read_bytes())
    assert bounds(machine(body="other.obj", floor_m=0.1), wedge) == before


def test_a_body_that_is_no_file_of_these_is_refused(tmp_path: Path) -> None:
    (tmp_path / "press.step").write_text("solid")
    station = machine(body="press.step", floor_m=0.1)
    with pytest.raises(
        BadInput,
        match=r"^station 'press': body = 'press\.step': wanted 'slab', 'box', or a \.urdf, \.obj or \.stl file$",
    ):
        bounds(station, tmp_path)


def test_a_body_from_a_file_needs_its_floor(wedge: Path) -> None:
    with pytest.raises(
        BadInput, match=r"^station 'press': floor_m is missing: how high parts stand in or on 'wedge\.obj'$"
    ):
        bounds(machine(body="wedge.obj"), wedge)


@pytest.mark.parametrize("file", ["press.obj", "../press.obj"])
def test_a_body_that_is_not_there_or_outside_is_refused(tmp_path: Path, file: str) -> None:
    with pytest.raises(BadInput, match=rf"^station 'press': body = '{file}'"):
        bounds(machine(body=file, floor_m=0.1), tmp_path)


def test_bounds_are_of_the_file_as_it_stands_turned_by_nothing(wedge: Path) -> None:
    straight, turned = (
        bounds(machine(body="wedge.stl", floor_m=0.06, pose=(1.0, 1.0, yaw)), wedge) for yaw in (0.0, 2.0)
    )
    assert straight == turned
