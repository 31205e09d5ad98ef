"""What came of a run in physics, and, where faults struck in it, whether it noticed them and told the truth."""

from collections.abc import Sequence
from dataclasses import dataclass

from lab.audit.audit import Audit
from lab.export.program import Program
from lab.production.durations import TimedMove
from lab.production.faults.fault import Happened
from lab.production.faults.truth import Verdict, verdict
from lab.production.run_state import Replanned
from lab.sequencing.cell.schedule import Schedule
from lab.teaching.events import Event


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which parts were delivered, retries, and why not all were (None: all).

    timed: the duration of each move in which nothing had to be tried again. skipped_s: of sim_s, the time that passed
    without physics, while the robot waited and nothing moved. interrupted: by Ctrl-C; all else is what came of it until then.
    happened: the faults that struck. heard: what the run told. program: what the robot carried out. audit: what the frames
    show (see `lab.audit`), None: nobody has looked; `delivered` are the parts that pass it, and what it finds is the failure
    where there is no other.
    """

    schedule: Schedule
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
    heard: tuple[Event, ...] = ()
    program: Program | None = None
    audit: Audit | None = None
    replanned: tuple[Replanned, ...] = ()

    def verdict(self, names: Sequence[str]) -> Verdict:
        """Whether all parts, of these names, were delivered, or the run stopped and told the truth (see `truth.verdict`)."""
        lacking = [name for part, name in enumerate(names, start=1) if part not in self.delivered]
        return verdict(self.happened, self.heard, self.failure, lacking)
