"""What every skill promises, whichever it is: one life, a problem with a solution, a reason when it fails."""

from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.learning.problem import Problem
from lab.mdp import NoPath, greedy_path, grid, shortest_steps
from lab.production.durations import measure
from lab.seat.lesson_scene import SkillScene
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot
from lab.sim.scene.places import Layout
from lab.skills import SKILLS, Skill
from lab.skills.prepared_scene import Prepared
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench, Status, learned_path, no_path_error
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import Stage, Subtask
from lab.teaching.lesson import one_lesson
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.skill_subject import SkillSubject
from lab.teaching.teacher import Teacher
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

Make = Callable[[str], Skill]

CellOf = Callable[[str], Any]
PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
ORDER = ("slice", "slice")


class Hover(Skill):
    """A new skill, all of it: before it travels, the empty gripper rises from a station's approach, level by level."""

    subtask: ClassVar[str] = "hover"
    help: ClassVar[str] = "the empty gripper rises before it travels"

    def __init__(self, station: str) -> None:
        super().__init__(f"hover at {station}")
        self.station = station

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Hover":
        return cls(origin)

    def setup(self, surveys: Surveys) -> Problem:
        self.surveys = surveys
        mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("stay", "wait", "down", "up"))
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def pose(self, state: int) -> ToolPose:
        return self.begins_at().shifted(dz=0.03 * self.problem.mdp.state_cell(state)[1])

    def begins_at(self) -> ToolPose:
        return self.surveys.approach(self.station)

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        path = learned_path(policy, self.problem.mdp, self.problem.mdp.start)
        yield from bench.scene.robot.follow([self.pose(state) for state in path])


ELSEWHERE = (
    "fms-arm: grasp rook on pallet at lathe-1-out",
    "fms-arm: transfer incoming to lathe-1-in with rook on pallet",
    "fms-arm: place rook at lathe-1-out",
    "fms-arm: vacuum at mill",
    "breakfast: grasp cup at shelf",
    "breakfast: place cup at coffee_machine",
)
every_subtask = pytest.mark.parametrize("name", [*SKILLS, Hover.subtask])
every_skill = pytest.mark.parametrize("name", [*SKILLS, Hover.subtask, *ELSEWHERE])


@pytest.fixture(autouse=True)
def row() -> Iterator[None]:
    """The new skill's row in the table: it comes before travelling."""
    others = dict(SKILLS)
    SKILLS.clear()
    SKILLS.update({Hover.subtask: Hover} | others)
    yield
    SKILLS.clear()
    SKILLS.update(others)


def poses(bench: Bench) -> dict[str, tuple[float, ...]]:
    return dict(bench.scene.world.frame().poses)


@every_subtask
def test_it_stands_in_the_table_under_its_own_name_and_the_shipped_task_needs_it(name: str, make: Make) -> None:
    assert SKILLS[name].subtask == make(name).subtask == name
    assert SKILLS[name].help
    assert not SKILLS[name].help.endswith(".")
    assert f" {make(name).station}" in f" {make(name).name}"


@pytest.mark.parametrize("cell", ["toast", "fms-arm", "breakfast"])
def test_every_skill_of_a_cell_has_a_problem_with_a_solution_from_every_start(
    cell: str, cells: dict[str, Any], optimal: PolicyOf
) -> None:
    surveys, solved = cells[cell].surveys, set()
    for name, skill in cells[cell].skills().items():
        problem = skill.setup(surveys)
        assert (problem.name, problem.subtask) == (skill.name, skill.subtask) == (name, skill.subtask)
        assert skill.problem is problem
        assert shortest_steps(problem.mdp) > 0
        if problem.mdp.signature not in solved:
            q = optimal(problem).q
            for start in (problem.mdp.start, *problem.mdp.starts):
                assert greedy_path(q, problem.mdp, problem.mdp.n_states, start)[2]
            solved.add(problem.mdp.signature)
    assert {skill.subtask for skill in cells[cell].skills().values()} >= {Hover.subtask, "grasp", "transfer", "place"}


