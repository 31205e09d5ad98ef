"""Grippers of one jaw, which a single joint moves towards a jaw that is part of the hand: their measurement from a URDF.

The jaw closes along any direction across the tool. Its pads need not be parallel: what counts is the clear distance between them.
"""

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim.arms.chain import Chain
from lab.sim.arms.convex_pieces import Pieces, pieces_of
from lab.sim.arms.fingers import Fingers, Gripper
from lab.sim.arms.foreign_urdf import Urdf, child, parent

STROKES = 129  # positions of the jaw that are measured over its range
PAD_M = 0.02  # length of the pads, from the tips up
SHORT_M = 0.012  # by which the jaw's tip may be behind the hand's as it swings open
ASIDE_M = 0.002  # [m] by which something may reach into the clear space between the jaws at each side

Array = NDArray[np.float64]


class _Hand:
    """The convex pieces of a hand and of its jaw, seen from the finger tips' frame `tip` (4, 4) in the link `tool`."""

    def __init__(
        self, urdf: Urdf, joint: str, tool: str, tip: Array, pieces: tuple[dict[str, Pieces], dict[str, Pieces]]
    ) -> None:
        self.urdf, self.joint, self.tool = urdf, joint, tool
        self.hand, self.jaw = pieces
        self._chains = {link: Chain.of(urdf, link) for link in (*self.hand, *self.jaw)}
        self._end = Chain.of(urdf, tool)
        self.tip = tip

    def points(self, pieces: dict[str, Pieces], position: float) -> list[Array]:
        """The corners (n, 3) [m] of each piece in the finger tips' frame, with the jaw's joint at `position`."""
        at, turn = self._end.ends(np.zeros((1, len(self._end.names))))
        foot, axes = at[0] + turn[0] @ self.tip[:3, 3], turn[0] @ self.tip[:3, :3]
        placed = []
        for link, convex in pieces.items():
            chain = self._chains[link]
            here, turned = chain.ends(np.array([[position if name == self.joint else 0.0 for name in chain.names]]))
            placed += [(points @ turned[0].T + here[0] - foot) @ axes for points, _ in convex]
        return placed


def jaw_of(urdf: Urdf, joint: str, tool: str, tip: Array, opening_m: float | None = None) -> tuple[Fingers, Array]:
    """The fingers of a hand whose only moving jaw hangs on `joint`, and the frame (4, 4) of the open jaws' middle in `tool`.

    `tip` (4, 4): the finger tips' frame in `tool`, x out of the gripper; its other axes may point anywhere across. opening_m:
    between the open jaws; None: as wide as they open. The collision meshes of both are cut into convex pieces, which leave the
    space between the jaws free. BadInput if the joint does not move a jaw across the tool towards the hand.
    """
    moved = urdf.below(child(urdf.joint(joint, "robot.fingers")))
    body = _fixed_to(urdf, _hand_of(urdf, tool))
    where = f"{urdf.path}: the finger joint {joint}"
    if parent(urdf.joints[joint]) not in body:
        raise BadInput(f"{where} opens and closes no jaw: it does not hang on the hand of '{tool}'")
    out = Chain.of(urdf, tool, tip).ends(np.zeros((1, len(Chain.of(urdf, tool).names))))[1][0][:, 0]
    hand = _Hand(urdf, joint, tool, tip, (pieces_of(urdf, body, out), pieces_of(urdf, moved, out)))
    hand.tip = tip @ _turned(_heading(hand, where))
    positions, gaps = _opening(hand)
    if len(gaps) < 2:
        raise BadInput(f"{where} opens and closes no jaw: it does not move across '{tool}', towards the hand")
    widest = float(gaps[-1])
    if opening_m is not None and not 0 < opening_m <= widest + 1e-9:
        raise BadInput(f"robot.opening_m {opening_m}: the gripper opens {widest:.3f} m at the most")
    opening = opening_m or widest
    middle = np.eye(4)
    middle[1, 3] = _inner(hand.points(hand.hand, 0.0)) + opening / 2
    opened = float(np.interp(opening, gaps, positions))
    links = (tuple(hand.jaw), tuple(hand.hand))
    hand.tip = hand.tip @ middle
    return Fingers(
        (joint,), (joint,), {}, links, gaps / 2, positions[:, None], _gripper(hand, opening, opened)
    ), hand.tip


def _hand_of(urdf: Urdf, link: str) -> str:
    """The link nearest to the foot that `link` is fixed to."""
    while link != urdf.foot and urdf.carrying[link].get("type") == "fixed":
        link = parent(urdf.carrying[link])
    return link


def _fixed_to(urdf: Urdf, link: str) -> list[str]:
    """A link and all that fixed joints fasten to it."""
    fixed = [link]
    for name, joint in urdf.carrying.items():
        if joint.get("type") == "fixed" and parent(joint) == link:
            fixed += _fixed_to(urdf, name)
    return fixed


