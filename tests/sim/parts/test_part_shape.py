"""Shapes of parts: hulls, inertia and looks as they stand; mesh files of all kinds, and the wrong ones told in words."""

import tomllib
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lab.errors import BadInput
from lab.files import assets_folder
from lab.sim.mesh_file import MAX_BYTES
from lab.sim.parts import part_shape
from lab.sim.parts.part_shape import PartShape, shape_of
from lab.sim.urdf_reader import looks, rotation
from lab.sim.world import World
from lab.tasks.part_fields import PartFields
from lab.tasks.task_fields import Part

QUARTER = pi / 2
edges = st.floats(0.005, 0.2)


def part(**fields: Any) -> PartFields:
    return PartFields.model_validate({"name": "thing", "mass_kg": 0.1, **fields})


def mesh_part(**fields: Any) -> PartFields:
    return part(shape="mesh", **{"file": "thing.stl", **fields})


def ground(shape: PartShape) -> tuple[float, float]:
    """The part's extents along its x and y [m]."""
    x, y = shape.high[:2] - shape.low[:2]
    return float(x), float(y)


def angle() -> trimesh.Trimesh:
    """An L of two bars, 40 x 20 x 10 mm and on its end 10 x 20 x 30 mm: lower corner at the origin."""
    outline = [(0, 0), (0.04, 0), (0.04, 0.01), (0.01, 0.01), (0.01, 0.04), (0, 0.04)]
    points = [(x, y, z) for y in (0.0, 0.02) for x, z in outline]
    ends = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [*ends, *((c + 6, b + 6, a + 6) for a, b, c in ends)]
    for one in range(6):
        other = (one + 1) % 6
        faces += [(other, one, one + 6), (other, one + 6, other + 6)]
    made = trimesh.Trimesh(points, faces)
    assert made.volume == pytest.approx(8e-6 + 6e-6)
    return made


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes a mesh to a folder as thing.stl, or under another name; the folder."""

    def write(mesh: trimesh.Trimesh, name: str = "thing.stl") -> Path:
        mesh.export(tmp_path / name)
        return tmp_path

    return write


def refusal(fields: PartFields, folder: Path) -> str:
    with pytest.raises(BadInput) as refused:
        shape_of(fields, folder)
    return str(refused.value)


# ---- boxes and cylinders ------------------------------------------------------------------------------------------


def test_a_box(tmp_path: Path) -> None:
    """12 x 1.5 x 12 cm: about x and z (0.12^2 + 0.015^2) / 12, about y 2 x 0.12^2 / 12, for each kilogram."""
    shape = shape_of(part(shape="box", size_m=[0.12, 0.015, 0.12]), tmp_path)
    assert shape.inertia_m2 == pytest.approx((0.00121875, 0.0024, 0.00121875))
    assert (shape.foot_m, shape.height_m, *ground(shape)) == pytest.approx((0.06, 0.12, 0.12, 0.015))
    assert (shape.turn, shape.solid, len(shape.hull)) == ((0, 0, 0, 1), "box", 8)
    assert [(look.kind, look.size) for look in shape.looks] == [("box", (0.12, 0.015, 0.12))]


def test_a_cylinder_on_its_side(tmp_path: Path) -> None:
    """Rolled by a quarter turn its axis, z, lies along y; a disc's 1/2 r^2 about the axis stays the last moment."""
    lying = part(shape="cylinder", size_m=[0.04, 0.10], stands=[QUARTER, 0.0])
    shape = shape_of(lying, tmp_path)
    assert ground(shape) == pytest.approx((0.04, 0.10))
    assert shape.height_m == pytest.approx(0.04)
    assert shape.inertia_m2 == pytest.approx((0.02**2 / 4 + 0.1**2 / 12, 0.02**2 / 4 + 0.1**2 / 12, 0.02**2 / 2))
    assert rotation(shape.turn) @ [0, 0, 1] == pytest.approx([0, -1, 0])


@given(edges, edges, edges, st.floats(-3, 3), st.floats(-3, 3))
def test_a_box_that_stands_anyhow_has_its_middle_in_the_origin_and_its_foot_below(
    x: float, y: float, z: float, roll: float, pitch: float
) -> None:
    shape = shape_of(part(shape="box", size_m=[x, y, z], stands=[roll, pitch]), assets_folder())
    assert shape.low == pytest.approx(-shape.high)
    assert shape.height_m == pytest.approx(2 * shape.foot_m)
    assert np.linalg.norm(shape.hull, axis=1) == pytest.approx(np.hypot(x, np.hypot(y, z)) / 2)
    assert max(x, y, z) <= np.hypot(shape.height_m, np.hypot(*ground(shape))) + 1e-9


