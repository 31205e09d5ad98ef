"""What help is worth: what is counted of a lesson, on a corridor, and the rows of one skill."""

import numpy as np
import pytest

from lab.advice.advising import Advising
from lab.advice.journal import Journal
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.lesson_sessions import Sessions
from lab_studies.comparisons.advice_worth import (
    NOBODY,
    Cost,
    Pupil,
    Watch,
    in_short,
    joined_costs,
    lessons_cost,
    moves_picture,
    rows_of,
    solved_picture,
)

CORRIDOR = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))
TWO, FOUR = (
    Cost(np.array([True, True]), np.array([1, 1]), np.array(moves), np.array([0, 1])) for moves in ([1, 3], [3, 5])
)


def test_a_lesson_is_counted_until_it_is_solved() -> None:
    """An expert leads the first episode straight to the goal, 3 moves; by then each move's value is above the others'."""
    learner = LearnerSettings("dyna-q", episodes=5)
    plan = LessonPlan(Problem("corridor", "walk", CORRIDOR), learner, GateSettings("always"), "corridor")
    watch = Watch.over(CORRIDOR)
    Sessions(plan, Advising.of(["expert"]), 0, Journal(), watch.hear).run()
    assert (watch.solved, watch.episodes, watch.moves, watch.helped) == (True, 1, 3, 3)


def test_what_an_advisor_saves() -> None:
    """With nobody 4 moves in the mean, with the advisor 2: half of them."""
    found = {Pupil("butter at butter_applier", NOBODY): FOUR, Pupil("butter at butter_applier", "expert"): TWO}
    rows = rows_of("butter at butter_applier", "expert", found)
    assert {one["measure"]: one["value"] for one in rows} == {
        "solved_percent": 100.0,
        "episodes_to_solve": 1.0,
        "moves_to_solve": 2.0,
        "helped_steps": 0.5,
        "saved_percent": pytest.approx(50.0),
    }
    assert len(rows_of("butter at butter_applier", NOBODY, found)) == 4
    assert joined_costs([TWO, FOUR]).moves.tolist() == [1, 3, 3, 5]
    costs = {"butter": dict.fromkeys(("none", "expert", "moderate", "limited", "novice", "wrong"), TWO)}
    assert in_short(costs)["butter, expert: moves"] == 2
    for picture in (moves_picture(costs), solved_picture(costs["butter"])):
        assert picture.startswith(b"<?xml")


def test_every_advisor_has_the_same_lessons() -> None:
    alone, again, helped = (
        lessons_cost(Pupil("insert at toaster", name), lessons=2, seed=0) for name in ("none", "none", "expert")
    )
    assert alone.moves.tolist() == again.moves.tolist()
    assert alone.solved.all()
    assert helped.solved.all()
    assert (alone.helped.sum(), helped.moves.sum() < alone.moves.sum()) == (0, True)
