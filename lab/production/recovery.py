"""What is done about trouble: look what is where, take up again, learn again, order anew, leave a part, or stop and say why.

What to do is decided in `answers`, as a function of the state and of what was seen; here it is done.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import assert_never

from lab.errors import LabError
from lab.production.answers import (
    Belief,
    Believe,
    GiveUp,
    GoOn,
    Stop,
    TryAgain,
    WaitForCamera,
    answer_to,
    belief_in,
)
from lab.production.controls import StopKind
from lab.production.floor import Floor
from lab.production.given_up_parts import GivenUpParts
from lab.production.parts_in_machines import PartsInMachines
from lab.production.perception import Deviation, new_deviations, scene_seen
from lab.production.replanning import Planner, in_another, plan_again
from lab.production.run_state import LOOK_S, Replanned, RunState, Strange
from lab.production.standing import too_near
from lab.production.taught import Relearner, adopt
from lab.production.transfers import Transfers
from lab.production.trouble import RunStopped, Trouble
from lab.sequencing.simulate.rest import Mishaps
from lab.teaching.events import MachineFailed, MoveRetried, PlanMade, RunHeld, RunWentOn, TroubleMet

BLIND_S = 120.0  # so long a skill waits until the camera sees again
NOBODY: Mapping[int, int] = MappingProxyType({})
TO_DO = {  # by a person, with a part that is left
    "part fallen": "stand it up",
    "part gone": "bring it back",
    "part out of reach": "put it within reach",
    "part moved": "move it away from there",
}


@dataclass(frozen=True)
class Recovery:
    """Does what is decided about trouble: to the scene by `work` and `machines`, to what is believed in the state.

    relearner: learns what changed in the scene, None: nobody does. planner: who orders the rest where it must be.
    """

    floor: Floor
    state: RunState
    work: Transfers
    machines: PartsInMachines
    given_up: GivenUpParts
    relearner: Relearner | None = None
    planner: Planner = field(default_factory=Planner)

    # ---- answers ---------------------------------------------------------------------------------------------------

    def answer(self, trouble: Trouble) -> None:
        """Do what lets the run go on, perhaps without a part. Raises RunStopped."""
        floor = self.floor
        if trouble.kind == "late":
            self._put_off(trouble)
            return
        self.state.place = ""
        floor.scene.robot.brake()
        if trouble.kind != "held":  # a protective stop
            floor.tell(RunHeld(StopKind.PROTECTIVE, str(trouble), "robot", floor.now_s))
        try:
            self._answer(trouble)
        finally:
            if trouble.kind != "held":
                floor.tell(RunWentOn(floor.now_s))

    def _answer(self, trouble: Trouble) -> None:
        floor, state = self.floor, self.state
        self._let_go_of_what_is_gone()
        if trouble.kind != "held":
            state.tries[trouble.key] += 1
        seen = () if trouble.kind == "held" else tuple(new_deviations(floor, state))
        answer = answer_to(state, trouble, seen, dark=floor.world.dark)
        if trouble.kind == "missed" and not isinstance(answer, Stop):
            skill = trouble.skill and f" '{trouble.skill}',"
            self._note(f"{trouble.part} at '{trouble.station}',{skill} try {state.tries[trouble.key]}: {trouble.what}")
        match answer:
            case GoOn():
                if trouble.kind == "held":
                    self._tell(trouble, "goes on from where it is")
            case Stop(why):
                raise RunStopped(why)
            case WaitForCamera():
                self._wait_for_camera(trouble)
            case Believe():
                self._believe(answer)
            case TryAgain(pause_s):
                state.first.setdefault(trouble.part, trouble.what)
                self._try_again(trouble, pause_s)
            case GiveUp(why):
                state.first.setdefault(trouble.part, trouble.what)
                self._give_up(trouble, why)
            case _:
                assert_never(answer)

    def _put_off(self, trouble: Trouble) -> None:
        """A machine is late: what can be done meanwhile comes first, and its part is fetched as if the machine took as long as it
        is allowed to. Where no order keeps to all windows then, the old one is gone on with."""
        self._tell(trouble, "waits for it, and does first what can be done meanwhile")
        with suppress(RunStopped):
            self.replan(str(trouble))

    def _try_again(self, trouble: Trouble, pause_s: float) -> None:
        floor = self.floor
        self._tell(trouble, "tries again")
        until_s = floor.now_s + pause_s
        while floor.now_s < until_s:
            floor.wait(until_s)
        work = floor.work_on(trouble.part)
        if work is not None and work.station == trouble.station and work.failed:
            floor.again(work)

    def _wait_for_camera(self, trouble: Trouble) -> None:
        self._tell(trouble, "waits until the camera sees again")
        floor = self.floor
        until_s = floor.now_s + BLIND_S
        while floor.world.dark:
            if floor.now_s >= until_s:
                raise RunStopped(f"{trouble}: the camera has seen nothing for {BLIND_S:.0f} s: uncover it")
            floor.wait(min(floor.now_s + LOOK_S, until_s))

    def _give_up(self, trouble: Trouble, why: str) -> None:
        """Go on without a machine or without a part; RunStopped when the part cannot be set down, or it is about none."""
        floor, state = self.floor, self.state
        text = str(Trouble(why, trouble.part, trouble.station))
        part = state.part_of(trouble.part)
        if part is None or (floor.bench.held is not None and not self.set_aside(why)):
            raise RunStopped(text)
        if (work := floor.work_on(trouble.part)) is not None and work.station == trouble.station:
            state.out[trouble.station] = why
            floor.tell(MachineFailed(trouble.station, trouble.part, why, floor.now_s))
        self._tell(trouble, "goes on without it")
        self.given_up.lose(part, text)
        self.replan(text)

    # ---- what was seen ---------------------------------------------------------------------------------------------

    def _believe(self, answer: Believe) -> None:
        """Take into account what was seen, body by body, and order the rest anew. Raises RunStopped."""
        for seen in answer.seen:
            self._account(seen)
        if answer.fixed:
            self._learn_again(answer.fixed)
        self.replan(answer.seen[0].words)

    def _account(self, seen: Deviation) -> None:
        """Believe what was seen of one body."""
        floor, state, part = self.floor, self.state, self.state.part_of(seen.name)
        near, unfinished = "", False
        if part is not None and seen.sort == "part moved":
            near, work = too_near(floor.bench, seen.name), self.machines.work_on(part)
            served = work is None or not self.machines.to_be_served(part, work.station)
            unfinished = work is not None and not (work.done(floor.now_s) and served)
        belief = belief_in(state, seen, blocked=bool(near), unfinished=unfinished)
        match belief:
            case Belief.FORGET:
                closes, spot = state.strange.pop(seen.name)
                state.out.pop(closes, None)
                state.taken -= {spot}
                state.spot_of.pop(seen.name, None)
            case Belief.AVOID:
                self._avoid(seen)
            case Belief.LEAVE:
                assert part is not None
                words = f"{seen.words}, too near to {near} to be taken up" if near else seen.words
                self._leave(part, replace(seen, words=words))
            case Belief.TAKE_UP | Belief.PUT_BACK:
                assert part is not None
                self._follow(part, seen, put_back=belief is Belief.PUT_BACK, unfinished=unfinished)
            case Belief.SURVEY:
                pass  # once, for all that is fixed
            case _:
                assert_never(belief)

    def _avoid(self, seen: Deviation) -> None:
        """Something stands where it does not belong: its spot is taken; where that was the only one, it is set aside, or else the
        station is closed."""
        assert seen.at is not None
        floor, state = self.floor, self.state
        state.strange[seen.name] = Strange()
        state.spot_of[seen.name] = seen.at
        if seen.station:
            spots = floor.scene.places.spots(floor.skillset.task.station(seen.station))
            near = min(spots, key=lambda spot: (spot.x - seen.at.x) ** 2 + (spot.y - seen.at.y) ** 2)  # type: ignore[union-attr]
            state.taken.add(near)
            state.strange[seen.name] = Strange("", near)
            if len(spots) == 1 and self._clear_away(seen):
                state.taken.discard(near)
                state.strange[seen.name] = Strange()
                self._tell_seen(seen, "sets it aside")
                return
            if len(spots) == 1:
                state.strange[seen.name] = Strange(seen.station, near)
                state.out[seen.station] = seen.words
        self._tell_seen(seen, "brings nothing there")

    def _clear_away(self, seen: Deviation) -> bool:
        """Whether what belongs to nobody was set aside; what is in the gripper is set down first."""
        try:
            if self.floor.bench.held is not None and not self.set_aside(seen.words):
                return False
            return self.work.clear_away(seen.name, seen.station)
        except Trouble as trouble:
            self._note(str(trouble))
            return False

    def _leave(self, part: int, seen: Deviation) -> None:
        """A part that cannot be taken up is left; where it lies in a machine, that is closed."""
        work = self.machines.work_on(part)
        left = self.given_up.as_left(part, astray=True)
        if work is not None and seen.sort == "part fallen":
            self.state.out[work.station] = f"{seen.name} lies in '{work.station}'"
        self.floor.take_out(self.state.name(part))
        self.given_up.lose(part, f"{seen.words}: {TO_DO[seen.sort]}", left)
        self._tell_seen(seen, "leaves it")

    def _follow(self, part: int, seen: Deviation, *, put_back: bool, unfinished: bool) -> None:
        """A part that was moved is put back, or taken up where it stands.

        Where the machine that it stood in is done by now, and the part was not seen in it since, it is noted that nobody knows.
        """
        assert seen.at is not None
        state, work = self.state, self.machines.work_on(part)
        if put_back:
            state.to_put_back.append(part)
        else:
            state.spot_of[seen.name] = seen.at
        if work is not None and not unfinished and state.right_s < work.until_s:
            self._note(f"{seen.name} was taken out of '{work.station}': whether it was done there was not seen")
        self.floor.take_out(state.name(part))
        self._tell_seen(seen, "puts it back" if put_back else "takes it up there")

    def _learn_again(self, fixed: Sequence[Deviation]) -> None:
        """Learn what is another problem in the scene as it is now. RunStopped when nothing can be done in it."""
        floor, state = self.floor, self.state
        for one in fixed:
            self._tell_seen(one, "surveys the scene again, and learns what has changed")
        if self.relearner is None:
            raise RunStopped(f"{fixed[0].words}: nobody is there to teach what changed")
        try:
            cell = self.relearner.learn(scene_seen(floor.scene.task, floor.scene.layout, [*fixed]))
            adopt(floor, self.relearner.prepared, state.spot_of)
            state.go_by(in_another(state.plan, cell), floor.now_s)
        except LabError as error:
            raise RunStopped(f"{fixed[0].words}: {error}") from None

    # ---- the order of what remains ---------------------------------------------------------------------------------

    def replan(self, why: str, back: Mapping[int, int] = NOBODY) -> None:
        """Order the work that remains anew, from the state that was reached. Raises RunStopped where no order ends it.

        back: parts that had been given up and are to be brought on after all, and their positions.
        """
        floor, state, machines, now_s = self.floor, self.state, self.machines, self.floor.now_s
        machines.begin_batches()
        first = state.sequence[0] if state.sequence and floor.bench.held is not None else None
        in_work = [part for part in range(1, state.cell.parts + 1) if machines.work_on(part) is not None]
        ready_s = {part: machines.left_s(part) for part in in_work}
        taken_up = {*back, *machines.taken_out()} - {*ready_s, *state.to_put_back}
        ready_s |= dict.fromkeys(sorted(taken_up), 0.0)
        mishaps = Mishaps(frozenset(state.lost), tuple(state.out), ready_s, back)
        try:
            found = plan_again(state.plan, mishaps, first, self.planner)
        except LabError as error:
            if first is None or not self.set_aside(why):
                raise RunStopped(f"{why}: {error}") from None
            self.replan(why, back)
            return
        for part, stuck in found.stuck.items():
            if part not in state.lost:
                reasons = ", ".join(f"'{station}': {what}" for station, what in state.out.items())
                self.given_up.lose(part, f"{stuck}: {reasons}" if reasons else stuck)
        state.sequence = [*found.sequence]
        state.go_by(found.run, floor.now_s)
        gap = None
        if found.schedule is not None:
            is_proven = found.proven is not None and found.proven.proven
            gap = None if found.proven is None else found.proven.gap(found.schedule.makespan_s)
            plan = found.schedule.later(now_s)
            floor.tell(PlanMade(plan, len(state.sequence), gap, is_proven, now_s, why, found.method))
        if found.method:
            state.replanned.append(Replanned(now_s, why, found.method, len(state.sequence), gap))

    def set_aside(self, why: str) -> bool:
        """Set down what is in the gripper, for it cannot be brought on now; whether that was done."""
        held = self.floor.bench.held
        if held is None or not self.work.set_aside():
            return False
        self._tell(Trouble(why, held), "sets it down again")
        return True

    # ---- parts that were given up ----------------------------------------------------------------------------------

    def find_again(self, attended: bool = False) -> bool:
        """Go on with parts that were given up and can now be brought on; whether there are any.

        Unattended, these are parts that could not be taken up. Attended, a person has put things right: then also those that
        stand where they were left, as in a machine that was out of order. What a machine had not finished, it begins anew.
        Where no order brings them on, they are given up as before.
        """
        state, parts = self.state, self.given_up
        found = parts.found(attended)
        why = {part: state.lost[part] for part in found}
        for part, left in found.items():
            parts.take_back(part, left)
            self._tell(Trouble("it can be taken up again", state.name(part)), "goes on with it")
        try:
            if found:
                self.replan("a part can be taken up again", {part: left.position for part, left in found.items()})
        except RunStopped as stopped:
            self._note(str(stopped))
            for part, left in found.items():
                self.given_up.lose(part, why[part], left)
            return False
        return bool(found)

    def forget(self) -> None:
        """A person has put things right: what was out of use is used again, and tries are counted anew."""
        self._let_go_of_what_is_gone()
        self.state.out.clear()
        self.state.tries.clear()
        self.state.first.clear()

    def _let_go_of_what_is_gone(self) -> None:
        """Believe the gripper to be empty where what it held is not in it any more."""
        bench = self.floor.bench
        if bench.held is not None and not bench.holds(bench.held):
            bench.held = None

    # ---- what is told ----------------------------------------------------------------------------------------------

    def _note(self, text: str) -> None:
        self.state.notes.append(text)
        self.floor.tell(MoveRetried(text))

    def _tell(self, trouble: Trouble, answer: str) -> None:
        self.floor.tell(TroubleMet(trouble.what, answer, trouble.part, trouble.station, self.floor.now_s))

    def _tell_seen(self, seen: Deviation, answer: str) -> None:
        name = "" if self.state.part_of(seen.name) is None else seen.name
        about = seen.station or ("" if name else seen.name)
        self.floor.tell(TroubleMet(seen.words, answer, name, about, self.floor.now_s))