def test_a_slice_has_the_masses_of_its_urdf_and_its_looks() -> None:
    """In physics the slice as a part and the slice that its URDF describes are the same box."""
    fields = part(shape="box", size_m=[0.12, 0.015, 0.12], look="slice.urdf", mass_kg=0.04)
    shape = shape_of(fields, assets_folder())
    assert shape.looks == looks(assets_folder() / "slice.urdf")[""]
    known = []
    for as_part in (True, False):
        with World() as world:
            world.box("floor", (1, 1, 0.02), (0, 0, -0.01), (1, 1, 1, 1))
            if as_part:
                world.part("slice", shape, 0.04, 0.8, (0.0, 0.01, 0.1), 0.3)
            else:
                world.load("slice", assets_folder() / "slice.urdf", (0.0, 0.01, 0.1), 0.3, fixed=False)
                world.friction("slice", 0.8, spinning=0.001)
            for _ in range(240):
                world.step()
            known.append(np.concatenate(world.pose("slice")))
    assert (known[0] == known[1]).all(), "to the last bit"


# ---- meshes -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["thing.stl", "thing.obj"])
def test_an_angle_of_two_bars(write: Callable[..., Path], name: str) -> None:
    """Bars of 8 and 6 cm3, their middles at x 20 and 5 mm, z 5 and 25 mm: together at x 13.571 mm, z 13.571 mm."""
    shape = shape_of(mesh_part(file=name), write(angle(), name))
    middle = (8 * 20 + 6 * 5) / 14 / 1000
    assert (shape.foot_m, shape.height_m) == pytest.approx(((8 * 5 + 6 * 25) / 14 / 1000, 0.04))
    assert shape.low == pytest.approx([-middle, -0.01, -middle], abs=1e-6)
    assert len(shape.hull) == 10, "the inner corner is within the hull"
    assert sum(shape.inertia_m2) == pytest.approx(2 * _second_moments(), rel=1e-6)
    (look,) = shape.looks
    assert (look.kind, look.size) == ("mesh", (1.0, 1.0, 1.0))
    assert look.position == pytest.approx((-middle, -0.01, -middle), abs=1e-6)


def _second_moments() -> float:
    """The mean of x^2 + y^2 + z^2 about the middle of the angle [m2], bar by bar."""
    middle = np.array([190 / 14, 10.0, 190 / 14]) / 1000
    found = 0.0
    for share, at, size in ((8 / 14, (20, 10, 5), (40, 20, 10)), (6 / 14, (5, 10, 25), (10, 20, 30))):
        own = np.array(size) / 1000
        off = np.array(at) / 1000 - middle
        found += share * float((own**2).sum() / 12 + (off**2).sum())
    return found


def test_a_mesh_in_physics_lies_where_its_shape_says(write: Callable[..., Path]) -> None:
    """The angle on its back, turned by 0.5, comes to rest as it is put: its pose is that of its own axes."""
    shape = shape_of(mesh_part(), write(angle()))
    with World() as world:
        world.box("floor", (1, 1, 0.02), (0, 0, -0.01), (1, 1, 1, 1))
        world.part("angle", shape, 0.1, 0.8, (0.1, 0.2, shape.foot_m + 0.0005), 0.5)
        for _ in range(120):
            world.step()
        position, turn = world.pose("angle")
        assert position == pytest.approx([0.1, 0.2, shape.foot_m], abs=0.0015)
        assert turn == pytest.approx([0, 0, np.sin(0.25), np.cos(0.25)], abs=0.01)
        world.put("angle", (0, 0, 0.3), (0, 0, 0, 1))
        assert world.pose("angle")[1] == pytest.approx([0, 0, 0, 1], abs=1e-7)


def nut() -> trimesh.Trimesh:
    made: trimesh.Trimesh = trimesh.creation.annulus(r_min=0.008, r_max=0.018, height=0.016, sections=6)
    return made


def bottle() -> trimesh.Trimesh:
    outline = [(0, 0), (0.025, 0), (0.025, 0.07), (0.012, 0.09), (0.012, 0.11), (0, 0.11)]
    made: trimesh.Trimesh = trimesh.creation.revolve(np.array(outline), sections=40)
    return made


