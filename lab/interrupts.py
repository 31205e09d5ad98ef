"""Functions that Ctrl-C does not interrupt: it is heard when they have ended."""

TYPE_CHECKING = False  # as typing's, which the command's start does without
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType
    from typing import TypeVar

    Function = TypeVar("Function", bound=Callable[..., object])

UNINTERRUPTED: "set[CodeType]" = set()  # what such functions run


def uninterrupted(function: "Function") -> "Function":
    """The function, which ends before `lab.cli.interrupt` raises KeyboardInterrupt: one that hands out what was found."""
    UNINTERRUPTED.add(function.__code__)
    return function
