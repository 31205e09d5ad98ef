"""The live scene of a lesson: the robot is where the state has it, all of it is in the picture, frames fit the bodies."""

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.problem import Problem
from lab.mdp import FloatArray, TabularMDP, grid
from lab.seat.lesson_scene import LessonScene, SkillScene, WorldScene, lesson_scene_of
from lab.seat.lesson_scene.skill_scene import TRAIL
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import TOOL, ToolPose
from lab.sim.frames import Frame, Recording, Viewpoint
from lab.skills.prepared_scene import prepare
from lab.skills.skill import Skill
from lab.tasks.grid_world import GridWorld, random_world
from lab.tasks.task_file import load, load_world
from lab.teaching.world_subject import WorldSubject
from lab.view.scene_data import describe
from lab.view.world_bodies import WORLD_M

SKILLS = (
    "insert at toaster",
    "transfer plate to insert with slice",
    "grasp at plate",
    "butter at butter_applier",
    "place at butter_buffer",
)
every_skill = pytest.mark.parametrize("name", SKILLS)
TWO = ("slice", "slice")
SMALL = GridWorld(name="small", shape=(2, 3), start=(0, 0), goal=(1, 2), obstacles=((0, 1),))
# S # .
# . . G


@cache
def lesson(name: str) -> tuple[LessonScene, Skill, TabularMDP]:
    """A skill's scene as `lab teach` has it, and its skill and problem."""
    prepared = prepare(load("toast"), TWO, 0, name)
    made = lesson_scene_of(prepared, prepared.problems[name])
    assert isinstance(made, SkillScene)
    return made, prepared.skillset.skills[name], prepared.problems[name].mdp


@pytest.fixture(scope="module", autouse=True)
def _close() -> Iterator[None]:
    yield
    for name in SKILLS:
        lesson(name)[0].close()
        lesson(name)[0].close()  # safe to call again


def world_scene(world: GridWorld) -> WorldScene:
    made = lesson_scene_of(world, Problem(world.name, "world", world.mdp()))
    assert isinstance(made, WorldScene)
    return made


InPicture = Callable[[Viewpoint, FloatArray], bool]  # the fixture of tests/conftest.py


def place(frame: Frame, name: str) -> FloatArray:
    return np.array(frame.poses[name][:3])


def shown(frame: Frame) -> set[str]:
    return {name for name, visible in frame.visible.items() if visible}


def free(mdp: TabularMDP) -> st.SearchStrategy[int]:
    return st.sampled_from([int(state) for state in np.flatnonzero(~mdp.terminal | mdp.goal)])


# ---- grid worlds --------------------------------------------------------------------------------------------------

shapes = st.lists(st.integers(1, 7), min_size=2, max_size=3).filter(lambda shape: np.prod(shape) >= 4)
worlds = st.builds(random_world, shapes, st.sampled_from([0.0, 0.1, 0.3]), st.integers(0, 99))


def test_a_board_by_hand() -> None:
    """Three columns are 2 m wide; rows run down, towards the viewer."""
    with closing(world_scene(SMALL)) as scene:
        cell = WORLD_M / 3
        assert place(scene.frame(0), "robot") == pytest.approx([-cell, cell / 2, cell / 2])  # (0, 0): left, behind
        assert place(scene.frame(5), "robot") == pytest.approx([cell, -cell / 2, cell / 2])  # (1, 2): right, in front
        boxes = {body.name: body.shapes for body in scene.bodies}
        assert [shape.position[:2] for shape in boxes["obstacles"]] == [pytest.approx((0.0, cell / 2))]
        assert boxes["goal"][0].position == pytest.approx((cell, -cell / 2, cell / 2))
        assert boxes["start"][0].position[:2] == pytest.approx((-cell, cell / 2))
        assert scene.camera.eye[0] == pytest.approx(0.0, abs=1e-9)
        assert scene.camera.eye[1] < -1.0 < 1.0 < scene.camera.eye[2]


WAYS = {
    2: {"up": (0, 1, 0), "down": (0, -1, 0), "left": (-1, 0, 0), "right": (1, 0, 0)},
    3: {
        "left": (-1, 0, 0),
        "right": (1, 0, 0),
        "backward": (0, -1, 0),
        "forward": (0, 1, 0),
        "down": (0, 0, -1),
        "up": (0, 0, 1),
    },
}


@given(worlds, st.data())
def test_an_action_moves_the_robot_by_a_cell_the_way_it_says(world: GridWorld, data: st.DataObject) -> None:
    mdp = world.mdp()
    state = data.draw(st.sampled_from(np.flatnonzero(~mdp.terminal).tolist()))
    action = data.draw(st.integers(0, mdp.n_actions - 1))
    after = int(mdp.successor[state, action])
    with closing(world_scene(world)) as scene:
        moved = place(scene.frame(after), "robot") - place(scene.frame(state), "robot")
    way = np.array(WAYS[len(world.shape)][mdp.action_labels[action]]) * (after != state)
    assert moved == pytest.approx(way * WORLD_M / max(world.shape), abs=1e-9)


