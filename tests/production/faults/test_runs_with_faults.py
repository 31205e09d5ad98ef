"""Whole runs of two toasts in physics in which something goes wrong: what comes of each, and what is said of it."""

from typing import Any

import pytest

from lab.production.composer import Conditions, carry_out
from lab.production.outcome import Outcome
from lab.production.taught import Relearner, Taught
from lab.sequencing.methods.exact import optimum
from lab.skills.prepared_scene import Prepared
from lab.tasks.fault_fields import FaultFields
from lab.teaching.events import TroubleMet
from lab.teaching.teacher import Teacher

NAMES = ("slice 1", "slice 2")


@pytest.fixture
def run_with(two_toasts: tuple[Prepared, Taught], teacher: Teacher) -> Any:
    prepared, taught = two_toasts
    sequence = optimum(taught.cell).sequence

    def run(*faults: dict[str, Any]) -> Outcome:
        conditions = Conditions(faults=tuple(FaultFields.model_validate(fields) for fields in faults))
        relearner = Relearner(prepared, taught, teacher)
        return carry_out(prepared, taught.cell, sequence, conditions, relearner=relearner)[0]

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    [
        {"what": "part moved", "part": "slice 2", "by_m": [0.0, 0.08]},
        {"what": "part dropped", "by_m": [0.1, 0.0], "at_s": 8},
        {"what": "station moved", "station": "toaster", "by_m": [0.02, 0.0], "at_s": 20},
        {"what": "camera blind", "at_s": 5, "seconds": 20},
    ],
    ids=lambda fault: fault["what"],
)
def test_both_are_made_all_the_same(run_with: Any, fault: dict[str, Any]) -> None:
    outcome = run_with(fault)
    verdict = outcome.verdict(NAMES)
    assert len(outcome.happened) == 1
    assert (outcome.failure, outcome.delivered, verdict.came) == (None, (1, 2), "delivered")
    assert verdict.rows[0]["noticed"]
    assert verdict.unexplained == ()


@pytest.mark.parametrize(
    ("fault", "delivered", "said"),
    [
        ({"what": "part gone", "part": "slice 1"}, (2,), "slice 1 is nowhere on the table"),
        ({"what": "part dropped", "part": "slice 1", "at_m": [1.36, 1.34]}, (2,), "out of reach"),
        ({"what": "machine fails", "station": "toaster"}, (), "after it should be"),
    ],
    ids=lambda value: value["what"] if isinstance(value, dict) else "",
)
def test_what_cannot_be_made_is_left_and_said(
    run_with: Any, fault: dict[str, Any], delivered: tuple[int, ...], said: str
) -> None:
    outcome = run_with(fault)
    assert outcome.delivered == delivered
    assert said in outcome.failure
    assert outcome.verdict(NAMES).came == "stopped"


@pytest.mark.slow
def test_what_nobody_saw_is_said(run_with: Any) -> None:
    """While the camera is covered a slice is taken out of the toaster, too soon: it is not found blindly, and not passed off."""
    outcome = run_with(
        {"what": "camera blind", "at_s": 20, "seconds": 60},
        {"what": "part moved", "when": "in machine", "by_m": [0.0, -0.2], "at_s": 40},
    )
    assert [one.undone for one in outcome.happened] == [False, True]
    assert any(why.endswith("is not where it was, and the camera sees nothing") for why in outcome.retries)
    assert any(
        why.endswith("was taken out of 'toaster': whether it was done there was not seen") for why in outcome.retries
    )
    assert outcome.verdict(NAMES).unexplained == ()


@pytest.mark.slow
def test_the_schedule_says_how_long_a_slow_machine_took(run_with: Any) -> None:
    outcome = run_with({"what": "machine slow", "station": "toaster", "share": 1.5})
    toasted = [
        row.end_s - row.start_s
        for row in outcome.schedule.machines
        if (row.resource, row.kind) == ("toaster", "process")
    ]
    assert toasted == pytest.approx([90.0, 90.0], abs=0.1)
    assert outcome.delivered == (1, 2)
    assert outcome.audit.findings == ()


@pytest.mark.slow
@pytest.mark.parametrize(("station", "at_s"), [("toaster", 5), ("toaster", 78), ("butter_applier", 81)])
def test_what_cannot_be_brought_on_is_set_down_and_goes_on_when_the_way_is_free(
    run_with: Any, station: str, at_s: float
) -> None:
    """A strange part comes into a machine while slice 1 is in the gripper: that is put back on the plate, or from the toaster on
    the table, and the strange part is set aside."""
    outcome = run_with({"what": "station full", "station": station, "at_s": at_s})
    answers = [event.answer for event in outcome.heard if isinstance(event, TroubleMet)]
    assert answers == ["sets it down again", "sets it aside"]
    assert (outcome.failure, outcome.delivered) == (None, (1, 2))
    assert outcome.verdict(NAMES).came == "delivered"
