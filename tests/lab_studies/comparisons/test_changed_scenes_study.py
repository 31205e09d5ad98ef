"""Skills in changed scenes: one scene from end to end, and how many become rows."""

from dataclasses import replace
from typing import Any

import pytest

from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.findings import those
from lab.studies.runner import Job
from lab.tasks.task_file import load
from lab_studies.comparisons import changed_scenes_study as study
from lab_studies.comparisons.changed_scenes import KINDS, Scene, survey_of_scene
from lab_studies.comparisons.changed_scenes_study import (
    WAYS,
    Outcome,
    Tally,
    changed_scenes,
    in_short,
    rows_of,
    rows_of_scene,
    scene_outcome,
)

NONE = Tally(0, 0, 0, 0.0, (0, 0))
ONE = Outcome(
    "'cubes A' moved 3.0 cm",
    1,
    {
        "the same": Tally(5, 0, 0, 0.1, (1000, 400)),
        "used": Tally(3, 0, 0, 0.1, (600, 100)),
        "adapted": Tally(1, 29, 0, 0.2, (200, 100)),
        "refused": Tally(1, 200, 80, 0.4, (200, 80)),
        "learned": NONE,
    },
    accepted_failing=0,
    adapted_failing=0,
    refused_working=0,
    longer=1,
    unsolved=(0, 0),
)


def test_the_rows_of_a_kind() -> None:
    other = replace(ONE, tallies=ONE.tallies | {"used": Tally(3, 0, 0, 0.1, (1000, 100))}, accepted_failing=3)
    rows = rows_of("cubes moved", [ONE, other])
    assert {(one["kind"], one["scenes"]) for one in rows} == {("cubes moved", 2)}
    value = {(one.get("source"), one["measure"]): one["value"] for one in rows}
    assert [value[way, "skills_percent"] for way in WAYS] == [50.0, 30.0, 10.0, 10.0, 0.0]
    first, second = 100 * (1 - 229 / 2000), 100 * (1 - 229 / 2400)
    assert value[None, "saved_episodes_percent"] == pytest.approx((first + second) / 2)
    first, second = 100 * (1 - 229 / 1000), 100 * (1 - 229 / 1400)
    assert value[None, "saved_in_changed_problems_episodes_percent"] == pytest.approx((first + second) / 2)
    assert value[None, "saved_in_changed_problems_helped_steps_percent"] == pytest.approx(100 * (1 - 80 / 280))
    assert (value[None, "accepted_failing_percent"], value[None, "longer_percent"]) == (50.0, 10.0)
    assert (value[None, "success_percent"], value["all anew", "success_percent"]) == (100.0, 100.0)
    assert rows_of("another seed", []) == []
    assert in_short(rows_of(None, [ONE]))["used skills_percent"] == 30.0


def test_the_rows_of_a_scene() -> None:
    rows = rows_of_scene(4, Scene("cubes moved", 0, 0), ONE)
    wanted = ("order", "task", "source", "episodes", "helped_steps", "wall_s", "saved_percent", "value")
    scene = "toast: 'cubes A' moved 3.0 cm"
    assert [tuple(one[name] for name in wanted) for one in rows[1:]] == [
        (4, scene, "used", 0, 0, 0.1, 100.0, 3.0),
        (4, scene, "adapted", 29, 0, 0.2, pytest.approx(85.5), 1.0),
        (4, scene, "refused", 200, 80, 0.4, 0.0, 1.0),
    ]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """A task with four of its skills, so that they are learned in seconds."""
    names = (
        "grasp at plate",
        "place at toaster_buffer",
        "transfer toaster_buffer to plate",
        "transfer toaster to plate",
    )

    def some(prepared: Prepared) -> Prepared:
        prepared.problems = {name: prepared.problems[name] for name in names}
        return prepared

    def scene(*given: Any) -> tuple[Prepared, str, int]:
        prepared, words, refused = survey_of_scene(*given)
        return some(prepared), words, refused

    monkeypatch.setattr(study, "prepare", lambda *given: some(prepare(*given)))
    monkeypatch.setattr(study, "survey_of_scene", scene)
    study.original_scene.cache_clear()


@pytest.mark.slow
def test_one_scene_of_few_skills_from_end_to_end(few: None) -> None:
    found = changed_scenes(Job(2), {})
    assert {one["kind"] for one in found.rows} == {"all", "cubes moved", "station moved"}
    skills = [one for one in found.rows if one["measure"] == "skills"]
    assert sum(one["value"] for one in skills) == 8
    assert {one["source"] for one in skills} <= {*WAYS}
    for measure in ("accepted_failing_percent", "refused_working_percent"):
        assert [one["value"] for one in those(found.rows, kind="all", measure=measure)] == [0.0]
    assert {one["value"] for one in those(found.rows, measure="success_percent")} == {100.0}
    assert "changed scenes" in found.notes[0]
    base, known, learned = study.original_scene()
    assert base.layout == prepare(load("toast"), load("toast").order(3), 0).layout
    assert len(known) <= len(learned) == 4
    assert scene_outcome(Scene(next(iter(KINDS)), 0, 0)).words in skills[0]["task"]
    study.original_scene.cache_clear()
