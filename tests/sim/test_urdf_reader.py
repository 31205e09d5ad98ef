"""A URDF that PyBullet would load in silence, and choke on later, is refused with the reason."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.sim import urdf_reader

GOOD = """<robot name="thing">
  <link name="root">
    <inertial><mass value="1.5"/><inertia ixx="2" ixy="0" ixz="0" iyy="2" iyz="0" izz="2"/></inertial>
    <visual>
      <origin xyz="0 0 1"/><geometry><mesh filename="part.obj"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material>
    </visual>
    <visual><geometry><sphere radius="1"/></geometry></visual>
  </link>
  <link name="arm">
    <inertial><mass value="1"/><inertia ixx="2" ixy="0" ixz="0" iyy="2" iyz="0" izz="2"/></inertial>
    <visual><geometry><box size="1 2 3"/></geometry></visual>
  </link>
  <joint name="turn" type="revolute">
    <parent link="root"/><child link="arm"/><limit lower="-1" upper="1"/>
  </joint>
</robot>"""
MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


def written(folder: Path, text: str = GOOD, mesh: str | bytes | None = MESH) -> Path:
    path = folder / "thing.urdf"
    path.write_text(text)
    if mesh is not None:
        (folder / "part.obj").write_bytes(mesh if isinstance(mesh, bytes) else mesh.encode())
    return path


def refusal(path: Path) -> str:
    with pytest.raises(BadInput) as caught:
        urdf_reader.validate(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


def test_a_sound_urdf_is_accepted_and_its_looks_are_read(tmp_path: Path) -> None:
    path = written(tmp_path)
    urdf_reader.validate(path)
    looks = urdf_reader.looks(path)
    assert set(looks) == {"", "arm"}
    mesh, ball = looks[""]
    assert (mesh.kind, mesh.mesh, mesh.rgba, mesh.position) == ("mesh", tmp_path / "part.obj", (1, 0, 0, 1), (0, 0, 1))
    assert (ball.kind, ball.size) == ("sphere", (1,))
    (box,) = looks["arm"]
    assert (box.kind, box.size) == ("box", (1, 2, 3))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('mass value="1.5"', 'mass value="-1.5"', "mass of link 'root' is -1.5 kg"),
        ('mass value="1.5"', 'mass value="0"', "mass of link 'root' is 0 kg"),
        ('mass value="1.5"', 'mass value="nan"', "mass of link 'root' is 'nan', wanted a finite number"),
        ('mass value="1.5"', 'mass value="inf"', "finite"),
        ('mass value="1.5"', 'mass value="heavy"', "'heavy'"),
        ('<mass value="1.5"/>', "", "link 'root' has no mass"),
        ('ixx="2" ixy="0"', 'ixx="nan" ixy="0"', "ixx of link 'root' is 'nan'"),
        ('ixx="2" ixy="0"', 'ixx="-2" ixy="0"', "inertia of link 'root' is not positive definite"),
        ('ixx="2" ixy="0"', 'ixx="2" ixy="3"', "not positive definite"),
        ('ixx="2" ixy="0"', 'ixy="0"', "ixx of link 'root' is 'None'"),
        (
            'parent link="root"',
            'parent link="rot"',
            "unknown link 'rot' (parent of joint 'turn'): did you mean 'root'?",
        ),
        ('<child link="arm"/>', "", "unknown link ''"),
        ('lower="-1"', 'lower="2"', "lower limit 2 above upper limit 1"),
        ('upper="1"', 'upper="nan"', "upper limit of joint 'turn' is 'nan'"),
        ('xyz="0 0 1"', 'xyz="0 0"', "xyz of a <origin> is '0 0', wanted 3 numbers"),
        ('xyz="0 0 1"', 'xyz="0 0 up"', "xyz of a <origin> is 'up', wanted a finite number"),
        ('radius="1"', 'radius="-1"', "radius of a <sphere> is '-1', wanted above 0"),
        ("part.obj", "missing.obj", "mesh 'missing.obj' is missing"),
        ("part.obj", "../part.obj", "mesh '../part.obj' lies outside"),
        ("part.obj", "/etc/hostname", "mesh '/etc/hostname' lies outside"),
        ("part.obj", "", "mesh '' lies outside"),
        ("part.obj", "x" * 300, "is missing"),
        ('<robot name="thing">', '<!DOCTYPE robot><robot name="thing">', "must not declare a document type"),
        ('<robot name="thing">', '<!DOCTYPE r [<!ENTITY a "b">]><robot name="thing">', "document type or entities"),
        ("</robot>", "", "not a readable URDF"),
    ],
)
def test_a_bad_urdf_is_refused_with_the_reason(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in GOOD
    assert said in refusal(written(tmp_path, GOOD.replace(old, new)))


def test_what_is_no_urdf_at_all_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "<html><link name='a'/></html>")
    assert "the root is <html>" in refusal(path)
    assert "with 0 links" in refusal(written(tmp_path, "<robot/>"))
    path.write_bytes(b"\xff\xfe\x00solid")
    assert "not a readable URDF" in refusal(path)
    assert "not a readable URDF" in refusal(tmp_path / "nowhere.urdf")
    assert "not a readable URDF" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        ("", "has 0 vertices"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "has 3 vertices"),
        ("f 1 2 3\n", "has 0 vertices"),
        (MESH.replace("v 0 1 0", "v 0 nan 0"), "not three finite numbers"),
        (MESH.replace("v 0 1 0", "v 0 inf 0"), "not three finite numbers"),
        (MESH.replace("v 0 1 0", "v 0 one 0"), "is not an OBJ file"),
        (MESH.replace("v 0 1 0", "v 0 1"), "is not an OBJ file"),
        ("v 0 0\nv 1 0\nv 0 1\nv 1 1\nf 1 2 3\n", "not three finite numbers"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", "is not an OBJ file"),
    ],
)
def test_a_garbage_mesh_is_refused(tmp_path: Path, mesh: str | bytes, said: str) -> None:
    assert said in refusal(written(tmp_path, mesh=mesh))


def test_a_mesh_reached_through_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "part.obj").write_text(MESH)
    (inside / "part.obj").symlink_to(tmp_path / "part.obj")
    assert "lies outside" in refusal(written(inside, mesh=None))