def _turned(quarters: int) -> Array:
    """A frame (4, 4) turned about x by quarter turns, exactly."""
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters % 4]
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]], float)


def _heading(hand: _Hand, where: str) -> int:
    """The quarter turns that take the tool's y axis to where the jaw is, as seen from the hand's own jaw at the tips."""
    low, high = _limits(hand)
    middles = []
    for pieces in (hand.jaw, hand.hand):
        tips = [
            points
            for position in np.linspace(low, high, 9)
            for points in _near_tips(hand.points(pieces, float(position)))
        ]
        if not tips:
            which = "no jaw" if pieces is hand.jaw else "no part of the hand"
            raise BadInput(
                f"{where} opens and closes no jaw: {which} comes within {PAD_M} m of the finger tips (robot.tip_m)"
            )
        middles.append(np.concatenate(tips).mean(axis=0))
    across, up = (middles[0] - middles[1])[1:]
    return int(np.round(np.arctan2(up, across) / (np.pi / 2)))


def _limits(hand: _Hand) -> tuple[float, float]:
    limit = hand.urdf.joints[hand.joint].find("limit")
    assert limit is not None
    return float(limit.get("lower", "0")), float(limit.get("upper", "0"))


def _near_tips(pieces: list[Array]) -> list[Array]:
    """The points of pieces that are within PAD_M of the finger tips."""
    return [points[points[:, 0] > -PAD_M] for points in pieces if (points[:, 0] > -PAD_M).any()]


def _inner(pieces: list[Array]) -> float:
    """The y [m] of the hand's jaw that is nearest to the moving one, at its pad; NaN without one."""
    return float(max((points[:, 1].max() for points in _near_tips(pieces)), default=np.nan))


def _opening(hand: _Hand) -> tuple[Array, Array]:
    """The positions (m,) of the jaw's joint from closed to open, and the increasing gaps (m,) [m] there, from 0 on."""
    low, high = _limits(hand)
    positions = np.linspace(low, high, STROKES)
    inner = _inner(hand.points(hand.hand, 0.0))
    gaps = np.full(STROKES, np.nan)
    for k, position in enumerate(positions):
        pads = _near_tips(hand.points(hand.jaw, float(position)))
        if pads and max(points[:, 0].max() for points in pads) > -SHORT_M:
            gaps[k] = min(points[:, 1].min() for points in pads) - inner
    if np.nan_to_num(gaps[: STROKES // 2], nan=np.inf).min() > np.nan_to_num(gaps[STROKES // 2 :], nan=np.inf).min():
        positions, gaps = positions[::-1], gaps[::-1]
    begin = int(np.nanargmin(np.abs(gaps))) if np.isfinite(gaps).any() else 0
    end = begin + 1
    while end < STROKES and gaps[end] > gaps[end - 1]:
        end += 1
    positions, gaps = positions[begin:end].copy(), gaps[begin:end].copy()
    if len(gaps) > 1 and gaps[0] != 0.0:  # the position at which the jaws just touch, or the nearest one
        touching = positions[0] - gaps[0] * (positions[1] - positions[0]) / (gaps[1] - gaps[0])
        positions[0], gaps[0] = np.clip(touching, low, high), max(gaps[0], 0.0) if not low <= touching <= high else 0.0
    return positions, gaps


def _gripper(hand: _Hand, opening: float, opened: float) -> Gripper:
    """The dimensions of the gripper with its jaw open, at the joint position `opened`; its tips are symmetric about y = 0."""
    solid = hand.points(hand.hand, 0.0) + hand.points(hand.jaw, opened)
    pads = np.concatenate(_near_tips(solid))
    width = 2 * float(np.abs(pads[:, 2]).max())
    clear = np.array([opening / 2 - ASIDE_M, width / 2])
    lows, highs = ([points[:, 1:].min(axis=0) for points in solid], [points[:, 1:].max(axis=0) for points in solid])
    between = np.all((np.array(lows) < clear) & (np.array(highs) > -clear), axis=1)
    tops = [float(points[:, 0].max()) for points, inside in zip(solid, between, strict=True) if inside]
    depth = -max(tops, default=min(float(points[:, 0].min()) for points in hand.points(hand.jaw, opened)))
    all_points = np.concatenate(solid)
    behind = np.abs(all_points[all_points[:, 0] <= -depth + 1e-9]).max(axis=0, initial=0.0)
    thick = float(max(np.abs(pads[:, 1]).max() - opening / 2, 0.0))
    return Gripper(opening, depth, width, thick, hand_m=(float(behind[2]), float(behind[1])), one_jaw=True)
