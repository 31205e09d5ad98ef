"""The base of all faults: when they strike, their effect in physics, its duration, and the truth about it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lab.production.faults.where import Whereabouts, parts_of, whereabouts
from lab.production.floor import Floor
from lab.sim.scene.scene import Scene
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task import Order, Task

GROUND_M = -0.75  # [m] below the table top
NEVER = float("inf")


@dataclass(frozen=True)
class Happened:
    """A fault that struck at at_s [s] of the run: the affected part, station or obstacle ("": none), and the truth in words.

    undone: the part was taken out of a machine that had not finished it.
    """

    what: str
    words: str
    at_s: float
    part: str = ""
    station: str = ""
    obstacle: str = ""
    undone: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of which a true reason contains at least one."""
        said = "camera" if self.what == "camera blind" else ""
        return tuple(name for name in (self.part, self.station, self.obstacle, said) if name)

    def explains(self, reason: str, part: str = "", station: str = "") -> bool:
        """Whether a reason about a part or a station refers to the effect of this fault."""
        return any(name in reason or name in (part, station) for name in self.names)


class Fault:
    """The base class of a fault; a new kind is a subclass and a row in `FAULTS`."""

    what: ClassVar[str]  # its name in task files
    help: ClassVar[str]  # its effect, in one line

    def __init__(self, fields: FaultFields, number: int) -> None:
        """number: the number of the fault in its run, from 1, with which the bodies that it adds are named."""
        self.fields, self.number = fields, number
        self.until_s = NEVER  # the time at which `end` is due, after it has struck

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """The fields of a drawn fault of this kind, without its time; None if it cannot strike in this task."""
        return {}

    def prepare(self, scene: Scene) -> None:
        """Adds the fault's bodies to the scene out of sight, because bodies cannot be added later."""

    def strikes(self, floor: Floor) -> Happened | None:
        """Lets the fault strike and returns what happened; returns None and changes nothing if it cannot strike now."""
        raise NotImplementedError

    def end(self, floor: Floor) -> None:
        """Ends an effect of limited duration."""

    def parts(self, floor: Floor, *how: str) -> list[tuple[str, Whereabouts]]:
        """The parts that the fault may strike and that are in one of these states now, with their whereabouts."""
        own = self.fields.part
        places = [(name, whereabouts(floor, name)) for name in parts_of(floor) if own in (None, name)]
        return [(name, at) for name, at in places if at.how in how]


def out_of_sight(number: int) -> tuple[float, float]:
    """The place x, y [m] on the ground below the table where a fault's bodies wait."""
    return (-0.45 + 0.3 * (number % 6), -0.9 + 0.3 * (number // 6 % 6))
