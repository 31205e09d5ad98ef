"""A run that carries itself out, steered in words: what it takes, what it refuses, what is written, who attends it."""

from pathlib import Path

import pytest

from lab.production.composer import Conditions
from lab.production.controls import RESET_FIRST, Controls, StopKind, StopsChanged
from lab.production.floor import Floor, Hooks
from lab.production.operation.desk import WORDS, RunDesk
from lab.production.run import run
from lab.production.run_journal import Commanded, RunBegan, RunEnded, RunJournal, Stopped, read_run
from lab.sim.world import World
from lab.skills.prepared_scene import prepare
from lab.tasks.task import Task
from lab.teaching.events import Event, MoveBegan, MoveMade, OperatorActed, RunHeld
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox


@pytest.fixture
def desk(brisk: Task, heard: list[Event]) -> RunDesk:
    return RunDesk(brisk, brisk.ordered(1), Controls(), RunJournal(), heard.append)


def test_stops_and_pace_are_taken_and_nothing_else(desk: RunDesk, heard: list[Event]) -> None:
    assert set(WORDS) == {"pause", "step", "go", "stop", "reset", "speed"}
    assert desk.say("STOP").well
    assert (desk.controls.held.kind, desk.now().held.kind) == (StopKind.EMERGENCY, "emergency")  # type: ignore[union-attr]
    for line, why in (
        ("go", RESET_FIRST),
        ("step", RESET_FIRST),
        ("jog +x 10", "jog: this run carries itself out and takes pause, step, go, stop, reset, speed"),
        ("spede 4", "did you mean 'speed'?"),
        ("speed 1000", "allowed are 0.1 to 100"),
    ):
        assert why in desk.say(line).refused
    assert desk.say("reset").well
    assert desk.say("speed 4").well
    assert desk.say("go").well
    assert (desk.controls.stops, desk.now().held, desk.now().speed) == ({}, None, 4.0)
    assert [done.words for done in desk.done] == [event.words for event in heard if isinstance(event, OperatorActed)]
    assert desk.say("reset", "onlooker").refused == "no emergency stop is pressed"


def test_somebody_attends_it_as_long_as_a_page_is_open(desk: RunDesk) -> None:
    attended = []
    for pages in (0, 2, 0):
        desk.watched(pages)
        attended.append(desk.controls.attended)
    assert attended == [False, True, False]


@pytest.mark.slow
def test_what_is_said_while_it_moves_and_while_it_waits_is_in_the_journal(
    brisk: Task, toolbox: Toolbox, tmp_path: Path
) -> None:
    """The run itself says the words: stop in the first move, reset and go while it is held, pause and step after it."""
    journal, folder = RunJournal.begin(tmp_path, RunBegan({}, "toast", "")), tmp_path
    prepared, told = prepare(brisk, brisk.ordered(1), 0), list[Event]()

    steered = RunDesk(brisk, prepared.order, Controls(), journal, lambda event: hear(event))

    def hear(event: Event) -> None:
        told.append(event)
        steered.hear(event)
        if isinstance(event, MoveBegan) and event.number == 1:
            assert steered.say("stop").well
        if isinstance(event, MoveMade) and steered.controls.held is None:
            assert steered.say("pause").well
        if isinstance(event, RunHeld) and event.kind == "emergency":
            assert steered.say("reset").well
            assert steered.say("go").well
        if isinstance(event, RunHeld) and event.kind == "pause":
            assert steered.say("go").well

    conditions = steered.steering(Conditions(1.0, None, steered.controls, journal))
    report = run(prepared, Teacher(toolbox, tell=hear), folder, conditions)
    journal.close()
    assert report.success
    entries = read_run(folder, "test")[1]
    commands = [entry for entry in entries if isinstance(entry, Commanded)]
    assert [entry.words for entry in commands][:3] == ["stop", "reset", "go"]
    assert "pause" in [entry.words for entry in commands]
    assert [entry.step for entry in commands] == sorted(entry.step for entry in commands)
    assert isinstance(entries[-1], RunEnded)
    assert any(isinstance(entry, Stopped) and entry.stops for entry in entries)
    assert any(isinstance(event, OperatorActed) for event in report.outcome.heard)


def test_a_protective_stop_waits_for_who_attends_and_is_done_again_without_them(brisk: Task) -> None:
    prepared, noted = prepare(brisk, brisk.ordered(1), 0), list[StopsChanged]()
    scene = prepared.skillset, prepared.layout, prepared.order
    controls = Controls()

    def go_on(event: Event, step: int) -> None:
        if isinstance(event, RunHeld):
            controls.go_on()

    with World() as world:
        floor = Floor(world, *scene, controls=controls, hooks=Hooks(hear=go_on, note_stops=noted.append))
        assert not floor.protected("it presses")
        assert noted == []
        controls.attended = True
        assert floor.protected("it presses")
    assert [[held.why for held in one.stops] for one in noted] == [["it presses"], []]
    with World() as world:
        floor = Floor(world, *scene)
        floor.stops.again([*noted], noted[-1].step)
        assert floor.protected("it presses")
        assert (floor.steps, floor.controls.held) == (noted[-1].step, None)
