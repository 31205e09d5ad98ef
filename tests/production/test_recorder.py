"""What a run looked like: frames at their times, and what machines leave on a part, on the part that has it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from lab.files import assets_folder
from lab.production.recorder import FRAME_EVERY, Recorder, extras_of, finish_on
from lab.sim.arms.arm_models import arm_of
from lab.sim.frames import Body, Frame, Vector
from lab.sim.parts.kinds import Kind, kinds_of
from lab.sim.parts.part_shape import shape_of
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills.prepared_scene import lay_out
from lab.skills.skillset import SkillSet
from lab.tasks.task_file import load

BROWN = (0.70, 0.42, 0.16, 1.0)
PATCHES = {f"butter on slice 1 {row}{column}" for row in range(3) for column in range(3)}


class Watcher:
    """Keeps what it is shown."""

    def __init__(self) -> None:
        self.shown: list[tuple[Body, ...]] = []
        self.frames: list[Frame] = []

    def show(self, bodies: tuple[Body, ...]) -> None:
        self.shown.append(bodies)

    def update(self, frame: Frame) -> None:
        self.frames.append(frame)


@pytest.fixture
def world() -> Iterator[World]:
    """Two slices that fall side by side."""
    with World() as made:
        for number in (1, 2):
            made.load(f"slice {number}", assets_folder() / "slice.urdf", (number, 0, 5), fixed=False)
        yield made


@pytest.fixture(scope="module")
def kinds() -> dict[str, Kind]:
    """A slice, a rook and a pallet as a gripper has them."""
    toast, cell = load("toast"), load("fms-arm")
    return kinds_of(toast, arm_of(toast.robot, Path()).gripper) | kinds_of(cell, arm_of(cell.robot, Path()).gripper)


@pytest.fixture(scope="module")
def extras() -> dict[str, tuple[Body, ...]]:
    """What may come to be seen on one slice of the shipped cell."""
    task = load("toast")
    with World() as world:
        return extras_of(Scene(world, task, ("slice",), lay_out(task, ("slice",), 0)), SkillSet.of(task, ("slice",)))


def run(world: World, recorder: Recorder, steps: int) -> None:
    for _ in range(steps):
        world.step()
        recorder.step()


def both(kinds: dict[str, Kind]) -> dict[str, tuple[Body, ...]]:
    """The finish of each of two slices."""
    return {f"slice {n}": (finish_on(f"slice {n}", kinds["slice"], "toaster", BROWN),) for n in (1, 2)}


def test_ten_frames_a_second_at_their_times_from_zero(world: World) -> None:
    world.step()  # before the recorder is there
    recorder = Recorder(world)
    recorder.take()
    run(world, recorder, 240)
    frames = recorder.recording.frames
    assert [frame.time_s for frame in frames] == pytest.approx([n * FRAME_EVERY * TIME_STEP for n in range(11)])
    heights = [frame.poses["slice 1"][2] for frame in frames]
    assert heights == sorted(heights, reverse=True)
    assert frames[-1].poses["slice 1"][:3] == pytest.approx(world.pose("slice 1")[0])
    recorder.recording.check()
    assert recorder.recording.bodies == recorder.bodies


def test_what_machines_may_leave_on_a_part(extras: dict[str, tuple[Body, ...]]) -> None:
    assert {name: {body.name for body in bodies} for name, bodies in extras.items()} == {
        "slice 1": {"done slice 1 at toaster"} | PATCHES
    }


def test_it_is_hidden_until_it_is_there(world: World, kinds: dict[str, Kind]) -> None:
    recorder = Recorder(world, both(kinds))
    one, other = "done slice 1 at toaster", "done slice 2 at toaster"
    assert [body.name for body in recorder.bodies] == ["slice 1", "slice 2", one, other]
    recorder.take()
    recorder.show(other)
    recorder.take()
    recorder.show(other)  # told again after each step
    recorder.take()
    first, second, third = recorder.recording.frames
    assert dict(first.visible) == {one: False, other: False}
    assert dict(second.visible) == {other: True}
    assert dict(third.visible) == {}
    assert one not in third.poses


def test_what_is_on_a_part_moves_with_it(world: World, kinds: dict[str, Kind]) -> None:
    recorder = Recorder(world, both(kinds))
    recorder.show("done slice 1 at toaster")
    run(world, recorder, FRAME_EVERY)
    (frame,) = recorder.recording.frames
    assert frame.poses["done slice 1 at toaster"] == frame.poses["slice 1"]
    assert frame.poses["done slice 1 at toaster"] != frame.poses["slice 2"]


def test_the_finish_of_a_flat_box_is_seen_on_both_sides_within_its_rim(kinds: dict[str, Kind]) -> None:
    """A slice of 12 x 1.5 x 12 cm: 2.2 cm narrower and lower, 1.6 mm thicker."""
    body = finish_on("slice 1", kinds["slice"], "toaster", BROWN)
    (shape,) = body.shapes
    assert (body.name, shape.kind, shape.rgba) == ("done slice 1 at toaster", "box", BROWN)
    assert shape.size == pytest.approx((0.098, 0.0166, 0.098))


def test_the_finish_of_a_narrow_box_is_no_thread(kinds: dict[str, Kind]) -> None:
    """A pallet of 12 x 3.4 x 2 cm: four fifths of its width."""
    (shape,) = finish_on("pallet 1", kinds["pallet"], "lathe", BROWN).shapes
    assert shape.size == pytest.approx((0.098, 0.0272, 0.0216))


@pytest.mark.parametrize("size", [None, (0.06, 0.05, 0.04)])
def test_the_finish_of_a_thick_part_is_all_around_it(kinds: dict[str, Kind], size: Vector | None) -> None:
    """A rook, and a thick box: a hundredth larger, where they are seen."""
    rook, pallet = kinds["rook"], kinds["pallet"]
    box = pallet.part.model_copy(update={"size_m": size})
    kind = rook if size is None else replace(pallet, part=box, shape=shape_of(box, Path()))
    (own,), (shape,) = kind.shape.looks, finish_on("part 1", kind, "lathe", BROWN).shapes
    assert (shape.kind, shape.rgba) == ("cylinder" if size is None else "box", BROWN)
    assert (shape.position, shape.quaternion) == (own.position, own.quaternion)
    assert shape.size == pytest.approx([1.01 * edge for edge in own.size or ()])


def test_the_patches_lie_on_the_side_of_the_nozzle_row_by_row(extras: dict[str, tuple[Body, ...]]) -> None:
    at = {body.name: body.shapes[0].position for body in extras["slice 1"]}
    top_left, bottom_right = at["butter on slice 1 00"], at["butter on slice 1 22"]
    assert top_left[0] < 0 < bottom_right[0]
    assert bottom_right[2] < 0 < top_left[2]
    assert top_left[1] == bottom_right[1] < -0.015 / 2


def test_a_viewer_sees_every_frame_as_it_is_taken(world: World) -> None:
    watcher = Watcher()
    recorder = Recorder(world, viewer=watcher)
    assert watcher.shown == [recorder.bodies]
    run(world, recorder, FRAME_EVERY - 1)
    assert watcher.frames == []
    run(world, recorder, 1 + FRAME_EVERY)
    assert watcher.frames == recorder.recording.frames
    assert len(watcher.frames) == 2
