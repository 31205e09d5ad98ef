"""One PyBullet world: silent, repeatable, and closed to what would poison it."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed
from lab.files import assets_folder
from lab.sim import world as world_module
from lab.sim.camera import Camera
from lab.sim.frames import Frame
from lab.sim.parts.part_shape import PartShape, shape_of
from lab.sim.world import TIME_STEP, World, engine
from lab.tasks.part_fields import PartFields

SLICE = assets_folder() / "slice.urdf"
TOASTER = assets_folder() / "toaster.urdf"
HEADS = ("head_x", "head_z")
WOOD = (0.7, 0.5, 0.3, 1.0)
NAN, INF = float("nan"), float("inf")


def tumble(world: World, steps: int = 120) -> Frame:
    """A slice falls on its edge onto a turned cube while the applier's head moves past."""
    world.box("cube", (0.1, 0.1, 0.1), (0, 0, 0.05), WOOD, yaw=0.3)
    world.load("applier", assets_folder() / "applier.urdf", (0.3, 0, 0))
    world.load("slice", SLICE, (0.01, 0.02, 0.2), yaw=0.2, fixed=False)
    world.friction("slice", 0.6, spinning=0.001)
    for step in range(steps):
        world.drive("applier", HEADS, (0.04 * step / steps, 0.1 * step / steps))
        world.step()
    return world.frame()


def test_nothing_is_said_on_the_terminal(root: Path) -> None:
    talk = (
        "from lab.sim.world import World\n"
        "from lab.files import assets_folder\n"
        "with World() as world:\n"
        "    world.load('toaster', assets_folder() / 'toaster.urdf')\n"
        "    world.load('robot', assets_folder() / 'robot.urdf', (1, 0, 0))\n"
        "    world.gear('robot', 'finger_left', 'finger_right')\n"
        "    world.step()\n"
        "print('done')\n"
    )
    done = subprocess.run([sys.executable, "-c", talk], cwd=root, capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"done\n", b"")


def test_the_terminal_is_given_back(capfd: pytest.CaptureFixture[str]) -> None:
    os.write(1, b"before\n")
    with World() as world:
        tumble(world, 5)
        os.write(1, b"during\n")
    os.write(1, b"after\n")
    assert capfd.readouterr() == ("before\nduring\nafter\n", "")


def test_the_same_calls_give_the_same_poses_to_the_last_bit() -> None:
    with World() as one:
        first = tumble(one)
        with World() as other:  # beside the first one, and after it
            assert tumble(other).poses == first.poses
    with World() as third:
        assert tumble(third).poses == first.poses


def test_worlds_do_not_mix_and_can_be_closed_twice() -> None:
    with World() as one, World() as other:
        one.load("slice", SLICE, (0, 0, 1), fixed=False)
        other.load("slice", SLICE, (5, 0, 1), fixed=False)
        one.step()
        assert (one.steps, other.steps) == (1, 0)
        assert one.time_s == TIME_STEP
        assert other.pose("slice")[0] == pytest.approx((5, 0, 1))
        one.close()
        one.close()
        other.step()


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
def test_targets_that_are_not_finite_are_refused(world: World, bad: float) -> None:
    tumble(world, 2)
    before = world.frame()
    with pytest.raises(WorkFailed, match="joint targets of 'applier' are not finite"):
        world.drive("applier", HEADS, (0.0, bad))
    with pytest.raises(WorkFailed, match="joint targets of 'applier' are not finite"):
        world.drive("applier", HEADS, (0.0, 0.0), (bad, 0.0))
    with pytest.raises(WorkFailed, match="joint positions of 'applier' are not finite"):
        world.set_joints("applier", HEADS, (bad, 0.0))
    with pytest.raises(WorkFailed, match="body 'slice' cannot be put"):
        world.put("slice", (0, bad, 0))
    with pytest.raises(WorkFailed, match="body 'slice' cannot be put"):
        world.put("slice", (0, 0, 0), (0, 0, 0, bad))
    assert world.frame().poses == before.poses
    world.step()
    assert np.isfinite(list(world.frame().poses.values())).all()


def test_a_bad_urdf_never_reaches_the_world(world: World, tmp_path: Path) -> None:
    bad = tmp_path / "bad.urdf"
    bad.write_text(SLICE.read_text().replace('mass value="0.04"', 'mass value="-1"'))
    with pytest.raises(BadInput, match=r"bad\.urdf: mass of link 'slice' is -1 kg"):
        world.load("slice", bad)
    with pytest.raises(BadInput, match="not a readable URDF"):
        world.load("slice", tmp_path / "missing.urdf")
    assert world.bodies() == ()
    assert world.frame().poses == {}


