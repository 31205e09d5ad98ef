"""Find a skill in the toolbox, or teach it: learning sessions with a gate and an advisor, kept whatever happens."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal
from zlib import crc32

import numpy as np

from lab.advice.advisors import Ask, make_advisor
from lab.errors import WorkFailed
from lab.learning.session import Event, SessionResult, run_session, unreached
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, greedy_path
from lab.policy import MAX_NAME_LENGTH, Policy
from lab.skills.skill import Problem
from lab.taskfile import Subtask
from lab.toolbox import Toolbox

MAX_SESSIONS = 20  # further sessions go on from the table of the one before
_LONGEST_PROBLEM = MAX_NAME_LENGTH - 20  # characters of a policy's name; the rest is for its signature and state
Source = Literal["learned", "reused", "continued"]


class Interrupted(KeyboardInterrupt):
    """Ctrl-C: what was learned so far has been kept, and the text says so."""


@dataclass(frozen=True)
class Lesson:
    """A taught skill: its policy, where that came from, and the last session (None when it was reused)."""

    policy: Policy
    source: Source
    result: SessionResult | None = None


@dataclass(frozen=True)
class Teacher:
    """How to teach: who advises, with which seed, whom to tell, and where policies are kept.

    `ask` is the prompt behind the advisor 'terminal'; `on_event(problem name, event)` hears of episodes and requests.
    """

    toolbox: Toolbox
    advisor: str = "expert"
    seed: int = 0
    ask: Ask | None = None
    on_event: Callable[[str, Event], None] | None = None

    def find_or_teach(
        self, problem: Problem, settings: Subtask, task: str, known: Mapping[tuple[str, str], Policy]
    ) -> Lesson:
        """A policy that reaches the goal in exactly this problem: from `known`, by (sub-task, signature), or learned now.

        An unfinished policy is learned on from where it stands. WorkFailed when no session finds a way; Interrupted on Ctrl-C.
        """
        found = known.get((problem.subtask, problem.mdp.signature))
        if found is not None and not _belongs(found, problem.mdp):
            found = None
        if found is not None and fits(found.q, problem.mdp):
            return Lesson(found, "reused")
        return self.teach(problem, settings.learner, settings.gate, task, unfinished=found)

    def teach(
        self,
        problem: Problem,
        learner: LearnerSettings,
        gate: GateSettings,
        task: str,
        *,
        unfinished: Policy | None = None,
        name: str | None = None,
        sessions: int = MAX_SESSIONS,
    ) -> Lesson:
        """Learn `problem` in up to `sessions` sessions, until a greedy path leads to the goal, and save the policy."""
        rng = np.random.default_rng([self.seed, crc32(problem.name.encode())])
        table = None if unfinished is None else unfinished.q
        whole: SessionResult | None = None
        for _ in range(sessions):
            advisor = make_advisor(self.advisor, problem.mdp, learner.discount, rng, self.ask)
            tell = None if self.on_event is None else lambda event: self.on_event(problem.name, event)  # type: ignore[misc]
            result = run_session(problem.mdp, learner, gate, advisor, rng, q0=table, on_event=tell)
            whole, table = _joined(whole, result), result.q
            if result.interrupted or fits(result.q, problem.mdp):
                break
        assert whole is not None
        policy = self._policy(whole, problem, learner, gate, task, name or self._free_name(problem, whole.solved))
        self.toolbox.save(policy)
        if whole.interrupted:
            raise Interrupted(
                f"stopped by Ctrl-C after {len(whole.steps)} episodes of '{problem.name}'; what was learned is kept"
            )
        if sessions > 1 and not fits(whole.q, problem.mdp):
            raise WorkFailed(
                f"'{problem.name}' was not learned in {len(whole.steps)} episodes with the advisor '{self.advisor}'; "
                "what was learned is kept: try a better advisor, or more episodes in the task file"
            )
        return Lesson(policy, "learned" if unfinished is None else "continued", whole)

    def _free_name(self, problem: Problem, solved: bool) -> str:
        """The name to save under; what did not get finished never replaces what is."""
        name = f"{problem.name[:_LONGEST_PROBLEM]} {problem.mdp.signature[:8]}"
        kept = None if solved else self.toolbox.find(problem.subtask, problem.mdp.signature, name)
        return f"{name} unfinished" if kept is not None and kept.solved else name

    def _policy(
        self,
        result: SessionResult,
        problem: Problem,
        learner: LearnerSettings,
        gate: GateSettings,
        task: str,
        name: str,
    ) -> Policy:
        return Policy.of(
            result,
            problem.mdp,
            name=name,
            subtask=problem.subtask,
            task=task,
            learner=learner,
            gate=gate,
            advisor=self.advisor,
            seed=self.seed,
        )


def fits(q: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]", mdp: TabularMDP) -> bool:
    """Whether greedy steps lead from every start of the problem to its goal."""
    return greedy_path(q, mdp, mdp.n_states)[2] and not unreached(q, mdp)


def _belongs(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy that bears a problem's signature also has its table's size and its actions."""
    return policy.q.shape == (mdp.n_states, mdp.n_actions) and policy.action_labels == mdp.action_labels


def _joined(before: SessionResult | None, after: SessionResult) -> SessionResult:
    """Two sessions of one table as one: curves one after the other, counts added, the later table."""
    if before is None:
        return after
    return replace(
        after,
        visits=before.visits + after.visits,
        steps=np.concatenate([before.steps, after.steps]),
        guided=np.concatenate([before.guided, after.guided]),
        requests=before.requests + after.requests,
        helped_steps=before.helped_steps + after.helped_steps,
        misleads=before.misleads + after.misleads,
        rejected_at_episode=before.rejected_at_episode
        if before.rejected_at_episode is not None
        else after.rejected_at_episode,
    )
