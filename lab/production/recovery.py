"""What is done about trouble: look what is where, take up again, learn again, order anew, leave a part, or stop and say why."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot

from lab.production.transfers import Transfers
from lab.production.trouble import RunStopped, Trouble
from lab.sim.parts.kinds import Spot
from lab.skills.skill import UPRIGHT
from lab.teaching.events import MachineFailed, MoveRetried, PartLost, TroubleMet

MAX_TRIES = 3  # what fails is tried again from the state reached, at most twice
PAUSES_S = (0.0, 0.0, 30.0)  # before each try [s]: what disturbs may go away
MOVED_M = 0.035  # a part farther than this from where it was set down was moved
LOOK_S = 1.0  # between two looks at the table
MOST_TROUBLES = 40  # in one run; then it is stopped

Replan = Callable[[str], None]  # given why


@dataclass
class Recovery:
    """The answers to trouble, for parts that are being brought on.

    lost: why a part was given up, by its number. out: why a machine is not used any more. back: positions to which parts
    fell back, by number, that the next plan has to know of.
    """

    work: Transfers
    replan: Replan
    lost: dict[int, str] = field(default_factory=dict)
    out: dict[str, str] = field(default_factory=dict)
    back: dict[int, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    _tries: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    _first: dict[str, str] = field(default_factory=dict)
    _looked_s: float = -LOOK_S

    def failure(self) -> str | None:
        """Why not all parts were made; None when they were."""
        return "; ".join(self.lost[part] for part in sorted(self.lost)) or None

    def look(self) -> None:
        """See, once a second, whether all is where it should be. Raises Trouble."""
        now_s = self.work.floor.now_s
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        if found := self._deviations():
            raise found[0]

    # ---- answers ---------------------------------------------------------------------------------------------------

    def answer(self, trouble: Trouble) -> None:
        """Do what lets the run go on, perhaps without a part. Raises RunStopped."""
        work, floor = self.work, self.work.floor
        work.place = ""
        if floor.bench.held is not None and not floor.bench.holds(floor.bench.held):
            floor.bench.held = None
        if trouble.held:
            self._tell(trouble, "goes on from where it is")
            return
        key = (trouble.part, trouble.station, trouble.skill)
        self._tries[key] += 1
        tries = self._tries[key]
        if not trouble.final and not isinstance(trouble, PartAstray):
            skill = trouble.skill and f" '{trouble.skill}',"
            self._note(f"{trouble.part} at '{trouble.station}',{skill} try {tries}: {trouble.what}")
        if self._tries.total() >= MOST_TROUBLES:
            raise RunStopped(f"{trouble} (after {MOST_TROUBLES} troubles)")
        if self._see():
            return
        first = self._first.setdefault(trouble.part, trouble.what)
        if tries >= MAX_TRIES or trouble.final:
            self._give_up(trouble, trouble.what if trouble.final else f"{first} (tried {tries} times)")
            return
        self._tell(trouble, "tries again")
        self._wait(PAUSES_S[tries])
        machine = floor.machines.get(trouble.station)
        if machine is not None and machine.failed:
            floor.again(machine)

    def _see(self) -> bool:
        """Look what is where, and take it into account; whether anything was not where it should be."""
        found = self._deviations()
        for trouble in found:
            self._account(trouble)
        if found:
            self.replan(str(found[0]))
        return bool(found)

    def _account(self, seen: "PartAstray") -> None:
        """Believe what was seen of one part."""
        work, part = self.work, seen.number
        machine = next((m for m in work.floor.machines.values() if m.part == seen.part), None)
        if seen.lost:
            self._lose(part, str(seen), seen)
        else:
            before = work.came_from.get(seen.part)
            if machine is not None and not machine.done(work.floor.now_s) and before is not None:
                self.back[part] = before
                self._tell(seen, "takes it up there, and brings it back to the machine")
            else:
                self._tell(seen, "takes it up there")
            work.spot_of[seen.part] = seen.spot
        if machine is not None:
            machine.clear()

    def _give_up(self, trouble: Trouble, why: str) -> None:
        """Go on without a machine or without a part; RunStopped when the part is in the gripper, or there is none."""
        floor = self.work.floor
        text = str(Trouble(why, trouble.part, trouble.station))
        part = self._number(trouble.part)
        if floor.bench.held is not None or part is None:
            raise RunStopped(text)
        if (machine := floor.machines.get(trouble.station)) is not None and machine.part == trouble.part:
            self.out[trouble.station] = why
            self.work.tell(MachineFailed(trouble.station, trouble.part, why, floor.now_s))
        self._lose(part, text, trouble)
        self.replan(text)

    def _lose(self, part: int, why: str, trouble: Trouble) -> None:
        self.lost[part] = why
        self._tell(trouble, "leaves it where it is")
        self.work.tell(PartLost(self.work.name(part), why, self.work.floor.now_s))

    def _wait(self, seconds: float) -> None:
        floor = self.work.floor
        until_s = floor.now_s + seconds
        while floor.now_s < until_s:
            floor.wait(until_s)

    def _note(self, text: str) -> None:
        self.notes.append(text)
        self.work.tell(MoveRetried(text))

    def _tell(self, trouble: Trouble, answer: str) -> None:
        self.work.tell(TroubleMet(trouble.what, answer, trouble.part, trouble.station, self.work.floor.now_s))

    def _number(self, name: str) -> int | None:
        parts = range(1, self.work.cell.parts + 1)
        return next((part for part in parts if self.work.name(part) == name), None)

    # ---- what is seen ----------------------------------------------------------------------------------------------

    def _deviations(self) -> list["PartAstray"]:
        """The parts that are not where they should be, and not known to be elsewhere."""
        work, bench, found = self.work, self.work.floor.bench, []
        for part in range(1, work.cell.parts + 1):
            name = work.name(part)
            if part in self.lost or bench.held in work.floor.scene.bodies_of(name, work.comes_as(part)):
                continue
            spot, at = work.spot_of[name], bench.part_pose(name)
            foot = work.floor.scene.kind_of[name].foot_at(at)
            station = work.cell.names[work.plan.cell.positions[work.plan.locations[part - 1]].station]
            where = f"({foot.x:.2f}, {foot.y:.2f}) m"
            if bench.upright(name) < UPRIGHT:
                found.append(PartAstray(f"it lies on its side at {where}", name, station, part, foot, lost=True))
            elif hypot(foot.x - spot.x, foot.y - spot.y) > MOVED_M or foot.z < spot.z - 0.02:
                reach = work.floor.scene.robot.arm.inverse(at) is not None and foot.z > -0.01
                words = f"it stands at {where}" if reach else f"it is out of reach at {where}"
                found.append(PartAstray(words, name, station, part, foot, lost=not reach))
        return found


class PartAstray(Trouble):
    """A part that is not where it was set down; lost: it cannot be taken up."""

    def __init__(self, what: str, part: str, station: str, number: int, spot: Spot, *, lost: bool) -> None:
        super().__init__(what, part, station)
        self.number, self.spot, self.lost = number, spot, lost
