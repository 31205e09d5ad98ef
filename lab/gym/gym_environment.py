"""Gymnasium environments for the lab's learners: their tables and models, and an `Environment` that judges policies."""

from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from math import prod
from typing import Any, NamedTuple

import numpy as np

from lab.errors import WorkFailed
from lab.gym.numbered_environment import CellNumbering, NumberedEnvironment, NumberedStep
from lab.gym.transition_model import SAME_REWARD, Actions, TransitionModel, Worth
from lab.learning.environment import Judged, Step
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, TabularMDP

STEPS_PROBED = 2000  # random steps by which a model is verified
STARTS_PROBED = 100  # resets by which the distribution of starts is estimated
_NEW_EPISODE = 200  # steps after which the verification resets the environment

Digits = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class KnownEnvironment:
    """The names of an environment's actions, and names and sizes of the components of its states."""

    actions: tuple[str, ...] = ()
    digits: Digits = ()


KNOWN = {  # class of the environment -> names
    "FrozenLakeEnv": KnownEnvironment(("left", "down", "right", "up")),
    "CliffWalkingEnv": KnownEnvironment(("up", "right", "down", "left")),
    "TaxiEnv": KnownEnvironment(
        ("south", "north", "east", "west", "pick-up", "drop-off"),
        (("row", 5), ("column", 5), ("passenger", 5), ("destination", 4)),
    ),
    "BlackjackEnv": KnownEnvironment(("stick", "hit"), (("sum", 32), ("dealer", 11), ("ace", 2))),
}


@dataclass(frozen=True, eq=False)
class GymTable(TabularMDP):
    """The table of an environment: the likeliest outcome and the mean reward of each action; placeholders without a model.

    environment: its id and keywords, which distinguish tables without a model; digits: names and sizes of the components of a
    state's number; box: the cells along the axes of a continuous space.
    """

    environment: str = ""
    digits: Digits = ()
    box: tuple[int, ...] = ()

    @property
    def cells(self) -> tuple[int, ...]:
        """The shape of the box or of the grid."""
        return self.box or self.shape

    @cached_property
    def signature(self) -> str:
        """The signature of the problem (see `TabularMDP.signature`), which includes the environment."""
        return sha256(f"{self.environment} {super().signature}".encode()).hexdigest()[:16]

    def state_label(self, state: int) -> str:
        """A state as text, such as "row 2, column 1, passenger 0, destination 3"."""
        plain = super().state_label(state)
        if not self.digits:
            return plain
        values = np.unravel_index(state, [size for _, size in self.digits])
        return ", ".join(f"{name} {value}".strip() for (name, _), value in zip(self.digits, values, strict=True))


def believed(live: NumberedEnvironment) -> TransitionModel | None:
    """The model in the environment's table `P`, None if it has none, or if random steps contradict it."""
    outcomes = getattr(live.inside, "P", None)
    if outcomes is None or len(live.states.sizes) != 1:
        return None
    try:
        starts = getattr(live.inside, "initial_state_distrib", None)
        known = _sampled(live) if starts is None else np.asarray(starts, np.float64)
        if known.shape != (live.states.count,):
            return None
        model = TransitionModel(outcomes, known, live.actions.count)
    except (KeyError, IndexError, TypeError, ValueError):
        return None
    return model if _follows(live, model) else None


def _sampled(live: NumberedEnvironment) -> FloatArray:
    """The estimated distribution (S,) of the starts."""
    begun = [live.begin(seed) for seed in range(STARTS_PROBED)]
    shares: FloatArray = np.bincount(begun, minlength=live.states.count) / len(begun)
    return shares


