"""A Gymnasium environment as the place where the lab's learners act, judged exactly where it brings a model along."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lab.errors import WorkFailed
from lab.gym.gym_table import believed, table_of
from lab.gym.numbered_environment import Moved, NumberedEnvironment
from lab.gym.transition_model import SAME_REWARD, Actions, Worth
from lab.learning.environment import Judged, Step
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, TabularMDP

MOST_STEPS = 10_000  # of an episode that is judged
EPISODES_JUDGED = 200  # where no model says how good a policy is
ALONE = LearnerSettings(learner="q", alpha=0.1, selection="epsilon-greedy", beta=0.3, episodes=5000)
ON_TILES = LearnerSettings(
    "sarsa-lambda",
    alpha=0.5,
    trace=0.9,
    replacing=True,
    tilings=8,
    selection="epsilon-greedy",
    exploration=0.1,
    beta=0.1,
    episodes=300,
)
NEAR = 0.01  # of the best return, and at least so much: as good as the best


class Played(NamedTuple):
    """What a policy did in EPISODES_JUDGED episodes: its mean return, and the last steps of those that terminated."""

    mean_return: float
    ends: list[tuple[int, Moved]]

    @property
    def best_end(self) -> float:
        """The highest reward of a last step, -inf when there was none."""
        return max([-np.inf, *(moved.reward for _, moved in self.ends)])

    def worth(self, best: float) -> Worth:
        """Its worth when an end with the reward `best` is a goal, where the environment itself does not say."""
        won = [s for s, m in self.ends if (m.reward >= best - SAME_REWARD if m.success is None else m.success)]
        return Worth(self.mean_return, len(won) / EPISODES_JUDGED, sum(won) / len(won) if won else np.inf)


class GymEnvironment:
    """The `Environment` that a Gymnasium environment is: its own chance, seeded by the first draw of a session.

    model: what it brings along as its table `P`, when its steps are found to follow it, else None: the best that is
    known is then what was learned alone (ALONE). A goal is reached where a step says so
    (info["is_success"]), else where an episode terminates with the best reward that any of its ends has, or without a
    model, has had so far in the session.
    """

    def __init__(self, live: NumberedEnvironment):
        self.live = live
        self.model = believed(live)
        self.mdp: TabularMDP = table_of(live, self.model)
        self._fresh = live.again()  # each session begins in a copy of it, whatever an environment keeps over its resets
        self._state, self._best = -1, -np.inf
        self._known: dict[float, FloatArray] = {}
        self._best_played: dict[tuple[float, int], Played] = {}

    def reset(self, episode: int, draw: Draw) -> int:
        """Where the environment begins; in episode 1 it is seeded."""
        seed = None
        if episode == 1:
            seed, self._best, self.live = int(draw() * 2**32), -np.inf, self._fresh.again()
        self._state = self.live.begin(seed)
        return self._state

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """One step from where the last one led. Raises WorkFailed for what is no step, ValueError for another state."""
        if state != self._state:
            raise ValueError(f"the environment is in state {self._state}, not in {state}")
        moved = self.live.step(action)
        self._state = moved.state
        return Step(moved.reward, moved.state, moved.terminated, self._reached(moved), moved.truncated)

    def _reached(self, moved: Moved) -> bool:
        if moved.success is not None or not moved.terminated:
            return bool(moved.success)
        self._best = max(self._best, moved.reward) if self.model is None else self.model.best
        return moved.reward >= self._best - SAME_REWARD

    def picture(self, state: int) -> str:
        """The environment's own text for a state."""
        return self.live.picture(state)

    @property
    def max_steps(self) -> int:
        """The steps of an episode: its own limit, else as many as a walk through all its states may need."""
        return self.live.limit or min(MOST_STEPS, max(200, 4 * self.mdp.n_states))

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A): exact with a model, else learned alone in a second environment.

        Raises WorkFailed when they do not settle, and when learning alone found nothing to prefer.
        """
        if discount not in self._known:
            known = self._learned_alone(discount) if self.model is None else self.model.optimal(discount)
            known.flags.writeable = False
            self._known[discount] = known
        return self._known[discount]

    def _learned_alone(self, discount: float) -> FloatArray:
        learner = replace(ON_TILES if self.mdp.cells and not self.mdp.shape else ALONE, discount=discount)
        learner = replace(learner, max_steps=self.max_steps)
        alone, rng = _Unjudged(self.live.again()), np.random.default_rng(0)
        result = Session(alone, learner, GateSettings(gate="never"), None, rng).run()
        if result.interrupted:
            raise KeyboardInterrupt
        if not (np.ptp(result.q, axis=1) > 0.0).any():
            found = f"{ALONE.episodes} episodes of learning alone found nothing to prefer"
            raise WorkFailed(f"{self.live.which}: nobody knows what is best in it: {found}")
        return result.q

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """Exact with a model, else from EPISODES_JUDGED seeded episodes; returns are compared without discount.

        final_steps, optimal_steps: the mean steps of the ways to the goal, rounded; final_steps None where the greedy
        policy gets there less than half as often as the best one, optimal_steps None without a model. Solved: its mean
        return is within 1 % (or 0.01) of that of the best policy for the learner's discount (where no model says which
        that is, of the best known one that gets to a goal), or reaches the threshold that the environment is registered
        with; keywords make it another one, with no threshold.
        """
        own, best = self._compared(q, learner)
        enough = own.reaches > 0.0 and (best is None or own.reaches >= 0.5 * best.reaches)
        exact = self.model is not None and best is not None and best.reaches > 0.0
        return Judged(
            round(own.steps) + learner.count_start if enough else None,
            round(best.steps) + learner.count_start if exact and best is not None else None,
            self._solved(own, best),
        )

    def _solved(self, own: Worth, best: Worth | None) -> bool:
        if self.live.threshold is not None and own.mean_return >= self.live.threshold:
            return True
        if best is None or (self.model is None and not best.reaches):
            return False  # nobody knows what is good here
        return own.mean_return >= best.mean_return - NEAR * max(1.0, abs(best.mean_return))

    def _compared(self, q: FloatArray, learner: LearnerSettings) -> tuple[Worth, Worth | None]:
        """What the greedy policy of a table brings, and what the best known one does, if any is known."""
        horizon = min(self.live.limit or MOST_STEPS, learner.max_steps - learner.count_start, MOST_STEPS)
        try:
            best = self.values(learner.discount).argmax(axis=1)
        except WorkFailed:
            best = None
        policy = q.argmax(axis=1)
        if self.model is not None:
            return self.model.worth(policy, horizon), None if best is None else self.model.worth(best, horizon)
        key = (learner.discount, horizon)
        if best is not None and key not in self._best_played:
            self._best_played[key] = self._played(best, horizon)
        own, known = self._played(policy, horizon), self._best_played.get(key)
        top = max([own.best_end, *([known.best_end] if known is not None else [])])
        return own.worth(top), None if known is None else known.worth(top)

    def _played(self, policy: Actions, horizon: int) -> Played:
        """What a policy did in seeded episodes of a second environment."""
        other, actions = self.live.again(), policy.tolist()
        returned, ends = 0.0, list[tuple[int, Moved]]()
        for seed in range(EPISODES_JUDGED):
            state = other.begin(seed)
            for step in range(1, horizon + 1):
                moved = other.step(actions[state])
                state, returned = moved.state, returned + moved.reward
                if moved.terminated:
                    ends.append((step, moved))
                if moved.terminated or moved.truncated:
                    break
        return Played(returned / EPISODES_JUDGED, ends)


class _Unjudged(GymEnvironment):
    """One in which a session only learns."""

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """No verdict."""
        return Judged(None, None, False)
