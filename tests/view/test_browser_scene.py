"""The toast scene itself in a real browser: the arm and the slices are where the physics has them. Skipped without Chromium."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lab.production.recorder import Recorder
from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.skills.prepared_scene import lay_out
from lab.tasks import task_file as taskfile
from lab.view.meshcat import LiveView, replay_html

if TYPE_CHECKING:
    from playwright.sync_api import Page

Until = Callable[["Page", str], None]
ABOVE_THE_PLATE = (ToolPose(0.07, 0.8, 0.3), ToolPose(0.07, 0.8, 0.2))
PLACES = "names => names.map(name => viewer.scene_tree.find(['lab', name]).object.position.toArray())"
SEEN = ("robot tool", "robot forearm", "slice 1", "slice 2")


@pytest.fixture
def scene() -> Iterator[Scene]:
    task = taskfile.load("toast")
    with World() as world:
        yield Scene(world, task, task.order(2), lay_out(task, task.order(2), 3))


def move(scene: Scene, pose: ToolPose, recorder: Recorder) -> list[list[float]]:
    """Stand the arm somewhere, push a slice over, take a frame; where everything in SEEN is now."""
    assert scene.robot.stand(pose)
    position, turn = scene.world.pose("slice 1")
    scene.world.put("slice 1", position + np.array([0.05, 0.0, 0.1]), turn)
    recorder.take()
    bodies = [
        (name.partition(" ")[0], name.partition(" ")[2]) if name.startswith("robot") else (name, "") for name in SEEN
    ]
    return [scene.world.pose(body, link)[0].tolist() for body, link in bodies]


def on_page(page: "Page", expected: list[list[float]]) -> bool:
    found = page.evaluate(PLACES, list(SEEN))
    return np.allclose(found, expected, atol=5e-4)


def test_the_live_page_shows_the_arm_and_the_slices(browser_page: "Page", scene: Scene, until: Until) -> None:
    with LiveView() as live:
        recorder = Recorder(scene.world, viewer=live)
        browser_page.goto(live.url)
        assert live.wait_for_page(20)
        for pose in ABOVE_THE_PLATE:
            expected = move(scene, pose, recorder)
            script = "(([names, places]) => names.every((name, n) => viewer.scene_tree.find(['lab', name]).object"
            script += ".position.toArray().every((value, k) => Math.abs(value - places[n][k]) < 5e-4)))"
            until(browser_page, f"{script}({json.dumps([SEEN, expected])})")
            assert on_page(browser_page, expected)


def test_the_replay_shows_the_arm_and_the_slices_offline(
    browser_page: "Page", scene: Scene, tmp_path: Path, paused: Callable[["Page"], None]
) -> None:
    recorder = Recorder(scene.world)
    first = move(scene, ABOVE_THE_PLATE[0], recorder)
    scene.world.steps += 240
    last = move(scene, ABOVE_THE_PLATE[1], recorder)
    asked: list[str] = []
    browser_page.on("request", lambda request: asked.append(request.url))
    browser_page.context.set_offline(True)
    page = replay_html(recorder.recording, tmp_path / "replay.html", speed=0.5).as_uri()
    browser_page.goto(page)
    paused(browser_page)
    for key, expected in (("Home", first), ("End", last)):
        browser_page.keyboard.press(key)
        assert on_page(browser_page, expected)
    assert asked == [page]
