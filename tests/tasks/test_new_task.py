"""A new task file: what words mean, where stations stand, and that the text is a task."""

import tomllib
from itertools import combinations
from math import hypot
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.tasks.new_task import (
    BETWEEN_M,
    GAPS_M,
    GRIPPER_M,
    MACHINE,
    Around,
    Changes,
    NewMachine,
    NewPart,
    NewTask,
    PlacedStation,
    file_of,
    heights_m,
    layouts,
    machine_of_word,
    new_task,
    part_of_word,
)
from lab.tasks.new_task_text import text_of
from lab.tasks.task_file import task_of_text

ROOMY = Around(0.36, 1.3, 2.9)


# ---- words --------------------------------------------------------------------------------------------------------


def test_words_by_hand() -> None:
    assert part_of_word("box:0.12x0.015x0.12:2") == NewPart("box", "box", (0.12, 0.015, 0.12), 2)
    assert part_of_word("box:0.1x0.02x0.1:1", ["box"]).name == "box-2"
    assert part_of_word("cup=cylinder:0.035x0.1:1") == NewPart("cup", "cylinder", (0.035, 0.1), 1)
    assert machine_of_word("oven:60") == NewMachine("oven", 60.0)
    found = new_task("t", "up6", (), (MACHINE,), False)
    assert (found.parts, found.machines) == (
        (NewPart("box", "box", (0.06, 0.03, 0.08), 3),),
        (NewMachine("press", 30.0),),
    )


@pytest.mark.parametrize(
    ("word", "line"),
    [
        ("box", "wanted SHAPE:SIZE:COUNT, in metres"),
        ("bxo:0.1x0.1x0.1:1", "unknown shape 'bxo' .*did you mean 'box'"),
        ("box:0.1x0.1:1", "the size of a box is XxYxZ, each 0.005 to 0.5 m, not '0.1x0.1'"),
        ("cylinder:0.1x0:1", "the size of a cylinder is DIAMETERxHEIGHT"),
        ("cylinder:0.1xnan:1", "the size of a cylinder is DIAMETERxHEIGHT"),
        ("box:0.1x0.1x0.1:0", "how many: '0': allowed are 1 to 50"),
        ("box:0.1x0.1x0.1:two", "how many: 'two'"),
        ("=box:0.1x0.1x0.1:1", "the name '': wanted letters"),
        ('a"b=box:0.1x0.1x0.1:1', "the name 'a\"b': wanted letters"),
    ],
)
def test_parts_that_cannot_be(word: str, line: str) -> None:
    with pytest.raises(BadInput, match=line):
        part_of_word(word)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("oven",), "wanted NAME:SECONDS, such as oven:60"),
        (("oven:-1",), "'-1' seconds: allowed are 0 to 86400"),
        (("oven:soon",), "'soon' seconds"),
        (("oven:1", "oven:2"), "the name 'oven' is taken: input, output, oven, box"),
        (("box:1",), "the name 'box' is taken"),
        (("input:1",), "the name 'input' is taken"),
    ],
)
def test_machines_that_cannot_be(words: tuple[str, ...], line: str) -> None:
    with pytest.raises(BadInput, match=line):
        new_task("t", "up6", (), words, False)


def test_masses_frictions_and_capacities_go_to_what_they_name() -> None:
    found = new_task(
        "t",
        "up6",
        ("pin=cylinder:0.012x0.04:2", "box:0.06x0.03x0.08:1"),
        ("oven:60",),
        True,
        Changes(["pin=0.05"], ["box=0.4"], ["oven=2", "output=6"]),
    )
    assert [(part.mass_kg, part.friction) for part in found.parts] == [(0.05, 0.8), (0.058, 0.4)]
    assert found.stations == {
        "input": ("storage", 3),
        "oven_buffer": ("buffer", 2),
        "oven": ("machine", 2),
        "output": ("storage", 6),
    }


