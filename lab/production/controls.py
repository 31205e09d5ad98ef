"""The stops of a run (pause, protective stop, emergency stop), its pace, and the physics steps at which it was stopped.

They are simulated, and no safety function.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from threading import Condition

RESET_FIRST = "an emergency stop holds the robot: reset it first"


class StopKind(StrEnum):
    """The kind of a stop: the operator's pause between two moves, a protective stop of the robot, or the emergency stop."""

    PAUSE = "pause"
    PROTECTIVE = "protective"
    EMERGENCY = "emergency"


PRIORITY = (StopKind.EMERGENCY, StopKind.PROTECTIVE, StopKind.PAUSE)  # the first pressed one counts


@dataclass(frozen=True)
class Held:
    """A stop: its kind, its reason, and its origin ("operator", "robot")."""

    kind: StopKind
    why: str = ""
    by: str = "operator"


@dataclass
class Controls:
    """The stops and the pace of one run, set by the thread of a page or terminal, and read by the simulation in each step.

    speed: simulated seconds per second of real time; None: unlimited. on_change: called after every change, in the thread
    that made it. attended: whether somebody is there who can release a protective stop.
    """

    speed: float | None = None
    attended: bool = False
    on_change: list[Callable[[], None]] = field(default_factory=list)
    stops: dict[StopKind, Held] = field(default_factory=dict)
    _one_move: bool = False
    _changed: Condition = field(default_factory=Condition, repr=False)

    @property
    def held(self) -> Held | None:
        """The stop with the highest priority, in the order emergency, protective, pause; None if there is none."""
        return next((stop for kind in PRIORITY if (stop := self.stops.get(kind)) is not None), None)

    @property
    def holds_arm(self) -> bool:
        """Whether the arm must stand still at once; a pause lets the current move end."""
        return bool(self.stops) and (StopKind.EMERGENCY in self.stops or StopKind.PROTECTIVE in self.stops)

    def pause(self, by: str = "operator") -> None:
        """Pauses the run after the current move."""
        self._press(Held(StopKind.PAUSE, "", by))

    def step(self) -> str:
        """Lets the run make one move and pause again; returns why it may not, or ""."""
        if self.holds_arm:
            return self._refusal()
        self._one_move = True
        self._press(Held(StopKind.PAUSE))
        return ""

    def protective(self, why: str, by: str = "robot") -> None:
        """Holds the arm at once by a protective stop."""
        self._press(Held(StopKind.PROTECTIVE, why, by))

    def emergency(self, why: str = "pressed by hand", by: str = "operator") -> None:
        """Holds the arm at once by the emergency stop, until `reset`."""
        self._press(Held(StopKind.EMERGENCY, why, by))

    def reset(self) -> str:
        """Turns the emergency stop into a pause; returns why there is nothing to reset, or ""."""
        if StopKind.EMERGENCY not in self.stops:
            return "no emergency stop is pressed"
        self._release(StopKind.EMERGENCY, StopKind.PROTECTIVE, instead=Held(StopKind.PAUSE, "after the emergency stop"))
        return ""

    def go_on(self) -> str:
        """Releases a pause or a protective stop; returns why it may not, or ""."""
        if StopKind.EMERGENCY in self.stops:
            return RESET_FIRST
        self._one_move = False
        self._release(StopKind.PROTECTIVE, StopKind.PAUSE)
        return ""

    def set_speed(self, speed: float | None) -> None:
        """Sets the simulated seconds per second of real time; None: unlimited."""
        self.speed = speed
        self._tell()

    def move_ended(self) -> None:
        """Notes that a move has ended; the run calls it between two moves."""
        self._one_move = False

    @property
    def waits(self) -> bool:
        """Whether the run must wait before the next move."""
        return bool(self.stops) and not (self._one_move and not self.holds_arm)

    def wait(self, timeout_s: float) -> None:
        """Waits until something changes, at most `timeout_s` [s]."""
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
    """The stops that were pressed from a physics step on; empty: the run continued."""

    step: int
    stops: tuple[Held, ...]


def unwritten(changed: StopsChanged) -> None:
    """Does nothing: there is no journal."""


@dataclass
class StopRecord:
    """The controls as the simulation last read them; each change is written to the journal before it takes effect.

    script: the changes still to come of a run that is repeated; again_until: the physics step up to which the earlier run
    went.
    """

    script: list[StopsChanged] = field(default_factory=list)
    again_until: int = 0
    note: Callable[[StopsChanged], None] = unwritten
    now: tuple[Held, ...] = ()
    folding: bool = False

    def look(self, step: int, controls: Controls) -> bool:
        """Takes over the changes up to a physics step; returns whether the run is stopped now."""
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
        """Repeats from now on the changes of an earlier run, up to a physics step."""
        self.script, self.again_until, self.folding = script, until, bool(script) or until > 0

    @property
    def held(self) -> Held | None:
        """The stop with the highest priority; None if there is none."""
        return next((held for kind in PRIORITY for held in self.now if held.kind is kind), None)

    @property
    def holds_arm(self) -> bool:
        """Whether the arm must stand still at once."""
        return any(held.kind is not StopKind.PAUSE for held in self.now)

    def pauses(self, controls: Controls) -> bool:
        """Whether the next move must wait; repeated moves do not wait."""
        return not self.folding and controls.waits
