"""Grippers of two fingers, measured from a URDF: their dimensions, and the opening for each stroke of their joints."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim import mesh_file
from lab.sim.arms.chain import Chain
from lab.sim.arms.foreign_urdf import Urdf, child
from lab.sim.urdf_reader import floats, placed

PAD_M = 0.011  # effective radius at which the friction of a finger's pad, of 3 x 3 cm, resists turning


@dataclass(frozen=True)
class Gripper:
    """Two fingers, which close along the tool's y axis [m].

    opening_m: the distance between the open pads. depth_m: from the finger tips up to the palm. width_m, thick_m: a
    finger's size across the closing direction and along it. level: the tool is held level, not hanging. hand_m: how far the
    hand above the palm reaches from the tool's axis, across the closing direction and along it. one_jaw: only one of the
    fingers moves, and pushes the part against the other; with a jaw that swings, they are parallel at one opening alone.
    """

    opening_m: float
    depth_m: float
    width_m: float
    thick_m: float
    level: bool = False
    hand_m: tuple[float, float] = (0.0, 0.0)
    one_jaw: bool = False


# ---- The joints of the fingers, and their measurement -----------------------------------------------------------------


_STROKES = 65  # number of strokes that are measured between closed and open
_MIMIC = {"multiplier": "1", "offset": "0"}
_TIP_M = 0.02  # length of a finger, from the tip up, that counts as its pad

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fingers:
    """Fingers whose joints move together: (k,) joints, and the links that grip, by side; left is along y.

    openings (m,) [m]: increasing distances of each pad from the middle; strokes (m, k) [rad or m]: the joint positions there.
    driven: the joints with a motor; the others are geared to the first joint of their side, listed in leaders.
    """

    joints: tuple[str, ...]
    driven: tuple[str, ...]
    leaders: dict[str, str]
    links: tuple[tuple[str, ...], tuple[str, ...]]
    openings: Array
    strokes: Array
    gripper: Gripper

    @property
    def open_m(self) -> float:
        """The distance of each pad from the middle when the fingers are open [m]."""
        return self.gripper.opening_m / 2

    def ratio(self, joint: str) -> float:
        """The gear ratio of a joint to its leader."""
        own, leader = (np.diff(self.strokes[[0, -1], self.joints.index(n)])[0] for n in (joint, self.leaders[joint]))
        return float(own / leader)

    def at(self, opening: float) -> Array:
        """The joint positions (k,) at which each pad is `opening` [m] from the middle, within their range."""
        return np.array([np.interp(opening, self.openings, self.strokes[:, k]) for k in range(len(self.joints))])

    def opening(self, joints: Array) -> float:
        """The distance of each pad from the middle [m] at joint positions (k,), computed from the first joint."""
        order = np.argsort(self.strokes[:, 0])
        return float(np.interp(joints[0], self.strokes[order, 0], self.openings[order]))

    def forces(self, force: float, opening: float) -> list[float]:
        """The forces or torques of the driven joints [N or Nm] with which each finger presses with `force` [N]."""
        near = np.clip([opening - 0.002, opening + 0.002], self.openings[0], self.openings[-1])
        way = 2.0 * float(near[1] - near[0]) / len(self.driven)  # one jaw alone moves by both fingers' way
        moved = np.abs(self.at(float(near[1])) - self.at(float(near[0])))
        chosen = [self.joints.index(joint) for joint in self.driven]
        return [force * way / max(float(moved[k]), 1e-9) for k in chosen]


def fingers_of(urdf: Urdf, named: tuple[str, ...], tool: str, tip: Array, opening_m: float | None = None) -> Fingers:
    """The fingers that the joints `named` move; `tip` (4, 4): the finger tips' frame in the link `tool`.

    opening_m: between the open pads; None: as wide as they open. BadInput if these joints do not open and close two fingers.
    """
    leads = _leads(urdf, named)
    ends = _Ends(urdf, tuple(leads), tool, tip)
    gaps = np.array([ends.gap(share) for share in np.linspace(0.0, 1.0, _STROKES)])
    strokes = np.array([ends.positions(share) for share in np.linspace(0.0, 1.0, _STROKES)])
    where = f"{urdf.path}: the finger joints {', '.join(named)}"
    steps = np.diff(gaps)
    if not np.isfinite(gaps).all() or not (steps > 0).all():
        raise BadInput(f"{where} do not open and close two fingers along y of '{tool}', on both sides of its middle")
    widest = 2 * float(gaps[-1])
    if opening_m is not None and not 0 < opening_m <= widest + 1e-9:
        raise BadInput(f"robot.opening_m {opening_m}: the gripper opens {widest:.3f} m at the most")
    return ends.fingers(leads, gaps, strokes, opening_m or widest)


def is_jaw(urdf: Urdf, named: tuple[str, ...]) -> bool:
    """Whether the joints `named` are a single one that no other joint mimics: one jaw, against the hand."""
    return len(_leads(urdf, named)) == 1


def _leads(urdf: Urdf, named: tuple[str, ...]) -> dict[str, str]:
    """The finger joints, those that mimic one of `named` included, with the joint that each follows; BadInput if unknown."""
    leads = {name: name for name in named}
    for name in named:
        urdf.joint(name, "robot.fingers")
    for name, joint in urdf.joints.items():
        mimic = joint.find("mimic")
        if mimic is not None and mimic.get("joint") in named and name not in leads:
            leads[name] = mimic.get("joint", "")
    return leads


class _Ends:
    """The vertices of the links that the finger joints carry, in the finger tips' frame."""

    def __init__(self, urdf: Urdf, names: tuple[str, ...], tool: str, tip: Array) -> None:
        self.urdf, self.names, self.tip = urdf, names, tip
        moved = {link for name in names for link in urdf.below(child(urdf.joints[name]))}
        self.palm = [link for link in urdf.below(tool) if link not in moved]
        self.chains = {link: Chain.of(urdf, link) for link in sorted(moved)}
        self.tool = Chain.of(urdf, tool, tip)
        solids = {link: solid_vertices(urdf.links[link]) for link in (*self.chains, *self.palm)}
        self.solids = {link: points for link, points in solids.items() if len(points)}
        self.ranges = self._ranges()
        self.sides: tuple[list[str], list[str]] = ([], [])
        for link in self.chains:
            points = self.points(link, 0.0)
            if len(points) and points[:, 0].max() > -_TIP_M:
                self.sides[0 if points[:, 1].mean() > 0 else 1].append(link)

    def _ranges(self) -> Array:
        """The positions of each joint with closed and with open fingers (k, 2); a mimic joint follows its leader."""
        self.ranges = np.array(
            [
                [floats(self.urdf.joints[name].find("limit"), end, "0")[0] for end in ("lower", "upper")]
                for name in self.names
            ]
        )
        ranges = self.ranges.copy()
        for k, name in enumerate(self.names):
            carried = self.urdf.below(child(self.urdf.joints[name]))
            low, high = (
                max(np.abs(self.points(link, share)[:, 1]).max(initial=0.0) for link in carried) for share in (0.0, 1.0)
            )
            if low > high:
                ranges[k] = ranges[k, ::-1]
        for k, name in enumerate(self.names):
            mimic = self.urdf.joints[name].find("mimic")
            if mimic is not None and mimic.get("joint") in self.names:
                ranges[k] = _multiplier(self.urdf, name) * ranges[self.names.index(mimic.get("joint", ""))]
        return ranges

    def positions(self, share: float) -> Array:
        """The joint positions (k,) at a share of their ranges from closed to open."""
        return np.asarray(self.ranges[:, 0] + share * (self.ranges[:, 1] - self.ranges[:, 0]))

    def points(self, link: str, share: float) -> Array:
        """A link's vertices (n, 3) [m]: x out of the gripper, 0 at the tips, y across."""
        if link not in self.solids:
            return np.zeros((0, 3))
        foot, axes = self.tool.ends(np.zeros((1, len(self.tool.names))))
        here, turned = self._ends(link, share)
        return np.asarray((self.solids[link] @ turned.T + here - foot[0]) @ axes[0])

    def _ends(self, link: str, share: float) -> tuple[Array, Array]:
        """The position (3,) [m] and axes (3, 3) of a link's frame in the foot's frame."""
        at = dict(zip(self.names, self.positions(share), strict=True))
        chain = self.chains.get(link) or Chain.of(self.urdf, link)
        here, turned = chain.ends(np.array([[at.get(name, 0.0) for name in chain.names]]))
        return here[0], turned[0]

    def gap(self, share: float) -> float:
        """The distance of the nearer pad from the middle [m]; NaN unless there are two sides."""
        left, right = ([self.points(link, share)[:, 1] for link in side] for side in self.sides)
        if not left or not right:
            return float("nan")
        return float(min(np.concatenate(left).min(), -np.concatenate(right).max()))

    def fingers(self, leads: dict[str, str], gaps: Array, strokes: Array, opening_m: float) -> Fingers:
        """The measured fingers and gripper; the first joint of each side is driven, the others are geared to it."""
        sides = {name: self._side(name) for name in leads}
        if len(set(sides.values())) < 2:
            raise BadInput(f"{self.urdf.path}: the finger joints {', '.join(leads)} are all on one side of the tool")
        first = {side: next(name for name in leads if sides[name] == side) for side in (True, False)}
        leaders = {name: first[sides[name]] for name in leads if name != first[sides[name]]}
        leaders[first[False]] = first[True]
        links = (tuple(self.sides[0]), tuple(self.sides[1]))
        return Fingers(tuple(leads), tuple(first.values()), leaders, links, gaps, strokes, self._gripper(opening_m))

    def _gripper(self, opening_m: float) -> Gripper:
        finger = np.concatenate([self.points(link, 0.0) for link in self.sides[0]])
        palm = [float(points[:, 0].max()) for points in (self.points(link, 0.0) for link in self.palm) if len(points)]
        tip = finger[finger[:, 0] > finger[:, 0].max() - _TIP_M]
        depth = -max(palm) if palm else float(np.ptp(finger[:, 0]))
        solid = np.concatenate([self.points(link, 1.0) for link in self.solids])
        hand = np.abs(solid[solid[:, 0] <= -depth + 1e-9]).max(axis=0, initial=0.0)
        return Gripper(
            opening_m,
            depth,
            float(np.ptp(tip[:, 2])),
            float(np.ptp(tip[:, 1])),
            hand_m=(float(hand[2]), float(hand[1])),
        )

    def _side(self, name: str) -> bool:
        """Whether a joint is left of the middle when all fingers are half open."""
        foot, axes = self.tool.ends(np.zeros((1, len(self.tool.names))))
        here, _ = self._ends(child(self.urdf.joints[name]), 0.5)
        return bool(((here - foot[0]) @ axes[0])[1] > 0)


