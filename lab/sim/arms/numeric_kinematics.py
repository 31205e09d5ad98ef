"""Joints for a vertical tool by Newton's method, for any arm whose first joint turns it and whose last turns its tool.

The joints between these two depend on two numbers, how far out and how high the tool is. A table over both is made once, each
entry from its neighbours, so that all of it belongs to one branch of solutions; a pose starts from its table entry. So the joints
are a function of the pose alone, and neighbouring poses have neighbouring joints. A tool may be beside the last joint's axis, as
the middle between one jaw and a fixed one is: the table is then that of the axis, and `aside` says where the tool is.
Source: damped least squares, Y. Nakamura and H. Hanafusa, 1986; a redundant arm stays near one posture, A. Liegeois, 1977.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim.arms.chain import Chain

STEP_M = 0.02  # spacing of the table's entries, of a small arm less: STEPS_OUT entries are within its longest reach
STEPS_OUT = 40
WITHIN_M, WITHIN_RAD = 5e-4, 0.0087  # largest error of a solution: 0.5 mm, 0.5 degrees
_EXACT = 1e-9  # [m], [rad] error at which Newton's method ends
_JUMP = 0.35  # [rad or m] between two table entries: beyond it, the arm has changed its branch of solutions
_DAMPING = 1e-5
_SEEDS, _TRIES = 160, 60
_UPRIGHT = 1e-6
ON_AXIS_M = 1e-4  # distance of a tool from the last joint's axis up to which it counts as on it

Array = NDArray[np.float64]
DOWN = np.array(
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
)  # the tool's axes (columns) at yaw 0: x down, y across


class NumericKinematics:
    """The kinematics of one arm; chain: ends in the finger tips, x out of the gripper, y along which the fingers close."""

    def __init__(self, chain: Chain, name: str) -> None:
        """BadInput unless the first joint turns about the vertical and the last about a line along the tool's own axis."""
        self.chain, self.name = chain, name
        self.count = len(chain.names)
        self.spins = self._spins()  # for the first and the last joint: 1 or -1, the sign of the tool's turn
        self.aside = self._aside()
        end = chain.end.copy()
        end[:3, 3] -= end[:3, 1:3] @ self.aside
        self._axis = replace(chain, end=end)  # it ends on the last joint's axis, beside the tool
        self._rest = (chain.lower + chain.upper) / 2  # a redundant arm stays near the middle of its ranges

    def _spins(self) -> tuple[float, float]:
        chain = self.chain
        if self.count < 4:
            raise BadInput(f"arm '{self.name}': {self.count} joints lead to its tool, wanted 4 or more")
        _, axes, moved = chain.jacobian(np.zeros((1, self.count)))
        first, last = moved[0, 3:, 0], axes[0].T @ moved[0, 3:, -1]  # of the last joint: in the tool's axes
        aside = np.hypot(*moved[0, :2, 0] - np.cross(first, chain.ends(np.zeros((1, self.count)))[0][0])[:2])
        if abs(abs(first[2]) - 1.0) > _UPRIGHT or aside > 1e-4:
            raise BadInput(f"arm '{self.name}': its first joint '{chain.names[0]}' does not turn it about the vertical")
        if abs(abs(last[0]) - 1.0) > 1e-4 or chain.slides[-1]:
            raise BadInput(
                f"arm '{self.name}': its last joint '{chain.names[-1]}' does not turn the tool about the tool's own axis"
            )
        return float(np.sign(first[2])), -float(np.sign(last[0]))  # x points down: a turn about it decreases the yaw

    def _aside(self) -> Array:
        """Where the tool is beside the last joint's axis (2,) [m], along the tool's y and z axes; 0 if it is on it."""
        at, axes, origins, _ = self.chain.along(np.zeros((1, self.count)))
        off = (axes[0].T @ (at[0] - origins[0, -1]))[1:]
        return off if np.linalg.norm(off) > ON_AXIS_M else np.zeros(2)

    @property
    def home(self) -> Array:
        """The joint positions (k,) from which the table was built, with the tool down and half-way out."""
        return self._begun[1]

    # ---- Inverse and forward kinematics -------------------------------------------------------------------------

    def bent(self, out: Array, up: Array) -> Array:
        """The joints (n, k) for a last axis `out` (n,) [m] off the first, tips `up` (n,) [m], at yaw 0; NaN: unsolvable."""
        table, low = self._table
        place = np.stack([out, up], axis=1) / self._step - low
        inside = np.all((place >= 0.0) & (place <= np.array(table.shape[:2]) - 1.0), axis=1)
        corner = np.clip(np.nan_to_num(place).astype(int), 0, np.array(table.shape[:2]) - 2)
        share = np.clip(np.nan_to_num(place) - corner, 0.0, 1.0)
        seeds, weights = np.zeros((len(out), self.count)), np.zeros(len(out))
        for i in (0, 1):
            for j in (0, 1):
                corner_joints = table[corner[:, 0] + i, corner[:, 1] + j]
                weight = np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1]) + 1e-9
                weight = np.where(np.isnan(corner_joints[:, 0]), 0.0, weight)
                seeds += weight[:, None] * np.nan_to_num(corner_joints)
                weights += weight
        known = inside & (weights > 0.0)
        joints = np.full((len(out), self.count), np.nan)
        if known.any():
            seeds = seeds[known] / weights[known, None]
            solved, _ = self._solved(seeds, out[known], up[known], 12)
            good = self._near(solved, seeds) & self._holds(solved, out[known], up[known])
            joints[known] = np.where(good[:, None], solved, np.nan)
        return joints

    def tools(self, joints: Array) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (n, 4) that joints (n, k) hold, in the foot's frame."""
        at, axes = self.chain.ends(joints)
        return np.column_stack([at, np.arctan2(-axes[:, 0, 1], axes[:, 1, 1])])

    def misses(self, joints: Array, tools: Array) -> tuple[Array, Array]:
        """The errors (n,) [m] and (n,) [rad], in tilt or in yaw, by which joints miss poses (n, 4) of the last axis."""
        at, axes = self._axis.ends(joints)
        c, s = np.cos(tools[:, 3]), np.sin(tools[:, 3])
        wanted = np.zeros_like(axes)
        wanted[:, 2, 0] = -1.0
        wanted[:, 0, 1], wanted[:, 1, 1], wanted[:, 0, 2], wanted[:, 1, 2] = -s, c, c, s
        cosine = (np.einsum("nij,nij->n", axes, wanted) - 1.0) / 2.0
        return np.linalg.norm(at - tools[:, :3], axis=1), np.arccos(np.clip(cosine, -1.0, 1.0))

    # ---- The table of solutions ---------------------------------------------------------------------------------

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        """Joint positions (i, j, k) by distance and height, NaN without a solution; and the indices (2,) of the first entry."""
        reach, foot = self._stretch
        low = np.array([1.0, np.floor((foot - reach) / self._step)])
        shape = (int(reach / self._step) + 1, int(2 * reach / self._step) + 2)
        table = np.full((*shape, self.count), np.nan)
        start, joints = self._begun
        table[tuple(start - low.astype(int))] = joints
        fresh = [tuple(start - low.astype(int))]
        while fresh:
            seeds: dict[tuple[int, int], list[Array]] = {}
            for i, j in fresh:
                for place in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                    if 0 <= place[0] < shape[0] and 0 <= place[1] < shape[1] and np.isnan(table[place][0]):
                        seeds.setdefault(place, []).append(table[i, j])
            places = list(seeds)
            if not places:
                break
            begun = np.array([np.mean(seeds[place], axis=0) for place in places])
            out, up = ((np.array(places) + low) * self._step).T
            solved, _ = self._solved(begun, out, up, 20)
            fresh = [place for place, near in zip(places, self._near(solved, begun), strict=True) if near]
            for place, joints in zip(places, solved, strict=True):
                if place in set(fresh):
                    table[place] = joints
        return table, low

    @property
    def _stretch(self) -> tuple[float, float]:
        """The arm's longest reach, and the height of its first joint [m]."""
        links = np.linalg.norm([*self.chain.roots[1:], self.chain.end[:3, 3]], axis=1).sum()
        slides = np.abs([self.chain.lower, self.chain.upper])[:, self.chain.slides].sum()
        return float(links + slides), float(self.chain.roots[0, 2])

    @cached_property
    def _step(self) -> float:
        """The spacing of the table's entries [m]."""
        return min(STEP_M, self._stretch[0] / STEPS_OUT)

    @cached_property
    def _begun(self) -> tuple[NDArray[np.int_], Array]:
        """The indices of the table's first entry and its joint positions: of all solutions, the one whose joints are highest."""
        reach, foot = self._stretch
        rng = np.random.default_rng(0)
        seeds = rng.uniform(self.chain.lower, self.chain.upper, (_SEEDS, self.count))
        for share in (0.5, 0.4, 0.6, 0.3, 0.7):
            for high in (0.0, 0.2, -0.2, 0.4, -0.4):
                place = np.array([round(share * reach / self._step), round((foot + high * reach) / self._step)])
                out, up = (np.full(_SEEDS, number * self._step) for number in place)
                solved, good = self._solved(seeds, out, up, _TRIES)
                middles = self.chain.middles(solved)
                good &= self._within(solved) & self._holds(solved, out, up) & (middles[:, 0] > 0.0)
                if good.any():
                    solved, heights = solved[good], middles[good, 2]
                    solved[:, [0, -1]] = (solved[:, [0, -1]] + np.pi) % (2 * np.pi) - np.pi
                    away = np.linalg.norm(solved[:, 1:-1] - self._rest[1:-1], axis=1)
                    best = np.lexsort((np.round(away, 6), -np.round(heights, 3)))[0]
                    return place, solved[best]
        raise BadInput(f"arm '{self.name}': no joints were found that hold its tool upright in front of it")

    def _holds(self, joints: Array, out: Array, up: Array) -> NDArray[np.bool_]:
        """Whether joint positions hold a vertical tool at `out`, 0, `up`, yaw 0, within the allowed error."""
        far, angle = self.misses(joints, np.stack([out, 0 * out, up, 0 * out], axis=1))
        held: NDArray[np.bool_] = (far <= WITHIN_M) & (angle <= WITHIN_RAD)
        return held

    def _near(self, solved: Array, seeds: Array) -> NDArray[np.bool_]:
        near: NDArray[np.bool_] = np.abs(solved - seeds)[:, 1:-1].max(axis=1) < _JUMP
        return near & self._within(solved)

    def _within(self, joints: Array) -> NDArray[np.bool_]:
        """Whether the joints between first and last are finite and within their limits."""
        chain = self.chain
        inside = (joints >= chain.lower - 1e-12) & (joints <= chain.upper + 1e-12)
        return np.asarray(inside[:, 1:-1].all(axis=1))

    def _solved(self, joints: Array, out: Array, up: Array, tries: int) -> tuple[Array, NDArray[np.bool_]]:
        """Newton's solutions from `joints` (n, k) for tools at `out`, 0, `up`, yaw 0, NaN where it fails; which converged."""
        joints = joints.copy()
        going = np.arange(len(joints))
        for _ in range(tries):
            at, axes, moved = self._axis.jacobian(joints[going])
            missed = np.concatenate(
                [np.stack([out[going], 0 * going, up[going]], axis=1) - at, turn_to(axes, DOWN[None])], axis=1
            )
            aside = np.zeros((len(going), self.count))
            if self.count > 6:
                aside[:, 1:-1] = (self._rest - joints[going])[:, 1:-1]
            wanted = missed - np.einsum("nij,nj->ni", moved, aside)
            step = damped(moved, wanted) + aside
            step *= np.minimum(1.0, 0.4 / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
            joints[going] += step
            left = (np.abs(missed).max(axis=1) > _EXACT) | (np.abs(step).max(axis=1) > 1e-7)
            going = going[left]
            if not going.size:
                break
        held = np.ones(len(joints), bool)
        held[going] = False
        joints[~held] = np.nan
        return joints, held


def damped(moved: Array, wanted: Array) -> Array:
    """The damped least-squares steps (n, k) that move the end by `wanted` (n, 6); `moved` (n, 6, k): the Jacobian."""
    back = moved.transpose(0, 2, 1)
    if moved.shape[2] < 6:
        square = back @ moved + _DAMPING**2 * np.eye(moved.shape[2])
        return np.asarray(np.linalg.solve(square, back @ wanted[:, :, None])[:, :, 0])
    square = moved @ back + _DAMPING**2 * np.eye(6)
    return np.asarray((back @ np.linalg.solve(square, wanted[:, :, None]))[:, :, 0])


def turn_to(axes: Array, wanted: Array) -> Array:
    """The small rotation (n, 3) [rad] that takes the tool's axes (n, 3, 3) to `wanted` ones (n, 3, 3)."""
    return np.asarray(0.5 * np.cross(axes, wanted, axisa=1, axisb=1, axisc=2).sum(axis=1))
