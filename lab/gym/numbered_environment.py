"""A running Gymnasium environment with numbered states and actions, the lab's errors, and its own pictures of states."""

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
MOST_AXES, CELLS = (
    4,
    {1: 64, 2: 64, 3: 32, 4: 24},
)  # of a box: the most axes, and the cells along each axis by the number of axes

PICTURES = (
    "no table holds pictures: wanted a symbolic view, in which the state is what the picture shows, "
    "as gym:MiniGrid-DoorKey-5x5-v0 has"
)

Digit = tuple[int, int]  # the number of its values, and the first value


class Unsupported(Exception):
    """Raised for a space that cannot be numbered."""


class Numbering:
    """The numbering of the values of a space by digits, of which the last varies fastest; a Discrete space has one.

    sizes: the number of values of each digit; count: of the space. Raises Unsupported unless the space is discrete.
    """

    def __init__(self, space: spaces.Space[Any]):
        self._space = space
        digits = list(_digits(space))
        self.sizes = tuple(size for size, _ in digits)
        self.count = prod(self.sizes)
        self._firsts = tuple(first for _, first in digits)

    def number(self, value: Any) -> int:
        """The number of a value. Raises ValueError if it is not in the space."""
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
    """The numbering of the cells of a box of one to four axes between its bounds.

    Raises Unsupported for other spaces, for more axes, and for bounds that are not finite.
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
        """The number of the cell that contains a point. Raises ValueError if it is no point of the box."""
        point = np.asarray(value, np.float64)
        if point.shape != (len(self.sizes),) or not np.isfinite(point).all():
            raise ValueError(f"{value!r} is no point with {len(self.sizes)} finite numbers")
        return self._bounds.number(point.tolist())

    def value(self, number: int) -> Any:
        """The centre of a cell."""
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


def _all_parts(space: Any) -> Iterator[Any]:
    """A space, or the spaces that a Tuple or Dict consists of."""
    if isinstance(space, spaces.Tuple | spaces.Dict):
        for part in _parts(space):
            yield from _all_parts(part)
    else:
        yield space


def _is_picture(space: Any) -> bool:
    return isinstance(space, spaces.Box) and len(space.shape) > 1


def _values(space: spaces.Space[Any], value: Any) -> Iterator[Any]:
    """The digits of a value."""
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
    """The value that the next digits compose."""
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


# ---- the environment ------------------------------------------------------------------------------------------------


MAX_ENTRIES = 1_000_000  # states x actions


class NumberedStep(NamedTuple):
    """The outcome of a step; success: whether the environment reports a goal, None if it reports nothing."""

    reward: float
    state: int
    terminated: bool
    truncated: bool
    success: bool | None


class NumberedEnvironment:
    """A running environment and, if its state can be set, a copy for drawing any state.

    states, actions: the numberings of its spaces; first: a state in which it begins; limit: the most steps of an episode, None
    without a limit; threshold: the mean return that counts as solved, None if unknown for these keywords.
    Raises BadInput if it cannot be made or reset, and for spaces without a table.
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
        """The limit that the environment applies itself, as the lab's own do; None if there is none."""
        limit = getattr(self.inside, "max_episode_steps", None)
        return limit if isinstance(limit, int) and limit > 0 else None

    def again(self) -> Self:
        """A copy, whose episodes do not affect this one's."""
        try:
            return deepcopy(self)
        except Exception:  # an attribute cannot be copied
            return type(self)(self.name, self._where)

    @property
    def inside(self) -> Any:
        """The environment without Gymnasium's wrappers."""
        return self._env.unwrapped

    def _numbered(self, kind: str, space: Any) -> Numbering:
        try:
            return Numbering(space)
        except Unsupported:
            what = f"its {kind} space is {' '.join(str(space).split())}"
            if kind == "observation" and any(map(_is_picture, _all_parts(space))):
                raise BadInput(f"{self.which}: {what}: {PICTURES}") from None
            raise BadInput(f"{self.which}: {what}: supported are {SUPPORTED}") from None

    def _cells(self) -> CellNumbering | None:
        """The numbering of a box by cells, None for other spaces. Raises BadInput if the box has too many axes, or no bounds."""
        space = self._env.observation_space
        if not isinstance(space, spaces.Box):
            return None
        try:
            return CellNumbering(space)
        except Unsupported:
            if _is_picture(space):
                what = " ".join(str(space).split())
                raise BadInput(f"{self.which}: its observation space is {what}: {PICTURES}") from None
            wanted = f"wanted 1 to {MOST_AXES} axes with finite bounds"
            raise BadInput(f"{self.which}: its observation space is {' '.join(str(space).split())}: {wanted}") from None

    def _failed(self, what: str, why: str) -> WorkFailed:
        return WorkFailed(f"{self.which}: {what}: {why}")

    def begin(self, seed: int | None) -> int:
        """The first state of a new episode; a seed resets the generator. Raises WorkFailed."""
        try:
            with quiet():
                observation, _ = self._env.reset(seed=seed)
            self._state = self.states.number(observation)
        except Exception as error:
            raise self._failed("it cannot be reset", said(error)) from error
        return self._state

    def step(self, action: int) -> NumberedStep:
        """The outcome of a step. Raises WorkFailed on an error, and for states or rewards that are not allowed."""
        try:
            observation, reward, terminated, truncated, info = self._env.step(self._choices[action])
            entered, worth, success = self.states.number(observation), float(reward), info.get("is_success")
        except Exception as error:
            raise self._failed(f"its step from {self._state} with action {action}", said(error)) from error
        if not isfinite(worth):
            raise self._failed(f"its step from {self._state} with action {action}", f"a reward of {worth}")
        self._state = entered
        return NumberedStep(
            worth, entered, bool(terminated), bool(truncated), None if success is None else bool(success)
        )

    def _placeable(self) -> Any:
        """A copy for drawing any state; None unless the state is the attribute `s`, as in Gymnasium's toy-text environments."""
        if len(self.states.sizes) != 1 or self.states.value(self.first) != getattr(self.inside, "s", None):
            return None
        try:
            return deepcopy(self.inside)
        except Exception:  # only the current state is drawn then
            return None

    def picture(self, state: int) -> str:
        """The environment's text for a state, with escape codes for colours; "" if it cannot draw this state."""
        if not self._draws or (self._canvas is None and state != self._state):
            return ""
        canvas = self._canvas or self.inside
        try:
            if self._canvas is not None:
                canvas.s, canvas.lastaction = self.states.value(state), None
            with quiet():
                text = canvas.render()
        except Exception:  # a failed picture does not end a session
            return ""
        return text.strip("\n") if isinstance(text, str) else ""
