"""The scene of an episode: what is drawn, and what physics says of the part."""

from collections.abc import Iterator
from math import hypot

import numpy as np
import pytest

from lab.control.control_scene import LIFTED_M, ControlScene
from lab.control.controlled_skill import GOAL_RANGE, START_RANGE, controlled_skill


@pytest.fixture(scope="module")
def place() -> Iterator[ControlScene]:
    scene = ControlScene(controlled_skill("toast", "place at finished_plate", 0))
    yield scene
    scene.close()


def test_starts_and_places_are_within_their_ranges(place: ControlScene) -> None:
    own = place.skill
    for seed in range(3):
        place.begin(np.random.default_rng(seed))
        off = [place.start.x - own.start.x, place.start.y - own.start.y, place.start.z - own.start.z]
        assert (np.abs([*off, place.start.yaw - own.start.yaw]) <= START_RANGE).all()
        assert abs(place.goal.yaw - own.goal.yaw) <= GOAL_RANGE[2]
        assert hypot(place.goal.x - own.goal.x, place.goal.y - own.goal.y) < 0.035  # 2 cm each way, and the turn
        assert place.holds(place.robot.tool())
        assert place.is_fresh


def test_the_station_is_moved_with_its_spot(place: ControlScene) -> None:
    """The spot stays where it was on the slab."""
    local = []
    for seed in range(2):
        place.begin(np.random.default_rng(seed))
        position, turn = place.world.pose("finished_plate")
        yaw = 2 * np.arctan2(turn[2], turn[3])
        off = complex(place.spot.x - position[0], place.spot.y - position[1]) * np.exp(-1j * yaw)
        local.append([off.real, off.imag, place.spot.yaw - yaw])
    assert local[0] == pytest.approx(local[1])


def test_a_part_released_where_it_is_said_stands_in_its_place(place: ControlScene) -> None:
    """The tool is put at the release pose without physics; then the fingers open, and the tool rises."""
    place.begin(np.random.default_rng(0))
    pose = place.release_pose(place.robot.tool())
    assert not place.stands()
    assert place.robot.stand(pose)
    place.scene.put(place.name, place.kind, pose)
    for _ in place.robot.release():
        place.world.step()
    assert place.stands()
    assert not place.is_done(place.robot.tool())  # the fingers are still beside it
    place.robot.stand(pose.shifted(dz=LIFTED_M + 0.01))
    for _ in range(10):
        place.world.step()
    assert place.is_done(place.robot.tool())
