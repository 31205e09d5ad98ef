"""The one learning session: its episodes, the gate that decides when to ask, the advisor, the events on the way."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.advice.advisors import AdviceRequest, Advisor, AdvisorLeft
from lab.advice.gates import GATES, Improvement, Surroundings, improvement
from lab.errors import BadInput, unknown
from lab.learning.selection import SELECTIONS, Draw, temperature, uniforms
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES, Update
from lab.mdp import BoolArray, FloatArray, TabularMDP, greedy_path, shortest_steps

CountArray = NDArray[np.int64]


@dataclass(frozen=True)
class EpisodeEnded:
    """An episode is over: `steps` is max_steps + 1 when it failed; the rate is None before 2K episodes."""

    episode: int
    steps: int
    guided: bool
    helped_steps: int
    improvement_rate: float | None
    reached: bool


@dataclass(frozen=True)
class AdviceRequested:
    """The learner asks for the first time in this episode; means of step counts over K episodes, None before 2K."""

    episode: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None


@dataclass(frozen=True)
class AdviceRejected:
    """Misled more than `omega` times, the learner asks no more; `steps` was not better than `mean_before`."""

    episode: int
    misleads: int
    omega: int
    steps: int
    mean_before: float


@dataclass(frozen=True)
class AdviceEnded:
    """No more advice in this session: `reason` is "converged" or "advisor left"."""

    episode: int
    reason: str


Event = EpisodeEnded | AdviceRequested | AdviceRejected | AdviceEnded
OnEvent = Callable[[Event], None]


@dataclass(frozen=True, eq=False)
class SessionResult:
    """What a session learned and how it went.

    q (S, A) float64, visits (S, A) int64; steps (episodes,) int64, a failed episode as max_steps + 1; guided
    (episodes,) bool: at least one advised step; requests: episodes in which the learner asked; helped_steps:
    advised steps that were carried out; misleads and rejected_at_episode: see lab/advice/gates.py; final_steps:
    those of the greedy path from the start, None if it does not reach the goal, optimal_steps: the fewest, both
    counted as in `steps`; solved: they are the same, or, in a problem with several `starts`, the greedy path reaches
    the goal from each of them; interrupted: stopped by Ctrl-C, only finished episodes count.
    """

    q: FloatArray
    visits: CountArray
    steps: CountArray
    guided: BoolArray
    requests: int
    helped_steps: int
    misleads: int
    rejected_at_episode: int | None
    optimal_steps: int
    final_steps: int | None
    solved: bool
    interrupted: bool


def run_session(
    mdp: TabularMDP,
    learner: LearnerSettings,
    gate: GateSettings,
    advisor: Advisor | None,
    rng: np.random.Generator,
    *,
    q0: FloatArray | None = None,
    on_event: OnEvent | None = None,
    draw: Draw | None = None,
) -> SessionResult:
    """Learns one table in `learner.episodes` episodes, asking `advisor` when the gate says so (None: nobody to ask).

    q0: (S, A) start values, default 0. draw: where uniform numbers come from, by default `rng`. An advised action is
    carried out and learned from as if it were the learner's own choice. KeyboardInterrupt ends the session at once;
    the result then holds all that was learned so far.
    Raises BadInput for an unknown learner, selection or gate, a q0 that does not fit or an advisor that names no
    action, and NoPath.
    Source: thesis fig. 6.2 with the update rules of section 2.2 and the softmax of section 9.4.
    """
    session = _Session(mdp, learner, gate, advisor, draw or uniforms(rng), q0, on_event or (lambda event: None))
    interrupted = False
    try:
        for episode in range(1, learner.episodes + 1):
            session.play(episode)
    except KeyboardInterrupt:
        interrupted = True
    return session.result(interrupted)


class _Session:
    """One session under way; everything the inner loop touches is a plain list."""

    def __init__(
        self,
        mdp: TabularMDP,
        learner: LearnerSettings,
        gate: GateSettings,
        advisor: Advisor | None,
        draw: Draw,
        q0: FloatArray | None,
        on_event: OnEvent,
    ):
        if learner.learner not in UPDATES:
            raise unknown("learner", learner.learner, UPDATES, "learner settings")
        if learner.selection not in SELECTIONS:
            raise unknown("selection", learner.selection, SELECTIONS, "learner settings")
        if gate.gate not in GATES:
            raise unknown("gate", gate.gate, GATES, "gate settings")
        self.mdp, self.settings, self.gate_settings = mdp, learner, gate
        self.advisor, self.tell = advisor, on_event
        self.optimal_steps = shortest_steps(mdp) + learner.count_start
        self.update = UPDATES[learner.learner](_start_values(mdp, q0).tolist(), learner, mdp)
        self.q = self.update.q
        self.visits: list[list[int]] = [[0] * mdp.n_actions for _ in range(mdp.n_states)]
        self.successor: list[list[int]] = mdp.successor.tolist()
        self.reward: list[list[float]] = mdp.reward.tolist()
        self.discount: list[float] = np.where(mdp.terminal, 0.0, learner.discount).tolist()  # by the state entered
        self.is_goal: list[bool] = mdp.goal.tolist()
        self.choose, self.draw = SELECTIONS[learner.selection], draw
        around = Surroundings(draw, self._others)
        self.gate = GATES[gate.gate](gate, learner.episodes, learner.max_steps, around)
        self.max_moves = learner.max_steps - learner.count_start
        self.steps: list[int] = []
        self.guided: list[bool] = []
        self.requests = self.helped_steps = 0
        self.rejected_at: int | None = None
        self.tau = 1.0
        self.episode = 0
        self.improved: Improvement | None = None
        self.asked_now = False  # in the episode under way; booked when it has ended
        self.helped_now = 0

    def _others(self, tables: int) -> list[Update]:
        """Learners like this one whose start values are drawn within +-0.5."""
        make, (states, actions) = UPDATES[self.settings.learner], self.mdp.successor.shape
        others = [make([[0.0] * actions for _ in range(states)], self.settings, self.mdp) for _ in range(tables)]
        for other in others:
            other.scatter(self.draw)
        return others

    def play(self, episode: int) -> None:
        """One episode with the gate's decision before it and its verdict after it."""
        self.episode, self.asked_now, self.helped_now = episode, False, 0
        self.tau = temperature(episode, self.settings.beta, self.settings.exploration)
        was_converged = self.gate.converged
        is_open = self.gate.opens(episode, self.steps) and self.advisor is not None
        if self.gate.converged and not was_converged and self.advisor is not None:
            self.tell(AdviceEnded(episode, "converged"))
        moves = self._walk(self._advised_choice if is_open else self._own_choice)
        self.update.end()
        steps = self.settings.max_steps + 1 if moves is None else moves + self.settings.count_start
        helped = self.helped_now
        self.requests += self.asked_now
        self.helped_steps += helped
        self.steps.append(steps)
        self.guided.append(helped > 0)
        self.improved = improvement(self.steps, self.gate_settings.window)
        self.gate.judges(self.steps, is_open and (helped > 0 or self.gate_settings.judge_unhelped))
        rate = self.improved.rate if self.improved else None
        self.tell(EpisodeEnded(episode, steps, helped > 0, helped, rate, moves is not None))
        if self.gate.rejected and self.rejected_at is None:
            self.rejected_at = episode
            before = self.steps[-1 - self.gate_settings.window : -1]
            mean_before = sum(before) / len(before)
            self.tell(AdviceRejected(episode, self.gate.misleads, self.gate_settings.omega, steps, mean_before))

    def _walk(self, choose: Callable[[int, int], int]) -> int | None:
        """Goes from the start until a terminal state or the step limit and learns; the moves to the goal, None if not reached."""
        successor, reward, discount, visits = self.successor, self.reward, self.discount, self.visits
        learn, lookahead, watch = self.update.learn, self.update.lookahead, self.gate.saw if self.gate.watches else None
        self.update.begin()
        starts = self.mdp.starts
        state = starts[int(self.draw() * len(starts))] if starts else self.mdp.start
        action = choose(state, 1)
        for step in range(1, self.max_moves + 1):
            last = step == self.max_moves
            visits[state][action] += 1
            entered = successor[state][action]
            discount_t = discount[entered]
            following = 0
            if lookahead and discount_t:
                # the move after the last one is never made: nobody is asked for it
                following = self._own_choice(entered, step) if last else choose(entered, step + 1)
            learn(state, action, reward[state][action], discount_t, entered, following)
            if watch is not None:
                watch(state, action, reward[state][action], discount_t, entered)
            if not discount_t:
                return step if self.is_goal[entered] else None
            if not last:
                state, action = entered, following if lookahead else choose(entered, step + 1)
        return None

    def _own_choice(self, state: int, step: int) -> int:
        return self.choose(self.q[state], self.tau, self.draw())

    def _advised_choice(self, state: int, step: int) -> int:
        """The advisor's action where the gate asks and the advisor answers, else the learner's own."""
        own = self._own_choice(state, step)
        within_budget = self.helped_steps + self.helped_now < self.gate_settings.budget
        if self.advisor is None or not within_budget or not self.gate.asks(state, self.update.gauge(state)):
            return own
        means = self.improved
        rate, current, previous = (means.rate, means.current_mean, means.previous_mean) if means else (None, None, None)
        if not self.asked_now:
            self.asked_now = True
            self.tell(AdviceRequested(self.episode, rate, current, previous))
        request = AdviceRequest(
            self.mdp, self.q, state, self.episode, step, own, rate, current, previous, self.gate.why
        )
        try:
            action = self.advisor.advise(request)
        except AdvisorLeft:
            self.advisor = None
            self.tell(AdviceEnded(self.episode, "advisor left"))
            return own
        if action is None:
            return own
        if action not in range(self.mdp.n_actions):
            raise BadInput(f"the advisor named action {action}: allowed 0..{self.mdp.n_actions - 1}")
        self.helped_now += 1
        return action

    def result(self, interrupted: bool) -> SessionResult:
        """What was learned so far; an unfinished episode counts in q and visits only."""
        q = np.array(list(self.q), np.float64)
        finished = len(self.guided)
        _, actions, reached = greedy_path(q, self.mdp, self.settings.max_steps)
        final_steps = len(actions) + self.settings.count_start if reached else None
        return SessionResult(
            q=q,
            visits=np.array(self.visits, np.int64),
            steps=np.array(self.steps[:finished], np.int64),
            guided=np.array(self.guided, bool),
            requests=self.requests,
            helped_steps=self.helped_steps,
            misleads=self.gate.misleads,
            rejected_at_episode=self.rejected_at,
            optimal_steps=self.optimal_steps,
            final_steps=final_steps,
            solved=not unreached(q, self.mdp) if self.mdp.starts else final_steps == self.optimal_steps,
            interrupted=interrupted,
        )


def unreached(q: FloatArray, mdp: TabularMDP) -> tuple[int, ...]:
    """The states among the problem's several `starts` from which the greedy path does not reach the goal."""
    return tuple(start for start in mdp.starts if not greedy_path(q, mdp, mdp.n_states, start)[2])


def _start_values(mdp: TabularMDP, q0: FloatArray | None) -> FloatArray:
    if q0 is None:
        return np.zeros(mdp.successor.shape)
    start = np.array(q0, np.float64)
    if start.shape != mdp.successor.shape or not np.isfinite(start).all():
        raise BadInput(f"start values: shape {start.shape}, allowed {mdp.successor.shape} with finite values")
    start[mdp.terminal] = 0.0
    return start
