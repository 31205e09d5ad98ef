"""A reason is true when a fault that had struck makes it so: of the right kind, about the right thing, and in time."""

import pytest

from lab.production.faults import FAULTS
from lab.production.faults.fault import Happened
from lab.production.faults.truth import CLAIMS, explained, pieces, untrue, verdict
from lab.teaching.events import MachineBegan, TroubleMet

MOVED = Happened("part moved", "slice 1 was moved by 0.06 m from 'plate'", 10.0, part="slice 1", station="plate")
PUSHED = Happened("station moved", "'toaster' was moved by 0.020 m", 20.0, station="toaster")
BLIND = Happened("camera blind", "the camera saw nothing for 20 s", 30.0)


def test_claims_name_kinds_of_faults_that_there_are() -> None:
    assert {kind for _, kinds, _ in CLAIMS for kind in kinds} == set(FAULTS)


@pytest.mark.parametrize(
    ("reason", "about", "true"),
    [
        ("slice 1 is not at 'plate': seen 0.06 m away at (0.1, 0.8) m", "slice 1", True),
        ("it stands at (0.1, 0.8) m", "slice 1", True),
        ("it stands at (0.1, 0.8) m", "slice 2", False),  # of another part
        ("slice 1 is not done when it should be", "slice 1", False),  # no machine is slow
        ("the camera sees the toaster moved by 0.020 m since 'insert at toaster' was learned", "", True),
        ("the camera does not see the gripper at (0.575, -0.225) m", "", True),
        ("a part that is not of this order stands on 'toaster'", "", False),  # nobody put one there
        ("transfer plate to toaster: no path reaches the goal; the goal is enclosed by: toaster", "", True),
        ("nobody knows", "", False),
    ],
)
def test_a_reason_is_true_or_not(reason: str, about: str, true: bool) -> None:
    assert explained(reason, [MOVED, PUSHED, BLIND], part=about) is true


def test_what_is_said_before_a_fault_is_not_explained_by_it() -> None:
    assert not explained("it stands at (0.1, 0.8) m", [MOVED], "slice 1", at_s=9.0)
    assert explained("it stands at (0.1, 0.8) m", [MOVED], "slice 1", at_s=11.0)


SEEN = TroubleMet("it stands at (0.1, 0.8) m", "takes it up there", "slice 1", "plate", 12.0)


def test_a_run_is_delivered_or_stopped_or_wrong() -> None:
    assert verdict([MOVED], [SEEN], None, []).came == "delivered"
    assert (
        verdict([MOVED], [SEEN], "slice 1 at 'plate': it is out of reach at (1.3, 1.3) m", ["slice 1"]).came
        == "stopped"
    )
    silent = verdict([MOVED], [SEEN], None, ["slice 1"])
    assert (silent.came, silent.why) == ("wrong", "nothing was said of slice 1")
    lie = verdict([MOVED], [SEEN], "slice 1: it lies on its side; slice 2: it lies on its side", ["slice 1", "slice 2"])
    assert (lie.came, lie.why) == ("wrong", "no fault explains: slice 2: it lies on its side")


def test_a_part_that_another_keeps_out_is_explained_by_why_that_one_is_there() -> None:
    fallen = Happened("part fallen", "slice 1 fell", 10.0, part="slice 1", station="out")
    full = "slice {} at '{}': no spot of '{}' is free: slice {} is there"
    why = f"slice 1 lies on its side; {full.format(3, 'hot', 'hot', 2)}; {full.format(2, 'out', 'out', 1)}"
    assert verdict([fallen], [], why, ["slice 1"]).came == "stopped"
    assert untrue([*pieces(why)], [fallen]) == []
    lone = full.format(3, "hot", "hot", 2)  # why is slice 2 there?
    assert verdict([fallen], [], lone, ["slice 3"]).came == "wrong"
    assert untrue([lone], [fallen]) == [lone]


def test_a_run_in_which_nothing_struck_may_stop() -> None:
    assert (
        verdict([], [], "slice 1 at 'toaster': it is not done 60 s after it should be", ["slice 1"]).came == "stopped"
    )


def test_what_was_noticed_of_each_fault_is_told() -> None:
    moved, blind = verdict([MOVED, BLIND], [SEEN], None, []).rows
    assert (moved["noticed"], moved["answer"], moved["noticed_s"]) == (SEEN.what, SEEN.answer, 12.0)
    assert (blind["noticed"], blind["true_reason"]) == (None, BLIND.words)


def test_a_part_that_no_machine_finished_is_not_delivered() -> None:
    taken = Happened("part moved", "", 50.0, part="slice 1", station="toaster", undone=True)
    again = MachineBegan("toaster", "slice 1", 70.0, 130.0)
    assert verdict([taken], [MachineBegan("toaster", "slice 1", 40.0, 100.0)], None, []).came == "wrong"
    assert verdict([taken], [again], None, []).came == "delivered"