@every_skill
def test_the_same_scene_gives_the_same_problem(name: str, make: Make, cell_of: CellOf) -> None:
    cell = cell_of(name)
    again = Surveys(cell.surveys.task, cell.order, cell.surveys.layout) if "transfer" not in name else cell.surveys
    assert make(name).setup(cell.surveys).mdp.signature == make(name).setup(again).mdp.signature


@every_skill
def test_idle_it_moves_nothing(name: str, make: Make, cell_of: CellOf, stage: Callable[..., Bench]) -> None:
    skill = make(name)
    assert skill.status is Status.IDLE
    assert skill.step() is Status.IDLE  # even before it knows its problem
    skill.setup(cell_of(name).surveys)
    bench = stage(skill)
    before = poses(bench)
    assert [skill.step() for _ in range(3)] == [Status.IDLE] * 3
    assert poses(bench) == before
    assert skill.reason == ""


@every_skill
def test_it_runs_succeeds_and_then_stays_done(
    name: str, make: Make, cell_of: CellOf, stage: Callable[..., Bench], optimal: PolicyOf, run: Run
) -> None:
    skill = make(name)
    policy = optimal(skill.setup(cell_of(name).surveys))
    bench = stage(skill)
    skill.start(bench, policy)
    life = [skill.status]
    for _ in range(30):
        life.append(skill.step())
        bench.scene.world.step()
    assert set(life) == {Status.RUNNING}
    skill.stop()
    before = poses(bench)
    assert [skill.status, skill.step()] == [Status.IDLE] * 2
    assert poses(bench) == before
    assert run(skill, bench, policy) is Status.SUCCESS, skill.reason  # it can be started again after a stop
    before = poses(bench)
    assert skill.step() is Status.SUCCESS
    assert poses(bench) == before
    assert skill.reason == ""


@every_skill
def test_a_policy_that_knows_nothing_fails_with_a_reason_and_touches_nothing(
    name: str,
    make: Make,
    cell_of: CellOf,
    stage: Callable[..., Bench],
    clueless: PolicyOf,
    optimal: PolicyOf,
    run: Run,
) -> None:
    skill = make(name)
    problem = skill.setup(cell_of(name).surveys)
    bench = stage(skill)
    before = bench.scene.robot.tool()
    assert run(skill, bench, clueless(problem)) is Status.FAILURE
    assert f"policy '{skill.name} policy' does not reach its goal from" in skill.reason
    assert skill.step() is Status.FAILURE
    assert bench.scene.robot.tool() == before
    skill.start(bench, optimal(problem))
    assert (skill.status, skill.reason) == (Status.RUNNING, "")


@pytest.mark.parametrize("error", [SkillFailed, WorkFailed])
def test_what_goes_wrong_in_a_motion_is_the_reason(
    error: type[Exception], make: Make, surveys: Surveys, stage: Callable[..., Bench], optimal: PolicyOf, run: Run
) -> None:
    skill = make("transfer")
    policy = optimal(skill.setup(surveys))

    def motion(*_: object) -> Iterator[None]:
        yield
        raise error("the arm is tired")

    setattr(skill, "motion", motion)  # noqa: B010
    assert run(skill, stage(skill), policy) is Status.FAILURE
    assert skill.reason == "the arm is tired"


def test_a_learned_path_ends_at_the_goal_or_says_where_it_got_lost(
    make: Make, surveys: Surveys, optimal: PolicyOf, clueless: PolicyOf
) -> None:
    problem = make("insert").setup(surveys)
    mdp, goal = problem.mdp, int(np.flatnonzero(problem.mdp.goal)[0])
    path = learned_path(optimal(problem), mdp, mdp.start)
    assert (path[0], path[-1], len(path)) == (mdp.start, goal, shortest_steps(mdp) + 1)
    assert learned_path(clueless(problem), mdp, goal) == [goal]
    with pytest.raises(SkillFailed, match=r"does not reach its goal from \(1, 1\)"):
        learned_path(clueless(problem), mdp, mdp.start)


