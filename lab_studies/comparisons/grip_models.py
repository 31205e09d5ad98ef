"""Twenty parts that others made, as parts of a task: models that pybullet_data ships, and trimesh's primitives."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from math import asin, atan2
from pathlib import Path
from shutil import copyfile
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.sim.parts.part_shape import shape_of
from lab.sim.urdf_reader import rotation
from lab.sim.world import World
from lab.tasks.part_fields import PartFields

if TYPE_CHECKING:
    from trimesh import Trimesh

MASS_KG, FRICTION = 0.1, 0.8
GRASPABLE_M, FITTED_M = 0.036, 0.03  # a model whose middle extent is above the first is scaled to the second
SETTLE_STEPS = 480  # of physics, until a dropped part is at rest
TABLE_RGBA = (0.8, 0.8, 0.8, 1.0)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """One model: a file of pybullet_data, or a primitive of trimesh by its name; scale: that of its own URDF, or to metres.

    hull: its surface is not closed, and its convex hull is used. rolls: it has no upright pose, and may roll when released.
    """

    name: str
    file: str | None = None
    scale: float = 1.0
    hull: bool = False
    rolls: bool = False


MODELS = (
    Model("lego brick", "lego/lego.obj", 0.1, hull=True),
    Model("domino", "domino/domino.obj"),
    Model("cube", "cube.obj"),
    Model("mug", "objects/mug.obj", hull=True),
    Model("duck", "duck_vhacd.obj", 0.05),
    Model("teddy", "teddy2_VHACD_CHs.obj", 0.1),
    Model("bunny", "bunny.obj"),
    Model("soccer ball", "soccerball.obj", rolls=True),
    Model("prism", "toys/prism.obj"),
    Model("blob 009", "random_urdfs/009/009.obj", 0.015),
    Model("blob 472", "random_urdfs/472/472.obj", 0.015),
    Model("motor", "quadruped/tmotor3.obj"),
    Model("pinion", "differential/diff_pinion.stl", 0.001),
    Model("toe brake", "quadruped/microtaur/toe_brake.stl"),
    Model("panda finger", "franka_panda/meshes/collision/finger.obj"),
    Model("capsule", rolls=True),
    Model("cone"),
    Model("icosahedron", rolls=True),
    Model("annulus"),
    Model("torus"),
)


def primitive(name: str) -> "Trimesh":
    """The primitive of trimesh with this name."""
    from trimesh import creation

    made: dict[str, Callable[[], Any]] = {
        "capsule": lambda: creation.capsule(height=1.0, radius=0.5),
        "cone": lambda: creation.cone(radius=0.5, height=1.0),
        "icosahedron": creation.icosahedron,
        "annulus": lambda: creation.annulus(r_min=0.5, r_max=1.0, height=1.0),
        "torus": lambda: creation.torus(major_radius=1.0, minor_radius=0.25),
    }
    return cast("Trimesh", made[name]())


def part_of_model(model: Model, folder: Path) -> PartFields:
    """The fields of a part of the model, which stands as it comes to rest in physics; its file is written to `folder`."""
    if model.file is None:
        name = f"{model.name}.stl"
        primitive(model.name).export(folder / name)
    else:
        name = Path(model.file).name
        copyfile(_models() / model.file, folder / name)
    fields = {
        "name": model.name,
        "shape": "mesh",
        "file": name,
        "hull": model.hull,
        "mass_kg": MASS_KG,
        "friction": FRICTION,
    }
    first = PartFields.model_validate({**fields, "scale": _fitting(folder / name, model.scale)})
    stands = rest_pose(first.model_copy(update={"stands": _stable(first, folder)}), folder)
    return first.model_copy(update={"stands": stands})


def _models() -> Path:
    package = find_spec("pybullet_data")  # only its folder is used
    if package is None or not package.submodule_search_locations:
        raise WorkFailed("pybullet_data, the folder of PyBullet's models, is missing: install pybullet again")
    return Path(package.submodule_search_locations[0])


def _fitting(path: Path, own: float) -> float:
    """The model's own scale if that gives a graspable size, else one with two digits that does."""
    import trimesh

    middle = sorted(trimesh.load_mesh(path).extents)[1]
    return own if own * middle <= GRASPABLE_M else float(f"{FITTED_M / middle:.2g}")


def _stable(part: PartFields, folder: Path) -> tuple[float, float]:
    """Roll and pitch [rad] of the most likely stable pose on a plane."""
    import trimesh

    hull = trimesh.Trimesh(shape_of(part, folder).hull).convex_hull
    poses, chances = trimesh.poses.compute_stable_poses(hull, center_mass=np.zeros(3))
    return roll_and_pitch(poses[int(np.argmax(chances))][:3, :3])


def rest_pose(part: PartFields, folder: Path) -> tuple[float, float]:
    """The roll and pitch [rad] at which a part comes to rest after it is set down on a plane as its field `stands` says."""
    shape = shape_of(part, folder)
    with World() as world:
        world.box("floor", (1, 1, 0.02), (0, 0, -0.01), TABLE_RGBA)
        world.part(part.name, shape, part.mass_kg, part.friction, (0, 0, shape.foot_m + 0.0005))
        for _ in range(SETTLE_STEPS):
            world.step()
        turned = rotation(world.pose(part.name)[1])
    before = rotation(shape.looks[0].quaternion)  # from the file's axes to those of the part
    return roll_and_pitch(turned @ before)


def roll_and_pitch(turn: Array) -> tuple[float, float]:
    """The roll and pitch [rad] of a rotation matrix (3, 3) by roll, then pitch, then yaw."""
    roll, pitch = atan2(turn[2, 1], turn[2, 2]), -asin(float(np.clip(turn[2, 0], -1, 1)))
    return round(roll, 6) + 0.0, round(pitch, 6) + 0.0