@given(world=worlds, data=st.data())
def test_the_robot_is_in_the_world_and_in_the_picture_and_never_in_an_obstacle_unless_it_ran_into_it(
    in_picture: InPicture, world: GridWorld, data: st.DataObject
) -> None:
    mdp = world.mdp()
    state = data.draw(st.integers(0, mdp.n_states - 1))
    size = WORLD_M / max(world.shape)
    with closing(world_scene(world)) as scene:
        frame = scene.frame(state)
        at = place(frame, "robot")
        bodies = {body.name: body.shapes for body in scene.bodies}
        assert np.all(abs(at[:2]) <= WORLD_M / 2 - size / 2 + 1e-9)
        assert size / 2 <= at[2] + 1e-9 <= WORLD_M
        assert in_picture(scene.camera, at + size / 2 * np.array(list(np.ndindex(3, 3, 3))) - size / 2)
        obstacles = np.array([shape.position for shape in bodies.get("obstacles", ())]).reshape(-1, 3)
        assert len(obstacles) == len(world.obstacles)
        hit = bool(np.any(np.all(abs(obstacles - at) < size / 2, axis=1)))
        assert hit == ("collision" in shown(frame)) == (mdp.state_cell(state) in world.obstacles)
        assert ("below" in frame.poses) == (len(world.shape) == 3)


@given(worlds, st.data())
def test_whatever_the_states_the_frames_fit_the_bodies_and_times_count_up(
    world: GridWorld, data: st.DataObject
) -> None:
    states = data.draw(st.lists(st.integers(0, world.mdp().n_states - 1), min_size=1, max_size=20))
    with closing(world_scene(world)) as scene:
        frames = [scene.frame(state) for state in states]
        Recording(scene.bodies, frames, scene.camera).check()
        assert all(before.time_s < after.time_s for before, after in pairwise(frames))


def test_the_cells_of_an_episode_stay_marked_until_the_next_one() -> None:
    """(0, 0), (1, 0), (1, 1), against the lower border, and up into the obstacle; then from the start again."""
    with closing(world_scene(SMALL)) as scene:
        first, down, right, still, crash, again = (scene.frame(state) for state in (0, 3, 4, 4, 1, 0))
        assert shown(first) == set()
        assert len(first.visible) == TRAIL + 1  # all are hidden before the first step
        assert [shown(frame) for frame in (down, right, still)] == [{"trail 0"}, {"trail 1"}, set()]
        assert place(down, "trail 0") == pytest.approx(place(first, "robot"))
        assert place(right, "trail 1") == pytest.approx(place(down, "robot"))
        assert shown(crash) == {"trail 2", "collision"}
        assert place(crash, "collision") == pytest.approx(place(crash, "robot"))
        assert set(again.visible) == {f"trail {number}" for number in range(TRAIL)} | {"collision"}
        assert shown(again) == set()
        assert shown(scene.frame(5)) == set()  # suddenly elsewhere: no way of one move leads there
        assert len(scene.frame(5).visible) == TRAIL + 1  # after the goal a new one begins


def test_a_long_way_gives_up_its_oldest_marks() -> None:
    world = GridWorld(name="long", shape=(1, 100), start=(0, 0), goal=(0, 99))
    with closing(world_scene(world)) as scene:
        frames = [scene.frame(state) for state in range(TRAIL + 2)]
        assert shown(frames[TRAIL + 1]) == {"trail 0"} == shown(frames[1])
        assert place(frames[TRAIL + 1], "trail 0") == pytest.approx(place(frames[TRAIL], "robot"))


@pytest.mark.parametrize("name", ["world-1", "world-2"])
def test_the_shipped_worlds_have_a_scene_that_the_page_can_draw(name: str) -> None:
    world = load_world(name)
    problem = WorldSubject(world).prepare(0)
    with closing(world_scene(world)) as scene:
        drawn = describe(scene.bodies, scene.camera)
        assert {"robot", "goal", "start", "ground", "obstacles"} <= {body["name"] for body in drawn["bodies"]}
        (goal,) = np.flatnonzero(problem.mdp.goal)
        (box,) = next(body.shapes for body in scene.bodies if body.name == "goal")
        assert place(scene.frame(int(goal)), "robot") == pytest.approx(np.array(box.position))


# ---- skills -------------------------------------------------------------------------------------------------------


def tool_of(frame: Frame) -> FloatArray:
    """The finger tips in a frame: straight below the tool's link."""
    return place(frame, "robot tool") - (0.0, 0.0, TOOL)


def at(pose: ToolPose) -> FloatArray:
    return np.array((pose.x, pose.y, pose.z))


@every_skill
@given(data=st.data())
def test_in_every_free_state_the_tool_is_at_the_pose_of_the_skill(name: str, data: st.DataObject) -> None:
    scene, skill, mdp = lesson(name)
    frame = scene.frame(data.draw(free(mdp)))
    state = data.draw(free(mdp))
    frame = scene.frame(state)
    pose = skill.pose(state)
    if name.startswith("butter"):
        assert place(frame, "butter_applier head") == pytest.approx(at(pose), abs=1e-6)
        return
    assert tool_of(frame) == pytest.approx(at(pose), abs=1e-6)
    if skill.carries:
        middle = pose.shifted(dz=0.12 / 2 - skill.own_kind.grip.up_m)  # a slice is 12 cm high
        assert place(frame, "slice 1") == pytest.approx(at(middle))