@pytest.mark.parametrize(
    ("option", "word", "line"),
    [
        (0, "0.05", r"'0.05' \(--mass\): wanted NAME=NUMBER, such as box=0.05"),
        (0, "bxo=0.05", r"unknown part 'bxo' \(--mass\): did you mean 'box'"),
        (0, "box=0", r"'box=0' \(--mass\): '0': allowed are 0.001 to 6"),
        (1, "box=nan", r"'box=nan' \(--friction\): 'nan': allowed are 0 to 5"),
        (2, "oven=1", "unknown station 'oven'"),
        (2, "input=2", "'input=2' .*whole numbers from 3 to 50"),
        (2, "press=1.5", "'press=1.5' .*whole numbers from 1 to 50"),
    ],
)
def test_numbers_that_cannot_be(option: int, word: str, line: str) -> None:
    numbers: list[list[str]] = [[], [], []]
    numbers[option] = [word]
    with pytest.raises(BadInput, match=line):
        new_task("t", "up6", (), (MACHINE,), False, Changes(*numbers))
    numbers[0] = ["box=1", "box=2"]
    with pytest.raises(BadInput, match=r"'box=2' .*once is allowed"):
        new_task("t", "up6", (), (MACHINE,), False, Changes(numbers[0]))


@pytest.mark.parametrize("capacity", [1, 2, 3])
def test_a_machine_of_any_capacity_has_its_spots_on_its_body(capacity: int) -> None:
    new = new_task("t", "up6", (), (MACHINE,), False, Changes(capacities=[f"press={capacity}"]))
    task = task_of_text(Path("t.toml"), text_of(new, next(layouts(new, ROOMY)), ROOMY))
    press = task.station("press")
    assert press.size_m is not None
    assert len(press.spots or [()]) == press.capacity == capacity
    for x, y, _ in press.spots or ():
        assert abs(x) + new.foot_m[0] / 2 < press.size_m[0] / 2
        assert abs(y) + new.foot_m[1] / 2 < press.size_m[1] / 2


def test_an_arm_that_is_not_known_and_too_many_parts() -> None:
    with pytest.raises(BadInput, match=r"unknown arm 'up5' \(--arm\): did you mean 'up6'"):
        new_task("t", "up5", (), (), False)
    with pytest.raises(BadInput, match=r"60 parts .*allowed are 1 to 50 in all"):
        new_task("t", "up6", ("box:0.1x0.02x0.1:30",) * 2, (), False)


def test_a_file_is_never_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert file_of("my-cell") == file_of("my-cell.toml") == (Path("my-cell.toml"), "my-cell")
    Path("there.toml").write_text("")
    for word, line in (
        ("there", "there is one already"),
        ("no/x", "no folder 'no'"),
        ("-x", "up to 31 letters"),
        ("", "up to"),
    ):
        with pytest.raises(BadInput, match=line):
            file_of(word)


# ---- stations -----------------------------------------------------------------------------------------------------


def test_three_stations_by_hand() -> None:
    """To the left, ahead and to the right, 44 % of the way from the nearest to the farthest place."""
    new = new_task("t", "up6", (), (MACHINE,), False)
    placed = next(layouts(new, ROOMY))
    far = 0.36 + 0.44 * (1.3 - 0.36)
    assert [one.name for one in placed] == ["input", "press", "output"]
    assert [one.x for one in placed] == pytest.approx([0.0, far, 0.0], abs=1e-3)
    assert [one.y for one in placed] == pytest.approx([far, 0.0, -far], abs=1e-3)
    pitch = 0.06 + BETWEEN_M
    assert placed[0].spots == ((0.0, 0.0), (-pitch, 0.0), (pitch, 0.0))
    assert placed[0].half_m(new.foot_m) == pytest.approx((pitch + 0.03 + GRIPPER_M, 0.015 + GRIPPER_M))


def test_an_arm_that_cannot_turn_far_has_its_stations_ahead() -> None:
    new = new_task("t", "up6", ("box:0.03x0.03x0.08:1",), (), False)
    angles = [abs(one.y) / hypot(one.x, one.y) for one in next(layouts(new, Around(0.36, 1.3, 1.2)))]
    assert all(one.x > 0 for one in next(layouts(new, Around(0.36, 1.3, 1.2))))
    assert angles == pytest.approx([3**0.5 / 2] * 2, abs=1e-2)  # 60 degrees
    assert not [*layouts(new, Around(0.36, 1.3, 0.5))]
    assert not [*layouts(new, Around(0.36, 0.4, 2.9))]


