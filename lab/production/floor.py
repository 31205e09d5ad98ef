"""A scene with the robot and the machines at work in it: who is where, at one clock."""

from collections.abc import Callable
from math import ceil

from lab.production.recorder import Recorder, Viewer, extras_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills import Skill
from lab.skills.skill import SETTLE_STEPS, STAND_STEPS, Bench, Status
from lab.skills.skillset import SkillSet
from lab.tasks.task import Order

AT_REST_STEPS = 60  # physics steps at the end of a wait that are simulated in any case


class Floor:
    """A scene in which skills are carried out: one clock, the robot's skill and the machines' processes side by side."""

    def __init__(
        self,
        world: World,
        skillset: SkillSet,
        layout: Layout,
        order: Order = (),
        *,
        film: bool = False,
        viewer: Viewer | None = None,
    ) -> None:
        """Build the scene and let it settle; `film` keeps frames, `viewer` sees them live."""
        self.world, self.skillset = world, skillset
        self.scene = Scene(world, skillset.task, order, layout)
        self.bench = Bench(self.scene)
        self.machines: dict[str, Skill] = {}
        self.on_tick: Callable[[], None] | None = None
        for _ in range(SETTLE_STEPS):
            world.step()
        self.recorder = Recorder(world, extras_of(self.scene, skillset), viewer) if film or viewer else None
        self._zero = world.steps
        self.skipped_s = 0.0

    @property
    def now_s(self) -> float:
        """Seconds since the floor was ready."""
        return (self.world.steps - self._zero) * TIME_STEP

    def restart_clock(self) -> None:
        """Let the floor's time begin now."""
        self._zero = self.world.steps

    def tick(self) -> None:
        """One physics step, with every running machine."""
        for machine in self.machines.values():
            machine.step()
        self.world.step()
        if self.on_tick is not None:
            self.on_tick()
        if self.recorder is not None:
            self.recorder.step()

    def wait(self, until_s: float) -> None:
        """One physics step, or, when no machine's head moves, all of the time until then: nothing happens meanwhile."""
        steps = ceil((until_s - self.now_s) / TIME_STEP) - AT_REST_STEPS
        if steps > 0 and not any(machine.status is Status.RUNNING for machine in self.machines.values()):
            self.skipped_s += steps * TIME_STEP
            self.world.pass_time(steps)
        self.tick()

    def start(self, skill: Skill) -> None:
        """Begin to carry a skill out with its policy."""
        skill.start(self.bench, self.skillset.policies[skill.name])

    def run(self, skill: Skill) -> Status:
        """Carry one skill out to its end."""
        self.start(skill)
        while skill.step() is Status.RUNNING:
            self.tick()
        return skill.status

    def stand(self, pose: ToolPose) -> None:
        """Put the open gripper at once to a pose, to begin there."""
        self.scene.robot.stand(pose)
        self.scene.robot.open_at_once()
        for _ in range(STAND_STEPS):
            self.tick()
