"""A task: what it knows of its stations and parts, how many are made, and what must be known, once, and have a time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.skills import SKILLS
from lab.tasks.task import RESERVED, Task, counts_from_word, in_words, part_name
from lab.tasks.task_fields import MAX_PARTS
from lab.tasks.task_file import load

TEXT = (tasks_folder() / "toast.toml").read_text()
STATIONS = "butter_applier, butter_buffer, finished_plate, plate, toaster, toaster_buffer"
Changed = Callable[[tuple[str | int, ...], Any], dict[str, Any]]  # the fixture of conftest.py
Edited = Callable[[str, str], str]  # the fixture of conftest.py
Refusal = Callable[[Callable[[], object]], str]  # the fixture of conftest.py
Refused = Callable[[str], str]  # the fixture of conftest.py


def test_the_toast_task_is_the_cell_of_the_thesis() -> None:
    task = load("toast")
    (part,) = task.parts
    (route,) = part.routes
    assert [stage.station for stage in route] == ["plate", "toaster", "butter_applier", "finished_plate"]
    assert [stage.buffer for stage in route] == [None, "toaster_buffer", "butter_buffer", None]
    assert len(task.stations) == 6
    for name in SKILLS:
        settings = task.subtask(name)
        assert (settings.rewards.goal, settings.rewards.collision, settings.rewards.step) == (1.5, -11.5, -0.1)
        learner, gate = settings.learner, settings.gate
        assert (learner.learner, learner.alpha, learner.discount) == ("dyna-q", 0.95, 0.99)
        assert (learner.beta, gate.gate) == (1.3, "ccrl")
        assert gate.spare_best  # the file says nothing of it, and its own gate table leaves it as it is
    grid = task.station("toaster").grid
    assert grid is not None
    assert grid.shape == (12, 12)


def test_a_task_is_frozen_and_knows_its_stations(refusal: Refusal) -> None:
    task = load("toast")
    with pytest.raises(ValueError, match="frozen"):
        task.name = "other"
    assert task.station("toaster").kind == "machine"
    message = refusal(lambda: task.station("toster"))
    assert message == f"unknown station 'toster' (task 'toast'): did you mean 'toaster'? known: {STATIONS}"


def test_a_sub_task_that_the_file_leaves_out_has_the_thesis_settings(changed: Changed) -> None:
    document = changed(("subtasks",), {})
    assert Task.model_validate(document).subtask("grasp").learner.alpha == 0.95


@pytest.mark.parametrize("name", RESERVED)
def test_reserved_names_are_refused(name: str, refused: Refused, edited: Edited) -> None:
    assert f"obstacle '{name}'" in refused(edited('name = "cubes B"', f'name = "{name}"'))
    document = TEXT.replace('"plate"', f'"{name}"')
    assert f"station '{name}'" in refused(document)


def test_a_task_is_checked_again_when_it_is_changed(changed: Changed) -> None:
    task = load("toast")
    other = task.changed(obstacles=())
    assert (other.obstacles, other.stations, other.folder) == ((), task.stations, task.folder)
    with pytest.raises(BadInput, match=r"unknown station 'home' \(robot.start\)"):
        task.changed(robot=task.robot.model_copy(update={"start": "home"}))


# ---- how many parts --------------------------------------------------------------------------------------------------


def test_an_order_is_as_the_file_says_or_as_is_asked() -> None:
    task = load("breakfast")
    assert task.order() == ("slice", "slice", "cup")
    assert task.order(3) == task.ordered(3) == ("slice", "slice", "slice", "cup")
    assert task.ordered(parts="cup=2") == ("cup", "cup")
    assert task.ordered(parts=" cup = 1, slice=1") == ("slice", "cup")
    assert in_words(task.order()) == "2 slices and 1 cup"
    assert [part_name(task.order(), number) for number in (1, 2, 3)] == ["slice 1", "slice 2", "cup 3"]


def test_an_order_for_a_lesson_is_as_large_as_there_is_room_for(changed: Changed) -> None:
    assert len(load("toast").fitting(3)) == 3
    small = Task.model_validate(changed(("stations", 5, "capacity"), 2))
    assert len(small.fitting(3)) == 2


@pytest.mark.parametrize("toasts", [0, -1, MAX_PARTS + 1])
def test_no_or_too_many_toasts_are_refused(toasts: int, refusal: Refusal) -> None:
    assert refusal(lambda: load("toast").order(toasts)) == f"{toasts} toasts (--toasts): allowed are 1 to 50"


def test_both_ends_of_the_route_must_hold_the_toasts(refusal: Refusal, changed: Changed) -> None:
    assert len(load("toast").order(50)) == 50
    small = Task.model_validate(changed(("stations", 5, "capacity"), 2))
    assert len(small.order(2)) == 2
    said = "3 slices (--toasts, --parts) do not fit on 'finished_plate': its capacity in the task file is 2"
    assert refusal(lambda: small.order(3)) == said
    said = "station 'finished_plate': capacity = 2: 3 slices (the sum of their counts) begin or end there, wanted at least 3"
    assert refusal(small.order) == said


def test_a_place_that_two_kinds_end_at_must_hold_both(refusal: Refusal) -> None:
    task = load("breakfast")
    assert len(task.ordered(parts="slice=5,cup=3")) == 8
    said = "7 slices and 2 cups (--toasts, --parts) do not fit on 'tray': its capacity in the task file is 8"
    assert refusal(lambda: task.ordered(parts="slice=7,cup=2")) == said


@pytest.mark.parametrize(
    ("toasts", "parts", "said"),
    [
        (3, "slice=1", "--toasts 3 and --parts slice=1: an order is one or the other"),
        (None, "slise=1", "unknown part 'slise' (--parts): did you mean 'slice'? known: cup, slice"),
        (None, "slice=0", "0 parts (--toasts, --parts) for task 'breakfast': allowed are 1 to 50"),
        (None, "slice=51", "51 parts (--toasts, --parts) for task 'breakfast': allowed are 1 to 50"),
        (None, "slice", "'slice' (--parts): wanted kind=number once each, such as slice=2,cup=1"),
        (None, "slice=1,slice=1", "'slice=1,slice=1' (--parts): wanted kind=number once each, such as slice=2,cup=1"),
        (None, "slice=-1", "'slice=-1' (--parts): wanted kind=number once each, such as slice=2,cup=1"),
    ],
)
def test_an_order_that_cannot_be(toasts: int | None, parts: str | None, said: str, refusal: Refusal) -> None:
    assert refusal(lambda: load("breakfast").ordered(toasts, parts)) == said


@given(st.dictionaries(st.from_regex(r"[a-z][a-z0-9-]{0,9}", fullmatch=True), st.integers(0, 999_999), min_size=1))
def test_counts_are_read_as_they_are_written(counts: dict[str, int]) -> None:
    assert counts_from_word(",".join(f"{kind}={count}" for kind, count in counts.items())) == counts


@given(st.text(max_size=30))
def test_any_word_is_counts_or_bad_input(word: str) -> None:
    try:
        assert all(count >= 0 for count in counts_from_word(word).values())
    except BadInput as error:
        assert "(--parts): wanted kind=number once each" in str(error)  # noqa: PT017


def test_a_fault_within_says_the_file_and_the_line(tmp_path: Path, refusal: Refusal, changed: Changed) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    line = TEXT[: TEXT.index('name = "toaster_buffer"')].count("\n") + 1
    task = load(str(path))

    def fail(one: Task) -> None:
        with one.in_its_file():
            raise BadInput("station 'toaster_buffer' is on fire")

    assert refusal(lambda: fail(task)) == f"{path}: line {line}: station 'toaster_buffer' is on fire"
    assert refusal(lambda: fail(task.changed(title="other"))) == "station 'toaster_buffer' is on fire"
