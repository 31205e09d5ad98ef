"""What the page is told of a run: the plan beside what was done, and what may be said next."""

import json
from dataclasses import astuple

import numpy as np
import pytest

from lab.advice.advisors import Person
from lab.learning.requests import TooSlow
from lab.learning.session_events import Improvement
from lab.learning.settings import GateSettings
from lab.production.controls import Controls
from lab.production.operation.desk import RunDesk
from lab.production.run_journal import RunJournal
from lab.seat.page.page_console import bars_of, changed_by, held_of, made_until, measured_of, plan_of, run_of
from lab.seat.page.page_question import question_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.methods.srl_advised import advised_srl
from lab.sequencing.search import Search, SequenceRequest
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run
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


# ---- page order -------------------------------------------------------------------------------------------------------


def request_after(*decisions: int, episode: int = 30) -> SequenceRequest:
    """Where the thesis's case I with 3 toasts stands after these decisions."""
    run = follow(load_cell("toast-case-1").cell(3), decisions)
    return SequenceRequest(
        run=run,
        allowed=run.allowed(),
        own=run.allowed()[0],
        episode=episode,
        reason=TooSlow(0.012, 0.05),
        improvement=Improvement(0.012, 606.0, 613.4),
        step=1,
        state=0,
    )


def test_a_question_lists_the_allowed_moves() -> None:
    asked = question_of(request_after(1))
    assert asked["title"] == "Episode 30, 57 s: the robot is at toaster"
    assert (asked["kind"], asked["own"], asked["why"], asked["rate"]) == ("order", 1, str(TooSlow(0.012, 0.05)), 0.012)
    assert asked["moves"][0] == {
        "action": 1,
        "label": "toast 1",
        "from": "toaster",
        "to": "butter_applier",
        "ready_s": 60.0,
        "direction": None,
    }
    assert [(move["label"], move["ready_s"]) for move in asked["moves"][1:]] == [("toast 2", 0.0), ("toast 3", 0.0)]


def moves_of(*decisions: int) -> list[Move]:
    run = Run(load_cell("toast-case-1").cell(3))
    return [run.move(decision) for decision in decisions]


def test_the_moves_of_a_whole_session_lead_to_where_each_question_is() -> None:
    cell = load_cell("toast-case-2").cell(3)
    asked = []

    def ask(request: SequenceRequest) -> int | None:
        moves = made_until(request)
        assert (moves[-1].drop_s if moves else 0.0) == request.run.now_s
        asked.append(len(moves))
        return None if len(asked) % 3 == 0 else request.allowed[-1]

    gate = GateSettings("always", first_episode=1)
    advised_srl(cell, Search(6), np.random.default_rng(0), gate, Person(ask))
    assert len(asked) > 20
    assert max(asked) > 5


@pytest.mark.parametrize(("name", "order"), [("toast-case-1", 3), ("fms", ("rook", "rook"))])
def test_bars_are_those_of_the_schedule(name: str, order: int | tuple[str, ...]) -> None:
    """Robot and machines, beside the schedule that the sequencers make: always the last part that may be moved."""
    cell = load_cell(name).cell(order)
    run, decisions = Run(cell), list[int]()
    while allowed := run.allowed():
        decisions.append(allowed[-1])
        run.move(allowed[-1])
    schedule = simulate(cell, decisions)
    run = Run(cell)
    shown = bars_of([run.move(decision) for decision in decisions])
    robot = [(bar["kind"], bar["start_s"], bar["end_s"]) for bar in shown["measured"] if bar["resource"] == "robot"]
    assert robot == [(a.kind, a.start_s, a.end_s) for a in schedule.robot]
    assert ("pallet" in {bar["kind"] for bar in shown["measured"]}) == (name == "fms")
    machines = [tuple(bar.values()) for bar in shown["measured"] if bar["resource"] != "robot"]
    assert sorted(machines) == sorted(astuple(activity) for activity in schedule.machines)
    assert shown["end_s"] == schedule.makespan_s == shown["now_s"]


def test_work_under_way_reaches_beyond_now() -> None:
    shown = bars_of(moves_of(1))
    assert (shown["now_s"], shown["end_s"]) == (57.0, 117.0)  # 60 s in the toaster
    assert shown["rows"] == ["robot", "toaster"]
    assert bars_of([]) == {"rows": ["robot"], "measured": [], "now_s": 0.0, "end_s": 0.0}
