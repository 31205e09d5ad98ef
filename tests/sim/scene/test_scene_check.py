"""What is wrong with a cell is said before anything is surveyed in it: reach, heights, stations in each other's way."""

from collections.abc import Callable
from math import pi

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sim.arms.arm_models import arm_of
from lab.sim.scene.scene_check import check_apart, check_places, check_scene, places_of
from lab.tasks.task import Task
from lab.tasks.task_fields import Place
from lab.tasks.task_file import load

Moved = Callable[..., Task]
SHIPPED = ["toast", "two-toasters", "breakfast", "fms-arm", "sorting", "palletise", "kit"]


@pytest.mark.parametrize("name", ["plate", "toaster_buffer", "toaster", "butter_applier", "finished_plate"])
@pytest.mark.parametrize("pose", [(1.5, 0.6, 0.0), (0.1, 0.1, 0.0), (-0.7, 0.0, 0.0)])
def test_a_station_out_of_reach_is_refused_by_name(
    task: Task, moved: Moved, name: str, pose: tuple[float, float, float]
) -> None:
    with pytest.raises(BadInput, match=rf"station '{name}' is out of reach: its spot at \(.*m from the robot; the arm"):
        check_scene(moved(task, name, pose=pose, approach="above", grid=None))


def test_one_given_spot_out_of_reach_is_enough(fms: Task, moved: Moved) -> None:
    near, *_ = fms.station("incoming").spots or ()
    check_scene(moved(fms, "incoming", capacity=1, spots=(near,)))
    with pytest.raises(BadInput, match=r"station 'incoming' is out of reach: its spot at \(1\.72, 0\.72\) m"):
        check_scene(moved(fms, "incoming", capacity=2, spots=(near, (1.7, 0.0, 0.0))))


@pytest.mark.parametrize("name", SHIPPED)
def test_what_check_scene_passes_the_arm_reaches(name: str) -> None:
    task = load(name)
    check_scene(task)
    check_apart(task, len(task.order()))
    arm, places = arm_of(task.robot, task.folder), places_of(task)
    for station in task.stations:
        for kind in places.kinds_at(station.name):
            assert all(arm.inverse(kind.held_at(spot)) is not None for spot in places.spots(station))


def test_a_yaw_to_which_the_last_joint_cannot_turn_the_tool_is_refused(moved: Moved) -> None:
    """The Panda's last joint goes from -2.90 to 2.90 rad: not every turn of nearly half a turn fits into that."""
    task = load("toast-panda")
    x, y, _ = task.station("butter_buffer").pose
    check_scene(moved(task, "butter_buffer", pose=(x, y, -2.6)))
    with pytest.raises(
        BadInput, match=r"'butter_buffer': .* cannot turn its tool from yaw 0\.00 to 3\.00: its last joint"
    ):
        check_scene(moved(task, "butter_buffer", pose=(x, y, 3.0)))


def test_a_machine_for_two_is_a_machine_with_two_spots(task: Task, moved: Moved) -> None:
    double = moved(task, "toaster", capacity=2)
    check_scene(double)
    check_apart(double, 2)


def test_parts_must_stand_on_the_body_of_their_station(task: Task, moved: Moved) -> None:
    """Slices are 120 x 15 mm, and 55 mm apart in a row: two need 70 mm, around the pose 125."""
    box: dict[str, object] = {"body": "box", "approach": "above", "grid": None}
    check_scene(moved(task, "toaster", capacity=2, size_m=(0.12, 0.13, 0.05), **box))
    with pytest.raises(
        BadInput, match=r"'toaster': size_m = \[0\.12, 0\.09, 0\.05\]: its 2 spots .* at least \[0\.12, 0\.125, 0\.05\]"
    ):
        check_scene(moved(task, "toaster", capacity=2, size_m=(0.12, 0.09, 0.05), **box))
    with pytest.raises(BadInput, match=r"size_m = .* at least \[0\.21, 0\.13, 0\.05\]"):
        check_scene(moved(task, "toaster", spots=((0.045, 0.0, 0.0),), size_m=(0.12, 0.13, 0.05), **box))
    with pytest.raises(BadInput, match=r"at \(0\.000, 0\.300\) m off its pose is beside its body toaster\.urdf"):
        check_scene(moved(task, "toaster", spots=((0.0, 0.3, 0.0),)))


