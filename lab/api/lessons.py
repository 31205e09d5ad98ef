"""`lab.teach`: one lesson, and what came of it."""

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Unpack

from lab.api.options import Advisors, Settings, ToolboxOrPlace, advising_of, data_frame, toolbox_of
from lab.api.pictures import Picture
from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.mdp import FloatArray
from lab.teaching.events import unheard
from lab.teaching.lesson import Subject, document_of, planned
from lab.teaching.lesson_plan import Lesson
from lab.teaching.step_record import StepRecord
from lab.teaching.subjects import Teachable, subject_from
from lab.teaching.teacher import Teacher
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class LessonResult:
    """What a lesson came to: the policy, and how it was learned.

    problem: what was learned; lesson: with the policy and the session's counts; document: as `lab teach --json` gives it.
    """

    problem: Problem
    lesson: Lesson
    document: dict[str, Any]
    _subject: Subject
    _record: StepRecord | None = None

    @property
    def policy(self) -> Policy:
        """The learned table with its provenance."""
        return self.lesson.policy

    @property
    def session(self) -> SessionResult:
        """The session's arrays and counts."""
        assert self.lesson.result is not None
        return self.lesson.result

    @property
    def q(self) -> FloatArray:
        """The learned action values, (S, A)."""
        return self.policy.q

    @property
    def solved(self) -> bool:
        """Whether the greedy way is as short as can be, and the skill worked in physics where it was tried."""
        return bool(self.document["solved"])

    def act(self, state: int) -> int:
        """The greedy action in a state."""
        return int(self.q[state].argmax())

    def rows(self) -> list[dict[str, Any]]:
        """One row an episode: its steps (max_steps + 1 where it failed), and whether it had advice."""
        curve = zip(self.session.steps.tolist(), self.session.guided.tolist(), strict=True)
        return [{"episode": n, "steps": steps, "guided": guided} for n, (steps, guided) in enumerate(curve, start=1)]

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. BadInput when pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def curve(self) -> Picture:
        """The learning curve: steps of each episode, those with advice marked."""
        from lab.view.plots import learning_curves

        return Picture.drawn(lambda path: learning_curves({self.problem.name: self.policy}, path))

    @cached_property
    def map(self) -> Picture:
        """What the cells are worth to the learner, and its way. BadInput for what is no map."""
        with TemporaryDirectory() as folder:
            files = self._subject.draw(self.policy, Path(folder))
            if "value_map" not in files:
                raise BadInput(f"'{self.problem.name}': it is no grid with two axes, so there is no map of it")
            return Picture(Path(files["value_map"]).read_bytes())

    def keep(self, toolbox: ToolboxOrPlace = None) -> Path:
        """Keep the policy in a toolbox, None: the user's own; the file. It is in use unless the one in use does better."""
        return (toolbox if isinstance(toolbox, Toolbox) else Toolbox(toolbox)).save(self.policy)

    @property
    def steps(self) -> StepRecord:
        """Every step of the lesson, with `to_minari` and `to_tensorboard`. BadInput unless it was taught with record=True."""
        if self._record is None:
            raise BadInput(f"'{self.problem.name}': its steps were not recorded: teach it with record=True")
        return self._record

    def __str__(self) -> str:
        how = f"{self.session.helped_steps} helped steps in {self.session.guided.sum()} of {len(self.session.steps)} episodes"
        return (
            f"{self.problem.name}: {self.session.final_steps} steps, the fewest are {self.session.optimal_steps}; {how}"
        )

    def _repr_html_(self) -> str:
        return f"<p>{escape(str(self))}</p>{self.curve._repr_svg_()}"


def teach(
    problem: Teachable,
    *,
    advisor: Advisors = "expert",
    seed: int = 0,
    toolbox: ToolboxOrPlace = None,
    task: str | None = None,
    sight: str | None = None,
    record: bool = False,
    **settings: Unpack[Settings],
) -> LessonResult:
    """One teaching session, as `lab teach` holds it: the same problem, settings and seed give the same table.

    problem: what `lab teach` takes by name (a sub-task of `task`, a world, "gym:ID"), or a `GridWorld`, a `TabularMDP` or
    a `Problem`; advisor: a name ("expert", "tau=0.2", "none"), a function of a request that gives an action or None, an
    object with `advise`, or several of these; toolbox: where the policy is kept, and an unfinished one gone on with;
    None: nothing is kept (see `LessonResult.keep`); sight: "limited": advice is heard in a world's region only; record: each
    step is recorded (see `LessonResult.steps`).
    Raises BadInput for whatever does not fit.
    """
    subject = subject_from(problem, task, sight)
    subject.settings = subject.settings.changed("", **settings)
    with TemporaryDirectory() as nowhere:
        steps = StepRecord() if record else None
        tell = unheard if steps is None else steps.hear
        teacher = Teacher(toolbox_of(toolbox, nowhere), advising_of(advisor, toolbox), seed, tell)
        teacher, plan = planned(subject, teacher)
        lesson = teacher.one_session(plan)
    document = document_of(plan.problem, lesson, teacher) | subject.facts()
    return LessonResult(plan.problem, lesson, document, subject, steps)
