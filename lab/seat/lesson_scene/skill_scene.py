"""The scene of a skill: the cell, with the arm or a machine's head in the pose of the state."""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, radians

import numpy as np

from lab.mdp import TabularMDP
from lab.sim.frames import Body, Frame, Pose, Rgba, Shape, Vector, Viewpoint
from lab.sim.parts.kinds import Spot
from lab.sim.scene.blocked_cells import FINGERS_OFF_M
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.skill import Bench
from lab.tasks.task import Order, Task, part_name
from lab.view.scene_data import camera_for, corners, vector
from lab.view.world_bodies import GREEN

STEP_S = 0.1  # [s] between two frames; nothing is simulated, times only have to increase
TRAIL = 48  # number of latest cells of the episode that are marked
RED: Rgba = (0.86, 0.16, 0.14, 0.6)
FAINT: Rgba = (0.16, 0.38, 0.78, 0.35)

Changes = tuple[dict[str, Pose], dict[str, bool]]  # poses and visibility, by body, for a frame


@dataclass
class EpisodeTrail:
    """Balls at the cells of the episode so far, and at a blocked cell that was entered.

    `place` gives the centre of a state's cell [m]; the radii [m] are those of both kinds of balls. A new episode begins
    after a terminal state, and when the state is not a neighbour of the last one.
    """

    mdp: TabularMDP
    place: Callable[[int], Vector]
    trail_m: float
    collision_m: float
    _last: int | None = None
    _count: int = 0

    def bodies(self) -> tuple[Body, ...]:
        """The balls, at the origin."""
        step = Shape("sphere", (self.trail_m,), None, FAINT)
        collision = Shape("sphere", (self.collision_m,), None, RED)
        return (*(Body(f"trail {number}", (step,)) for number in range(TRAIL)), Body("collision", (collision,)))

    def at(self, state: int) -> Changes:
        """The changes when the learner comes to `state`."""
        last, self._last = self._last, state
        poses: dict[str, Pose] = {}
        visible: dict[str, bool] = {}
        if last is None or self.mdp.terminal[last] or state not in self.mdp.successor[last]:
            visible = {f"trail {number}": False for number in range(TRAIL)}
        elif state != last:
            name = f"trail {self._count % TRAIL}"
            self._count += 1
            poses[name], visible[name] = upright(self.place(last)), True
        visible["collision"] = bool(self.mdp.terminal[state] and not self.mdp.goal[state])
        if visible["collision"]:
            poses["collision"] = upright(self.place(state))
        return poses, visible


def upright(at: Vector) -> Pose:
    """The pose at a place, without rotation."""
    return (*at, 0.0, 0.0, 0.0, 1.0)


# ---- the scene of a skill ---------------------------------------------------------------------------------------------


GHOST: Rgba = (0.80, 0.68, 0.48, 0.3)
TRAIL_M, COLLISION_M = 0.004, 0.045  # [m] least radii of the trail's balls, which the gripper must not hide
_ROOM = np.array([0.09, 0.09, 0.10])  # [m] space for a part and the gripper around the tool's positions


@dataclass
class OnPart:
    """The bodies that a skill makes visible on its part, state by state."""

    skill: Skill
    world: World
    name: str

    def bodies(self) -> tuple[Body, ...]:
        """All of these bodies, as in a run's replay."""
        return self.skill.on_part(self.name, self.skill.own_kind)

    def at(self, state: int) -> Changes:
        """The poses (on the part) and visibility of the bodies in `state`."""
        seen = self.skill.shown_in(state, self.name)
        position, (i, j, k, w) = self.world.pose(self.name)
        pose = (*vector(position), float(i), float(j), float(k), float(w))
        return dict.fromkeys(seen, pose), seen


