"""Scenes with one change each: what is changed is what the words say, and nothing else moves."""

from math import hypot

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sim.scene.places import Layout
from lab.tasks.task import Order, Task
from lab.tasks.task_file import load
from lab_studies.comparisons import changed_scenes
from lab_studies.comparisons.changed_scenes import (
    FARTHEST_M,
    KINDS,
    NEAREST_M,
    Changed,
    Scene,
    survey_of_scene,
    with_fixed_obstacles,
)

ORDER = ("slice",) * 3
LAYOUT = Layout(((0.72, -0.08), (0.78, 0.08), (0.98, -0.12), (0.68, 0.45), (0.26, -0.42)), ())


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


def drawn(kind: str, task: Task, seed: int) -> Changed:
    return KINDS[kind](task, LAYOUT, 7, np.random.default_rng(seed))


def test_it_is_changed_from_where_things_were_laid_out(task: Task) -> None:
    fixed = with_fixed_obstacles(task, LAYOUT)
    assert tuple(o.position_m for o in fixed.obstacles) == LAYOUT.obstacles
    assert {o.area for o in fixed.obstacles} == {(0.0, 0.0)}
    assert fixed.stations == task.stations


@pytest.mark.parametrize("seed", range(12))
def test_one_thing_is_moved_by_1_to_10_cm(task: Task, seed: int) -> None:
    cubes = drawn("cubes moved", task, seed)
    far = [
        hypot(o.position_m[0] - x, o.position_m[1] - y)
        for o, (x, y) in zip(cubes.task.obstacles, LAYOUT.obstacles, strict=True)
    ]
    assert (sum(d > 0 for d in far), NEAREST_M <= max(far) <= FARTHEST_M) == (1, True)
    assert (cubes.task.stations, cubes.seed) == (task.stations, 7)
    assert f"{100 * max(far):.1f} cm" in cubes.words
    station = drawn("station moved", task, seed)
    pairs = zip(station.task.stations, task.stations, strict=True)
    far = [hypot(a.pose[0] - b.pose[0], a.pose[1] - b.pose[1]) for a, b in pairs]
    assert (sum(d > 0 for d in far), NEAREST_M <= max(far) <= FARTHEST_M) == (1, True)
    assert station.task.obstacles == with_fixed_obstacles(task, LAYOUT).obstacles


def test_cubes_come_and_go(task: Task) -> None:
    for seed in range(12):
        more, fewer = drawn("cubes added", task, seed).task, drawn("cubes taken away", task, seed).task
        assert more.obstacles[:5] == with_fixed_obstacles(task, LAYOUT).obstacles
        assert len(more.obstacles) == 6
        cubes = [sum(o.cubes for o in scene.obstacles) for scene in (task, fewer)]
        assert cubes[1] < cubes[0]
        assert {o.name for o in fewer.obstacles} <= {o.name for o in task.obstacles}


def test_a_scene_that_cannot_be_surveyed_is_drawn_again(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[int] = []

    def prepare(task: Task, order: Order, seed: int) -> Order:
        tried.append(seed)
        if len(tried) % 4:
            raise BadInput("two things overlap")
        return order

    monkeypatch.setattr(changed_scenes, "prepare", prepare)
    prepared, words, refused = survey_of_scene(Scene("another seed", 3, 5), task, LAYOUT, 0, ORDER)
    found: object = prepared
    assert (found, words, refused, len(set(tried))) == (ORDER, f"seed {tried[-1]}", 3, 4)
    again = survey_of_scene(Scene("another seed", 3, 5), task, LAYOUT, 0, ORDER)
    assert again[1:] == (words, refused)  # its own chance, whoever draws it
    monkeypatch.setattr(changed_scenes, "MAX_DRAWS", 3)
    tried.clear()
    with pytest.raises(BadInput, match="another seed, scene 3: none of 3 draws can be surveyed; the last: two things"):
        survey_of_scene(Scene("another seed", 3, 5), task, LAYOUT, 0, ORDER)
