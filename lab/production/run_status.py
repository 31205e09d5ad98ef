"""Where a run stands, gathered from its events, as a console, a page and the progress lines show it."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from lab.production.controls import Controls
from lab.sequencing.cell.schedule import Activity, robot_activities
from lab.tasks.task import Order, Task
from lab.teaching.events import (
    Event,
    MachineBegan,
    MachineDone,
    MachineFailed,
    MoveBegan,
    MoveMade,
    OperatorActed,
    PartDone,
    PartLost,
    PhaseBegan,
    PlanMade,
    RunHeld,
    RunWentOn,
    SkillBegan,
    TroubleMet,
)

PartState = Literal["waiting", "carried", "in machine", "done", "lost"]
Light = Literal["idle", "busy", "done", "failed"]
TAKES_UP = "grasp "  # how the names of skills begin that take a part up
MOST_KEPT = 50  # troubles and commands


@dataclass
class PartStatus:
    """A part: its name and kind, the station where it is or was taken up last, and what becomes of it."""

    name: str
    kind: str
    station: str
    state: PartState = "waiting"


@dataclass
class MachineStatus:
    """A machine's light, a part in it ("": none), and when it should be done with that [s] (None: not known)."""

    station: str
    light: Light = "idle"
    part: str = ""
    until_s: float | None = None
    since_s: float = 0.0
    worked_s: float | None = None  # until when it worked, once it is done


@dataclass
class HeldStatus:
    """What stops the run, as `RunHeld` says it."""

    kind: str
    why: str
    by: str


@dataclass
class PlanStatus:
    """The plan in use, as `PlanMade` says it; rows: its activities, seconds since the run began."""

    makespan_s: float
    gap: float | None
    proven: bool
    why: str
    rows: list[Activity]
    method: str = ""


@dataclass
class TroubleStatus:
    """Something that was not as planned, what was done about it, and when [s]."""

    what: str
    answer: str
    at_s: float


@dataclass
class ActedStatus:
    """A command of the operator, when it was given [s], and why it was refused ("": it was not)."""

    words: str
    by: str
    at_s: float
    refused: str


