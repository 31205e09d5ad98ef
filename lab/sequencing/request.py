"""What SRL shows when it asks which part to move next."""

from dataclasses import dataclass

from lab.learning.requests import Request
from lab.sequencing.simulate.run import Run


@dataclass(frozen=True, slots=True, kw_only=True)
class SequenceRequest(Request):
    """A request about which part to move next; the means of its improvement are costs. run: where the work stands; made: the
    decisions of the episode until now.
    """

    run: Run
    made: tuple[int, ...] = ()


def state_of(run: Run) -> int:
    """A number for where robot and parts are, whatever the time; as long as it takes."""
    number = run.robot
    for location in run.locations:
        number = number * len(run.cell.positions) + location
    return number
