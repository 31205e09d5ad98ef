"""The live page and the replay in a real browser: poses as the page's scene tree has them. Skipped without Chromium."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import trimesh

from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sim.frames import IDENTITY, Body, Frame, Recording, Shape
from lab.tasks.schedule_table import read_schedule
from lab.view.meshcat import LiveView, replay_html
from lab.view.scene_data import Mark, Story
from lab.view.schedule_floor import HIGH_M, PART_M
from lab.view.schedule_scene import scene_of

if TYPE_CHECKING:
    from playwright.sync_api import Page

Until = Callable[["Page", str], None]
Paused = Callable[["Page"], None]
HALF = 0.5**0.5
WHITE, BROWN = (1.0, 1.0, 1.0, 1.0), (0.5, 0.0, 0.0, 0.5)
# where the slice is at the simulated seconds 3, 4 and 5, the last turned by a quarter about z
POSES = [
    (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0),
    (0.5, 0.2, 0.7, 0.0, 0.0, 0.0, 1.0),
    (0.5, -0.2, 0.3, 0.0, 0.0, HALF, HALF),
]


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    trimesh.creation.box((0.12, 0.015, 0.12)).export(tmp_path / "slice.stl")
    post = Shape("cylinder", (0.05, 0.8), position=(0.0, 0.0, 0.4))
    bodies = (
        Body("table", (Shape("box", (2.0, 2.0, 0.04), position=(0.0, 0.0, -0.02)),)),
        Body("arm", (post, Shape("sphere", (0.1,), position=(0.0, 0.0, 0.8)))),
        Body("slice 1", (Shape("mesh", (1.0, 2.0, 1.0), mesh=tmp_path / "slice.stl"),)),
    )
    frames = [Frame(3.0 + number, {"slice 1": pose}) for number, pose in enumerate(POSES)]
    frames[0] = Frame(3.0, {"table": (0, 0, 0, 0, 0, 0, 1), "arm": (-0.5, 0, 0, 0, 0, 0, 1), "slice 1": POSES[0]})
    frames[1] = Frame(4.0, frames[1].poses, {"slice 1": BROWN}, {"arm": False})
    return Recording(bodies, frames)


def pose_of(page: "Page", *path: str) -> list[float]:
    script = """path => {
        const object = viewer.scene_tree.find(path).object;
        return [...object.position.toArray(), ...object.quaternion.toArray()];
    }"""
    found = page.evaluate(script, ["lab", *path])
    assert isinstance(found, list)
    return found


def look_of(page: "Page", body: str) -> dict[str, Any]:
    """Opacity and colour (as written into the scene, sRGB) of a body's first shape, and whether the body is visible."""
    script = """body => {
        const material = viewer.scene_tree.find(["lab", body, "0", "<object>"]).object.material;
        const color = material.color.clone().convertLinearToSRGB().toArray();
        return { color, opacity: material.opacity, visible: viewer.scene_tree.find(["lab", body]).object.visible };
    }"""
    found = page.evaluate(script, body)
    assert isinstance(found, dict)
    return found


def size_of(page: "Page", *path: str) -> list[float]:
    """A shape's extent along its own axes [m]."""
    script = """path => {
        const { geometry, scale } = viewer.scene_tree.find(path).object;
        geometry.computeBoundingBox();
        return geometry.boundingBox.getSize(scale.clone()).multiply(scale).toArray();
    }"""
    found = page.evaluate(script, ["lab", *path, "<object>"])
    assert isinstance(found, list)
    return found


def drawn_colors(page: "Page") -> int:
    """How many different colours the 3D picture holds: one or two when nothing was drawn."""
    script = """() => {
        viewer.render();
        const gl = viewer.renderer.getContext(), { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
        const pixels = new Uint8Array(4 * w * h);
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return new Set(new Uint32Array(pixels.buffer)).size;
    }"""
    found = page.evaluate(script)
    assert isinstance(found, int)
    return found


def test_the_live_page_shows_bodies_where_they_are(browser_page: "Page", recording: Recording, until: Until) -> None:
    with LiveView(title="Toast & more") as view:
        view.show(recording.bodies)
        view.update(recording.frames[0])
        browser_page.goto(view.url)
        assert view.wait_for_page(20)
        until(browser_page, "document.getElementById('note').textContent === '3.0 s'")
        assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[0], abs=1e-5)
        assert pose_of(browser_page, "arm", "1")[:3] == pytest.approx([0, 0, 0.8], abs=1e-5)
        assert size_of(browser_page, "arm", "0") == pytest.approx([0.1, 0.1, 0.8], abs=1e-3)  # it stands along z
        assert size_of(browser_page, "slice 1", "0") == pytest.approx([0.12, 0.03, 0.12], abs=1e-5)

        view.update(recording.frames[1])
        until(browser_page, "document.getElementById('note').textContent === '4.0 s'")
        assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[1], abs=1e-5)
        look = look_of(browser_page, "slice 1")
        assert [*look["color"], look["opacity"]] == pytest.approx(BROWN, abs=1e-3)
        assert look_of(browser_page, "arm")["visible"] is False

        view.update(recording.frames[2])
    until(browser_page, "document.getElementById('note').textContent.startsWith('the run has ended')")
    assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[2], abs=1e-5)
    assert browser_page.inner_text("#caption").startswith("Toast & more")
    assert drawn_colors(browser_page) > 100