def _follows(live: NumberedEnvironment, model: TransitionModel) -> bool:
    """Whether STEPS_PROBED random steps agree with the model."""
    rng = np.random.default_rng(0)
    state, over = live.begin(0), False
    for number, action in enumerate(rng.integers(model.n_actions, size=STEPS_PROBED).tolist()):
        if over or number % _NEW_EPISODE == 0:
            state = live.begin(None)
            if not model.starts[state] > 0.0:
                return False
        step = live.step(action)
        if not model.allows(state, action, step.state, step.reward, step.terminated):
            return False
        state, over = step.state, step.terminated or step.truncated
    return True


def table_of(live: NumberedEnvironment, model: TransitionModel | None) -> GymTable:
    """The table of the environment, with the likeliest outcomes if there is a model."""
    states, actions = live.states.count, live.actions.count
    names: dict[str, Any] = {"action_labels": _labels(live), "environment": str(live.name), "digits": _digits(live)}
    names["box"] = live.states.sizes if isinstance(live.states, CellNumbering) else ()
    if model is None:
        stays = np.repeat(np.arange(states)[:, None], actions, axis=1)
        no = np.zeros(states, bool)
        return GymTable(stays.astype(np.int32), np.zeros(stays.shape), no, no, live.first, **names)
    starts = tuple(np.flatnonzero(model.starts > 0.0).tolist())
    return GymTable(
        model.likeliest(),
        model.gain,
        model.terminal,
        model.goal,
        int(model.starts.argmax()),
        shape=_grid_shape(live.inside, states),
        starts=starts if len(starts) > 1 else (),
        **names,
    )


def _known(live: NumberedEnvironment) -> KnownEnvironment:
    return KNOWN.get(type(live.inside).__name__, KnownEnvironment())


def _labels(live: NumberedEnvironment) -> tuple[str, ...]:
    labels = tuple(str(label) for label in getattr(live.inside, "action_labels", _known(live).actions))
    return labels if len(labels) == live.actions.count else tuple(f"action {a}" for a in range(live.actions.count))


def _digits(live: NumberedEnvironment) -> Digits:
    known = _known(live).digits
    if known and prod(size for _, size in known) == live.states.count:
        return known
    return tuple(("", size) for size in live.states.sizes) if len(live.states.sizes) > 1 else ()


def _grid_shape(inside: Any, states: int) -> tuple[int, ...]:
    """The shape of the grid of the states, according to the environment's attributes; () if there is none."""
    given = getattr(inside, "shape", None) or (getattr(inside, "nrow", 0), getattr(inside, "ncol", 0))
    try:
        shape = tuple(int(n) for n in given)
    except (TypeError, ValueError):
        return ()
    return shape if len(shape) in (2, 3) and prod(shape) == states else ()


# ---- the environment ------------------------------------------------------------------------------------------------


MOST_STEPS = 10_000  # of a judged episode
EPISODES_JUDGED = 200  # seeded episodes by which a policy is judged without a model
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
NEAR = 0.01  # relative and absolute tolerance of the best return


class Played(NamedTuple):
    """The result of EPISODES_JUDGED episodes: the mean return, and (steps, last step) of those that terminated."""

    mean_return: float
    ends: list[tuple[int, NumberedStep]]

    @property
    def best_end(self) -> float:
        """The highest reward of a last step, -inf if there is none."""
        return max([-np.inf, *(moved.reward for _, moved in self.ends)])

    def worth(self, best: float) -> Worth:
        """The worth of the policy; an end with the reward `best` is a goal, unless the environment itself reports success."""
        won = [s for s, m in self.ends if (m.reward >= best - SAME_REWARD if m.success is None else m.success)]
        return Worth(self.mean_return, len(won) / EPISODES_JUDGED, sum(won) / len(won) if won else np.inf)


