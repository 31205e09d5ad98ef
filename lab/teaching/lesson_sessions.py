"""The sessions of one lesson: each continues the best table so far; together they give one result."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Protocol
from zlib import crc32

import numpy as np

from lab.advice.advising import Advising
from lab.advice.journal import Journal
from lab.learning import session_events as session
from lab.learning.environment import TableEnvironment
from lab.learning.praise import Judging
from lab.learning.problem import Problem
from lab.learning.requests import Advisor, Reply, Request, Walked
from lab.learning.session import Session
from lab.learning.session_events import AdviceEnded, AdviceRejected
from lab.learning.session_result import SessionResult
from lab.learning.settings import LearnerSettings
from lab.learning.values import fewest_moves, greedy_moves, known_values
from lab.mdp import BoolArray, FloatArray, TabularMDP, greedy_path
from lab.teaching.events import AdvisorGathered, LessonEvent, QuestionAnswered, SessionBegan, Tell
from lab.teaching.lesson_plan import LessonPlan
from lab.toolbox.fitness import warm_start
from lab.toolbox.policy import Policy

MORE_SESSIONS = 8  # the limit on sessions for a shorter path, once the goal is reached
WARM_EPISODES = 29  # of a session that begins from what was learned elsewhere
WARM_EXPLORATION = 0.1  # of the usual exploration, so that what was learned elsewhere is tried, not forgotten


class RunsSessions(Protocol):
    """What a teacher runs: the sessions of a lesson, such as `Sessions`."""

    def run(self) -> SessionResult:
        """The result of all sessions."""


class Sessions:
    """The sessions of a lesson, and who advises in them.

    Up to `plan.sessions` are run until the greedy paths are as short as can be; once they lead to the goal, at most
    MORE_SESSIONS further ones look for shorter ones. A table that leads to the goal is never given up for a worse one.

    In a lesson of several sessions nobody is asked in these further ones, and a session alone, there or because nobody is
    left to ask, does not go on from the best table but from optimistic initial values (see `optimistic`): then every move
    that might lead to a shorter path is tried. A session whose advisor has left, or was rejected, ends at once, and one
    alone follows.

    With a policy to begin from, a short session alone comes before them.
    """

    def __init__(self, plan: LessonPlan, advising: Advising, seed: int, journal: Journal, tell: Tell):
        self.plan, self.advising, self.journal, self.tell = plan, advising, journal, tell
        self.place = plan.problem.environment or TableEnvironment(plan.problem.mdp)
        self.gate = replace(plan.gate, judge_unhelped=False) if advising.records else plan.gate
        # Part of the seed, so that a continued lesson draws other numbers.
        before = 0 if plan.unfinished is None else len(plan.unfinished.curve)
        self.rng = np.random.default_rng([seed, crc32(plan.problem.name.encode()), before])
        self.alone = False  # the advisor left or was rejected: nobody is asked about this skill again
        mdp = plan.problem.mdp  # only needed if further sessions may follow
        self.fewest = float(fewest_moves(mdp)[list(mdp.starts)].sum()) if mdp.starts and plan.sessions > 1 else inf

    def run(self) -> SessionResult:
        """The result of all sessions: their curves, and the best table, that of the unfinished policy included. Raises Again."""
        plan, several, unfinished = self.plan, self.plan.sessions > 1, self.plan.unfinished
        whole = None if plan.warm is None else self._alone(plan.warm)
        kept: SessionResult | Policy | None = unfinished or whole
        moves = before = inf if kept is None else moves_to_goal(kept.q, plan.problem, plan.learner)
        if whole is not None and (whole.interrupted or (whole.solved and moves <= self.fewest)):
            return whole
        left = plan.sessions if moves == inf else min(plan.sessions, MORE_SESSIONS)
        while left:
            left -= 1
            advisor = None if self.alone or (several and moves < inf) else self._advisor()
            q0 = None if kept is None else kept.q
            if several and advisor is None and plan.problem.environment is None:
                past, mdp = unfinished if whole is None else joined(unfinished, whole), plan.problem.mdp
                tried = np.zeros(mdp.successor.shape, bool) if past is None else past.visits > 0
                q0 = optimistic(mdp, tried, plan.learner.discount)
            session, asks = self._begun(plan.learner, advisor, q0), several and advisor is not None
            result = session.run(self._hear, lambda: self.alone) if asks else session.run(self._hear)
            whole, now = joined(whole, result), moves_to_goal(result.q, plan.problem, plan.learner)
            if now <= moves:
                if now < moves == inf:
                    left = MORE_SESSIONS if several else 0
                kept, moves = result, now
            if result.interrupted or (kept is result and result.solved and now <= self.fewest):
                break
        assert whole is not None
        assert kept is not None
        if several and not (whole.interrupted or kept.solved) and before == moves < inf and unfinished is not None:
            kept = unfinished  # no shorter path: with the same table, what was measured with it still holds
        whole = replace(whole, q=kept.q, final_steps=kept.final_steps, solved=kept.solved)
        if not whole.by_return:
            return whole
        return replace(whole, final_return=self.place.judge(kept.q, plan.learner).final_return)

    def _begun(self, learner: LearnerSettings, advisor: Advisor | None, q0: FloatArray | None) -> Session:
        """A session that begins from a table (S, A); reports its begin."""
        session = Session(self.place, learner, self.gate, advisor, self.rng, q0)
        self.tell(SessionBegan(session))
        return session

    def _alone(self, warm: Policy) -> SessionResult:
        """A short session without advice that begins from a policy of another problem; the better of both tables."""
        plan, mdp = self.plan, self.place.mdp
        q0 = warm_start(warm, mdp, plan.learner.discount)
        episodes = min(plan.learner.episodes, WARM_EPISODES)
        short = replace(plan.learner, episodes=episodes, exploration=WARM_EXPLORATION * plan.learner.exploration)
        self.tell(AdvisorGathered(None))
        result = self._begun(short, None, q0).run(self._hear)
        if moves_to_goal(q0, plan.problem, plan.learner) >= moves_to_goal(result.q, plan.problem, plan.learner):
            return result
        judged = self.place.judge(q0, plan.learner)
        final = replace(result, final_steps=judged.final_steps, final_return=judged.final_return)
        return replace(final, q=q0, solved=judged.solved)

    def _advisor(self) -> Advisor | None:
        made = self.advising.gather(self.place, self.plan.learner, self.rng, journal=self.journal, tell=self._hear)
        self.tell(AdvisorGathered(made))
        return None if made is None else TellingAdvisor(made, self.tell)

    def _hear(self, event: session.Event) -> None:
        left_for_good = isinstance(event, AdviceEnded) and event.reason != "converged"
        self.alone = self.alone or left_for_good or isinstance(event, AdviceRejected)
        self.tell(LessonEvent(self.plan.problem.name, event, self.journal.tell(event)))


def optimistic(mdp: TabularMDP, tried: BoolArray, discount: float) -> FloatArray:
    """Optimistic initial values (S, A) for a session alone: a move that was not tried yet is as good as the best reward."""
    return known_values(mdp, tried, np.full(mdp.successor.shape, mdp.reward.max()), discount)


class TellingAdvisor:
    """An advisor whose answers are reported as events."""

    def __init__(self, advisor: Advisor, tell: Tell):
        self._advisor, self._tell = advisor, tell
        self.followed: Callable[[Walked], None] | None = getattr(advisor, "followed", None)
        self.judging: Judging | None = getattr(advisor, "judging", None)

    def advise(self, request: Request) -> Reply:
        """The advisor's answer."""
        action = self._advisor.advise(request)
        self._tell(QuestionAnswered(request, action))
        return action


