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
from lab.teaching.peer_lesson import check_alone, teach_peers
from lab.teaching.subjects import TableSubject
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox


def subject(episodes: int = 30) -> TableSubject:
    made = TableSubject(Problem("corridor", "push", grid((4,), np.zeros(4, bool), (0,), (3,))))
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


def test_an_option_that_does_not_fit_is_named() -> None:
    check_alone({"--advisor": None, "--page": False, "--port": 0})
    with pytest.raises(BadInput, match=r"^--page beside peers: .*: remove --page$"):
        check_alone({"--advisor": None, "--page": True})
