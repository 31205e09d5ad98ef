"""The events of a session, as records for teachers, displays and journals."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["", "better", "best", "misled"]  # on an episode that was open for advice; "": none
# Why advice has ended.
Ending = Literal["converged", "advisor left", "budget spent", "misled by what was remembered"]


@dataclass(frozen=True)
class Improvement:
    """The means of the last K episodes and of the K before: rate = (previous - current) / previous (thesis eq. 6.1)."""

    rate: float
    current_mean: float
    previous_mean: float


@dataclass(frozen=True)
class EpisodeEnded:
    """An episode has ended.

    steps: max_steps + 1 if it failed; for an order of transfers, its cost; without a goal, the shortfall of its return (see
    `lab.learning.session`). guided: whether any step was helped.
    improvement_rate: None before 2K episodes.
    verdict: "better" than the mean before it; "best", as good as the best so far; "misled"; "" if the gate gives none.
    """

    episode: int
    steps: int | float
    guided: bool
    helped_steps: int
    improvement_rate: float | None
    reached: bool
    verdict: Verdict = ""


@dataclass(frozen=True)
class AdviceRequested:
    """The learner asks for the first time in an episode; the rate and both means over K episodes are None before 2K."""

    episode: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None

    @classmethod
    def of(cls, episode: int, known: Improvement | None) -> "AdviceRequested":
        """The event with the values of an improvement, which is None before 2K episodes."""
        means = (None, None, None) if known is None else (known.rate, known.current_mean, known.previous_mean)
        return cls(episode, *means)


@dataclass(frozen=True)
class AdviceRejected:
    """The learner rejects the advisor: more than `omega` misleads, the last with `steps` no better than `mean_before`."""

    episode: int
    misleads: int
    omega: int
    steps: int | float
    mean_before: float


@dataclass(frozen=True)
class AdviceEnded:
    """Advice has ended for this session, and why."""

    episode: int
    reason: Ending


@dataclass(frozen=True)
class AdviceGiven:
    """The answer to one question: the advised action (None if there was no answer) and the learner's own choice."""

    episode: int
    step: int
    state: int
    action: int | None
    own: int


@dataclass(frozen=True)
class MoveJudged:
    """A judgement of moves: praise if `value` is above 0, blame if it is below.

    episode, step: of the question; state, action: of the last of the judged moves; moves: their number.
    """

    episode: int
    step: int
    state: int
    action: int
    value: int
    moves: int


@dataclass(frozen=True)
class AdviceRemembered:
    """In the episode that has ended, this many steps were practice of a path from memory, without asking."""

    episode: int
    steps: int


@dataclass(frozen=True)
class AdvisorsDisagreed:
    """Several advisors gave different answers: (name, action) of each, and the action that was carried out."""

    episode: int
    step: int
    state: int
    said: tuple[tuple[str, int], ...]
    followed: int


@dataclass(frozen=True)
class _Turned:
    """An advisor was dropped or readmitted; trust: the expected share of good advice."""

    episode: int
    advisor: str
    trust: float
    why: str


class AdvisorDropped(_Turned):
    """One of several advisors is no longer followed."""


class AdvisorReadmitted(_Turned):
    """A dropped advisor is followed again, because its answers to occasional questions were good."""


Event = (
    EpisodeEnded
    | AdviceRequested
    | AdviceRejected
    | AdviceEnded
    | AdviceGiven
    | MoveJudged
    | AdviceRemembered
    | AdvisorsDisagreed
    | AdvisorDropped
    | AdvisorReadmitted
)
