"""A scripted person in whole runs of two toasts: comes when a run has stopped, does what it asks for, and it goes on."""

from typing import Any

import pytest

from lab.production.composer import Conditions, carry_out
from lab.production.outcome import Outcome
from lab.production.taught import Relearner, teach_all
from lab.sequencing.methods.exact import optimum
from lab.skills.prepared_scene import prepare
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task_file import load
from lab.teaching.events import MachineBegan, PartDone
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab_studies.comparisons.attendant import COMES_AFTER_S, MOST_CALLS, Attendant


@pytest.fixture(scope="module")
def run_with(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Seconds: the skills are learned once."""
    teacher = Teacher(Toolbox(tmp_path_factory.mktemp("box")))
    task = load("toast")
    prepared = prepare(task, task.ordered(parts="slice=2"), 0)
    taught = teach_all(prepared, teacher)
    sequence = optimum(taught.cell).sequence

    def run(person: Attendant, *faults: dict[str, Any]) -> Outcome:
        drawn = tuple(FaultFields.model_validate(fields) for fields in faults)
        conditions = Conditions(faults=drawn, controls=person, on_floor=person.on_floor, before_step=person.before_step)
        return carry_out(prepared, taught.cell, sequence, conditions, relearner=Relearner(prepared, taught, teacher))[0]

    return run


@pytest.mark.parametrize(
    ("fault", "asked", "did"),
    [
        (
            {"what": "part gone", "part": "slice 1", "when": "standing"},
            "slice 1 is nowhere on the table",
            "stood slice 1 up",
        ),
        (
            {"what": "part gone", "part": "slice 1", "when": "in machine", "at_s": 40},
            "bring it back",
            "stood slice 1 up",
        ),
        ({"what": "part fallen", "part": "slice 2", "at_s": 5}, "slice 2 lies on its side", "stood slice 2 up"),
        ({"what": "part dropped", "part": "slice 1", "at_m": [1.36, 1.34]}, "out of reach", "stood slice 1 up"),
        ({"what": "machine fails", "station": "toaster", "at_s": 30}, "after it should be", "repaired 'toaster'"),
    ],
    ids=("gone", "gone from a machine", "fallen", "out of reach", "machine"),
)
def test_a_run_goes_on_to_its_end_once_a_person_has_put_right_what_it_asks_for(
    run_with: Any, fault: dict[str, Any], asked: str, did: str
) -> None:
    """The frames show it: the audit finds nothing."""
    person = Attendant()
    outcome = run_with(person, fault)
    assert len(outcome.happened) == 1
    assert len(person.asked) == 1
    assert asked in person.asked[0]
    assert person.did == [did]
    assert (outcome.failure, outcome.delivered, outcome.audit.findings) == (None, (1, 2), ())
    assert outcome.sim_s > COMES_AFTER_S


def test_what_a_machine_had_not_finished_it_begins_anew(run_with: Any) -> None:
    """A slice is taken out of the toaster after some 20 of its 60 s; brought back, it is toasted for all 60."""
    outcome = run_with(Attendant(), {"what": "part gone", "part": "slice 1", "when": "in machine", "at_s": 40})
    assert outcome.happened[0].undone
    began = [
        e.at_s for e in outcome.heard if isinstance(e, MachineBegan) and (e.station, e.part) == ("toaster", "slice 1")
    ]
    assert len(began) == 2
    assert began[1] > outcome.happened[0].at_s


def test_a_part_that_is_brought_back_does_not_come_where_another_one_stands_by_then(run_with: Any) -> None:
    """Slice 1 is taken from the plate at the end; slice 2 comes to its spot, and slice 1 to the next one."""
    person = Attendant()
    outcome = run_with(person, {"what": "part gone", "part": "slice 1", "when": "standing", "at_s": 150})
    delivered = [e for e in outcome.heard if isinstance(e, PartDone) and e.at_s < outcome.happened[0].at_s]
    assert [event.part for event in delivered] == ["slice 1"]
    assert len(person.asked) == 1
    assert (outcome.failure, outcome.delivered, outcome.audit.findings) == (None, (1, 2), ())


def test_of_two_parts_that_go_into_one_machine_again_the_second_waits(run_with: Any) -> None:
    """Slice 1 is taken out of the toaster, which then fails with slice 2 in it; both are to be toasted after that."""
    person = Attendant()
    gone = {"what": "part gone", "part": "slice 1", "when": "in machine", "at_s": 40}
    outcome = run_with(person, gone, {"what": "machine fails", "station": "toaster", "at_s": 60})
    assert person.did == ["repaired 'toaster'", "stood slice 1 up"]
    assert len(person.asked) == 1
    assert (outcome.failure, outcome.delivered, outcome.audit.findings) == (None, (1, 2), ())


def test_a_person_who_helps_in_vain_is_not_called_for_ever(run_with: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Attendant, "_put_right", lambda self, floor, why: iter(()))
    person = Attendant()
    outcome = run_with(person, {"what": "machine fails", "station": "toaster", "at_s": 30})
    assert 1 <= len(person.asked) <= MOST_CALLS
    assert "after it should be" in outcome.failure
    assert outcome.verdict(("slice 1", "slice 2")).came == "stopped"
