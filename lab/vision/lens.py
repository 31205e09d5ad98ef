"""A camera's lens: focal length, middle and distortion; pictures and points made straight, and a straight picture bent."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput
from lab.vision.opencv import cv2
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

TERMS = ("k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True)
class Lens:
    """Focal lengths and principal point [pixels] of pictures of (width, height), and Brown's distortion k1 k2 p1 p2 k3.

    Pixels are (x, y) from the centre of the top left pixel. Terms as in OpenCV's calibration; all 0: a pinhole.
    Raises BadInput for what is no lens.
    """

    size: tuple[int, int]
    focal: tuple[float, float]
    middle: tuple[float, float]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        values = [*self.focal, *self.middle, *self.distortion]
        if len(self.distortion) != len(TERMS) or not np.isfinite(values).all() or min(*self.size, *self.focal) <= 0:
            raise BadInput(
                f"lens: size {self.size}, focal {self.focal}, middle {self.middle}, distortion {self.distortion}: "
                f"wanted finite numbers, size and focal lengths above 0, and {len(TERMS)} terms of distortion"
            )

    @property
    def matrix(self) -> Array:
        """The camera matrix (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.middle
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def scaled(self, size: tuple[int, int]) -> "Lens":
        """The same lens for pictures of another (width, height) [pixels]."""
        x, y = (new / old for new, old in zip(size, self.size, strict=True))
        middle = ((self.middle[0] + 0.5) * x - 0.5, (self.middle[1] + 0.5) * y - 0.5)
        return Lens(size, (self.focal[0] * x, self.focal[1] * y), middle, self.distortion)

    def projected(self, points: ArrayLike, turn: ArrayLike, shift: ArrayLike) -> Array:
        """The pixels (n, 2) of world points (n, 3) [m]; `turn` (3, 3) and `shift` (3,) take them to the camera's axes."""
        rotation = cv2.Rodrigues(np.asarray(turn, dtype=np.float64))[0]
        world, to = np.asarray(points, dtype=np.float64), np.asarray(shift, dtype=np.float64)
        seen, _ = cv2.projectPoints(world, rotation, to, self.matrix, np.array(self.distortion))
        return np.asarray(seen, dtype=np.float64).reshape(-1, 2)

    def straight_points(self, pixels: ArrayLike) -> Array:
        """Where pixels (n, 2) of a picture are in the straightened one."""
        return self._onto(np.asarray(pixels, dtype=np.float64), self.matrix)

    def straightened(self, image: Image) -> Image:
        """The picture (H, W, 3) as a pinhole with the same matrix would have taken it."""
        self._check(image)
        if not any(self.distortion):
            return image
        return np.asarray(cv2.undistort(image, self.matrix, np.array(self.distortion)), dtype=np.uint8)

    def bent(self, wide: Image, pinhole: Array) -> Image:
        """What this lens shows of a scene of which a pinhole with the matrix `pinhole` (3, 3) took the picture `wide`.

        `wide` (H, W, 3) should reach farther on all sides than this lens sees; beyond it the edge's pixels are taken again.
        """
        check_picture(wide)
        width, height = self.size
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
        there = self._onto(pixels.astype(np.float64), pinhole).reshape(height, width, 2).astype(np.float32)
        bent: Any = cv2.remap(wide, there[..., 0], there[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(bent, dtype=np.uint8)

    def _onto(self, pixels: Array, matrix: Array) -> Array:
        there = cv2.undistortPoints(pixels[:, None], self.matrix, np.array(self.distortion), None, None, matrix)
        return np.asarray(there, dtype=np.float64).reshape(-1, 2)

    def _check(self, image: Image) -> None:
        check_picture(image)
        height, width = image.shape[:2]
        if (width, height) != self.size:
            raise BadInput(
                f"picture: {width} x {height} pixels: the camera was calibrated with {self.size[0]} x {self.size[1]}"
            )
