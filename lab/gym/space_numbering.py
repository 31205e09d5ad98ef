"""The values of Gymnasium's discrete spaces, numbered from 0, so that they can stand for the rows and columns of a table."""

from collections.abc import Iterator
from math import prod
from typing import Any

import numpy as np
from gymnasium import spaces

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
