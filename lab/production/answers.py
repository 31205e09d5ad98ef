"""What is decided about trouble: pure functions of the state of a run and of what was seen, which return what to do.

`recovery` does it.
"""

from collections import Counter
from collections.abc import Container, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from lab.production.perception import Deviation
from lab.production.run_state import GivenUp, RunState
from lab.production.trouble import Trouble

MAX_TRIES = 3  # what fails is tried again from the state reached, at most twice
PAUSES_S = (0.0, 0.0, 30.0)  # before each try [s]: what disturbs may go away
MOST_TROUBLES = 40  # in one run; then it is stopped
LOST = ("part fallen", "part gone", "part out of reach")
FIXED = ("obstacle moved", "obstacle gone", "obstacle new", "station moved")


@dataclass(frozen=True)
class GoOn:
    """Go on from where everything is: nothing is wrong any more."""


@dataclass(frozen=True)
class Stop:
    """Stand still safely, and say why."""

    why: str


@dataclass(frozen=True)
class WaitForCamera:
    """Wait until the camera sees again."""


@dataclass(frozen=True)
class Believe:
    """Take into account what was seen, and order the rest of the work anew."""

    seen: tuple[Deviation, ...]

    @property
    def fixed(self) -> tuple[Deviation, ...]:
        """Those that change the scene, so that it has to be surveyed and learned again."""
        return tuple(one for one in self.seen if one.sort in FIXED)


@dataclass(frozen=True)
class TryAgain:
    """Try it again after a pause [s]."""

    pause_s: float


@dataclass(frozen=True)
class GiveUp:
    """Go on without the machine or the part, and say why."""

    why: str


Answer = GoOn | Stop | WaitForCamera | Believe | TryAgain | GiveUp


def answer_to(state: RunState, trouble: Trouble, seen: tuple[Deviation, ...], *, dark: bool) -> Answer:
    """What to do about trouble that has been counted in `state.tries`.

    seen: what is not as believed, now; dark: the camera sees nothing.
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
    """What to believe of a body that was seen where it was not expected, or was not seen at all."""

    FORGET = auto()  # what belonged to nobody is not there any more
    AVOID = auto()  # something that belongs to nobody takes up room
    LEAVE = auto()  # a part cannot be taken up
    TAKE_UP = auto()  # a part is taken up where it stands
    PUT_BACK = auto()  # a part is brought again to where it was moved from
    SURVEY = auto()  # the scene has changed: it is surveyed as a whole


def belief_in(state: RunState, seen: Deviation, *, blocked: bool = False, unfinished: bool = False) -> Belief:
    """What to believe of one body, in the order of the cases.

    blocked: a part stands too near to something to be taken up. unfinished: a machine, or the robot there, was not done with it.
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
    """Of parts that were given up and could be brought on, those for which there is room at the stations of their positions,
    those that stand there first; and the others, which come later."""
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
