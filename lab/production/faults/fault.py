"""What all faults share: when they strike, what they do in physics, how long that lasts, and what is then true."""

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
    """A fault that struck: at_s [s] of the run, what it was about ("": nothing of that sort), and the truth in words.

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
        """What a true reason names, one of them at least."""
        said = "camera" if self.what == "camera blind" else ""
        return tuple(name for name in (self.part, self.station, self.obstacle, said) if name)

    def explains(self, reason: str, part: str = "", station: str = "") -> bool:
        """Whether a reason that was given, about a part or a station, is about what this fault did."""
        return any(name in reason or name in (part, station) for name in self.names)


class Fault:
    """One fault of a run; a new kind is a class of these and a row in `FAULTS`."""

    what: ClassVar[str]  # its name in task files
    help: ClassVar[str]  # what happens, in one line of plain words

    def __init__(self, fields: FaultFields, number: int) -> None:
        """number: from 1, which fault of its run it is; it names what the fault brings along."""
        self.fields, self.number = fields, number
        self.until_s = NEVER  # when `end` is due, once it has struck

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """The fields of a drawn fault of this kind, without its time; None where a task has nothing that it could strike."""
        return {}

    def prepare(self, scene: Scene) -> None:
        """Put out of sight what the fault will bring into the scene: bodies cannot come later."""

    def strikes(self, floor: Floor) -> Happened | None:
        """Let the fault happen; returns what happened, None, with nothing changed, when it cannot happen now."""
        raise NotImplementedError

    def end(self, floor: Floor) -> None:
        """Undo what was to last only for a while."""

    def parts(self, floor: Floor, *how: str) -> list[tuple[str, Whereabouts]]:
        """The parts that the fault may strike and that are in one of these ways now, with where they are."""
        own = self.fields.part
        found = [(name, whereabouts(floor, name)) for name in parts_of(floor) if own in (None, name)]
        return [(name, at) for name, at in found if at.how in how]


def out_of_sight(number: int) -> tuple[float, float]:
    """Where on the ground below the table the things of a fault wait, x, y [m]."""
    return (-0.45 + 0.3 * (number % 6), -0.9 + 0.3 * (number // 6 % 6))
