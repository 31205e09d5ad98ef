"""The state of a job that is being carried out: all that changes, but for the scene itself, in one record."""

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

from lab.production.durations import TimedMove
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.run import Run, Windowless
from lab.sim.parts.kinds import Spot
from lab.sim.scene.scene import pallet_of
from lab.skills.skillset import CarriedPath

LOOK_S = 1.0  # between two looks at the table


@dataclass(frozen=True)
class Replanned:
    """A new order of the rest: when, why, by which method, of how many moves; gap: to what is proven, None: not known."""

    at_s: float
    why: str
    method: str
    moves: int
    gap: float | None


@dataclass
class UnderWay:
    """The times [s] of a move under way; leg: what of the carrying comes next; smooth: nothing had to be done twice.

    stayed_s: how long it has waited above its target.
    picked: when it reached its part, was served and took it up for the first time; None: not yet.
    """

    what: tuple[str, CarriedPath]
    start: str
    leave_s: float
    reach_s: float = 0.0
    served_s: float = 0.0
    pick_s: float = 0.0
    leg: int = 0
    stayed_s: float = 0.0
    smooth: bool = True
    picked: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class GivenUp:
    """How a part was when it was given up: its position on its routes, and the spot on which it was believed to stand.

    undone: a machine had begun it and was not done. astray: it could not be taken up, but may be later. finished_s: when it
    had reached the end of its route [s]; None: it had not.
    """

    position: int
    spot: Spot | None
    undone: bool
    astray: bool
    finished_s: float | None


class Strange(NamedTuple):
    """What belongs to nobody: the station that it closes, "" for none, and the spot on which nothing else fits."""

    closes: str = ""
    spot: Spot | None = None


@dataclass
class RunState:
    """A job under way, from its first move to the last. Parts are numbers, as in a sequence; bodies are names.

    The order:
    plan: where parts are and may go; its clock is the floor's, later_s later.
    sequence: the decisions still to come (see `Run`). replanned: each new order of them.

    The robot and what it has done:
    place: the station at whose approach the tool is; "": it is somewhere else.
    under_way: the move that was begun and not ended; None: none.
    moves, timed, deviations_m: what was carried out, how long it took, and how far off the camera saw parts [m].

    What is believed of the scene:
    spot_of: by body, a part's or its pallet's. taken: spots on which something stands that belongs to nobody.
    strange: what belongs to nobody, by body. looked_s: the last look [s]; right_s: the last at which all was as believed [s].

    The parts:
    finished: when a part reached the end of its route [s]. waiting: parts in a machine whose batch has not begun.
    brought: how each part was brought to where it stands, and how long it is worked on there [s].
    served: parts for which the robot's service is done. left_s: when parts that were set aside left their stations.
    to_put_back: parts that were moved from where they were brought.
    spoilt: why a part is, which is brought on all the same.

    Trouble:
    lost: why a part was given up. given_up: of these, those of which a position is known. left_lying: their names.
    out: why nothing is brought to a station any more. notes: what was tried again.
    tries: by part, station and skill. first: what was wrong first, by part.
    """

    cell: Cell
    plan: Windowless
    later_s: float
    place: str
    sequence: list[int] = field(default_factory=list)
    replanned: list[Replanned] = field(default_factory=list)
    under_way: UnderWay | None = None
    moves: list[Move] = field(default_factory=list)
    timed: list[TimedMove] = field(default_factory=list)
    deviations_m: list[float] = field(default_factory=list)
    spot_of: dict[str, Spot] = field(default_factory=dict)
    taken: set[Spot] = field(default_factory=set)
    strange: dict[str, Strange] = field(default_factory=dict)
    looked_s: float = -LOOK_S
    right_s: float = -LOOK_S
    finished: dict[int, float] = field(default_factory=dict)
    waiting: set[str] = field(default_factory=set)
    brought: dict[str, tuple[CarriedPath, float]] = field(default_factory=dict)
    served: set[str] = field(default_factory=set)
    left_s: dict[str, float] = field(default_factory=dict)
    to_put_back: list[int] = field(default_factory=list)
    spoilt: dict[int, str] = field(default_factory=dict)
    lost: dict[int, str] = field(default_factory=dict)
    given_up: dict[int, GivenUp] = field(default_factory=dict)
    left_lying: set[str] = field(default_factory=set)
    out: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    tries: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    first: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, cell: Cell, now_s: float = 0.0) -> "RunState":
        """Before the first move, which may begin now, by the floor's clock [s]; where bodies stand is not known yet."""
        run = Run(cell)
        return cls(cell, Windowless(cell, run.times, run), now_s - run.now_s, cell.robot_start)

    def go_by(self, run: Run, now_s: float) -> None:
        """From now on, by the floor's clock [s], a run is the plan: it says where parts are and may go."""
        self.plan, self.later_s = Windowless(run.cell, run.times, run), now_s - run.now_s

    def name(self, part: int) -> str:
        """What a part is called."""
        return self.cell.part_name(part)

    def part_of(self, body: str) -> int | None:
        """The number of the part that a body is, or whose pallet; None for what belongs to nobody."""
        for part in range(1, self.cell.parts + 1):
            if body in (self.name(part), pallet_of(self.name(part))):
                return part
        return None

    def failure(self) -> str | None:
        """Why not all parts were made; None when they were."""
        why = self.spoilt | self.lost
        return "; ".join(dict.fromkeys(why[part] for part in sorted(why))) or None

    def to_put_right(self) -> str:
        """Why parts were given up that a person may yet help on; "" where there are none."""
        return "; ".join(dict.fromkeys(self.lost[part] for part in sorted(self.given_up)))
