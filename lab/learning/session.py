"""The one learning session: its episodes, the gate that decides when to ask, the advisor, the events on the way."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.learning.advice_memory import Recall
from lab.learning.environment import Environment, TableEnvironment, check_solvable
from lab.learning.gates import GATES, Surroundings, improvement
from lab.learning.physics.cells import CellTable
from lab.learning.requests import AdviceRequest, Advisor, AdvisorLeft, Standing, Walked, allowed_words
from lab.learning.selection import COLDEST, SELECTIONS, Draw, temperature, uniforms
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRequested,
    EpisodeEnded,
    Event,
    Improvement,
)
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import LINEAR, UPDATES, Update, update_of
from lab.mdp import BoolArray, FloatArray, TabularMDP
from lab.plugins.code_file import from_file

CountArray = NDArray[np.int64]


OnEvent = Callable[[Event], None]


@dataclass(frozen=True, eq=False)
class SessionResult:
    """What a session learned and how it went.

    q (S, A) float64, visits (S, A) int64; steps (episodes,) int64, a failed episode as max_steps + 1; guided
    (episodes,) bool: at least one advised step; requests: episodes in which the learner asked; helped_steps:
    advised steps that were carried out; misleads and rejected_at_episode: see lab/learning/gates; final_steps:
    those of the greedy path from the start, None if it does not reach the goal, optimal_steps: the fewest, None where
    nobody knows them, both counted as in `steps`; solved: see `Environment.judge`; interrupted: stopped by Ctrl-C, only
    finished episodes count.
    """

    q: FloatArray
    visits: CountArray
    steps: CountArray
    guided: BoolArray
    requests: int
    helped_steps: int
    misleads: int
    rejected_at_episode: int | None
    optimal_steps: int | None
    final_steps: int | None
    solved: bool
    interrupted: bool


def run_session(
    problem: TabularMDP | Environment,
    learner: LearnerSettings,
    gate: GateSettings,
    advisor: Advisor | None,
    rng: np.random.Generator | Draw,
    on_event: OnEvent | None = None,
) -> SessionResult:
    """Learns one table from zeros: see `Session`."""
    return Session(problem, learner, gate, advisor, rng).run(on_event)


def check_members(
    learner: LearnerSettings, gate: GateSettings, where: tuple[str, str] = ("learner settings", "gate settings")
) -> None:
    """Raises BadInput for an unknown learner, selection or gate; `where`: where the learner and the gate came from."""
    for kind, name, table, source in (
        ("learner", learner.learner, UPDATES, where[0]),
        ("selection", learner.selection, SELECTIONS, where[0]),
        ("gate", gate.gate, GATES, where[1]),
    ):
        if name not in table:
            raise from_file(kind, name, source) or unknown(kind, name, table, source)
    if learner.tilings > 1 and learner.learner not in LINEAR:
        known = ", ".join(LINEAR)
        raise BadInput(
            f"learner '{learner.learner}' ({where[0]}) with tilings = {learner.tilings}: allowed are {known}"
        )


class Session:
    """One learned table, in `learner.episodes` episodes, asking `advisor` when the gate says so (None: nobody to ask).

    problem: where the steps are made; rng: a generator, or uniform numbers one after the other; q0: (S, A) start values,
    default 0. An advised action is carried out and learned from as if it were the learner's own choice. An advisor with a
    method `followed` hears after each episode what it led to.
    Raises BadInput for an unknown learner, selection or gate, a q0 that does not fit or an advisor that names no
    action, and NoPath.
    Source: thesis fig. 6.2 with the update rules of section 2.2 and the softmax of section 9.4.
    """

    # everything that the inner loop touches is a plain list
    def __init__(
        self,
        problem: TabularMDP | Environment,
        learner: LearnerSettings,
        gate: GateSettings,
        advisor: Advisor | None,
        rng: np.random.Generator | Draw,
        q0: FloatArray | None = None,
    ):
        environment = TableEnvironment(problem) if isinstance(problem, TabularMDP) else problem
        draw = uniforms(rng) if isinstance(rng, np.random.Generator) else rng
        check_members(learner, gate)
        check_solvable(environment)
        self.environment, self.mdp, self.settings, self.gate_settings = environment, environment.mdp, learner, gate
        self.advisor, self.advised = advisor, advisor is not None
        self.tell: OnEvent = lambda event: None
        mdp = self.mdp
        self.update = update_of(learner, mdp, _start_values(mdp, q0, learner))
        self.q = self.update.q
        self.visits: list[list[int]] = [[0] * mdp.n_actions for _ in range(mdp.n_states)]
        self.actions = range(mdp.n_actions)
        self.lasts = isinstance(mdp, CellTable) and mdp.physics.falls
        self.choose, self.draw = SELECTIONS[learner.selection].make, draw
        several_starts = bool(mdp.starts) or not (
            isinstance(environment, TableEnvironment) or isinstance(mdp, CellTable)
        )
        size = mdp.n_states, mdp.n_actions
        around = Surroundings(draw, self._others, several_starts, self.update.gauge, size, learner)
        make = GATES[gate.gate if self.advised else "never"].make
        self.gate = make(gate, learner.episodes, learner.max_steps, around)
        self.max_moves = learner.max_steps - learner.count_start
        self.recall = (
            Recall(mdp.n_states, mdp.n_actions, self.max_moves, learner.episodes, gate.window) if gate.memory else None
        )
        self.judge_unhelped = gate.judge_unhelped and not gate.memory
        self.steps: list[int] = []
        self.guided: list[bool] = []
        self.requests = self.helped_steps = 0
        self.rejected_at: int | None = None
        self.tau = 1.0
        self.episode = 0
        self.improved: Improvement | None = None
        self.trail: list[tuple[int, int, int]] | None = None  # of an episode that an advisor wants to hear of
        self.asked_now = False  # in the episode under way; booked when it has ended
        self.helped_now = 0

    def run(self, on_event: OnEvent | None = None, enough: Callable[[], bool] = lambda: False) -> SessionResult:
        """All episodes, told to `on_event`, or fewer: until after one it is `enough`.

        A KeyboardInterrupt ends them at once, and what was learned so far counts.
        """
        self.tell = on_event or self.tell
        interrupted = False
        try:
            for episode in range(1, self.settings.episodes + 1):
                self.play(episode)
                if enough():
                    break
        except KeyboardInterrupt:
            interrupted = True
        return self.result(interrupted)

    def _others(self, tables: int) -> list[Update]:
        """Learners like this one whose start values are drawn within +-0.5."""
        others = [update_of(self.settings, self.mdp, np.zeros(self.mdp.successor.shape)) for _ in range(tables)]
        for other in others:
            other.scatter(self.draw)
        return others

    def play(self, episode: int) -> None:
        """One episode with the gate's decision before it and its verdict after it."""
        self.episode, self.asked_now, self.helped_now = episode, False, 0
        self.tau = temperature(episode, self.settings.beta, self.settings.exploration)
        was_converged = self.gate.converged
        is_open = self._opens(episode)
        if self.gate.converged and not was_converged and self.advisor is not None:
            self.tell(AdviceEnded(episode, "converged"))
        followed = getattr(self.advisor, "followed", None)
        self.trail = [] if is_open and followed is not None else None
        closed = self._own_choice
        if self.recall is not None and self.recall.late:
            self.tau, closed = COLDEST, self._practised_choice
        moves = self._walk(self._advised_choice if is_open else closed)
        self.update.end()
        steps = self.settings.max_steps + 1 if moves is None else moves + self.settings.count_start
        helped = self.helped_now
        self.requests += self.asked_now
        self.helped_steps += helped
        self.steps.append(steps)
        self.guided.append(helped > 0)
        self.improved = improvement(self.steps, self.gate_settings.window)
        self.gate.judges(self.steps, is_open and (helped > 0 or self.judge_unhelped))
        rate = self.improved.rate if self.improved else None
        if self.trail is not None and followed is not None:
            followed(Walked(episode, self.trail, moves is not None, steps, self._mean_before()))
        self.tell(EpisodeEnded(episode, steps, helped > 0, helped, rate, moves is not None, self.gate.verdict))
        if helped and self.helped_steps >= self.gate_settings.budget:
            self.tell(AdviceEnded(episode, "budget spent"))
        if self.gate.rejected and self.rejected_at is None:
            self.rejected_at = episode
            mean_before = self._mean_before()
            self.tell(AdviceRejected(episode, self.gate.misleads, self.gate_settings.omega, steps, mean_before))
        for event in self.recall.ended(moves, helped) if self.recall is not None else ():
            self.tell(event)

    def _opens(self, episode: int) -> bool:
        """Whether the gate opens for somebody, and memory does not close it again."""
        is_open = self.gate.opens(episode, self.steps) and self.advisor is not None
        return is_open if self.recall is None else self.recall.opens(episode, is_open)

    def _mean_before(self) -> float:
        """The mean of the K step counts before the last one, of fewer at the beginning; the step limit before the first."""
        before = self.steps[-1 - self.gate_settings.window : -1]
        return sum(before) / len(before) if before else float(self.settings.max_steps + 1)

    def _walk(self, choose: Callable[[int, int], int]) -> int | None:
        """Goes from the start until a terminal state or the step limit and learns; the moves to the goal, None if not reached.

        Where an episode is the better the longer it lasts, the moves that it was too short, and one.
        """
        act, draw, discount, visits = self.environment.step, self.draw, self.settings.discount, self.visits
        learn, lookahead, watch = self.update.learn, self.update.lookahead, self.gate.saw if self.gate.watches else None
        recall = self.recall
        self.update.begin()
        state = self.environment.reset(self.episode, draw)
        self.gate.begins(state)
        if recall is not None:
            recall.starts(state)
        action = choose(state, 1)
        for step in range(1, self.max_moves + 1):
            visits[state][action] += 1
            reward, entered, over, reached, truncated = act(state, action, draw)
            if recall is not None:
                recall.moved(state, action, entered, over, reached)
            last = truncated or step == self.max_moves
            discount_t = 0.0 if over else discount
            following = 0
            if lookahead and not over:
                # the move after the last one is never made: nobody is asked for it
                following = self._own_choice(entered, step) if last else choose(entered, step + 1)
            learn(state, action, reward, discount_t, entered, following)
            if self.trail is not None:
                self.trail.append((state, action, entered))
            if watch is not None:
                watch(state, action, reward, discount_t, entered, following)
            if over:
                return self.max_moves - step + 2 if self.lasts else step if reached else None
            if last:
                return 1 if self.lasts else None
            state, action = entered, following if lookahead else choose(entered, step + 1)
        return None

    def _own_choice(self, state: int, step: int) -> int:
        return self.choose(self.q[state], self.tau, self.draw())

    def _practised_choice(self, state: int, step: int) -> int:
        own = self._own_choice(state, step)
        return own if self.recall is None else self.recall.chosen(state, own)

    def _advised_choice(self, state: int, step: int) -> int:
        """What the advisor says, where the gate asks, else the learner's own."""
        own, recall, gate = self._own_choice(state, step), self.recall, self.gate
        advisor = self.advisor if self.helped_steps + self.helped_now < self.gate_settings.budget else None
        if (advisor is None and not gate.weighs) or (recall is not None and not recall.trusts):
            return own
        wanted = gate.asks(state, self.update.gauge(state))
        said = None if advisor is None or not wanted else self._asks(advisor, state, step, own)
        if said is not None:
            self.helped_now += 1
            if recall is not None:
                recall.asked()
        return gate.takes(state, own, said)

    def _asks(self, advisor: Advisor, state: int, step: int, own: int) -> int | None:
        """The advisor's action, None when nothing is said."""
        if not self.asked_now:
            self.asked_now = True
            self.tell(AdviceRequested.of(self.episode, self.improved))
        request = AdviceRequest(
            episode=self.episode,
            step=step,
            state=state,
            own=own,
            allowed=self.actions,
            improvement=self.improved,
            reason=self.gate.why,
            standing=self._standing(),
            mdp=self.mdp,
            q=self.q,
            temperature=self.tau,
            selection=self.settings.selection,
            environment=self.environment,
        )
        try:
            action = advisor.advise(request)
        except AdvisorLeft:
            self.advisor = None
            self.tell(AdviceEnded(self.episode, "advisor left"))
            return None
        self.tell(AdviceGiven(self.episode, step, state, action, own))
        if action is not None and action not in self.actions:
            raise BadInput(f"the advisor named action {action}: allowed {allowed_words(request)}")
        return action

    def _standing(self) -> Standing:
        gate, settings = self.gate, self.gate_settings
        helped = self.helped_steps + self.helped_now
        return Standing(helped, settings.budget, gate.misleads, settings.omega, settings.lambda_threshold)

    def result(self, interrupted: bool) -> SessionResult:
        """What was learned so far; an unfinished episode counts in q and visits only."""
        q = self.update.table()
        finished = len(self.guided)
        final_steps, optimal_steps, solved = self.environment.judge(q, self.settings)
        return SessionResult(
            q=q,
            visits=np.array(self.visits, np.int64),
            steps=np.array(self.steps[:finished], np.int64),
            guided=np.array(self.guided, bool),
            requests=self.requests,
            helped_steps=self.helped_steps,
            misleads=self.gate.misleads,
            rejected_at_episode=self.rejected_at,
            optimal_steps=optimal_steps,
            final_steps=final_steps,
            solved=solved,
            interrupted=interrupted,
        )


def _start_values(mdp: TabularMDP, q0: FloatArray | None, learner: LearnerSettings) -> FloatArray:
    start = np.full(mdp.successor.shape, learner.start_value) if q0 is None else np.array(q0, np.float64)
    if start.shape != mdp.successor.shape or not np.isfinite(start).all():
        raise BadInput(f"start values: shape {start.shape}, allowed {mdp.successor.shape} with finite values")
    if learner.tilings == 1:  # on tiles, what is worth nothing would take from what lies beside it
        start[mdp.terminal] = 0.0
    return start
