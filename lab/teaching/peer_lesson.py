"""A lesson of peers, `lab teach --peers`: several learners of one problem advise each other; the best policy is saved."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.advice.advising import Advising
from lab.advice.advisors import AdvisorName
from lab.advice.journal import Journal
from lab.errors import BadInput
from lab.learning.session_events import Event
from lab.learning.session_result import SessionResult
from lab.teaching.events import LessonEvent, Tell
from lab.teaching.lesson import Subject, one_lesson
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.peers import GroupResult, PeerGroup, PeerPlan, check_peers
from lab.teaching.teacher import Teacher

NOBODY = AdvisorName.of("none")


class PeerLesson:
    """The sessions of a lesson in which `count` peers learn the problem; made once, called by the teacher as `Sessions` is.

    group: the results of all peers, once they have run; the lesson's result is the best peer's, see `GroupResult.best`.
    """

    def __init__(self, count: int):
        check_peers(count)
        self.count = count
        self._group: GroupResult | None = None

    @property
    def group(self) -> GroupResult:
        """The results of the peers."""
        assert self._group is not None
        return self._group

    def __call__(self, plan: LessonPlan, advising: Advising, seed: int, journal: Journal, tell: Tell) -> "PeerLesson":
        """The lesson with its peers, which have not run yet. Raises BadInput for a problem without a goal."""

        def hear(number: int, event: Event) -> None:
            tell(LessonEvent(f"{plan.problem.name}, peer {number}", event))

        plans = [PeerPlan(plan.problem, plan.learner, plan.gate)] * self.count
        self._peers = PeerGroup(plans, seed, panel=advising.panel, tell=hear)
        return self

    def run(self) -> SessionResult:
        """The result of the best peer."""
        self._group = self._peers.run()
        return self._group.best.session

    def teacher(self, teacher: Teacher) -> Teacher:
        """The teacher of this lesson: it begins anew, and its policy says that peers advised."""
        name = replace(NOBODY, text=f"{self.count} peers")
        advising = replace(teacher.advising, names=(name,))
        return replace(teacher, advising=advising, sessions=self, begun=lambda problem: None)


def teach_peers(
    subject: Subject, teacher: Teacher, count: int, name: str | None = None, out: Path | None = None
) -> dict[str, Any]:
    """The document of `lab teach --peers --json` after a lesson of `count` peers, whose best policy is saved.

    Pictures are written to `out`; no journal is kept, because the same seed gives the same lesson. Raises BadInput for bad
    options, and Interrupted on Ctrl-C, when the best policy so far has been saved.
    """
    lesson = PeerLesson(count)
    document = one_lesson(subject, lesson.teacher(teacher), name, out)
    return document | lesson.group.to_json()


def check_alone(given: Mapping[str, object]) -> None:
    """Raises BadInput for the first option, by name, that has a value and cannot be combined with --peers."""
    for option, value in given.items():
        if value:
            raise BadInput(
                f"{option} beside peers: they are advised by each other alone, and nothing is recorded: remove {option}"
            )
