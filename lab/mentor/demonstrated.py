"""The steps of demonstrations as a mentor looks them up: what was observed, what was done, how many steps were left."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.lazy import scipy
from lab.recordings.episode import Episode

Array = NDArray[np.float64]
MOST_STEPS = 20_000  # that are looked up: `python -m devtools.mentor_cost` measures a call
_STILL = 0.01  # least scale, as a share of the median one: a number that never moved must not outweigh the others
_ROUNDING = 1e-5  # standard deviation, as a share of the largest value, below which float32 numbers are all the same


def shows_what_to_do(episode: Episode) -> NDArray[np.bool_]:
    """Which steps (n,) are demonstrations: all of an episode that did not fail, the corrected ones of an episode that did."""
    return episode.corrected if episode.success is False else np.ones(len(episode), bool)


@dataclass(frozen=True, eq=False)
class Demonstrated:
    """n steps: states (n, d), standardized by middle (d,) and scale (d,); actions (n, k); left (n,), the steps until the end.

    action_scale (k,): the standard deviation of each number of the actions, with a floor as for the states.
    """

    middle: Array
    scale: Array
    states: Array
    actions: Array
    left: Array
    action_scale: Array

    @classmethod
    def of(
        cls,
        episodes: Iterable[Episode],
        rng: np.random.Generator,
        shows: Callable[[Episode], NDArray[np.bool_]] = shows_what_to_do,
    ) -> "Demonstrated":
        """The steps (n,) of the episodes that `shows` marks; at most MOST_STEPS, drawn. Raises BadInput if there is none."""
        chosen = [(episode, shows(episode)) for episode in episodes]
        chosen = [(episode, taken) for episode, taken in chosen if taken.any()]
        if not chosen:
            raise BadInput("demonstrations: no step of an episode that did not fail: wanted one or more")
        states = np.concatenate([episode.states[taken] for episode, taken in chosen]).astype(np.float64)
        actions = np.concatenate([episode.actions[taken] for episode, taken in chosen]).astype(np.float64)
        left = np.concatenate([np.arange(len(taken))[::-1][taken] for _, taken in chosen]).astype(np.float64)
        if len(states) > MOST_STEPS:
            kept = np.sort(rng.choice(len(states), MOST_STEPS, replace=False))
            states, actions, left = states[kept], actions[kept], left[kept]
        middle, scale = states.mean(axis=0), _scale(states)
        return cls(middle, scale, (states - middle) / scale, actions, left, _scale(actions))

    def standardized(self, states: Any) -> Array:
        """States (..., d) in the scale of the demonstrations."""
        return np.asarray((np.asarray(states, np.float64) - self.middle) / self.scale)

    def near(self, state: Array, count: int) -> tuple[Array, NDArray[np.int64]]:
        """The distances (count,) of the nearest steps to a standardized state (d,), and their numbers (count,)."""
        wanted = min(count, len(self.states))
        numbers = np.atleast_1d(self._tree.query(state @ self._axes, wanted)[1])
        return np.linalg.norm(self.states[numbers] - state, axis=1), numbers

    @cached_property
    def _axes(self) -> Array:
        """The principal axes (d, d) of the states: along the first few a tree of them rules most out, at equal distances."""
        return np.linalg.eigh(self.states.T @ self.states)[1]

    @cached_property
    def _tree(self) -> Any:
        return scipy.spatial.cKDTree(self.states @ self._axes)


def _scale(values: Array) -> Array:
    """The standard deviation (d,) of each column, not below a share of the median of those that vary; 1 if none does."""
    spread = values.std(axis=0)
    moving = spread[spread > _ROUNDING * np.abs(values).max(axis=0)]
    return np.asarray(np.maximum(spread, _STILL * float(np.median(moving)) if len(moving) else 1.0))
