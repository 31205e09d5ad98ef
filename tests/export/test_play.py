"""How far a played tool is off the run's: by hand, and of files with something wrong in them, which must not go unnoticed."""

from math import radians

import numpy as np
import pytest

from lab.errors import BadInput
from lab.export import jbi, trajectory_csv
from lab.export.commands import Path
from lab.export.inform import InformPosition, read_job
from lab.export.play import apart, deviation
from lab.export.program import Options, Program

UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def poses(*places: tuple[float, float, float], turn: float = 0.0) -> np.ndarray:
    """Poses without a turn, or turned by so many degrees about x."""
    half = radians(turn) / 2
    return np.array([[*place, np.sin(half), 0.0, 0.0, np.cos(half)] for place in places])


def test_the_nearest_place_of_a_way_lies_between_its_poses() -> None:
    """3 mm beside the middle of a way of 10 cm; and 1 cm beyond its end."""
    way = poses((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    far, turned = apart(poses((0.05, 0.003, 0.0), (0.11, 0.0, 0.0)), way)
    assert far == pytest.approx([0.003, 0.01])
    assert turned == pytest.approx([0.0, 0.0])


def test_a_lean_of_the_tool_is_seen() -> None:
    far, turned = apart(poses((0.05, 0.0, 0.0), turn=2.0), poses((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)))
    assert far == pytest.approx([0.0])
    assert turned == pytest.approx([radians(2.0)])


def test_the_two_signs_of_a_quaternion_are_the_same_turn() -> None:
    way = poses((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), turn=120.0)
    way[1, 3:] *= -1.0
    _, turned = apart(poses((0.05, 0.0, 0.0), turn=120.0), way)
    assert turned == pytest.approx([0.0], abs=1e-7)


def moved(files: dict[str, str], name: str, at: int, mm: float) -> dict[str, str]:
    """The files with one position of a job so much higher."""
    job = read_job(files[name], name)
    x, y, z, *turn = job.positions[at].numbers
    positions = [*job.positions]
    positions[at] = InformPosition((x, y, z + mm, *turn), job.positions[at].configuration)
    changed = type(job)(job.name, job.comment, job.date, tuple(positions), job.instructions)
    return files | {name: changed.text()}


def test_a_position_that_is_2_mm_off_is_found_out(up6: Program) -> None:
    files = jbi.write(up6, Options())
    assert deviation(up6, jbi.read(files, up6.arm)).near_enough
    off = deviation(up6, jbi.read(moved(files, "M001.JBI", 1, 2.0), up6.arm))
    assert not off.near_enough
    assert [off.max_m, off.at_rest_m] == pytest.approx([0.002, 0.002], abs=2e-4)


def test_a_turn_that_is_2_degrees_off_is_found_out(up6: Program) -> None:
    files = jbi.write(up6, Options())
    job = read_job(files["M002.JBI"], "M002.JBI")
    *place, turn = job.positions[-1].numbers
    wrong = type(job)(
        job.name, "", job.date, (*job.positions[:-1], InformPosition((*place, turn + 2.0), (0,) * 8)), job.instructions
    )
    off = deviation(up6, jbi.read(files | {"M002.JBI": wrong.text()}, up6.arm))
    assert off.at_rest_rad == pytest.approx(radians(2.0), abs=radians(0.1))
    assert not off.near_enough


@pytest.mark.parametrize(
    ("line", "other"),
    [
        ("CALL JOB:CLOSE\r\n", ""),
        ("WAIT IN#(2)=ON\r\n", ""),
        ("PAUSE IF IN#(1)=OFF\r\n", ""),
        ("PULSE OT#(2)", "PULSE OT#(3)"),
        ("TOOL 1: 0.040", "TOOL 1: 0.050"),
        ("CALL JOB:CLOSE", "CALL JOB:OPEN"),
        ("IN#(2)", "IN#(3)"),
    ],
)
def test_a_gripper_output_or_a_wait_that_is_wrong_is_found_out(up6: Program, line: str, other: str) -> None:
    files = jbi.write(up6, Options())
    wrong = {name: text.replace(line, other) for name, text in files.items()}
    assert wrong != files
    if "JOB:CLOSE" not in "".join(wrong.values()):
        del wrong["CLOSE.JBI"]
    with pytest.raises(BadInput, match="what was read back has other gripper outputs or waits than the run"):
        deviation(up6, jbi.read(wrong, up6.arm))


def test_a_way_that_is_missing_is_found_out(up6: Program) -> None:
    commands = jbi.read(jbi.write(up6, Options()), up6.arm)
    first = next(command for command in commands if isinstance(command, Path))
    with pytest.raises(BadInput, match="3 paths were read back, the run had 4"):
        deviation(up6, [command for command in commands if command is not first])


def test_a_row_of_a_table_that_is_off_is_found_out(up6: Program) -> None:
    (text,) = trajectory_csv.write(up6, Options()).values()
    lines = text.splitlines()
    at = len(lines) // 4
    row = lines[at].split(",")
    row[1] = f"{float(row[1]) + 0.01:.6f}"  # the first joint, by half a degree
    lines[at] = ",".join(row)
    played = trajectory_csv.read({"t": "\n".join(lines) + "\n"}, up6.arm)
    assert not deviation(up6, played).near_enough


def test_a_table_without_its_closing_gripper_is_found_out(up6: Program) -> None:
    (text,) = trajectory_csv.write(up6, Options()).values()
    with pytest.raises(BadInput, match="other gripper outputs or waits"):
        deviation(up6, trajectory_csv.read({"t": text.replace(",1,,1\n", ",0,,1\n")}, up6.arm))
    with pytest.raises(BadInput, match="other gripper outputs or waits"):
        deviation(up6, trajectory_csv.read({"t": text.replace("toaster", "")}, up6.arm))
