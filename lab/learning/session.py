"""The learning session, top to bottom: a learner that acts, asks when it does not improve, learns, and judges who advised it.

This is CCRL, the thesis's fig. 6.2, with the gate as a part: `lab/learning/gates/ccrl.py` has the thesis's own rule. With
L_n the steps of episode n (max_steps + 1 where it failed) and m_n = (L_(n-K+1) + ... + L_n) / K their moving average,

    eq. 9.1     an own action a is drawn with the chance exp(Q(s, a) / tau_n) / sum_b exp(Q(s, b) / tau_n)
    eq. 9.2     tau_n = n ** -beta
    eqs. 6.1-2  the learner asks in episode n + 1 while its improvement 1 - m_n / m_(n-K) is less than Lambda
    eq. 6.3     an advised episode misled when it took no fewer steps than the K before it took on average
    eq. 6.4     the advisor is rejected after more than Omega misleads; what is learned from a step is in `updates`

Without a goal, L_n is the shortfall of the return: the return of the highest reward in every step, minus that of episode n.
"""

from collections.abc import Callable
from functools import partial
from typing import cast

import numpy as np

from lab.errors import BadInput
from lab.learning import session_events as events
from lab.learning.advice_memory import Recall
from lab.learning.environment import Environment, TableEnvironment, check_solvable, highest_reward
from lab.learning.gates import GATES, Surroundings, improvement
from lab.learning.physics.cells import CellTable
from lab.learning.praise import PRAISE_RULES, ActionBiasing, Judgement, Judging, Move
from lab.learning.requests import AdviceRequest, Advisor, AdvisorLeft, Reply, Standing, Walked
from lab.learning.selection import COLDEST, SELECTIONS, Draw, temperature, uniforms
from lab.learning.session_result import SessionResult, check_members, start_values
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES, scattered, update_of
from lab.mdp import FloatArray, TabularMDP
from lab.plugins.family import checked_action

OnEvent = Callable[[events.Event], None]
NO_LIMIT = 2**62  # the gate's `max_steps` where no episode fails


