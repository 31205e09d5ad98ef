"""Parts that stand in machines: begun alone or in batches, waited for, fetched before they spoil."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lab.production.floor import Floor
from lab.production.machine import NEVER, MachineWork
from lab.production.perception import look, moved_off
from lab.production.recorder import burnt_name, finish_name
from lab.production.run_state import RunState
from lab.production.trouble import Trouble
from lab.sequencing.simulate.follow import closes, waits_of
from lab.sequencing.simulate.run import NO_WAIT, Wait, branch
from lab.sim.world import TIME_STEP
from lab.skills import Skill
from lab.skills.skillset import WINDOW_MARGIN_S
from lab.teaching.events import MachineBegan, MachineDone, PartLost, TroubleMet

ON_TIME_S = 2 * TIME_STEP  # a window is kept that is not overrun by more: what a machine does is noticed a step later
LATE_S = 1.0  # a machine that takes so much longer than it should is late


def watch_machines(state: RunState, floor: Floor) -> None:
    """After each physics step: tell of machines that are done, and show what they have done to their parts.

    A machine is never done with a part that is seen not to stand in it.
    """
    now_s = floor.now_s
    for work in (work for machine in floor.machines.values() for work in machine.works.values()):
        if not work.told and work.done(now_s):
            if not floor.world.dark and moved_off(floor, work.part, state.spot_of.get(work.part)):
                work.until_s = NEVER
                continue
            work.told = True
            if work.skill is not None:
                work.until_s = now_s
            at_most_s = may_stay_s(floor, work.part, work.station)
            work.burns_s = NEVER if at_most_s is None else now_s + at_most_s
            floor.tell(MachineDone(work.station, work.part, now_s))
            if work.skill is None and floor.skillset.task.station(work.station).finish is not None:
                floor.show(finish_name(work.part, work.station))
        if now_s > work.burns_s:
            work.burns_s = NEVER
            floor.show(burnt_name(work.part, work.station))
        if work.skill is not None and work.moves:
            floor.show(*work.skill.shown())


def may_stay_s(floor: Floor, name: str, station: str) -> float | None:
    """How long a part may stay in a machine that is done with it, by the task [s]; None: as long as it is left there."""
    routes = floor.scene.kind_of[name].part.routes
    own = [s.at_most_s for route in routes for s in route if s.station == station and s.at_most_s is not None]
    return own[0] if own else floor.skillset.task.station(station).at_most_s


@dataclass(frozen=True)
class PartsInMachines:
    """What machines do with the parts that were brought to them, and when these have to be fetched."""

    floor: Floor
    state: RunState

    def work_on(self, part: int) -> MachineWork | None:
        """What the machine that a part stands in does with it, or has done; None where it stands in none."""
        return self.floor.work_on(self.state.name(part))

    def taken_out(self) -> list[int]:
        """The parts that a machine is done with and that are not in it any more, though not at their next station either."""
        state, laid_out, names = self.state, self.state.cell.laid_out, self.state.cell.names
        places = [(part, place) for part, place in enumerate(state.plan.locations, 1) if place < len(laid_out)]
        in_machine = [part for part, place in places if names[laid_out[place].station] in self.floor.machines]
        return [part for part in in_machine if part not in state.to_put_back and self.work_on(part) is None]

    # ---- begun -----------------------------------------------------------------------------------------------------

    def brought(self, name: str, station: str, process_s: float, following: Sequence[int]) -> None:
        """A part was set down at a station: let a machine begin with it, alone, or with its batch where it closes that.

        following: the decisions after the one that brought it.
        """
        state, index = self.state, self.state.cell.index(station)
        if index not in state.cell.batches:
            self.begin(name, station, process_s)
            return
        state.waiting.add(name)
        if closes(state.plan, index, following):
            self._begin_batch(station)

    def brought_back(self, name: str, station: str, process_s: float) -> None:
        """A part was put back into a machine, which begins anew; with a batch that waits it waits, too."""
        if self.state.cell.index(station) not in self.state.cell.batches:
            self.begin(name, station, process_s)
        elif self.floor.machines[station].works:
            self.state.waiting.add(name)
            self._begin_batch(station)

    def begin_again(self, part: int, stands: bool) -> None:
        """Let the machine begin a part anew that it had not finished; stands: where it was brought, else it is put back first."""
        name = self.state.name(part)
        way, process_s = self.state.brought[name]
        self.floor.take_out(name)
        if stands:
            self.begin(name, way.target, process_s)
        else:
            self.state.to_put_back.append(part)

    def begin(self, name: str, station: str, process_s: float) -> None:
        """Let the machine begin that a part has been brought to; at another station nothing begins."""
        floor = self.floor
        self.state.served.discard(name)
        if station in floor.machines:
            work = floor.begin(station, name, process_s)
            floor.tell(MachineBegan(station, name, work.begun_s, work.expected_s))

    def begin_batches(self) -> None:
        """Let machines begin with the parts that wait in them for others of their batch: nothing more is to come."""
        state = self.state
        for station in [state.cell.names[index] for index in sorted(state.cell.batches)]:
            if any(state.name(part) in state.waiting for part in state.plan.inside(state.cell.index(station))):
                self._begin_batch(station)

    def _begin_batch(self, station: str) -> None:
        """Let a machine begin with all parts in it that it is not done with, for the longest of their times."""
        state = self.state
        inside = [part for part in state.plan.inside(state.cell.index(station)) if part not in state.to_put_back]
        working = {name for name, work in self.floor.machines[station].works.items() if not work.done(self.floor.now_s)}
        names = [name for name in map(state.name, inside) if name in state.waiting | working]
        longest_s = max((state.brought[name][1] for name in names), default=0.0)
        for name in names:
            self.begin(name, station, longest_s)
        state.waiting -= {*names}

    # ---- waited for ------------------------------------------------------------------------------------------------

    def wait_for(self, name: str, station: str) -> None:
        """Wait until the machine is done with a part. Raises Trouble when it fails, once when it is late, and when it takes far
        too long."""
        floor, work = self.floor, self.floor.work_on(name)
        if work is None or work.station != station:
            return
        while not work.done(floor.now_s):
            if work.failed:
                raise Trouble(work.failed, name, station)
            late_s = floor.now_s - work.expected_s
            if floor.now_s > work.given_up_s:
                raise Trouble(f"it is not done {late_s:.0f} s after it should be", name, station, kind="final")
            if late_s > LATE_S and not work.late:
                work.late = True
                raise Trouble("it is not done when it should be", name, station, kind="late")
            floor.wait(work.expected_s if late_s < 0 else floor.now_s + 1.0)
            look(floor, self.state)

    def waits(self, sequence: Sequence[int], origin: str, at_s: float) -> Wait:
        """How long the first of the decisions still to come has to wait on purpose, if its work at its origin begins at a time:
        so that no part is left too long in a machine, by what the machines have really begun and done."""
        state = self.state
        if not state.plan.cell.has_windows:
            return NO_WAIT
        run = branch(state.plan)
        run.robots_at, run.robots_s = [state.cell.index(origin)], [at_s]
        run.ready_s = [self.ready_s(part, at_s) for part in range(1, state.cell.parts + 1)]
        for beyond_s in (0.0, WINDOW_MARGIN_S):
            if waits := waits_of(run, sequence, beyond_s):
                return waits[0]
        return NO_WAIT

    def ready_s(self, part: int, else_s: float) -> float:
        """When the machine that a part stands in is done with it; of a part that stands in none, and of a spoilt one, another
        time."""
        work, now_s = self.work_on(part), self.floor.now_s
        if work is None or part in self.state.spoilt:
            return else_s
        return work.until_s if work.done(now_s) else max(now_s, work.expected_s)

    def left_s(self, part: int) -> float:
        """How long until the machine of a part should be done, or, when it is late, is given up [s]; below 0: it has been done
        for so long, and the part must not wait on without end. A spoilt part may."""
        work, now_s = self.work_on(part), self.floor.now_s
        assert work is not None
        if not work.done(now_s):
            return max(0.0, (work.given_up_s if work.late else work.expected_s) - now_s)
        left_s = work.until_s - now_s
        self.check_window(part)
        waits = self.state.cell.at_most_s(part, work.station) is None or part in self.state.spoilt
        return max(0.0, left_s) if waits else left_s

    # ---- fetched ---------------------------------------------------------------------------------------------------

    def check_window(self, part: int) -> None:
        """Notice a part that its machine has been done with for longer than it may stay there: it is spoilt."""
        floor, state, work, name = self.floor, self.state, self.work_on(part), self.state.name(part)
        if work is None or part in state.spoilt or work.moves:
            return
        at_most_s, late_s = may_stay_s(floor, name, work.station), floor.now_s - work.until_s
        if at_most_s is None or late_s <= at_most_s + ON_TIME_S:
            return
        what = f"it is burnt: fetched {late_s:.1f} s after it was done, allowed are {at_most_s:g}"
        state.spoilt[part] = f"{name} at '{work.station}': {what}"
        floor.tell(TroubleMet(what, "brings it on, but it counts as lost", name, work.station, floor.now_s))
        floor.tell(PartLost(name, what, floor.now_s))

    def service(self, part: int, station: str) -> Sequence[Skill]:
        """What the robot does at a station before it takes a part out."""
        return self.floor.skillset.services.get((self.state.cell.order[part - 1], station), ())

    def to_be_served(self, part: int, station: str) -> bool:
        """Whether the robot has yet to do something at a station for a part that is there."""
        return bool(self.service(part, station)) and self.state.name(part) not in self.state.served

    def fetched(self, name: str, station: str) -> None:
        """A part was taken out of a machine: note for how long that has really worked on it."""
        self._note_work(name)
        self.floor.machines[station].clear(name)

    def _note_work(self, name: str) -> None:
        state, work = self.state, self.floor.work_on(name)
        own = [n for n, move in enumerate(state.moves) if move.carries == "part" and state.name(move.part) == name]
        if work is None or not own or not work.done(self.floor.now_s):
            return
        brought = state.moves[own[-1]]
        batch = state.cell.index(brought.target) in state.cell.batches
        worked_s = work.until_s - (work.begun_s if batch else brought.drop_s)
        if abs(worked_s - brought.process_s) > TIME_STEP:
            state.moves[own[-1]] = replace(brought, process_s=worked_s)
