"""The generated models: what is committed is what the parameters make, and it is what the cell needs."""

from pathlib import Path

import numpy as np
import pytest

from lab.files import assets_folder
from lab.sim import models
from lab.sim.urdf_reader import validate
from lab.sim.world import World


def test_the_committed_files_are_what_the_parameters_make(tmp_path: Path) -> None:
    written = models.write(tmp_path)
    committed = {path.name: path.read_text() for path in assets_folder().iterdir() if path.is_file()}
    assert sorted(committed) == sorted(path.name for path in written), "a stray or a missing file in assets/"
    changed = [path.name for path in written if path.read_text() != committed[path.name]]
    assert not changed, "run lab.sim.models.write(assets_folder()) and commit"


@pytest.mark.parametrize("name", models.MODELS)
def test_every_model_is_a_valid_urdf_of_its_own_name(name: str) -> None:
    text, meshes = models.urdf(models.MODELS[name]())
    assert f'<robot name="{name}">' in text
    assert all(f'filename="{mesh}"' in text for mesh in meshes)
    validate(assets_folder() / f"{name}.urdf")


def test_an_obj_has_a_normal_for_every_face_and_no_negative_zero() -> None:
    import trimesh

    text = models.obj(trimesh.creation.box(extents=(2.0, 4.0, 6.0)))
    lines = text.splitlines()
    vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
    assert sorted(map(tuple, np.unique(np.abs(vertices), axis=0))) == [(1.0, 2.0, 3.0)]
    assert sum(line.startswith("vn ") for line in lines) == 6
    faces = [line.split()[1:] for line in lines if line.startswith("f ")]
    assert len(faces) == 12
    corners = [corner.split("//") for face in faces for corner in face]
    assert {int(normal) for _, normal in corners} == set(range(1, 7))
    assert {int(vertex) for vertex, _ in corners} == set(range(1, 9))
    assert "-0 " not in text
    assert "-0\n" not in text


def test_a_slice_weighs_and_turns_like_a_homogeneous_box() -> None:
    text, _ = models.urdf(models.bread())
    (x, y, z), kg = models.SLICE, models.SLICE_KG
    expected = f'ixx="{kg * (y**2 + z**2) / 12:.9g}" ixy="0" ixz="0" iyy="{kg * (x**2 + z**2) / 12:.9g}"'
    assert f'<mass value="{kg:g}" />' in text
    assert expected in text


def test_the_toaster_has_a_slot_that_a_slice_fits_in(world: World) -> None:
    world.load("toaster", assets_folder() / "toaster.urdf")

    def top(x: float, y: float) -> float:
        hit = world.ray((x, y, 0.5), (x, y, -0.5))
        assert hit is not None
        return float(hit[1][2])

    half_length, half_width = models.SLICE[0] / 2, models.SLICE[1] / 2
    for x in (-half_length, 0.0, half_length):
        for y in (-half_width, 0.0, half_width):
            assert top(x, y) == pytest.approx(models.TOASTER_FLOOR, abs=1e-4)
    for x, y in ((0.0, 0.02), (0.0, -0.02), (0.08, 0.0), (-0.08, 0.0)):
        assert top(x, y) == pytest.approx(models.TOASTER[2], abs=1e-4)


def test_a_slice_stands_in_the_applier_with_its_back_against_the_rest(world: World) -> None:
    world.load("applier", assets_folder() / "applier.urdf")
    height = models.SLICE[2]
    world.load("slice", assets_folder() / "slice.urdf", (0, 0, models.APPLIER_FLOOR + height / 2), fixed=False)
    for _ in range(240):
        world.step()
    position, turn = world.pose("slice")
    assert position == pytest.approx((0, 0, models.APPLIER_FLOOR + height / 2), abs=2e-3)
    assert 1 - 2 * (turn[0] ** 2 + turn[1] ** 2) > 0.999
    world.step()
    assert world.pose("slice")[0] == pytest.approx(position, abs=1e-5)
