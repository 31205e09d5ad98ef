"""The plan and the result of a lesson, which teacher, sessions and listeners share."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lab.advice.journal import Journal
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.toolbox.fitness import Fitness
from lab.toolbox.policy import Policy

Source = Literal["learned", "reused", "continued", "adapted", "composed"]
MAX_SESSIONS = 20  # the limit on sessions for reaching the goal; each continues the table of the one before


@dataclass(frozen=True)
class LessonPlan:
    """The plan of a lesson.

    problem, learner, gate: what is learned, and how; task: the name of the task, world or environment, which the policy is saved
    under; unfinished: a policy of exactly this problem to continue; warm: a policy of another problem to warm-start from; name:
    of the saved policy, None for a free name; sessions: the limit; composed: whether `warm` was put together for this lesson.
    """

    problem: Problem
    learner: LearnerSettings
    gate: GateSettings
    task: str
    unfinished: Policy | None = None
    warm: Policy | None = None
    name: str | None = None
    sessions: int = MAX_SESSIONS
    composed: bool = False

    @property
    def begins_from(self) -> Policy | None:
        """The policy whose table the lesson begins with, None if it begins anew."""
        return self.unfinished or self.warm


@dataclass(frozen=True)
class Lesson:
    """The result of a lesson.

    policy: with its whole history; source: where it came from; result: of the sessions now, None if it was reused.
    failure: why it failed in physics, None if it did not or was not tried.
    In the lessons of a run also: reason: why the policy is reused, adapted, composed or learned; parent: the policy that an
    adapted one was warm-started from; fitness: of that parent, of a reused policy of another problem, or of the best refused one;
    saved: how many fewer episodes and helped steps this took than the found policy, or than a session from nothing if that is
    more; other_arm: the arm that the found policy was learned with, "" if it is this task's.
    """

    policy: Policy
    source: Source
    result: SessionResult | None = None
    failure: str | None = None
    reason: str = ""
    parent: Policy | None = None
    fitness: Fitness | None = None
    saved: tuple[int, int] = (0, 0)
    other_arm: str = ""

    @property
    def steps(self) -> tuple[int | None, int | None]:
        """(steps, fewest): of the greedy path in this problem, and the fewest possible; None if missing or unknown."""
        if self.source == "reused" and self.fitness is not None:
            return self.fitness.moves, self.fitness.fewest
        return self.policy.final_steps, self.policy.optimal_steps

    @property
    def from_task(self) -> str:
        """The task whose policy is reused or was adapted; "" for none."""
        if self.source == "reused":
            return self.policy.task
        return "" if self.parent is None else self.parent.task


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a lesson; what was learned has been saved, and the text says so."""

    def _render_traceback_(self) -> list[str]:
        """The text alone, which a notebook shows in place of a traceback."""
        return [str(self)]


Keep = Callable[[LessonPlan], Journal]  # returns the journal of a lesson
Trial = Callable[[Problem, Policy], str | None]  # tries a policy in physics; returns why it failed, or None