def test_a_new_scene_replaces_the_old_one(browser_page: "Page", recording: Recording, until: Until) -> None:
    with LiveView() as view:
        view.show(recording.bodies)
        browser_page.goto(view.url)
        until(browser_page, "viewer.scene_tree.children.lab")
        view.show([Body("plate", (Shape("box", (1, 1, 1)),))])
        until(browser_page, "viewer.scene_tree.children.lab?.children.plate")
        assert browser_page.evaluate("Object.keys(viewer.scene_tree.children.lab.children)") == ["plate"]


def test_a_label_is_as_high_as_it_says_and_a_page_of_one_picture_has_no_player(
    browser_page: "Page", tmp_path: Path, until: Until
) -> None:
    label = Shape("label", (0.2,), rgba=BROWN, position=(0.1, 0.2, 0.3), text="column")
    still = Recording((Body("axes", (label,)),), [Frame(0.0, {"axes": IDENTITY})])
    browser_page.goto(replay_html(still, tmp_path / "still.html").as_uri())
    until(browser_page, "viewer.scene_tree.children.lab?.children.axes")
    sprite = "viewer.scene_tree.find(['lab', 'axes', '0', '<object>']).object"
    wide, high = browser_page.evaluate(f"[{sprite}.scale.x, {sprite}.scale.y]")
    assert (high, browser_page.evaluate(f"{sprite}.isSprite")) == (pytest.approx(0.2), True)
    assert 2.0 < wide / high < 5.0
    assert pose_of(browser_page, "axes", "0")[:3] == pytest.approx([0.1, 0.2, 0.3])
    assert look_of(browser_page, "axes")["opacity"] == 0.5
    assert browser_page.inner_text("#note") == ""
    assert not browser_page.is_visible("#player")


def test_the_replay_plays_from_disk_without_a_network(
    browser_page: "Page", recording: Recording, tmp_path: Path, until: Until
) -> None:
    path = replay_html(recording, tmp_path / "replay.html", speed=0.05, title="Toast <b>bold</b>")
    asked: list[str] = []
    browser_page.on("request", lambda request: asked.append(request.url))
    browser_page.context.set_offline(True)
    browser_page.goto(path.as_uri())
    until(browser_page, "player.state().playing && player.state().time > 0")
    assert "0.05 × real time" in browser_page.inner_text("#caption")
    assert browser_page.inner_text("#caption").startswith("Toast <b>bold</b>")

    browser_page.click("#play")
    assert browser_page.evaluate("player.state().playing") is False
    middle = [0.3, 0.2, 0.5, 0.0, 0.0, 0.0, 1.0]  # half way between the first two poses
    for time_s, pose in ((0.0, POSES[0]), (0.5, middle), (1.0, POSES[1]), (2.0, POSES[2])):
        browser_page.evaluate("time => viewer.animator.seek(time)", time_s)
        assert pose_of(browser_page, "slice 1") == pytest.approx(pose, abs=3e-4)
        assert pose_of(browser_page, "arm")[0] == pytest.approx(-0.5)
    assert drawn_colors(browser_page) > 100
    assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [path.as_uri()]


def test_colours_and_visibility_step_in_the_replay(
    browser_page: "Page", recording: Recording, tmp_path: Path, paused: Paused
) -> None:
    recording.frames[2] = Frame(5.0, {"slice 1": POSES[2]}, {"slice 1": WHITE}, {"arm": True})
    browser_page.goto(replay_html(recording, tmp_path / "replay.html").as_uri())
    paused(browser_page)
    start = (*recording.bodies[2].shapes[0].rgba, True)
    for time_s, expected in ((0.5, start), (1.5, (*BROWN, False)), (2.5, (*WHITE, True)), (0.2, start)):
        browser_page.evaluate("time => viewer.animator.seek(time)", time_s)
        look = look_of(browser_page, "slice 1")
        assert [*look["color"], look["opacity"]] == pytest.approx(expected[:4], abs=1e-3)
        assert look_of(browser_page, "arm")["visible"] is expected[4]