def test_the_second_spot_of_a_machine_must_be_in_reach_too(task: Task, moved: Moved) -> None:
    """Turned to the right, the second spot lies 55 mm farther out than the first."""

    def passes(x: float, capacity: int) -> bool:
        try:
            check_scene(moved(task, "toaster", pose=(x, 0.0, -pi / 2), capacity=capacity, approach="above", grid=None))
        except BadInput as error:
            assert "station 'toaster' is out of reach: its spot at" in str(error)  # noqa: PT017
            return False
        return True

    farthest = max(x for x in np.arange(1.0, 1.5, 0.01).tolist() if passes(x, 1))
    assert not passes(farthest, 2)
    assert passes(farthest - 0.056, 2)


def test_a_workspace_that_sweeps_slices_away_is_refused(task: Task) -> None:
    """12 mm of plate, 120 mm of slice and 10 mm between them are below the carried one's foot, 90 mm below the tips."""
    x, y, z = task.workspace.lower_m
    assert z + task.workspace.cell_m[2] / 2 > 0.12 + 0.02 + 0.01 + 0.09
    low = task.workspace.model_copy(update={"lower_m": (x, y, z - 0.1)})
    with pytest.raises(
        BadInput,
        match=r"the lowest tool height 0\.200 m would sweep a carried slice through what stands at 'butter_applier': "
        r"at least 0\.240 needed",
    ):
        check_scene(task.changed(workspace=low))


def test_what_rides_on_a_pallet_counts_to_what_stands_and_not_to_what_hangs(fms: Task) -> None:
    """At the machines a rook reaches 60 + 50 mm up; a pallet hangs 5 mm below the tips: 0.110 + 0.010 + 0.005 m."""
    x, y, _ = fms.workspace.lower_m
    half = fms.workspace.cell_m[2] / 2
    check_scene(fms.changed(workspace=fms.workspace.model_copy(update={"lower_m": (x, y, 0.1251 - half)})))
    with pytest.raises(BadInput, match=r"height 0\.124 m would sweep .* 'lathe-1': at least 0\.125 needed"):
        check_scene(fms.changed(workspace=fms.workspace.model_copy(update={"lower_m": (x, y, 0.1240 - half)})))


def test_a_way_so_low_that_the_slice_would_hit_the_toaster_is_refused(task: Task, moved: Moved) -> None:
    """The marker lies at 100 mm, the tips hold the slice 90 mm above its foot, and 5 mm are kept free."""
    grid = task.station("toaster").grid
    assert grid is not None
    with pytest.raises(
        BadInput,
        match=r"station 'toaster': grid\.height_m 0\.19: a carried slice would hit it, at least 0\.195 needed",
    ):
        check_scene(moved(task, "toaster", grid=grid.model_copy(update={"height_m": 0.19})))
    check_scene(moved(task, "toaster", grid=grid.model_copy(update={"height_m": 0.196})))


def test_a_machine_outside_its_own_grid_is_refused(task: Task, moved: Moved) -> None:
    """Its marker lies 38 mm across its axis, as it is turned: at y = 0.27 + 0.03825 m, and the grid ends at 0.30 m."""
    _, _, yaw = task.station("toaster").pose
    with pytest.raises(
        BadInput, match=r"station 'toaster': grid\.marker_m: it is at \(0\.97, 0\.31\) m, outside the grid"
    ):
        check_scene(moved(task, "toaster", pose=(0.97, 0.27, yaw)))


def test_slices_of_neighbouring_stations_must_not_meet(task: Task, moved: Moved) -> None:
    """0.2 m along y the buffer's slots come within a row of each other once three toasts are under way."""
    check_apart(task, 50)
    x, y, yaw = task.station("toaster_buffer").pose
    near = moved(task, "butter_buffer", pose=(x, y - 0.2, yaw))
    check_apart(near, 1)
    with pytest.raises(
        BadInput,
        match=r"stations 'toaster_buffer' and 'butter_buffer' overlap: at \(.* m parts, machines and the gripper around",
    ):
        check_apart(near, 4)


