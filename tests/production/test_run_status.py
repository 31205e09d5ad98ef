"""Where a run stands, folded from what it tells: a run of one slice redone by hand."""

import json

import pytest

from lab.production.run_status import MOST_KEPT, RunStatus
from lab.sequencing.cell.schedule import Activity, Move, Schedule
from lab.tasks.task_file import load
from lab.teaching.events import (
    Event,
    MachineBegan,
    MachineDone,
    MachineFailed,
    MoveBegan,
    MoveMade,
    OperatorActed,
    PartDone,
    PartLost,
    PhaseBegan,
    PlanMade,
    RunHeld,
    RunWentOn,
    SkillBegan,
    TroubleMet,
)


@pytest.fixture
def status() -> RunStatus:
    task = load("toast")
    return RunStatus.of(task, task.ordered(2))


def tell(status: RunStatus, *events: Event) -> None:
    for event in events:
        status.hear(event)


# The robot goes to the plate in 2 s, takes the slice to the toaster until 10 s; it toasts until 50 s; fetched at 60 s.
FIRST = (
    MoveBegan(1, 3, "slice 1", "finished_plate", "plate", "toaster", 0.0),
    SkillBegan("grasp at plate", "takes slice 1 up at 'plate'", "slice 1", 2.0),
    SkillBegan("transfer plate to toaster", "carries slice 1 from 'plate' to 'toaster'", "slice 1", 4.0),
    MachineBegan("toaster", "slice 1", 10.0, 50.0),
    MoveMade(Move(1, "finished_plate", "plate", "toaster", 0.0, 2.0, 4.0, 10.0, 40.0), "slice 1"),
)


def test_before_anything_has_begun_parts_wait_and_machines_are_idle(status: RunStatus) -> None:
    told = status.to_json()
    assert told["parts"][0] == {"name": "slice 1", "kind": "slice", "station": "plate", "state": "waiting"}
    assert {m["light"] for m in told["machines"]} == {"idle"}
    assert (told["move"], told["moves"], told["finished"], told["plan"], told["held"]) == (0, 0, 0, None, None)


def test_the_robot_goes_to_the_part_and_then_where_it_brings_it(status: RunStatus) -> None:
    tell(status, *FIRST[:2])
    assert (status.next_station, status.part("slice 1").state, status.move, status.moves) == (
        "plate",
        "waiting",
        1,
        3,
    )
    tell(status, FIRST[2])
    assert (status.next_station, status.part("slice 1").state) == ("toaster", "carried")
    assert status.words == "carries slice 1 from 'plate' to 'toaster'"
    tell(status, *FIRST[3:])
    assert (status.part("slice 1").state, status.part("slice 1").station) == ("in machine", "toaster")


def test_a_machine_is_busy_done_and_idle_again(status: RunStatus) -> None:
    tell(status, *FIRST)
    toaster = status.machine("toaster")
    assert (toaster.light, toaster.part, toaster.until_s) == ("busy", "slice 1", 50.0)
    status.now_s = 30.0
    assert status.so_far()[-1] == Activity("toaster", "process", 1, "toaster", "toaster", 10.0, 30.0)
    tell(status, MachineDone("toaster", "slice 1", 50.0))
    assert toaster.light == "done"
    tell(status, MoveMade(Move(1, "toaster", "toaster", "finished_plate", 10.0, 10.0, 60.0, 70.0), "slice 1"))
    tell(status, PartDone("slice 1", 70.0))
    assert (toaster.light, toaster.part) == ("idle", "")
    machine = [a for a in status.so_far() if a.resource == "toaster"]
    assert [(a.kind, a.start_s, a.end_s) for a in machine] == [("process", 10.0, 50.0), ("blocked", 50.0, 60.0)]
    assert (status.finished, status.part("slice 1").state, status.now_s) == (1, "done", 70.0)


