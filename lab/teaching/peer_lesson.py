"""Lessons of peers, `lab teach --peers`: several learners of a sub-task advise each other; the best policy is saved.

With several tasks, such as one with another arm, the learners of all of them are one group, and each task's best policy is saved.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lab.advice.advisors import AdvisorName
from lab.errors import BadInput
from lab.learning.session_events import Event
from lab.learning.session_result import SessionResult
from lab.teaching.events import LessonEvent
from lab.teaching.lesson import Subject, carried_out, planned
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.peers import GroupResult, PeerGroup, PeerPlan, PeerResult, check_peers
from lab.teaching.teacher import Teacher

NOBODY = AdvisorName.of("none")


class PeerLessons:
    """The lessons of `count` peers for each subject, planned now; the first lesson that is taught runs all peers.

    planned: the subject, teacher and plan of each lesson. Raises BadInput for a group that is too small or too large, and for a
    problem without a goal.
    """

    def __init__(self, subjects: Sequence[Subject], teacher: Teacher, count: int, name: str | None = None):
        check_peers(count * len(subjects))
        advisor = replace(NOBODY, text=f"{count * len(subjects)} peers")
        advising = replace(teacher.advising, names=(advisor,))
        teacher = replace(teacher, advising=advising, begun=lambda problem: None)  # each lesson begins anew
        self.planned: list[tuple[Subject, Teacher, LessonPlan]] = []
        plans: list[PeerPlan] = []
        for number, subject in enumerate(subjects):
            own, plan = planned(subject, teacher, name)
            best = _Best(self, number)
            self.planned.append((subject, replace(own, sessions=lambda *_, best=best: best), plan))
            plans += [PeerPlan(plan.problem, plan.learner, plan.gate, reach=subject.reach())] * count

        def hear(number: int, event: Event) -> None:
            teacher.tell(LessonEvent(f"{plans[number - 1].problem.name}, peer {number}", event))

        self._count, self._group = count, PeerGroup(plans, teacher.seed, panel=advising.panel, tell=hear)
        self._peers: tuple[PeerResult, ...] = ()

    @property
    def peers(self) -> tuple[PeerResult, ...]:
        """The results of all peers, in the order of the subjects."""
        if not self._peers:
            self._peers = self._group.run().peers
        return self._peers

    def best(self, number: int) -> PeerResult:
        """The best peer of a subject, from 0."""
        first = number * self._count
        return GroupResult(self.peers[first : first + self._count]).best


@dataclass(frozen=True)
class _Best:
    """The sessions of a lesson, as a teacher runs them: those of the subject's best peer."""

    lessons: PeerLessons
    number: int

    def run(self) -> SessionResult:
        return self.lessons.best(self.number).session


def teach_peers(
    subjects: Sequence[Subject], teacher: Teacher, count: int, name: str | None = None, out: Path | None = None
) -> dict[str, Any]:
    """The document of `lab teach --peers --json`: that of the first subject, with all peers, and those of the other subjects.

    count: of the learners of each subject. Pictures are written to `out`; no journal is kept, because the same seed gives the
    same lessons. Raises BadInput for bad options, and Interrupted on Ctrl-C, when the best policies so far have been saved.
    """
    lessons, documents = PeerLessons(subjects, teacher, count, name), list[dict[str, Any]]()
    stopped: KeyboardInterrupt | None = None
    for number, (subject, own, plan) in enumerate(lessons.planned):
        folder = out if out is None or len(subjects) == 1 else out / f"{number + 1}-{subject.name}"
        try:
            document = carried_out(subject, own, plan, folder)
        except KeyboardInterrupt as interrupted:  # the policies of the others are saved as well
            stopped = stopped or interrupted
        else:
            documents.append(document | {"best_peer": lessons.best(number).number})
    if stopped is not None:
        raise stopped
    first, *others = documents
    first["peers"] = [peer.to_json() for peer in lessons.peers]
    return first | ({"others": others} if others else {})


def check_alone(given: Mapping[str, object]) -> None:
    """Raises BadInput for the first option, by name, that has a value and cannot be combined with --peers."""
    for option, value in given.items():
        if value:
            raise BadInput(
                f"{option} beside peers: they are advised by each other alone, and nothing is recorded: remove {option}"
            )
