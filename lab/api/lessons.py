"""`lab.teach`: one lesson and its result."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Unpack

from annotated_types import Ge, Le, Lt

from lab.advice.journal import Journal
from lab.api.options import (
    Advisors,
    Settings,
    ToolboxOrPlace,
    advising_of,
    asks_page,
    check_common,
    data_frame,
    heard_by,
    several,
    toolbox_of,
)
from lab.api.pictures import Picture
from lab.errors import BadInput, check_value
from lab.lazy import pandas
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.mdp import FloatArray
from lab.teaching.events import told_to, unheard
from lab.teaching.kept_session import NewSession, check_new, known_values, receipt_of
from lab.teaching.lesson import Subject, document_of, planned
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted, Lesson, LessonPlan
from lab.teaching.peer_lesson import PeerLessons, check_alone, of_tasks
from lab.teaching.peers import FEWEST, MOST, PeerResult
from lab.teaching.step_record import StepRecord
from lab.teaching.subjects import Teachable, subject_from
from lab.teaching.teacher import Teacher
from lab.toolbox.names import default_address
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox
from lab.view.plots import learning_curves

KEPT_SETTINGS = ("learner", "gate", "memory", "episodes")  # those that a stored session holds, as `lab teach` has them


@dataclass(frozen=True, eq=False)
class LessonResult:
    """The result of a lesson, which notebooks display.

    problem: the problem, with its table `problem.mdp`; lesson: the policy and the session's counts; document: the dict that
    `lab teach --json` prints, without the items of other tasks' lessons, and with a receipt if a person was asked or `out` was
    given; peers: the results of all peers if there were several, otherwise (). Policy and session are then those of the best peer
    of the problem.

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

    @property
    def receipt(self) -> list[str]:
        """What the advice was worth, as lines of text; [] unless a person was asked or `out` was given."""
        return [*self.document.get("receipt", {}).get("lines", ())]

    def _repr_html_(self) -> str:
        receipt = "\n".join(self.receipt)
        worth = f"<pre>{escape(receipt)}</pre>" if receipt else ""
        return f"<p>{escape(str(self))}</p>{self.curve._repr_svg_()}{worth}"


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
    out: Path | str | None = None,
    page: str | None = None,
    **settings: Unpack[Settings],
) -> LessonResult:
    """The result of one teaching session; the same problem, settings and seed give the same table.

    problem: a name as for `lab teach` (a sub-task of `task`, a world, "gym:ID"), a `GridWorld`, a `TabularMDP` or a `Problem`.
    advisor: a name ("expert", "tau=0.2", "accuracy=0.8", "llm:URL", "none"), a function of an `AdviceRequest` that returns an
    action or None, an object with `advise`, or a list of these. In a notebook also "web": you answer on the teaching page in the
    cell while it runs.
    seed: of all randomness.
    toolbox: saves the policy, and provides an unfinished one to continue; None (default): nothing is saved, see
    `LessonResult.keep`.
    task: the task that a sub-task belongs to, default "toast".
    sight: "limited" restricts advice to the region in a world's file; default "full".
    record: whether all steps are recorded, see `LessonResult.steps`.
    peers: 2 to 16 learners of the problem at once, each of which asks the others by its gate; `advisor` is then left out.
    peer_tasks: further tasks whose sub-task of that name is learned at the same time, such as with another arm; by one learner
    each, or by `peers` learners each. Their best policies go to the toolbox.
    out: a folder for the session's journal and receipt, which `lab replay` and `lab teach --resume` read. The problem and the
    advisors are then given by name, and the settings are among those of the command: learner, gate, memory, episodes.
    page: where the browser finds the page of "web", with the place {port}, such as "https://hub.example.org/user/me/proxy/{port}/";
    None: on this computer, or as Colab says.
    settings: of learner and gate, by the names in docs/settings.md; `learner` and `gate` may also be classes.

    Raises BadInput for an unknown name, a value out of range, and what does not fit together; WorkFailed if the toolbox cannot
    be reached; Interrupted, which is a KeyboardInterrupt, if the lesson is ended before its last episode. An error in an advisor,
    gate or learner of your own is raised as it is.

        >>> import lab
        >>> lesson = lab.teach("world-1", advisor="expert", seed=1, episodes=100)
        >>> lesson.solved, lesson.session.final_steps == lesson.session.optimal_steps
        (True, True)
    """
    check_common("lab.teach", seed=seed, task=task, record=record)
    if peers is not None or peer_tasks:
        _check_peers(peers, peer_tasks, advisor=advisor, sight=sight, record=record, out=out)
    subject = subject_from(problem, task, sight)
    subjects = of_tasks(subject, peer_tasks, lambda other: subject_from(problem, other))
    for one in subjects:
        one.settings = one.settings.changed("", **settings)
    with TemporaryDirectory() as nowhere, ExitStack() as stack:
        box, session, seat = toolbox_of(toolbox, nowhere), None, None
        if out is not None:
            session = NewSession(Path(out), box, _kept_options(problem, task, sight, advisor, seed, settings))
            check_new(Path(out))
        if asks_page(advisor):
            from lab.seat.notebook_cell import cell_seat

            seat = stack.enter_context(cell_seat(page))
        elif page is not None:
            raise BadInput(f"page {page!r} (lab.teach): only the advisor 'web' has a page")
        steps = StepRecord() if record else None
        advising = advising_of(advisor, toolbox, {} if seat is None else seat.people())
        heard = [one.hear for one in (steps, seat) if one is not None]
        tell = heard_by(advising, told_to(*heard) if heard else unheard)
        journal = Journal()
        keep = (lambda plan: journal) if session is None else session.keep
        teacher = Teacher(box, advising, seed, tell, keep)
        together = None
        if peers is not None or peer_tasks:
            together = PeerLessons(subjects, teacher, peers or 1)
            taught = together.each(lambda number, subject, own, plan: (own, plan, own.teach(plan)))
            teacher, plan, lesson = taught[0]
        else:
            teacher, plan = planned(subject, teacher)
            try:
                lesson = teacher.teach(plan)
            except Interrupted as stopped:
                raise Interrupted(_how_stopped(stopped, plan, session, toolbox)) from None
        document = document_of(plan.problem, lesson, teacher) | subject.facts()
        if session is not None:
            document |= session.worth()
        elif seat is not None:
            worth = receipt_of(plan, journal, known_values(plan))
            document["receipt"] = worth.to_json() | {"lines": worth.lines()}
        if seat is not None:
            seat.lesson_over(document)
    if together is None:
        return LessonResult(plan.problem, lesson, document, subject, steps)
    document |= {"best_peer": together.best(0).number, "peers": [peer.to_json() for peer in together.peers]}
    return LessonResult(plan.problem, lesson, document, subject, steps, together.peers)


