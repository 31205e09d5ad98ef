"""Stochastic problems from arrays of probabilities and rewards, with goals or scored by return; RiverSwim as an example."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Gt, Le
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput, WorkFailed, check_value, shortened
from lab.learning.chance_table import ChanceTable, Outcome
from lab.learning.environment import Judged
from lab.learning.selection import Draw
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import MAX_SWEEPS, BoolArray, FloatArray, NoPath, TabularMDP

WHERE = "lab.Problem.from_arrays"
ROUNDED = 1e-6  # the most by which a sum of probabilities may miss 1; the row is then divided by its sum
SETTLED = 1e-12  # relative changes of values, and probabilities, below this count as 0
NEAR = 0.01  # relative and absolute tolerance of the best return
EPISODES = (1000, 20_000)  # limits on 20 episodes per entry of the table


@dataclass(frozen=True, eq=False)
class ArrayTable(TabularMDP):
    """The likeliest outcome and the mean reward of each action; arrays: a digest of the arrays that the problem was made of."""

    arrays: str = ""

    @cached_property
    def signature(self) -> str:
        """The signature of the problem (see `TabularMDP.signature`), which includes the arrays."""
        return sha256(f"{self.arrays} {super().signature}".encode()).hexdigest()[:16]


class ArrayEnvironment(ChanceTable):
    """The environment of a Markov decision process that is given as arrays; `of` checks them.

    chances: (S, A, S) float64, a terminal state leads to itself; rewards: (S, A, S), 0 in terminal states; begins: (S,), the
    distribution of the starts; mdp: its likeliest outcomes.
    highest_reward: of a step, None if there is a goal, see `lab.learning.environment.highest_reward`; certain: whether all steps
    are deterministic.
    """

    def __init__(self, mdp: TabularMDP, chances: FloatArray, rewards: FloatArray, begins: FloatArray):
        possible = chances > 0.0
        super().__init__(mdp, _outcomes(chances, rewards), np.zeros(mdp.successor.shape))
        self.chances, self.begins, self.gain = chances, begins, (chances * rewards).sum(axis=2)
        self.certain = bool((possible.sum(axis=2) == 1).all())
        self.highest_reward: float | None = None
        if not mdp.goal.any():
            highest = float(rewards[possible & ~mdp.terminal[:, None, None]].max())
            self.highest_reward = max(highest, 0.0) if mdp.terminal.any() else highest
        self._wins = (
            chances[:, :, mdp.goal].sum(axis=2) * ~mdp.terminal[:, None]
        )  # (S, A) the probability of reaching a goal
        self._known: dict[float, FloatArray] = {}

    @classmethod
    def of(
        cls,
        P: ArrayLike,
        R: ArrayLike,
        start: int | ArrayLike,
        terminal: ArrayLike,
        goal: ArrayLike,
        action_labels: Sequence[str] | None,
    ) -> "ArrayEnvironment":
        """The environment of these arrays, see `lab.Problem.from_arrays`. Raises BadInput if they do not fit together."""
        chances, rewards = _numbers("P", P), _numbers("R", R)
        if chances.ndim != 3 or 0 in chances.shape or chances.shape[0] != chances.shape[2]:
            turned = chances.ndim == 3 and chances.shape[1] == chances.shape[2]
            way = ": P.transpose(1, 0, 2) has it" if turned else ""
            raise _refused(f"P has shape {chances.shape}: wanted (states, actions, states){way}")
        states, actions, _ = chances.shape
        ends, goals = _states("terminal", terminal, states), _states("goal", goal, states)
        if (goals & ~ends).any():
            raise _refused(f"goal {int(np.flatnonzero(goals & ~ends)[0])} is not among the terminal states")
        _check_chances(chances, ~ends)
        if rewards.shape not in ((states, actions), (states, actions, states)):
            wanted = f"wanted ({states}, {actions}) or ({states}, {actions}, {states})"
            raise _refused(f"R has shape {rewards.shape}: {wanted}, as P has {chances.shape}")
        if not np.isfinite(rewards).all():
            at = tuple(int(i) for i in np.argwhere(~np.isfinite(rewards))[0])
            raise _refused(f"R{list(at)} is {rewards[at]}: wanted finite rewards")
        if rewards.ndim == 2:
            rewards = np.repeat(rewards[:, :, None], states, axis=2)
        begins = _distribution(start, ends)
        chances[ends], rewards[ends] = np.eye(states)[ends][:, None, :], 0.0
        chances /= chances.sum(axis=2, keepdims=True)
        labels = tuple(f"action {a}" for a in range(actions)) if action_labels is None else tuple(action_labels)
        digest = sha256(b"".join(array.tobytes() for array in (chances, rewards, begins))).hexdigest()
        starts = tuple(np.flatnonzero(begins).tolist())
        mdp = ArrayTable(
            chances.argmax(axis=2).astype(np.int32),
            (chances * rewards).sum(axis=2),
            ends,
            goals,
            int(begins.argmax()),
            labels,
            starts=starts if len(starts) > 1 else (),
            arrays=digest,
        )
        return (DrawnStarts if mdp.starts else ArrayEnvironment)(mdp, chances, rewards, begins)

    def check(self) -> None:
        """Raises NoPath if there is a goal, and none can be reached from any start."""
        reached = self.begins > 0.0
        while not (reached & self.mdp.goal).any() and self.highest_reward is None:
            further = reached | (self.chances[reached & ~self.mdp.terminal] > 0.0).any(axis=(0, 1))
            if (further == reached).all():
                raise NoPath(f"no goal can be reached from {self.mdp.state_label(self.mdp.start)}", (), "goal")
            reached = further

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) by value iteration. Raises WorkFailed if they do not converge."""
        if discount not in self._known:
            q = self.gain
            for _ in range(MAX_SWEEPS):
                updated = self.gain + discount * (self.chances @ np.where(self.mdp.terminal, 0.0, q.max(axis=1)))
                change, q = float(np.abs(updated - q).max()), updated
                if change < SETTLED * max(1.0, float(np.abs(q).max())):
                    break
            else:
                raise WorkFailed(f"value iteration with discount {discount} did not settle in {MAX_SWEEPS} sweeps")
            q.flags.writeable = False
            self._known[discount] = q
        return self._known[discount]

    def worth(self, policy: NDArray[np.int64], moves: int) -> tuple[float, float, float]:
        """(mean return, probability of reaching a goal, mean moves to it) of a policy (S,) in episodes of so many moves."""
        states = np.arange(self.mdp.n_states)
        onward, gain, wins = (array[states, policy] for array in (self.chances, self.gain, self._wins))
        at, returned, reached, steps = self.begins, 0.0, 0.0, 0.0
        for step in range(1, moves + 1):
            now = float(at @ wins)
            returned, reached, steps = returned + float(at @ gain), reached + now, steps + step * now
            at = np.where(self.mdp.terminal, 0.0, at @ onward)
            if at.sum() < SETTLED:
                break
        return returned, reached, steps / reached if reached else np.inf

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """The exact judgement of the greedy policy, beside the policy that is optimal with the learner's discount.

        final_steps, optimal_steps: mean steps to the goal, rounded; final_steps is None if the greedy policy reaches it less than
        half as often. Without a goal both are None, and there are final_return and best_return. solved: the mean return is within
        1 % (or 0.01) of that of the best policy.
        """
        moves, best = learner.max_steps - learner.count_start, None
        with suppress(WorkFailed):  # as with a discount of 1 in a continuing problem
            best = self.worth(self.values(learner.discount).argmax(axis=1), moves)
        returned, reached, steps = self.worth(q.argmax(axis=1), moves)
        solved = best is not None and returned >= best[0] - NEAR * max(1.0, abs(best[0]))
        if self.highest_reward is not None:
            return Judged(None, None, solved, returned, None if best is None else best[0])
        final = round(steps) + learner.count_start if reached > 0.0 and (not best or reached >= 0.5 * best[1]) else None
        fewest = round(best[2]) + learner.count_start if best and best[1] else None
        return Judged(final, fewest, solved and final is not None)


