"""A scene in which the robot and the machines work under one clock, and their stops."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil
from time import perf_counter

from lab.errors import WorkFailed
from lab.production.controls import Controls, StopKind, StopRecord, StopsChanged, unwritten
from lab.production.machine import Machine, MachineWork
from lab.production.recorder import Recorder, Viewer, extras_of
from lab.production.trouble import Kind
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, Array, World
from lab.skills import Skill
from lab.skills.sight import SkillFailed
from lab.skills.skill import SETTLE_STEPS, STAND_STEPS, Bench, Status
from lab.skills.skillset import SkillSet
from lab.tasks.task import Order
from lab.teaching.events import Event, RunHeld, RunWentOn

AT_REST_STEPS = 60  # physics steps at the end of a wait that are simulated in any case
SKIPPED_STEPS = 240  # longest wait without a check for other events
FORCE_EVERY = 4  # physics steps between two checks of the contact force on the arm
BRAKE_ITERATIONS = 300  # of the solver: with 60, the joints of a seven-axis arm creep at a tenth of their speed
BACK_STEPS = 120  # physics steps of its path that the arm retracts after a stop by a force
DISTURBED_S = 2.0  # time for which everything is simulated after a hand has reached in


def untouched(floor: "Floor") -> bool:
    """Returns False: nobody reaches into the scene."""
    return False


def _unwatched(floor: "Floor") -> None:
    """Does nothing: nobody watches the steps."""


def idle() -> bool:
    """Returns False: nobody does anything by hand."""
    return False


def _unheard(event: Event, step: int) -> None:
    """Does nothing: nobody listens."""


@dataclass(frozen=True)
class Hooks:
    """The functions that a floor calls; by default they do nothing.

    before_step: before each physics step, to change the scene as a fault does; returns whether it did.
    after_step: after each physics step.
    meanwhile: between moves and during a pause, for the operator's work by hand; returns whether there was any.
    hear: for each event, with its physics step.
    note_stops: for each change of the stops, before it takes effect.
    """

    before_step: "Callable[[Floor], bool]" = untouched
    after_step: "Callable[[Floor], None]" = _unwatched
    meanwhile: Callable[[], bool] = idle
    hear: Callable[[Event, int], None] = _unheard
    note_stops: Callable[[StopsChanged], None] = unwritten


NO_HOOKS = Hooks()


class Floor:
    """A scene in which skills are carried out: one clock, the robot's skill and the machines' processes side by side.

    controls: its stops and its pace. stops: the steps at which it was stopped. hooks: the functions that it calls.
    """

    def __init__(
        self,
        world: World,
        skillset: SkillSet,
        layout: Layout,
        order: Order = (),
        *,
        parts: int = 0,
        controls: Controls | None = None,
        hooks: Hooks = NO_HOOKS,
    ) -> None:
        """Builds the scene and lets it settle without hooks; parts: the number for which stations are built (see `Scene`)."""
        self.world, self.skillset = world, skillset
        self.scene = Scene(world, skillset.task, order, layout, parts)
        self.bench = Bench(self.scene)
        self.machines = {s.name: Machine(s.name) for s in skillset.task.stations if s.kind == "machine"}
        self.hooks, self.controls = hooks, controls or Controls()
        self.stops = StopRecord(note=hooks.note_stops)
        self.pressing_n = 0.0  # force beyond the task's limit, so that a stopped arm can move away
        self.was_held = False  # whether the operator stopped the last motion
        self._trail: deque[Array] = deque(maxlen=BACK_STEPS // FORCE_EVERY)  # the joint positions of the last steps
        for _ in range(SETTLE_STEPS):
            world.step()
        self.recorder: Recorder | None = None
        self.restart_clock()
        self.skipped_s = 0.0
        self._quiet_s = 0.0  # the time from which on waiting may be skipped
        self._told_held = ""
        self._paced = (0.0, 0.0, 0.0)  # the speed, with the simulated and the real time from which on it applies

    @property
    def trouble_kind(self) -> Kind:
        """The kind of a trouble in the last motion: "held" if the operator stopped the arm, otherwise "missed"."""
        return "held" if self.was_held else "missed"

    def record(self, viewer: Viewer | None = None) -> Recorder:
        """The recorder that keeps frames of all bodies from now on; `viewer` shows them live."""
        self.recorder = Recorder(self.world, extras_of(self.scene, self.skillset), viewer)
        return self.recorder

    def show(self, *names: str) -> None:
        """Shows extra bodies on their parts from now on if frames are kept (see `extras_of`)."""
        if self.recorder is not None:
            for name in names:
                self.recorder.show(name)

    @property
    def now_s(self) -> float:
        """Seconds since the floor was ready."""
        return self.steps * TIME_STEP

    @property
    def steps(self) -> int:
        """Physics steps since the floor was ready."""
        return self.world.steps - self._zero

    def restart_clock(self) -> None:
        """Restarts the floor's time at 0."""
        self._zero = self.world.steps

    def tell(self, event: Event) -> None:
        """Passes an event to the listener."""
        self.hooks.hear(event, self.steps)

    # ---- one step ------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Makes one physics step, with every running machine."""
        self._reached_in()
        for machine in self.machines.values():
            machine.step()
        self.world.step()
        self._after()

    def wait(self, until_s: float) -> None:
        """Makes one physics step; while nothing moves, skips the time until then without physics, at most one second."""
        steps = min(ceil((until_s - self.now_s) / TIME_STEP) - AT_REST_STEPS, SKIPPED_STEPS)
        still = self.now_s >= self._quiet_s and not any(machine.moves for machine in self.machines.values())
        if steps > 0 and still and not self._reached_in():
            self.skipped_s += steps * TIME_STEP
            self.world.pass_time(steps)
            self._after()
        else:
            self.tick()
        self.held()

    def _reached_in(self) -> bool:
        if self.hooks.before_step(self):
            self._quiet_s = self.now_s + DISTURBED_S
            return True
        return False

    def _after(self) -> None:
        self.hooks.after_step(self)
        if self.recorder is not None:
            self.recorder.step()
        self._pace()

    def _pace(self) -> None:
        """Waits until real time has caught up with simulated time, if a speed is set; a stop ends the wait."""
        speed = None if self.stops.folding else self.controls.speed
        if not speed:
            self._paced = (0.0, 0.0, 0.0)
            return
        if self._paced[0] != speed:
            self._paced = (speed, self.now_s, perf_counter())
        _, simulated_s, real_s = self._paced
        ahead_s = (self.now_s - simulated_s) / speed - (perf_counter() - real_s)
        if ahead_s > 0.004:
            self.controls.wait(ahead_s)
        elif ahead_s < -1.0:  # it cannot reach this speed: lost time is not made up for
            self._paced = (speed, self.now_s, perf_counter())

    # ---- stops ---------------------------------------------------------------------------------------------------

    def held(self) -> str:
        """Holds the arm as long as an emergency or protective stop lasts; returns the reason, or "" without a stop.

        The brakes act in the same physics step. Simulated time continues, at most as fast as real time.
        """
        if not self._stopped():
            return ""
        held = self.stops.held
        assert held is not None
        why = f"{held.kind} stop: {held.why}"
        self.scene.robot.brake()
        before = self.world.at_least(BRAKE_ITERATIONS)
        try:
            while self._stopped():
                self._tell_held()
                self.tick()
                if not self.stops.folding:
                    self.controls.wait(TIME_STEP)
        finally:
            self.world.iterations(before)
        self.between_moves()
        return why

    def protected(self, why: str) -> bool:
        """Holds a protective stop until somebody releases it; returns False without a stop if nobody attends the run.

        A run that is repeated from its journal counts as attended if it was stopped at this step.
        """
        if not self.stops.folding:
            if not self.controls.attended:
                return False
            self.controls.protective(why)
        return bool(self.held())

    def between_moves(self) -> None:
        """Waits as long as a pause lasts; simulated time stands still."""
        while self.hooks.meanwhile() or (
            self.stops.look(self.steps, self.controls) and self.stops.pauses(self.controls)
        ):
            self._tell_held()
            self.controls.wait(0.0 if self.stops.folding else 0.1)
        self._tell_held()
        self._paced = (0.0, 0.0, 0.0)

    def _stopped(self) -> bool:
        """Whether the arm must stand still now."""
        return self.stops.look(self.steps, self.controls) and self.stops.holds_arm

    def _tell_held(self) -> None:
        held = self.stops.held
        text = "" if held is None else f"{held.kind} {held.why}"
        if text != self._told_held:
            self._told_held = text
            self.tell(RunWentOn(self.now_s) if held is None else RunHeld(held.kind, held.why, held.by, self.now_s))

    def _too_hard(self) -> str:
        """The name of the body on which the arm presses harder than the task allows; "" for none."""
        if self.steps % FORCE_EVERY:
            return ""
        robot = self.scene.robot
        self._trail.append(self.world.joints(NAME, robot.arm.joints))
        body, force_n = self.world.pressed(NAME)
        limit_n = self.scene.stops_at_n + self.pressing_n
        return f"the arm presses on '{body}' with {force_n:.0f} N, allowed are {limit_n:g}" if force_n > limit_n else ""

    def _back_off(self) -> None:
        """Retracts the arm a little along its path after a contact."""
        while self._trail:
            self.world.drive(NAME, self.scene.robot.arm.joints, self._trail.pop())
            for _ in range(FORCE_EVERY):
                self.tick()

    # ---- skills --------------------------------------------------------------------------------------------------

    def start(self, skill: Skill) -> None:
        """Starts a skill with its policy."""
        skill.start(self.bench, self.skillset.policies[skill.name])

    def run(self, skill: Skill) -> Status:
        """Carries one skill out and returns its status, which is failed if it was stopped or is blocked."""
        if why := self.skillset.blocked.get(skill.name):
            skill.fail(why)
            return skill.status
        self.start(skill)
        self.was_held = False
        while skill.step() is Status.RUNNING:
            if why := self._stopped_by():
                skill.fail(why)
                break
            self.tick()
        return skill.status

    def follow(self, motion: Iterator[None]) -> str:
        """Carries out a motion of the arm that is no skill; returns what stopped it, or ""."""
        self.was_held = False
        try:
            for _ in motion:
                if why := self._stopped_by():
                    return why
                self.tick()
        except (SkillFailed, WorkFailed) as failure:
            return str(failure)
        return ""

    def _stopped_by(self) -> str:
        """Holds the current motion during a stop; returns what stopped it once that is over, or ""."""
        if why := self.held():
            self.was_held = True
            return why
        if too_hard := self._too_hard():
            self.scene.robot.brake()
            self._back_off()
            self.protected(too_hard)
            return f"{StopKind.PROTECTIVE} stop: {too_hard}"
        return ""

    def begin(self, station: str, part: str, seconds: float) -> MachineWork:
        """Starts a machine's work on a part: its learned process, or a processing time [s]."""
        skills = self.skillset.processes[station]
        work = self.machines[station].begin(part, self.now_s, seconds, skills[0] if skills else None)
        self.again(work)
        return work

    def again(self, work: MachineWork) -> None:
        """Restarts a machine's process from the beginning."""
        if work.skill is not None:
            work.start(self.bench, self.skillset.policies[work.skill.name])

    def work_on(self, part: str) -> MachineWork | None:
        """The work of the machine in which a part stands, current or finished; None if it stands in none."""
        return next((m.works[part] for m in self.machines.values() if part in m.works), None)

    def take_out(self, part: str) -> None:
        """Notes that a part is no longer in a machine."""
        for machine in self.machines.values():
            machine.clear(part)

    def stand(self, pose: ToolPose) -> None:
        """Places the open gripper at a pose without motion, to begin there; no hook is called."""
        self.scene.robot.stand(pose)
        self.scene.robot.open_at_once()
        for _ in range(STAND_STEPS):
            self.world.step()
            if self.recorder is not None:
                self.recorder.step()