edges = st.floats(0.01, 0.15).map(lambda edge: round(edge, 3))
parts = st.builds(
    NewPart,
    st.sampled_from(["a", "b"]),
    st.just("box"),
    st.tuples(edges, edges, edges),
    st.integers(1, 12),
) | st.builds(NewPart, st.sampled_from(["a", "b"]), st.just("cylinder"), st.tuples(edges, edges), st.integers(1, 12))
machines = st.lists(st.floats(0, 999), max_size=4).map(
    lambda times: tuple(NewMachine(f"m{number}", time) for number, time in enumerate(times))
)
tasks = st.builds(
    NewTask,
    st.just("t"),
    st.sampled_from(["up6", "panda"]),
    st.lists(parts, min_size=1, max_size=2, unique_by=lambda part: part.name).map(tuple),
    machines,
    st.booleans(),
)


@given(tasks, st.sampled_from([None, 0.08]))
def test_all_spots_are_reached_and_no_two_stations_meet(new: NewTask, between_m: float | None) -> None:
    placed = next(layouts(new, ROOMY, between_m), None)
    assume(placed is not None)
    assert placed is not None
    for one in placed:
        assert len(one.spots) == one.capacity
        assert all(ROOMY.nearest_m < hypot(one.x + x, one.y + y) < ROOMY.farthest_m for x, y in one.spots)
    for one, other in combinations(placed, 2):
        assert apart(one, other, new.foot_m) >= min(GAPS_M) - 1e-9


def apart(one: PlacedStation, other: PlacedStation, foot: tuple[float, float]) -> float:
    """Between the rectangles around two stations, along the axis on which they are farther apart."""
    (along, across), (length, width) = one.half_m(foot), other.half_m(foot)
    return max(abs(one.x - other.x) - along - length, abs(one.y - other.y) - across - width)


@given(tasks, st.sampled_from([None, 0.08]), st.sampled_from([None, 0.046]))
def test_the_text_is_the_task_that_was_asked_for(
    new: NewTask, between_m: float | None, opening_m: float | None
) -> None:
    placed = next(layouts(new, ROOMY, between_m), None)
    assume(placed is not None)
    assert placed is not None
    text = text_of(new, placed, ROOMY, opening_m)
    assert max(map(len, text.splitlines())) <= 130
    task = task_of_text(Path("t.toml"), text)
    assert tomllib.loads(text)["name"] == task.name == "t"
    assert (task.robot.model, task.robot.opening_m) == (new.arm, opening_m)
    assert [(p.name, p.shape, p.size_m, p.count) for p in task.parts] == [
        (p.name, p.shape, p.size_m, p.count) for p in new.parts
    ]
    way = ["input", *(machine.name for machine in new.machines), "output"]
    buffers = [f"{machine.name}_buffer" if new.buffers else None for machine in new.machines]
    for part in task.parts:
        assert [stage.station for stage in part.routes[0]] == way
        assert [stage.buffer for stage in part.routes[0][1:-1]] == buffers
    assert [task.station(machine.name).processing_s for machine in new.machines] == [
        m.processing_s for m in new.machines
    ]
    assert len(task.order()) == new.count
    low = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    assert low == pytest.approx(heights_m(new)[1])
    for station, one in zip(task.stations, placed, strict=True):
        assert (station.name, station.kind, station.pose) == (one.name, one.kind, (one.x, one.y, 0.0))
        assert (station.spots is not None) == (between_m is not None and one.capacity > 1)
        for axis in (0, 1):  # the workspace has the station's middle in it
            first, size, count = (task.workspace.lower_m[axis], task.workspace.cell_m[axis], task.workspace.shape[axis])
            assert first <= station.pose[axis] <= first + size * (count - 1)


@given(st.floats(0.2, 0.6))
def test_no_cell_right_behind_the_arm_is_reached(nearest_m: float) -> None:
    """There its first joint would have to turn through its gap, from one side to the other."""
    around = Around(nearest_m, 1.3, 2.9)
    new = new_task("t", "up6", (), (MACHINE,), False)
    grid = task_of_text(Path("t.toml"), text_of(new, next(layouts(new, around)), around)).workspace
    (x, y), (wide, high) = grid.lower_m[:2], grid.cell_m[:2]
    middles = [(x + (i + 0.5) * wide, y + (j + 0.5) * high) for i in range(grid.shape[0]) for j in range(grid.shape[1])]
    assert all(hypot(a, b) < nearest_m for a, b in middles if a < 0 and abs(b) < high)
