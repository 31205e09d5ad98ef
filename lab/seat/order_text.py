"""A question on the order of transfers in words and numbers, for the terminal and for the page."""

from dataclasses import dataclass

from lab.errors import counted
from lab.sequencing.cell.routes import part_of
from lab.sequencing.search import SequenceRequest


@dataclass(frozen=True)
class OrderMove:
    """An allowed next move, in words; wait_s: the time until it can begin [s]."""

    decision: int
    name: str
    origin: str
    target: str
    wait_s: float

    @property
    def ready(self) -> str:
        """The time until it can begin: "now" or "60 s"."""
        return "now" if self.wait_s == 0.0 else f"{self.wait_s:.0f} s"

    def __str__(self) -> str:
        when = "ready now" if self.wait_s == 0.0 else f"ready in {self.ready}"
        return f"Move {self.decision}: {self.name} from {self.origin} to {self.target}, {when}"


def move_of(request: SequenceRequest, decision: int) -> OrderMove:
    """An allowed decision in words."""
    run = request.run
    option, part = run.option(decision), part_of(decision, run.cell.parts)
    assert option is not None  # it is allowed
    name = run.cell.part_name(part) + ("'s pallet" if option.carries == "pallet" else "")
    wait_s = max(0.0, run.ready_s[part - 1] - run.now_s) if option.waits else 0.0
    return OrderMove(decision, name, run.cell.names[option.origin], run.cell.names[option.target], wait_s)


def title(request: SequenceRequest) -> str:
    """The time of the question, and the robot's station."""
    run = request.run
    return f"Episode {request.episode}, {run.now_s:.0f} s: the robot is at {run.cell.names[run.robot]}"


def progress(request: SequenceRequest) -> str:
    """The reason for the question, and the cost of the last episodes."""
    known = request.improvement
    if known is None:
        return f"It asks because {request.reason}."
    means = f"the last episodes cost {known.current_mean:.0f} on average, those before {known.previous_mean:.0f}"
    return f"It asks because {request.reason}: {means}."


def reasons(request: SequenceRequest) -> list[str]:
    """The reason for the question, the learner's own choice, and the rule by which advice is judged."""
    own = move_of(request, request.own)
    return [
        progress(request),
        f"It would move {own.name} to {own.target} itself ({own.decision}), one of {counted(len(request.allowed), 'move')}.",
        "After the episode it compares its cost with the mean of those before it.",
    ]