def _multiplier(urdf: Urdf, name: str) -> float:
    """The multiplier of a mimic joint, 1 of any other; BadInput unless it is finite and not 0, without an offset."""
    mimic = urdf.joints[name].find("mimic")
    try:
        by, offset = (float(mimic.get(key, "") or word) if mimic is not None else 1.0 for key, word in _MIMIC.items())
    except ValueError:
        by, offset = float("nan"), 0.0
    if mimic is not None and (not np.isfinite(by) or by == 0.0 or offset != 0.0):
        raise BadInput(f"{urdf.path}: joint '{name}' mimics another: wanted a finite multiplier, not 0, and no offset")
    return by


def solid_vertices(link: Xml.Element) -> Array:
    """The corners (n, 3) [m] of a link's collision shapes, in its own frame."""
    corners = [np.zeros((0, 3))]
    for collision in link.findall("collision"):
        frame = placed(collision.find("origin"))
        points = _corners(collision)
        corners.append(points @ frame[:3, :3].T + frame[:3, 3])
    return np.concatenate(corners)


def _corners(collision: Xml.Element) -> Array:
    mesh, box = collision.find("geometry/mesh"), collision.find("geometry/box")
    if mesh is not None:
        scale = np.array(floats(mesh, "scale", "1 1 1"))
        return np.asarray(mesh_file.vertices(Path(mesh.get("filename", ""))) * scale)
    if box is not None:
        half = np.array(floats(box, "size", "")) / 2
    else:
        ball, rod = collision.find("geometry/sphere"), collision.find("geometry/cylinder")
        if ball is None and rod is None:
            return np.zeros((0, 3))
        radius = floats(ball if rod is None else rod, "radius", "")[0]
        half = np.array([radius, radius, radius if rod is None else floats(rod, "length", "")[0] / 2])
    return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
