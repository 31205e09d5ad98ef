"""An operator at work in physics: by hand, in turn, in a pause, stopped at once, and all of it once more bit for bit."""

import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from lab.production.composer import Conditions
from lab.production.operation.desk import AT_WORK, LEFT_FIRST, Desk
from lab.production.operation.operation import Operation
from lab.production.run_journal import Commanded, SkillKept, read_run
from lab.sim.world import TIME_STEP
from lab.tasks.task_file import load
from lab.teaching.events import Event, MoveMade, OperatorActed, PlanMade, SkillReady
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

PATIENCE_S = 60.0
Made = Callable[..., Operation]


def until(what: Callable[[], Any]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < end_s, "it does not come"
        time.sleep(0.002)


@pytest.fixture
def desk(made: Made) -> Any:
    """A desk whose simulation runs in a thread of its own, once the plan is made."""
    desk = Desk(made())
    worker = Thread(target=desk.serve)
    worker.start()
    desk.say("policy")
    desk.settle()
    assert desk.operation.done[-1].well
    yield desk
    desk.leave()
    worker.join()


def poses(operation: Operation) -> dict[str, Any]:
    """Where every body is, and how the arm's joints stand, to the last bit."""
    scene = operation.scene.floor.scene
    joints = scene.world.joints("robot", scene.robot.arm.joints)
    return {name: repr(pose) for name, pose in scene.world.frame().poses.items()} | {"joints": repr(joints.tolist())}


# ---- by hand ---------------------------------------------------------------------------------------------------------


def test_the_tool_goes_where_it_is_jogged(made: Made) -> None:
    operation = made()
    operation.open()
    robot = operation.scene.floor.scene.robot
    before = robot.tool()
    assert operation.do("jog +z 30").well
    assert operation.do("jog -y 20").well
    assert operation.do("rotate 30").well
    after = robot.tool()
    assert (after.x, after.y, after.z) == pytest.approx((before.x, before.y - 0.02, before.z + 0.03), abs=0.002)
    assert after.yaw - before.yaw == pytest.approx(0.5236, abs=0.02)
    assert operation.do("home").well
    assert operation.scene.floor.scene.world.joints("robot", robot.arm.joints) == pytest.approx(
        robot.arm.home, abs=0.05
    )


def test_what_may_not_be_is_refused_and_nothing_moves(made: Made, tmp_path: Path, heard: list[Event]) -> None:
    operation = made(box=Toolbox(tmp_path / "empty"))
    operation.open()
    for _ in range(5):
        operation.do("jog +x 500")
    before, steps = poses(operation), operation.scene.floor.steps
    for line, why in (
        ("jog +x 500", "out of the arm's reach"),
        ("grasp", "'grasp at plate' is not learned yet: policy, or learn grasp at plate"),
        ("run", "there is no plan yet: policy finds one"),
        ("order 1", "there is no plan yet"),
        ("execute insert at toaster", "begins with a part in the gripper"),
        ("execute grasp at plate", "'grasp at plate' is not learned yet: policy, or learn grasp at plate"),
        ("execute butter at butter_applier", "what a machine does by itself"),
        ("execute grasp at plate slice 9", "unknown part 'slice 9'"),
        ("execute transfer toaster_buffer to plate slice 1", "is not done with slice 1: wanted no part"),
        ("learn insrt", "did you mean 'insert'?"),
        ("parts slice=0", "0 parts"),
        ("parts cup=1", "unknown part 'cup'"),
        ("go on", "wanted nothing"),
        ("reset", "no emergency stop is pressed"),
    ):
        assert why in operation.do(line).refused
    assert (poses(operation), operation.scene.floor.steps) == (before, steps)
    noted = [entry for entry in read_run(tmp_path / "run", "test")[1] if isinstance(entry, Commanded)]
    assert sum("reach" in entry.refused for entry in noted) >= 1
    assert isinstance(heard[-1], OperatorActed)


def test_pressing_on_the_table_is_stopped_and_may_be_jogged_away(made: Made) -> None:
    operation = made()
    operation.open()
    robot = operation.scene.floor.scene.robot
    assert operation.do("close").well
    for _ in range(80):
        done = operation.do("jog -z 10")
        if not done.well:
            break
    assert "presses on" in done.failed
    low = robot.tool().z
    assert operation.do("jog +z 50").well
    assert robot.tool().z > low + 0.04


# ---- a plan and its run ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_typed_order_is_checked_and_carried_out(made: Made, heard: list[Event]) -> None:
    operation = made(2)
    operation.open()
    assert operation.do("policy").well
    assert "move 3 '3': there is no part 3" in operation.do("order 1 1 3").refused
    assert "move 2 '2': slice 2 at 'plate' cannot move on: 'toaster' full" in operation.do("order 1 2").refused
    assert "it ends after 3 moves, but slice 2 is still at 'plate'" in operation.do("order 1 1 1").refused
    done = operation.do("order 1 1 1 2 2 2")
    assert "the proven optimum" in done.said
    assert operation.do("run").well
    assert [e.part for e in heard if isinstance(e, MoveMade)] == 3 * ["slice 1"] + 3 * ["slice 2"]
    assert operation.now().finished == 2
    assert "nothing is left to do" in operation.do("run").refused
    report = operation.report()
    assert report is not None
    assert report.success
    assert report.gap >= 0
    plan = [event for event in heard if isinstance(event, PlanMade)][-1]
    assert plan.schedule.makespan_s == pytest.approx(operation.now().now_s, abs=2.0)
    assert operation.do("parts slice=1").said == "1 slice laid out"
    assert (operation.now().finished, operation.scene.floor.steps) == (0, 0)


def test_what_was_grasped_by_hand_is_brought_on_first(made: Made) -> None:
    operation = made()
    operation.open()
    assert operation.do("policy").well
    assert operation.do("execute grasp at plate").well
    assert operation.scene.floor.bench.held == "slice 1"
    assert "the robot holds slice 1: open first" in operation.do("grasp").refused
    assert operation.do("jog +z 40").well
    done = operation.do("run")
    assert done.said == "1 of 1 parts made", done


def test_what_the_toolbox_holds_is_carried_out_without_a_plan(made: Made, toolbox: Toolbox) -> None:
    learned = made()
    learned.open()
    assert learned.do("policy").well
    operation = made(folder="again")
    operation.open()
    for line in (
        "home",
        "grasp",
        "home",
        "execute transfer plate to insert with slice",
        "execute insert at toaster",
        "home",
        "execute transfer toaster_buffer to plate",
        "execute grasp at toaster",
    ):
        assert operation.do(line).well, operation.done[-1]
    assert operation.scene.plan is None
    assert operation.scene.floor.bench.held == "slice 1"
    kept = operation.scene.journal.path
    assert kept is not None
    rows = [entry.row for entry in read_run(kept.parent, "test")[1] if isinstance(entry, SkillKept)]
    assert [(row["name"], row["source"]) for row in rows][:2] == [
        ("grasp at plate", "reused"),
        ("transfer plate to insert with slice", "reused"),
    ]


def test_a_skill_takes_the_part_at_its_own_station(made: Made) -> None:
    operation = made(2)
    operation.open()
    assert operation.do("execute grasp at plate slice 2").well
    assert operation.do("execute transfer plate to insert with slice").well
    assert operation.do("execute insert at toaster").well
    assert operation.do("execute grasp at toaster").well
    assert operation.scene.floor.bench.held == "slice 2"


def test_a_skill_refuses_another_kind_of_part_than_its_own(tmp_path: Path) -> None:
    task = load("breakfast")
    operation = Operation(task, task.order(None), 0, Teacher(Toolbox(tmp_path / "box")), Conditions())
    operation.open()
    try:
        assert (
            "'grasp cup at shelf' is not done with slice 1: wanted cup 3"
            in operation.do("execute grasp cup at shelf slice 1").refused
        )
        operation.scene.floor.bench.held = "cup 3"
        assert (
            "the robot holds cup 3: 'insert slice at toaster' carries a slice"
            in operation.do("execute insert slice at toaster").refused
        )
    finally:
        operation.close()


def test_what_was_learned_after_a_plan_is_in_the_next(made: Made, heard: list[Event]) -> None:
    operation = made()
    operation.open()
    assert operation.do("policy").well
    assert operation.do("learn grasp at plate").well
    policy = operation.scene.prepared.skillset.policies["grasp at plate"]
    heard.clear()
    assert operation.do("policy").well
    assert operation.scene.prepared.skillset.policies["grasp at plate"].created == policy.created
    assert {e.lesson.source for e in heard if isinstance(e, SkillReady)} == {"reused"}


def test_a_skill_is_learned_by_its_name_and_kept(made: Made) -> None:
    operation = made()
    operation.open()
    assert operation.do("learn grasp at plate").said == "learned grasp at plate"
    policy = operation.scene.prepared.skillset.policies["grasp at plate"]
    assert operation.scene.teacher.toolbox.find(policy.subtask, policy.signature, policy.name).solved  # type: ignore[union-attr]
    assert operation.do("execute grasp at plate").well


# ---- in threads ------------------------------------------------------------------------------------------------------


def test_an_emergency_stop_holds_the_arm_until_it_is_reset(desk: Desk) -> None:
    operation = desk.operation
    floor = operation.scene.floor
    desk.say("speed 5")
    desk.say("run")
    until(lambda: floor.now_s > 1.0)
    assert desk.say("jog +z 10").refused == AT_WORK  # type: ignore[union-attr]
    pressed = floor.steps
    desk.say("stop")
    assert desk.now().held.kind == "emergency"  # type: ignore[union-attr]
    until(lambda: floor.stops.holds_arm)
    until(lambda: floor.steps > pressed + 60)
    before, steps = floor.scene.robot.tool(), floor.steps
    until(lambda: floor.steps > steps + 60)  # time goes on, the arm does not
    after = floor.scene.robot.tool()
    assert (after.x, after.y, after.z) == pytest.approx((before.x, before.y, before.z), abs=1e-4)
    assert "reset it first" in desk.say("go").refused  # type: ignore[union-attr]
    assert "reset it first" in desk.say("jog +z 10").refused  # type: ignore[union-attr]
    assert desk.say("reset").well  # type: ignore[union-attr]
    desk.say("speed max")
    desk.say("go")
    desk.settle()
    assert operation.done[-1].said == "1 of 1 parts made"


def test_after_a_protective_stop_the_operator_goes_on_and_jogs_away(made: Made) -> None:
    desk = Desk(made())
    worker = Thread(target=desk.serve)
    worker.start()
    controls = desk.operation.controls
    for _ in range(80):
        desk.say("jog -z 10")
        until(lambda: desk.still or controls.holds_arm)
        if controls.holds_arm:
            break
    assert "the arm presses on" in desk.now().held.why  # type: ignore[union-attr]
    assert desk.say("go").well  # type: ignore[union-attr]
    desk.settle()
    assert "protective stop" in desk.operation.done[-1].failed
    desk.say("jog +z 50")
    desk.settle()
    assert desk.operation.done[-1].well
    desk.leave()
    worker.join()


def test_a_step_is_one_move(desk: Desk, heard: list[Event]) -> None:
    desk.say("step")
    desk.settle()
    assert sum(isinstance(event, MoveMade) for event in heard) == 1
    desk.say("step")
    desk.settle()
    assert sum(isinstance(event, MoveMade) for event in heard) == 2
    desk.say("go")
    desk.settle()
    assert desk.now().finished == 1


def test_run_goes_on_after_a_step(desk: Desk) -> None:
    for line in ("step", "run"):
        desk.say(line)
        desk.settle()
    assert desk.now().finished == 1
    assert [done.words for done in desk.done[-2:]] == ["go", "run"]


def test_whose_turn_did_not_come_is_said(desk: Desk) -> None:
    """As from a pipe, whose next line is read when nothing moves."""
    for line in ("step", "policy", "home"):
        desk.say(line)
        desk.settle()
    desk.leave()
    until(
        lambda: (
            [(done.words, done.refused) for done in desk.done[-2:]] == [("policy", LEFT_FIRST), ("home", LEFT_FIRST)]
        )
    )


def test_what_was_done_is_done_again_bit_for_bit(desk: Desk, made: Made, tmp_path: Path) -> None:
    operation = desk.operation
    for line in ("jog +y 25", "step", "jog +z 20", "rotate 10", "go"):
        desk.say(line)
        desk.settle()
    assert desk.now().finished == 1
    desk.say("home")
    desk.settle()
    assert all(done.well for done in operation.done)
    again = made(folder="again")
    again.repeat(read_run(tmp_path / "run", "test")[1])
    assert again.scene.floor.steps == operation.scene.floor.steps > 5 / TIME_STEP
    assert poses(again) == poses(operation)


def test_who_leaves_breaks_off_what_is_under_way(desk: Desk) -> None:
    desk.say("speed 1")
    desk.say("run")
    until(lambda: desk.operation.scene.floor.now_s > 0.5)
    desk.leave()
    until(lambda: desk.closed and not desk.busy)
    report = desk.operation.report()
    assert report is not None
    assert report.outcome.interrupted
    assert report.outcome.failure == "the operator left before its end"