class DrawnStarts(ArrayEnvironment):
    """The environment of a process whose episodes begin in several states, each with its own probability."""

    def reset(self, episode: int, draw: Draw) -> int:
        """The start that one uniform number selects."""
        starts = self.mdp.starts
        return starts[int(np.searchsorted(self.begins[list(starts)].cumsum()[:-1], draw(), side="right"))]


def fitting(environment: ArrayEnvironment, discount: float, horizon: int) -> tuple[LearnerSettings, GateSettings]:
    """Settings that suit a stochastic problem, as for Gymnasium's. Raises BadInput for a discount or horizon out of range."""
    check_value("discount", discount, Annotated[float, Gt(0), Le(1)], WHERE)
    check_value("horizon", horizon, Annotated[int, Ge(1), Le(1_000_000)], WHERE)
    episodes = min(max(20 * environment.mdp.successor.size, EPISODES[0]), EPISODES[1])
    learner = LearnerSettings(
        learner="q",
        alpha=0.1,
        selection="epsilon-greedy",
        beta=0.3,
        discount=float(discount),
        episodes=episodes,
        max_steps=horizon,
    )
    return learner, GateSettings(window=20, first_episode=40, omega=30, spare_best=True)


def _outcomes(chances: FloatArray, rewards: FloatArray) -> list[list[Outcome]]:
    """The possible outcomes of each of the S * A moves."""
    states = chances.shape[0]
    rows = zip(chances.reshape(-1, states), rewards.reshape(-1, states), strict=True)
    return [
        [(float(chance[k]), k, float(reward[k])) for k in np.flatnonzero(chance > 0.0).tolist()]
        for chance, reward in rows
    ]


