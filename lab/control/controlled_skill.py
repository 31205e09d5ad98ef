"""A skill as a continuous-control problem: its aim, the box in which the tool moves, and the bodies that are in it.

All of it follows from the surveyed problem of the skill, and is computed once a process for each task, skill and layout.
"""

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.mdp import TabularMDP, shortest_path
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import COUNTED
from lab.sim.scene.places import Layout
from lab.skills import Insert, Skill
from lab.skills.around_part import AroundPart
from lab.skills.insert import IN_SLOT_M
from lab.skills.place import NEAR_M
from lab.skills.prepared_scene import lay_out, prepare
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.task import TAUGHT_WITH, Order, Task
from lab.tasks.task_file import load

START_RANGE = (0.05, 0.05, 0.04, 0.30)  # the start is drawn within +- x, y, z [m], yaw [rad] of where the skill begins
GOAL_RANGE = (0.02, 0.02, 0.12)  # the station, or the end of a transfer, within +- x, y [m], yaw [rad] of its place
MARGIN_M, ABOVE_M, BELOW_M = 0.15, 0.12, 0.02  # by which the box exceeds all poses of the table, sideways, up and down
TURN_RAD = 2.0  # the largest turn of the tool from the goal's yaw
CACHED = 16  # skills that are kept in memory

Array = NDArray[np.float64]


class Aim(Enum):
    """What ends an episode well: a part is lifted, stands in its place, or the tool is where it should be."""

    TAKE = "take"
    SET_DOWN = "set down"
    REACH = "reach"


@dataclass(frozen=True, eq=False)
class ControlledSkill:
    """A surveyed skill of a task in a layout of its obstacles. Raises BadInput for a skill that does not move the tool so."""

    task: Task
    layout: Layout
    skill: Skill

    def __post_init__(self) -> None:
        skill, where = self.skill, f"task '{self.task.name}'"
        if not skill.moves_arm or skill.problem.mdp.coverage_shape:
            raise BadInput(
                f"skill '{skill.name}' ({where}): it has no pose to reach: wanted one that grasps, carries or sets down"
            )
        if self.arm.level is not None or (skill.station and self.surveys.into(skill.station) is not None):
            raise BadInput(
                f"skill '{skill.name}' ({where}): wanted a tool that hangs, and a station that is entered from above"
            )

    @property
    def surveys(self) -> Surveys:
        """The surveys of the scene."""
        return self.skill.surveys

    @property
    def mdp(self) -> TabularMDP:
        """The skill's table."""
        return self.skill.problem.mdp

    def is_of_other_kind(self, name: str) -> bool:
        """Whether a name is that of a skill of this task for another sub-task."""
        found = SkillSet.of(self.task, self.task.fitting(TAUGHT_WITH)).skills.get(name)
        return found is not None and found.subtask != self.skill.subtask

    @cached_property
    def arm(self) -> Arm:
        """The task's arm."""
        return arm_of(self.task.robot, self.task.folder)

    @property
    def aim(self) -> Aim:
        """What ends an episode well."""
        if not self.skill.station:
            return Aim.REACH
        return Aim.SET_DOWN if self.skill.carries else Aim.TAKE

    @property
    def within_m(self) -> float:
        """The largest distance of a part that was set down from its spot [m]."""
        return IN_SLOT_M if isinstance(self.skill, Insert) else NEAR_M

    @cached_property
    def start(self) -> ToolPose:
        """The tool pose around which starts are drawn."""
        return self.skill.begins_at() or self.skill.pose(self.mdp.start)

    @cached_property
    def goal(self) -> ToolPose:
        """The tool pose that takes or releases the part at the station's own place, or that ends a transfer."""
        if self.aim is Aim.REACH:
            return self.skill.pose(int(np.flatnonzero(self.mdp.goal)[0]))
        return self.skill.own_kind.held_at(self.skill.stands_on())

    @property
    def around_goal(self) -> bool:
        """Whether the table's poses are relative to the goal, not to the world."""
        return isinstance(self.skill, AroundPart)

    @cached_property
    def poses(self) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (S, 4) of the table's states, relative to the goal if `around_goal`."""
        skill, states = self.skill, range(self.mdp.n_states)
        if isinstance(skill, AroundPart):
            own = [skill.pose(state, ToolPose(0.0, 0.0, 0.0, 0.0)) for state in states]
        else:
            own = [skill.pose(state) for state in states]
        return np.array([[pose.x, pose.y, pose.z, pose.yaw] for pose in own])

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """The states (S,) in which the tool can be."""
        return np.asarray(~self.mdp.terminal | self.mdp.goal)

    @cached_property
    def path_m(self) -> float:
        """The length of a shortest path of the table [m], turns counted as length."""
        path = self.poses[shortest_path(self.mdp)] * COUNTED
        return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """The lowest and the highest tool pose (4,) that are commanded: x, y, z [m], yaw [rad]."""
        goal, start = self.goal, self.start
        poses = self.poses[self.free]
        if self.around_goal:
            poses = np.array([[p.x, p.y, p.z, p.yaw] for p in (goal.local(*map(float, row)) for row in poses)])
        ends = [[goal.x, goal.y, goal.z], [start.x, start.y, start.z]]
        low, high = np.min([*poses[:, :3].tolist(), *ends], axis=0), np.max([*poses[:, :3].tolist(), *ends], axis=0)
        low, high = low - np.array([MARGIN_M, MARGIN_M, BELOW_M]), high + np.array([MARGIN_M, MARGIN_M, ABOVE_M])
        return np.append(low, goal.yaw - TURN_RAD), np.append(high, goal.yaw + TURN_RAD)

    @cached_property
    def nearby(self) -> tuple[Task, Layout]:
        """The task and the layout with only the stations and obstacles that the arm can come near, its tool in the box."""
        low, high = (np.array(self.box[end][:2]) for end in (0, 1))
        low, high = np.minimum(low, 0.0) - MARGIN_M, np.maximum(high, 0.0) + MARGIN_M  # from the arm's foot to the box
        parts, places, kept = len(self.surveys.order), self.surveys.places, []
        for station in self.task.stations:
            corners = np.array(places.body(station, parts).corners())
            if (corners.max(axis=0) >= low).all() and (corners.min(axis=0) <= high).all():
                kept.append(station)
        stand = zip(self.task.obstacles, self.layout.obstacles, strict=True)
        near = [
            (o, at)
            for o, at in stand
            if (np.array(at) >= low - max(o.size)).all() and (np.array(at) <= high + max(o.size)).all()
        ]
        task = self.task.model_copy(update={"stations": tuple(kept), "obstacles": tuple(o for o, _ in near)})
        return task, Layout(tuple(at for _, at in near), ())


@lru_cache(maxsize=CACHED)
def controlled_skill(task: str, skill: str, layout_seed: int) -> ControlledSkill:
    """A skill of a task, surveyed in the layout that a seed draws. `skill`: its name, or that of its sub-task for the first one.

    Raises BadInput for unknown names, a scene without a solution, and a skill that is no control problem.
    """
    loaded = load(task)
    order: Order = loaded.fitting(TAUGHT_WITH)
    skills = SkillSet.of(loaded, order).skills
    name = next((own for own, found in skills.items() if skill in (own, found.subtask)), None)
    if name is None:
        subtasks = dict.fromkeys(found.subtask for found in skills.values())
        raise unknown("skill", skill, (*subtasks, *skills), f"task '{loaded.name}'")
    prepared = prepare(loaded, order, layout_seed, name)
    layout = replace(lay_out(loaded, order, layout_seed), parts=())
    return ControlledSkill(prepared.task, layout, prepared.skillset.skills[name])