def _kept_options(
    problem: Teachable, task: str | None, sight: str | None, advisor: Advisors, seed: int, settings: Mapping[str, Any]
) -> LessonOptions:
    """The options of a session that is stored. Raises BadInput for what a journal cannot hold."""
    names = several(advisor)
    given: dict[str, list[object]] = {
        "problem": [problem],
        "advisor": [*names],
        **{name: [settings.get(name)] for name in ("learner", "gate")},
    }
    for name, values in given.items():
        for value in values:
            if not isinstance(value, str | Path | None):
                raise BadInput(
                    f"out beside {name} {value!r} (lab.teach): a stored session holds names: give the {name} by name"
                )
    others = [name for name, value in settings.items() if value is not None and name not in KEPT_SETTINGS]
    if others:
        raise BadInput(
            f"out beside {others[0]} (lab.teach): a stored session holds the settings {', '.join(KEPT_SETTINGS)}"
        )
    kept: dict[str, Any] = {name: settings.get(name) for name in KEPT_SETTINGS}
    return LessonOptions(str(problem), task, sight, advisors=tuple(map(str, names)), seed=seed, **kept)


def _how_stopped(stopped: Interrupted, plan: LessonPlan, session: NewSession | None, toolbox: ToolboxOrPlace) -> str:
    """The message of an interrupted lesson: how it is resumed, or what would have kept it."""
    if session is not None:
        return f"{stopped}{session.resume_command(toolbox_of(toolbox, default_address()))}"
    if toolbox is not None:
        return str(stopped)
    return f"'{plan.problem.name}' was stopped before its last episode; nothing is kept: name a toolbox, or a folder with out="


def _check_peers(
    peers: int | None,
    peer_tasks: Sequence[str],
    *,
    advisor: Advisors,
    sight: str | None,
    record: bool,
    out: Path | str | None,
) -> None:
    """Raises BadInput for another number of peers, for tasks that are no names, and for what cannot be combined with them."""
    if peers is not None:
        check_value("peers", peers, Annotated[int, Ge(FEWEST), Le(MOST)], "lab.teach")
    if isinstance(peer_tasks, str) or not all(isinstance(name, str) for name in peer_tasks):
        raise BadInput(f"peer_tasks {peer_tasks!r} (lab.teach): wanted a list of the names of tasks")
    check_alone({"advisor": advisor not in (None, "expert", "none"), "sight": sight, "record": record, "out": out})
