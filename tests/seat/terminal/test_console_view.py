"""The console's panel in text: it fits, and no light is told by its colour alone."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.production.run_status import HeldStatus, PlanStatus, RunStatus
from lab.seat.terminal.console_view import LIGHTS, NOTICE, plain_lines, row_of, view
from lab.sequencing.cell.schedule import Activity, Move
from lab.tasks.task_file import load
from lab.teaching.events import MachineBegan, MachineFailed, MoveBegan, MoveMade, SkillBegan, TroubleMet


def status() -> RunStatus:
    """Half-way: slice 1 is in the toaster, the robot fetches slice 2."""
    task = load("toast")
    made = RunStatus.of(task, task.ordered(2))
    move = Move(1, "plate", "plate", "toaster", 0.0, 0.0, 4.0, 10.0, 40.0)
    for event in (
        MoveBegan(1, 6, "slice 1", "plate", "plate", "toaster", 0.0),
        MachineBegan("toaster", "slice 1", 10.0, 50.0),
        MoveMade(move, "slice 1"),
        MoveBegan(2, 6, "slice 2", "toaster", "plate", "toaster_buffer", 10.0),
        SkillBegan("transfer toaster to plate", "goes from 'toaster' to 'plate'", "slice 2", 10.0),
        TroubleMet("it slipped", "tries again", "slice 2", "plate", 12.0),
    ):
        made.hear(event)
    rows = [
        Activity("robot", "carry", 1, "plate", "toaster", 0.0, 10.0),
        Activity("toaster", "process", 1, "toaster", "toaster", 10.0, 50.0),
    ]
    made.plan = PlanStatus(50.0, 0.02, True, "slice 2 was moved", rows)
    made.now_s = 20.0
    return made


def shown(made: RunStatus, width: int = 80, height: int = 22) -> str:
    return "\n".join(line.plain for line in view(made, "run", width, height))


def test_what_the_operator_wants_to_know_is_there() -> None:
    text = shown(status())
    for words in (
        "goes from 'toaster' to 'plate'",
        "step 2 of 6, next station plate; 0 of 2 finished",
        "(>) busy   toaster: slice 1, until 50 s (30 s more)",
        "( ) idle   butter_applier",
        "slice 1 in machine, slice 2 waiting at plate",
        "slice 2 at 'plate': it slipped: tries again",
        "plan 50.0 s, 2.0 % above the optimum (slice 2 was moved)"[:40],
        NOTICE,
    ):
        assert words in text


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("pause", "PAUSED  ready? (go goes on)"),
        ("protective", "PROTECTIVE STOP  ready? (go goes on)"),
        ("emergency", "EMERGENCY STOP  ready? (reset, then go)"),
    ],
)
def test_a_stop_is_told_with_its_reason_and_what_to_do(kind: str, words: str) -> None:
    made = status()
    made.held = HeldStatus(kind, "ready?", "operator")
    assert words in shown(made)


def test_a_failed_machine_is_told_in_words_and_lights_differ_without_colour() -> None:
    made = status()
    made.hear(MachineFailed("toaster", "slice 1", "it is not done", 60.0))
    assert "(!) failed toaster: slice 1" in shown(made)
    assert len({sign for sign, _ in LIGHTS.values()}) == len(LIGHTS)
    assert "machine toaster: failed: slice 1" in plain_lines(made)


@given(st.integers(20, 200), st.integers(1, 60))
def test_it_fits_any_screen(width: int, height: int) -> None:
    lines = view(status(), "run", width, height)
    assert len(lines) <= height
    assert max(line.cell_len for line in lines) <= width


def test_a_row_of_the_chart_by_hand() -> None:
    row = [
        Activity("robot", "empty", None, "a", "b", 0.0, 2.0),
        Activity("robot", "wait", 1, "b", "b", 2.0, 4.0),
        Activity("robot", "carry", 1, "b", "c", 4.0, 8.0),
    ]
    assert row_of(row, 10, 10.0) == "--..1###  "


@given(st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), max_size=6), st.integers(1, 120))
def test_a_row_keeps_its_width(spans: list[tuple[float, float]], room: int) -> None:
    row = [Activity("robot", "carry", 12, "a", "b", min(s), max(s)) for s in spans]
    assert len(row_of(row, room, 100.0)) == room