@every_skill
@given(data=st.data())
def test_frames_of_a_skill_fit_its_bodies(name: str, data: st.DataObject) -> None:
    scene, _, mdp = lesson(name)
    states = data.draw(st.lists(st.integers(0, mdp.n_states - 1), min_size=1, max_size=8))
    frames = [scene.frame(state) for state in states]
    Recording(scene.bodies, frames, scene.camera).check()
    assert all(before.time_s < after.time_s for before, after in pairwise(frames))


@every_skill
def test_all_places_of_the_tool_are_in_the_picture(in_picture: InPicture, name: str) -> None:
    scene, skill, mdp = lesson(name)
    places = np.array([at(skill.pose(int(state))) for state in np.flatnonzero(~mdp.terminal | mdp.goal)])
    assert in_picture(scene.camera, places)


@every_skill
def test_right_is_to_the_right_in_the_picture(name: str) -> None:
    """What the action "right" does, seen by the camera; "forward" goes away from it."""
    scene, skill, mdp = lesson(name)
    ahead = np.array(scene.camera.target) - scene.camera.eye
    aside = np.cross(ahead, (0.0, 0.0, 1.0))
    for word, way in (("right", aside), ("forward", ahead)):
        if word in mdp.action_labels:
            moves = mdp.successor[:, mdp.action_labels.index(word)]
            state = next(s for s in range(mdp.n_states) if moves[s] != s)
            assert (at(skill.pose(int(moves[state]))) - at(skill.pose(state))) @ way > 0


@every_skill
def test_the_page_can_draw_a_skill(name: str) -> None:
    scene, skill, _ = lesson(name)
    drawn = {body["name"] for body in describe(scene.bodies, scene.camera)["bodies"]}
    assert {"table", "robot tool", "slice 1", "slice 2"} <= drawn
    assert ("goal" in drawn) == (skill.subtask in ("insert", "transfer", "place"))


def test_a_state_out_of_reach_leaves_the_arm_and_marks_where_it_was_to_go() -> None:
    scene, skill, mdp = lesson("transfer plate to insert with slice")
    before = scene.frame(mdp.start)
    far = next(state for state in range(mdp.n_states) if arm_named("up6").inverse(skill.pose(state)) is None)
    after = scene.frame(far)
    assert after.poses["robot tool"] == before.poses["robot tool"]
    assert after.poses["slice 1"] == before.poses["slice 1"]
    assert "collision" in shown(after)
    assert place(after, "collision") == pytest.approx(at(skill.pose(far)))
    assert "collision" not in shown(scene.frame(mdp.start))


def test_butter_is_where_the_state_has_it() -> None:
    scene, _, mdp = lesson("butter at butter_applier")
    cells = [f"butter on slice 1 {row}{column}" for row, column in np.ndindex(3, 3)]
    some = scene.frame(4 << 9 | 0b000010011)
    assert shown(some) == {cells[0], cells[1], cells[4]}
    assert set(some.visible) == set(cells)
    assert some.poses[cells[0]] == some.poses["slice 1"]
    assert shown(scene.frame(mdp.start)) == {cells[0]}  # a new slice


def test_slices_that_may_stand_beside_the_one_are_ghosts_and_real_ones_are_not() -> None:
    prepared = prepare(load("toast"), TWO, 0, "grasp at plate")
    with closing(SkillScene(prepared.task, TWO, prepared.layout, prepared.skillset.skills["grasp at plate"])) as scene:
        first, second = scene.frame(0), scene.frame(1)
        ghosts = {name for name in first.poses if name.startswith("slice ") and not name[6:].isdigit()}
        assert len(ghosts) == 3  # the second toast is where the fourth would be
        assert set(first.colors) == ghosts
        assert all(rgba[3] < 0.5 for rgba in first.colors.values())
        assert not second.colors
        spot = first.poses["slice 1"]
        assert all(np.linalg.norm(place(first, name) - spot[:3]) > 0.05 for name in ghosts)


def test_where_a_slice_is_to_be_set_down_its_ghost_stands() -> None:
    scene, _, mdp = lesson("place at butter_buffer")
    (goal,) = np.flatnonzero(mdp.goal)
    frame = scene.frame(int(goal))
    off = place(frame, "slice 1") - place(frame, "goal")
    assert off[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert 0.0 < off[2] < 0.003  # let go just above the spot


# ---- which scene --------------------------------------------------------------------------------------------------


def test_a_problem_without_a_scene_has_no_scene() -> None:
    mdp = grid((2, 2), np.zeros((2, 2), bool), (0, 0), (1, 1))
    assert lesson_scene_of(None, Problem("FrozenLake-v1", "gym", mdp)) is None
    prepared = prepare(load("toast"), TWO, 0, "place at butter_buffer")
    assert lesson_scene_of(prepared, Problem("FrozenLake-v1", "gym", mdp)) is None
