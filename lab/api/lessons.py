"""`lab.teach`: one lesson and its result."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Unpack

from annotated_types import Ge, Le, Lt

from lab.api.options import (
    Advisors,
    Settings,
    ToolboxOrPlace,
    advising_of,
    check_common,
    data_frame,
    heard_by,
    toolbox_of,
)
from lab.api.pictures import Picture
from lab.errors import BadInput, check_value
from lab.lazy import pandas
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.mdp import FloatArray
from lab.teaching.events import unheard
from lab.teaching.lesson import Subject, document_of, planned
from lab.teaching.lesson_plan import Lesson
from lab.teaching.peer_lesson import PeerLessons, check_alone, of_tasks
from lab.teaching.peers import FEWEST, MOST, PeerResult
from lab.teaching.step_record import StepRecord
from lab.teaching.subjects import Teachable, subject_from
from lab.teaching.teacher import Teacher
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox
from lab.view.plots import learning_curves


@dataclass(frozen=True, eq=False)
class LessonResult:
    """The result of a lesson, which notebooks display.

    problem: the problem, with its table `problem.mdp`; lesson: the policy and the session's counts; document: the dict that
    `lab teach --json` prints, without the items of other tasks' lessons; peers: the results of all peers if there were several,
    otherwise (). Policy and session are then those of the best peer of the problem.

        >>> import lab
        >>> lesson = lab.teach(lab.world("S.#\\n..G"), gate="never", advisor=None)
        >>> lesson.q.shape, lesson.solved, len(lesson.rows()) == len(lesson.session.steps)
        ((6, 4), True, True)
    """

    problem: Problem
    lesson: Lesson
    document: dict[str, Any]
    _subject: Subject
    _record: StepRecord | None = None
    peers: tuple[PeerResult, ...] = ()

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
        """The learned action values, (S, A) float64."""
        return self.policy.q

    @property
    def solved(self) -> bool:
        """Whether the greedy path is a shortest one and, if the skill was tried in physics, it succeeded."""
        return bool(self.document["solved"])

    def act(self, state: int) -> int:
        """The greedy action in a state, an index of the problem's `action_labels`. Raises BadInput for an unknown state."""
        check_value("state", state, Annotated[int, Ge(0), Lt(len(self.q))], self.problem.name)
        return int(self.q[state].argmax())

    def rows(self) -> list[dict[str, Any]]:
        """One row per episode: its number, its steps (max_steps + 1 if it failed), and whether any step was advised.

        In a problem that is scored by return, also its return.
        """
        curve = zip(self.session.steps.tolist(), self.session.guided.tolist(), strict=True)
        rows = [{"episode": n, "steps": steps, "guided": guided} for n, (steps, guided) in enumerate(curve, start=1)]
        if self.session.by_return:
            for row, returned in zip(rows, self.session.returns.tolist(), strict=True):
                row["return"] = returned
        return rows

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. Raises BadInput if pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def curve(self) -> Picture:
        """The learning curve: steps, or returns, by episode, with the advised episodes marked."""
        name = self.problem.name
        returns = {name: self.session.returns} if self.session.by_return else None
        return Picture.drawn(lambda path: learning_curves({name: self.policy}, path, returns))

    @cached_property
    def map(self) -> Picture:
        """The value map: the value of each cell, and the greedy path. Raises BadInput if the problem is no grid with two axes."""
        with TemporaryDirectory() as folder:
            files = self._subject.draw(self.policy, Path(folder))
            if "value_map" not in files:
                raise BadInput(f"'{self.problem.name}': it is no grid with two axes, so there is no map of it")
            return Picture(Path(files["value_map"]).read_bytes())

    def keep(self, toolbox: ToolboxOrPlace = None) -> Path:
        """Saves the policy in a toolbox (None: the user's own) and returns its file; a better policy in use stays in use."""
        return (toolbox if isinstance(toolbox, Toolbox) else Toolbox(toolbox)).save(self.policy)

    @property
    def steps(self) -> StepRecord:
        """The record of all steps, with `to_minari` and `to_tensorboard`. Raises BadInput unless taught with record=True."""
        if self._record is None:
            raise BadInput(f"'{self.problem.name}': its steps were not recorded: teach it with record=True")
        return self._record

    def __str__(self) -> str:
        how = f"{self.session.helped_steps} helped steps in {self.session.guided.sum()} of {len(self.session.steps)} episodes"
        if self.session.final_return is not None:
            best = (
                "" if self.session.best_return is None else f", that of the best policy {self.session.best_return:.4g}"
            )
            return f"{self.problem.name}: mean return {self.session.final_return:.4g}{best}; {how}"
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
    peers: int | None = None,
    peer_tasks: Sequence[str] = (),
    **settings: Unpack[Settings],
) -> LessonResult:
    """The result of one teaching session; the same problem, settings and seed give the same table.

    problem: a name as for `lab teach` (a sub-task of `task`, a world, "gym:ID"), a `GridWorld`, a `TabularMDP` or a `Problem`.
    advisor: a name ("expert", "tau=0.2", "accuracy=0.8", "llm:URL", "none"), a function of an `AdviceRequest` that returns an
    action or None, an object with `advise`, or a list of these.
    seed: of all randomness.
    toolbox: saves the policy, and provides an unfinished one to continue; None (default): nothing is saved, see
    `LessonResult.keep`.
    task: the task that a sub-task belongs to, default "toast".
    sight: "limited" restricts advice to the region in a world's file; default "full".
    record: whether all steps are recorded, see `LessonResult.steps`.
    peers: 2 to 16 learners of the problem at once, each of which asks the others by its gate; `advisor` is then left out.
    peer_tasks: further tasks whose sub-task of that name is learned at the same time, such as with another arm; by one learner
    each, or by `peers` learners each. Their best policies go to the toolbox.
    settings: of learner and gate, by the names in docs/settings.md; `learner` and `gate` may also be classes.

    Raises BadInput for an unknown name, a value out of range, and what does not fit together; WorkFailed if the toolbox cannot
    be reached. An error in an advisor, gate or learner of your own is raised as it is.

        >>> import lab
        >>> lesson = lab.teach("world-1", advisor="expert", seed=1, episodes=100)
        >>> lesson.solved, lesson.session.final_steps == lesson.session.optimal_steps
        (True, True)
    """
    check_common("lab.teach", seed=seed, task=task, record=record)
    if peers is not None or peer_tasks:
        _check_peers(peers, peer_tasks, advisor=advisor, sight=sight, record=record)
    subject = subject_from(problem, task, sight)
    subjects = of_tasks(subject, peer_tasks, lambda other: subject_from(problem, other))
    for one in subjects:
        one.settings = one.settings.changed("", **settings)
    with TemporaryDirectory() as nowhere:
        steps = StepRecord() if record else None
        advising = advising_of(advisor, toolbox)
        tell = heard_by(advising, unheard if steps is None else steps.hear)
        teacher = Teacher(toolbox_of(toolbox, nowhere), advising, seed, tell)
        together = None
        if peers is not None or peer_tasks:
            together = PeerLessons(subjects, teacher, peers or 1)
            taught = together.each(lambda number, subject, own, plan: (own, plan, own.teach(plan)))
            teacher, plan, lesson = taught[0]
        else:
            teacher, plan = planned(subject, teacher)
            lesson = teacher.teach(plan)
    document = document_of(plan.problem, lesson, teacher) | subject.facts()
    if together is None:
        return LessonResult(plan.problem, lesson, document, subject, steps)
    document |= {"best_peer": together.best(0).number, "peers": [peer.to_json() for peer in together.peers]}
    return LessonResult(plan.problem, lesson, document, subject, steps, together.peers)


def _check_peers(
    peers: int | None, peer_tasks: Sequence[str], *, advisor: Advisors, sight: str | None, record: bool
) -> None:
    """Raises BadInput for another number of peers, for tasks that are no names, and for what cannot be combined with them."""
    if peers is not None:
        check_value("peers", peers, Annotated[int, Ge(FEWEST), Le(MOST)], "lab.teach")
    if isinstance(peer_tasks, str) or not all(isinstance(name, str) for name in peer_tasks):
        raise BadInput(f"peer_tasks {peer_tasks!r} (lab.teach): wanted a list of the names of tasks")
    check_alone({"advisor": advisor not in (None, "expert", "none"), "sight": sight, "record": record})
