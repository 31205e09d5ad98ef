"""What came of a run in physics, and, where faults struck in it, whether it noticed them and told the truth."""

from dataclasses import dataclass

from lab.production.durations import TimedMove
from lab.production.faults.fault import Happened
from lab.production.faults.truth import Parts, Verdict, verdict
from lab.sequencing.cell.schedule import Schedule
from lab.tasks.task import Order, part_name
from lab.teaching.events import MachineBegan, TroubleMet


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which parts were delivered, retries, and why not all were (None: all).

    said: the parts that the run itself holds for delivered. timed: how long each move took in which nothing had to be
    tried again. skipped_s: of sim_s, the time that passed without physics, while the robot waited and nothing moved.
    interrupted: by Ctrl-C; all else is what came of it until then. happened: the faults that struck. heard: what was
    noticed and done about it, and when machines began.
    """

    schedule: Schedule
    said: tuple[int, ...]
    delivered: tuple[int, ...]
    dropped: tuple[int, ...]
    retries: tuple[str, ...]
    failure: str | None
    sim_s: float
    camera_deviations_m: tuple[float, ...]
    timed: tuple[TimedMove, ...] = ()
    skipped_s: float = 0.0
    interrupted: bool = False
    happened: tuple[Happened, ...] = ()
    heard: tuple[TroubleMet | MachineBegan, ...] = ()

    def verdict(self, order: Order) -> Verdict:
        """Whether all parts of the order were delivered, or the run stopped and told why, or was wrong in what it told."""
        names = [part_name(order, number) for number in range(1, len(order) + 1)]
        told, there = ([names[part - 1] for part in parts] for parts in (self.said, self.delivered))
        return verdict(self.happened, self.heard, self.failure, Parts(names, told, there))
