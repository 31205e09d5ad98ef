"""Under which conditions a prepared task is carried out: at which speed, who watches and may stop it, and what is kept of it."""

from collections.abc import Callable
from dataclasses import dataclass, field

from lab.production.controls import Controls
from lab.production.floor import Floor, idle, untouched
from lab.production.recorder import Viewer
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunJournal
from lab.tasks.fault_fields import FaultFields


def nobody(floor: Floor) -> None:
    """Nobody looks at it."""


@dataclass(frozen=True)
class Conditions:
    """override: the share of the task's speed and acceleration with which the arm moves. viewer: who watches live.

    faults: what goes wrong in it; fault_seed: draws more of that, None: nothing more. advice: who is asked, None: nobody
    about the order. on_floor: called with the floor when it is ready. before_step, meanwhile: called by the floor, before
    faults strike (see `Hooks`).
    """

    override: float = 1.0
    viewer: Viewer | None = None
    controls: Controls = field(default_factory=Controls)
    journal: RunJournal = field(default_factory=RunJournal)
    faults: tuple[FaultFields, ...] = ()
    fault_seed: int | None = None
    advice: RunAdvice | None = None
    on_floor: Callable[[Floor], None] = nobody
    before_step: Callable[[Floor], bool] = untouched
    meanwhile: Callable[[], bool] = idle