class GymEnvironment:
    """The `Environment` of a Gymnasium environment, whose own generator is seeded by the first draw of a session.

    model: its verified table `P`, None if there is none; then the best known policy is one learned without advice (ALONE).
    A goal is reached if a step says so (info["is_success"]); otherwise if the episode terminates with the best reward of any end,
    without a model the best so far in the session.
    """

    def __init__(self, live: NumberedEnvironment):
        self.live = live
        self.model = believed(live)
        self.mdp: TabularMDP = table_of(live, self.model)
        self._fresh = live.again()  # copied for each session, because environments may keep state over resets
        self._state, self._best = -1, -np.inf
        self._known: dict[float, FloatArray] = {}
        self._best_played: dict[tuple[float, int], Played] = {}

    def reset(self, episode: int, draw: Draw) -> int:
        """The state in which the environment begins; episode 1 seeds it."""
        seed = None
        if episode == 1:
            seed, self._best, self.live = int(draw() * 2**32), -np.inf, self._fresh.again()
        self._state = self.live.begin(seed)
        return self._state

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome of a step from the current state. Raises WorkFailed for an invalid step, ValueError for another state."""
        if state != self._state:
            raise ValueError(f"the environment is in state {self._state}, not in {state}")
        moved = self.live.step(action)
        self._state = moved.state
        return Step(moved.reward, moved.state, moved.terminated, self._reached(moved), moved.truncated)

    def _reached(self, moved: NumberedStep) -> bool:
        if moved.success is not None or not moved.terminated:
            return bool(moved.success)
        self._best = max(self._best, moved.reward) if self.model is None else self.model.best
        return moved.reward >= self._best - SAME_REWARD

    def picture(self, state: int) -> str:
        """The environment's own text for a state."""
        return self.live.picture(state)

    @property
    def highest_reward(self) -> float | None:
        """The highest reward of a step if no episode ever ends in a goal, as a model shows; None otherwise."""
        return None if self.model is None or self.model.goal.any() else self.model.highest

    @property
    def modules(self) -> tuple[str, ...]:
        """The module of the environment's code, see `lab.files.code_key`."""
        return (type(self.live.inside).__module__,)

    @property
    def max_steps(self) -> int:
        """The limit of steps of an episode: its own, otherwise one that allows for a walk through all states."""
        return self.live.limit or min(MOST_STEPS, max(200, 4 * self.mdp.n_states))

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A): exact with a model, otherwise learned without advice in a copy.

        Raises WorkFailed if they do not converge, or if learning found no difference between actions.
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
            why = f"{ALONE.episodes} episodes of learning alone found nothing to prefer"
            raise WorkFailed(f"{self.live.which}: nobody knows what is best in it: {why}")
        return result.q

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """The judgement: exact with a model, otherwise from EPISODES_JUDGED seeded episodes; returns are undiscounted.

        final_steps, optimal_steps: the mean steps to the goal, rounded; final_steps is None if the greedy policy reaches it less
        than half as often as the best one, optimal_steps is None without a model. solved: the mean return is within 1 % (or 0.01)
        of that of the best policy (without a model, of the best known one that reaches a goal), or it reaches the threshold
        that the environment is registered with, if no keywords were given. Where no episode ends in a goal, both steps are None,
        and there are final_return and best_return.
        """
        own, best = self._compared(q, learner)
        enough = own.reaches > 0.0 and (best is None or own.reaches >= 0.5 * best.reaches)
        if self.highest_reward is not None:
            best_return = None if best is None else best.mean_return
            return Judged(None, None, self._solved(own, best), own.mean_return, best_return)
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
            return False  # no policy is known to be good
        return own.mean_return >= best.mean_return - NEAR * max(1.0, abs(best.mean_return))

    def _compared(self, q: FloatArray, learner: LearnerSettings) -> tuple[Worth, Worth | None]:
        """The worth of the greedy policy of a table, and that of the best known policy, None if there is none."""
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
        """The result of a policy in seeded episodes of a copy."""
        other, actions = self.live.again(), policy.tolist()
        returned, ends = 0.0, list[tuple[int, NumberedStep]]()
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
    """A Gymnasium environment without judgement, for learning only."""

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """An empty judgement."""
        return Judged(None, None, False)
