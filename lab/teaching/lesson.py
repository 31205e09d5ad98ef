"""A lesson of one session: journal, receipt, pictures and document; and the replay of a stored lesson."""

from dataclasses import replace
from functools import partial
from math import isnan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

from lab.advice.advisors import split_praise
from lab.errors import BadInput, LabError
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.learning.session_result import SessionResult
from lab.mdp import BoolArray, FloatArray
from lab.tasks.record import Learned
from lab.teaching.events import ScenePrepared, Tell
from lab.teaching.kept_session import KeptSession, NewSession, check_new
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted, Lesson, LessonPlan
from lab.teaching.teacher import Teacher, check_name
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox
from lab.view.plots import learning_curves


class Subject(Protocol):
    """The subject of a lesson. It is made, with checked options, before anything is surveyed.

    name: of the task, world or environment, which the policy is saved under; settings: of learner and gate; region: (S,) bool,
    the states in which advice counts, None for all; scene: the place, for displays.
    """

    name: str
    settings: Learned
    region: BoolArray | None = None
    scene: object = None

    def prepare(self, seed: int) -> Problem:
        """The problem, which is surveyed now. Raises BadInput if it cannot be learned."""

    def tried(self, problem: Problem, policy: Policy) -> str | None:
        """Tries the policy in physics; returns why it failed, None if it did not, or if there is no simulation."""
        return None

    def reach(self) -> BoolArray | None:
        """The states of the prepared problem that the arm can reach, (S,) bool; None for all, or if there is no arm."""
        return None

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """Draws pictures other than the learning curve into the folder `out`; returns their files by name."""
        return {}

    def facts(self) -> dict[str, Any]:
        """Further items for the lesson's document."""
        return {}


def teach(
    subject: Subject, options: LessonOptions, teacher: Teacher, out: Path | None, kept: KeptSession | None = None
) -> dict[str, Any]:
    """The document of `lab teach --json`, after a new session with these options, or after the stored one `kept`, resumed.

    Pictures and the receipt are written to `out`. Raises BadInput for bad options, WorkFailed, and Interrupted, whose text says
    how to resume.
    """
    check_name(options.save)
    if kept is None and out is not None:
        check_new(out)
    session = kept or NewSession(out, teacher.toolbox, options)
    teacher = replace(teacher, keep=session.keep, begun=None if kept is None else kept.begun)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"output folder '{out}' (--out): {error.strerror or error}") from error
    try:
        document = one_lesson(subject, teacher, options.save, out, options.sessions or 1)
    except KeyboardInterrupt as stopped:
        if session.journal is None:
            raise
        what = str(stopped) or "stopped by Ctrl-C; the journal has all that was said"
        raise Interrupted(f"{what}{session.resume_command(teacher.toolbox)}") from None
    try:
        return document | session.worth()
    except BadInput as error:  # the policy has been saved already
        return document | {"missing": [*document.get("missing", []), str(error)]}


def one_lesson(
    subject: Subject, teacher: Teacher, name: str | None = None, out: Path | None = None, sessions: int = 1
) -> dict[str, Any]:
    """The document of `lab teach --json`, without a receipt, after one session whose policy is saved.

    The session continues an unfinished policy of the same problem, if there is one. A skill that is tried in physics counts as
    solved only if that succeeds; `failure` says why it did not, and `missing` why a picture could not be drawn.
    sessions: those of the run that the lesson belongs to. Raises BadInput if the policy called `name` is of another problem.
    """
    teacher, plan = planned(subject, teacher, name, sessions)
    return carried_out(subject, teacher, plan, out)