# ---- checks of what is handed in ------------------------------------------------------------------------------------


def _refused(why: str) -> BadInput:
    return BadInput(f"{why} ({WHERE})")


def _numbers(name: str, given: Any) -> FloatArray:
    try:
        array: FloatArray = np.array(given, np.float64)
    except (TypeError, ValueError):
        raise _refused(f"{name} {shortened(repr(given))}: wanted an array of numbers") from None
    return array


def _states(name: str, given: Any, states: int) -> BoolArray:
    """A mask (S,) of states that are given as numbers or as a mask."""
    refused = _refused(f"{name} {shortened(repr(given))}: wanted states 0..{states - 1}, or a bool mask of {states}")
    try:
        listed = np.asarray(given)
    except ValueError:
        raise refused from None
    if listed.dtype == np.bool_ and listed.shape == (states,):
        return listed.copy()
    mask = np.zeros(states, bool)
    if listed.size:
        if listed.ndim != 1 or listed.dtype.kind not in "iu" or listed.min() < 0 or listed.max() >= states:
            raise refused
        mask[listed] = True
    return mask


def _check_chances(chances: FloatArray, live: BoolArray) -> None:
    """Raises BadInput for the first row of a state that is not terminal which is no distribution."""
    sums = chances.sum(axis=2)
    for what, wrong in (
        ("is not finite: wanted probabilities", ~np.isfinite(chances).all(axis=2)),
        ("has a negative probability", (chances < 0.0).any(axis=2)),
        ("sums to {:g}: wanted 1", ~(np.abs(sums - 1.0) <= ROUNDED)),
    ):
        rows = np.argwhere(wrong & live[:, None])
        if len(rows):
            state, action = rows[0].tolist()
            raise _refused(f"P[{state}, {action}] {what.format(sums[state, action])}")


def _distribution(start: Any, ends: BoolArray) -> FloatArray:
    """The distribution (S,) of the starts."""
    given, states = _numbers("start", start), len(ends)
    wanted = f"wanted a state 0..{states - 1}, or {states} probabilities that sum to 1"
    if given.ndim == 0:
        if not 0 <= given < states or given != int(given):
            raise _refused(f"start {start!r}: {wanted}")
        given = np.eye(states)[int(given)]
    if given.shape != (states,) or not (given >= 0.0).all() or not abs(given.sum() - 1.0) <= ROUNDED:
        raise _refused(f"start {shortened(repr(start))}: {wanted}")
    if (given[ends] > 0.0).any():
        raise _refused(f"start {int(np.flatnonzero((given > 0.0) & ends)[0])} is a terminal state")
    begins: FloatArray = given / given.sum()
    return begins


# ---- RiverSwim ------------------------------------------------------------------------------------------------------


def river_swim(states: int = 6) -> tuple[FloatArray, FloatArray]:
    """The arrays (P, R) of RiverSwim: swimming left with the current, action 0, is certain; right, action 1, mostly fails.

    The left bank, state 0, gives 0.005 for swimming left, the right one 1 for swimming right; episodes begin at the left bank and
    have 20 steps. Source: Strehl and Littman 2008; the numbers are those of Osband, Russo and Van Roy 2013.
    """
    P, last = np.zeros((states, 2, states)), states - 1
    for state in range(states):
        P[state, 0, max(state - 1, 0)] = 1.0
        P[state, 1, max(state - 1, 0)] += 0.05
        P[state, 1, state] += 0.6
        P[state, 1, min(state + 1, last)] += 0.35
    P[0, 1], P[last, 1] = 0.0, 0.0
    P[0, 1, :2] = 0.4, 0.6
    P[last, 1, last - 1 :] = 0.4, 0.6
    R = np.zeros((states, 2))
    R[0, 0], R[last, 1] = 0.005, 1.0
    return P, R
