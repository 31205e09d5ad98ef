"""A run's replay tells what the run told."""

from lab.production.faults.fault import Happened
from lab.production.outcome import Outcome
from lab.production.report import story_of
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.teaching.events import MoveBegan, PartDone, PhaseBegan, PlanMade, RunHeld, RunWentOn, SkillBegan, TroubleMet

WAIT = Activity("robot", "wait", 1, "toaster", "toaster", 4.0, 64.0)
MOMENT = Activity("robot", "wait", 1, "plate", "plate", 1.0, 1.1)
STORE = Activity("slice 1", "store", 1, "plate", "plate", 0.0, 2.0)
MEASURED = Schedule((MOMENT, WAIT), (), (STORE,), 64.0, (1,))


def test_what_was_told_is_in_words_and_what_went_wrong_is_marked() -> None:
    heard = (
        PhaseBegan("carry out", 1),
        PlanMade(MEASURED, 1, 0.0, True, 0.0),
        MoveBegan(1, 2, "slice 1", "home", "plate", "toaster", 0.0),
        SkillBegan("grasp", "grasps slice 1 at 'plate'", "slice 1", 1.5),
        RunHeld("emergency", "pressed by hand", "operator", 2.0),
        RunWentOn(3.0),
        TroubleMet("it is not there", "takes it up where it lies", "slice 1", "plate", 3.5),
        PartDone("slice 1", 70.0),
    )
    slipped = Happened("slip", "slice 1 slipped", 3.4, "slice 1")
    outcome = Outcome(MEASURED, (1,), (), (), None, 70.0, (), happened=(slipped,), heard=heard)
    story = story_of(outcome, None)
    assert dict(sorted(story.captions)) == {
        0.0: "The robot brings slice 1 from 'plate' to 'toaster'",
        1.5: "The robot grasps slice 1 at 'plate'",
        2.0: "emergency stop by the operator: pressed by hand",
        3.0: "The run goes on",
        3.5: "slice 1: it is not there; takes it up where it lies",
        4.0: "The robot waits at 'toaster' for slice 1",
        70.0: "slice 1 is done",
    }
    assert [(mark.at_s, mark.kind) for mark in story.marks] == [(2.0, "stop"), (3.5, "trouble"), (3.4, "fault")]
    assert story.begins_s == (0.0,)
