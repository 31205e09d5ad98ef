"""Insert: by the overhead camera's picture through the 12 x 12 grid to the toaster, and down into its slot (thesis ch. 8)."""

from collections.abc import Iterator
from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.mdp import NoPath, grid
from lab.sim import assets
from lab.sim.kinematics import ToolPose
from lab.sim.scene import GRASP_DEPTH, Spot, spots
from lab.skills.place import let_go, release_pose
from lab.skills.skill import Bench, Problem, Skill, SkillFailed, learned_path, no_way
from lab.skills.surveys import Surveys, camera_view, overhead_camera
from lab.taskfile import Task
from lab.vision import find_markers, locate, see

if TYPE_CHECKING:
    from lab.policy import Policy

ACTIONS = ("left", "right", "backward", "forward")  # -x, +x, -y, +y: as the camera's picture shows them
CLEARANCE_M = 0.006  # between a carried slice and a cube in its way
SEEN_WITHIN_M = 0.008  # the camera must see the gripper this near to where the grid says it is
CHECK_PIXELS = 320  # a side of the pictures taken on the way
IN_SLOT_M = 0.008
_SLOW = 0.6


class Insert(Skill):
    """Carry the slice in the gripper from the grid's start to the toaster's slot and let it go there."""

    subtask: ClassVar[str] = "insert"

    def __init__(self, station: str) -> None:
        super().__init__(f"insert at {station}")
        self.station = station
        self.deviations_m: list[float] = []

    def setup(self, surveys: Surveys) -> Problem:
        """Take the overhead picture, find the markers, and block the cells in which the slice would meet a cube."""
        self.surveys = surveys
        self.picture = surveys.picture()
        self.seen = see(self.picture, camera_view(surveys.task), where="the overhead camera's picture")
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
        """Cells whose middle is so near to a seen cube that the carried slice would touch it, and which cubes those are."""
        view = self.seen.view
        half = (assets.SLICE[0] / 2 + CLEARANCE_M, assets.SLICE[1] / 2 + CLEARANCE_M)
        blocked = np.zeros(task.insert.shape, bool)
        names: dict[tuple[int, ...], str] = {}
        places = dict(zip((o.name for o in task.obstacles), self.surveys.layout.obstacles, strict=True))
        for marker in self.seen.markers:
            if marker.kind != "obstacle":
                continue
            name = min(places, key=lambda n: hypot(places[n][0] - marker.world_m[0], places[n][1] - marker.world_m[1]))
            obstacle = next(o for o in task.obstacles if o.name == name)
            low = task.insert.height_m + GRASP_DEPTH - assets.SLICE[2] - CLEARANCE_M
            tall = obstacle.edge_m * obstacle.cubes
            if tall < low:
                continue
            reach = [h + obstacle.edge_m / 2 for h in half]
            if tall > task.insert.height_m - CLEARANCE_M:  # as high as the fingers: the gripper is wider than the slice
                reach[1] = _GRIPPER_HALF_M + CLEARANCE_M + obstacle.edge_m / 2
            for cell in np.ndindex(*task.insert.shape):
                x, y = view.centre((cell[0], cell[1]))
                if abs(x - marker.world_m[0]) < reach[0] and abs(y - marker.world_m[1]) < reach[1]:
                    blocked[cell] = True
                    names[cell] = ", ".join(filter(None, (names.get(cell), name)))
        return blocked, names

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Cell by cell, each time seen by the camera; then above the slot, down, let go, and see that the slice is in it."""
        task, robot, mdp, name = self.surveys.task, bench.scene.robot, self.problem.mdp, bench.held
        if name is None:
            raise SkillFailed(f"nothing in the gripper to insert at '{self.station}'")
        self.deviations_m = []
        yield from self._to_start(bench)
        self._same_picture(bench)
        for state in learned_path(policy, mdp, mdp.start):
            x, y = self.seen.view.centre((mdp.state_cell(state)[0], mdp.state_cell(state)[1]))
            yield from robot.follow([ToolPose(x, y, task.insert.height_m, 0.0)])
            self._check_camera(bench, x, y)
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
        task, tool = self.surveys.task, bench.scene.robot.tool()
        x, y = self.seen.view.centre(self.seen.start)
        if hypot(tool.x - x, tool.y - y, tool.z - task.insert.height_m) < task.insert.cell_m:
            return
        grid = task.workspace
        over = grid.lower_m[2] + (grid.shape[2] - 0.5) * grid.cell_m[2]
        poses = [ToolPose(tool.x, tool.y, over, 0.0), ToolPose(x, y, over), ToolPose(x, y, task.insert.height_m)]
        for pose in poses:
            yield from bench.scene.robot.follow([pose])

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
        small = camera_view(self.surveys.task, CHECK_PIXELS)
        picture = overhead_camera(self.surveys.task, CHECK_PIXELS).picture(bench.scene.world)
        try:
            seen = locate(picture, small, "gripper").world_m
        except BadInput as error:
            raise SkillFailed(f"the camera does not see the gripper at ({x:.3f}, {y:.3f}) m: {error}") from None
        self.deviations_m.append(hypot(seen[0] - x, seen[1] - y))
        if self.deviations_m[-1] > SEEN_WITHIN_M:
            raise SkillFailed(f"the camera sees the gripper {self.deviations_m[-1]:.3f} m off its cell")


_GRIPPER_HALF_M = 0.055
