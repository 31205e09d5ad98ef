"""A scene with the robot and the machines at work in it, under one clock, and what stops them."""

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
SKIPPED_STEPS = 240  # at the most without a look at what else goes on
FORCE_EVERY = 4  # physics steps between two looks at what presses on the arm
BRAKE_ITERATIONS = 300  # of the solver: with 60 the joints of an arm that has seven creep on at a tenth of their speed
BACK_STEPS = 120  # physics steps of its way that the arm goes back when it was stopped by a force
DISTURBED_S = 2.0  # after a hand has reached into the scene, all of it is simulated for so long


def untouched(floor: "Floor") -> bool:
    """Nobody reaches into the scene."""
    return False


def _unwatched(floor: "Floor") -> None:
    """Nobody looks at what a step has done."""


def idle() -> bool:
    """Nobody does anything by hand."""
    return False


def _unheard(event: Event, step: int) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class Hooks:
    """Whom a floor calls, and when; by default nobody.

    before_step: before each physics step, to reach into the scene as a fault does; returns whether it did.
    after_step: after each physics step.
    meanwhile: between moves and while a pause lasts, for what the operator does by hand; returns whether that was anything.
    hear: for each event that is told, with the physics step at which it happened.
    note_stops: for each change of the stops, before it counts.
    """

    before_step: "Callable[[Floor], bool]" = untouched
    after_step: "Callable[[Floor], None]" = _unwatched
    meanwhile: Callable[[], bool] = idle
    hear: Callable[[Event, int], None] = _unheard
    note_stops: Callable[[StopsChanged], None] = unwritten


NO_HOOKS = Hooks()


