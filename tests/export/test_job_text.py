"""The jobs' text against what was driven, by a reader of its own: the moves, and what machines and gripper are told."""

import numpy as np
import pytest

from lab.export import jbi
from lab.export.commands import jobs_of
from lab.export.program import Motion, Options, Program
from tests.export.job_text import Stretch, farthest, signals, stretches


def ways_of(program: Program) -> list[tuple[Motion, ...]]:
    return [way for job in jobs_of(program) for way in job.ways]


def driven(program: Program) -> list[np.ndarray]:
    """Where the tool was told to be on each way (n, 4), x, y, z [mm] from the arm's foot, Rz [degrees]."""
    ways = [np.concatenate([program.tools(m.first, m.last) for m in way]) for way in ways_of(program)]
    foot = np.array([0.0, 0.0, program.arm.base_up_m, 0.0])
    return [(way - foot) * [1000.0, 1000.0, 1000.0, np.degrees(1.0)] for way in ways]


def dense(way: np.ndarray) -> np.ndarray:
    """A way (n, 4), which is up to 2 mm from row to row, with seven points between its rows."""
    rows = np.arange(8 * (len(way) - 1) + 1) / 8
    return np.stack([np.interp(rows, np.arange(len(way)), way[:, k]) for k in range(4)], axis=1)


def jobs(program: Program) -> dict[str, str]:
    files = jbi.write(program, Options(any_arm=True))
    return {name: text for name, text in files.items() if name.startswith("M0")}


def test_an_arc_touches_both_lines_by_hand() -> None:
    """A corner of 90 degrees at level 8: a quarter circle of 50 mm, whose middle is 20.7 mm off the corner."""
    corner = Stretch(
        [np.array([x, y, 0.0, 0.0]) for x, y in ((0.0, 0.0), (200.0, 0.0), (200.0, 200.0))], [0.0, 50.0, 0.0]
    )
    line = corner.sampled()
    gaps = np.hypot(line[:, 0] - 200.0, line[:, 1])
    assert gaps.min() == pytest.approx(50.0 * (np.sqrt(2.0) - 1.0), abs=0.01)


def test_what_the_text_says_is_within_1_mm_and_1_degree_of_what_was_driven(program: Program) -> None:
    said = [way for text in jobs(program).values() for way in stretches(text)]
    ways = driven(program)
    assert len(said) == len(ways)
    for stretch, way in zip(said, ways, strict=True):
        line = stretch.sampled()
        for off in (farthest(way, line), farthest(line[::8], dense(way))):
            assert off[0] < 0.5
            assert off[1] < 0.5


def test_a_position_or_a_level_that_is_wrong_is_seen(up6: Program) -> None:
    text = jobs(up6)["M001.JBI"]
    way = driven(up6)[1]
    assert farthest(way, stretches(text)[1].sampled())[0] < 1.0
    assert "PL=8" in text
    assert farthest(way, stretches(text.replace("PL=8", "PL=6"))[1].sampled())[0] > 5.0
    moved = text.replace("C00003=500.000", "C00003=503.000")
    assert moved != text
    assert farthest(way, stretches(moved)[1].sampled())[0] > 1.0


def test_machines_and_gripper_are_told_and_asked_in_this_order(up6: Program) -> None:
    first, second = (signals(text) for text in jobs(up6).values())
    start = ["PULSE OT#(2) T=0.50", "WAIT IN#(2)=OFF"]
    assert first == ["-", "CALL JOB:CLOSE", "PAUSE IF IN#(1)=OFF", "-", "CALL JOB:OPEN", *start, "END"]
    wait = ["-", "WAIT IN#(2)=ON", "TIMER T=1.00", "-", "TIMER T=0.25"]
    assert second == [*wait, "PULSE OT#(4) T=0.50", "WAIT IN#(3)=OFF", "END"]
