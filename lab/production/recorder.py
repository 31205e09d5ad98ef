"""The frames of a run's world, and the extra bodies of a viewer: the finish that machines have left on parts."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from lab.sim.frames import Body, Frame, Recording, Rgba, Shape
from lab.sim.parts.kinds import Kind
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills.skillset import SkillSet
from lab.tasks.task import Order, Task

FRAME_EVERY = 24  # physics steps: ten frames a simulated second
RIM_M, PROUD_M = 0.022, 0.0016  # [m] total rim that the finish of a flat part leaves free, and its extra thickness
LEAST = 0.8  # least share of an edge that it covers
BURNT: Rgba = (0.10, 0.08, 0.07, 1.0)
LARGER = 1.01  # factor of the size of another part's finish


class Viewer(Protocol):
    """A live viewer."""

    def show(self, bodies: tuple[Body, ...]) -> None:
        """Shows these bodies."""

    def update(self, frame: Frame) -> None:
        """Moves the bodies to their poses in this frame."""


@dataclass
class Recorder:
    """Takes a frame every FRAME_EVERY steps, which a viewer gets at once; `show` changes the looks of parts.

    extras: the extra bodies that may be shown on a part, by part.
    """

    world: World
    extras: Mapping[str, tuple[Body, ...]] = field(default_factory=dict)
    viewer: Viewer | None = None
    _shown: dict[str, str] = field(default_factory=dict)  # extra body -> the part that carries it

    def __post_init__(self) -> None:
        self._carrier = {body.name: part for part, bodies in self.extras.items() for body in bodies}
        self.bodies = (*self.world.bodies(), *(body for bodies in self.extras.values() for body in bodies))
        self.recording = Recording(self.bodies)
        self._start = self.world.steps
        self._pending = dict.fromkeys(self._carrier, False)
        if self.viewer is not None:
            self.viewer.show(self.bodies)

    def step(self) -> None:
        """Takes a frame if it is due; called after each physics step."""
        if (self.world.steps - self._start) % FRAME_EVERY == 0:
            self.take()

    def take(self) -> None:
        """Takes a frame now."""
        poses = self.world.poses()
        for name, part in self._shown.items():
            poses[name] = poses[part]
        pending, self._pending = self._pending, {}
        made = Frame((self.world.steps - self._start) * TIME_STEP, poses, visible=pending)
        self.recording.frames.append(made)
        if self.viewer is not None:
            self.viewer.update(made)

    def show(self, name: str) -> None:
        """Shows this extra body on its part from now on."""
        if name not in self._shown:
            self._shown[name] = self._carrier[name]
            self._pending[name] = True


def show_scene(task: Task, order: Order, layout: Layout, viewer: Viewer) -> None:
    """Shows a viewer the scene at its beginning."""
    with World() as world:
        Scene(world, task, order, layout)
        Recorder(world, viewer=viewer).take()


def extras_of(scene: Scene, skillset: SkillSet) -> dict[str, tuple[Body, ...]]:
    """The extra bodies of each part of a scene: the coats and finishes that machines leave on it."""
    extras: dict[str, tuple[Body, ...]] = {}
    for name, kind in scene.kind_of.items():
        bodies: list[Body] = []
        for station in (scene.task.station(place) for place in kind.part.places):
            if station.finish is not None:
                bodies.append(finish_on(name, kind, station.name, (*station.finish, 1.0)))
            if any(limit is not None for limit in (station.at_most_s, *_windows(kind, station.name))):
                bodies.append(
                    replace(finish_on(name, kind, station.name, BURNT, 2), name=burnt_name(name, station.name))
                )
            for skill in skillset.processes[station.name]:
                bodies += skill.on_part(name, kind)
        if bodies:
            extras[name] = tuple(bodies)
    return extras


def _windows(kind: Kind, station: str) -> list[float | None]:
    return [stage.at_most_s for route in kind.part.routes for stage in route if stage.station == station]


def burnt_name(name: str, station: str) -> str:
    """The name of the extra body of a part that stayed in a machine for too long."""
    return f"burnt {name} at {station}"


def finish_name(name: str, station: str) -> str:
    """The name of the finish that a machine has left on a part."""
    return f"done {name} at {station}"


def finish_on(name: str, kind: Kind, station: str, rgba: Rgba, coat: int = 1) -> Body:
    """A part's finish: both sides of a flat part within its rim, or the whole of any other part; coat 2 lies over coat 1."""
    fields = kind.part
    if fields.shape == "box" and fields.size_m is not None and min(fields.size_m) < RIM_M:
        size = tuple(
            edge + coat * PROUD_M if edge < RIM_M else max(edge - RIM_M, LEAST * edge) for edge in fields.size_m
        )
        return Body(finish_name(name, station), (Shape("box", size, None, rgba),))
    shapes = tuple(
        Shape(look.kind, _larger(look, coat), look.mesh, rgba, look.position, look.quaternion)
        for look in kind.shape.looks
    )
    return Body(finish_name(name, station), shapes)


def _larger(look: Shape, coat: int) -> tuple[float, ...]:
    return tuple(LARGER**coat * size for size in (look.size or (1.0, 1.0, 1.0)))
