"""A Gymnasium environment under way: its states and actions as numbers, its errors as ours, its own picture of a state."""

from collections.abc import Iterator
from copy import deepcopy
from math import isfinite, prod
from typing import Any, NamedTuple, Self

import numpy as np
from gymnasium import spaces

from lab.errors import BadInput, WorkFailed
from lab.gym.environment_name import GymName, make, quiet, said
from lab.learning.tiles import Bounds

SUPPORTED = "Discrete, MultiDiscrete, MultiBinary, and Tuple or Dict of these"
MOST_AXES, CELLS = 4, {1: 64, 2: 64, 3: 32, 4: 24}  # of a box, along each axis

Digit = tuple[int, int]  # how many values it has, and the first of them


class Unsupported(Exception):
    """A space that is not discrete."""


class Numbering:
    """The values of a space in order, the last digit running fastest; `sizes`: the values of each digit.

    A Discrete space is one digit. Raises Unsupported for a space that holds anything continuous, text or lists.
    """

    def __init__(self, space: spaces.Space[Any]):
        self._space = space
        digits = list(_digits(space))
        self.sizes = tuple(size for size, _ in digits)
        self.count = prod(self.sizes)
        self._firsts = tuple(first for _, first in digits)

    def number(self, value: Any) -> int:
        """The number of a value; raises ValueError for one that is not in the space."""
        total = 0
        for given, size, first in zip(_values(self._space, value), self.sizes, self._firsts, strict=True):
            digit = int(given) - first
            if not 0 <= digit < size:
                raise ValueError(f"{value!r} is not in {self._space}")
            total = total * size + digit
        return total

    def value(self, number: int) -> Any:
        """The value with a number."""
        digits = np.unravel_index(number, self.sizes) if self.sizes else ()
        return _built(self._space, iter([int(d) + first for d, first in zip(digits, self._firsts, strict=True)]))


class CellNumbering:
    """The cells of a box with one axis, or of up to four, between its bounds: as `Numbering`.

    Raises Unsupported for another space, for more axes, and for bounds that are not finite.
    """

    def __init__(self, space: spaces.Space[Any]):
        if not isinstance(space, spaces.Box) or len(space.shape) != 1 or not 1 <= space.shape[0] <= MOST_AXES:
            raise Unsupported
        if not (np.isfinite(space.low).all() and np.isfinite(space.high).all() and (space.low < space.high).all()):
            raise Unsupported
        axes = space.shape[0]
        self.sizes = (CELLS[axes],) * axes
        self.count = prod(self.sizes)
        self._bounds = Bounds(tuple(space.low.tolist()), tuple(space.high.tolist()), self.sizes)
        self._type = space.dtype

    def number(self, value: Any) -> int:
        """The number of the cell that a point lies in; raises ValueError for what is no point."""
        point = np.asarray(value, np.float64)
        if point.shape != (len(self.sizes),) or not np.isfinite(point).all():
            raise ValueError(f"{value!r} is no point with {len(self.sizes)} finite numbers")
        return self._bounds.number(point.tolist())

    def value(self, number: int) -> Any:
        """The middle of a cell."""
        return np.array(self._bounds.centre(number), self._type)


def _digits(space: spaces.Space[Any]) -> Iterator[Digit]:
    match space:
        case spaces.Discrete():
            yield int(space.n), int(space.start)
        case spaces.MultiDiscrete():
            yield from zip(space.nvec.ravel().tolist(), space.start.ravel().tolist(), strict=True)
        case spaces.MultiBinary():
            yield from [(2, 0)] * prod(space.shape)
        case spaces.Tuple() | spaces.Dict():
            for part in _parts(space):
                yield from _digits(part)
        case _:
            raise Unsupported


def _parts(space: "spaces.Tuple[Any] | spaces.Dict") -> list[spaces.Space[Any]]:  # no generic before Gymnasium 1.4
    return list(space.spaces.values() if isinstance(space, spaces.Dict) else space.spaces)


def _values(space: spaces.Space[Any], value: Any) -> Iterator[Any]:
    """The values of the digits, as they stand in a value."""
    match space:
        case spaces.Discrete():
            yield value
        case spaces.Tuple():
            for part, given in zip(space.spaces, value, strict=True):
                yield from _values(part, given)
        case spaces.Dict():
            for key, part in space.spaces.items():
                yield from _values(part, value[key])
        case _:
            yield from np.asarray(value).ravel().tolist()


def _built(space: spaces.Space[Any], digits: Iterator[int]) -> Any:
    """The value that the next digits make."""
    match space:
        case spaces.Discrete():
            return next(digits)
        case spaces.Tuple():
            return tuple(_built(part, digits) for part in space.spaces)
        case spaces.Dict():
            return {key: _built(part, digits) for key, part in space.spaces.items()}
        case _:
            shape = space.shape or ()
            return np.array([next(digits) for _ in range(prod(shape))], space.dtype).reshape(shape)


# ---- numbered environment ---------------------------------------------------------------------------------------------


MAX_ENTRIES = 1_000_000  # states x actions


