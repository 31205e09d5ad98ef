"""The scene of a skill: the cell with the arm, or the applier's head, where the state has it."""

from dataclasses import dataclass
from math import hypot, radians

import numpy as np

from lab.seat.lesson_scene.episode_trail import STEP_S, Changes, EpisodeTrail
from lab.sim import models
from lab.sim.frames import Body, Frame, Rgba, Shape, Vector, Viewpoint
from lab.sim.scene import Layout, Scene, spots
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.skill import FINGERS_OFF_M, Bench
from lab.skills.surveys import neighbours
from lab.tasks.task_file import Task
from lab.view.camera_placement import camera_for, corners, vector
from lab.view.world_bodies import GREEN

NUMBER = 1  # of the slice that the lesson is about
SLICE = f"slice {NUMBER}"
GHOST: Rgba = (0.80, 0.68, 0.48, 0.3)
TRAIL_M, COLLISION_M = 0.004, 0.045  # [m] at least: the gripper must not hide them
_ROOM = np.array([0.09, 0.09, 0.10])  # [m] of a slice and the gripper around the places of the tool


@dataclass
class OnSlice:
    """What a skill has made to be seen on the slice in the states of its problem."""

    skill: Skill
    world: World

    def bodies(self) -> tuple[Body, ...]:
        """All of it, as a run's replay has it."""
        return self.skill.on_slice(NUMBER)

    def at(self, state: int) -> Changes:
        """What there is in `state`, where the slice is."""
        seen = self.skill.shown_in(state, NUMBER)
        position, (i, j, k, w) = self.world.pose(SLICE)
        pose = (*vector(position), float(i), float(j), float(k), float(w))
        return dict.fromkeys(seen, pose), seen


class SkillScene:
    """A skill's scene with the first slice in the gripper, or before it on its spot."""

    def __init__(self, task: Task, toasts: int, layout: Layout, skill: Skill) -> None:
        """Build the scene; `skill` is set up, `toasts` at least 1. A state out of reach leaves the arm where it was."""
        self._skill, self._mdp, self._frames = skill, skill.problem.mdp, 0
        self._world = World()
        try:
            self._bench = Bench(Scene(self._world, task, toasts, layout))
            self._ghosts = self._set_up(task)
            self._extra = OnSlice(skill, self._world) if skill.on_slice(NUMBER) else self._marks()
            self.bodies: tuple[Body, ...] = (*self._world.bodies(), *self._goal(), *self._extra.bodies())
            self.camera = self._camera()
        except BaseException:
            self.close()
            raise

    def _set_up(self, task: Task) -> dict[str, Rgba]:
        """The slice into the gripper or onto its spot; the colours of the slices that are not really there.

        These are the ones that the survey reckons with beside the spot, and the slice as it is to be set down.
        """
        bench, skill = self._bench, self._skill
        if skill.carries:
            bench.held = SLICE
            bench.scene.robot.open_at_once(models.SLICE[1] / 2 + FINGERS_OFF_M)
        elif skill.near:
            bench.scene.put_slice(SLICE, spots(task.station(skill.station))[0].grasp())
        if not skill.near:
            return {}
        station = task.station(skill.station)
        slices = [bench.slice_pose(f"slice {number}") for number in range(1, bench.scene.toasts + 1)]
        foot = spots(station)[0]
        ghosts = {
            name: (spot, GHOST)
            for name, spot in neighbours(station, foot).items()
            if all(hypot(spot.x - at.x, spot.y - at.y) > models.SLICE[0] / 4 for at in slices)
        }
        if skill.carries:
            ghosts["goal"] = (foot, GREEN)
        for name, (spot, _) in ghosts.items():
            bench.scene.add_slice(name, spot)
        return {name: rgba for name, (_, rgba) in ghosts.items()}

    def _place(self, state: int) -> Vector:
        pose = self._skill.pose(state)
        return (pose.x, pose.y, pose.z)

    def _marks(self) -> EpisodeTrail:
        size = self._size()
        return EpisodeTrail(self._mdp, self._place, max(0.11 * size, TRAIL_M), max(0.6 * size, COLLISION_M))

    def _size(self) -> float:
        """How far apart neighbouring states are, at least [m]."""
        start = self._mdp.start
        ways = np.array([self._place(int(state)) for state in self._mdp.successor[start]]) - self._place(start)
        lengths = np.linalg.norm(ways, axis=1)
        return float(lengths[lengths > 0].min())

    def _goal(self) -> tuple[Body, ...]:
        """A ball where the tool is to go through the cell; at a station the slice says so."""
        if self._skill.near:
            return ()
        at = self._place(int(np.flatnonzero(self._mdp.goal)[0]))
        return (Body("goal", (Shape("sphere", (0.35 * self._size(),), None, GREEN, at),)),)

    def _camera(self) -> Viewpoint:
        """From the front, of the slice or of the whole cell; a little from the right, so that nothing hides the rest."""
        free = np.flatnonzero(~self._mdp.terminal | self._mdp.goal)
        places = np.array([self._place(int(state)) for state in free])
        azimuth, elevation = (radians(angle) for angle in self._skill.looks_from)
        if not self._skill.near:
            return camera_for(np.vstack([places * [1.0, 1.0, 0.0], places + _ROOM]), azimuth, elevation)
        if not self._skill.moves_arm:
            places = np.vstack([places, self._world.pose(SLICE)[0]])
        yaw = self._skill.surveys.task.station(self._skill.station).pose[2]
        seen = corners(places.min(axis=0) - _ROOM, places.max(axis=0) + _ROOM)
        return camera_for(seen, yaw + azimuth, elevation)

    def frame(self, state: int) -> Frame:
        """Everything where it is in `state`."""
        self._skill.show(self._bench, state)
        poses, visible = self._extra.at(state)
        colors = {} if self._frames else self._ghosts
        self._frames += 1
        return Frame(self._frames * STEP_S, {**self._world.frame().poses, **poses}, colors, visible)

    def close(self) -> None:
        """Free the simulator."""
        self._world.close()
