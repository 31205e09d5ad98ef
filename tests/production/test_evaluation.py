"""A policy is carried out in drawn scenes: what is counted, and why it fails."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.mdp import optimal_values
from lab.production.evaluation import PARTS, Evaluation, SceneResult, evaluate, in_scene, skill_of, task_of
from lab.skills.prepared_scene import prepare
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.toolbox.policy import Policy

PLACE, INSERT, GRASP = "place at toaster_buffer", "insert at toaster", "grasp at plate"
Known = Callable[..., Policy]


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


@pytest.fixture(scope="module")
def known(task: Task, make_policy: Known) -> Known:
    """The policy that always takes a shortest way of a skill in the scene of seed 0."""

    def make(name: str, **changed: Any) -> Policy:
        problem = prepare(task, task.fitting(PARTS), 0, name).problems[name]
        mdp = problem.mdp
        q = optimal_values(mdp, 0.99)
        fields: dict[str, Any] = {
            "name": f"{name} {mdp.signature[:8]}",
            "subtask": problem.subtask,
            "q": q,
            "visits": np.zeros(q.shape, np.int64),
            "action_labels": mdp.action_labels,
            "shape": mdp.shape,
            "start": mdp.start,
            "signature": mdp.signature,
        }
        return make_policy(**(fields | changed))

    return make


def unheard(done: int, of: int) -> None:
    """Nobody listens."""


def test_a_skill_that_works_everywhere(task: Task, known: Known) -> None:
    heard: list[tuple[int, int]] = []
    found = evaluate(known(PLACE), task, PLACE, 3, 5, lambda *told: heard.append(told))
    assert heard == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert [(scene.seed, scene.failed_in, scene.reason) for scene in found.scenes] == [
        (n, None, None) for n in (5, 6, 7)
    ]
    assert all(1.0 < scene.sim_s < 20.0 for scene in found.scenes)
    assert not found.interrupted
    again = evaluate(known(PLACE), task, PLACE, 3, 5, unheard)
    assert again.scenes == found.scenes


def test_what_was_learned_elsewhere_may_not_lead_to_the_goal(task: Task, known: Known) -> None:
    policy = known(INSERT)
    assert in_scene(policy, task, INSERT, 0).failed_in is None
    elsewhere = [in_scene(policy, task, INSERT, seed) for seed in range(1, 3)]
    lost = [scene for scene in elsewhere if scene.failed_in == "table"]
    assert lost
    assert all(str(scene.reason).startswith("its best moves from (1, 1) run into something at (") for scene in lost)
    assert all(scene.sim_s == 0.0 for scene in lost)


def test_a_policy_that_learned_nothing_goes_round(task: Task, known: Known) -> None:
    policy = known(INSERT)
    scene = in_scene(replace(policy, q=np.zeros_like(policy.q)), task, INSERT, 0)
    assert (scene.failed_in, scene.reason) == ("table", "its best moves from (1, 1) go round and round at (0, 1)")


def test_what_slips_in_physics_fails_there(task: Task, known: Known, monkeypatch: pytest.MonkeyPatch) -> None:
    """So smooth a slice would be refused before it is tried."""
    monkeypatch.setattr("lab.sim.scene.scene_check.held", lambda robot, *_: robot)
    smooth = task.changed(parts=(task.parts[0].model_copy(update={"friction": 0.001}),))
    scene = in_scene(known(GRASP), smooth, GRASP, 0)
    assert (scene.failed_in, scene.reason) == ("physics", "slice 1 is not in the gripper after grasping at 'plate'")
    assert scene.sim_s > 1.0


def test_a_slice_is_taken_up_where_it_is_drawn(task: Task, known: Known) -> None:
    """The same table, another motion."""
    straight = task.changed(parts=(task.parts[0].model_copy(update={"area": (0.0, 0.0, 0.0)}),))
    drawn, still = (in_scene(known(GRASP), given, GRASP, 3) for given in (task, straight))
    assert drawn.failed_in is still.failed_in is None
    assert drawn.sim_s != still.sim_s


def test_a_scene_without_a_way_is_not_counted(task: Task, known: Known) -> None:
    tower = task.obstacles[0].model_copy(update={"position_m": (0.42, 0.56), "area": (0.0, 0.0)})
    blocked = task.model_copy(update={"obstacles": (tower,)})
    found = evaluate(known(PLACE), blocked, PLACE, 2, 0, unheard)
    assert [scene.failed_in for scene in found.scenes] == ["scene", "scene"]
    assert "stands on station 'toaster_buffer'" in str(found.scenes[0].reason)
    assert (found.facts()["scenes"], found.facts()["success_percent"], found.facts()["ci95"]) == (0, None, None)


def test_what_is_counted() -> None:
    """Three of four: Wilson's interval is 30.1 to 95.4 %."""
    scenes = [SceneResult(n, None, None, 2.0 + n) for n in range(3)]
    scenes += [SceneResult(3, "physics", "it fell", 1.0), SceneResult(4, "scene", "no way", 0.0)]
    found = Evaluation("mine", GRASP, "toast", 0, 6, scenes, 1.5).to_json()
    assert {name: found[name] for name in ("scenes", "successes", "success_percent", "mean_sim_s", "unsolvable")} == {
        "scenes": 4, "successes": 3, "success_percent": 75.0, "mean_sim_s": 3.0, "unsolvable": 1,
    }  # fmt: skip
    assert found["ci95"] == pytest.approx([30.064, 95.441], abs=1e-3)
    assert found["interrupted"]
    assert found["rows"][3] == {"seed": 3, "failed_in": "physics", "reason": "it fell", "sim_s": 1.0, "success": False}


