"""The tables of families (learners, selections, gates): a name, what it stands for, and one line of help."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Made = TypeVar("Made")


@dataclass(frozen=True)
class Member(Generic[Made]):
    """A row of a family's table.

    make: the member, or what makes it; help: what it is, in one line, as listings show it; compiled: its form in the
    kernel, None where it has none and runs in the session alone.
    """

    make: Made
    help: str
    compiled: Any = None
