"""Calibration: a camera's lens and pose, computed from pictures of a mat with ArUco markers, or from four corners."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import radians
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed, counted
from lab.files import json_of, read_limited, write_whole
from lab.lazy import cv2
from lab.vision.lens import TERMS, Lens
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

DICTIONARY = "DICT_4X4_50"
LEAST_MARKERS = 4  # of the mat that each picture must show
FEW = 3  # pictures: with fewer the focal length must be given, and the principal point and p1, p2 are not estimated
UNSURE = 0.05  # of the focal length: a result with a larger standard deviation is rejected
MAX_BYTES = 100_000
PRINTED = 2000.0  # pixels per metre of the mat's image from which photographs are rendered
TABLE_RGB = (219, 217, 212)


@dataclass(frozen=True)
class Mat:
    """A mat with `columns` x `rows` ArUco markers (dictionary 4x4_50), numbered row by row from the upper left.

    A marker is `marker_m` [m] wide and `gap_m` from the next. The mat's middle lies at `middle_m` (x, y) on z = 0; its
    upper edge points along the world's y axis.
    """

    middle_m: tuple[float, float] = (0.0, 0.0)
    columns: int = 6
    rows: int = 6
    marker_m: float = 0.10
    gap_m: float = 0.04

    @property
    def board(self) -> Any:
        """The mat as an OpenCV board, whose origin is the upper left corner, y downwards."""
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
        return cv2.aruco.GridBoard((self.columns, self.rows), self.marker_m, self.gap_m, dictionary)

    @property
    def size_m(self) -> tuple[float, float]:
        """Length and width from the first marker's outer edge to the last one's [m]."""
        pitch = self.marker_m + self.gap_m
        return self.columns * pitch - self.gap_m, self.rows * pitch - self.gap_m

    def printed(self, pixels_per_m: float) -> Image:
        """The mat as a picture to be printed, without a border."""
        width, height = (max(1, round(side * pixels_per_m)) for side in self.size_m)
        grey = self.board.generateImage((width, height))
        return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB), dtype=np.uint8)

    def world(self, on_board: Array) -> Array:
        """The world coordinates (n, 3) [m] of points on the board (n, 3)."""
        length, width = self.size_m
        x, y = self.middle_m[0] - length / 2, self.middle_m[1] + width / 2
        return np.column_stack([x + on_board[:, 0], y - on_board[:, 1], np.zeros(len(on_board))])

    def photographed(self, lens: Lens, turn: Array, shift: Array) -> Image:
        """The picture that a lens takes of the mat in its place; `turn` (3, 3) and `shift` (3,) [m]: world to camera."""
        side, ahead = round(1.4 * max(lens.size)), lens.focal
        pinhole = np.array([[ahead[0], 0, side / 2], [0, ahead[1], side / 2], [0, 0, 1.0]])
        (length, width), step = self.size_m, 1 / PRINTED
        x, y = self.middle_m[0] - length / 2, self.middle_m[1] + width / 2
        world_from_mat = np.array([[step, 0, x + step / 2], [0, -step, y - step / 2], [0, 0, 0], [0, 0, 1.0]])
        way = pinhole @ np.column_stack([turn, shift]) @ world_from_mat
        wide: Any = cv2.warpPerspective(
            self.printed(PRINTED), way, (side, side), flags=cv2.INTER_AREA, borderValue=TABLE_RGB
        )
        return lens.bent(np.asarray(wide, dtype=np.uint8), pinhole)

    def corners(self, image: Image, where: str = "picture") -> tuple[Array, Array]:
        """World points (n, 3) [m] and pixels (n, 2) of the markers' corners; BadInput names how many markers were seen."""
        check_picture(image, where)
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        board = self.board
        detector: Any = cv2.aruco.ArucoDetector(board.getDictionary(), settings)
        corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
        mine = [] if numbers is None else [n for n, number in enumerate(numbers.ravel()) if number in board.getIds()]
        if len(mine) < LEAST_MARKERS:
            raise BadInput(
                f"{where}: {len(mine)} ArUco markers of the mat seen ({DICTIONARY}, {self.columns} x {self.rows}): "
                f"wanted {LEAST_MARKERS} or more"
            )
        on_board, pixels = board.matchImagePoints([corners[n] for n in mine], numbers[mine])
        return self.world(on_board.reshape(-1, 3).astype(float)), pixels.reshape(-1, 2).astype(float)


