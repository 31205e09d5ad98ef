"""What a run looked like: frames at their times, and toast and butter that appear on the slice that has them."""

from collections.abc import Iterator

import pytest

from lab.files import assets_folder
from lab.production.recorder import FRAME_EVERY, Recorder
from lab.sim.frames import Body, Frame
from lab.sim.models import SLICE
from lab.sim.world import TIME_STEP, World


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


def run(world: World, recorder: Recorder, steps: int) -> None:
    for _ in range(steps):
        world.step()
        recorder.step()


def test_ten_frames_a_second_at_their_times_from_zero(world: World) -> None:
    world.step()  # before the recorder is there
    recorder = Recorder(world, 2)
    recorder.take()
    run(world, recorder, 240)
    frames = recorder.recording.frames
    assert [frame.time_s for frame in frames] == pytest.approx([n * FRAME_EVERY * TIME_STEP for n in range(11)])
    heights = [frame.poses["slice 1"][2] for frame in frames]
    assert heights == sorted(heights, reverse=True)
    assert frames[-1].poses["slice 1"][:3] == pytest.approx(world.pose("slice 1")[0])
    recorder.recording.check()
    assert recorder.recording.bodies == recorder.bodies


def test_toast_and_butter_are_hidden_until_they_are_there(world: World) -> None:
    recorder = Recorder(world, 2)
    names = {body.name for body in recorder.bodies}
    assert {"slice 1", "slice 2", "toasted 1", "toasted 2", "butter 1 00", "butter 2 22"} <= names
    assert len(names) == len(recorder.bodies) == 2 + 2 * (1 + 9)
    recorder.take()
    recorder.toast(2)
    recorder.show("butter 2 01")
    recorder.take()
    recorder.show("butter 2 01")  # told again after each step
    recorder.take()
    first, second, third = recorder.recording.frames
    assert dict(first.visible) == dict.fromkeys(names - {"slice 1", "slice 2"}, False)
    assert dict(second.visible) == {"toasted 2": True, "butter 2 01": True}
    assert dict(third.visible) == {}
    assert "toasted 1" not in third.poses


def test_what_is_on_a_slice_moves_with_it(world: World) -> None:
    recorder = Recorder(world, 2)
    recorder.toast(1)
    recorder.show("butter 1 22")
    run(world, recorder, FRAME_EVERY)
    (frame,) = recorder.recording.frames
    assert frame.poses["toasted 1"] == frame.poses["butter 1 22"] == frame.poses["slice 1"]
    assert frame.poses["toasted 1"] != frame.poses["slice 2"]


def test_the_extras_lie_on_the_slice_that_they_belong_to(world: World) -> None:
    bodies = {body.name: body.shapes[0] for body in Recorder(world, 1).bodies}
    width, thick, height = SLICE
    toasted = bodies["toasted 1"].size
    assert toasted[0] < width
    assert toasted[1] > thick  # seen on both sides
    assert toasted[2] < height
    top_left, bottom_right = bodies["butter 1 00"].position, bodies["butter 1 22"].position
    assert top_left[0] < 0 < bottom_right[0]
    assert bottom_right[2] < 0 < top_left[2]
    assert top_left[1] == bottom_right[1] < -thick / 2  # on the side of the nozzle


def test_a_viewer_sees_every_frame_as_it_is_taken(world: World) -> None:
    watcher = Watcher()
    recorder = Recorder(world, 1, watcher)
    assert watcher.shown == [recorder.bodies]
    run(world, recorder, FRAME_EVERY - 1)
    assert watcher.frames == []
    run(world, recorder, 1 + FRAME_EVERY)
    assert watcher.frames == recorder.recording.frames
    assert len(watcher.frames) == 2
