"""What came of a run in physics, and, where faults struck in it, whether it noticed them and told the truth."""

from dataclasses import dataclass
from typing import Any, Literal

from lab.export.program import Program
from lab.production.durations import TimedMove
from lab.production.faults.fault import Happened
from lab.sequencing.cell.schedule import Schedule
from lab.teaching.events import TroubleMet

Verdict = Literal["delivered", "stopped", "wrong"]


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which parts were delivered, retries, and why not all were (None: all).

    said: the parts that the run itself holds for delivered. timed: how long each move took in which nothing had to be
    tried again. skipped_s: of sim_s, the time that passed without physics, while the robot waited and nothing moved.
    interrupted: by Ctrl-C; all else is what came of it until then. happened: the faults that struck. troubles: what was
    noticed, and what was done about it. program: what the robot carried out.
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
    troubles: tuple[TroubleMet, ...] = ()
    program: Program | None = None

    def verdict(self, parts: int) -> Verdict:
        """Whether all parts were delivered, or the run stopped and told why, or it was wrong in what it told.

        Wrong: a part that it holds for delivered is not, or a reason that is not that of a fault that struck.
        """
        if set(self.said) - set(self.delivered):
            return "wrong"
        if self.failure is None:
            return "delivered" if len(self.delivered) == parts else "wrong"
        reasons = [self.failure] if self.happened else []
        return "stopped" if all(any(one.explains(why) for one in self.happened) for why in reasons) else "wrong"

    def fault_rows(self) -> list[dict[str, Any]]:
        """Of each fault: what it was, when it struck, what was noticed of it, and what was done."""
        rows = []
        for fault in self.happened:
            own = [
                one
                for one in self.troubles
                if one.at_s >= fault.at_s and fault.explains(one.what, one.part, one.station)
            ]
            first = own[0] if own else None
            rows.append(
                {
                    "what": fault.what,
                    "at_s": fault.at_s,
                    "noticed": None if first is None else first.what,
                    "noticed_s": None if first is None else first.at_s,
                    "answer": None if first is None else first.answer,
                    "true_reason": fault.words,
                }
            )
        return rows