MESHES: dict[str, Callable[[], trimesh.Trimesh]] = {
    "box": lambda: trimesh.creation.box((0.05, 0.03, 0.04)),
    "cylinder": lambda: trimesh.creation.cylinder(radius=0.015, height=0.06),
    "plate": lambda: trimesh.creation.cylinder(radius=0.04, height=0.0012),
    "cone": lambda: trimesh.creation.cone(radius=0.02, height=0.05),
    "bracket": angle,
    "nut": nut,
    "bottle": bottle,
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("off", [0.0, 0.3])
def test_a_mesh_is_felt_where_it_is_seen(write: Callable[..., Path], name: str, off: float) -> None:
    """2 mm above a floor it is 2 mm from it, not less by an engine's margin; and it rests with its foot on the floor."""
    mesh = MESHES[name]()
    mesh.apply_translation((off, -off, off))
    shape = shape_of(mesh_part(), write(mesh))
    with World() as world:
        world.box("floor", (1, 1, 0.02), (0, 0, -0.01), (1, 1, 1, 1))
        world.part(name, shape, 0.1, 0.8, (0, 0, shape.foot_m + 0.002), 0.5)
        assert world.nearest(name, "floor", 0.1) == pytest.approx(0.002, abs=5e-5)
        for _ in range(120):
            world.step()
        assert world.pose(name)[0][2] == pytest.approx(shape.foot_m, abs=1e-4)


def test_the_mesh_of_the_docs_is_one(write: Callable[..., Path], root: Path) -> None:
    """The example on the page of cells, with a nut in millimetres that stands on one of its sides."""
    page = (root / "docs" / "cells.md").read_text(encoding="utf-8")
    (fields,) = tomllib.loads(page.split("```toml")[1].split("```")[0])["parts"]
    in_mm = nut()
    in_mm.apply_scale(1000)  # type: ignore[no-untyped-call]
    shape = shape_of(Part.model_validate(fields), write(in_mm, fields["file"]))
    assert shape.high[1] - shape.low[1] == pytest.approx(0.016, abs=1e-5)


def test_a_mesh_that_is_a_box_is_one_in_physics_and_a_hollow_one_is_none(write: Callable[..., Path]) -> None:
    """However the file has it: off its origin, turned, in millimetres."""
    turned = np.eye(4)
    turned[:3, :3], turned[:3, 3] = Rotation.from_rotvec((0.2, 0.4, 0.6)).as_matrix(), (90, 20, 5)
    box = trimesh.creation.box((50, 30, 40), turned)
    shape = shape_of(mesh_part(scale=0.001), write(box))
    assert shape.solid == "box"
    assert shape.size == pytest.approx((0.05, 0.04, 0.03))
    own = np.array([(i, j, k) for i in (-25, 25) for j in (-20, 20) for k in (-15, 15)]) / 1000 @ rotation(shape.turn).T
    assert np.sort(own[:, 2]) == pytest.approx(np.sort(shape.hull[:, 2]), abs=1e-6)
    hollow = trimesh.util.concatenate([trimesh.creation.box((50, 30, 40)), _inside_out((40, 20, 30))])
    assert isinstance(hollow, trimesh.Trimesh)
    assert shape_of(mesh_part(scale=0.001), write(hollow)).solid == "mesh"


def _inside_out(size: tuple[float, ...]) -> trimesh.Trimesh:
    box: trimesh.Trimesh = trimesh.creation.box(size)
    box.invert()
    return box


def test_a_mesh_of_many_corners_has_few_in_physics(write: Callable[..., Path]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    shape = shape_of(mesh_part(), write(ball))
    assert len(ball.vertices) > 2000
    assert 100 < len(shape.hull) <= 2 * part_shape.MOST_HULL
    assert np.linalg.norm(shape.hull, axis=1) == pytest.approx(0.02, abs=1e-4)
    assert shape.inertia_m2 == pytest.approx([0.4 * 0.02**2] * 3, rel=0.01)


def test_faces_that_look_inwards_are_turned_around(write: Callable[..., Path]) -> None:
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    box.invert()
    assert shape_of(mesh_part(), write(box)).inertia_m2 == pytest.approx((13e-4 / 12, 20e-4 / 12, 25e-4 / 12))


def test_a_face_that_is_turned_round_is_turned_back(write: Callable[..., Path]) -> None:
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    faces = np.array(box.faces)
    faces[3] = faces[3][::-1]
    turned = trimesh.Trimesh(box.vertices, faces, process=False)
    assert not turned.is_winding_consistent
    assert shape_of(mesh_part(), write(turned)).inertia_m2 == pytest.approx((13e-4 / 12, 20e-4 / 12, 25e-4 / 12))


@pytest.mark.parametrize(("kind", "first"), [("stl_ascii", "solid Prüfteil"), ("obj", "# Prüfteil")])
def test_a_name_in_latin_1_does_not_keep_a_mesh_from_being_read(kind: str, first: str, tmp_path: Path) -> None:
    text = trimesh.creation.box((0.02, 0.03, 0.04)).export(file_type=kind)
    name = f"thing.{kind[:3]}"
    (tmp_path / name).write_bytes("\n".join([first, *text.splitlines()[1:]]).encode("latin-1"))
    shape = shape_of(mesh_part(file=name), tmp_path)
    assert shape.height_m == pytest.approx(0.04)
    with World() as world:
        world.part("thing", shape, 0.1, 0.5, (0, 0, 0.1))
        assert world.pose("thing")[0] == pytest.approx((0, 0, 0.1))


def holed() -> trimesh.Trimesh:
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    return trimesh.Trimesh(box.vertices, box.faces[1:])


def test_a_mesh_with_a_hole_is_refused_unless_its_hull_is_taken(write: Callable[..., Path]) -> None:
    folder = write(holed())
    assert refusal(mesh_part(), folder) == (
        "part 'thing': file = 'thing.stl': its surface is not closed: 3 open edges (a hole); close it, or set hull = true, "
        "which takes its convex hull"
    )
    taken = shape_of(mesh_part(hull=True), folder)
    assert taken.inertia_m2 == pytest.approx(
        shape_of(mesh_part(), write(trimesh.creation.box((0.02, 0.03, 0.04)))).inertia_m2
    )


def test_a_mesh_in_millimetres_is_refused_with_the_scale_that_was_meant(write: Callable[..., Path]) -> None:
    folder = write(trimesh.creation.box((80, 30, 20)))
    says = refusal(mesh_part(), folder)
    scales = "scale = 0.001 (mm) would make it 0.08 m, 0.01 (cm) would make it 0.8 m"
    assert f"it is 80 m long: allowed are 0.002 to 2.0 m; {scales}" in says
    assert ground(shape_of(mesh_part(scale=0.001), folder)) == pytest.approx((0.08, 0.03))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no such file, neither in"),
        (b"", "wanted a solid"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a mesh of 3 vertices: wanted a solid"),
        (b"v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n", "vertex 1 is not finite"),
        (b"v 0 0 0\nv .1 0 0\nv 0 .1 0\nv .1 .1 0\nf 1 2 3\nf 2 4 3\nf 1 3 2\nf 2 3 4\n", "it is flat: wanted a solid"),
        (b"\x00\xff no mesh at all", "thing.obj'"),
        (b"v 0\nv .1\nv .2\nv .3\nf 1 2 3\nf 2 4 3\nf 1 3 2\nf 2 3 4\n", "its vertices are not three numbers each"),
    ],
)
def test_what_is_no_solid_is_refused(tmp_path: Path, content: bytes | None, says: str) -> None:
    if content is not None:
        (tmp_path / "thing.obj").write_bytes(content)
    found = refusal(mesh_part(file="thing.obj"), tmp_path)
    assert found.startswith("part 'thing': file = 'thing.obj'")
    assert says in found


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "thing.stl").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    assert "it has 20000001 bytes, allowed are 20000000" in refusal(mesh_part(), tmp_path)


