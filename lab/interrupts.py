"""Functions that Ctrl-C does not interrupt; KeyboardInterrupt is raised after they have returned."""

TYPE_CHECKING = False  # typing.TYPE_CHECKING without its import, which would slow the start of the command
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType
    from typing import TypeVar

    Function = TypeVar("Function", bound=Callable[..., object])

UNINTERRUPTED: "set[CodeType]" = set()  # the code objects of these functions


def uninterrupted(function: "Function") -> "Function":
    """The function itself, marked so that `lab.cli.interrupt` raises KeyboardInterrupt only after it has returned.

    It is meant for functions whose results would otherwise be lost.
    """
    UNINTERRUPTED.add(function.__code__)
    return function
