"""The recovery from trouble: perceive, retry, learn again, replan, give a part up, or stop for a reason.

`answers` decides what to do, from the state and the perceived deviations; this module does it.
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

BLIND_S = 120.0  # longest wait for a covered camera
NOBODY: Mapping[int, int] = MappingProxyType({})
TO_DO = {  # what a person must do with a given-up part
    "part fallen": "stand it up",
    "part gone": "bring it back",
    "part out of reach": "put it within reach",
    "part moved": "move it away from there",
}


@dataclass(frozen=True)
class Recovery:
    """Carries out the answers to trouble: in the scene by `work` and `machines`, in the believed scene by `state`.

    relearner: learns the changed problems of the scene; None: they are not learned. planner: replans the remaining work.
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
        """Answers trouble so that the run can continue, perhaps without a part. Raises RunStopped."""
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
        """Replans for a late machine, whose part is fetched as if the machine took the longest allowed time. If then no order
        keeps all windows, the old one is kept."""
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
        """Continues without a machine or a part; RunStopped if the part cannot be set down, or the trouble concerns none."""
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
        """Updates the believed scene body by body, and replans the rest. Raises RunStopped."""
        for seen in answer.seen:
            self._account(seen)
        if answer.fixed:
            self._learn_again(answer.fixed)
        self.replan(answer.seen[0].words)

    def _account(self, seen: Deviation) -> None:
        """Updates the belief about one body."""
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
                pass  # once, for all fixed bodies
            case _:
                assert_never(belief)

    def _avoid(self, seen: Deviation) -> None:
        """Marks the spot of a strange body as taken; if it was the only spot, the body is set aside or else the station
        closed."""
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
        """Sets a strange body aside, after the part in the gripper; returns whether that succeeded."""
        try:
            if self.floor.bench.held is not None and not self.set_aside(seen.words):
                return False
            return self.work.clear_away(seen.name, seen.station)
        except Trouble as trouble:
            self._note(str(trouble))
            return False

    def _leave(self, part: int, seen: Deviation) -> None:
        """Gives up a part that cannot be taken up; if it lies in a machine, that is closed."""
        work = self.machines.work_on(part)
        left = self.given_up.as_left(part, astray=True)
        if work is not None and seen.sort == "part fallen":
            self.state.out[work.station] = f"{seen.name} lies in '{work.station}'"
        self.floor.take_out(self.state.name(part))
        self.given_up.lose(part, f"{seen.words}: {TO_DO[seen.sort]}", left)
        self._tell_seen(seen, "leaves it")

    def _follow(self, part: int, seen: Deviation, *, put_back: bool, unfinished: bool) -> None:
        """Lets a moved part be put back, or taken up where it stands.

        If its machine is done by now, and the part was not seen in it since, a note says that its processing is unknown.
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
        """Learns the problems that changed in the present scene. RunStopped if the scene allows no work."""
        floor, state = self.floor, self.state
        for deviation in fixed:
            self._tell_seen(deviation, "surveys the scene again, and learns what has changed")
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
        """Replans the remaining work from the reached state. Raises RunStopped if no order completes it.

        back: given-up parts that are to be brought on after all, with their positions.
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
            new_plan = plan_again(state.plan, mishaps, first, self.planner)
        except LabError as error:
            if first is None or not self.set_aside(why):
                raise RunStopped(f"{why}: {error}") from None
            self.replan(why, back)
            return
        for part, stuck in new_plan.stuck.items():
            if part not in state.lost:
                reasons = ", ".join(f"'{station}': {what}" for station, what in state.out.items())
                self.given_up.lose(part, f"{stuck}: {reasons}" if reasons else stuck)
        state.sequence = [*new_plan.sequence]
        state.go_by(new_plan.run, floor.now_s)
        gap = None
        if new_plan.schedule is not None:
            is_proven = new_plan.proven is not None and new_plan.proven.proven
            gap = None if new_plan.proven is None else new_plan.proven.gap(new_plan.schedule.makespan_s)
            plan = new_plan.schedule.later(now_s)
            floor.tell(PlanMade(plan, len(state.sequence), gap, is_proven, now_s, why, new_plan.method))
        if new_plan.method:
            state.replanned.append(Replanned(now_s, why, new_plan.method, len(state.sequence), gap))

    def set_aside(self, why: str) -> bool:
        """Sets down the part in the gripper, which cannot be brought on now; returns whether that succeeded."""
        held = self.floor.bench.held
        if held is None or not self.work.set_aside():
            return False
        self._tell(Trouble(why, held), "sets it down again")
        return True

    # ---- parts that were given up ----------------------------------------------------------------------------------

    def find_again(self, attended: bool = False) -> bool:
        """Returns given-up parts that can now be brought on to the job; returns whether there are any.

        Unattended, these are parts that could not be taken up. Attended, after a person has put things right, they include those
        that stand where they were left, as in a machine that was out of order. Machines restart their unfinished work.
        If no order brings the parts on, they are given up as before.
        """
        state, parts = self.state, self.given_up
        ready = parts.found(attended)
        why = {part: state.lost[part] for part in ready}
        for part, left in ready.items():
            parts.take_back(part, left)
            self._tell(Trouble("it can be taken up again", state.name(part)), "goes on with it")
        try:
            if ready:
                self.replan("a part can be taken up again", {part: left.position for part, left in ready.items()})
        except RunStopped as stopped:
            self._note(str(stopped))
            for part, left in ready.items():
                self.given_up.lose(part, why[part], left)
            return False
        return bool(ready)

    def forget(self) -> None:
        """Reopens closed stations and resets the counts of tries, after a person has put things right."""
        self._let_go_of_what_is_gone()
        self.state.out.clear()
        self.state.tries.clear()
        self.state.first.clear()

    def _let_go_of_what_is_gone(self) -> None:
        """Believes the gripper to be empty if it has lost its part."""
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
