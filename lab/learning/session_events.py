"""What happens in a session, as records: what the learner tells whoever teaches, watches or keeps a journal."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["", "better", "best", "misled"]  # of a gate on an episode that was open for advice; "": none
# why there is no more advice
Ending = Literal["converged", "advisor left", "budget spent", "misled by what was remembered"]


@dataclass(frozen=True)
class Improvement:
    """The last K episodes beside the K before them: rate = (previous - current) / previous (thesis eq. 6.1)."""

    rate: float
    current_mean: float
    previous_mean: float


@dataclass(frozen=True)
class EpisodeEnded:
    """An episode is over: `steps` is max_steps + 1 when it failed, of an order its cost; the rate is None before 2K episodes.

    verdict: "better" than those before it, no better but the "best" so far, or "misled"; "" for a gate that gives none.
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
    """The learner asks for the first time in this episode; means of step counts over K episodes, None before 2K."""

    episode: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None

    @classmethod
    def of(cls, episode: int, known: Improvement | None) -> "AdviceRequested":
        """From the improvement, None before 2K episodes."""
        means = (None, None, None) if known is None else (known.rate, known.current_mean, known.previous_mean)
        return cls(episode, *means)


@dataclass(frozen=True)
class AdviceRejected:
    """Misled more than `omega` times, the learner asks no more; `steps` was not better than `mean_before`."""

    episode: int
    misleads: int
    omega: int
    steps: int | float
    mean_before: float


@dataclass(frozen=True)
class AdviceEnded:
    """No more advice in this session, and why."""

    episode: int
    reason: Ending


@dataclass(frozen=True)
class AdviceGiven:
    """What came of one question: the state, the advised action (None: nothing was said), the learner's own choice."""

    episode: int
    step: int
    state: int
    action: int | None
    own: int


@dataclass(frozen=True)
class AdviceRemembered:
    """In the episode that is over so many steps were made from memory, without asking: practice of a known way."""

    episode: int
    steps: int


@dataclass(frozen=True)
class AdvisorsDisagreed:
    """Several advisors said different things: (name, action) of each that spoke, and the action that was followed."""

    episode: int
    step: int
    state: int
    said: tuple[tuple[str, int], ...]
    followed: int


@dataclass(frozen=True)
class _Turned:
    """An advisor is heard no more, or again; trust is the share of its advice that is expected to help."""

    episode: int
    advisor: str
    trust: float
    why: str


class AdvisorDropped(_Turned):
    """One of several advisors is heard no more."""


class AdvisorReadmitted(_Turned):
    """A dropped advisor is heard again, because of what it said when it was asked now and then."""


Event = (
    EpisodeEnded
    | AdviceRequested
    | AdviceRejected
    | AdviceEnded
    | AdviceGiven
    | AdviceRemembered
    | AdvisorsDisagreed
    | AdvisorDropped
    | AdvisorReadmitted
)
