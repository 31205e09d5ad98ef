"""What a run looked like: frames of the world, and what a viewer shows beside the bodies, such as toasted sides."""

from dataclasses import dataclass, field
from typing import Protocol

from lab.sim import models
from lab.sim.frames import Body, Frame, Recording, Shape
from lab.sim.scene import Layout, Scene
from lab.sim.world import TIME_STEP, World
from lab.skills import SKILLS
from lab.tasks.task_file import Task

FRAME_EVERY = 24  # physics steps: ten frames a simulated second
TOASTED = (0.70, 0.42, 0.16, 1.0)


class Viewer(Protocol):
    """Who watches live."""

    def show(self, bodies: tuple[Body, ...]) -> None:
        """What there is to see."""

    def update(self, frame: Frame) -> None:
        """Where it is now."""


@dataclass
class Recorder:
    """Takes a frame every FRAME_EVERY steps; a viewer gets each at once. Slices change their looks as they are told."""

    world: World
    slices: int
    viewer: Viewer | None = None
    _shown: dict[str, int] = field(default_factory=dict)  # extra body -> the slice that carries it

    def __post_init__(self) -> None:
        extras = [(body, number) for number in range(1, self.slices + 1) for body in _extras(number)]
        self._carrier = {body.name: number for body, number in extras}
        self.bodies = (*self.world.bodies(), *(body for body, _ in extras))
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
        frame = self.world.frame()
        poses = dict(frame.poses)
        for name, number in self._shown.items():
            poses[name] = poses[f"slice {number}"]
        pending, self._pending = self._pending, {}
        made = Frame((self.world.steps - self._start) * TIME_STEP, poses, visible=pending)
        self.recording.frames.append(made)
        if self.viewer is not None:
            self.viewer.update(made)

    def toast(self, number: int) -> None:
        """From now on slice `number` is seen toasted."""
        self.show(f"toasted {number}")

    def show(self, name: str) -> None:
        """From now on this extra body is seen on its slice."""
        if name not in self._shown:
            self._shown[name] = self._carrier[name]
            self._pending[name] = True


def show_scene(task: Task, toasts: int, layout: Layout, viewer: Viewer) -> None:
    """Show a viewer the scene before anything has happened in it."""
    with World() as world:
        Scene(world, task, toasts, layout)
        Recorder(world, toasts, viewer).take()


def _extras(number: int) -> list[Body]:
    """What may come to be seen on a slice: both sides toasted, and what skills make."""
    width, thick, height = models.SLICE
    toasted = Shape("box", (width - 0.022, thick + 0.0016, height - 0.022), None, TOASTED)
    made = (body for kind in SKILLS.values() for body in kind.on_slice(number))
    return [Body(f"toasted {number}", (toasted,)), *made]