class Session:
    """A session of `learner.episodes` episodes, in which one table is learned, with advice when the gate decides to ask.

    problem: a table, or the environment in which steps are made; advisor: None if there is nobody to ask; rng: a generator, or a
    function that returns uniform numbers; q0: (S, A), the start values, default the learner's start value.
    An advised action is carried out and learned from like the learner's own choice. If the advisor has a method `followed`, it is
    called with the `Walked` record after each open episode, or after every episode if its attribute `follows_all` is true.
    If it has an attribute `judging`, see `Judging`, it may judge moves that it was shown: see `lab.learning.praise`.
    Raises BadInput for an unknown learner, selection or gate, an unfit q0 and an answer that is no action, and NoPath.
    """

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
        check_members(learner, gate)
        check_solvable(environment)
        self.environment, self.mdp, self.settings, self.gate_settings = environment, environment.mdp, learner, gate
        self.advisor, self.advised = advisor, advisor is not None
        self.followed: Callable[[Walked], None] | None = getattr(advisor, "followed", None)
        self.judging: Judging | None = getattr(advisor, "judging", None)
        self.only_judges = self.judging is not None and self.judging.only
        self.praise: ActionBiasing | None = None  # what was learned from judgements, once there was one
        self.shown: list[Move] = []  # the moves of this episode that the advisor saw and may judge
        self.follows_all = bool(getattr(advisor, "follows_all", False))
        self.tell: OnEvent = lambda event: None
        mdp, cells = self.mdp, self.mdp if isinstance(self.mdp, CellTable) else None
        self.draw = uniforms(rng) if isinstance(rng, np.random.Generator) else rng
        self.update = update_of(learner, mdp, start_values(mdp, q0, learner), self.draw)
        self.q = self.update.q  # plain lists, which the loop reads faster than arrays
        self.visits: list[list[int]] = [[0] * mdp.n_actions for _ in range(mdp.n_states)]
        self.actions = range(mdp.n_actions)
        self.longer_is_better = cells is not None and cells.physics.longer_is_better
        self.highest_reward = highest_reward(environment)
        by_return = self.highest_reward is not None
        if by_return and gate.memory:
            raise BadInput("memory: what it remembers leads to a goal, and this problem has none: leave it off")
        self.choose = SELECTIONS[learner.selection].make
        several_starts = bool(mdp.starts) or not (isinstance(environment, TableEnvironment) or cells is not None)
        size = mdp.n_states, mdp.n_actions
        others = partial(scattered, learner, mdp, self.draw)
        around = Surroundings(
            self.draw,
            others,
            several_starts and not by_return,
            self.update.gauge,
            size,
            learner,
            by_return,
            self.update,
        )
        self.gate_name = f"gate '{gate.gate}'"
        make = GATES[gate.gate if self.advised else "never"].make
        self.gate = make(gate, learner.episodes, NO_LIMIT if by_return else learner.max_steps, around)
        self.max_moves = learner.max_steps - learner.count_start
        self.recall = Recall(*size, self.max_moves, learner.episodes, gate.window) if gate.memory else None
        self.judge_unhelped = gate.judge_unhelped and not (gate.memory or gate.by_evidence)
        self.steps: list[int] = []
        self.scores: list[float] = [] if by_return else cast(list[float], self.steps)  # what the gate compares
        self.gained = 0.0  # the rewards of this episode
        self.guided: list[bool] = []
        self.returns: list[float] = []
        self.requests = self.helped_steps = 0
        self.rejected_at: int | None = None
        self.episode, self.tau = 0, 1.0  # from here on: the state of the current episode
        self.improved: events.Improvement | None = None
        self.asked_now, self.helped_now = False, 0
        self.trail: list[tuple[int, int, int]] | None = None  # recorded if the advisor has `followed`

    def run(self, on_event: OnEvent | None = None, enough: Callable[[], bool] = lambda: False) -> SessionResult:
        """The result of the session; `on_event` receives its events.

        The session ends early when `enough` returns True after an episode, or at once on KeyboardInterrupt; what was learned so
        far is returned.
        """
        self.tell = on_event or self.tell
        try:
            for episode in range(1, self.settings.episodes + 1):
                self.play(episode)
                if enough():
                    break
        except KeyboardInterrupt:
            return self.result(interrupted=True)
        return self.result(interrupted=False)

    def play(self, episode: int) -> None:
        """Plays one episode and judges it; `run` plays all, numbered from 1."""
        settings, gate, recall = self.settings, self.gate, self.recall
        self.episode, self.asked_now, self.helped_now = episode, False, 0
        self.tau = temperature(episode, settings.beta, settings.exploration)  # eq. 9.2
        was_converged = gate.converged
        is_helped = self.advisor is not None or self.praise is not None
        is_open = gate.opens(episode, self.scores) and is_helped  # eqs. 6.1 and 6.2
        is_open = is_open if recall is None else recall.opens(episode, is_open)
        if gate.converged and not was_converged and self.advisor is not None:
            self.tell(events.AdviceEnded(episode, "converged"))
        self.trail = [] if (is_open or self.follows_all) and self.followed is not None else None
        alone = self._own_choice
        if recall is not None and recall.late:
            self.tau, alone = COLDEST, self._practised_choice
        self._judge(is_open, self._walk(self._advised_choice if is_open else alone))

    def _walk(self, choose: Callable[[int, int], int]) -> int | None:
        """The number of moves to the goal, None if it was not reached; each move is chosen, made and learned from.

        In worlds where longer episodes are better, it is 1 plus the number of moves by which the episode was too short; without a
        goal it is the number of all moves.
        """
        act, draw, discount, visits = self.environment.step, self.draw, self.settings.discount, self.visits
        learn, lookahead, recall = self.update.learn, self.update.lookahead, self.recall
        watch = self.gate.saw if self.gate.watches else None
        without_goal, self.gained = self.highest_reward is not None, 0.0
        self.update.begin()
        state = self.environment.reset(self.episode, draw)
        self.gate.begins(state)
        if recall is not None:
            recall.starts(state)
        action = choose(state, 1)
        for step in range(1, self.max_moves + 1):
            visits[state][action] += 1
            reward, entered, over, reached, truncated = act(state, action, draw)
            self.gained += reward
            if recall is not None:
                recall.moved(state, action, entered, over, reached)
            last = truncated or step == self.max_moves
            discount_t = 0.0 if over else discount
            following = 0
            if lookahead and not over:
                # this choice is never carried out, so no advice is asked for
                following = self._own_choice(entered, step) if last else choose(entered, step + 1)
            learn(state, action, reward, discount_t, entered, following)
            if self.trail is not None:
                self.trail.append((state, action, entered))
            if watch is not None:
                watch(state, action, reward, discount_t, entered, following)
            if over:
                return self.max_moves - step + 2 if self.longer_is_better else step if reached or without_goal else None
            if last:
                return 1 if self.longer_is_better else step if without_goal else None
            state, action = entered, following if lookahead else choose(entered, step + 1)
        return None

    def _own_choice(self, state: int, step: int) -> int:
        return self.choose(self.q[state], self.tau, self.draw())  # eq. 9.1

    def _practised_choice(self, state: int, step: int) -> int:
        own = self._own_choice(state, step)
        return own if self.recall is None else self.recall.chosen(state, own)

    def _advised_choice(self, state: int, step: int) -> int:
        """The advisor's action if the gate asks and the advisor answers, otherwise the learner's own, biased by praise."""
        recall, gate, praise = self.recall, self.gate, self.praise
        own = (
            self._own_choice(state, step)
            if praise is None
            else praise.choice(state, self.q[state], self.tau, self.draw)
        )
        advisor = self.advisor if self.helped_steps + self.helped_now < self.gate_settings.budget else None
        if (advisor is None and not gate.weighs) or (recall is not None and not recall.trusts):
            return own
        gate_asks = gate.asks(state, self.update.gauge(state))
        answer = self._ask(advisor, state, step, own) if gate_asks and advisor is not None else None
        if isinstance(answer, Judgement):
            answer = own if answer.value > 0 else None  # praise of a move is an answer that names it
        elif answer is not None:
            self.helped_now += 1
            if recall is not None:
                recall.asked()
        action = checked_action(gate.takes(state, own, answer), self.actions, self.gate_name)
        if gate_asks and self.judging is not None and not self.only_judges:
            self.shown.append((state, action))
        return action

    def _ask(self, advisor: Advisor, state: int, step: int, own: int) -> Reply:
        """The advisor's answer, None if it gives none. Raises BadInput if the answer is no action.

        Who only judges answers with a judgement of the learner's own move; who may judge as well is asked again after it.
        """
        if not self.asked_now:
            self.asked_now = True
            self.tell(events.AdviceRequested.of(self.episode, self.improved))
        gate, limits, helped = self.gate, self.gate_settings, self.helped_steps + self.helped_now
        if self.only_judges:
            self.shown.append((state, own))
        request = AdviceRequest(
            episode=self.episode,
            step=step,
            state=state,
            own=own,
            allowed=self.actions,
            improvement=self.improved,
            reason=gate.why,
            standing=Standing(
                helped, limits.budget, gate.misleads, limits.omega, limits.lambda_threshold, limits.by_evidence
            ),
            mdp=self.mdp,
            q=self.q,
            temperature=self.tau,
            selection=self.settings.selection,
            environment=self.environment,
            judgement="only" if self.only_judges else "also" if self.judging is not None and self.shown else "no",
            praise=self.praise,
        )
        try:
            action = advisor.advise(request)
            while isinstance(action, Judgement):
                self._hears(action, step)
                if self.only_judges:
                    return action
                action = advisor.advise(request)
        except AdvisorLeft:
            self.advisor = None
            self.tell(events.AdviceEnded(self.episode, "advisor left"))
            return None
        self.tell(events.AdviceGiven(self.episode, step, state, action, own))
        return None if action is None else checked_action(action, self.actions, "the advisor")

    def _hears(self, said: Judgement, step: int) -> None:
        """Learns from a judgement of the last moves that were shown."""
        assert self.judging is not None
        if self.praise is None:
            self.praise = PRAISE_RULES[self.judging.rule].make(self.mdp.n_actions, self.settings.selection)
        moves = self.shown[-(said.moves or self.judging.late + 1) :]
        self.praise.hears(moves, said.value, self.q.__getitem__, self.tau)
        self.helped_now += 1
        self.tell(events.MoveJudged(self.episode, step, *moves[-1], said.value, len(moves)))

    def _judge(self, is_open: bool, moves: int | None) -> None:
        """Records the episode, lets the gate judge it (eqs. 6.3 and 6.4), and reports its events."""
        self.update.end()
        episode, helped, limits, gate = self.episode, self.helped_now, self.gate_settings, self.gate
        steps = self.settings.max_steps + 1 if moves is None else moves + self.settings.count_start
        before = self.scores[-limits.window :]
        mean_before = sum(before) / len(before) if before else float(self.settings.max_steps + 1)
        self.requests += self.asked_now
        self.helped_steps += helped
        self.steps.append(steps)
        score: float = steps
        self.returns.append(self.gained)
        if self.highest_reward is not None:
            score = self.max_moves * self.highest_reward - self.gained
            self.scores.append(score)
        self.guided.append(helped > 0)
        self.improved = improvement(self.scores, limits.window)
        gate.judges(self.scores, is_open and (helped > 0 or self.praise is not None or self.judge_unhelped))
        if is_open and self.praise is not None:
            self.praise.fades()
        self.shown.clear()
        if self.trail is not None and self.followed is not None:
            self.followed(Walked(episode, self.trail, moves is not None, score, mean_before))
        rate = self.improved.rate if self.improved else None
        self.tell(events.EpisodeEnded(episode, score, helped > 0, helped, rate, moves is not None, gate.verdict))
        if helped and self.helped_steps >= limits.budget:
            self.tell(events.AdviceEnded(episode, "budget spent"))
        if gate.rejected and self.rejected_at is None:
            self.rejected_at = episode
            self.tell(events.AdviceRejected(episode, gate.misleads, limits.omega, score, mean_before))
        shown = 0 if self.only_judges else helped  # who judges shows nothing that could be remembered
        for event in self.recall.ended(moves, shown) if self.recall is not None else ():
            self.tell(event)

    def result(self, interrupted: bool) -> SessionResult:
        """The result so far; an unfinished episode counts in q and visits only."""
        q, finished, name = self.update.table(), len(self.guided), self.settings.learner
        if UPDATES.is_added(name) and (wrong := int((~np.isfinite(q)).sum())):
            raise BadInput(f"learner '{name}': {wrong} of its {q.size} action values are not finite")
        judged = self.environment.judge(q, self.settings)
        return SessionResult(
            q=q,
            visits=np.array(self.visits, np.int64),
            steps=np.array(self.steps[:finished], np.int64),
            guided=np.array(self.guided, bool),
            requests=self.requests,
            helped_steps=self.helped_steps,
            misleads=self.gate.misleads,
            rejected_at_episode=self.rejected_at,
            optimal_steps=judged.optimal_steps,
            final_steps=judged.final_steps,
            solved=judged.solved,
            interrupted=interrupted,
            returns=np.array(self.returns[:finished], np.float64),
            final_return=judged.final_return,
            best_return=judged.best_return,
        )
