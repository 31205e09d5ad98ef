"""The row type of the tables of learners, selections and gates."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Made = TypeVar("Made")


@dataclass(frozen=True)
class Member(Generic[Made]):
    """A row of a family's table.

    make: the class or function; help: one line, as listings show it; compiled: its form in the kernel, None if it runs in the
    session only.
    """

    make: Made
    help: str
    compiled: Any = None
