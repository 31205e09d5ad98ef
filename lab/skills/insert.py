"""Insert: by the overhead camera's picture through the 12 x 12 grid to the toaster, and down into its slot (thesis ch. 8)."""

from collections.abc import Iterator
from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, grid
from lab.sim import models
from lab.sim.kinematics import ToolPose
from lab.sim.scene import GRASP_DEPTH, Spot, is_toaster, spots
from lab.skills.place import let_go, release_pose
from lab.skills.skill import Bench, Photo, Skill, SkillFailed, learned_path, no_way, over_everything
from lab.skills.surveys import INSERT_START, Surveys, camera_view, overhead_camera
from lab.tasks.task_file import Obstacle, Task
from lab.vision import Marker, find_markers, locate, see

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward")  # -x, +x, -y, +y: as the camera's picture shows them
CLEARANCE_M = 0.006  # between a carried slice and a cube in its way
_GRIPPER_HALF_M = 0.055  # as high as the fingers, the gripper is wider than the slice
SEEN_WITHIN_M = 0.008  # the camera must see the gripper this near to where the grid says it is
CHECK_PIXELS = 320  # a side of the pictures taken on the way
IN_SLOT_M = 0.008
_SLOW = 0.6


class Insert(Skill):
    """Carry the slice in the gripper from the grid's start to the toaster's slot and let it go there."""

    subtask: ClassVar[str] = "insert"
    help: ClassVar[str] = "by the overhead camera's picture to the toaster, and down into its slot"
    looks_from: ClassVar[tuple[float, float]] = (-84.0, 46.0)
    carries = True

    def __init__(self, station: str) -> None:
        super().__init__(f"insert at {station}")
        self.station = station

    @classmethod
    def on_carry(cls, task: Task, origin: str, target: str) -> "Insert | None":
        """At the end, where the camera's grid leads."""
        return cls(target) if is_toaster(task.station(target)) else None

    def setup(self, surveys: Surveys) -> Problem:
        """Take the overhead picture, find the markers, and block the cells in which the slice would meet a cube."""
        self.surveys = surveys
        self.picture = surveys.picture()
        self.seen = see(
            self.picture, camera_view(surveys.task, layout=surveys.layout), where="the overhead camera's picture"
        )
        blocked, names = self._blocked(surveys.task)
        rewards = surveys.task.subtask("insert").rewards
        try:
            if blocked[self.seen.goal]:
                raise BadInput(f"{self.name}: the toaster's cell is blocked by {names[self.seen.goal]}")
            if blocked[self.seen.start]:
                raise BadInput(f"{self.name}: the start's cell is blocked by {names[self.seen.start]}")
            mdp = grid(blocked.shape, blocked, self.seen.start, self.seen.goal, rewards, ACTIONS)
        except NoPath as error:
            enclosing = {part for cell in error.enclosing for part in names[cell].split(", ")}
            raise no_way(self.name, error, sorted(enclosing)) from None
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def _blocked(self, task: Task) -> tuple[NDArray[np.bool_], dict[tuple[int, ...], str]]:
        """Cells in which the carried slice would touch a cube that the camera sees, or cannot be for another reason; and why."""
        causes: dict[tuple[int, ...], list[str]] = {cell: [] for cell in np.ndindex(*task.insert.shape)}
        seen = {self._named(task, marker): marker.world_m for marker in self.seen.markers if marker.kind == "obstacle"}
        for name, place in seen.items():
            reach = _reach(task, next(o for o in task.obstacles if o.name == name))
            for cell, found in causes.items():
                middle = self.seen.view.centre((cell[0], cell[1]))
                if all(abs(m - p) < r for m, p, r in zip(middle, place, reach, strict=True)):
                    found.append(name)
        unseen = self.surveys.over_grid(frozenset(seen)).causes
        for cell in zip(*np.nonzero(unseen != ""), strict=True):
            causes[tuple(map(int, cell))].append(str(unseen[cell]))
        blocked = np.zeros(task.insert.shape, bool)
        for cell, found in causes.items():
            blocked[cell] = bool(found)
        return blocked, {cell: ", ".join(found) for cell, found in causes.items() if found}

    def _named(self, task: Task, marker: Marker) -> str:
        """The name of the obstacle that a marker lies on."""
        x, y = marker.world_m
        places = zip(task.obstacles, self.surveys.layout.obstacles, strict=True)
        return min(places, key=lambda place: hypot(place[1][0] - x, place[1][1] - y))[0].name

    def photo(self) -> Photo:
        """The overhead picture."""
        return Photo(self.picture, self.seen)

    def begins_at(self) -> ToolPose:
        """At the grid's start, where a transfer ends."""
        high = self.surveys.approach(INSERT_START)
        return ToolPose(high.x, high.y, self.surveys.task.insert.height_m, 0.0)

    def pose(self, state: int) -> ToolPose:
        """Over the middle of the grid's cell."""
        i, j = self.problem.mdp.state_cell(state)
        return ToolPose(*self.seen.view.centre((i, j)), self.surveys.task.insert.height_m, 0.0)

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Cell by cell, each time seen by the camera; then above the slot, down, let go, and see that the slice is in it."""
        task, robot, mdp, name = self.surveys.task, bench.scene.robot, self.problem.mdp, bench.held
        if name is None:
            raise SkillFailed(f"nothing in the gripper to insert at '{self.station}'")
        self.deviations_m = []
        yield from self._to_start(bench)
        self._same_picture(bench)
        for state in learned_path(policy, mdp, mdp.start):
            pose = self.pose(state)
            yield from robot.follow([pose])
            self._check_camera(bench, pose.x, pose.y)
        spot = self._slot(task)
        goal = release_pose(bench, name, spot)
        yield from robot.follow([ToolPose(goal.x, goal.y, task.insert.height_m, goal.yaw)], slow=_SLOW)
        yield from robot.follow([goal], slow=_SLOW)
        yield from let_go(bench, goal, self.surveys.approach(self.station))
        if not bench.stands(name, spot.grasp(), IN_SLOT_M):
            raise SkillFailed(f"{name} is not in the slot of '{self.station}'")

    def _slot(self, task: Task) -> Spot:
        """The slot where the camera saw the toaster."""
        marker = next(m for m in self.seen.markers if m.kind == "toaster")
        spot = spots(task.station(self.station))[0]
        return replace(spot, x=marker.world_m[0], y=marker.world_m[1])

    def _to_start(self, bench: Bench) -> Iterator[None]:
        """Where the tool is not at the grid's start, as when trying again: over everything and down to it."""
        start, tool = self.pose(self.problem.mdp.start), bench.scene.robot.tool()
        if hypot(tool.x - start.x, tool.y - start.y, tool.z - start.z) >= self.surveys.task.insert.cell_m:
            yield from over_everything(bench, start)

    def _same_picture(self, bench: Bench) -> None:
        """A new snapshot must show the cubes and the toaster where they were learned around, and no others."""
        view = self.seen.view
        now, _ = find_markers(overhead_camera(self.surveys.task).picture(bench.scene.world), view)
        for before in (marker for marker in self.seen.markers if marker.kind != "gripper"):
            x, y = before.world_m
            moved = min((hypot(m.world_m[0] - x, m.world_m[1] - y) for m in now if m.kind == before.kind), default=None)
            if moved is None:
                raise SkillFailed(f"the camera does not see the {before.kind} that '{self.name}' was learned with")
            if moved > SEEN_WITHIN_M:
                raise SkillFailed(
                    f"the camera sees the {before.kind} at ({x:.3f}, {y:.3f}) m moved by {moved:.3f} m "
                    f"since '{self.name}' was learned"
                )
        count, known = (sum(m.kind == "obstacle" and view.holds(m.cell) for m in ms) for ms in (now, self.seen.markers))
        if count > known:
            raise SkillFailed(f"the camera sees {count} obstacles, '{self.name}' was learned with {known}")

    def _check_camera(self, bench: Bench, x: float, y: float) -> None:
        """Compare where the camera sees the gripper with where the grid has it."""
        small = camera_view(self.surveys.task, CHECK_PIXELS, self.surveys.layout)
        picture = overhead_camera(self.surveys.task, CHECK_PIXELS).picture(bench.scene.world)
        try:
            seen = locate(picture, small, "gripper").world_m
        except BadInput as error:
            raise SkillFailed(f"the camera does not see the gripper at ({x:.3f}, {y:.3f}) m: {error}") from None
        self.deviations_m.append(hypot(seen[0] - x, seen[1] - y))
        if self.deviations_m[-1] > SEEN_WITHIN_M:
            raise SkillFailed(f"the camera sees the gripper {self.deviations_m[-1]:.3f} m off its cell")


def _reach(task: Task, obstacle: Obstacle) -> tuple[float, float]:
    """How near along x and y [m] the tool may come to the middle of an obstacle with a slice in its fingers."""
    tall = obstacle.edge_m * obstacle.cubes
    if tall < task.insert.height_m + GRASP_DEPTH - models.SLICE[2] - CLEARANCE_M:
        return (0.0, 0.0)  # the slice passes over it
    across = _GRIPPER_HALF_M if tall > task.insert.height_m - CLEARANCE_M else models.SLICE[1] / 2
    half_cell = task.insert.cell_m / 2  # moves between free cells must not jump over an obstacle
    x, y = (max(half + CLEARANCE_M + obstacle.edge_m / 2, half_cell) for half in (models.SLICE[0] / 2, across))
    return (x, y)
