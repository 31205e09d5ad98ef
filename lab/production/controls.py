"""What stops a run and sets its pace: pause, protective stop, emergency stop, kept apart; and at which steps it was stopped.

Simulated: no safety function.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from threading import Condition

RESET_FIRST = "an emergency stop holds the robot: reset it first"


class StopKind(StrEnum):
    """Why nothing moves: the operator's pause between two moves, what the robot noticed, or the emergency stop."""

    PAUSE = "pause"
    PROTECTIVE = "protective"
    EMERGENCY = "emergency"


PRIORITY = (StopKind.EMERGENCY, StopKind.PROTECTIVE, StopKind.PAUSE)  # the first one that is pressed counts


@dataclass(frozen=True)
class Held:
    """A stop: its kind, why, and who stopped ("operator", "robot")."""

    kind: StopKind
    why: str = ""
    by: str = "operator"


@dataclass
class Controls:
    """The stops and the pace of one run; a page's or a terminal's thread sets them, the simulation looks once a step.

    speed: simulated seconds per second of the clock on the wall; None: as fast as it can. on_change: told of every change,
    in the thread that made it. attended: somebody is there who can go on after a protective stop.
    """

    speed: float | None = None
    attended: bool = False
    on_change: list[Callable[[], None]] = field(default_factory=list)
    stops: dict[StopKind, Held] = field(default_factory=dict)
    _one_move: bool = False
    _changed: Condition = field(default_factory=Condition, repr=False)

    @property
    def held(self) -> Held | None:
        """What stops the run now: an emergency stop before a protective one, that before a pause; None: nothing."""
        return next((found for kind in PRIORITY if (found := self.stops.get(kind)) is not None), None)

    @property
    def holds_arm(self) -> bool:
        """Whether the arm is to stand still at once; a pause lets the move under way end."""
        return bool(self.stops) and (StopKind.EMERGENCY in self.stops or StopKind.PROTECTIVE in self.stops)

    def pause(self, by: str = "operator") -> None:
        """Stop when the move under way has ended."""
        self._press(Held(StopKind.PAUSE, "", by))

    def step(self) -> str:
        """Carry one move out, then pause again; why it may not be, "" when it may."""
        if self.holds_arm:
            return self._refusal()
        self._one_move = True
        self._press(Held(StopKind.PAUSE))
        return ""

    def protective(self, why: str, by: str = "robot") -> None:
        """Hold the arm at once, because the robot noticed something."""
        self._press(Held(StopKind.PROTECTIVE, why, by))

    def emergency(self, why: str = "pressed by hand", by: str = "operator") -> None:
        """Hold the arm at once, until it is reset."""
        self._press(Held(StopKind.EMERGENCY, why, by))

    def reset(self) -> str:
        """Release the emergency stop: it stays until `go_on`; why there is nothing to reset, ""."""
        if StopKind.EMERGENCY not in self.stops:
            return "no emergency stop is pressed"
        self._release(StopKind.EMERGENCY, StopKind.PROTECTIVE, instead=Held(StopKind.PAUSE, "after the emergency stop"))
        return ""

    def go_on(self) -> str:
        """Go on after a pause or a protective stop; why it may not be, "" when it may."""
        if StopKind.EMERGENCY in self.stops:
            return RESET_FIRST
        self._one_move = False
        self._release(StopKind.PROTECTIVE, StopKind.PAUSE)
        return ""

    def set_speed(self, speed: float | None) -> None:
        """Simulated seconds per second; None: as fast as it can."""
        self.speed = speed
        self._tell()

    def move_ended(self) -> None:
        """To be called by the run between two moves: one step was made."""
        self._one_move = False

    @property
    def waits(self) -> bool:
        """Whether the run is to wait before the next move."""
        return bool(self.stops) and not (self._one_move and not self.holds_arm)

    def wait(self, timeout_s: float) -> None:
        """Wait until something changes, at most so long [s]."""
        with self._changed:
            self._changed.wait(timeout_s)

    def _refusal(self) -> str:
        return RESET_FIRST if StopKind.EMERGENCY in self.stops else "a protective stop holds the robot: go on first"

    def _press(self, held: Held) -> None:
        self.stops = {**self.stops, held.kind: held}
        self._tell()

    def _release(self, *kinds: StopKind, instead: Held | None = None) -> None:
        left = {kind: held for kind, held in self.stops.items() if kind not in kinds}
        self.stops = left if instead is None else {**left, instead.kind: instead}
        self._tell()

    def _tell(self) -> None:
        with self._changed:
            self._changed.notify_all()
        for told in self.on_change:
            told()


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