def test_a_machine_with_room_for_two_shows_each_part_with_its_own_time() -> None:
    task = load("toast")
    roomy = [s.model_copy(update={"capacity": 2}) if s.name == "toaster" else s for s in task.stations]
    status = RunStatus.of(task.model_copy(update={"stations": tuple(roomy)}), task.ordered(2))
    tell(status, *FIRST, MachineBegan("toaster", "slice 2", 20.0, 60.0), MachineDone("toaster", "slice 1", 50.0))
    told = next(m for m in status.to_json()["machines"] if m["station"] == "toaster")
    first = {"light": "done", "part": "slice 1", "until_s": 50.0}
    second = {"light": "busy", "part": "slice 2", "until_s": 60.0}
    assert told == {"station": "toaster", **first, "parts": [first, second]}
    tell(status, MoveMade(Move(1, "toaster", "toaster", "finished_plate", 10.0, 10.0, 55.0, 58.0), "slice 1"))
    told = next(m for m in status.to_json()["machines"] if m["station"] == "toaster")
    assert told == {"station": "toaster", **second}
    tell(status, MoveMade(Move(2, "toaster", "toaster", "finished_plate", 58.0, 58.0, 61.0, 65.0), "slice 2"))
    told = next(m for m in status.to_json()["machines"] if m["station"] == "toaster")
    assert told == {"station": "toaster", "light": "idle", "part": "", "until_s": None}
    toasted = [(a.part, a.start_s, a.end_s) for a in status.so_far() if (a.resource, a.kind) == ("toaster", "process")]
    assert toasted == [(1, 10.0, 50.0), (2, 20.0, 61.0)]


def test_what_is_brought_to_a_full_machine_takes_the_place_of_what_was_there(status: RunStatus) -> None:
    tell(status, *FIRST, MachineBegan("toaster", "slice 2", 70.0, 110.0))
    assert [m.part for m in status.machines if m.station == "toaster"] == ["slice 2"]


def test_a_machine_that_failed_and_a_part_that_is_lost_stay_so(status: RunStatus) -> None:
    tell(
        status, *FIRST, MachineFailed("toaster", "slice 1", "it is not done", 99.0), PartLost("slice 1", "burnt", 99.0)
    )
    assert (status.machine("toaster").light, status.part("slice 1").state) == ("failed", "lost")
    assert status.finished == 0


def test_stops_troubles_and_commands_are_shown(status: RunStatus) -> None:
    tell(status, RunHeld("emergency", "pressed by hand", "operator", 5.0))
    assert status.to_json()["held"] == {"kind": "emergency", "why": "pressed by hand", "by": "operator"}
    tell(status, RunWentOn(6.0), TroubleMet("it slipped", "tries again", "slice 1", "toaster", 7.0))
    assert status.held is None
    assert status.to_json()["trouble"] == [
        {"what": "slice 1 at 'toaster': it slipped", "answer": "tries again", "at_s": 7.0}
    ]
    for number in range(MOST_KEPT + 5):
        tell(status, OperatorActed(f"jog +x {number}", "operator", 8.0, ""))
    assert len(status.acted) == MOST_KEPT
    assert status.acted[-1].words == f"jog +x {MOST_KEPT + 4}"


def test_a_new_plan_counts_the_moves_that_are_made(status: RunStatus) -> None:
    tell(status, PhaseBegan("carry out", 3), *FIRST)
    plan = Schedule((Activity("robot", "wait", 1, "toaster", "toaster", 10.0, 50.0),), (), (), 90.0, (1, 1))
    tell(status, PlanMade(plan, 2, 0.0, True, 12.0, "slice 2 was moved"))
    assert (status.moves, status.phase) == (3, "carry out")
    told = json.loads(json.dumps(status.to_json(), allow_nan=False))
    assert (told["plan"]["makespan_s"], told["plan"]["why"], len(told["plan"]["rows"])) == (
        90.0,
        "slice 2 was moved",
        1,
    )


def test_a_copy_stands_still(status: RunStatus) -> None:
    tell(status, *FIRST[:1])
    before = status.copied()
    tell(status, *FIRST[1:], PartDone("slice 1", 11.0))
    assert (before.part("slice 1").state, before.machine("toaster").light, before.measured) == ("waiting", "idle", [])
