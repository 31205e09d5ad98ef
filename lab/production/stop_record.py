"""At which physics steps a run was stopped and went on: as it happens, or, of a run that is carried out again, as it did."""

from collections.abc import Callable
from dataclasses import dataclass, field

from lab.production.controls import PRIORITY, Controls, Held, StopKind


@dataclass(frozen=True)
class StopsChanged:
    """From a physics step on these stops were pressed; none: the run went on."""

    step: int
    stops: tuple[Held, ...]


def unwritten(changed: StopsChanged) -> None:
    """No journal is kept."""


@dataclass
class StopRecord:
    """What the simulation knows of the controls: what they were at its last look; each change is noted before it counts.

    script: of a run that is carried out again, what is still to come; again_until: the physics step up to which it was
    carried out before.
    """

    script: list[StopsChanged] = field(default_factory=list)
    again_until: int = 0
    note: Callable[[StopsChanged], None] = unwritten
    now: tuple[Held, ...] = ()
    folding: bool = False

    def look(self, step: int, controls: Controls) -> bool:
        """Take over what has changed until a physics step; whether anything is stopped now."""
        if self.folding:
            while self.script and self.script[0].step <= step:
                self.now = self.script.pop(0).stops
            if not self.script and step >= self.again_until:
                self.folding = False
                controls.stops = {held.kind: held for held in self.now} | controls.stops
        elif controls.stops or self.now:
            live = tuple(controls.stops.values())
            if live != self.now:
                self.note(StopsChanged(step, live))
                self.now = live
        return bool(self.now)

    def again(self, script: list[StopsChanged], until: int) -> None:
        """Do from now on what was done before, up to a physics step."""
        self.script, self.again_until, self.folding = script, until, bool(script) or until > 0

    @property
    def held(self) -> Held | None:
        """The stop that counts; None: nothing is stopped."""
        return next((held for kind in PRIORITY for held in self.now if held.kind is kind), None)

    @property
    def holds_arm(self) -> bool:
        """Whether the arm is to stand still at once."""
        return any(held.kind is not StopKind.PAUSE for held in self.now)

    def pauses(self, controls: Controls) -> bool:
        """Whether the next move is to wait; what is done again does not."""
        return not self.folding and controls.waits
