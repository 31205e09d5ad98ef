"""The three stops are kept apart: what each takes to be released, which one counts, and that waiting ends at once."""

import threading
from collections.abc import Callable

import pytest

from lab.production.controls import RESET_FIRST, Controls, Held, StopKind, StopRecord, StopsChanged


def test_nothing_is_stopped_at_first() -> None:
    controls = Controls()
    assert (controls.held, controls.holds_arm, controls.waits) == (None, False, False)
    assert controls.reset() == "no emergency stop is pressed"
    assert controls.go_on() == ""


def test_a_pause_lets_the_move_end_and_is_released_by_going_on() -> None:
    controls = Controls()
    controls.pause()
    assert (controls.held, controls.holds_arm, controls.waits) == (Held(StopKind.PAUSE), False, True)
    assert controls.go_on() == ""
    assert controls.held is None


def test_an_emergency_stop_counts_first_and_stays_until_it_is_reset() -> None:
    controls = Controls()
    controls.pause()
    controls.protective("slice 1 is lost")
    controls.emergency()
    assert controls.held == Held(StopKind.EMERGENCY, "pressed by hand", "operator")
    assert controls.go_on() == RESET_FIRST
    assert controls.step() == RESET_FIRST
    assert controls.reset() == ""
    assert controls.held == Held(StopKind.PAUSE, "after the emergency stop")  # it does not go on by itself
    assert controls.go_on() == ""
    assert controls.held is None


def test_a_protective_stop_holds_the_arm_until_going_on() -> None:
    controls = Controls()
    controls.protective("slice 1 is lost")
    assert controls.holds_arm
    assert controls.held == Held(StopKind.PROTECTIVE, "slice 1 is lost", "robot")
    assert controls.step() == "a protective stop holds the robot: go on first"
    assert controls.go_on() == ""
    assert not controls.holds_arm


def test_one_step_is_one_move() -> None:
    controls = Controls()
    controls.pause()
    assert controls.step() == ""
    assert not controls.waits
    controls.move_ended()
    assert controls.waits


@pytest.mark.parametrize(
    "change",
    [Controls.pause, Controls.emergency, lambda c: c.protective("why"), lambda c: c.set_speed(2.0)],
)
def test_whoever_waits_is_woken_by_a_change(change: Callable[[Controls], None]) -> None:
    controls = Controls()
    told: list[int] = []
    controls.on_change.append(lambda: told.append(1))
    woken = threading.Thread(target=controls.wait, args=(60.0,))
    woken.start()
    while woken.is_alive():
        change(controls)
        woken.join(0.01)
    assert told


def test_each_change_is_noted_once_with_its_step() -> None:
    controls, noted = Controls(), list[StopsChanged]()
    record = StopRecord(note=noted.append)
    assert not record.look(1, controls)
    controls.emergency()
    assert record.look(2, controls)
    assert record.look(3, controls)
    controls.reset()
    record.look(9, controls)
    assert not record.holds_arm
    controls.go_on()
    assert not record.look(12, controls)
    assert [one.step for one in noted] == [2, 9, 12]
    assert noted[-1].stops == ()


def test_what_was_noted_is_done_again_at_the_same_steps() -> None:
    """Pressed at step 2, reset at 9, gone on at 12; the journal knows the run until step 20."""
    stop, pause = Held(StopKind.EMERGENCY), Held(StopKind.PAUSE)
    script = [StopsChanged(2, (stop,)), StopsChanged(9, (pause,)), StopsChanged(12, ())]
    controls, record = Controls(), StopRecord()
    record.again([*script], 20)
    held = [step for step in range(30) if record.look(step, controls) and record.holds_arm]
    assert held == [*range(2, 9)]
    assert not record.folding
    assert controls.held is None


def test_a_run_that_was_held_when_it_broke_off_is_held_again() -> None:
    controls, record = Controls(), StopRecord()
    record.again([StopsChanged(2, (Held(StopKind.EMERGENCY, "smoke"),))], 5)
    assert [record.look(step, controls) for step in range(7)] == [False, False, True, True, True, True, True]
    assert controls.held == Held(StopKind.EMERGENCY, "smoke")
    assert not record.folding
