"""Methods whose results are made once an object, and go with it to another process."""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

Made = dict[tuple[Hashable, ...], Any]  # by the method's name and its arguments
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class Holder(Protocol):
    """What keeps the results of its own methods."""

    made: Made


Self = TypeVar("Self", bound=Holder)


def once(
    method: Callable[Concatenate[Self, Arguments], Result],
) -> Callable[Concatenate[Self, Arguments], Result]:
    """The method, whose result is kept in the object's `made` for each set of positional arguments.

    Unlike `functools.cache` it holds no object alive, and an object with results can be pickled.
    """

    def made_once(self: Self, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if kwargs:
            raise TypeError(f"{method.__name__} takes its arguments by their places")
        key = (method.__name__, *args)
        if key not in self.made:
            self.made[key] = method(self, *args, **kwargs)
        result: Result = self.made[key]
        return result

    return wraps(method)(made_once)
