"""A software rasterizer: pictures of bodies without a display or a browser, with a depth buffer and a lamp's shadows.

Each corner is projected to homogeneous pixels (x w, y w, w), and nothing is clipped: with the inverse of a face's three
corners, a pixel's three weights are all positive where the face covers it, and their sum is 1 / w. Source: Olano and Greer,
Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import without_refcounts
from lab.sim.frames import Body, Frame, Recording, Vector, Viewpoint


class Still:
    """A viewer that keeps the bodies and frames that it is given."""

    def __init__(self) -> None:
        self.recording = Recording(())

    def show(self, bodies: Sequence[Body]) -> None:
        """Keep these bodies, and forget earlier ones and their frames."""
        self.recording = Recording(tuple(bodies))

    def update(self, frame: Frame) -> None:
        """Keep a frame as well."""
        self.recording.frames.append(frame)


# ---- drawing meshes ---------------------------------------------------------------------------------------------------


Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

FIELD_OF_VIEW_RAD = radians(38.0)  # from bottom to top, as on the page
BACKGROUND = (0.945, 0.955, 0.965)  # sRGB
LAMP: Vector = (2.2, -1.6, 4.0)  # direction of the lamp from the camera's target
LAMP_M, LAMP_REACH_M = (
    12.0,
    2.4,
)  # [m] the lamp's distance, and the radius around the target within which it casts shadows
LAMP_PIXELS = 1536  # width and height of the shadow map
SKY, SUN, WINDOW = 0.50, 0.56, 0.16  # strength of each light, as on the page
GROUND_LIGHT = (0.62, 0.58, 0.51)  # share of the sky's light that the ground reflects
FROM_WINDOW: Vector = (-0.48, 0.73, 0.48)
FINER = 2  # subpixels along each side of a pixel, whose mean is shown
MARGIN = 0.04  # share of the picture's sides that stays free
LEAST_AREA = 1e-12


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one colour in their body's frame: positions [m] and normals (n, 3), faces (m, 3), rgba in sRGB."""

    positions: Floats
    normals: Floats
    faces: Whole
    rgba: tuple[float, float, float, float]


