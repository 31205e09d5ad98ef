"""What follows from a surveyed skill: its aim, its box, and the bodies that are left in the scene."""

import numpy as np
import pytest

from lab.control.controlled_skill import Aim, controlled_skill
from lab.errors import BadInput
from lab.tasks.task_file import load


@pytest.mark.parametrize(
    ("skill", "aim"),
    [("grasp at plate", Aim.TAKE), ("insert", Aim.SET_DOWN), ("place at finished_plate", Aim.SET_DOWN)],
)
def test_a_skills_aim_follows_from_what_it_carries(skill: str, aim: Aim) -> None:
    own = controlled_skill("toast", skill, 0)
    low, high = own.box
    assert own.aim is aim
    for pose in (own.start, own.goal):
        assert (low <= [pose.x, pose.y, pose.z, pose.yaw]).all()
        assert (high >= [pose.x, pose.y, pose.z, pose.yaw]).all()


def test_the_station_and_what_is_beside_the_way_stay_in_the_scene() -> None:
    task, layout = controlled_skill("toast", "insert", 0).nearby
    assert {"toaster"} <= {station.name for station in task.stations} < {s.name for s in load("toast").stations}
    assert {"cubes A", "cubes B", "cubes C"} <= {obstacle.name for obstacle in task.obstacles}
    assert len(layout.obstacles) == len(task.obstacles)


def test_the_start_and_the_goal_of_the_grasp_are_those_by_hand() -> None:
    """The plate is at (0, 0.8), 1.2 cm high, its first spot 7 cm to the left; slices, 12 cm high, are held 3 cm below their top.

    The table's path leads from a corner, 2.4 cm aside twice and two turns of 0.06 rad aside, 15 cm down.
    """
    own = controlled_skill("toast", "grasp at plate", 0)
    assert (own.goal.x, own.goal.y, own.goal.z) == pytest.approx((-0.07, 0.8, 0.012 + 0.12 - 0.03))
    assert (own.start.x, own.start.y, own.start.z) == pytest.approx((0.0, 0.8, 0.30))
    goal_state = int(np.flatnonzero(own.mdp.goal)[0])
    assert own.path_m == pytest.approx(0.024 + 0.024 + 2 * 0.06 * 0.15 + 0.15)
    assert own.poses[goal_state] == pytest.approx([0.0, 0.0, 0.0, 0.0])


def test_an_unknown_task_or_skill_is_named() -> None:
    with pytest.raises(BadInput, match="unknown skill 'place at mars'"):
        controlled_skill("toast", "place at mars", 0)