def test_what_falls_falls_and_rests(world: World) -> None:
    world.box("table", (1, 1, 0.1), (0, 0, -0.05), WOOD)
    world.load("slice", SLICE, (0, 0, 0.08), fixed=False)
    world.step()
    assert 0.08 - world.pose("slice")[0][2] == pytest.approx(9.81 * TIME_STEP**2, rel=0.05)
    assert not world.touching("slice", "table")
    for _ in range(240):
        world.step()
    assert world.touching("slice", "table")
    rest = world.pose("slice")[0]
    assert rest == pytest.approx((0, 0, 0.06), abs=1e-3)
    world.step()
    assert world.pose("slice")[0] == pytest.approx(rest, abs=1e-5)


def test_mass_is_changed_with_its_inertia(world: World) -> None:
    """Pushed by its own weight alone, a heavier slice falls alike; on a table it is as stable as before."""
    world.box("table", (1, 1, 0.1), (0, 0, -0.05), WOOD)
    world.load("slice", SLICE, (0, 0, 0.062), fixed=False)
    world.mass("slice", 2.0)
    for _ in range(240):
        world.step()
    assert world.pose("slice")[0] == pytest.approx((0, 0, 0.06), abs=1e-3)


def test_distances_and_rays(world: World) -> None:
    world.box("left", (0.2, 0.2, 0.2), (0, 0, 0.1), WOOD)
    world.box("right", (0.2, 0.2, 0.2), (0.5, 0, 0.1), WOOD)
    world.disc("seen only", 0.1, 0.2, (0.25, 0, 0.1), WOOD)
    world.step()
    assert world.nearest("left", "right", 1.0) == pytest.approx(0.3, abs=1e-3)
    assert world.nearest("left", "right", 0.1) == 0.1  # farther apart than asked for
    hit = world.ray((-1, 0, 0.1), (1, 0, 0.1))
    assert hit is not None
    assert hit[0] == "left"
    assert hit[1] == pytest.approx((-0.1, 0, 0.1), abs=1e-3)
    assert world.ray((-1, 0, 0.5), (1, 0, 0.5)) is None


def test_joints_are_set_driven_and_read(world: World) -> None:
    world.load("applier", assets_folder() / "applier.urdf")
    world.set_joints("applier", HEADS, (0.02, 0.05))
    assert world.joints("applier", HEADS) == pytest.approx((0.02, 0.05))
    base = world.pose("applier", "applier")[0]
    before = world.pose("applier", "head")[0]
    for _ in range(240):
        world.drive("applier", HEADS, (-0.02, 0.08), force=300.0)
        world.step()
    assert world.joints("applier", HEADS) == pytest.approx((-0.02, 0.08), abs=1e-3)
    assert world.pose("applier", "head")[0] - before == pytest.approx((-0.04, 0, 0.03), abs=2e-3)
    assert base == pytest.approx((0, 0, 0))


def test_the_viewer_sees_every_visible_link_where_it_is(world: World) -> None:
    tumble(world, 3)
    world.disc("spot", 0.02, 0.004, (1, 2, 3), (0, 1, 0, 1))
    world.box("block", (0.1, 0.2, 0.3), (4, 5, 6), WOOD)
    bodies, poses = {body.name: body for body in world.bodies()}, world.frame().poses
    assert set(bodies) == set(poses) == {"cube", "applier", "applier column", "applier head", "slice", "spot", "block"}
    assert bodies["block"].shapes[0].size == (0.1, 0.2, 0.3)
    assert bodies["spot"].shapes[0].size == (0.02, 0.004)
    assert list(poses["spot"]) == [1, 2, 3, 0, 0, 0, 1]
    assert list(poses["slice"][:3]) == world.pose("slice")[0].tolist()
    assert list(poses["applier head"][:3]) == world.pose("applier", "head")[0].tolist()
    assert world.frame().time_s == pytest.approx(3 * TIME_STEP)


# ---- parts ----------------------------------------------------------------------------------------------------------


def part(folder: Path, **fields: Any) -> PartShape:
    return shape_of(PartFields.model_validate({"name": "thing", "mass_kg": 0.1, **fields}), folder)


def seen(build: Callable[[World], None]) -> NDArray[np.uint8]:
    """What a camera half a metre above the origin sees of it, (160, 160, 3)."""
    with World() as world:
        build(world)
        return Camera.overhead((0.0, 0.0, 0.5), 0.5, 160).picture(world)


def test_a_part_looks_as_the_urdf_whose_looks_it_has(tmp_path: Path) -> None:
    bread = part(tmp_path, shape="box", size_m=[0.12, 0.015, 0.12], look="slice.urdf")
    turned = (0.5, 0.5, 0.5, 0.5)  # its crumb faces the camera

    def as_part(world: World) -> None:
        world.part("slice", bread, 0.04, 0.8, (0, 0, 0))
        world.put("slice", (0, 0, 0), turned)

    def as_urdf(world: World) -> None:
        world.load("slice", SLICE, fixed=False)
        world.put("slice", (0, 0, 0), turned)

    assert (seen(as_part) == seen(as_urdf)).all()
    assert (seen(as_part) != 255).any()


