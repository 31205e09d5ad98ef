"""What the page is told of a run: the plan beside what was done, and what may be said next."""

import json

import pytest

from lab.production.controls import Controls
from lab.production.operation.desk import RunDesk
from lab.production.run_journal import RunJournal
from lab.seat.page.page_console import changed_by, held_of, measured_of, plan_of, run_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.follow import follow, simulate
from lab.tasks.task_file import load, load_cell
from lab.teaching.events import Event, MachineBegan, MoveBegan, MoveMade, PlanMade, SkillBegan


@pytest.fixture
def desk() -> RunDesk:
    task = load("toast")
    return RunDesk(task, task.ordered(1), Controls(), RunJournal(), lambda event: None)


def test_the_plan_and_what_was_done_are_those_of_robot_and_machines(desk: RunDesk) -> None:
    cell = load_cell("toast-case-1").cell(1)
    schedule = simulate(cell, [1] * len(follow(cell, ()).allowed() * 3))
    move = Move(1, "plate", "plate", "toaster", 0.0, 2.0, 2.0, 10.0, 40.0)
    happened: list[Event] = [
        PlanMade(schedule, 3, 0.0, True, 0.0),
        MoveBegan(1, 3, "slice 1", "plate", "plate", "toaster", 0.0),
        SkillBegan("grasp at plate", "takes slice 1 up at 'plate'", "slice 1", 2.0),
        MachineBegan("toaster", "slice 1", 10.0, 50.0),
        MoveMade(move, "slice 1"),
    ]
    for event in happened:
        desk.hear(event)
    plan, run = plan_of(desk), run_of(desk)
    assert plan is not None
    assert run is not None
    assert (plan["makespan_s"], plan["proven"]) == (schedule.makespan_s, True)
    assert {row["resource"] for row in plan["rows"]} == {"robot", "toaster", "butter_applier"}
    assert [row["kind"] for row in measured_of(desk)] == ["empty", "carry"]
    toaster = next(one for one in run["machines"] if one["station"] == "toaster")
    assert (toaster["light"], toaster["since_s"], toaster["until_s"], toaster["worked_s"]) == ("busy", 10.0, 50.0, None)
    assert run["parts"] == [{"name": "slice 1", "kind": "slice", "station": "toaster", "state": "in machine"}]
    json.dumps([run, plan, measured_of(desk)], allow_nan=False)
    assert [changed_by(event) for event in happened[:2]] == [("run", "plan"), ("run",)]
    assert changed_by(happened[-1]) == ("run", "measured")


def test_what_may_be_said_next_depends_on_what_stops_it(desk: RunDesk) -> None:
    assert held_of(desk) == {"kind": "", "speed": None}
    desk.say("pause")
    assert (held_of(desk)["kind"], held_of(desk)["next"]) == ("pause", "go")
    desk.controls.protective("a part is lost")
    assert (held_of(desk)["why"], held_of(desk)["by"], held_of(desk)["next"]) == ("a part is lost", "robot", "go")
    desk.say("stop", "onlooker")
    assert (held_of(desk)["kind"], held_of(desk)["by"], held_of(desk)["next"]) == ("emergency", "onlooker", "reset")


def test_before_there_is_a_run_there_is_nothing() -> None:
    assert (run_of(None), plan_of(None), measured_of(None)) == (None, None, [])