class Rasterizer:
    """Draws bodies, each made of meshes, from one camera; whatever never changes is computed once."""

    def __init__(
        self, bodies: Sequence[Sequence[Mesh]], camera: Viewpoint, width: int, height: int, around: Floats | None = None
    ) -> None:
        """around (n, 3): points [m] that fill the picture; without them, the picture is the camera's whole view."""
        meshes = [(number, mesh) for number, body in enumerate(bodies) for mesh in body]
        sizes = [len(mesh.positions) for _, mesh in meshes]
        firsts = np.cumsum([0, *sizes[:-1]])
        self._body_of_corner = np.repeat([number for number, _ in meshes], sizes)
        self._positions = np.concatenate([mesh.positions for _, mesh in meshes])
        self._normals = np.concatenate([mesh.normals for _, mesh in meshes])
        self._faces = np.concatenate([mesh.faces + first for first, (_, mesh) in zip(firsts, meshes, strict=True)])
        counts = [len(mesh.faces) for _, mesh in meshes]
        self._mesh_of_face = np.repeat(np.arange(len(meshes)), counts)
        self._body_of_mesh = np.array([number for number, _ in meshes])
        self._rgba = np.array([mesh.rgba for _, mesh in meshes])
        self._size = (height * FINER, width * FINER)
        self._eye = np.array(camera.eye)
        target = np.array(camera.target)
        self._camera = _projection(self._eye, target, tan(FIELD_OF_VIEW_RAD / 2), *self._size)
        if around is not None:
            self._camera = _filled_by(around, self._camera, *self._size)
        self._from_lamp = np.array(LAMP) / np.linalg.norm(LAMP)
        lamp_at = target + LAMP_M * self._from_lamp
        self._lamp = _projection(lamp_at, target, LAMP_REACH_M / LAMP_M, LAMP_PIXELS, LAMP_PIXELS)

    def picture(self, places: Floats, turns: Floats, shown: NDArray[np.bool_], rgba: Floats) -> NDArray[np.uint8]:
        """The picture (height, width, 3) uint8 of bodies at places (bodies, 3) [m], rotated by matrices (bodies, 3, 3).

        shown (bodies,): whether a body is visible; rgba (bodies, 4): the colour of all its shapes, NaN: their own.
        """
        turn = turns[self._body_of_corner]
        at = np.einsum("nij,nj->ni", turn, self._positions) + places[self._body_of_corner]
        normals = np.einsum("nij,nj->ni", turn, self._normals)
        given = rgba[self._body_of_mesh]
        colours = np.where(np.isnan(given), self._rgba, given)
        seen = shown[self._body_of_mesh[self._mesh_of_face]]
        alpha = colours[self._mesh_of_face, 3]
        *_, shadows = self._nearest(at, np.flatnonzero(seen & (alpha > 0.5)), self._lamp, LAMP_PIXELS, LAMP_PIXELS)
        drawn = np.tile(_linear(np.array(BACKGROUND)), (*self._size, 1))
        near = np.zeros(self._size)
        for chosen in (seen & (alpha >= 1.0), seen & (alpha < 1.0)):  # opaque faces first, then transparent ones
            faces = np.flatnonzero(chosen)
            if len(faces):
                weights, face_at, near = self._nearest(at, faces, self._camera, *self._size, behind=near)
                corners = self._faces[faces]
                lit = _linear(colours[self._mesh_of_face[faces], :3])
                directions = np.stack([self._from_lamp, np.array(FROM_WINDOW), np.array(GROUND_LIGHT)])
                _shade(
                    Seen(face_at, near, weights),
                    Corners(at[corners], normals[corners], np.concatenate([lit, alpha[faces, None]], axis=1)),
                    Lighting(self._eye, directions, self._lamp, shadows),
                    drawn,
                )
        height, width = self._size[0] // FINER, self._size[1] // FINER
        means = drawn.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3))
        return np.asarray(np.round(255.0 * _encoded(means)), dtype=np.uint8)

    def _nearest(
        self, at: Floats, faces: Whole, projection: Floats, height: int, width: int, behind: Floats | None = None
    ) -> tuple[Floats, Whole, Floats]:
        """The faces' weights (faces, 3, 3); for each pixel (height, width) the nearest face, -1 for none, and its 1 / w.

        behind: the 1 / w of what is drawn already; faces behind it are hidden.
        """
        corners = (at @ projection[:, :3].T + projection[:, 3])[self._faces[faces]]
        first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
        crosses = np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=1)
        volumes = np.einsum("fi,fi->f", first, crosses[:, 0])
        fine = abs(volumes) > LEAST_AREA
        weights = crosses / np.where(fine, volumes, np.inf)[:, None, None]
        ahead = corners[:, :, 2:] > 0
        pixels = np.nan_to_num(corners[:, :, :2] / np.where(ahead, corners[:, :, 2:], 1.0))
        whole = ~ahead.all(axis=(1, 2))[:, None]  # a face that reaches behind the camera may cover any pixel
        lows = np.where(whole, 0, np.clip(np.floor(pixels.min(axis=1)), 0, (width, height)))
        highs = np.where(whole, (width, height), np.clip(np.ceil(pixels.max(axis=1)), 0, (width, height)))
        highs[~fine | ~ahead.any(axis=(1, 2))] = 0
        near = np.zeros((height, width)) if behind is None else behind.copy()
        face_at = np.full((height, width), -1, dtype=np.int64)
        _fill(weights, np.concatenate([lows, highs], axis=1).astype(np.int64), face_at, near)
        return weights, face_at, near


def _projection(eye: Floats, target: Floats, slope: float, height: int, width: int) -> Floats:
    """The projection (3, 4) of world points to homogeneous pixels; `slope`: tangent of half the vertical field of view."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0) if abs(ahead[2]) < 0.999 else (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    scale = height / 2 / slope
    rows = np.stack(
        [
            scale * right + width / 2 * ahead,
            scale * np.cross(ahead, right) + height / 2 * ahead,
            ahead,
        ]
    )
    return np.concatenate([rows, -rows @ eye[:, None]], axis=1)


def _filled_by(points: Floats, projection: Floats, height: int, width: int) -> Floats:
    """The projection (3, 4), scaled and shifted so that the points (n, 3) in front of the camera fill the picture."""
    seen = points @ projection[:, :3].T + projection[:, 3]
    pixels = seen[seen[:, 2] > 0, :2] / seen[seen[:, 2] > 0, 2:]
    if not len(pixels):
        return projection
    low, high, size = pixels.min(axis=0), pixels.max(axis=0), np.array([width, height])
    larger = float((size / np.maximum(high - low, 1.0)).min()) * (1.0 - 2.0 * MARGIN)
    zoom = np.diag([larger, larger, 1.0])
    zoom[:2, 2] = (size - larger * (low + high)) / 2
    return np.asarray(zoom @ projection)


def _linear(colours: Floats) -> Floats:
    """The linear light of sRGB colours."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


