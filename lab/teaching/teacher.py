"""Find a skill in the toolbox, or teach it: learning sessions with a gate and an advisor, kept whatever happens."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from math import inf
from typing import Any, Literal
from zlib import crc32

import numpy as np

from lab.advice.advising import Advising
from lab.advice.entries import Closed
from lab.advice.journal import Again, Journal
from lab.errors import BadInput, WorkFailed, counted
from lab.learning.environment import TableEnvironment, unreached
from lab.learning.events import AdviceEnded, AdviceRejected, Event
from lab.learning.problem import Problem
from lab.learning.requests import Advisor
from lab.learning.session import Session, SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, TabularMDP, greedy_path
from lab.tasks.grid_world import GridWorld
from lab.tasks.record import Learned
from lab.tasks.task_file import Subtask
from lab.toolbox.policy import MAX_NAME_LENGTH, Origin, Policy, is_name
from lab.toolbox.registry import Toolbox

MAX_SESSIONS = 20  # to reach the goal at all; further sessions go on from the table of the one before
MORE_SESSIONS = 3  # to find a shorter way once the goal is reached
_UNFINISHED = " unfinished"
_LONGEST_PROBLEM = MAX_NAME_LENGTH - 20  # characters of a policy's name; the rest is for its signature and state
Keep = Callable[[Problem, LearnerSettings, GateSettings, Policy | None], Journal]
Trial = Callable[[Problem, Policy], str | None]
Source = Literal["learned", "reused", "continued"]


class Interrupted(KeyboardInterrupt):
    """Ctrl-C: what was learned so far has been kept, and the text says so."""


@dataclass(frozen=True)
class Lesson:
    """A taught skill: its policy with all its history, where that came from, and the sessions now (None when reused).

    failure: why it failed when it was tried in physics, None when it did not, or was not tried.
    """

    policy: Policy
    source: Source
    result: SessionResult | None = None
    failure: str | None = None


class Audience:
    """Who hears how lessons go on; the base hears nothing."""

    def begins(self, problem: Problem, learner: LearnerSettings, gate: GateSettings, journal: Journal) -> None:
        """A lesson begins, or begins again because an answer was taken back: what it told before is told again."""

    def meets(self, advisor: Advisor | None) -> None:
        """Who advises in the session that begins now, several as a `Panel`."""

    def hears(self, name: str, event: Event, is_new: bool) -> None:
        """Something happened in the lesson of that name; not new: it is told again."""

    def goes_on(self, unfinished: Policy) -> None:
        """The next lesson goes on from what was left unfinished."""

    def stands(self, where: Any, problem: Problem) -> None:
        """Where the next lesson takes place, for those who show it: a prepared task, a world."""


@dataclass(frozen=True)
class Teacher:
    """How to teach: who advises, with which seed, whom to tell, and where policies and journals are kept.

    `audience` hears how lessons go on; `keep(problem, learner, gate, the policy that is learned on)` gives the journal of a
    lesson, by default one that is not written; `begun(problem)`, in a lesson that is resumed: the policy that it once
    went on from; `trial(problem, policy)` tries in physics what was learned, before it is kept: why it failed, or None.
    """

    toolbox: Toolbox
    advising: Advising = field(default_factory=Advising)
    seed: int = 0
    audience: Audience = field(default_factory=Audience)
    keep: Keep = lambda problem, learner, gate, unfinished: Journal()
    begun: Callable[[Problem], Policy | None] | None = None
    trial: Trial | None = None

    @property
    def advisor(self) -> str:
        """Who advises, in words."""
        return str(self.advising)

    def find_or_teach(
        self, problem: Problem, settings: Subtask, task: str, known: Mapping[tuple[str, str], Policy]
    ) -> Lesson:
        """A policy that reaches the goal in exactly this problem: from `known`, by (sub-task, signature), or learned now.

        Only a solved policy is reused; any other is learned on from where it stands, and followed when it fits though
        no shorter way was found. WorkFailed when no session finds a way; Interrupted on Ctrl-C.
        """
        found = known.get((problem.subtask, problem.mdp.signature))
        if found is not None and not _belongs(found, problem.mdp):
            found = None
        if found is not None and found.solved and fits(found.q, problem, settings.learner):
            return Lesson(found, "reused")
        return self.teach(problem, settings.learner, settings.gate, task, unfinished=found)

    def unfinished(self, problem: Problem, name: str | None = None) -> Policy | None:
        """The unsolved policy to go on from: the one it would replace, the best one, or the one beside a solved one."""
        key = (problem.subtask, problem.mdp.signature)
        for wanted in (name or plain_name(problem), None, f"{plain_name(problem)}{_UNFINISHED}"):
            found = self.toolbox.find(*key, wanted)
            if found is not None and not found.solved and _belongs(found, problem.mdp):
                return found
        return None

    def one_session(
        self, problem: Problem, settings: Learned, task: str, name: str | None, *, sessions: int = 1
    ) -> Lesson:
        """One session that goes on from what was broken off, or left unsolved by the same learner, gate and advisor.

        `sessions`: as many as the lesson of a run had, when that is gone on with. BadInput when `name` is that of
        another problem's policy.
        """
        for row in self.toolbox.list() if name is not None else ():
            if row["name"] == name and (row["subtask"], row["signature"]) != (problem.subtask, problem.mdp.signature):
                raise BadInput(
                    f"policy name '{name}' (--save): it is the name of a policy for '{row['subtask']}' in another "
                    f"problem ({row['signature'][:8]}): choose another name, or remove that policy"
                )
        if self.begun is not None:
            found = self.begun(problem)
        else:
            found = self.unfinished(problem, name)
            if found is not None and (self.advising.records or not self._same(found, settings)):
                found = None  # another learner, gate or advisor begins anew, so that they can be compared
            if found is not None:
                self.audience.goes_on(found)
        return self.teach(
            problem, settings.learner, settings.gate, task, unfinished=found, name=name, sessions=sessions
        )

    def _same(self, policy: Policy, settings: Learned) -> bool:
        """Whether a policy was learned in this way, or broken off before anything can be said of its gate and advisor."""
        length = {"episodes": 0}
        broken_off = len(policy.curve) < policy.learner.get("episodes", 0)
        gate = asdict(settings.gate)
        alike = (gate | policy.gate, policy.advisor) == (gate, self.advisor)  # an older one does not know all settings
        return policy.learner | length == asdict(settings.learner) | length and (alike or broken_off)

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
        """Learn `problem` in up to `sessions` sessions, until its greedy path is as short as can be, and save the policy.

        Once the path leads to the goal, at most MORE_SESSIONS further ones look for a shorter one. A table that leads
        to the goal is never given up for a worse one. `unfinished`, a policy of this very problem, is learned on.
        """
        self.advising.check_records(problem.mdp)
        journal = self.keep(problem, learner, gate, unfinished)
        try:
            result = self._run_through(problem, learner, gate, unfinished, sessions, journal)
            whole = result if unfinished is None else _after(unfinished, result)
            policy = self._policy(whole, problem, learner, gate, task, name or self._free_name(problem, result.solved))
            failure = None
            if not (result.interrupted or journal.read_only):
                policy, failure = self._tried(problem, policy)
            if not (result.interrupted and journal.folding):  # what it was before is more
                self.toolbox.save(policy)
            if not result.interrupted:
                ended = (len(result.steps), result.final_steps, result.optimal_steps, policy.solved)
                journal.closes(Closed(*ended, saved_as=policy.name))
        finally:
            journal.close()
        if policy.solved and unfinished is not None and unfinished.name == f"{policy.name}{_UNFINISHED}":
            with suppress(BadInput):  # it may be gone already
                self.toolbox.remove(unfinished.name)  # it is finished now, under its plain name
        if result.interrupted:
            raise Interrupted(
                f"stopped by Ctrl-C after {counted(len(result.steps), 'episode')} of '{problem.name}'; what was learned is kept"
            )
        if sessions > 1 and not journal.read_only and not fits(result.q, problem, learner):
            raise WorkFailed(
                f"'{problem.name}' was not learned in {counted(len(result.steps), 'episode')} with the advisor '{self.advisor}'; "
                "what was learned is kept: try a better advisor, or more episodes in the task file"
            )
        return Lesson(policy, "learned" if unfinished is None else "continued", result, failure)

    def _run_through(
        self,
        problem: Problem,
        learner: LearnerSettings,
        gate: GateSettings,
        unfinished: Policy | None,
        sessions: int,
        journal: Journal,
    ) -> SessionResult:
        """The lesson, from its beginning each time an answer is taken back."""
        while True:
            self.audience.begins(problem, learner, gate, journal)
            try:
                return self._learn(problem, learner, gate, unfinished, sessions, journal)
            except Again:
                journal.rewind()

    def _learn(
        self,
        problem: Problem,
        learner: LearnerSettings,
        gate: GateSettings,
        unfinished: Policy | None,
        sessions: int,
        journal: Journal,
    ) -> SessionResult:
        """All sessions of one lesson as one, with the best table of these and of `unfinished`."""
        place = problem.environment or TableEnvironment(problem.mdp)
        gate = replace(gate, judge_unhelped=False) if self.advising.records else gate
        lived = 0 if unfinished is None else len(unfinished.curve)  # what did not help before is not drawn again
        rng = np.random.default_rng([self.seed, crc32(problem.name.encode()), lived])
        kept: SessionResult | Policy | None = unfinished
        moves = before = inf if unfinished is None else _moves(unfinished.q, problem, learner)
        left = sessions if moves == inf else min(sessions, MORE_SESSIONS)
        whole: SessionResult | None = None
        alone = False  # the advisor left or was rejected: nobody is asked about this skill again

        def tell(event: Event) -> None:
            nonlocal alone
            left_for_good = isinstance(event, AdviceEnded) and event.reason != "converged"
            alone = alone or left_for_good or isinstance(event, AdviceRejected)
            self.audience.hears(problem.name, event, journal.tell(event))

        def advisor() -> Advisor | None:
            made = self.advising.gather(place, learner, rng, journal=journal, tell=tell)
            self.audience.meets(made)
            return made

        while left:
            left -= 1
            table = None if kept is None else kept.q
            asked = None if alone else advisor()
            result = Session(place or problem.mdp, learner, gate, asked, rng, table).run(tell)
            whole, now = _joined(whole, result), _moves(result.q, problem, learner)
            if now <= moves:
                if now < moves == inf:
                    left = MORE_SESSIONS if sessions > 1 else 0
                kept, moves = result, now
            if result.interrupted or (kept is result and result.solved and now < inf):
                break
        assert whole is not None
        assert kept is not None
        if sessions > 1 and not (whole.interrupted or kept.solved) and before == moves < inf and unfinished is not None:
            kept = unfinished  # no shorter way: with the same table, what was measured with it still holds
        return replace(whole, q=kept.q, final_steps=kept.final_steps, solved=kept.solved)

    def _tried(self, problem: Problem, policy: Policy) -> tuple[Policy, str | None]:
        """The policy as it is to be kept, and why it failed in physics; then it is unsolved, and replaces no solved one."""
        if self.trial is None:
            return policy, None
        kept, unproven = self.toolbox.find(policy.subtask, policy.signature, policy.name), policy
        if policy.solved:
            beside = f"{policy.name[: MAX_NAME_LENGTH - len(_UNFINISHED)]}{_UNFINISHED}"
            unproven = replace(policy, solved=False, name=beside if kept is not None and kept.solved else policy.name)
        try:
            failure = self.trial(problem, policy)
        except BaseException:  # Ctrl-C, too: what was learned is kept
            self.toolbox.save(unproven)
            raise
        return (policy if failure is None else unproven), failure

    def _free_name(self, problem: Problem, solved: bool) -> str:
        """The name to save under; what did not get finished never replaces what is."""
        name = plain_name(problem)
        kept = None if solved else self.toolbox.find(problem.subtask, problem.mdp.signature, name)
        return f"{name}{_UNFINISHED}" if kept is not None and kept.solved else name

    def _policy(
        self,
        result: SessionResult,
        problem: Problem,
        learner: LearnerSettings,
        gate: GateSettings,
        task: str,
        name: str,
    ) -> Policy:
        origin = Origin(name, problem.subtask, task, self.advisor, self.seed)
        return Policy.of(result, problem.mdp, learner, gate, origin)


def fits(q: FloatArray, problem: Problem, learner: LearnerSettings) -> bool:
    """Whether greedy steps lead from every start of the problem to its goal."""
    return _moves(q, problem, learner) < inf


def _moves(q: FloatArray, problem: Problem, learner: LearnerSettings) -> float:
    """The moves of the greedy path from the start; infinite when it, or that from another start, misses the goal."""
    if problem.environment is not None:
        steps = problem.environment.judge(q, learner).final_steps
        return inf if steps is None else steps
    mdp = problem.mdp
    _, actions, reached = greedy_path(q, mdp, mdp.n_states)
    return len(actions) if reached and not unreached(q, mdp) else inf


def world_problem(world: GridWorld) -> Problem:
    """What a grid world sets to learn; BadInput when that cannot be learned (see `GridWorld.check`)."""
    return Problem(world.name, "world", world.check())


def check_name(name: str | None) -> None:
    """BadInput unless a policy may have the name that a person chose."""
    if name is not None and not is_name(name):
        raise BadInput(f"policy name '{name}' (--save): wanted 1 to {MAX_NAME_LENGTH} printable characters")


def plain_name(problem: Problem) -> str:
    """What a policy of this problem is called when nobody names it."""
    return f"{problem.name[:_LONGEST_PROBLEM]} {problem.mdp.signature[:8]}"


def _belongs(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy that bears a problem's signature also has its table's size and its actions."""
    return policy.q.shape == (mdp.n_states, mdp.n_actions) and policy.action_labels == mdp.action_labels


def _after(policy: Policy, result: SessionResult) -> SessionResult:
    """What was learned on from a policy, with the history of that policy before it."""
    return replace(
        result,
        visits=policy.visits + result.visits,
        steps=np.concatenate([np.array(policy.curve, np.int64), result.steps]),
        guided=np.concatenate([np.array(policy.guided, bool), result.guided]),
        requests=policy.requests + result.requests,
        helped_steps=policy.helped_steps + result.helped_steps,
    )


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
