"""The outcome of a run in physics, and the verdict on its reports of faults."""

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
    """The outcome of a run: the measured schedule, the delivered parts, retries, and why not all were delivered (None: all were).

    timed: the duration of each move without retries. skipped_s: of sim_s, the time that passed
    without physics, while the robot waited and nothing moved. interrupted: by Ctrl-C; all else is the outcome until then.
    happened: the faults that struck. heard: the run's events. program: the robot's program. audit: the audit of the
    frames (see `lab.audit`), None before it; `delivered` are the parts that pass it, and its first finding is the failure
    if there is no other.
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
        """The verdict on the run, with these names of parts (see `truth.verdict`)."""
        lacking = [name for part, name in enumerate(names, start=1) if part not in self.delivered]
        return verdict(self.happened, self.heard, self.failure, lacking)
