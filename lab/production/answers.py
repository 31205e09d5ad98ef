"""Decisions about trouble: pure functions of a run's state and of the perceived deviations, which return an answer.

`recovery` carries the answers out.
"""

from collections import Counter
from collections.abc import Container, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from lab.production.perception import Deviation
from lab.production.run_state import GivenUp, RunState
from lab.production.trouble import Trouble

MAX_TRIES = 3  # most tries of a skill, each from the reached state
PAUSES_S = (0.0, 0.0, 30.0)  # pause before each try [s], in which a disturbance may end
MOST_TROUBLES = 40  # most troubles in one run, after which it is stopped
LOST = ("part fallen", "part gone", "part out of reach")
FIXED = ("obstacle moved", "obstacle gone", "obstacle new", "station moved")


@dataclass(frozen=True)
class GoOn:
    """Continue from the present state: nothing is wrong any more."""


@dataclass(frozen=True)
class Stop:
    """Stop the run safely, for a reason."""

    why: str


@dataclass(frozen=True)
class WaitForCamera:
    """Wait until the camera is uncovered."""


@dataclass(frozen=True)
class Believe:
    """Update the believed scene by the perceived deviations, and replan the remaining work."""

    seen: tuple[Deviation, ...]

    @property
    def fixed(self) -> tuple[Deviation, ...]:
        """The deviations of fixed bodies, after which the scene is surveyed and learned again."""
        return tuple(deviation for deviation in self.seen if deviation.sort in FIXED)


@dataclass(frozen=True)
class TryAgain:
    """Retry after a pause [s]."""

    pause_s: float


@dataclass(frozen=True)
class GiveUp:
    """Continue without the machine or the part, for a reason."""

    why: str


Answer = GoOn | Stop | WaitForCamera | Believe | TryAgain | GiveUp


def answer_to(state: RunState, trouble: Trouble, seen: tuple[Deviation, ...], *, dark: bool) -> Answer:
    """The answer to trouble that has been counted in `state.tries`.

    seen: the present deviations; dark: whether the camera is covered.
    """
    if trouble.kind == "held":
        return GoOn()
    if state.tries.total() >= MOST_TROUBLES:
        return Stop(f"{trouble} (after {MOST_TROUBLES} troubles)")
    if dark:
        return WaitForCamera()
    if seen:
        return Believe(seen)
    if trouble.kind == "seen":
        return GoOn()
    tries = state.tries[trouble.key]
    if trouble.kind == "final":
        return GiveUp(trouble.what)
    if tries >= MAX_TRIES:
        return GiveUp(f"{state.first.get(trouble.part, trouble.what)} (tried {tries} times)")
    return TryAgain(PAUSES_S[tries])


class Belief(Enum):
    """A new belief about a body that was seen at an unexpected place, or was not seen."""

    FORGET = auto()  # a strange body is no longer there
    AVOID = auto()  # a strange body occupies a spot
    LEAVE = auto()  # the part cannot be taken up
    TAKE_UP = auto()  # the part is taken up where it stands
    PUT_BACK = auto()  # the part is brought back to where it was moved from
    SURVEY = auto()  # a fixed body has moved: the whole scene is surveyed again


def belief_in(state: RunState, seen: Deviation, *, blocked: bool = False, unfinished: bool = False) -> Belief:
    """The new belief about one body, by the first case that applies.

    blocked: whether the part is too near to another body to be taken up. unfinished: whether its machine or service is not done.
    """
    part = state.part_of(seen.name)
    if seen.name in state.strange:
        return Belief.FORGET
    if seen.sort == "strange part":
        return Belief.AVOID
    if part is None or seen.sort not in (*LOST, "part moved"):
        return Belief.SURVEY
    if seen.sort in LOST or blocked:
        return Belief.LEAVE
    return Belief.PUT_BACK if unfinished or seen.name in state.waiting or part in state.finished else Belief.TAKE_UP


def with_room(
    state: RunState, found: Mapping[int, GivenUp], standing: Container[int]
) -> tuple[dict[int, GivenUp], dict[int, GivenUp]]:
    """Of given-up parts that could be brought on, those with room at the stations of their positions, in which those that
    already stand there come first; and the others, which come later."""
    now, later = dict[int, GivenUp](), dict[int, GivenUp]()
    places = [place for part, place in enumerate(state.plan.locations, 1) if part not in state.lost]
    taken = Counter(station for place in places for station in state.plan.cell.positions[place].holds)
    for part in sorted(found, key=lambda part: (part not in standing, part)):
        holds = state.cell.laid_out[found[part].position].holds
        if all(taken[station] < state.cell.capacities[station] for station in holds):
            taken.update(holds)
            now[part] = found[part]
        else:
            later[part] = found[part]
    return now, later
