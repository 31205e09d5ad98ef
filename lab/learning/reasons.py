"""Why a learner asks: one record a reason, with its figures; `str` words it, as it follows "it asks because".

A gate that is added brings its own reason along: a `Reason` with figures as fields and words in `__str__`.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Reason:
    """Why the last question was asked; this one: nothing decides it."""

    def __str__(self) -> str:
        return "it asks about every step"


@dataclass(frozen=True, slots=True)
class TooSlow(Reason):
    """The improvement rate is below Lambda."""

    rate: float
    threshold: float

    def __str__(self) -> str:
        return f"its improvement is {self.rate:+.1%}, below {self.threshold:.0%}"


@dataclass(frozen=True, slots=True)
class TooLong(Reason):
    """The mean of the last K episodes is above a constant."""

    window: int
    mean: float
    enough: float

    def __str__(self) -> str:
        return f"the last {self.window} episodes took {self.mean:.1f} steps, more than {self.enough:g}"


@dataclass(frozen=True, slots=True)
class ValuesAlike(Reason):
    """The values of the state span at most Psi."""

    width: float
    psi: float

    def __str__(self) -> str:
        return f"the values here span {self.width:.2f}, at most {self.psi:g}"


@dataclass(frozen=True, slots=True)
class ValuesApart(Reason):
    """The values of the state span at least Psi."""

    width: float
    psi: float

    def __str__(self) -> str:
        return f"the values here span {self.width:.2f}, at least {self.psi:g}"


@dataclass(frozen=True, slots=True)
class TablesDiffer(Reason):
    """The tables of an ensemble disagree about the state."""

    tables: int
    spread: float
    least: float

    def __str__(self) -> str:
        return f"its {self.tables} tables differ by {self.spread:.2f} here, at least {self.least:g}"


@dataclass(frozen=True, slots=True)
class ByChance(Reason):
    """Chance says so, at a rate."""

    rate: float

    def __str__(self) -> str:
        return f"it asks about {self.rate:.0%} of the steps"


@dataclass(frozen=True, slots=True)
class Both(Reason):
    """Two reasons that hold at a time."""

    first: Reason
    second: Reason

    def __str__(self) -> str:
        return f"{self.first}, and {self.second}"


@dataclass(frozen=True, slots=True)
class ToldSeldom(Reason):
    """So many answers were given in this state before."""

    answers: int

    def __str__(self) -> str:
        return f"it was told {self.answers} times here"


@dataclass(frozen=True, slots=True)
class Trusted(Reason):
    """Advised episodes did better than going alone; rate: how many of the recent ones reached the goal."""

    rate: float

    def __str__(self) -> str:
        return (
            f"it knows nothing to hold on to here, and {self.rate:.0%} of the recent advised episodes reached the goal"
        )