@pytest.mark.parametrize("form", ["stl", "stl_ascii", "obj"])
def test_a_mesh_in_any_form_is_seen_and_nothing_is_said(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], form: str
) -> None:
    name = f"thing.{form.removesuffix('_ascii')}"
    trimesh.creation.box((0.06, 0.04, 0.02)).export(tmp_path / name, file_type=form)
    shape = part(tmp_path, shape="mesh", file=name)
    picture = seen(lambda world: world.part("thing", shape, 0.1, 0.8, (0, 0, 0)))
    brown = (picture != 255).any(axis=2)
    across, along = brown.any(axis=0).sum(), brown.any(axis=1).sum()
    assert sorted((across, along)) == pytest.approx([0.04 / 0.06 * max(across, along), max(across, along)], abs=2)
    assert max(across, along) > 30
    assert capfd.readouterr() == ("", "")


def test_a_ball_that_is_pushed_comes_to_rest(tmp_path: Path) -> None:
    """It falls beside the ridge of a bar, which sends it off along x."""
    trimesh.creation.icosphere(radius=0.02).export(tmp_path / "ball.stl")
    ball = part(tmp_path, shape="mesh", file="ball.stl")
    with World() as world:
        world.box("floor", (4, 4, 0.02), (0, 0, -0.01), WOOD)
        world.box("bar", (0.01, 0.2, 0.01), (-0.015, 0, 0.005), WOOD)
        world.part("ball", ball, 0.1, 0.8, (0, 0, 0.08))
        places = []
        for _ in range(2):
            for _ in range(960):
                world.step()
            places.append(world.pose("ball")[0])
    assert places[0][0] > 0.01
    assert places[1] == pytest.approx(places[0], abs=1e-3)


@pytest.mark.parametrize("body", ["toaster.urdf", "applier.urdf", "a box"])
def test_a_fixed_body_that_is_put_elsewhere_is_there_for_all(world: World, body: str) -> None:
    """Pose, links, rays and distances: 10 cm on, all of them; PyBullet counts a URDF's place from the centre of its mass."""
    if body == "a box":
        world.box("it", (0.2, 0.2, 0.2), (0, 0, 0.1), WOOD)
    else:
        world.load("it", assets_folder() / body)
    world.box("wall", (0.1, 2.0, 2.0), (1.0, 0, 0), WOOD)
    (x, y, z), turn = world.pose("it")
    before = world.nearest("it", "wall", 2.0), {name: pose[:3] for name, pose in world.frame().poses.items()}
    world.put("it", (x + 0.1, y, z), turn)
    world.step()
    assert world.nearest("it", "wall", 2.0) == pytest.approx(before[0] - 0.1, abs=1e-5)
    for name, (i, j, k) in before[1].items():
        on = 0.1 if name != "wall" else 0.0
        assert world.frame().poses[name][:3] == pytest.approx((i + on, j, k), abs=2e-3), name  # an unheld head sags


def test_a_part_that_is_put_somewhere_rests_there(world: World) -> None:
    world.load("it", SLICE, (0, 0, 2.0), fixed=False)
    for _ in range(100):
        world.step()
    world.put("it", (0, 0, 1.0))
    world.step()
    assert world.pose("it")[0][2] == pytest.approx(1.0, abs=1e-3)  # g dt^2 = 0.17 mm of its fall


def test_a_body_that_is_removed_is_gone_and_its_name_is_free(world: World) -> None:
    world.box("table", (1, 1, 0.1), (0, 0, -0.05), WOOD)
    for _ in range(2):
        world.load("slice", SLICE, (0, 0, 0.061), fixed=False)
        for _ in range(30):
            world.step()
        assert world.touched("slice") == {"table"}
        assert world.touched("table") == {"slice"}
        world.remove("slice")
        world.step()
        assert world.names() == ["table"]
        assert world.touched("table") == set()


def test_a_covered_camera_sees_black_and_then_again(world: World) -> None:
    world.box("table", (1, 1, 0.1), (0, 0, 0), (1.0, 1.0, 1.0, 1.0))
    camera = Camera.overhead((0, 0, 1.0), 0.5, 32)
    seen = camera.picture(world)
    world.dark = True
    assert seen.any()
    assert not camera.picture(world).any()
    world.dark = False
    assert (camera.picture(world) == seen).all()


def test_the_engine_is_named_with_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    name, number = engine().split()
    assert name in world_module.ENGINES
    assert number[0].isdigit()
    monkeypatch.setattr(world_module, "ENGINES", ("no-engine",))
    with pytest.raises(WorkFailed, match="no-engine"):
        engine()
