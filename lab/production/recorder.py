"""What a run looked like: frames of the world, and what a viewer shows beside the bodies (toasted sides, butter)."""

from dataclasses import dataclass, field
from typing import Protocol

from lab.sim import assets
from lab.sim.scene import Layout, Scene
from lab.sim.world import TIME_STEP, World
from lab.taskfile import Task
from lab.view.frames import Body, Frame, Recording, Shape

FRAME_EVERY = 24  # physics steps: ten frames a simulated second
TOASTED = (0.70, 0.42, 0.16, 1.0)
BUTTER = (1.0, 0.87, 0.25, 1.0)
_CELL = assets.SLICE[0] / 3


class Viewer(Protocol):
    """Who watches live."""

    def show(self, bodies: tuple[Body, ...]) -> None:
        """What there is to see."""

    def update(self, frame: Frame) -> None:
        """Where it is now."""


@dataclass
class Recorder:
    """Takes a frame every FRAME_EVERY steps; a viewer gets each at once. Slices toast and take butter as they are told."""

    world: World
    slices: int
    viewer: Viewer | None = None
    _shown: dict[str, int] = field(default_factory=dict)  # extra body -> the slice that carries it

    def __post_init__(self) -> None:
        self.bodies = (*self.world.bodies(), *(body for n in range(1, self.slices + 1) for body in _extras(n)))
        self.recording = Recording(self.bodies)
        self._start = self.world.steps
        self._pending = {body.name: False for number in range(1, self.slices + 1) for body in _extras(number)}
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
        self._show(f"toasted {number}", number)

    def butter(self, number: int, cell: tuple[int, int]) -> None:
        """From now on slice `number` is seen buttered in a cell (row, column)."""
        self._show(f"butter {number} {cell[0]}{cell[1]}", number)

    def _show(self, name: str, number: int) -> None:
        if name not in self._shown:
            self._shown[name] = number
            self._pending[name] = True


def show_scene(task: Task, toasts: int, layout: Layout, viewer: Viewer) -> None:
    """Show a viewer the scene before anything has happened in it."""
    with World() as world:
        Scene(world, task, toasts, layout)
        Recorder(world, toasts, viewer).take()


def _extras(number: int) -> list[Body]:
    """What may come to be seen on a slice: both sides toasted, nine cells of butter on the side of its negative y axis."""
    width, thick, height = assets.SLICE
    toasted = Shape("box", (width - 0.022, thick + 0.0016, height - 0.022), None, TOASTED)
    bodies = [Body(f"toasted {number}", (toasted,))]
    for row in range(3):
        for column in range(3):
            at = ((column - 1) * _CELL * 0.9, -thick / 2 - 0.0016, (1 - row) * _CELL * 0.9)
            patch = Shape("box", (_CELL * 0.82, 0.0024, _CELL * 0.82), None, BUTTER, at)
            bodies.append(Body(f"butter {number} {row}{column}", (patch,)))
    return bodies
