"""What is known of an environment before anything is learned: the model it brings along, and its states and actions by name."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from math import prod
from typing import Any

import numpy as np

from lab.gym.numbered_environment import NumberedEnvironment
from lab.gym.space_numbering import CellNumbering
from lab.gym.transition_model import TransitionModel
from lab.mdp import FloatArray, TabularMDP

STEPS_PROBED = 2000  # of a model, before it is believed
STARTS_PROBED = 100  # resets, where an environment does not say where it begins
_NEW_EPISODE = 200  # steps after which a probe begins again

Digits = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Known:
    """What an environment's actions and the digits of its states are called."""

    actions: tuple[str, ...] = ()
    digits: Digits = ()


KNOWN = {  # by the class of the environment
    "FrozenLakeEnv": Known(("left", "down", "right", "up")),
    "CliffWalkingEnv": Known(("up", "right", "down", "left")),
    "TaxiEnv": Known(
        ("south", "north", "east", "west", "pick-up", "drop-off"),
        (("row", 5), ("column", 5), ("passenger", 5), ("destination", 4)),
    ),
    "BlackjackEnv": Known(("stick", "hit"), (("sum", 32), ("dealer", 11), ("ace", 2))),
}


@dataclass(frozen=True, eq=False)
class GymTable(TabularMDP):
    """What is known of an environment's steps: the likeliest state entered and the mean reward, or nothing at all.

    environment: its id and keywords, so that two of which nothing is known are two problems. digits: the names and sizes
    of what the number of a state is made of. box: the cells along the axes of a continuous space.
    """

    environment: str = ""
    digits: Digits = ()
    box: tuple[int, ...] = ()

    @property
    def cells(self) -> tuple[int, ...]:
        """Those of a box, or of a grid."""
        return self.box or self.shape

    @cached_property
    def signature(self) -> str:
        """As `TabularMDP.signature`, the environment included."""
        return sha256(f"{self.environment} {super().signature}".encode()).hexdigest()[:16]

    def state_label(self, state: int) -> str:
        """A state in words, such as "row 2, column 1, passenger 0, destination 3"."""
        plain = super().state_label(state)
        if not self.digits:
            return plain
        values = np.unravel_index(state, [size for _, size in self.digits])
        return ", ".join(f"{name} {value}".strip() for (name, _), value in zip(self.digits, values, strict=True))


def believed(live: NumberedEnvironment) -> TransitionModel | None:
    """The model that the environment's table `P` makes, if it has one and steps taken at random are as it says."""
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
    """How often episodes began in each state (S,), as a share."""
    begun = [live.begin(seed) for seed in range(STARTS_PROBED)]
    shares: FloatArray = np.bincount(begun, minlength=live.states.count) / len(begun)
    return shares


def _follows(live: NumberedEnvironment, model: TransitionModel) -> bool:
    """Whether every one of many random steps is one that the model knows."""
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
    """The environment's states and actions by name, with its likeliest steps where there is a model."""
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


def _known(live: NumberedEnvironment) -> Known:
    return KNOWN.get(type(live.inside).__name__, Known())


def _labels(live: NumberedEnvironment) -> tuple[str, ...]:
    labels = tuple(str(label) for label in getattr(live.inside, "action_labels", _known(live).actions))
    return labels if len(labels) == live.actions.count else tuple(f"action {a}" for a in range(live.actions.count))


def _digits(live: NumberedEnvironment) -> Digits:
    known = _known(live).digits
    if known and prod(size for _, size in known) == live.states.count:
        return known
    return tuple(("", size) for size in live.states.sizes) if len(live.states.sizes) > 1 else ()


def _grid_shape(inside: Any, states: int) -> tuple[int, ...]:
    """The shape of a grid that the states are, as the environment's own attributes say; () when they say none."""
    given = getattr(inside, "shape", None) or (getattr(inside, "nrow", 0), getattr(inside, "ncol", 0))
    try:
        shape = tuple(int(n) for n in given)
    except (TypeError, ValueError):
        return ()
    return shape if len(shape) in (2, 3) and prod(shape) == states else ()
