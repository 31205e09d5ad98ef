"""Parts in machines: they are begun alone or in batches, waited for, and fetched before they spoil."""

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

ON_TIME_S = 2 * TIME_STEP  # tolerance of a window: the end of a machine's work is noticed a step later
LATE_S = 1.0  # a machine with a longer delay is late


def watch_machines(state: RunState, floor: Floor) -> None:
    """Tells, after a physics step, which machines are done, and shows the finish of their parts.

    A machine is never done with a part that is seen elsewhere.
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
    """The longest stay [s] of a finished part in its machine, from the task; None: no limit."""
    routes = floor.scene.kind_of[name].part.routes
    own = [s.at_most_s for route in routes for s in route if s.station == station and s.at_most_s is not None]
    return own[0] if own else floor.skillset.task.station(station).at_most_s


@dataclass(frozen=True)
class PartsInMachines:
    """The work of machines on the parts that were brought to them, and the times by which parts must be fetched."""

    floor: Floor
    state: RunState

    def work_on(self, part: int) -> MachineWork | None:
        """The work of the machine in which a part stands, current or finished; None if it stands in none."""
        return self.floor.work_on(self.state.name(part))

    def taken_out(self) -> list[int]:
        """The finished parts that are no longer in their machine and not yet at their next station."""
        state, laid_out, names = self.state, self.state.cell.laid_out, self.state.cell.names
        places = [(part, place) for part, place in enumerate(state.plan.locations, 1) if place < len(laid_out)]
        in_machine = [part for part, place in places if names[laid_out[place].station] in self.floor.machines]
        return [part for part in in_machine if part not in state.to_put_back and self.work_on(part) is None]

    # ---- begun -----------------------------------------------------------------------------------------------------

    def brought(self, name: str, station: str, process_s: float, following: Sequence[int]) -> None:
        """Starts a machine's work on a part that was set down, alone, or with its batch if the part completes it.

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
        """Restarts a machine's work on a part that was put back; in a batch that waits, the part waits, too."""
        if self.state.cell.index(station) not in self.state.cell.batches:
            self.begin(name, station, process_s)
        elif self.floor.machines[station].works:
            self.state.waiting.add(name)
            self._begin_batch(station)

    def begin_again(self, part: int, stands: bool) -> None:
        """Restarts the machine's work on an unfinished part; stands: whether it is still there; else it is put back first."""
        name = self.state.name(part)
        way, process_s = self.state.brought[name]
        self.floor.take_out(name)
        if stands:
            self.begin(name, way.target, process_s)
        else:
            self.state.to_put_back.append(part)

    def begin(self, name: str, station: str, process_s: float) -> None:
        """Starts the work of a machine on a part; does nothing at another station."""
        floor = self.floor
        self.state.served.discard(name)
        if station in floor.machines:
            work = floor.begin(station, name, process_s)
            floor.tell(MachineBegan(station, name, work.begun_s, work.expected_s))

    def begin_batches(self) -> None:
        """Starts all waiting batches, because no more parts will come."""
        state = self.state
        for station in [state.cell.names[index] for index in sorted(state.cell.batches)]:
            if any(state.name(part) in state.waiting for part in state.plan.inside(state.cell.index(station))):
                self._begin_batch(station)

    def _begin_batch(self, station: str) -> None:
        """Starts a machine's work on all unfinished parts in it, for the longest of their times."""
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
        """Waits until the machine is done with a part. Raises Trouble if it fails, once if it is late, and if it is given
        up."""
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
        """The deliberate waits of the next decision, if its work at its origin begins at `at_s`, so that no part stays too long
        in a machine, by the times at which machines really began and ended."""
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
        """The time [s] at which the machine of a part is done with it; `else_s` for a part in no machine and for a spoilt
        one."""
        work, now_s = self.work_on(part), self.floor.now_s
        if work is None or part in self.state.spoilt:
            return else_s
        return work.until_s if work.done(now_s) else max(now_s, work.expected_s)

    def left_s(self, part: int) -> float:
        """The time [s] until the machine of a part should be done or, if it is late, is given up; negative: the time since it
        was done, for a part with a limited stay that is not spoilt."""
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
        """Marks a part as spoilt if it has stayed in its machine for longer than allowed."""
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
        """The skills of the robot's service at a station before it takes a part out."""
        return self.floor.skillset.services.get((self.state.cell.order[part - 1], station), ())

    def to_be_served(self, part: int, station: str) -> bool:
        """Whether the robot's service for a part at a station is still to be done."""
        return bool(self.service(part, station)) and self.state.name(part) not in self.state.served

    def fetched(self, name: str, station: str) -> None:
        """Notes that a part was taken out of a machine, and the real time of the machine's work on it."""
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
