"""A lesson of peers: the best policy is saved, also after Ctrl-C; what it cannot be combined with is refused."""

from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.learning.session_events import EpisodeEnded
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid
from lab.tasks.record import Learned
from lab.teaching.events import Event, LessonEvent
from lab.teaching.lesson_plan import Interrupted
from lab.teaching.peer_lesson import check_alone, of_tasks, teach_peers
from lab.teaching.subjects import TableSubject
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox


def subject(episodes: int = 30, length: int = 4) -> TableSubject:
    made = TableSubject(Problem("corridor", "push", grid((length,), np.zeros(length, bool), (0,), (length - 1,))))
    made.settings = Learned(learner=LearnerSettings(episodes=episodes), gate=GateSettings("always"))
    return made


def test_the_best_policy_is_saved_and_the_toolbox_changes_nothing(tmp_path: Path) -> None:
    heard: list[Event] = []
    teacher = Teacher(Toolbox(tmp_path), seed=3, tell=heard.append)
    document = teach_peers([subject()], teacher, 3)
    assert teach_peers([subject()], teacher, 3) == document
    best = document["peers"][document["best_peer"] - 1]
    assert (document["advisor"], document["solved"], document["final_steps"]) == ("3 peers", True, 3)
    assert (best["final_steps"], best["helped_steps"]) == (3, document["helped_steps"])
    policy = teacher.toolbox.versions(document["saved_as"]).in_use()
    assert policy is not None
    assert (policy.policy.advisor, policy.policy.curve) == ("3 peers", document["steps_per_episode"])
    lessons = [
        event.lesson for event in heard if isinstance(event, LessonEvent) and isinstance(event.event, EpisodeEnded)
    ]
    assert lessons[:4] == [f"corridor, peer {number}" for number in (1, 2, 3, 1)]


def test_ctrl_c_saves_the_best_so_far(tmp_path: Path) -> None:
    def stop(event: Event) -> None:
        if isinstance(event, LessonEvent) and isinstance(event.event, EpisodeEnded) and event.event.episode == 5:
            raise KeyboardInterrupt

    teacher = Teacher(Toolbox(tmp_path), tell=stop)
    with pytest.raises(Interrupted, match="what was learned is kept"):
        teach_peers([subject()], teacher, 2)
    (row,) = teacher.toolbox.list()
    assert row["advisor"] == "2 peers"


def test_the_best_policy_of_each_problem_is_saved(tmp_path: Path) -> None:
    teacher = Teacher(Toolbox(tmp_path), seed=3)
    document = teach_peers([subject(), subject(length=5)], teacher, 2)
    (other,) = document["others"]
    assert ("others" in other, len(document["peers"])) == (False, 4)
    assert (document["final_steps"], other["final_steps"]) == (3, 4)
    assert (document["best_peer"] in (1, 2), other["best_peer"] in (3, 4)) == (True, True)
    assert {row["name"] for row in teacher.toolbox.list()} == {document["saved_as"], other["saved_as"]}
    with pytest.raises(BadInput, match="--save both beside --peer-task"):
        teach_peers([subject(), subject(length=5)], teacher, 1, "both")
    with pytest.raises(BadInput, match="peers 18"):
        teach_peers([subject(), subject(length=5)], teacher, 9)


def test_ctrl_c_saves_the_policies_of_all_problems(tmp_path: Path) -> None:
    def stop(event: Event) -> None:
        if isinstance(event, LessonEvent) and isinstance(event.event, EpisodeEnded) and event.event.episode == 5:
            raise KeyboardInterrupt

    teacher = Teacher(Toolbox(tmp_path), tell=stop)
    with pytest.raises(Interrupted):
        teach_peers([subject(), subject(length=5)], teacher, 1)
    assert len(teacher.toolbox.list()) == 2


def test_only_the_sub_task_of_a_task_has_further_tasks() -> None:
    made = subject()
    assert of_tasks(made, (), lambda task: made) == [made]
    with pytest.raises(BadInput, match=r"^task 'toast' \(--peer-task\): 'corridor' is no sub-task of a task"):
        of_tasks(made, ["toast"], lambda task: made)


def test_an_option_that_does_not_fit_is_named() -> None:
    check_alone({"--advisor": None, "--page": False, "--port": 0})
    with pytest.raises(BadInput, match=r"^--page beside peers: .*: remove --page$"):
        check_alone({"--advisor": None, "--page": True})
