"""Insert: carry a part through a grid seen by the overhead camera to a machine, and down into its slot (thesis ch. 8)."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from math import hypot
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, grid
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot
from lab.skills.free_way import by_free_cells, look_at
from lab.skills.place import let_go, release_pose
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench, Photo, Skill, learned_path, no_path_error
from lab.skills.state_words import plain
from lab.skills.surveys import SurveyName, Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle
from lab.toolbox.policy import Policy
from lab.vision import Marker, find_markers, locate, see

ACTIONS = ("left", "right", "backward", "forward")  # -x, +x, -y, +y: as the camera's picture shows them
CLEARANCE_M = 0.006  # between a carried part and an obstacle
_GRIPPER_HALF_M = 0.055  # half the gripper's width at the fingers' height, where it is wider than a slice
SEEN_WITHIN_M = 0.008  # largest deviation of the gripper, as the camera sees it, from its cell's middle
CHECK_PIXELS = 320  # width and height of the pictures taken along the path
CORRECTED_M = 0.002  # with `perception = "camera"`, a larger deviation is corrected
STRAYED_M = 0.03  # and one larger than this is a failure
IN_SLOT_M = 0.008
_SLOW = 0.6


class Insert(Skill):
    """Carry the part in the gripper from the grid's start to the machine's slot and release it there."""

    subtask: ClassVar[str] = "insert"
    help: ClassVar[str] = "by the overhead camera's picture to a machine, and down into its slot"
    doing: ClassVar[str] = "puts {part} in by the camera's picture"
    looks_from: ClassVar[tuple[float, float]] = (-84.0, 46.0)
    carries = True

    def __init__(self, task: Task, kind: str, station: str) -> None:
        super().__init__(f"insert{task.called(kind)} at {station}", kind)
        self.station = station
        self._off = (0.0, 0.0)  # [m] correction that is added to each tool target

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> "Insert | None":
        """The skill that inserts the part if the target is entered through a camera's grid, else None."""
        return cls(task, kind, target) if task.station(target).grid is not None else None

    @property
    def needs(self) -> tuple[SurveyName, ...]:
        """The survey of the camera's grid."""
        return (("camera_grid", self.station, self.kind),)

    def setup(self, surveys: Surveys) -> Problem:
        """The problem read from the overhead picture; cells where the part would touch an obstacle are blocked.

        BadInput when start or goal is blocked, or no path leads to the goal.
        """
        self.surveys, self.grid = surveys, surveys.camera_grid(self.station, self.kind)
        self.picture = self.grid.picture()
        machine = surveys.task.station(self.station).pose[:2]
        where = "the overhead camera's picture"
        self.seen = see(self.picture, self.grid.view(), goal_near_m=machine, where=where)
        blocked, names = self._blocked(surveys.task)
        self.blocking = np.array([names.get(cell, "") for cell in np.ndindex(*blocked.shape)]).reshape(blocked.shape)
        rewards = surveys.task.subtask("insert").rewards
        try:
            if blocked[self.seen.goal]:
                raise BadInput(f"{self.name}: the machine's cell is blocked by {names[self.seen.goal]}")
            if blocked[self.seen.start]:
                raise BadInput(f"{self.name}: the start's cell is blocked by {names[self.seen.start]}")
            mdp = grid(blocked.shape, blocked, self.seen.start, self.seen.goal, rewards, ACTIONS)
        except NoPath as error:
            enclosing = {part for cell in error.enclosing for part in names[cell].split(", ")}
            raise no_path_error(self.name, error, sorted(enclosing)) from None
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def _blocked(self, task: Task) -> tuple[NDArray[np.bool_], dict[tuple[int, ...], str]]:
        """The blocked cells, and the causes of each by cell: obstacles that the camera sees, or what the survey found."""
        shape = self.grid.settings.shape
        causes: dict[tuple[int, ...], list[str]] = {cell: [] for cell in np.ndindex(*shape)}
        seen = {self._named(task, marker): marker.world_m for marker in self.seen.markers if marker.kind == "obstacle"}
        for name, place in seen.items():
            reach = self._reach(next(o for o in task.obstacles if o.name == name))
            for cell, names in causes.items():
                middle = self.seen.view.centre((cell[0], cell[1]))
                if all(abs(m - p) < r for m, p, r in zip(middle, place, reach, strict=True)):
                    names.append(name)
        unseen = self.grid.survey(frozenset(seen)).causes
        for cell in zip(*np.nonzero(unseen != ""), strict=True):
            causes[tuple(map(int, cell))].append(str(unseen[cell]))
        blocked = np.zeros(shape, bool)
        for cell, names in causes.items():
            blocked[cell] = bool(names)
        return blocked, {cell: ", ".join(names) for cell, names in causes.items() if names}

    def _reach(self, obstacle: Obstacle) -> tuple[float, float]:
        """The least distance along x and along y [m] from the tool with its part to the middle of an obstacle."""
        length, width, tall = obstacle.size
        high, half = self.grid.settings.height_m, self.own_kind.carried_half_m()
        if tall < high - self.own_kind.grip.up_m - CLEARANCE_M:
            return (0.0, 0.0)  # the part passes over it
        across = max(_GRIPPER_HALF_M, half[1]) if tall > high - CLEARANCE_M else half[1]
        half_cell = self.grid.settings.cell_m / 2  # moves between free cells must not jump over an obstacle
        x, y = (max(h + CLEARANCE_M + edge / 2, half_cell) for h, edge in ((half[0], length), (across, width)))
        return (x, y)

    def _named(self, task: Task, marker: Marker) -> str:
        """The name of the obstacle nearest to a marker."""
        x, y = marker.world_m
        places = zip(task.obstacles, self.surveys.layout.obstacles, strict=True)
        return min(places, key=lambda place: hypot(place[1][0] - x, place[1][1] - y))[0].name

    def photo(self) -> Photo:
        """The overhead picture, and the grid seen in it."""
        return Photo(self.picture, self.seen)

    def begins_at(self) -> ToolPose:
        """The tool pose at the grid's start, where a transfer ends."""
        return ToolPose(*self.grid.settings.start_m, self.grid.settings.height_m, 0.0)

    def pose(self, state: int) -> ToolPose:
        """The tool pose over the middle of the state's cell."""
        i, j = self.problem.mdp.state_cell(state)
        return ToolPose(*self.seen.view.centre((i, j)), self.grid.settings.height_m, 0.0)

    def way_in_words(self) -> tuple[str, str]:
        """The part in the fingers, and the machine's slot."""
        return f"{plain(self.kind).capitalize()} in the fingers is", f"the slot of {plain(self.station)}"

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Follow the learned cells, each checked by the camera, then move above the slot, down, release, and check the part."""
        robot, mdp, body = bench.scene.robot, self.problem.mdp, bench.held
        if body is None:
            raise SkillFailed(f"nothing in the gripper to insert at '{self.station}'")
        self.deviations_m, self._off = [], (0.0, 0.0)
        yield from self._to_start(bench)
        self._same_picture(bench)
        for state in learned_path(policy, mdp, mdp.start):
            pose = self.pose(state)
            yield from robot.follow([pose.shifted(*self._off)])
            self._check_camera(bench, pose.x, pose.y)
            if bench.sight is not None and self.deviations_m[-1] > CORRECTED_M:
                yield from self._corrected(bench, pose)
        spot = self._slot()
        goal = release_pose(bench, body, spot).shifted(*self._off)
        yield from robot.follow([ToolPose(goal.x, goal.y, self.grid.settings.height_m, goal.yaw)], slow=_SLOW)
        yield from robot.follow([goal], slow=_SLOW)
        yield from let_go(bench, self.surveys.exit_path(self.station, goal))
        yield from look_at(bench, self.surveys, self.station, body, spot)
        if not bench.stands(body, spot, IN_SLOT_M):
            raise SkillFailed(f"{body} is not in the slot of '{self.station}'")

    def _slot(self) -> Spot:
        """The slot's position, computed from where the camera saw the machine and the spot's offset from the station."""
        place, seen, spot = self.surveys.task.station(self.station), self.seen.goal_marker.world_m, self.stands_on()
        return replace(spot, x=spot.x + seen[0] - place.pose[0], y=spot.y + seen[1] - place.pose[1])

    def _to_start(self, bench: Bench) -> Iterator[None]:
        """Bring a tool that is not at the grid's start, as before a second attempt, above everything and down to it."""
        start, tool = self.pose(self.problem.mdp.start), bench.scene.robot.tool()
        if hypot(tool.x - start.x, tool.y - start.y, tool.z - start.z) >= self.grid.settings.cell_m:
            yield from by_free_cells(bench, self.surveys, start, self.kind)

    def _same_picture(self, bench: Bench) -> None:
        """Raise SkillFailed unless a new picture shows machine and obstacles where they were in training, and no others.

        A marker that is still in its place is matched to itself first, so it is never taken for one that has moved.
        """
        view = self.grid.view(CHECK_PIXELS)
        now = [*find_markers(self.grid.camera(CHECK_PIXELS).picture(bench.scene.world), view)[0]]
        missing = []
        for before in (marker for marker in self.seen.markers if marker.kind != "gripper"):
            near = min((m for m in now if m.kind == before.kind), key=lambda m: _far(m, before), default=None)
            if near is None or _far(near, before) > SEEN_WITHIN_M:
                missing.append(before)
            else:
                now.remove(near)
        for before in missing:
            what = self.station if before.kind == "toaster" else before.kind
            x, y = before.world_m
            moved = min((_far(m, before) for m in now if m.kind == before.kind), default=None)
            if moved is None:
                raise SkillFailed(
                    f"the camera does not see the {what} at ({x:.3f}, {y:.3f}) m that '{self.name}' was learned with"
                )
            raise SkillFailed(
                f"the camera sees the {what} at ({x:.3f}, {y:.3f}) m moved by {moved:.3f} m "
                f"since '{self.name}' was learned"
            )
        if new := sum(m.kind == "obstacle" and view.holds(m.cell) for m in now):
            known = sum(m.kind == "obstacle" and view.holds(m.cell) for m in self.seen.markers)
            raise SkillFailed(f"the camera sees {known + new} obstacles, '{self.name}' was learned with {known}")

    def _corrected(self, bench: Bench, pose: ToolPose) -> Iterator[None]:
        """Add the deviation that the camera sees to all further targets, move the tool, and check it again. SkillFailed."""
        self._off = (self._off[0] + self._deviation[0], self._off[1] + self._deviation[1])
        yield from bench.scene.robot.follow([pose.shifted(*self._off)], slow=_SLOW)
        self._check_camera(bench, pose.x, pose.y)
        if self.deviations_m[-1] > SEEN_WITHIN_M:
            raise SkillFailed(
                f"the camera sees the gripper {self.deviations_m[-1]:.3f} m off its cell, corrected as it was"
            )

    def _check_camera(self, bench: Bench, x: float, y: float) -> None:
        """Record how far the gripper is off its cell in the camera's picture. SkillFailed when that is too far."""
        seen = self._gripper_seen(bench, x, y)
        self._deviation = (x - seen[0], y - seen[1])
        self.deviations_m.append(hypot(*self._deviation))
        if self.deviations_m[-1] > (SEEN_WITHIN_M if bench.sight is None else STRAYED_M):
            raise SkillFailed(f"the camera sees the gripper {self.deviations_m[-1]:.3f} m off its cell")

    def _gripper_seen(self, bench: Bench, x: float, y: float) -> tuple[float, float]:
        """The gripper's position in the camera's picture [m]; the window around its target is rendered first, to save time."""
        camera, view = self.grid.camera(CHECK_PIXELS), self.grid.view(CHECK_PIXELS)
        window = camera.in_picture(view.window((x, y), "gripper", STRAYED_M))
        with suppress(BadInput):
            return locate(camera.picture(bench.scene.world, window), view.within(window), "gripper").world_m
        try:
            return locate(camera.picture(bench.scene.world), view, "gripper").world_m
        except BadInput as error:
            raise SkillFailed(f"the camera does not see the gripper at ({x:.3f}, {y:.3f}) m: {error}") from None


def _far(one: Marker, other: Marker) -> float:
    """The distance between two markers [m]."""
    return hypot(one.world_m[0] - other.world_m[0], one.world_m[1] - other.world_m[1])