def test_no_way_names_what_encloses_or_the_border() -> None:
    error = NoPath("no path", ((1, 2),), "start")
    assert str(no_path_error("insert", error, ["cubes A", "cubes B"])) == (
        "insert: no path reaches the goal; the start is enclosed by: cubes A, cubes B"
    )
    assert str(no_path_error("insert", error, [])).endswith("the start is enclosed by: the border")


def test_a_bench_tells_standing_leaning_and_held_slices_apart(
    make: Make, surveys: Surveys, stage: Callable[..., Bench]
) -> None:
    place = make("place")
    place.setup(surveys)
    bench = stage(place)
    world, tool = bench.scene.world, bench.scene.robot.tool()
    assert bench.holds("slice 1")
    assert bench.upright("slice 1") == pytest.approx(1.0, abs=1e-3)
    held = bench.part_pose("slice 1")
    assert (held.x, held.y, held.z) == pytest.approx((tool.x, tool.y, tool.z), abs=2e-3)
    world.put("slice 1", (0.6, 0.0, 0.06), (0.0, 0.0, np.sin(1.2), np.cos(1.2)))
    world.step()
    assert not bench.holds("slice 1")
    assert bench.part_pose("slice 1").yaw == pytest.approx(2.4 - np.pi, abs=1e-2)  # alike after half a turn
    assert bench.stands("slice 1", Spot(0.605, 0.0, 0.0, 0.0), 0.01)
    assert not bench.stands("slice 1", Spot(0.62, 0.0, 0.0, 0.0), 0.01)
    assert not bench.stands("slice 1", Spot(0.6, 0.0, 0.03, 0.0), 0.01)
    world.put("slice 1", (0.6, 0.0, 0.06), (np.sin(0.3), 0.0, 0.0, np.cos(0.3)))
    assert bench.upright("slice 1") == pytest.approx(np.cos(0.6))
    assert not bench.stands("slice 1", Spot(0.6, 0.0, 0.0, 0.0), 0.01)


def test_a_new_skill_is_a_class_and_a_row_and_all_else_knows_it(
    task: Task, surveys: Surveys, optimal: PolicyOf, tmp_path: Path
) -> None:
    """The task file may have settings for it, lessons teach and show it, and jobs need it, time it and carry it out."""
    ((first, *_, last),) = task.parts[0].routes
    ends = (Stage(station=first.station), Stage(station=last.station))
    slices = task.parts[0].model_copy(update={"routes": (ends,)})
    short = task.changed(parts=(slices,), subtasks=task.subtasks | {"hover": Subtask()})
    subject = SkillSubject.of(LessonOptions("hover", episodes=40), short)
    document = one_lesson(subject, Teacher(Toolbox(tmp_path)), out=tmp_path / "out")
    assert (document["subtask"], document["skill"], document["solved"]) == ("hover", "hover at toaster_buffer", True)
    skillset = SkillSet.of(short, ("slice",))
    hovers = [skill for skill in skillset.skills.values() if isinstance(skill, Hover)]
    assert hovers
    assert all(way[0] in hovers for way in skillset.travels.values())
    problems = {name: skill.setup(surveys) for name, skill in skillset.skills.items()}
    skillset.policies = {name: optimal(problem) for name, problem in problems.items()}
    with closing(
        SkillScene(task, ("slice",), Layout(surveys.layout.obstacles, ((0.0, 0.0, 0.0),)), hovers[0])
    ) as stage:
        assert stage.frame(2).poses["robot tool"][2] == pytest.approx(stage.frame(0).poses["robot tool"][2] + 0.06)
    durations = measure(Prepared(short, ("slice",), 0, surveys.layout, surveys, skillset, problems))
    assert set(durations.empty_s) == set(skillset.moves.empty)
