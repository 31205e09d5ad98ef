"""What a physics engine is told of a part's shape: what is felt of it, and what cameras see, in its principal axes."""

from collections.abc import Callable
from typing import Any

from lab.sim.mesh_file import text_corners
from lab.sim.parts.part_shape import PartShape, visual_arrays

Call = Callable[..., Any]


def solid_of(engine: Any, call: Call, shape: PartShape) -> int:
    """The number of what is felt of a part; engine: PyBullet, `call` calls it by a function's name."""
    if shape.solid == "box":
        return int(call("createCollisionShape", engine.GEOM_BOX, halfExtents=[s / 2 for s in shape.size]))
    if shape.solid == "cylinder":
        diameter, height = shape.size
        return int(call("createCollisionShape", engine.GEOM_CYLINDER, radius=diameter / 2, height=height))
    return int(call("createCollisionShape", engine.GEOM_MESH, vertices=shape.inner[0].tolist()))


def seen_of(engine: Any, call: Call, shape: PartShape) -> int:
    """The number of what cameras see of a part; of meshes in text, which PyBullet cannot read, the first alone."""
    back = engine.invertTransform([0, 0, 0], list(shape.turn))[1]
    places = [engine.multiplyTransforms([0, 0, 0], back, look.position, look.quaternion) for look in shape.looks]
    if (corners := text_corners(shape.looks[0].mesh)) is not None:
        look = shape.looks[0]
        place = dict(zip(("visualFramePosition", "visualFrameOrientation"), places[0], strict=True))
        corners, faces = corners * (look.size or (1.0, 1.0, 1.0)), list(range(len(corners)))
        place |= {"vertices": corners.tolist(), "indices": faces, "rgbaColor": look.rgba}
        return int(call("createVisualShape", engine.GEOM_MESH, **place))
    arrays = visual_arrays(shape.looks)
    kinds = [getattr(engine, f"GEOM_{look.kind.upper()}") for look in shape.looks]
    at, turns = ([list(one) for one in ways] for ways in zip(*places, strict=True))  # PyBullet crashes over tuples
    arrays |= {"shapeTypes": kinds, "visualFramePositions": at, "visualFrameOrientations": turns}
    return int(call("createVisualShapeArray", **arrays))