class SkillScene:
    """A skill's scene with a part in the gripper, or in front of it on its spot."""

    def __init__(self, task: Task, order: Order, layout: Layout, skill: Skill) -> None:
        """Build the scene; `skill` is set up. A state out of reach leaves the arm where it was."""
        self._skill, self._mdp, self._frames = skill, skill.problem.mdp, 0
        self._world = World()
        try:
            self._bench = Bench(Scene(self._world, task, order, layout))
            self._ghosts = self._set_up(task)
            seen = OnPart(skill, self._world, self._part) if skill.kind else None
            self._extra = seen if seen is not None and seen.bodies() else self._marks()
            self.bodies: tuple[Body, ...] = (*self._world.bodies(), *self._goal(), *self._extra.bodies())
            self.camera = self._camera()
        except BaseException:
            self.close()
            raise

    def _set_up(self, task: Task) -> dict[str, Rgba]:
        """Put the part into the gripper or onto its spot; returns the colours of the ghosts.

        Ghosts are the neighbours that the survey assumes beside the spot, and the part in its target place.
        """
        bench, skill, scene = self._bench, self._skill, self._bench.scene
        kind = task.made_as(skill.kind).name if skill.kind else ""
        numbers = [number for number, own in enumerate(scene.order, 1) if own == kind]
        self._part = part_name(scene.order, numbers[0]) if numbers else ""
        skill.aim(self._part)
        if skill.carries:
            bench.held = scene.body_of(self._part, skill.kind)
            scene.robot.open_at_once(skill.own_kind.grip.width_m / 2 + FINGERS_OFF_M)
        elif skill.near:
            scene.put(self._part, skill.kind, skill.own_kind.held_at(skill.stands_on()))
        if not skill.near:
            return {}
        return self._ghosts_at(skill.stands_on())

    def _ghosts_at(self, foot: Spot) -> dict[str, Rgba]:
        skill, scene = self._skill, self._bench.scene
        station = scene.task.station(skill.station)
        stand = [self._world.pose(part_name(scene.order, number))[0] for number in range(1, len(scene.order) + 1)]
        near_m = skill.own_kind.footprint_m()[0] / 2
        colors: dict[str, Rgba] = {}
        for name, (kind, spot) in skill.surveys.places.neighbours(station, foot).items():
            if all(hypot(spot.x - at[0], spot.y - at[1]) > near_m for at in stand):
                scene.add(name, kind, spot)
                colors |= dict.fromkeys(scene.bodies_of(name, kind), GHOST)
        if skill.carries:
            scene.add("goal", skill.kind, foot)
            colors |= dict.fromkeys(scene.bodies_of("goal", skill.kind), GREEN)
        return colors

    def _place(self, state: int) -> Vector:
        pose = self._skill.pose(state)
        return (pose.x, pose.y, pose.z)

    def _marks(self) -> EpisodeTrail:
        size = self._size()
        return EpisodeTrail(self._mdp, self._place, max(0.11 * size, TRAIL_M), max(0.6 * size, COLLISION_M))

    def _size(self) -> float:
        """The least distance between neighbouring states [m]."""
        start = self._mdp.start
        ways = np.array([self._place(int(state)) for state in self._mdp.successor[start]]) - self._place(start)
        lengths = np.linalg.norm(ways, axis=1)
        return float(lengths[lengths > 0].min())

    def _goal(self) -> tuple[Body, ...]:
        """A ball at the goal of a motion through the workspace; at a station the part marks the goal."""
        if self._skill.near:
            return ()
        at = self._place(int(np.flatnonzero(self._mdp.goal)[0]))
        return (Body("goal", (Shape("sphere", (0.35 * self._size(),), None, GREEN, at),)),)

    def _camera(self) -> Viewpoint:
        """A camera in front of the part or the whole cell, slightly to the right so that less is hidden."""
        free = np.flatnonzero(~self._mdp.terminal | self._mdp.goal)
        places = np.array([self._place(int(state)) for state in free])
        azimuth, elevation = (radians(angle) for angle in self._skill.looks_from)
        if not self._skill.near:
            return camera_for(np.vstack([places * [1.0, 1.0, 0.0], places + _ROOM]), azimuth, elevation)
        if not self._skill.moves_arm:
            places = np.vstack([places, self._world.pose(self._part)[0]])
        yaw = self._skill.surveys.task.station(self._skill.station).pose[2]
        seen = corners(places.min(axis=0) - _ROOM, places.max(axis=0) + _ROOM)
        return camera_for(seen, yaw + azimuth, elevation)

    def frame(self, state: int) -> Frame:
        """The frame of the whole scene in `state`."""
        self._skill.show(self._bench, state)
        poses, visible = self._extra.at(state)
        colors = {} if self._frames else self._ghosts
        self._frames += 1
        return Frame(self._frames * STEP_S, {**self._world.frame().poses, **poses}, colors, visible)

    def close(self) -> None:
        """Free the simulator."""
        self._world.close()
