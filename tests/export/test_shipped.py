"""Exports of whole runs of shipped tasks, by the reader of `job_text`: moves a transfer, and how far they are off physics."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lab.export import program_formats
from lab.export.program import Options, Program
from tests.export.job_text import Stretch, farthest, moves, script_stretches, stretches
from tests.export.test_job_text import dense, ways_of

TASKS, MOST_MOVES = ("kit", "breakfast"), 20  # a transfer


def jobs(program: Program, form: str) -> list[tuple[int, list[Stretch]]]:
    """Of each transfer, and of what came after the last one: how many moves it has, and which."""
    files = program_formats()[form].write(program, Options(any_arm=True))
    if form == "jbi":
        return [(moves(text), stretches(text)) for name, text in sorted(files.items()) if re.match(r"M\d", name)]
    (text,) = files.values()
    return [(moves(part), script_stretches(part)) for part in re.split(r"^  # \d+: .*$", text, flags=re.MULTILINE)[1:]]


def carried_out(program: Program) -> list[np.ndarray]:
    """Where physics had the tool on each way (n, 4), x, y, z [mm] from the arm's foot, Rz [degrees]."""
    across = Rotation.from_quat(program.seen[:, 3:]).apply([0.0, 1.0, 0.0])
    yaw = np.arctan2(-across[:, 0], across[:, 1])
    ways = [slice(way[0].seen_first, way[-1].seen_last) for way in ways_of(program)]
    places = 1000.0 * (program.seen[:, :3] - [0.0, 0.0, program.arm.base_up_m])
    return [np.column_stack([places[way], np.degrees(np.unwrap(yaw[way]))]) for way in ways]


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
def test_few_moves_lead_within_1_mm_and_1_degree_of_what_physics_carried_out(
    lab: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, task: str
) -> None:
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    assert lab("run", task, "--out", str(tmp_path / "run")).code == 0
    program = Program.load(tmp_path / "run")
    seen = carried_out(program)
    for form in ("jbi", "urscript"):
        read = jobs(program, form)
        counts = [count for count, _ in read[: len(program.carried.transfers)]]
        assert max(counts) <= MOST_MOVES, counts
        said = [way for _, ways in read for way in ways]
        assert len(said) == len(seen)
        for stretch, way in zip(said, seen, strict=True):
            line = stretch.sampled()
            for off in (farthest(way, line), farthest(line[::8], dense(way))):
                assert max(off) <= 1.0