def test_the_slider_moves_the_replay(
    browser_page: "Page", recording: Recording, tmp_path: Path, until: Until, paused: Paused
) -> None:
    browser_page.goto(replay_html(recording, tmp_path / "replay.html").as_uri())
    paused(browser_page)
    browser_page.evaluate("const s = document.getElementById('seek'); s.value = 1; s.dispatchEvent(new Event('input'))")
    assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[1], abs=3e-4)
    until(browser_page, "document.getElementById('note').textContent.startsWith('4.0 s')")


def test_a_still_recording_has_no_player(browser_page: "Page", recording: Recording, tmp_path: Path) -> None:
    del recording.frames[1:]
    browser_page.goto(replay_html(recording, tmp_path / "replay.html").as_uri())
    assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[0], abs=1e-5)
    assert browser_page.is_hidden("#player")


def test_keys_go_from_move_to_move_and_the_words_the_chart_and_the_slider_follow(
    browser_page: "Page", recording: Recording, tmp_path: Path, paused: Paused
) -> None:
    done = Activity("robot", "carry", 1, "plate", "toaster", 3.0, 5.0)
    schedule = Schedule((done,), (), (), 5.0, (1,))
    told = ((3.0, "The robot grasps slice 1"), (4.0, "The robot waits"))
    story = Story(schedule, schedule, told, (Mark(4.0, "stop", "pause"),), (3.0, 4.0))
    browser_page.goto(replay_html(recording, tmp_path / "replay.html", speed=1, story=story).as_uri())
    paused(browser_page)
    browser_page.keyboard.press("Home")
    assert browser_page.inner_text("#doing") == "The robot grasps slice 1"
    browser_page.keyboard.press("n")
    assert browser_page.inner_text("#doing") == "The robot waits"
    assert browser_page.evaluate("player.state()") == {"time": 1, "playing": False, "speed": 1}
    assert pose_of(browser_page, "slice 1") == pytest.approx(POSES[1], abs=3e-4)
    browser_page.keyboard.press("+")
    browser_page.keyboard.press("ArrowRight")
    assert browser_page.evaluate("player.state()") == {"time": 2, "playing": False, "speed": 2}
    browser_page.click("#marks button")
    assert browser_page.input_value("#seek") == "1"
    assert browser_page.locator("#gantt rect.planned").count() == 1


def test_a_schedule_is_pale_where_it_is_still_to_come_and_its_bars_are_called_as_its_parts(
    browser_page: "Page", tmp_path: Path, paused: Paused
) -> None:
    (tmp_path / "plan.csv").write_text("job,machine,start,end\norder 7,saw,0,30\norder 8,mill,10,40\n,saw,30,35\n")
    scene = scene_of(read_schedule([tmp_path / "plan.csv"]), "plan")
    page = replay_html(scene.recording, tmp_path / "plan.html", 1, scene.title, scene.story, tracks=scene.tracks)
    browser_page.set_viewport_size({"width": 700, "height": 400})
    browser_page.goto(page.as_uri())
    paused(browser_page)
    browser_page.evaluate("(() => { const at = document.getElementById('seek'); at.value = 20; at.oninput(); })()")
    assert pose_of(browser_page, "part 1")[2] == pytest.approx(HIGH_M + PART_M / 2)
    assert browser_page.inner_text("#doing") == "order 8 begins in mill"
    bars = "[...document.querySelectorAll('#gantt rect.k-process')].map((bar) => [bar.style.fill, bar.textContent])"
    first, second = browser_page.evaluate(bars)[:2]
    assert first == ["rgb(230, 159, 0)", "saw works on order 7, 0.0 to 30.0 s"]
    assert second == ["rgb(0, 158, 115)", "mill works on order 8, 10.0 to 40.0 s"]
    assert browser_page.locator("#gantt text", has_text="order 7").count() == 2  # once pale, once as far as it is done
    assert browser_page.locator("#gantt g[opacity]").count() == 1
    assert [text.strip() for text in browser_page.locator("#key span:visible").all_inner_texts()] == ["serves"]


@pytest.mark.parametrize(("machines", "beside"), [(8, False), (9, True)])
def test_a_long_chart_stands_beside_the_picture(
    machines: int, beside: bool, browser_page: "Page", tmp_path: Path, until: Until
) -> None:
    rows = "".join(f"A,m{k},{k},{k + 1}\n" for k in range(machines))
    (tmp_path / "plan.csv").write_text(f"job,machine,start,end\n{rows}")
    scene = scene_of(read_schedule([tmp_path / "plan.csv"]), "plan")
    browser_page.set_viewport_size({"width": 1200, "height": 300})
    browser_page.goto(
        replay_html(scene.recording, tmp_path / "p.html", story=scene.story, tracks=scene.tracks).as_uri()
    )
    until(browser_page, "player.state().playing")
    player = browser_page.locator("#player").bounding_box()
    assert player is not None
    assert (player["x"] > 500) is beside