@dataclass(frozen=True)
class Calibration:
    """A camera's lens and pose: `turn` (3, 3) and `shift` (3,) [m] map world points to the camera's frame (z ahead).

    residual_px: root mean square reprojection error [pixels]. method: what the result was computed from.
    """

    lens: Lens
    turn: tuple[tuple[float, ...], ...]
    shift: tuple[float, ...]
    residual_px: float
    points: int
    method: str

    @property
    def pixel_from_world(self) -> Array:
        """The projection (3, 4) from homogeneous world points [m] to homogeneous pixels of the undistorted picture."""
        return np.asarray(self.lens.matrix @ np.column_stack([self.turn, self.shift]))

    @property
    def eye_m(self) -> tuple[float, float, float]:
        """The camera's position (x, y, z) [m]."""
        x, y, z = (float(value) for value in -np.array(self.turn).T @ np.array(self.shift))
        return x, y, z

    def to_json(self) -> dict[str, Any]:
        """The record as written to a calibration file."""
        record = asdict(self)
        lens = record.pop("lens")
        lens["distortion"] = dict(zip(TERMS, lens["distortion"], strict=True))
        return {"calibration": 1, "lens": lens, **record, "eye_m": list(self.eye_m)}


def calibrate(pictures: Sequence[tuple[str, Image]], mat: Mat, angle_rad: float | None = None) -> Calibration:
    """The calibration from named pictures of the mat: the lens from all of them, the camera's pose from the first.

    In the first picture the mat lies where `mat` says; the others show it tilted, anywhere. angle_rad: the field of view
    across the picture's height [rad], as the maker states it. It is needed with fewer than 3 pictures: then focal length
    and principal point are not estimated, only k1 and k2. k3 stays 0: up to a field of view of about 1 rad, k2 covers it.
    Raises BadInput for too few pictures, pictures without the mat or of different sizes, and WorkFailed when the focal
    length cannot be determined. Source: Z. Zhang, 2000.
    """
    corners = [mat.corners(image, name) for name, image in pictures]
    sizes = {(image.shape[1], image.shape[0]) for _, image in pictures}
    if len(sizes) > 1:
        raise BadInput(f"pictures of {len(sizes)} sizes: {sorted(sizes)}: wanted one camera's")
    size = sizes.pop()
    flags = cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_USE_INTRINSIC_GUESS
    known = len(pictures) < FEW
    if known and angle_rad is None:
        raise BadInput(
            f"{counted(len(pictures), 'picture')} of the mat: wanted {FEW} or more, tilted in all but the first, "
            "or the task with the camera's field of view (--task)"
        )
    if known:
        flags |= cv2.CALIB_FIX_FOCAL_LENGTH | cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_ZERO_TANGENT_DIST
    start = pinhole(size, radians(45) if angle_rad is None else angle_rad)
    worlds = [world.astype(np.float32)[:, None] for world, _ in corners]
    pixels = [pixel.astype(np.float32)[:, None] for _, pixel in corners]
    result: Any = cv2.calibrateCameraExtended(worlds, pixels, size, start.matrix, np.zeros(5), flags=flags)
    residual, matrix, terms, turns, shifts, unsure = result[:6]
    if not known and not unsure.ravel()[0] < UNSURE * matrix[0, 0]:
        raise WorkFailed(
            f"{len(pictures)} pictures: they do not tell the focal length, "
            f"{matrix[0, 0]:.0f} +- {unsure.ravel()[0]:.0f} pixels: show the mat "
            "tilted in more pictures"
        )
    k1, k2, p1, p2, k3 = (float(term) for term in np.ravel(terms)[:5])
    fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    lens = Lens(size, (fx, fy), (cx, cy), (k1, k2, p1, p2, k3))
    words = f"{counted(len(pictures), 'picture')} of a mat of {mat.columns} x {mat.rows} ArUco markers"
    return _placed(lens, turns[0], shifts[0], float(residual), sum(len(p) for p in pixels), words)


