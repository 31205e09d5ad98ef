"""What is done about trouble: look what is where, take up again, learn again, order anew, leave a part, or stop and say why."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from lab.errors import LabError
from lab.production.controls import StopKind
from lab.production.perception import BELOW_M, Deviation, perceive, seen_at
from lab.production.standing import DELIVERED_M, too_near
from lab.production.transfers import Transfers
from lab.production.trouble import RunStopped, Trouble
from lab.sim.parts.kinds import Spot
from lab.sim.scene.scene import pallet_of
from lab.skills.skill import UPRIGHT
from lab.teaching.events import MachineFailed, MoveRetried, PartLost, RunHeld, RunWentOn, TroubleMet

MAX_TRIES = 3  # what fails is tried again from the state reached, at most twice
PAUSES_S = (0.0, 0.0, 30.0)  # before each try [s]: what disturbs may go away
LOOK_S = 1.0  # between two looks at the table
BLIND_S = 120.0  # so long a skill waits until the camera sees again
MOST_TROUBLES = 40  # in one run; then it is stopped
LOST = ("part fallen", "part gone", "part out of reach")
FIXED = ("obstacle moved", "obstacle gone", "obstacle new", "station moved")
TO_DO = {  # by a person, with a part that is left
    "part fallen": "stand it up",
    "part gone": "bring it back",
    "part out of reach": "put it within reach",
    "part moved": "move it away from there",
}


@dataclass(frozen=True)
class GivenUp:
    """How a part was when it was given up: its position on its routes, and the spot on which it was believed to stand.

    undone: a machine had begun it and was not done. astray: it could not be taken up, but may be later. finished_s: when it
    had reached the end of its route [s]; None: it had not.
    """

    position: int
    spot: Spot | None
    undone: bool
    astray: bool
    finished_s: float | None


class Strange(NamedTuple):
    """What belongs to nobody: the station that it closes, "" for none, and the spot on which nothing else fits."""

    closes: str = ""
    spot: Spot | None = None


@dataclass
class Recovery:
    """The answers to trouble, for parts that are being brought on.

    replan: orders the rest of the work anew, given why, and parts that are back in play, with their positions.
    relearn: learns what changed in the scene, given what was seen.
    lost: why a part was given up, by its number. out: why nothing is brought to a station any more.
    """

    work: Transfers
    replan: Callable[..., None]
    relearn: Callable[[Sequence[Deviation]], None]
    lost: dict[int, str] = field(default_factory=dict)
    out: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    _strange: dict[str, Strange] = field(default_factory=dict)  # what belongs to nobody, by its name
    _given_up: dict[int, GivenUp] = field(default_factory=dict)  # of `lost`, those of which a position is known
    _tries: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    _first: dict[str, str] = field(default_factory=dict)
    _looked_s: float = -LOOK_S
    _right_s: float = -LOOK_S  # when all was seen last to be where it should be

    def find_again(self, attended: bool = False) -> bool:
        """Go on with parts that were given up and can now be brought on; whether there are any.

        Unattended, these are parts that could not be taken up. Attended, a person has put things right: then also those that
        stand where they were left, as in a machine that was out of order. What a machine had not finished, it begins anew.
        Where no order brings them on, they are given up as before.
        """
        found = {part: one for part, one in self._given_up.items() if attended or one.astray}
        found = self._with_room({part: one for part, one in found.items() if self._is_back(part, one)})
        why = {part: self.lost[part] for part in found}
        for part, one in found.items():
            self._take_back(part, one)
        try:
            if found:
                self.replan("a part can be taken up again", {part: one.position for part, one in found.items()})
        except RunStopped as stopped:
            self._note(str(stopped))
            for part, one in found.items():
                self._lose(part, why[part], one)
            return False
        return bool(found)

    def _with_room(self, found: dict[int, GivenUp]) -> dict[int, GivenUp]:
        """Those for which there is room at the stations of their positions, those that stand there first; others come later."""
        cell, chosen = self.work.cell, dict[int, GivenUp]()
        places = [place for part, place in enumerate(self.work.plan.locations, 1) if part not in self.lost]
        taken = Counter(station for place in places for station in self.work.plan.cell.positions[place].holds)

        def is_elsewhere(part: int) -> bool:
            return (spot := found[part].spot) is None or not self._stands(part, spot)

        for part in sorted(found, key=lambda part: (is_elsewhere(part), part)):
            holds = cell.laid_out[found[part].position].holds
            if all(taken[station] < cell.capacities[station] for station in holds):
                taken.update(holds)
                chosen[part] = found[part]
            else:
                self._given_up[part] = replace(found[part], astray=True)
        return chosen

    def _take_back(self, part: int, left: GivenUp) -> None:
        """Count on a part again that had been given up."""
        work, name = self.work, self.work.name(part)
        del self._given_up[part], self.lost[part]
        work.left_lying.discard(name)
        stands = left.spot is not None and self._stands(part, left.spot)
        work.spot_of[name] = left.spot if left.spot is not None and stands else seen_at(work.floor, name)
        if left.finished_s is not None:
            work.finished[part] = left.finished_s
        if left.undone or (left.finished_s is not None and not stands):
            work.begin_again(part, stands)
        self._tell(Trouble("it can be taken up again", name), "goes on with it")

    def _is_back(self, part: int, left: GivenUp) -> bool:
        """Whether a part that was given up can be brought on: it stands where it was left, or can be taken up elsewhere."""
        place = self.work.cell.laid_out[left.position].station
        if left.undone and self.work.cell.names[place] in self.out:
            return False
        return (left.spot is not None and self._stands(part, left.spot)) or self._can_be_taken_up(part)

    def _stands(self, part: int, spot: Spot) -> bool:
        """Whether a part is seen to stand upright on a spot."""
        floor, name = self.work.floor, self.work.name(part)
        upright = not floor.world.dark and floor.bench.upright(name) >= UPRIGHT
        return upright and floor.bench.stands(name, spot, DELIVERED_M)

    def _can_be_taken_up(self, part: int) -> bool:
        floor, name = self.work.floor, self.work.name(part)
        at = seen_at(floor, name)
        reached = floor.scene.robot.arm.inverse(floor.bench.part_pose(name)) is not None
        stands = at.z > BELOW_M and floor.bench.upright(name) >= UPRIGHT and not too_near(floor.bench, name)
        return not floor.world.dark and stands and reached

    def forget(self) -> None:
        """A person has put things right: what was out of use is used again, and tries are counted anew."""
        bench = self.work.floor.bench
        if bench.held is not None and not bench.holds(bench.held):  # it was taken out of the gripper
            bench.held = None
        self.out.clear()
        self._tries.clear()
        self._first.clear()

    def failure(self) -> str | None:
        """Why not all parts were made; None when they were."""
        why = self.work.spoilt | self.lost
        return "; ".join(dict.fromkeys(why[part] for part in sorted(why))) or None

    def to_put_right(self) -> str:
        """Why parts were given up that a person may yet help on; "" where there are none."""
        why = [self.lost[part] for part in sorted(self._given_up)]
        return "; ".join(dict.fromkeys(why))

    def look(self) -> None:
        """See, once a second, whether all is where it should be. Raises Trouble."""
        now_s = self.work.floor.now_s
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        found = self._deviations()
        if found:
            raise Trouble(found[0].words, found[0].name, found[0].station, seen=True)
        if not self.work.floor.world.dark:
            self._right_s = now_s

    # ---- answers ---------------------------------------------------------------------------------------------------

    def answer(self, trouble: Trouble) -> None:
        """Do what lets the run go on, perhaps without a part. Raises RunStopped."""
        work, floor = self.work, self.work.floor
        if trouble.late:
            self._put_off(trouble)
            return
        work.place = ""
        floor.scene.robot.brake()
        if not trouble.held:  # a protective stop
            work.tell(RunHeld(StopKind.PROTECTIVE, str(trouble), "robot", floor.now_s))
        try:
            self._answer(trouble)
        finally:
            if not trouble.held:
                work.tell(RunWentOn(floor.now_s))

    def _answer(self, trouble: Trouble) -> None:
        floor = self.work.floor
        if floor.bench.held is not None and not floor.bench.holds(floor.bench.held):
            floor.bench.held = None
        if trouble.held:
            self._tell(trouble, "goes on from where it is")
            return
        key = (trouble.part, trouble.station, trouble.skill)
        self._tries[key] += 1
        if self._tries.total() >= MOST_TROUBLES:
            raise RunStopped(f"{trouble} (after {MOST_TROUBLES} troubles)")
        if not (trouble.final or trouble.seen):
            skill = trouble.skill and f" '{trouble.skill}',"
            self._note(f"{trouble.part} at '{trouble.station}',{skill} try {self._tries[key]}: {trouble.what}")
        if floor.world.dark:
            self._wait_for_camera(trouble)
        elif not self._see() and not trouble.seen:
            self._try_again(trouble, self._tries[key])

    def _put_off(self, trouble: Trouble) -> None:
        """A machine is late: what can be done meanwhile comes first, and its part is fetched as if the machine took as long as it
        is allowed to. Where no order keeps to all windows then, the old one is gone on with."""
        self._tell(trouble, "waits for it, and does first what can be done meanwhile")
        with suppress(RunStopped):
            self.replan(str(trouble))

    def set_aside(self, why: str) -> bool:
        """Set down what is in the gripper, for it cannot be brought on now; whether that was done."""
        held = self.work.floor.bench.held
        if held is None or not self.work.set_aside():
            return False
        self._tell(Trouble(why, held), "sets it down again")
        return True

    def _try_again(self, trouble: Trouble, tries: int) -> None:
        """Nothing is to be seen that explains it: try it again, a few times, then give up."""
        first = self._first.setdefault(trouble.part, trouble.what)
        if tries >= MAX_TRIES or trouble.final:
            self._give_up(trouble, trouble.what if trouble.final else f"{first} (tried {tries} times)")
            return
        self._tell(trouble, "tries again")
        self._wait(PAUSES_S[tries])
        work = self.work.floor.work_on(trouble.part)
        if work is not None and work.station == trouble.station and work.failed:
            self.work.floor.again(work)

    def _wait_for_camera(self, trouble: Trouble) -> None:
        self._tell(trouble, "waits until the camera sees again")
        floor = self.work.floor
        until_s = floor.now_s + BLIND_S
        while floor.world.dark:
            if floor.now_s >= until_s:
                raise RunStopped(f"{trouble}: the camera has seen nothing for {BLIND_S:.0f} s: uncover it")
            floor.wait(min(floor.now_s + LOOK_S, until_s))

    def _see(self) -> bool:
        """Look what is where, and take it into account; whether anything was not as believed."""
        found = self._deviations()
        for one in found:
            self._account(one)
        fixed = [one for one in found if one.sort in FIXED]
        if fixed:
            self._learn_again(fixed)
        if found:
            self.replan(found[0].words)
        return bool(found)

    def _account(self, seen: Deviation) -> None:
        """Believe what was seen of one body."""
        work, part = self.work, self._part_of(seen.name)
        if seen.name in self._strange:  # it was there, and is not any more
            closes, spot = self._strange.pop(seen.name)
            self.out.pop(closes, None)
            self.work.taken -= {spot}
            work.spot_of.pop(seen.name, None)
        elif seen.sort == "strange part":
            self._avoid(seen)
        elif part is not None and seen.sort in LOST:
            self._leave(part, seen)
        elif part is not None and seen.sort == "part moved":
            self._follow(part, seen)

    def _avoid(self, seen: Deviation) -> None:
        """Something stands where it does not belong: its spot is taken; where that was the only one, it is set aside, or else the
        station is closed."""
        assert seen.at is not None
        floor = self.work.floor
        self._strange[seen.name] = Strange()
        self.work.spot_of[seen.name] = seen.at
        if seen.station:
            spots = floor.scene.places.spots(floor.skillset.task.station(seen.station))
            near = min(spots, key=lambda spot: (spot.x - seen.at.x) ** 2 + (spot.y - seen.at.y) ** 2)  # type: ignore[union-attr]
            self.work.taken.add(near)
            self._strange[seen.name] = Strange("", near)
            if len(spots) == 1 and self._clear_away(seen):
                self.work.taken.discard(near)
                self._strange[seen.name] = Strange()
                self._tell_seen(seen, "sets it aside")
                return
            if len(spots) == 1:
                self._strange[seen.name] = Strange(seen.station, near)
                self.out[seen.station] = seen.words
        self._tell_seen(seen, "brings nothing there")

    def _clear_away(self, seen: Deviation) -> bool:
        """Whether what belongs to nobody was set aside; what is in the gripper is set down first."""
        try:
            if self.work.floor.bench.held is not None and not self.set_aside(seen.words):
                return False
            return self.work.clear_away(seen.name, seen.station)
        except Trouble as trouble:
            self._note(str(trouble))
            return False

    def _leave(self, part: int, seen: Deviation) -> None:
        """A part that cannot be taken up is left; where it lies in a machine, that is closed."""
        work = self.work.work_on(part)
        left = self._as_left(part, astray=True)
        if work is not None and seen.sort == "part fallen":
            self.out[work.station] = f"{seen.name} lies in '{work.station}'"
        self.work.floor.take_out(self.work.name(part))
        self._lose(part, f"{seen.words}: {TO_DO[seen.sort]}", left)
        self._tell_seen(seen, "leaves it")

    def _follow(self, part: int, seen: Deviation) -> None:
        """A part that was moved is taken up where it stands; out of its machine before that was done, or before the robot served
        it there, it is put back there.

        Where the machine is done by now, and the part was not seen in it since, it is noted that nobody knows.
        """
        assert seen.at is not None
        if other := too_near(self.work.floor.bench, seen.name):
            self._leave(part, replace(seen, words=f"{seen.words}, too near to {other} to be taken up"))
            return
        work, begun, answer = self.work, self.work.work_on(part), "takes it up there"
        unfinished = begun is not None and (not begun.done(work.floor.now_s) or work.to_be_served(part, begun.station))
        if unfinished or seen.name in work.waiting or part in work.finished:
            answer = "puts it back"
            work.to_put_back.append(part)
        else:
            work.spot_of[seen.name] = seen.at
        if begun is not None and not unfinished and self._right_s < begun.until_s:
            self._note(f"{seen.name} was taken out of '{begun.station}': whether it was done there was not seen")
        work.floor.take_out(work.name(part))
        self._tell_seen(seen, answer)

    def _learn_again(self, fixed: Sequence[Deviation]) -> None:
        """Learn what is another problem in the scene as it is now. RunStopped when nothing can be done in it."""
        for one in fixed:
            self._tell_seen(one, "surveys the scene again, and learns what has changed")
        try:
            self.relearn(fixed)
        except LabError as error:
            raise RunStopped(f"{fixed[0].words}: {error}") from None

    def _give_up(self, trouble: Trouble, why: str) -> None:
        """Go on without a machine or without a part; RunStopped when the part cannot be set down, or it is about none."""
        floor = self.work.floor
        text = str(Trouble(why, trouble.part, trouble.station))
        part = self._part_of(trouble.part)
        if part is None or (floor.bench.held is not None and not self.set_aside(why)):
            raise RunStopped(text)
        if (work := floor.work_on(trouble.part)) is not None and work.station == trouble.station:
            self.out[trouble.station] = why
            self.work.tell(MachineFailed(trouble.station, trouble.part, why, floor.now_s))
        self._tell(trouble, "goes on without it")
        self._lose(part, text)
        self.replan(text)

    def lose(self, stuck: dict[int, str]) -> None:
        """Give parts up that cannot be finished any more."""
        for part, why in stuck.items():
            if part not in self.lost:
                reasons = ", ".join(f"'{station}': {what}" for station, what in self.out.items())
                self._lose(part, f"{why}: {reasons}" if reasons else why)

    def _as_left(self, part: int, astray: bool = False) -> GivenUp | None:
        """How a part is that is now given up; None where nobody could go on with it."""
        work, position = self.work.work_on(part), self.work.plan.locations[part - 1]
        if position >= len(self.work.cell.laid_out):
            return None
        undone = part in self.work.to_put_back or (work is not None and not work.done(self.work.floor.now_s))
        spot, finished_s = self.work.spot_of.get(self.work.name(part)), self.work.finished.get(part)
        return GivenUp(position, spot, undone, astray, finished_s)

    def _lose(self, part: int, why: str, left: GivenUp | None = None) -> None:
        self.lost[part] = why
        if (left := left or self._as_left(part)) is not None:
            self._given_up[part] = left
        self.work.left_lying.add(self.work.name(part))
        self.work.spot_of.pop(self.work.name(part), None)
        self.work.finished.pop(part, None)
        self.work.to_put_back = [one for one in self.work.to_put_back if one != part]
        self.work.tell(PartLost(self.work.name(part), why, self.work.floor.now_s))

    def _wait(self, seconds: float) -> None:
        floor = self.work.floor
        until_s = floor.now_s + seconds
        while floor.now_s < until_s:
            floor.wait(until_s)

    # ---- what is seen and told -------------------------------------------------------------------------------------

    def _deviations(self) -> list[Deviation]:
        """What is not as believed; of parts that were given up, and things that belong to nobody, nothing new."""
        floor = self.work.floor
        delivered = {self.work.name(part) for part in self.work.finished}
        found = perceive(floor, floor.scene.task, floor.scene.layout, self.work.spot_of, delivered)
        return [one for one in found if one.sort != "camera blind" and not self._is_known(one)]

    def _is_known(self, one: Deviation) -> bool:
        part = self._part_of(one.name)
        if part is None:
            return one.name in self._strange and one.sort != "part gone"
        return part in self.lost or (part in self.work.to_put_back and one.sort == "part moved")

    def _part_of(self, body: str) -> int | None:
        """The number of the part that a body is, or whose pallet."""
        for part in range(1, self.work.cell.parts + 1):
            name = self.work.name(part)
            if body in (name, pallet_of(name)):
                return part
        return None

    def _note(self, text: str) -> None:
        self.notes.append(text)
        self.work.tell(MoveRetried(text))

    def _tell(self, trouble: Trouble, answer: str) -> None:
        now_s = self.work.floor.now_s
        self.work.tell(TroubleMet(trouble.what, answer, trouble.part, trouble.station, now_s))

    def _tell_seen(self, seen: Deviation, answer: str) -> None:
        name = "" if self._part_of(seen.name) is None else seen.name
        about = seen.station or ("" if name else seen.name)
        self.work.tell(TroubleMet(seen.words, answer, name, about, self.work.floor.now_s))