def test_an_stl_in_text_has_not_too_many_triangles(
    write: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(part_shape, "MOST_TEXT", 11)
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    assert shape_of(mesh_part(), write(box)).height_m == pytest.approx(0.04)
    box.export(tmp_path / "thing.stl", file_type="stl_ascii")
    assert "an STL in text of 12 triangles: up to 11 are read: save it as binary" in refusal(mesh_part(), tmp_path)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path, write: Callable[..., Path]) -> None:
    write(trimesh.creation.box((0.02, 0.03, 0.04)), "outside.stl")
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "thing.stl").symlink_to(tmp_path / "outside.stl")
    assert f"it lies outside the folder '{folder}'" in refusal(mesh_part(), folder)


def test_a_look_of_several_links_is_refused(tmp_path: Path) -> None:
    says = refusal(part(shape="box", size_m=[0.1, 0.1, 0.1], look="applier.urdf"), tmp_path)
    assert "look = 'applier.urdf': it has 3 links" in says


def test_a_look_stands_and_is_off_as_its_part_is(write: Callable[..., Path]) -> None:
    """What is seen of an angle's corner, rolled by a quarter turn, lies where the corner of its hull does."""
    shape: PartShape = shape_of(mesh_part(stands=[QUARTER, 0.0]), write(angle()))
    (look,) = shape.looks
    corner = rotation(look.quaternion) @ [0.04, 0.02, 0.01] + look.position
    assert np.abs(shape.hull - corner).max(axis=1).min() < 1e-6
