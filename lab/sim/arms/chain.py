"""A chain of joints from a URDF: the poses of its end, and Jacobians, for many joint positions at once.

Source: product of exponentials in body order, as in K. M. Lynch and F. C. Park, Modern Robotics, 2017, ch. 4 and 5.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.foreign_urdf import MOVING, Urdf
from lab.sim.urdf_reader import floats, placed

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chain:
    """k joints from a foot to an end; fixed joints between them are folded in.

    roots (k, 3) [m]: where each joint's frame is in that of the joint before; turns (k, 3, 3, 3): its axes there are
    turns[0] + sin(q) turns[1] + cos(q) turns[2]; axes (k, 3): along or about which it moves, in its own frame; slides (k,)
    bool; end (4, 4): the end's frame in the last joint's; lower, upper (k,) [rad or m], speed (k,) [rad/s or m/s].
    """

    names: tuple[str, ...]
    roots: Array
    turns: Array
    axes: Array
    slides: NDArray[np.bool_]
    end: Array
    lower: Array
    upper: Array
    speed: Array

    @classmethod
    def of(cls, urdf: Urdf, link: str, end: Array | None = None) -> Self:
        """The chain from a URDF's foot to `link`; `end` (4, 4): a frame in that link, by default its own."""
        names, roots, turns, axes, slides, limits = [], [], [], [], [], []
        before = np.eye(4)
        for joint in urdf.down_to(link):
            before = before @ placed(joint.find("origin"))
            if joint.get("type") not in MOVING:
                continue
            axis = np.array(floats(joint.find("axis"), "xyz", "1 0 0"))
            axis = axis / np.linalg.norm(axis)
            slide = joint.get("type") == "prismatic"
            cross = np.cross(np.eye(3), axis)  # (3, 3): cross @ v = axis x v
            square = np.zeros((3, 3)) if slide else cross @ cross
            names.append(joint.get("name", ""))
            roots.append(before[:3, 3])
            turns.append(before[:3, :3] @ np.array([np.eye(3) + square, np.zeros((3, 3)) if slide else cross, -square]))
            axes.append(axis)
            slides.append(slide)
            limit = joint.find("limit")
            limits.append([floats(limit, name, "nan")[0] for name in ("lower", "upper", "velocity")])
            before = np.eye(4)
        lower, upper, speed = np.array(limits).reshape(-1, 3).T
        last = before if end is None else before @ end
        return cls(
            tuple(names), np.array(roots), np.array(turns), np.array(axes), np.array(slides), last, lower, upper, speed
        )

    def ends(self, joints: Array) -> tuple[Array, Array]:
        """The end's position (n, 3) [m] and axes (n, 3, 3) in the foot's frame, for joint positions (n, k)."""
        at, axes, _, _ = self.along(joints)
        return at, axes

    def jacobian(self, joints: Array) -> tuple[Array, Array, Array]:
        """The results of `ends`, and the Jacobian (n, 6, k) of the end, translation then rotation, in the foot's axes."""
        at, axes, origins, directions = self.along(joints)
        moved = np.cross(directions, at[:, None] - origins)
        moved[:, self.slides] = directions[:, self.slides]
        turned = np.where(self.slides[:, None], 0.0, directions)
        return at, axes, np.concatenate([moved, turned], axis=2).transpose(0, 2, 1)

    def middles(self, joints: Array) -> Array:
        """The mean position (n, 3) of the joints [m]."""
        _, _, origins, _ = self.along(joints)
        return np.asarray(origins.mean(axis=1))

    def along(self, joints: Array) -> tuple[Array, Array, Array, Array]:
        """The results of `ends`, and each joint's position and axis (n, k, 3), in the foot's frame."""
        n, k = joints.shape
        sines, cosines = np.sin(joints), np.cos(joints)
        at, axes = np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3))
        origins, directions = np.empty((n, k, 3)), np.empty((n, k, 3))
        for i in range(k):
            fixed, by_sine, by_cosine = self.turns[i]
            at = at + axes @ self.roots[i]
            axes = axes @ (fixed + sines[:, i, None, None] * by_sine + cosines[:, i, None, None] * by_cosine)
            directions[:, i] = axes @ self.axes[i]
            if self.slides[i]:
                at = at + joints[:, i, None] * directions[:, i]
            origins[:, i] = at
        return at + axes @ self.end[:3, 3], axes @ self.end[:3, :3], origins, directions
