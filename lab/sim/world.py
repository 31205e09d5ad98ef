"""One PyBullet world: bodies by name, metres, radians, seconds. The only module that imports pybullet."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from math import isfinite
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.sim import urdf_reader
from lab.sim.frames import Body, Frame, Pose, Rgba, Shape
from lab.sim.parts.part_shape import PartShape, seen_of, solid_of
from lab.sim.silence import silence

TIME_STEP = 1.0 / 240.0  # [s]
PART_SPINNING = 0.001  # [m] spinning friction of a part's contacts
GROUP, ALL = 1, -1  # collision group and mask of movable bodies, the engine's defaults
PART_ROLLING = 0.0005  # [m] rolling friction of parts that are no boxes: without it, a ball never comes to rest

Array = NDArray[np.float64]
Position = Sequence[float] | Array
NO_TURN = (0.0, 0.0, 0.0, 1.0)
ENGINES = ("pybullet", "pybullet-arm64")  # the distributions that contain the module pybullet; one of them is installed


def engine() -> str:
    """The name and version of the installed physics engine, such as "pybullet 3.2.7"; raises WorkFailed when there is none."""
    for name in ENGINES:
        try:
            return f"{name} {version(name)}"
        except PackageNotFoundError:
            continue
    raise WorkFailed(f"no physics engine is installed ({' or '.join(ENGINES)}): install the lab again")


@dataclass
class _Entry:
    """A body in the world: its number, whether it can move, link numbers and joint numbers by name, and its looks."""

    number: int
    moves: bool
    pose: tuple[Position, Position]
    links: dict[str, int] = field(default_factory=dict)
    joints: dict[str, int] = field(default_factory=dict)
    looks: dict[str, tuple[Shape, ...]] = field(default_factory=dict)
    turn: Position = NO_TURN  # from PyBullet's axes, the principal axes of a part, to the body's own axes


class World:
    """A PyBullet client without a window; use it as a context manager. The same calls give the same result, bit for bit."""

    def __init__(self) -> None:
        with silence():
            import pybullet

            self._p: Any = pybullet
            self._client = pybullet.connect(pybullet.DIRECT)
        if self._client < 0:
            raise WorkFailed("PyBullet gave no physics client")
        self._bodies: dict[str, _Entry] = {}
        self._names: dict[int, str] = {}
        self.steps = 0
        self.dark = False  # whether cameras are blind
        self._iterations = 60
        self._call("setGravity", 0, 0, -9.81)
        self._call(
            "setPhysicsEngineParameter",
            fixedTimeStep=TIME_STEP,
            numSolverIterations=self._iterations,
            deterministicOverlappingPairs=1,
        )

    def iterations(self, count: int) -> int:
        """Sets the solver's iterations per step, of which a linkage of fingers needs more than bodies do.

        Returns the previous number.
        """
        before, self._iterations = self._iterations, count
        self._call("setPhysicsEngineParameter", numSolverIterations=count)
        return before

    def at_least(self, iterations: int) -> int:
        """Raises the solver's iterations per step to at least this number; returns the previous one."""
        return self.iterations(max(iterations, self._iterations))

    def _call(self, name: str, *args: Any, **kwargs: Any) -> Any:
        return getattr(self._p, name)(*args, physicsClientId=self._client, **kwargs)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the client; a closed world stays closed."""
        if self._client >= 0:
            self._call("disconnect")
            self._client = -1

    @property
    def time_s(self) -> float:
        """Simulated time since the world began [s]."""
        return self.steps * TIME_STEP

    def step(self) -> None:
        """Advance the physics by TIME_STEP [s]."""
        self._call("stepSimulation")
        self.steps += 1

    def pass_time(self, steps: int) -> None:
        """Advances the clock by `steps` physics steps without simulating them."""
        self.steps += steps

    # ---- Bodies -------------------------------------------------------------------------------------------------

    def load(
        self,
        name: str,
        path: Path,
        position: Position = (0, 0, 0),
        yaw: float = 0.0,
        *,
        fixed: bool = True,
        checked: bool = False,
    ) -> None:
        """Load a URDF, after validating it unless it is `checked`, as body `name` at `position` [m], turned by `yaw` [rad]."""
        if not checked:
            urdf_reader.validate(path)
        turn = self._p.getQuaternionFromEuler([0, 0, yaw])
        with silence():
            flags = self._p.URDF_USE_INERTIA_FROM_FILE
            number = self._call("loadURDF", str(path), list(position), turn, useFixedBase=fixed, flags=flags)
        entry = _Entry(number, not fixed, (tuple(position), tuple(turn)))
        for joint in range(self._call("getNumJoints", number)):
            info = self._call("getJointInfo", number, joint)
            entry.joints[info[1].decode()] = joint
            entry.links[info[12].decode()] = joint
        entry.looks = urdf_reader.looks(path)
        self._add(name, entry)

    def box(self, name: str, size: Position, position: Position, rgba: Rgba, *, yaw: float = 0.0) -> None:
        """A box that never moves: `size` and centre `position` [m]."""
        half = [s / 2 for s in size]
        turn = tuple(self._p.getQuaternionFromEuler([0, 0, yaw]))
        shape = self._call("createCollisionShape", self._p.GEOM_BOX, halfExtents=half)
        visual = self._call("createVisualShape", self._p.GEOM_BOX, halfExtents=half, rgbaColor=list(rgba))
        self._fixed(name, shape, visual, position, turn, Shape("box", tuple(size), None, rgba))

    def mesh(self, name: str, path: Path, position: Position, rgba: Rgba, *, yaw: float = 0.0) -> None:
        """A mesh file that never moves, with its hollows; its origin is at `position` [m]."""
        turn = tuple(self._p.getQuaternionFromEuler([0, 0, yaw]))
        with silence():
            hollow = self._p.GEOM_FORCE_CONCAVE_TRIMESH
            shape = self._call("createCollisionShape", self._p.GEOM_MESH, fileName=str(path), flags=hollow)
            visual = self._call("createVisualShape", self._p.GEOM_MESH, fileName=str(path), rgbaColor=list(rgba))
        self._fixed(name, shape, visual, position, turn, Shape("mesh", (), path, rgba))

    def disc(self, name: str, radius: float, height: float, position: Position, rgba: Rgba) -> None:
        """A flat round marker without collisions; `position` [m] is its centre."""
        visual = self._call(
            "createVisualShape", self._p.GEOM_CYLINDER, radius=radius, length=height, rgbaColor=list(rgba)
        )
        self._fixed(name, -1, visual, position, NO_TURN, Shape("cylinder", (radius, height), None, rgba))

    def show(self, name: str, looks: Sequence[Shape]) -> None:
        """A body at the origin that is only seen, and collides with nothing; `put` moves it."""
        with silence():
            visual = seen_of(self._p, self._call, looks)
        number = self._call("createMultiBody", 0, -1, visual, [0.0, 0.0, 0.0], list(NO_TURN))
        self._add(name, _Entry(number, False, ((0.0, 0.0, 0.0), NO_TURN), looks={"": tuple(looks)}))

    def _fixed(self, name: str, shape: int, visual: int, position: Position, turn: Position, look: Shape) -> None:
        number = self._call("createMultiBody", 0, shape, visual, list(position), list(turn))
        self._add(name, _Entry(number, False, (tuple(position), tuple(turn)), looks={"": (look,)}))

    def part(
        self, name: str, shape: PartShape, mass_kg: float, friction: float, position: Position, yaw: float = 0.0
    ) -> None:
        """A part that can move: its origin, the centre of mass, at `position` [m], turned by `yaw` [rad]."""
        turn = tuple(self._p.getQuaternionFromEuler([0, 0, yaw]))
        entry = _Entry(-1, True, (tuple(position), turn), looks={"": shape.looks}, turn=shape.turn)
        body = self._turned(turn, shape.turn)
        with silence():
            solid, seen = solid_of(self._p, self._call, shape), seen_of(self._p, self._call, shape.looks, shape.turn)
            entry.number = self._call("createMultiBody", mass_kg, solid, seen, list(position), list(body))
        moments, rolling = (
            [float(f"{moment * mass_kg:.12g}") for moment in shape.inertia_m2],
            PART_ROLLING * (shape.solid != "box"),
        )
        self._call("changeDynamics", entry.number, -1, localInertiaDiagonal=moments, rollingFriction=rolling)
        if shape.solid == "mesh":
            self._call("changeDynamics", entry.number, -1, collisionMargin=shape.inner[1])
        self._add(name, entry)
        self.friction(name, friction, spinning=PART_SPINNING)

    def _turned(self, turn: Position, by: Position) -> Position:
        """The turn `by` followed by `turn`, quaternions xyzw."""
        if tuple(by) == NO_TURN:
            return turn
        return tuple(self._p.multiplyTransforms([0, 0, 0], list(turn), [0, 0, 0], list(by))[1])

    def _add(self, name: str, entry: _Entry) -> None:
        self._bodies[name] = entry
        self._names[entry.number] = name

    def friction(
        self,
        name: str,
        lateral: float,
        *,
        links: Sequence[str] | None = None,
        spinning: float = 0.0,
        sticks: bool = False,
    ) -> None:
        """Set the Coulomb friction of a body (or of some of its links); `spinning` resists turning about the contact [m].

        sticks: a contact that does not slide keeps its place; otherwise it creeps, because only velocities are corrected.
        """
        entry = self._bodies[name]
        anchor = {"frictionAnchor": 1} if sticks else {}
        for link in [-1, *entry.links.values()] if links is None else [entry.links[one] for one in links]:
            self._call(
                "changeDynamics", entry.number, link, lateralFriction=lateral, spinningFriction=spinning, **anchor
            )

    def mass(self, name: str, mass_kg: float) -> None:
        """Give a one-link body another mass [kg]; its inertia is scaled by the same factor."""
        number = self._bodies[name].number
        info = self._call("getDynamicsInfo", number, -1)
        inertia = [value * mass_kg / info[0] for value in info[2]]
        self._call("changeDynamics", number, -1, mass=mass_kg, localInertiaDiagonal=inertia)

    def put(self, name: str, position: Position, quaternion: Position = NO_TURN) -> None:
        """Moves a body, also a fixed one, without physics to `position` [m], `quaternion` xyzw; a part is then at rest."""
        if not np.isfinite([*position, *quaternion]).all():
            raise WorkFailed(f"body '{name}' cannot be put at {list(position)}: not finite")
        entry = self._bodies[name]
        at, turn = position, self._turned(quaternion, entry.turn)
        if not entry.moves:  # PyBullet wants the position of the base's centre of mass
            off = self._call("getDynamicsInfo", entry.number, -1)[3:5]
            at, turn = self._p.multiplyTransforms(list(at), list(turn), *off)
        self._call("resetBasePositionAndOrientation", entry.number, list(at), list(turn))
        entry.pose = (tuple(position), tuple(quaternion))

    def remove(self, name: str) -> None:
        """Take a body out of the world, with its contacts; a body that is added next gets its place in the engine."""
        number = self._bodies.pop(name).number
        del self._names[number]
        self._call("removeBody", number)

    def forget_contacts(self, name: str) -> None:
        """Lets the engine recompute, at its next step, all contacts of a body's links, in the order of a new world."""
        entry = self._bodies[name]
        for link in entry.links.values():
            self._call("setCollisionFilterGroupMask", entry.number, link, GROUP, ALL)

    def touched(self, name: str) -> set[str]:
        """The names of the bodies that a body touched in the last step."""
        number = self._bodies[name].number
        points = self._call("getContactPoints", number)
        return {self._names[n] for point in points for n in point[1:3] if n in self._names and n != number}

    def names(self) -> list[str]:
        """All bodies, in the order in which they came."""
        return list(self._bodies)

    def looks(self, name: str) -> tuple[Shape, ...]:
        """The visible shapes of a body without links."""
        return self._bodies[name].looks.get("", ())

    def pose(self, name: str, link: str = "") -> tuple[Array, Array]:
        """Position (3,) [m] and quaternion (4,) xyzw of a body's or a link's frame in the world."""
        position, turn = self._pose(name, link)
        return np.array(position), np.array(turn)

    def _pose(self, name: str, link: str) -> tuple[Any, Any]:
        """The position and quaternion of `pose` as PyBullet returns them, tuples or arrays."""
        entry = self._bodies[name]
        if link and link in entry.links:
            state = self._call("getLinkState", entry.number, entry.links[link], computeForwardKinematics=1)
            return state[4], state[5]
        position, turn = self._call("getBasePositionAndOrientation", entry.number) if entry.moves else entry.pose
        if entry.moves and tuple(entry.turn) != NO_TURN:
            turn = self._turned(turn, self._p.invertTransform([0, 0, 0], list(entry.turn))[1])
        return position, turn

    # ---- Joints -------------------------------------------------------------------------------------------------

    def joints(self, name: str, names: Sequence[str]) -> Array:
        """Joint positions [rad or m], shape (n,)."""
        entry = self._bodies[name]
        states = self._call("getJointStates", entry.number, [entry.joints[joint] for joint in names])
        return np.array([state[0] for state in states])

    def joint_speeds(self, name: str, names: Sequence[str]) -> Array:
        """Joint velocities [rad/s or m/s], shape (n,)."""
        entry = self._bodies[name]
        states = self._call("getJointStates", entry.number, [entry.joints[joint] for joint in names])
        return np.array([state[1] for state in states])

    def set_joints(self, name: str, names: Sequence[str], positions: Sequence[float] | Array) -> None:
        """Put joints at `positions` at once, without physics: for building and surveying a scene."""
        if not np.isfinite(positions).all():
            raise WorkFailed(f"joint positions of '{name}' are not finite: {list(positions)}")
        entry = self._bodies[name]
        for joint, value in zip(names, positions, strict=True):
            self._call("resetJointState", entry.number, entry.joints[joint], float(value))

    def drive(
        self,
        name: str,
        names: Sequence[str],
        positions: Sequence[float] | Array,
        velocities: Sequence[float] | Array | None = None,
        *,
        force: float | Sequence[float] = 2000.0,
    ) -> None:
        """Set the position motors' targets [rad or m], with velocities fed forward; `force` [Nm or N] is their limit."""
        targets = [float(v) for v in positions]
        speeds = [0.0] * len(names) if velocities is None else [float(v) for v in velocities]
        if not all(map(isfinite, targets + speeds)):
            raise WorkFailed(f"joint targets of '{name}' are not finite: {targets}, moving {speeds}")
        entry = self._bodies[name]
        self._call(
            "setJointMotorControlArray",
            entry.number,
            [entry.joints[joint] for joint in names],
            self._p.POSITION_CONTROL,
            targetPositions=targets,
            targetVelocities=speeds,
            forces=[force] * len(names) if isinstance(force, float) else list(force),
            positionGains=[0.3] * len(names),
            velocityGains=[1.0] * len(names),
        )

    def gear(self, name: str, joint_a: str, joint_b: str, ratio: float = 1.0) -> None:
        """Couple two joints: b moves `ratio` times as far as a (a two-finger gripper drifts without it)."""
        entry = self._bodies[name]
        first, second = entry.joints[joint_a], entry.joints[joint_b]
        axis, zero = [1, 0, 0], [0, 0, 0]
        gear = self._call(
            "createConstraint", entry.number, first, entry.number, second, self._p.JOINT_GEAR, axis, zero, zero
        )
        self._call("changeConstraint", gear, gearRatio=-1.0 / ratio, erp=0.1, maxForce=100)

    # ---- Contacts, distances and pictures -----------------------------------------------------------------------

    def touch_anew(self, name: str, links: Sequence[str]) -> None:
        """Lets the engine recompute, at its next step, the contacts of movable bodies with these links of a body.

        It keeps a contact as long as the two points stay together, with the direction that it had in the world: in a gripper
        that turned by half a turn a part would press on the fingers from behind, and hold them closed.
        """
        entry, movable = self._bodies[name], {body.number for body in self._bodies.values() if body.moves}
        touched = {
            int(contact[2])
            for link in links
            for contact in self._call("getContactPoints", entry.number, linkIndexA=entry.links[link])
        }
        for number in sorted(touched & movable - {entry.number}):
            self._call("setCollisionFilterGroupMask", number, -1, GROUP, ALL)

    def touching(self, one: str, other: str, link: str = "") -> bool:
        """Whether two bodies touched in the last step (`link`: that link of the first)."""
        first, second = self._bodies[one], self._bodies[other]
        chosen = {"linkIndexA": first.links[link]} if link else {}
        return bool(self._call("getContactPoints", first.number, second.number, **chosen))

    def bounds(self, name: str) -> tuple[Array, Array]:
        """The lowest and the highest corner (3,) [m] of the box along the world's axes that a body fills."""
        low, high = self._call("getAABB", self._bodies[name].number)
        return np.array(low), np.array(high)

    def pressed(self, name: str) -> tuple[str, float]:
        """The body that a body pressed on most in the last step, and the force [N]; ("", 0) if it touched none."""
        forces: dict[int, float] = {}
        for point in self._call("getContactPoints", self._bodies[name].number):
            if point[1] != point[2]:
                forces[point[2]] = forces.get(point[2], 0.0) + float(point[9])
        number, force = max(forces.items(), key=lambda item: item[1], default=(-1, 0.0))
        return self._names.get(number, ""), force

    def nearest(self, one: str, other: str, within: float, first_link: int = -1) -> float:
        """The distance [m] between two bodies, at most `within`.

        first_link: of the first body only the links from this number on count; -1 is its base.
        """
        first, second = self._bodies[one].number, self._bodies[other].number
        points = self._call("getClosestPoints", first, second, within)
        return min((float(point[8]) for point in points if point[3] >= first_link), default=within)

    def ray(self, start: Position, end: Position) -> tuple[str, Array] | None:
        """The first body that the ray from `start` to `end` [m] meets, and the point, or None."""
        number, _, _, where, _ = self._call("rayTest", list(start), list(end))[0]
        return (self._names[number], np.array(where)) if number in self._names else None

    def render(self, view: Array, projection: Array, width: int, height: int) -> NDArray[np.uint8]:
        """The picture (height, width, 3) uint8 RGB through OpenGL-style `view` and `projection` matrices, each (4, 4)."""
        if self.dark:
            return np.zeros((height, width, 3), np.uint8)
        _, _, pixels, _, _ = self._call(
            "getCameraImage",
            width,
            height,
            list(view.T.ravel()),
            list(projection.T.ravel()),
            shadow=0,
            renderer=self._p.ER_TINY_RENDERER,
            lightDirection=[0.3, -0.4, 1.0],
        )
        # An engine that was built without numpy gives a tuple of numbers from 0 to 255.
        rgba = np.frombuffer(bytes(pixels), np.uint8) if isinstance(pixels, tuple) else np.asarray(pixels, np.uint8)
        return rgba.reshape(height, width, 4)[:, :, :3]

    # ---- Records for viewers ------------------------------------------------------------------------------------

    def bodies(self) -> tuple[Body, ...]:
        """The bodies for a viewer, one per link, named `body` or `body link`."""
        return tuple(
            Body(_label(name, link), shapes)
            for name, entry in self._bodies.items()
            for link, shapes in entry.looks.items()
            if shapes
        )

    def frame(self) -> Frame:
        """The poses of all bodies now."""
        return Frame(self.time_s, self.poses())

    def poses(self) -> dict[str, Pose]:
        """The pose of each body of `bodies` now, by name."""
        poses: dict[str, Pose] = {}
        for name, entry in self._bodies.items():
            for link, shapes in entry.looks.items():
                if shapes:
                    (x, y, z), (i, j, k, w) = self._pose(name, link)
                    poses[_label(name, link)] = (x, y, z, i, j, k, w)
        return poses


def _label(name: str, link: str) -> str:
    return f"{name} {link}" if link else name