def carried_out(subject: Subject, teacher: Teacher, plan: LessonPlan, out: Path | None) -> dict[str, Any]:
    """The document of `one_lesson` after the planned lesson."""
    problem, lesson = plan.problem, teacher.teach(plan)
    document = document_of(problem, lesson, teacher) | subject.facts()
    if out is None:
        return document
    missing = []
    returns = lesson.result.returns if lesson.result is not None and lesson.result.by_return else None
    for draw in (partial(_draw_curve, problem.name, returns), subject.draw):
        try:
            document["files"] |= draw(lesson.policy, out)
        except (OSError, LabError) as error:  # the policy has been saved already
            missing.append(str(error))
    return document | ({"missing": missing} if missing else {})


def planned(
    subject: Subject, teacher: Teacher, name: str | None = None, sessions: int = 1
) -> tuple[Teacher, LessonPlan]:
    """The teacher for this subject, and the plan of the lesson, which is surveyed now; `Teacher.teach` carries it out."""
    check_name(name)
    problem = subject.prepare(teacher.seed)
    teacher.tell(ScenePrepared(subject.scene, problem))
    teacher = replace(teacher, advising=replace(teacher.advising, region=subject.region), trial=subject.tried)
    settings = subject.settings
    plan = LessonPlan(problem, settings.learner, settings.gate, subject.name, name=name, sessions=sessions)
    return teacher, teacher.continuing(plan)


def replay(kept: KeptSession, subject: Subject, tell: Tell) -> dict[str, Any]:
    """The document of `lab replay --json`, after the events of a stored session were repeated; nothing is written.

    tell: receives the events. Raises KeyboardInterrupt on Ctrl-C.
    """
    options = kept.options
    people = [split_praise(name)[0] for name in options.advisors]
    advising = options.advising(dict.fromkeys(people, _nobody))  # the journal answers for people
    with TemporaryDirectory() as folder:
        teacher = Teacher(Toolbox(folder), advising, options.seed, tell, keep=kept.keep, begun=kept.begun)
        try:
            one_lesson(subject, teacher, options.save, sessions=options.sessions or 1)
        except Interrupted:  # at the end of an unfinished journal, or by Ctrl-C
            if kept.journal is None or kept.journal.folding:
                raise KeyboardInterrupt from None
    return kept.replayed()


def _nobody(request: AdviceRequest) -> int | None:
    raise AdvisorLeft


def document_of(problem: Problem, lesson: Lesson, teacher: Teacher) -> dict[str, Any]:
    """The document of `lab teach --json`, before any file is written."""
    policy, result = lesson.policy, lesson.result
    assert result is not None
    return {
        "subtask": problem.subtask,
        "skill": problem.name,
        "task": policy.task,
        "learner": policy.learner["learner"],
        "gate": policy.gate["gate"],
        "advisor": str(teacher.advising),
        "memory": policy.gate["memory"],
        "seed": teacher.seed,
        "episodes": len(result.steps),
        "steps_per_episode": result.steps.tolist(),
        "guided_episodes": [n for n, guided in enumerate(result.guided.tolist(), start=1) if guided],
        "requests": result.requests,
        "helped_steps": result.helped_steps,
        "misleads": result.misleads,
        "rejected_at_episode": result.rejected_at_episode,
        "optimal_steps": result.optimal_steps,
        "final_steps": result.final_steps,
        "steps_are_means": problem.environment is not None,  # both are means over drawn starts and steps
        "solved": result.solved and lesson.failure is None,
        "failure": lesson.failure,
        "source": lesson.source,
        "saved_as": policy.name,
        "files": {},
    } | (_returned(result) if result.by_return else {})


def _returned(result: SessionResult) -> dict[str, Any]:
    """The further items of a problem that is scored by return; a return that is not known is None."""
    return {
        "score": "return",
        "returns_per_episode": [None if isnan(value) else value for value in result.returns.tolist()],
        "final_return": result.final_return,
        "best_return": result.best_return,
    }


def _draw_curve(name: str, returns: FloatArray | None, policy: Policy, out: Path) -> dict[str, str]:
    out.mkdir(parents=True, exist_ok=True)
    learning_curves({name: policy}, out / "learning-curve.png", None if returns is None else {name: returns})
    return {"learning_curve": str(out / "learning-curve.png")}