@dataclass
class RunStatus:
    """A run as it stands: pass it every event (`hear`), let `now_s` follow the floor's clock, show it (`to_json`).

    words: what the robot does now, for people. next_station: where the robot goes. move, moves: step n of m, 0 before the
    first. machines: one for each machine, and one more for each part beyond the first in it. speed: simulated seconds per
    second of the clock on the wall, None: as fast as it can.
    """

    now_s: float = 0.0
    phase: str = ""
    held: HeldStatus | None = None
    words: str = ""
    next_station: str = ""
    move: int = 0
    moves: int = 0
    finished: int = 0
    parts: list[PartStatus] = field(default_factory=list)
    machines: list[MachineStatus] = field(default_factory=list)
    plan: PlanStatus | None = None
    measured: list[Activity] = field(default_factory=list)
    trouble: list[TroubleStatus] = field(default_factory=list)
    acted: list[ActedStatus] = field(default_factory=list)
    speed: float | None = None
    _room: dict[str, int] = field(default_factory=dict)  # for parts in each machine
    _target: str = ""  # of the move under way
    _grasped: str = ""  # the part that the robot is taking up
    _grasped_s: float = 0.0  # when that began
    _made: int = 0  # moves

    @classmethod
    def of(cls, task: Task, order: Order) -> "RunStatus":
        """Before anything has begun: the parts at their first stations, the machines idle."""
        parts = [PartStatus(f"{kind} {number}", kind, task.starts(kind)) for number, kind in enumerate(order, start=1)]
        room = {s.name: s.capacity for s in task.stations if s.kind == "machine"}
        return cls(parts=parts, machines=[MachineStatus(name) for name in room], _room=room)

    def hear(self, event: Event) -> None:
        """Take over what happened."""
        self.now_s = max(self.now_s, getattr(event, "at_s", 0.0))
        match event:
            case PhaseBegan(name):
                self.phase, self.words = name, ""
            case PlanMade():
                rows = [*event.schedule.robot, *event.schedule.machines, *event.schedule.parts]
                self.plan = PlanStatus(
                    *(event.schedule.makespan_s, event.gap, event.proven, event.why, rows, event.method)
                )
                self.moves = self._made + event.moves
            case MoveBegan() | SkillBegan() | MoveMade() | PartDone() | PartLost():
                self._hear_move(event)
            case MachineBegan() | MachineDone() | MachineFailed():
                self._hear_machine(event)
            case RunHeld(kind, why, by):
                self.held = HeldStatus(kind, why, by)
            case RunWentOn():
                self.held = None
            case TroubleMet(what, answer, part, station, at_s):
                where = " at ".join(filter(None, (part, station and f"'{station}'")))
                self.trouble.append(TroubleStatus(f"{where}: {what}" if where else what, answer, at_s))
                del self.trouble[:-MOST_KEPT]
            case OperatorActed(words, by, at_s, refused):
                self.acted.append(ActedStatus(words, by, at_s, refused))
                del self.acted[:-MOST_KEPT]

    def _hear_move(self, event: MoveBegan | SkillBegan | MoveMade | PartDone | PartLost) -> None:
        part = self.part(event.part)
        match event:
            case MoveBegan():
                self.move, self.moves = event.number, event.moves
                self._target = event.target
                self.next_station = event.target if event.start == event.origin else event.origin
                part.station = event.origin
            case SkillBegan():
                if part.state in ("waiting", "in machine") and self._grasped == event.part:
                    part.state, self.next_station = "carried", self._target
                    self._fetched(part.station, event.part, self._grasped_s)
                self._grasped = event.part if event.name.startswith(TAKES_UP) else ""
                self._grasped_s = event.at_s
                self.words = event.words
            case MoveMade(move):
                self._made, self.words, self._grasped, self.next_station = self._made + 1, "", "", ""
                self.now_s = max(self.now_s, move.drop_s)
                self.measured += robot_activities(move)
                if move.carries == "part":
                    self._fetched(move.origin, event.part, move.pick_s)
                part.station = move.target
                if part.state != "done":
                    inside = any(m.station == move.target and m.part == event.part for m in self.machines)
                    part.state = "in machine" if inside else "waiting"
            case PartDone():
                part.state = "done"
                self.finished = sum(other.state == "done" for other in self.parts)
            case PartLost():
                part.state = "lost"
                for machine in [*self.machines]:
                    if machine.part == event.part and machine.light != "failed":
                        self._fetched(machine.station, event.part, event.at_s)

    def _hear_machine(self, event: MachineBegan | MachineDone | MachineFailed) -> None:
        machine = self.machine(event.station, event.part)
        match event:
            case MachineBegan():
                machine.light, machine.part, machine.until_s = "busy", event.part, event.until_s
                machine.since_s, machine.worked_s = event.at_s, None
            case MachineDone():
                machine.light, machine.worked_s = "done", event.at_s
            case MachineFailed():
                machine.light, machine.part = "failed", event.part

    def _fetched(self, station: str, part: str, at_s: float) -> None:
        """Note that a part was taken out of a machine, whose work on it is added to what was measured."""
        for machine in [status for status in self.machines if (status.station, status.part) == (station, part)]:
            self.measured += self._work(machine, at_s)
            machine.light, machine.part, machine.until_s = "idle", "", None
            if len(self._in(station)) > 1:
                self.machines = [status for status in self.machines if status is not machine]

    def _work(self, machine: MachineStatus, until_s: float) -> list[Activity]:
        """What a machine has done with the part in it, until a time."""
        done_s = until_s if machine.worked_s is None else min(machine.worked_s, until_s)
        number = next((n for n, part in enumerate(self.parts, start=1) if part.name == machine.part), None)
        spans = (("process", machine.since_s, done_s), ("blocked", done_s, until_s))
        where = machine.station
        return [
            Activity(where, kind, number, where, where, begin_s, end_s)  # type: ignore[arg-type]
            for kind, begin_s, end_s in spans
            if end_s > begin_s
        ]

    def part(self, name: str) -> PartStatus:
        """The part called so; one that nobody told of before is made."""
        for part in self.parts:
            if part.name == name:
                return part
        self.parts.append(PartStatus(name, name.rpartition(" ")[0], ""))
        return self.parts[-1]

    def machine(self, station: str, part: str = "") -> MachineStatus:
        """The machine called so with a part, or idle, as long as it has room for that; one that nobody told of is made."""
        own = self._in(station)
        for machine in own:
            if part in ("", machine.part) or not machine.part:
                return machine
        if len(own) >= self._room.get(station, 1) and own:
            return own[0]
        at = self.machines.index(own[-1]) + 1 if own else len(self.machines)
        self.machines.insert(at, MachineStatus(station))
        return self.machines[at]

    def _in(self, station: str) -> list[MachineStatus]:
        return [machine for machine in self.machines if machine.station == station]

    def so_far(self) -> list[Activity]:
        """What was measured, with what machines are doing now."""
        under_way = (self._work(machine, self.now_s) for machine in self.machines if machine.part)
        return [*self.measured, *(activity for work in under_way for activity in work)]

    def under(self, controls: Controls) -> "RunStatus":
        """With a stop as soon as it is pressed, and the pace."""
        held = controls.held
        self.held = None if held is None else HeldStatus(held.kind, held.why, held.by)
        self.speed = controls.speed
        return self

    def copied(self) -> "RunStatus":
        """As it is now, for another thread to show while this one goes on."""
        return replace(
            self,
            parts=[replace(part) for part in self.parts],
            machines=[replace(machine) for machine in self.machines],
            measured=[*self.measured],
            trouble=[*self.trouble],
            acted=[*self.acted],
        )

    def _machine_json(self, station: str) -> dict[str, Any]:
        """A machine with its first part; where there are several in it, `parts` has each."""
        own = [{"light": m.light, "part": m.part, "until_s": m.until_s} for m in self._in(station)]
        return {"station": station, **own[0]} | ({"parts": own} if len(own) > 1 else {})

    def to_json(self) -> dict[str, Any]:
        """Plain dicts, lists, numbers and strings, for `json.dumps`; activities as `Schedule.to_json` has them."""
        return {
            "now_s": self.now_s,
            "phase": self.phase,
            "held": None if self.held is None else asdict(self.held),
            "words": self.words,
            "next_station": self.next_station,
            "move": self.move,
            "moves": self.moves,
            "finished": self.finished,
            "parts": [asdict(part) for part in self.parts],
            "machines": [self._machine_json(name) for name in dict.fromkeys(m.station for m in self.machines)],
            "plan": None if self.plan is None else asdict(self.plan),
            "measured": _rows(self.so_far()),
            "trouble": [asdict(met) for met in self.trouble],
            "acted": [asdict(command) for command in self.acted],
            "speed": self.speed,
        }


def _rows(activities: Iterable[Activity]) -> list[dict[str, Any]]:
    return [asdict(activity) for activity in activities]