def test_ctrl_c_keeps_what_was_done(task: Task, known: Known) -> None:
    def stop_at(number: int) -> Callable[[int, int], None]:
        def told(done: int, of: int) -> None:
            if done == number:
                raise KeyboardInterrupt

        return told

    found = evaluate(known(PLACE), task, PLACE, 9, 0, stop_at(1))
    assert (len(found.scenes), found.wanted, found.interrupted) == (1, 9, True)
    with pytest.raises(KeyboardInterrupt, match="before a scene was done"):
        evaluate(known(PLACE), task, PLACE, 9, 0, stop_at(0))


def test_a_table_of_another_size_is_refused(task: Task, known: Known) -> None:
    with pytest.raises(BadInput, match=r"is for 150 states and the actions left, .*; 'grasp at plate' has 750 states"):
        evaluate(known(PLACE), task, GRASP, 1, 0, unheard)


@pytest.mark.parametrize(
    ("name", "subtask", "given", "found"),
    [
        ("grasp at plate 613ab15c", "grasp", None, "grasp at plate"),
        ("grasp at toaster_buffer 613ab15c", "grasp", None, "grasp at toaster_buffer"),
        ("grasp at toaster 613ab15c unfinished", "grasp", None, "grasp at toaster"),
        ("grasp at plate", "grasp", "grasp at toaster", "grasp at toaster"),
        ("the best one", "insert", None, "insert at toaster"),
        ("the best one", "grasp", None, r"which of 6 skills for 'grasp' .* give --skill: grasp at butter_applier, "),
        ("the best one", "fly", None, "task 'toast' has no skill for the sub-task 'fly'"),
        (
            "the best one",
            "grasp",
            "grasp at plat",
            r"unknown skill 'grasp at plat' \(--skill, .* did you mean 'grasp at plate'",
        ),
    ],
)
def test_which_skill_a_policy_is_for(
    task: Task, known: Known, name: str, subtask: str, given: str | None, found: str
) -> None:
    policy = replace(known(PLACE), name=name, subtask=subtask)
    if found.startswith(("grasp at", "insert at")):
        assert skill_of(policy, task, given) == found
    else:
        with pytest.raises(BadInput, match=found):
            skill_of(policy, task, given)


def test_which_task_a_policy_was_learned_in(task: Task, known: Known) -> None:
    policy = known(PLACE)
    assert task_of(policy, None) == task == task_of(replace(policy, task="mine"), "toast")
    with pytest.raises(
        BadInput, match=r"was learned in 'mine', which is no task here: name one \(--task\): unknown task"
    ):
        task_of(replace(policy, task="mine"), None)
    with pytest.raises(BadInput, match="it is a world, not a task"):
        task_of(replace(policy, task="world-1"), None)