def _encoded(light: Floats) -> Floats:
    """The sRGB colours of linear light, clipped to 0..1."""
    light = np.clip(light, 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def fill(weights: Floats, boxes: Whole, face_at: Whole, near: Floats) -> None:
    """Write into `face_at` and `near`, for each pixel, the nearest face that covers it, and its 1 / w.

    boxes (faces, 4): bounds of each face in pixels, from x, y up to x, y.
    """
    for face in range(len(weights)):
        for y in range(boxes[face, 1], boxes[face, 3]):
            for x in range(boxes[face, 0], boxes[face, 2]):
                a, b = x + 0.5, y + 0.5
                first = weights[face, 0, 0] * a + weights[face, 0, 1] * b + weights[face, 0, 2]
                second = weights[face, 1, 0] * a + weights[face, 1, 1] * b + weights[face, 1, 2]
                third = weights[face, 2, 0] * a + weights[face, 2, 1] * b + weights[face, 2, 2]
                if first >= 0.0 and second >= 0.0 and third >= 0.0 and first + second + third > near[y, x]:
                    near[y, x] = first + second + third
                    face_at[y, x] = face


class Seen(NamedTuple):
    """The nearest face of each pixel (h, w), how near it is (h, w), and the weights of its corners (faces, 3, 3)."""

    face_at: Whole
    near: Floats
    weights: Floats


class Corners(NamedTuple):
    """The faces' corners: places and normals (faces, 3, 3), and the faces' colours (faces, 4), linear."""

    places: Floats
    normals: Floats
    colours: Floats


class Lighting(NamedTuple):
    """The eye (3,); lights (3, 3): the directions to the lamp and to the window, and what comes back from below.

    lamp: the lamp's camera; shadows: what it sees.
    """

    eye: Floats
    lights: Floats
    lamp: Floats
    shadows: Floats


def shade(seen: Seen, corners: Corners, lighting: Lighting, drawn: Floats) -> None:
    """Blends the light of each pixel over `drawn` (h, w, 3), in place."""
    face_at, near, weights = seen
    places, normals, colours = corners
    eye, lights, lamp, shadows = lighting
    for y in range(len(near)):
        for x in range(near.shape[1]):
            face = face_at[y, x]
            if face < 0:
                continue
            px, py, pz, nx, ny, nz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for corner in range(3):
                share = weights[face, corner, 0] * (x + 0.5) + weights[face, corner, 1] * (y + 0.5)
                share = (share + weights[face, corner, 2]) / near[y, x]
                px += share * places[face, corner, 0]
                py += share * places[face, corner, 1]
                pz += share * places[face, corner, 2]
                nx += share * normals[face, corner, 0]
                ny += share * normals[face, corner, 1]
                nz += share * normals[face, corner, 2]
            length = (nx * nx + ny * ny + nz * nz) ** 0.5
            if nx * (eye[0] - px) + ny * (eye[1] - py) + nz * (eye[2] - pz) < 0.0:
                length = -length  # the back of a face of an open mesh
            if length != 0.0:
                nx, ny, nz = nx / length, ny / length, nz / length
            sun = max(0.0, nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2])
            if sun > 0.0:
                qx, qy, qz = px + 0.01 * nx, py + 0.01 * ny, pz + 0.01 * nz
                w = lamp[2, 0] * qx + lamp[2, 1] * qy + lamp[2, 2] * qz + lamp[2, 3]
                u = int((lamp[0, 0] * qx + lamp[0, 1] * qy + lamp[0, 2] * qz + lamp[0, 3]) / w)
                v = int((lamp[1, 0] * qx + lamp[1, 1] * qy + lamp[1, 2] * qz + lamp[1, 3]) / w)
                hidden = 0
                if 2 <= u < len(shadows) - 2 and 2 <= v < len(shadows) - 2:
                    for a in range(-2, 3):
                        for b in range(-2, 3):
                            hidden += shadows[v + a, u + b] * w > 1.0
                sun *= 1.0 - hidden / 25.0
            window = max(0.0, nx * lights[1, 0] + ny * lights[1, 1] + nz * lights[1, 2])
            up, alpha = 0.5 + 0.5 * nz, colours[face, 3]
            for channel in range(3):
                light = SKY * (up + (1.0 - up) * lights[2, channel]) + SUN * sun + WINDOW * window
                drawn[y, x, channel] += alpha * (light * colours[face, channel] - drawn[y, x, channel])


_fill, _shade = without_refcounts(fill), without_refcounts(shade)
