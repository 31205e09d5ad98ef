"""What a lesson teaches and what comes of it: the records that teacher, sessions and listeners hand on."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lab.advice.journal import Journal
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.toolbox.fitness import Fitness
from lab.toolbox.policy import Policy

Source = Literal["learned", "reused", "continued", "adapted"]
MAX_SESSIONS = 20  # to reach the goal at all; further sessions go on from the table of the one before


@dataclass(frozen=True)
class LessonPlan:
    """What a lesson teaches, to which learner with which gate, and the task, world or environment that it is kept under.

    unfinished: a policy of this very problem that is learned on; warm: one of another problem that the table is begun
    from; name: what the policy is saved as, None: a free name; sessions: at most so many.
    """

    problem: Problem
    learner: LearnerSettings
    gate: GateSettings
    task: str
    unfinished: Policy | None = None
    warm: Policy | None = None
    name: str | None = None
    sessions: int = MAX_SESSIONS

    @property
    def begins_from(self) -> Policy | None:
        """The policy whose table it begins with, None: it begins with zeros."""
        return self.unfinished or self.warm


@dataclass(frozen=True)
class Lesson:
    """A taught skill: its policy with all its history, where that came from, and the sessions now (None when reused).

    failure: why it failed when it was tried in physics, None when it did not, or was not tried. Of a lesson of a run also
    reason: why it is reused, adapted or learned; parent: the policy that an adapted one was begun from; fitness: what was
    judged of that, of the one that is reused though it was learned for another problem, or of the best one that was
    refused; saved: how many episodes and helped steps fewer than the policy took that was found, or one session from
    nothing, if that is more; other_arm: the one that the found policy was learned with, "" when it is this task's own.
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
        """Those of the greedy way in this problem, and the fewest."""
        if self.source == "reused" and self.fitness is not None:
            return self.fitness.moves, self.fitness.fewest
        return self.policy.final_steps, self.policy.optimal_steps

    @property
    def from_task(self) -> str:
        """The task whose policy is reused, or was adapted; "" where it was learned from nothing, or here before."""
        if self.source == "reused":
            return self.policy.task
        return "" if self.parent is None else self.parent.task


class Interrupted(KeyboardInterrupt):
    """Ctrl-C: what was learned so far has been kept, and the text says so."""


Keep = Callable[[LessonPlan], Journal]  # gives a lesson its journal
Trial = Callable[[Problem, Policy], str | None]  # tries in physics what was learned: why it failed, or None
