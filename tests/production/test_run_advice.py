"""What people said in a run's lessons is found again by the run that goes on, also of a skill that was learned twice."""

from pathlib import Path

import numpy as np

from lab.advice.journal import Journal
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunBegan, RunJournal
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import LessonPlan
from lab.toolbox.registry import Toolbox

NAME = "insert at toaster"


def plan(columns: int) -> LessonPlan:
    """Of the same skill, about a board so wide."""
    blocked = np.zeros((3, columns), bool)
    problem = Problem(NAME, "insert", grid(blocked.shape, blocked, (0, 0), (2, columns - 1)))
    return LessonPlan(problem, LearnerSettings(), GateSettings(), "toast")


def advice_of(folder: Path, journal: RunJournal, *names: str) -> RunAdvice:
    return RunAdvice(Toolbox(folder / "toolbox"), LessonOptions(task="toast", advisors=names or ("terminal",)), journal)


def folder_of(journal: Journal | None) -> Path:
    """Where it is kept; it is left, as by a command that ends."""
    assert journal is not None
    assert journal.path is not None
    journal.close()
    return journal.path.parent


def test_each_lesson_of_a_skill_goes_on_in_its_own_session(tmp_path: Path) -> None:
    """It was learned, then the toaster was moved and it was learned again, then the run was broken off."""
    begun = RunJournal.begin(tmp_path / "run", RunBegan({}, "toast", "0"))
    broken = advice_of(tmp_path, begun)
    first, second = folder_of(broken.keep(plan(4))), folder_of(broken.keep(plan(5)))
    assert first != second
    begun.close()

    again = RunJournal.resume(tmp_path / "run")
    advice = advice_of(tmp_path, again)
    assert folder_of(advice.again(plan(4))) == first
    assert folder_of(advice.keep(plan(5))) == second
    assert advice.again(plan(6)) is None
    third = folder_of(advice.keep(plan(6)))
    assert third not in (first, second)
    assert again.sessions(NAME) == [first, second]
    again.close()


def test_what_a_language_model_says_is_kept(tmp_path: Path) -> None:
    journal = RunJournal.begin(tmp_path / "run", RunBegan({}, "toast", "0"))
    kept = advice_of(tmp_path, journal, "expert", "llm:http://127.0.0.1").keep(plan(4))
    assert folder_of(kept).parent == tmp_path / "toolbox" / "sessions"
    journal.close()


def test_where_nobody_is_asked_nothing_is_kept(tmp_path: Path) -> None:
    journal = RunJournal.begin(tmp_path / "run", RunBegan({}, "toast", "0"))
    kept = advice_of(tmp_path, journal, "expert").keep(plan(4))
    assert kept.path is None
    assert not (tmp_path / "toolbox" / "sessions").exists()
    journal.close()