def from_corners(
    lens: Lens, pixels: Sequence[tuple[float, float]], corners_m: Sequence[tuple[float, float]]
) -> Calibration:
    """The calibration of a camera with a known lens, from the pixels of four corners (x, y) [m] of a rectangle on the table.

    Raises BadInput unless there are four corners, no three of them on one line.
    """
    seen = np.asarray(pixels, dtype=np.float64)
    if len(seen) != 4 or len(corners_m) != 4:
        raise BadInput(f"{len(seen)} corners: wanted 4, around the rectangle in its order")
    triangles = [abs(float(np.linalg.det(np.column_stack([np.delete(seen, n, 0), np.ones(3)])))) for n in range(4)]
    if min(triangles) < 100.0:
        raise BadInput(
            f"corners {[tuple(point) for point in pixels]}: three of them lie on a line: wanted a rectangle's"
        )
    world = np.column_stack([np.asarray(corners_m, dtype=np.float64), np.zeros(4)])
    distortion = np.array(lens.distortion)
    solve: Any = cv2.solvePnP
    _, turn, shift = solve(world, seen, lens.matrix, distortion, flags=cv2.SOLVEPNP_IPPE)
    refine: Any = cv2.solvePnPRefineLM
    turn, shift = refine(world, seen, lens.matrix, distortion, turn, shift)
    again, _ = cv2.projectPoints(world, turn, shift, lens.matrix, distortion)
    residual = float(np.sqrt(((again.reshape(-1, 2) - seen) ** 2).sum(axis=1).mean()))
    return _placed(lens, turn, shift, residual, 4, "four corners")


def pinhole(size: tuple[int, int], angle_rad: float) -> Lens:
    """A lens without distortion, for pictures of `size` (width, height) and a field of view across the height [rad]."""
    focal = size[1] / 2 / float(np.tan(angle_rad / 2))
    return Lens(size, (focal, focal), ((size[0] - 1) / 2, (size[1] - 1) / 2))


def _placed(lens: Lens, turn: Array, shift: Array, residual: float, points: int, method: str) -> Calibration:
    rows = np.asarray(cv2.Rodrigues(turn)[0], dtype=float)
    return Calibration(
        lens,
        tuple(tuple(float(number) for number in row) for row in rows),
        tuple(float(value) for value in np.ravel(shift)),
        residual,
        points,
        method,
    )


def drawn(image: Image, calibration: Calibration, mat: Mat | None = None) -> Image:
    """A copy of a picture with the mat's corners according to the calibration (green) and the principal point."""
    canvas = np.array(image)
    lens = calibration.lens
    if mat is not None:
        corners = np.concatenate([np.asarray(corners_m, dtype=np.float64) for corners_m in mat.board.getObjPoints()])
        for x, y in lens.projected(mat.world(corners), calibration.turn, calibration.shift):
            cv2.drawMarker(canvas, (round(x), round(y)), (0, 200, 0), cv2.MARKER_CROSS, 9, 1, cv2.LINE_AA)
    x, y = lens.middle
    cv2.drawMarker(canvas, (round(x), round(y)), (220, 30, 30), cv2.MARKER_TILTED_CROSS, 21, 2, cv2.LINE_AA)
    return np.asarray(canvas, dtype=np.uint8)


# ---- calibration files -----------------------------------------------------------------------------------------------


def write_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration to a JSON file, atomically."""
    write_whole(path, (json.dumps(calibration.to_json(), indent=1) + "\n").encode())


def read_calibration(path: Path) -> Calibration:
    """The calibration in a file. BadInput, naming the file, when it is missing or holds no calibration."""
    try:
        data = read_limited(path, MAX_BYTES)
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
    wanted = "wanted a calibration as `lab see PHOTO --calibrate --out FILE` writes it"
    try:
        record = json_of(data)
        lens, distortion = record["lens"], record["lens"]["distortion"]
        width, height = (int(size) for size in lens["size"])
        fx, fy = (float(focal) for focal in lens["focal"])
        cx, cy = (float(coordinate) for coordinate in lens["middle"])
        terms = tuple(float(distortion[term]) for term in TERMS)
        turn = np.array(record["turn"], dtype=float)
        shift = np.array(record["shift"], dtype=float)
        if turn.shape != (3, 3) or shift.shape != (3,) or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-4):
            raise ValueError("turn is no rotation (3, 3), or shift has not 3 numbers")
        own = Lens((width, height), (fx, fy), (cx, cy), cast(tuple[float, float, float, float, float], terms))
        rows = tuple(tuple(float(number) for number in row) for row in turn)
        quality = float(record["residual_px"]), int(record["points"]), str(record["method"])
    except (ValueError, KeyError, TypeError, BadInput, RecursionError, OverflowError) as error:
        why = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise BadInput(f"{path}: no calibration: {why}: {wanted}") from None
    if not np.isfinite([*shift, quality[0]]).all():
        raise BadInput(f"{path}: no calibration: numbers that are not finite: {wanted}")
    return Calibration(own, rows, tuple(float(value) for value in shift), *quality)