class Floor:
    """A scene in which skills are carried out: one clock, the robot's skill and the machines' processes side by side.

    controls: what stops it and sets its pace. stops: at which steps they did. hooks: who is called as its time goes by.
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
        """Build the scene and let it settle, with nobody called; parts: for how many stations are built (see `Scene`)."""
        self.world, self.skillset = world, skillset
        self.scene = Scene(world, skillset.task, order, layout, parts)
        self.bench = Bench(self.scene)
        self.machines = {s.name: Machine(s.name) for s in skillset.task.stations if s.kind == "machine"}
        self.hooks, self.controls = hooks, controls or Controls()
        self.stops = StopRecord(note=hooks.note_stops)
        self.pressing_n = 0.0  # allowed on top of the task's limit, so that the arm gets away from where it was stopped
        self.was_held = False  # by the operator, in the last motion
        self._trail: deque[Array] = deque(maxlen=BACK_STEPS // FORCE_EVERY)  # the joints on the last steps of the way
        for _ in range(SETTLE_STEPS):
            world.step()
        self.recorder: Recorder | None = None
        self.restart_clock()
        self.skipped_s = 0.0
        self._quiet_s = 0.0  # from when on waiting may be skipped
        self._told_held = ""
        self._paced = (0.0, 0.0, 0.0)  # speed, simulated and real time from which on it holds

    @property
    def trouble_kind(self) -> Kind:
        """The kind of a trouble in the last motion: "held" if the operator stopped the arm, otherwise "missed"."""
        return "held" if self.was_held else "missed"

    def record(self, viewer: Viewer | None = None) -> Recorder:
        """What keeps frames from now on, of all that is there; `viewer` sees them live."""
        self.recorder = Recorder(self.world, extras_of(self.scene, self.skillset), viewer)
        return self.recorder

    def show(self, *names: str) -> None:
        """Show extra bodies on their parts from now on, where frames are kept (see `extras_of`)."""
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
        """Let the floor's time begin now."""
        self._zero = self.world.steps

    def tell(self, event: Event) -> None:
        """Tell what happened."""
        self.hooks.hear(event, self.steps)

    # ---- one step ------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """One physics step, with every running machine."""
        self._reached_in()
        for machine in self.machines.values():
            machine.step()
        self.world.step()
        self._after()

    def wait(self, until_s: float) -> None:
        """One physics step, or, while nothing moves, the time until then without physics, a second at the most."""
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
        """Wait until real time has caught up with simulated time, where a speed is set; a stop ends the waiting."""
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
        elif ahead_s < -1.0:  # it cannot be so fast: what is lost is not made up for
            self._paced = (speed, self.now_s, perf_counter())

    # ---- stops ---------------------------------------------------------------------------------------------------

    def held(self) -> str:
        """Hold the arm as long as an emergency or protective stop lasts; returns why it was held, "" when it was not.

        The brakes act in the same physics step. Simulated time goes on, not faster than real time.
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
        """Hold a protective stop until somebody lets the run go on; False, and nothing is stopped, where nobody attends the run.

        A run that is replayed from its journal was attended if it was stopped at this step.
        """
        if not self.stops.folding:
            if not self.controls.attended:
                return False
            self.controls.protective(why)
        return bool(self.held())

    def between_moves(self) -> None:
        """Wait as long as a pause lasts; simulated time stands still."""
        while self.hooks.meanwhile() or (
            self.stops.look(self.steps, self.controls) and self.stops.pauses(self.controls)
        ):
            self._tell_held()
            self.controls.wait(0.0 if self.stops.folding else 0.1)
        self._tell_held()
        self._paced = (0.0, 0.0, 0.0)

    def _stopped(self) -> bool:
        """Whether the arm is to stand still now."""
        return self.stops.look(self.steps, self.controls) and self.stops.holds_arm

    def _tell_held(self) -> None:
        held = self.stops.held
        text = "" if held is None else f"{held.kind} {held.why}"
        if text != self._told_held:
            self._told_held = text
            self.tell(RunWentOn(self.now_s) if held is None else RunHeld(held.kind, held.why, held.by, self.now_s))

    def _too_hard(self) -> str:
        """What the arm presses on harder than the task allows; "" for nothing."""
        if self.steps % FORCE_EVERY:
            return ""
        robot = self.scene.robot
        self._trail.append(self.world.joints(NAME, robot.arm.joints))
        body, force_n = self.world.pressed(NAME)
        limit_n = self.scene.stops_at_n + self.pressing_n
        return f"the arm presses on '{body}' with {force_n:.0f} N, allowed are {limit_n:g}" if force_n > limit_n else ""

    def _back_off(self) -> None:
        """Go back a little along the path on which the arm pressed on something."""
        while self._trail:
            self.world.drive(NAME, self.scene.robot.arm.joints, self._trail.pop())
            for _ in range(FORCE_EVERY):
                self.tick()

    # ---- skills --------------------------------------------------------------------------------------------------

    def start(self, skill: Skill) -> None:
        """Begin to carry a skill out with its policy."""
        skill.start(self.bench, self.skillset.policies[skill.name])

    def run(self, skill: Skill) -> Status:
        """Carry one skill out to its end; its status. It has failed where something stopped it, and where it is blocked."""
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
        """Carry out a motion of the arm that is no skill; returns what stopped it, "" when nothing did."""
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
        """Hold the motion under way where something stops it; returns what did once that is over, "" when nothing did."""
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
        """Let a machine begin with a part: with its learned process, or for so long [s]."""
        skills = self.skillset.processes[station]
        work = self.machines[station].begin(part, self.now_s, seconds, skills[0] if skills else None)
        self.again(work)
        return work

    def again(self, work: MachineWork) -> None:
        """Let a machine carry its process out, from the beginning."""
        if work.skill is not None:
            work.start(self.bench, self.skillset.policies[work.skill.name])

    def work_on(self, part: str) -> MachineWork | None:
        """What the machine that a part stands in does with it, or has done; None where it stands in none."""
        return next((m.works[part] for m in self.machines.values() if part in m.works), None)

    def take_out(self, part: str) -> None:
        """Note that a part is in no machine any more."""
        for machine in self.machines.values():
            machine.clear(part)

    def stand(self, pose: ToolPose) -> None:
        """Put the open gripper at once to a pose, to begin there; no hook is called meanwhile."""
        self.scene.robot.stand(pose)
        self.scene.robot.open_at_once()
        for _ in range(STAND_STEPS):
            self.world.step()
            if self.recorder is not None:
                self.recorder.step()
