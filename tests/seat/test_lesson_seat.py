"""Who hears of lessons: what the page shows of a replay, of a skill in its words, and of the order after a lesson."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from io import StringIO
from typing import Any

import numpy as np
from rich.console import Console

from lab.learning.requests import AdviceRequest
from lab.learning.settings import GateSettings, LearnerSettings
from lab.seat.lesson_seat import LessonSeat
from lab.seat.page.teaching_page import SeatPage
from lab.seat.run_progress import RunProgress
from lab.seat.terminal.prompt import TeachingPrompt
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.task_file import load, load_cell
from lab.teaching.events import LessonBegan, QuestionAnswered, ScenePrepared
from lab.teaching.lesson_plan import LessonPlan

Opens = Callable[..., AbstractContextManager[Any]]


def toast() -> Prepared:
    task = load("toast")
    return prepare(task, task.ordered(1, None), 0)


def about_grasp(prepared: Prepared) -> AdviceRequest:
    mdp = prepared.problems["grasp at plate"].mdp
    state = int(np.ravel_multi_index((0, 4, 5, 3), mdp.shape))
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(mdp=mdp, q=q, state=state, episode=31, step=1, own=7, allowed=range(mdp.n_actions))


def about_order() -> SequenceRequest:
    run = Run(load_cell("toast-case-1").cell(2))
    return SequenceRequest(run=run, allowed=run.allowed(), own=1, episode=30, step=1, state=10**9)


def test_a_skill_is_told_in_words_and_the_order_after_it_moves_no_scene(opens: Opens) -> None:
    prepared, written = toast(), StringIO()
    console = Console(file=written, width=80, height=24)
    with SeatPage() as page, opens(page) as browser:
        seat = LessonSeat(RunProgress(console), TeachingPrompt(console), page)
        seat.replaying(0.0)
        seat.hear(ScenePrepared(prepared))
        plan = LessonPlan(prepared.problems["grasp at plate"], LearnerSettings("q"), GateSettings(), "toast")
        seat.hear(LessonBegan(plan))
        seat.hear(QuestionAnswered(about_grasp(prepared), 1))
        said = browser.hear_until(lambda seat: seat.get("question") and (seat.get("replay") or {}).get("said"))
        where = "The open fingers are 2.4 cm left of, 2.4 cm behind and 15 cm above where they close on the slice"
        assert said["question"]["where"].startswith(where)
        assert said["question"]["moves"][0]["size"] == "1.2 cm"
        assert said["replay"]["said"] == "The answer was → right."
        assert " ".join(written.getvalue().split()).count(where) == 1
        seat.hear(QuestionAnswered(about_order(), 2))
        said = browser.hear_until(lambda seat: (seat.get("question") or {}).get("kind") == "order")
        assert said["replay"]["said"] == "The answer was move 2."
        seat.clear_scene()