def fits(q: FloatArray, problem: Problem, learner: LearnerSettings) -> bool:
    """Whether greedy steps lead from every start of the problem to its goal."""
    return moves_to_goal(q, problem, learner) < inf


def moves_to_goal(q: FloatArray, problem: Problem, learner: LearnerSettings) -> float:
    """The total moves of the greedy paths from all starts, inf if one misses the goal; without a goal, minus the return."""
    if problem.environment is not None:
        judged = problem.environment.judge(q, learner)
        if judged.final_return is not None:
            return -judged.final_return
        steps = judged.final_steps
        return inf if steps is None else steps
    mdp = problem.mdp
    if mdp.starts:
        return float(greedy_moves(q, mdp)[list(mdp.starts)].sum())
    _, actions, reached = greedy_path(q, mdp, mdp.n_states)
    return len(actions) if reached else inf


def joined(before: SessionResult | Policy | None, now: SessionResult) -> SessionResult:
    """The result of a session, joined to the history that it continued: curves are concatenated, counts added."""
    if before is None:
        return now
    steps = before.curve if isinstance(before, Policy) else before.steps
    earlier = np.full(len(steps), np.nan) if isinstance(before, Policy) else before.returns
    whole = replace(
        now,
        visits=before.visits + now.visits,
        steps=np.concatenate([np.asarray(steps, np.int64), now.steps]),
        guided=np.concatenate([np.asarray(before.guided, bool), now.guided]),
        requests=before.requests + now.requests,
        helped_steps=before.helped_steps + now.helped_steps,
        returns=np.concatenate([earlier, now.returns]),
    )
    if isinstance(before, Policy):  # it does not know of misleads
        return whole
    first = before.rejected_at_episode
    first = now.rejected_at_episode if first is None else first
    return replace(whole, misleads=before.misleads + now.misleads, rejected_at_episode=first)
