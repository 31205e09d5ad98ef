"""One lesson of one session in a subject, with its journal, its receipt and its pictures; and one shown again."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

from lab.advice.advisors import PEOPLE
from lab.errors import BadInput, LabError
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.mdp import BoolArray
from lab.tasks.record import Learned
from lab.teaching.events import ScenePrepared, Tell
from lab.teaching.kept_session import KeptSession, NewSession, check_new
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted, Lesson, LessonPlan
from lab.teaching.teacher import Teacher, check_name
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox


class Subject(Protocol):
    """What a lesson is about; it is made when its options are known to be right, before anything is surveyed.

    name: of the task, the world or the environment that the policy is kept under; settings: how it is learned; region
    (S,): where advice is heard, None: everywhere; scene: where it takes place, for those who show it.
    """

    name: str
    settings: Learned
    region: BoolArray | None = None
    scene: object = None

    def prepare(self, seed: int) -> Problem:
        """Survey what there is to learn; BadInput when it cannot be learned."""

    def tried(self, problem: Problem, policy: Policy) -> str | None:
        """Try in physics what was learned: why it failed, None when it did not, or where nothing is simulated."""
        return None

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """Pictures beside the learning curve: their files, by name."""
        return {}

    def facts(self) -> dict[str, Any]:
        """What the lesson's document says of it beside the rest."""
        return {}


def teach(
    subject: Subject, options: LessonOptions, teacher: Teacher, out: Path | None, kept: KeptSession | None = None
) -> dict[str, Any]:
    """The session that these options ask for, or `kept` gone on with, with its journal; the document of `lab teach --json`.

    Pictures and the receipt go to `out`. Raises BadInput for bad options, WorkFailed, and Interrupted, which says how to
    go on.
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
    except BadInput as error:  # the policy is kept by now
        return document | {"missing": [*document.get("missing", []), str(error)]}


def one_lesson(
    subject: Subject, teacher: Teacher, name: str | None = None, out: Path | None = None, sessions: int = 1
) -> dict[str, Any]:
    """One session in a subject; the policy is kept. Returns the document of `lab teach --json` without a receipt.

    It goes on from an unfinished policy of the same problem, if there is one. A skill that is tried in physics counts as
    solved when that succeeds, too; `failure` says why it did not; `missing`, why a picture could not be drawn.
    sessions: those of the run that the lesson belongs to.
    BadInput when the policy called `name` is of another problem.
    """
    teacher, plan = planned(subject, teacher, name, sessions)
    problem, lesson = plan.problem, teacher.one_session(plan)
    document = document_of(problem, lesson, teacher) | subject.facts()
    if out is None:
        return document
    missing = []
    for draw in (partial(_draw_curve, problem.name), subject.draw):
        try:
            document["files"] |= draw(lesson.policy, out)
        except (OSError, LabError) as error:  # the policy is kept by now
            missing.append(str(error))
    return document | ({"missing": missing} if missing else {})


def planned(
    subject: Subject, teacher: Teacher, name: str | None = None, sessions: int = 1
) -> tuple[Teacher, LessonPlan]:
    """What is surveyed now and is to be learned, and the teacher of this subject, whose `one_session` learns it."""
    check_name(name)
    problem = subject.prepare(teacher.seed)
    teacher.tell(ScenePrepared(subject.scene, problem))
    teacher = replace(teacher, advising=replace(teacher.advising, region=subject.region), trial=subject.tried)
    how = subject.settings
    return teacher, LessonPlan(problem, how.learner, how.gate, subject.name, name=name, sessions=sessions)


def replay(kept: KeptSession, subject: Subject, tell: Tell) -> dict[str, Any]:
    """Tells a kept session again, each question with its answer; nothing is learned or written.

    Returns the document of `lab replay --json`. Raises KeyboardInterrupt on Ctrl-C.
    """
    options = kept.options
    advising = options.advising(dict.fromkeys(PEOPLE, _nobody))  # the journal answers for them
    with TemporaryDirectory() as folder:
        teacher = Teacher(Toolbox(folder), advising, options.seed, tell, keep=kept.keep, begun=kept.begun)
        try:
            one_lesson(subject, teacher, options.save, sessions=options.sessions or 1)
        except Interrupted:  # by the journal's end, when it was not over, or by Ctrl-C
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
    }


def _draw_curve(name: str, policy: Policy, out: Path) -> dict[str, str]:
    from lab.view.plots import learning_curves

    out.mkdir(parents=True, exist_ok=True)
    learning_curves({name: policy}, out / "learning-curve.png")
    return {"learning_curve": str(out / "learning-curve.png")}
