"""What people say in a run, at both levels: a journal for each lesson and one for the order, and what each was worth."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lab.advice.advisors import is_external
from lab.advice.journal import Journal
from lab.learning.requests import Ask
from lab.production.order import OrderAdvice, Ordered, person_of
from lab.production.run_journal import RunJournal, SessionKept
from lab.sequencing.cell.cell import Cell
from lab.teaching.events import ORDER
from lab.teaching.kept_order import OrderSession, OrderSessionOptions, kept_order
from lab.teaching.kept_session import KeptSession, NewSession, SessionInFolder
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import MAX_SESSIONS, LessonPlan
from lab.toolbox.registry import Toolbox


@dataclass
class RunAdvice:
    """Who is asked in a run; what people and language models say is kept in sessions, each named in the run's journal.

    given: the words of an order that is not to be looked for, "" for none; gate: when SRL asks about the order;
    cyclic: the order is to repeat the shortest cycle, of at most parts_per_cycle parts. Of a run that is resumed, the
    sessions that it began are continued.
    """

    toolbox: Toolbox
    options: LessonOptions
    journal: RunJournal = field(default_factory=RunJournal)
    given: str = ""
    gate: str = "ccrl"
    cyclic: bool = False
    parts_per_cycle: int | None = None
    sessions: dict[str, SessionInFolder] = field(default_factory=dict)

    @property
    def keeps_answers(self) -> bool:
        """Whether a person or a language model is among the advisors."""
        return any(map(is_external, self.options.advisors))

    # ---- the lessons

    def keep(self, plan: LessonPlan) -> Journal:
        """The journal of a lesson: the one that a resumed run has begun, or a new one."""
        name = plan.problem.name
        if not self.keeps_answers:
            return Journal()
        made = self.again(plan)
        if made is not None:
            return made
        new = NewSession(None, self.toolbox, replace(self.options, subtask=name, sessions=MAX_SESSIONS))
        self.sessions[name] = new
        made = new.keep(plan)
        self.journal.write(SessionKept(name, str(new.folder)))
        return made

    def again(self, plan: LessonPlan) -> Journal | None:
        """The journal of a lesson that a resumed run has begun; None where it has not.

        A scene that changed is another problem of the same name, with a session of its own.
        """
        name, signature = plan.problem.name, plan.problem.mdp.signature
        begun = [KeptSession(folder, "--resume") for folder in self.journal.sessions(name)]
        kept = next((session for session in begun if session.read.session.signature == signature), None)
        if kept is None:
            return None
        if kept.read.closed is not None:
            kept = KeptSession(kept.folder, "--resume", read_only=True)
        self.sessions[name] = kept
        return kept.keep(plan)

    # ---- the order

    def order(self, people: Mapping[str, Ask], durations: Mapping[str, Any]) -> OrderAdvice:
        """Whose word counts on the order; durations: those it is planned with, which its session keeps (`to_json`)."""

        def keep(cell: Cell, objective: str) -> Journal:
            begun = next(iter(self.journal.sessions(ORDER)), None)
            session = self._new_order(durations) if begun is None else self._order_again(begun)
            self.sessions[ORDER] = session
            made = session.keep(cell, objective)
            if begun is None:
                self.journal.write(SessionKept(ORDER, str(session.folder)))
            return made

        cyclic = self.cyclic, self.parts_per_cycle
        return OrderAdvice(self.given, person_of(self.options.advisors), self.gate, people, keep, *cyclic)

    def _new_order(self, durations: Mapping[str, Any]) -> OrderSession:
        options = OrderSessionOptions(
            task=str(self.options.task),
            toasts=self.options.toasts,
            method="srl",
            advisor=str(person_of(self.options.advisors)),
            gate=self.gate,
            seed=self.options.seed,
            parts=self.options.parts,
        )
        return OrderSession(options, self.toolbox, durations=durations)

    def _order_again(self, folder: Path) -> OrderSession:
        kept = kept_order(folder, "--resume", self.toolbox)
        is_over = kept.read is not None and kept.read.closed is not None
        return kept_order(folder, "--resume", self.toolbox, read_only=True) if is_over else kept

    # ---- what it was worth

    def receipts(self, found: Ordered) -> dict[str, Any]:
        """What the advice of each level was worth: by skill, where people were asked, and of the order, None for nobody's."""
        lessons = {
            name: session.worth() for name, session in self.sessions.items() if name != ORDER and _was_asked(session)
        }
        order = self.sessions.get(ORDER)
        where = {} if order is None or order.folder is None else {"session": str(order.folder)}
        return {"skills": lessons, "order": None if found.receipt is None else found.receipt | where}


def _was_asked(session: SessionInFolder) -> bool:
    """Whether anything was asked in it."""
    return session.journal is not None and session.receipt().questions > 0
