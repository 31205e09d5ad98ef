"""A scene with the crew at work in it, and the durations that are measured there."""

from collections.abc import Callable

from lab.errors import WorkFailed
from lab.production.durations import Durations
from lab.production.recorder import Recorder, Viewer
from lab.production.skillset import Crew
from lab.sim.scene import Layout, Scene, Spot, spots
from lab.sim.world import TIME_STEP, World
from lab.skills import Butter, Grasp, Place, Skill
from lab.skills.skill import Bench, Status
from lab.skills.surveys import Surveys

_SETTLE_STEPS = 60


class Line:
    """A scene with the crew at work in it: one clock, the robot's skill and the machines' processes side by side."""

    def __init__(
        self, world: World, crew: Crew, layout: Layout, toasts: int, *, film: bool = False, viewer: Viewer | None = None
    ) -> None:
        """Build the scene and let it settle; `film` keeps frames, `viewer` sees them live."""
        self.world, self.crew = world, crew
        self.scene = Scene(world, crew.task, toasts, layout)
        self.bench = Bench(self.scene)
        self.machines: dict[str, Skill] = {}
        self.on_tick: Callable[[], None] | None = None
        for _ in range(_SETTLE_STEPS):
            world.step()
        self.recorder = Recorder(world, toasts, viewer) if film or viewer else None
        self._zero = world.steps

    @property
    def now_s(self) -> float:
        """Seconds since the line was ready."""
        return (self.world.steps - self._zero) * TIME_STEP

    def restart_clock(self) -> None:
        """Let the line's time begin now."""
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

    def run(self, skill: Skill) -> Status:
        """Carry one skill out to its end."""
        skill.start(self.bench, self.crew.policies[skill.name])
        while skill.step() is Status.RUNNING:
            self.tick()
        return skill.status

    def at(self, place: str, surveys: Surveys) -> None:
        """Put the arm above a station, to begin there."""
        self.scene.robot.stand(surveys.approach(place))
        self.scene.robot.open_at_once()
        for _ in range(_SETTLE_STEPS // 4):
            self.tick()


def measure(crew: Crew, surveys: Surveys, on_move: Callable[[str, float], None] | None = None) -> Durations:
    """Carry every needed move out once in simulation and time it [s]; WorkFailed when one does not succeed."""
    tell = on_move or (lambda name, seconds: None)
    empty: dict[tuple[str, str], float] = {}
    loaded: dict[tuple[str, str], float] = {}
    process: dict[str, float] = {}
    steps = 0
    for origin, target in crew.moves.loaded:
        with World() as world:
            line = Line(world, crew, surveys.layout, 0)
            line.scene.add_slice("slice 1", spots(crew.task.station(origin))[0])
            line.at(origin, surveys)
            start = line.now_s
            for skill in crew.leg(origin, target):
                _timed(line, aimed(skill, "slice 1", None))
            loaded[origin, target] = line.now_s - start
            tell(f"{origin} > {target}, loaded", loaded[origin, target])
            if crew.task.station(target).process == "butter" and target not in process:
                start = line.now_s
                _timed(line, aimed(crew.skills[Butter(target).name], "slice 1", None))
                process[target] = line.now_s - start
                tell(f"butter at {target}", process[target])
            steps += world.steps
    with World() as world:
        line = Line(world, crew, surveys.layout, 0)
        for origin, target in crew.moves.empty:
            line.at(origin, surveys)
            start = line.now_s
            _timed(line, crew.empty(origin, target))
            empty[origin, target] = line.now_s - start
            tell(f"{origin} > {target}, empty", empty[origin, target])
        steps += world.steps
    return Durations(empty, loaded, process, steps * TIME_STEP)


def try_grasp(crew: Crew, surveys: Surveys, grasp: Grasp) -> str | None:
    """Carry a grasp out once in physics; None when the slice was lifted, else why it was not."""
    with World() as world:
        line = Line(world, crew, surveys.layout, 0)
        line.scene.add_slice("slice 1", spots(crew.task.station(grasp.station))[0])
        line.at(grasp.station, surveys)
        return None if line.run(grasp.take("slice 1")) is Status.SUCCESS else grasp.reason


def _timed(line: Line, skill: Skill) -> None:
    if line.run(skill) is not Status.SUCCESS:
        raise WorkFailed(f"measuring '{skill.name}': {skill.reason}")


def aimed(skill: Skill, name: str, spot: Spot | None) -> Skill:
    """Tell a skill which slice it is about, and where to set it down."""
    if isinstance(skill, Grasp):
        return skill.take(name)
    if isinstance(skill, Butter):
        return skill.on(name)
    if isinstance(skill, Place):
        skill.spot = spot
    return skill
