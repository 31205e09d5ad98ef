"""What every skill promises, whichever it is: one life, a problem with a solution, a reason when it fails."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.mdp import NoPath, greedy_path, shortest_steps
from lab.policy import Policy
from lab.sim.kinematics import ToolPose
from lab.skills import SKILLS, Skill
from lab.skills.skill import Bench, Problem, SkillFailed, Status, learned_path, no_way
from lab.skills.surveys import Surveys
from lab.taskfile import SUBTASKS

Make = dict[str, Callable[[], Skill]]
PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
every_skill = pytest.mark.parametrize("name", SKILLS)


def poses(bench: Bench) -> dict[str, tuple[float, ...]]:
    return dict(bench.scene.world.frame().poses)


def test_every_skill_is_a_sub_task_of_the_task_file_and_has_an_example_here(make: Make) -> None:
    assert tuple(SKILLS) == SUBTASKS == tuple(make)
    assert all(SKILLS[name].subtask == name for name in SKILLS)


@every_skill
def test_the_problem_has_a_solution_from_every_start(
    name: str, make: Make, surveys: Surveys, optimal: PolicyOf
) -> None:
    skill = make[name]()
    problem = skill.setup(surveys)
    assert (problem.name, problem.subtask) == (skill.name, name)
    assert shortest_steps(problem.mdp) > 0
    q = optimal(problem).q
    for start in (problem.mdp.start, *problem.mdp.starts):
        assert greedy_path(q, problem.mdp, problem.mdp.n_states, start)[2]


@every_skill
def test_the_same_scene_gives_the_same_problem(name: str, make: Make, surveys: Surveys) -> None:
    again = Surveys(surveys.task, surveys.layout) if name != "transfer" else surveys
    assert make[name]().setup(surveys).mdp.signature == make[name]().setup(again).mdp.signature


@every_skill
def test_idle_it_moves_nothing(name: str, make: Make, surveys: Surveys, stage: Callable[..., Bench]) -> None:
    skill = make[name]()
    assert skill.status is Status.IDLE
    assert skill.step() is Status.IDLE  # even before it knows its problem
    skill.setup(surveys)
    bench = stage(skill)
    before = poses(bench)
    assert [skill.step() for _ in range(3)] == [Status.IDLE] * 3
    assert poses(bench) == before
    assert skill.reason == ""


@every_skill
def test_it_runs_succeeds_and_then_stays_done(
    name: str, make: Make, surveys: Surveys, stage: Callable[..., Bench], optimal: PolicyOf, run: Run
) -> None:
    skill = make[name]()
    policy = optimal(skill.setup(surveys))
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
    surveys: Surveys,
    stage: Callable[..., Bench],
    clueless: PolicyOf,
    optimal: PolicyOf,
    run: Run,
) -> None:
    skill = make[name]()
    problem = skill.setup(surveys)
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
    skill = make["transfer"]()
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
    problem = make["insert"]().setup(surveys)
    mdp, goal = problem.mdp, int(np.flatnonzero(problem.mdp.goal)[0])
    path = learned_path(optimal(problem), mdp, mdp.start)
    assert (path[0], path[-1], len(path)) == (mdp.start, goal, shortest_steps(mdp) + 1)
    assert learned_path(clueless(problem), mdp, goal) == [goal]
    with pytest.raises(SkillFailed, match=r"does not reach its goal from \(1, 1\)"):
        learned_path(clueless(problem), mdp, mdp.start)


def test_no_way_names_what_encloses_or_the_border() -> None:
    error = NoPath("no path", ((1, 2),), "start")
    assert str(no_way("insert", error, ["cubes A", "cubes B"])) == (
        "insert: no path reaches the goal; the start is enclosed by: cubes A, cubes B"
    )
    assert str(no_way("insert", error, [])).endswith("the start is enclosed by: the border")


def test_a_bench_tells_standing_leaning_and_held_slices_apart(
    make: Make, surveys: Surveys, stage: Callable[..., Bench]
) -> None:
    place = make["place"]()
    place.setup(surveys)
    bench = stage(place)
    world, tool = bench.scene.world, bench.scene.robot.tool()
    assert bench.holds("slice 1")
    assert bench.upright("slice 1") == pytest.approx(1.0, abs=1e-3)
    held = bench.slice_pose("slice 1")
    assert (held.x, held.y, held.z) == pytest.approx((tool.x, tool.y, tool.z), abs=2e-3)
    world.put("slice 1", (0.6, 0.0, 0.06), (0.0, 0.0, np.sin(1.2), np.cos(1.2)))
    world.step()
    assert not bench.holds("slice 1")
    assert bench.slice_pose("slice 1").yaw == pytest.approx(
        2.4 - np.pi, abs=1e-2
    )  # a slice looks alike after half a turn
    assert bench.stands("slice 1", ToolPose(0.605, 0.0, 0.09), 0.01)
    assert not bench.stands("slice 1", ToolPose(0.62, 0.0, 0.09), 0.01)
    assert not bench.stands("slice 1", ToolPose(0.6, 0.0, 0.12), 0.01)
    world.put("slice 1", (0.6, 0.0, 0.06), (np.sin(0.3), 0.0, 0.0, np.cos(0.3)))
    assert bench.upright("slice 1") == pytest.approx(np.cos(0.6))
    assert not bench.stands("slice 1", ToolPose(0.6, 0.0, 0.09), 0.01)