class Moved(NamedTuple):
    """What a step led to; success: whether the environment says that a goal is reached, None when it says nothing."""

    reward: float
    state: int
    terminated: bool
    truncated: bool
    success: bool | None


class NumberedEnvironment:
    """An environment that is stepped, and where its state can be set, a second one that is put where it is to be drawn.

    states, actions: the numbering of its spaces; first: a state that it begins in; limit: the steps of an episode, None
    when it has no limit of its own; threshold: the mean return that counts as solved there, None when none is known for
    these keywords. Raises BadInput when it cannot be made or reset, and for spaces that make no table.
    """

    def __init__(self, name: GymName, where: str):
        self.name, self._where, self.which = name, where, f"environment '{name}' ({where})"
        self._env = make(name, where)
        self.states: Numbering | CellNumbering = self._cells() or self._numbered(
            "observation", self._env.observation_space
        )
        self.actions = self._numbered("action", self._env.action_space)
        if self.states.count * self.actions.count > MAX_ENTRIES:
            size = f"{self.states.count} states x {self.actions.count} actions"
            raise BadInput(f"{self.which}: {size}: a table of at most {MAX_ENTRIES} entries is allowed")
        self._choices = [self.actions.value(number) for number in range(self.actions.count)]
        self._draws = "ansi" in ((self._env.metadata or {}).get("render_modes") or ())
        if self._draws:
            self._env = make(name, where, "ansi")
        self._state = -1
        try:
            self.first = self.begin(0)
        except WorkFailed as error:
            raise BadInput(str(error)) from None
        self._canvas = self._placeable() if self._draws else None
        spec = self._env.spec
        self.limit = self._own_limit() if spec is None or spec.max_episode_steps is None else spec.max_episode_steps
        self.threshold = None if spec is None or name.options else spec.reward_threshold

    def _own_limit(self) -> int | None:
        """The limit that an environment keeps itself, as the lab's own do."""
        limit = getattr(self.inside, "max_episode_steps", None)
        return limit if isinstance(limit, int) and limit > 0 else None

    def again(self) -> Self:
        """Another one of the same, to play in without disturbing this one's episode."""
        try:
            return deepcopy(self)
        except Exception:  # it holds what cannot be copied
            return type(self)(self.name, self._where)

    @property
    def inside(self) -> Any:
        """The environment itself, without what Gymnasium wraps it in."""
        return self._env.unwrapped

    def _numbered(self, kind: str, space: Any) -> Numbering:
        try:
            return Numbering(space)
        except Unsupported:
            raise BadInput(f"{self.which}: its {kind} space is {space}: supported are {SUPPORTED}") from None

    def _cells(self) -> CellNumbering | None:
        """Those of a box; None for another space. Raises BadInput for a box that has too many axes, or no bounds."""
        space = self._env.observation_space
        if not isinstance(space, spaces.Box):
            return None
        try:
            return CellNumbering(space)
        except Unsupported:
            wanted = f"wanted 1 to {MOST_AXES} axes with finite bounds"
            raise BadInput(f"{self.which}: its observation space is {' '.join(str(space).split())}: {wanted}") from None

    def _failed(self, what: str, why: str) -> WorkFailed:
        return WorkFailed(f"{self.which}: {what}: {why}")

    def begin(self, seed: int | None) -> int:
        """A new episode's first state; a seed begins all chance anew. Raises WorkFailed."""
        try:
            with quiet():
                observation, _ = self._env.reset(seed=seed)
            self._state = self.states.number(observation)
        except Exception as error:
            raise self._failed("it cannot be reset", said(error)) from error
        return self._state

    def step(self, action: int) -> Moved:
        """One step. Raises WorkFailed for what is no step: an error, a state outside the space, a reward that is no number."""
        try:
            observation, reward, terminated, truncated, info = self._env.step(self._choices[action])
            entered, worth, success = self.states.number(observation), float(reward), info.get("is_success")
        except Exception as error:
            raise self._failed(f"its step from {self._state} with action {action}", said(error)) from error
        if not isfinite(worth):
            raise self._failed(f"its step from {self._state} with action {action}", f"a reward of {worth}")
        self._state = entered
        return Moved(worth, entered, bool(terminated), bool(truncated), None if success is None else bool(success))

    def _placeable(self) -> Any:
        """A copy to draw any state with, when its state is kept where Gymnasium's own toy texts keep it; else None."""
        if len(self.states.sizes) != 1 or self.states.value(self.first) != getattr(self.inside, "s", None):
            return None
        try:
            return deepcopy(self.inside)
        except Exception:  # it is drawn where it is
            return None

    def picture(self, state: int) -> str:
        """The environment's own text for a state, with escape codes for colours; "" when it draws none, or not this one."""
        if not self._draws or (self._canvas is None and state != self._state):
            return ""
        canvas = self._canvas or self.inside
        try:
            if self._canvas is not None:
                canvas.s, canvas.lastaction = self.states.value(state), None
            with quiet():
                text = canvas.render()
        except Exception:  # a picture that fails is no reason to end a session
            return ""
        return text.strip("\n") if isinstance(text, str) else ""
