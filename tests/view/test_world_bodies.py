"""A grid world's bodies: obstacles, a way as a tube, the limited view, the axes' names."""

from collections.abc import Callable
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.mdp import FloatArray, shortest_path
from lab.sim.frames import Body, Recording, Shape, Viewpoint
from lab.tasks.grid_world import GridWorld, random_world
from lab.tasks.task_file import load_world
from lab.view.scene_data import describe
from lab.view.world_bodies import MOST_OBSTACLES, WORLD_M, WorldBodies

InPicture = Callable[[Viewpoint, FloatArray], bool]  # the fixture of tests/conftest.py
SMALL = GridWorld(name="small", shape=(2, 3), start=(0, 0), goal=(1, 2), obstacles=((0, 1),))
# S # .
# . . G
shapes = st.lists(st.integers(1, 7), min_size=2, max_size=3).filter(lambda shape: np.prod(shape) >= 4)
worlds = st.builds(random_world, shapes, st.sampled_from([0.0, 0.1, 0.3]), st.integers(0, 99))


def still(world: GridWorld) -> Recording:
    """The world with its shortest way."""
    mdp = world.mdp()
    with closing(WorldBodies(world)) as drawn:
        return drawn.still([mdp.state_cell(state) for state in shortest_path(mdp)])


def body(recording: Recording, name: str) -> Body:
    return next(body for body in recording.bodies if body.name == name)


def test_the_way_of_a_board_by_hand() -> None:
    """Down by a cell of 2/3 m and right by two: two tubes, a ball where they meet, a larger one at the start."""
    cell = WORLD_M / 3
    turn, start, down, right = body(still(SMALL), "shortest path").shapes
    assert [shape.kind for shape in (turn, start, down, right)] == ["sphere", "sphere", "cylinder", "cylinder"]
    assert turn.position == pytest.approx((-cell, -cell / 2, cell / 2))
    assert start.position == pytest.approx((-cell, cell / 2, cell / 2))
    assert start.size[0] > turn.size[0]
    assert [down.size[1], *down.position] == pytest.approx([cell, -cell, 0.0, cell / 2])
    assert [right.size[1], *right.position] == pytest.approx([2 * cell, 0.0, -cell / 2, cell / 2])
    assert down.quaternion == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5))  # z turned onto the y axis
    assert right.quaternion == pytest.approx((0.0, 0.5**0.5, 0.0, 0.5**0.5))  # and onto the x axis


@given(world=worlds)
def test_the_tubes_are_as_long_as_the_way_and_all_is_in_the_picture(in_picture: InPicture, world: GridWorld) -> None:
    recording = still(world)
    recording.check()
    size = WORLD_M / max(world.shape)
    tubes = [shape for shape in body(recording, "shortest path").shapes if shape.kind == "cylinder"]
    assert sum(tube.size[1] for tube in tubes) == pytest.approx(size * (len(shortest_path(world.mdp())) - 1))
    points = np.array([shape.position for body in recording.bodies for shape in body.shapes])
    assert in_picture(recording.camera, points)


def test_the_axes_are_named_where_they_point_to() -> None:
    named = {shape.text: shape.position for shape in body(still(load_world("world-1")), "axes").shapes}
    half = WORLD_M / 2
    assert {*named} == {"x", "y", "z"}
    assert named["x"][0] == pytest.approx(half)
    assert named["x"][1] < -half
    assert named["y"][0] > half
    assert named["y"][1] == pytest.approx(half)
    assert named["z"][2] == pytest.approx(WORLD_M)
    assert {shape.text for shape in body(still(SMALL), "axes").shapes} == {"row", "column"}


def test_the_limited_view_of_world_1_is_a_box_of_its_cells() -> None:
    """Cells 5..9, 2..8 and 2..7 of 0.2 m."""
    (box,) = body(still(load_world("world-1")), "limited view").shapes
    assert box.size == pytest.approx((1.0, 1.4, 1.2))
    assert box.position == pytest.approx((0.5, 0.1, 1.0))
    assert "limited view" not in {body.name for body in still(SMALL).bodies}


def boxes_of(shape: Shape) -> FloatArray:
    """The middles (n, 3) of the boxes in a mesh file of boxes that do not touch."""
    import trimesh

    mesh = trimesh.load(shape.mesh, force="mesh")
    assert isinstance(mesh, trimesh.Trimesh)
    corners: FloatArray = np.asarray(mesh.triangles, dtype=np.float64).reshape(-1, 36, 3)
    return np.asarray((corners.min(axis=1) + corners.max(axis=1)) / 2)


def test_hundreds_of_obstacles_are_one_mesh_that_goes_with_the_scene() -> None:
    world = random_world((60, 50), 0.3, 1)
    with closing(WorldBodies(world)) as boxes:
        (body,) = (body for body in boxes.bodies if body.name == "obstacles")
        (shape,) = body.shapes
        expected = boxes.centres(world.obstacles)
        found = boxes_of(shape)
        assert len(found) == len(world.obstacles) == 900
        assert found[:, :2] == pytest.approx(expected[:, :2], abs=1e-6)
        assert len(boxes.bodies) < 70
        assert len(describe(boxes.bodies, boxes.camera())["geometries"]) < 20
        assert shape.mesh is not None
        assert shape.mesh.is_file()
    assert not shape.mesh.exists()
    boxes.close()  # safe to call again


def test_of_too_many_obstacles_in_a_room_those_near_the_shortest_ways_are_drawn() -> None:
    world = random_world((20, 20, 20), 0.25, 3)
    assert len(world.obstacles) > MOST_OBSTACLES[3]
    ends = np.array([world.start, world.goal])
    detours = np.abs(np.array(world.obstacles)[:, None] - ends).sum(axis=(1, 2))
    with closing(WorldBodies(world)) as boxes:
        (body,) = (body for body in boxes.bodies if body.name == "obstacles")
        found = boxes_of(body.shapes[0])
        size, middle = WORLD_M / 20, np.array([9.5, 9.5, -0.5])
        cells = np.round(found / size + middle)
        drawn = np.abs(cells[:, None] - ends).sum(axis=(1, 2))
        assert len(found) == boxes.drawn == MOST_OBSTACLES[3]
        assert sorted(drawn.tolist()) == sorted(detours.tolist())[: len(found)]
