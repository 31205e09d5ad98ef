"""Lessons of peers, `lab teach --peers`: several learners of a sub-task advise each other; the best policy is saved.

With several tasks, such as one with another arm, the learners of all of them are one group, and each task's best policy is saved.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from lab.advice.advisors import AdvisorName
from lab.errors import BadInput
from lab.learning.session_events import Event
from lab.learning.session_result import SessionResult
from lab.teaching.events import LessonEvent
from lab.teaching.lesson import Subject, carried_out, planned
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.peers import GroupResult, PeerGroup, PeerPlan, PeerResult, check_peers
from lab.teaching.skill_subject import SkillSubject
from lab.teaching.teacher import Teacher

NOBODY = AdvisorName.of("none")
Taught = TypeVar("Taught")


class PeerLessons:
    """The lessons of `count` peers for each subject, planned now; `each` teaches them, and the first one runs all peers.

    name: of the saved policy. Raises BadInput for a group that is too small or too large, for a problem
    without a goal, and for one name for several policies.
    """

    def __init__(self, subjects: Sequence[Subject], teacher: Teacher, count: int, name: str | None = None):
        check_peers(count * len(subjects))
        if name is not None and len(subjects) > 1:
            raise BadInput(
                f"--save {name} beside --peer-task: the policy of each task has a name of its own: remove --save"
            )
        advisor = replace(NOBODY, text=f"{count * len(subjects)} peers")
        advising = replace(teacher.advising, names=(advisor,))
        teacher = replace(teacher, advising=advising, begun=lambda problem: None)  # each lesson begins anew
        self._lessons: list[tuple[int, Subject, Teacher, LessonPlan]] = []
        plans: list[PeerPlan] = []
        for number, subject in enumerate(subjects):
            own, plan = planned(subject, teacher, name)
            best = _Best(self, number)
            self._lessons.append((number, subject, replace(own, sessions=lambda *_, best=best: best), plan))
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

    def each(self, teach: Callable[[int, Subject, Teacher, LessonPlan], Taught]) -> list[Taught]:
        """What `teach` returns for each subject, numbered from 0.

        After Ctrl-C the lessons that are left save their policies, too; then it is raised.
        """
        results, stopped = list[Taught](), list[KeyboardInterrupt]()
        for lesson in self._lessons:
            try:
                results.append(teach(*lesson))
            except KeyboardInterrupt as interrupted:
                stopped.append(interrupted)
        if stopped:
            raise stopped[0]
        return results

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
    lessons = PeerLessons(subjects, teacher, count, name)

    def teach(number: int, subject: Subject, own: Teacher, plan: LessonPlan) -> dict[str, Any]:
        folder = out if out is None or len(subjects) == 1 else out / f"{number + 1}-{subject.name}"
        return carried_out(subject, own, plan, folder) | {"best_peer": lessons.best(number).number}

    first, *others = lessons.each(teach)
    first["peers"] = [peer.to_json() for peer in lessons.peers]
    return first | ({"others": others} if others else {})


def of_tasks(subject: Subject, tasks: Sequence[str], make: Callable[[str], Subject]) -> list[Subject]:
    """The subject, and those that `make` returns for further tasks. Raises BadInput if the subject is no sub-task of a task."""
    if tasks and not isinstance(subject, SkillSubject):
        raise BadInput(
            f"task '{tasks[0]}' (--peer-task): '{subject.name}' is no sub-task of a task: remove --peer-task"
        )
    try:
        return [subject, *map(make, tasks)]
    except BadInput as error:
        raise BadInput(f"--peer-task {', '.join(tasks)}: {error}") from None


def check_alone(given: Mapping[str, object]) -> None:
    """Raises BadInput for the first option, by name, that has a value and cannot be combined with --peers."""
    for option, value in given.items():
        if value:
            raise BadInput(
                f"{option} beside peers: they are advised by each other alone, and nothing is recorded: remove {option}"
            )
