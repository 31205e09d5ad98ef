"""What a run looked like: frames of the world, and what a viewer shows beside the bodies: what machines have left on parts."""

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
RIM_M, PROUD_M = 0.022, 0.0016  # [m] that the finish of a flat part leaves free in all, and is thicker than it
LEAST = 0.8  # of an edge is covered by it, however short that is
BURNT: Rgba = (0.10, 0.08, 0.07, 1.0)
LARGER = 1.01  # than another part is its finish


class Viewer(Protocol):
    """Who watches live."""

    def show(self, bodies: tuple[Body, ...]) -> None:
        """What there is to see."""

    def update(self, frame: Frame) -> None:
        """Where it is now."""


@dataclass
class Recorder:
    """Takes a frame every FRAME_EVERY steps; a viewer gets each at once. Parts change their looks as they are told.

    extras: by the part that carries it, what may come to be seen on it.
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
        """To be called after each physics step."""
        if (self.world.steps - self._start) % FRAME_EVERY == 0:
            self.take()

    def take(self) -> None:
        """Take a frame now."""
        poses = self.world.poses()
        for name, part in self._shown.items():
            poses[name] = poses[part]
        pending, self._pending = self._pending, {}
        made = Frame((self.world.steps - self._start) * TIME_STEP, poses, visible=pending)
        self.recording.frames.append(made)
        if self.viewer is not None:
            self.viewer.update(made)

    def show(self, name: str) -> None:
        """From now on this extra body is seen on its part."""
        if name not in self._shown:
            self._shown[name] = self._carrier[name]
            self._pending[name] = True


def show_scene(task: Task, order: Order, layout: Layout, viewer: Viewer) -> None:
    """Show a viewer the scene before anything has happened in it."""
    with World() as world:
        Scene(world, task, order, layout)
        Recorder(world, viewer=viewer).take()


def extras_of(scene: Scene, skillset: SkillSet) -> dict[str, tuple[Body, ...]]:
    """What may come to be seen on each part of a scene: what machines leave on it, by their processes or their finish."""
    found: dict[str, tuple[Body, ...]] = {}
    for name, kind in scene.kind_of.items():
        bodies: list[Body] = []
        for station in (scene.task.station(place) for place in kind.part.places):
            if station.finish is not None:
                bodies.append(finish_on(name, kind, station.name, (*station.finish, 1.0)))
            if any(one is not None for one in (station.at_most_s, *_windows(kind, station.name))):
                bodies.append(
                    replace(finish_on(name, kind, station.name, BURNT, 2), name=burnt_name(name, station.name))
                )
            for skill in skillset.processes[station.name]:
                bodies += skill.on_part(name, kind)
        if bodies:
            found[name] = tuple(bodies)
    return found


def _windows(kind: Kind, station: str) -> list[float | None]:
    return [stage.at_most_s for route in kind.part.routes for stage in route if stage.station == station]


def burnt_name(name: str, station: str) -> str:
    """What the looks of a part are called that stayed in a machine for too long."""
    return f"burnt {name} at {station}"


def finish_name(name: str, station: str) -> str:
    """What the finish of a part is called that a machine has left on it."""
    return f"done {name} at {station}"


def finish_on(name: str, kind: Kind, station: str, rgba: Rgba, coat: int = 1) -> Body:
    """A part's finish: both sides of a flat part within its rim, all of another; coat: 2 lies over 1."""
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
