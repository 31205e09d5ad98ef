"""Around one part: the problem that grasp and place share, where its episodes begin, and where the tool comes in."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.mdp import grid
from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.places import Layout
from lab.skills import Grasp, PlacePart
from lab.skills.around_part import SIDEWAYS, entry_cell, from_above, nearest_start
from lab.skills.grasp import ACTIONS
from lab.skills.surveys import NEAR_SHAPE, Surveys, near_pose
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle

ORDER = ("slice", "slice")


def test_every_station_that_is_picked_from_has_the_same_problem_when_its_surroundings_are(surveys: Surveys) -> None:
    """A policy learned at one buffer serves at another: the table is relative to the slice."""
    one, other = (
        Grasp(surveys.task, "slice", place).setup(surveys).mdp for place in ("toaster_buffer", "butter_buffer")
    )
    assert one.signature == other.signature
    assert one.action_labels == ACTIONS


def test_episodes_begin_anywhere_free_on_the_highest_level() -> None:
    blocked = np.zeros((2, 2, NEAR_SHAPE[2]), dtype=bool)
    blocked[1, 1, -1] = True
    top = NEAR_SHAPE[2] - 1
    mdp = from_above(grid(blocked.shape, blocked, (0, 0, top), (1, 0, 0)))
    assert [mdp.state_cell(s) for s in mdp.starts] == [(0, 0, top), (0, 1, top), (1, 0, top)]


def test_the_tool_enters_by_the_nearest_free_cell_where_the_one_below_it_is_blocked() -> None:
    top = NEAR_SHAPE[2] - 1
    blocked = np.zeros((3, 1, NEAR_SHAPE[2]), dtype=bool)
    blocked[0, 0, -1] = True
    mdp = from_above(grid(blocked.shape, blocked, (1, 0, top), (2, 0, 0)))
    for cell, entry in (((0, 0, top), (1, 0, top)), ((2, 0, top), (2, 0, top))):
        assert mdp.state_cell(nearest_start(mdp, cell)) == entry


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2, 1.5])
@pytest.mark.parametrize("cell", [(0, 0, 5, 0), (2, 2, 5, 2), (4, 1, 5, 3), (1, 3, 5, 4)])
def test_the_entry_is_the_cell_above_which_the_tool_is(yaw: float, cell: tuple[int, int, int, int]) -> None:
    goal = ToolPose(0.4, -0.3, 0.1, yaw)
    assert entry_cell(goal, near_pose(goal, cell)) == cell
    turned = near_pose(goal, cell).shifted(dyaw=np.pi)  # the fingers are alike
    assert entry_cell(goal, turned) == cell


def test_from_far_away_the_entry_is_at_the_grids_border() -> None:
    goal = ToolPose(0.4, -0.3, 0.1, 0.0)
    top = NEAR_SHAPE[2] - 1
    assert entry_cell(goal, ToolPose(2.0, -0.3, 0.5, 0.0)) == (NEAR_SHAPE[0] - 1, 2, top, 2)
    assert entry_cell(goal, ToolPose(0.4, -2.0, 0.5, -0.3)) == (2, 0, top, 0)


def test_obstacles_elsewhere_do_not_change_the_problem(task: Task, surveys: Surveys) -> None:
    bare = Surveys(task.changed(obstacles=()), ORDER, Layout((), ()))
    assert (
        Grasp(surveys.task, "slice", "plate").setup(bare).mdp.signature
        == Grasp(surveys.task, "slice", "plate").setup(surveys).mdp.signature
    )


def test_no_room_beside_the_slice_is_bad_input_that_names_what_is_in_the_way(task: Task) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    near = Obstacle(name="pillar", position_m=(x, y - 0.06), cubes=3)
    surveys = Surveys(task.changed(obstacles=(near,)), ORDER, Layout((near.position_m,), ()))
    for skill in (Grasp(surveys.task, "slice", "toaster_buffer"), PlacePart(surveys.task, "slice", "toaster_buffer")):
        with pytest.raises(
            BadInput, match=rf"^{skill.name}: no room for gripper and part; in the way: pillar: move that, or say spots"
        ):
            skill.setup(surveys)


def test_a_station_in_its_own_way_is_not_told_to_be_moved(task: Task, layout: Layout) -> None:
    """A box with its floor below its rim: the part would stand inside, and moves with the station."""
    own = {"body": "box", "size_m": (0.3, 0.3, 0.12), "floor_m": 0.02}
    stations = tuple(s.model_copy(update=own) if s.name == "toaster_buffer" else s for s in task.stations)
    surveys = Surveys(task.changed(stations=stations), ORDER, layout)
    for skill in (Grasp(surveys.task, "slice", "toaster_buffer"), PlacePart(surveys.task, "slice", "toaster_buffer")):
        with pytest.raises(BadInput) as told:
            skill.setup(surveys)
        assert str(told.value) == (
            f"{skill.name}: no room for gripper and part; in the way: toaster_buffer itself: "
            "change its body, size_m, floor_m, spots or approach, or let the fingers open less (opening_m)"
        )


def test_a_pillar_at_one_side_leaves_the_other_side_to_begin_from(task: Task) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    near = Obstacle(name="pillar", position_m=(x, y - 0.105), cubes=6)
    surveys = Surveys(task.changed(obstacles=(near,)), ORDER, Layout((near.position_m,), ()))
    mdp = Grasp(surveys.task, "slice", "toaster_buffer").setup(surveys).mdp
    assert mdp.terminal[int(np.ravel_multi_index((0, 0, NEAR_SHAPE[2] - 1, 0), mdp.shape))]
    assert mdp.start in mdp.starts


def test_from_the_side_the_tool_comes_straight_in() -> None:
    """Wherever it is aside or above, it enters on the middle of the outermost level, at the yaw that is nearest."""
    goal = ToolPose(0.4, -0.3, 0.1, 0.0)
    assert entry_cell(goal, ToolPose(0.25, -0.32, 0.3, 0.06), from_the_side=True) == (2, 2, NEAR_SHAPE[2] - 1, 3)


def test_from_the_side_the_moves_are_called_as_they_go(task: Task, layout: Layout) -> None:
    """What is left and right of a part from above is lower and higher from the side; down is in and up is out."""
    stations = tuple(
        s.model_copy(update={"approach": "side"}) if s.name == "toaster_buffer" else s for s in task.stations
    )
    robot = task.robot.model_copy(update={"tool": "hanging"})
    surveys = Surveys(task.changed(stations=stations, robot=robot), ORDER, layout)
    mdp = Grasp(surveys.task, "slice", "toaster_buffer").setup(surveys).mdp
    assert mdp.action_labels == tuple(SIDEWAYS.get(action, action) for action in ACTIONS)
    assert mdp.action_labels[:6] == ("lower", "higher", "backward", "forward", "in", "out")


def test_kinds_are_named_where_there_are_several(task: Task, breakfast: Task) -> None:
    assert Grasp(task, "slice", "plate").name == "grasp at plate"
    assert PlacePart(breakfast, "cup", "tray").name == "place cup at tray"