def test_a_machines_body_must_not_stand_on_another_stations_spots(fms: Task, moved: Moved) -> None:
    """The mill's table is 26 cm wide, a pallet 12 cm long and 1 cm is kept free around it: 13 + 7 cm between the two."""
    x, y, yaw = fms.station("mill").pose
    for apart, stands in ((0.21, True), (0.19, False)):
        beside = moved(fms, "mill-out", pose=(x - apart, y, yaw))
        if stands:
            check_apart(beside, 3)
        else:
            with pytest.raises(BadInput, match="stations 'mill' and 'mill-out' overlap"):
                check_apart(beside, 3)


def test_what_the_fingers_cannot_hold_is_refused(task: Task) -> None:
    heavy = tuple(one.model_copy(update={"mass_kg": 2.0}) for one in task.parts)
    given = task.robot.model_copy(update={"grip_force_n": 10.0})
    with pytest.raises(BadInput, match=r"^robot.grip_force_n = 10: slice of 2 kg, friction 0.8, would slip"):
        check_scene(task.changed(parts=heavy, robot=given))
    check_scene(task.changed(parts=heavy, robot=task.robot.model_copy(update={"grip_force_n": None})))


def a_stack(task: Task, moved: Moved, *places: tuple[float, float, float], **changed: object) -> Task:
    """The pallet with places at x, y and a height: boxes are 60 x 30 x 50 mm."""
    given = tuple(Place(at=(x, y, 0.0), height_m=height_m) for x, y, height_m in places)
    return moved(task, "pallet", capacity=len(given), places=given, **changed)


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ([(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)], "a box there would stand in a box"),
        ([(0.0, 0.0, 0.0), (0.0, 0.0, 0.04)], "a box there would stand in a box"),
        ([(0.0, 0.0, 0.0), (0.0, 0.0, 0.06)], r"below it parts reach up to 0\.05 m"),
        ([(0.0, 0.0, 0.0), (0.07, 0.0, 0.05)], "no place is below it"),
        ([(0.0, 0.0, 0.0), (0.03, 0.0, 0.05)], "would topple"),
    ],
)
def test_a_layer_rests_on_places_below_and_places_do_not_overlap(
    palletise: Task, moved: Moved, places: list[tuple[float, float, float]], said: str
) -> None:
    with pytest.raises(BadInput, match=rf"station 'pallet': place at \(0\.0\d0, 0\.000\) m, height_m = 0.*{said}"):
        check_scene(a_stack(palletise, moved, *places))


def test_a_part_may_lie_across_two_and_stand_as_high_as_the_robot_clears(palletise: Task, moved: Moved) -> None:
    across = (-0.035, 0.0, 0.0), (0.035, 0.0, 0.0), (0.0, 0.0, 0.05)
    check_scene(a_stack(palletise, moved, *across))
    with pytest.raises(BadInput, match=r"lowest tool height 0\.230 m would sweep a carried box through .* 'pallet'"):
        check_scene(a_stack(palletise, moved, *across, *((0.0, 0.0, 0.05 * n) for n in (2, 3, 4))))


def test_on_a_body_from_a_file_a_place_may_be_high_alone(palletise: Task, moved: Moved) -> None:
    task = a_stack(palletise, moved, (0.0, 0.0, 0.03), body="applier.urdf", size_m=None, floor_m=0.0)
    check_places(places_of(task), task.station("pallet"))


def test_a_place_that_takes_two_kinds_is_as_high_as_neither(breakfast: Task, moved: Moved) -> None:
    slice_m, cup_m = (places_of(breakfast).kinds[kind].height_m for kind in ("slice", "cup"))
    lowest = min(slice_m, cup_m)
    any_kind = (Place(at=(0.0, 0.0, 0.0)), Place(at=(0.0, 0.2, 0.0)), Place(at=(0.0, 0.0, 0.0), height_m=lowest))
    both = moved(breakfast, "tray", capacity=3, spots=None, places=any_kind)
    with pytest.raises(BadInput, match=r"would stand in a (slice|cup)"):
        check_places(places_of(both), both.station("tray"))
