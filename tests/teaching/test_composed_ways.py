"""A teacher that puts ways together out of shorter ones: three places on a floor of two rooms with a door."""

from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import greedy_path, grid
from lab.production.run_options import RunOptions
from lab.seat.event_text import lesson_parts
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox

LEARNER = LearnerSettings(episodes=60, max_steps=60)
DOOR = (1, 3)
PLACES = {"left": (0, 0), "door": DOOR, "right": (2, 6)}


def way(origin: str, target: str) -> LessonPlan:
    wall = np.zeros((3, 7), bool)
    wall[:, 3] = True
    wall[DOOR] = False
    mdp = grid(wall.shape, wall, PLACES[origin], PLACES[target])
    return LessonPlan(Problem(f"{origin} to {target}", "transfer", mdp), LEARNER, GateSettings("never"), "floor")


def taught(folder: Path, composes: bool, *ways: tuple[str, str]) -> list[Lesson]:
    """The lessons of these ways, one after another."""
    teacher, known = Teacher(Toolbox(folder), composes=composes), KnownPolicies.of([])
    lessons = []
    for origin, target in ways:
        lessons.append(teacher.find_or_teach(way(origin, target), known))
        known["transfer", lessons[-1].policy.signature] = lessons[-1].policy
    return lessons


def test_a_way_through_the_door_is_put_together_and_kept(tmp_path: Path) -> None:
    *_, lesson = taught(tmp_path, True, ("left", "door"), ("door", "right"), ("left", "right"))
    mdp = way("left", "right").problem.mdp
    assert (lesson.source, lesson.result, lesson.policy.solved, lesson.steps) == ("composed", None, True, (8, 8))
    assert mdp.state_label(greedy_path(lesson.policy.q, mdp, 20)[0][4]) == "(1, 3)"
    assert lesson.reason.startswith("a path by '")
    assert (lesson.saved, lesson.policy.curve, lesson.policy.helped_steps) == ((60, 0), [], 0)
    assert lesson_parts(lesson) == ["8/8 steps", lesson.reason, "saved 60 episodes"]
    known, damaged = Toolbox(tmp_path).index()
    again = Teacher(Toolbox(tmp_path)).find_or_teach(way("left", "right"), known)
    assert (damaged, again.source, again.reason) == ([], "reused", "it was learned in exactly this problem")


def test_a_way_that_cannot_be_put_together_is_learned_from_what_is_known(tmp_path: Path) -> None:
    first, back = taught(tmp_path, True, ("left", "door"), ("right", "left"))
    assert (first.source, back.source, back.policy.solved, back.policy.parent) == ("learned", "adapted", True, "")
    assert back.result is not None
    assert lesson_parts(back)[2] == "from the moves of others, which do not lead to the goal yet"


def test_a_teacher_does_not_compose_unless_it_is_to(tmp_path: Path) -> None:
    lessons = taught(tmp_path, False, ("left", "door"), ("door", "right"), ("left", "right"))
    assert {lesson.source for lesson in lessons} <= {"learned", "adapted"}


def test_the_ways_of_a_run_are_one_of_two() -> None:
    assert [RunOptions(ways=ways).composes for ways in ("learned", "composed")] == [False, True]
    kept = RunOptions(ways="composed").to_json()
    assert RunOptions.from_json(kept, "journal").composes
    del kept["ways"]  # of a run before there was a choice
    assert not RunOptions.from_json(kept, "journal").composes
    with pytest.raises(BadInput, match=r"unknown ways 'compose' \(--ways\): did you mean 'composed'\?"):
        _ = RunOptions(ways="compose").composes
