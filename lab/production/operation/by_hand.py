"""The arm moved by the operator: jogged, turned, opened, closed, brought home, and told to take up what is near."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import hypot, radians

from lab.errors import BadInput, WorkFailed, unknown
from lab.production.floor import Floor
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import comes_as
from lab.skills import Skill
from lab.skills.free_way import by_free_cells
from lab.skills.skill import Status

SLOW = 0.5  # of the arm's speed, for motions by hand
NEAR_M = 0.2  # from the tool, across the table, a part may be that "grasp" takes up
FORCE_N = (
    60.0  # more than this on top of what it presses on already stops a motion by hand, where the task says nothing
)

Deed = Callable[[], None]  # raises WorkFailed


@dataclass
class ByHand:
    """Motions of the arm on a floor that are no skill's; each is checked first (BadInput), then returned to be done."""

    floor: Floor

    def jog(self, way_m: tuple[float, float, float]) -> Deed:
        """Move the tool along the world's axes [m]."""
        return self._to(self.floor.scene.robot.tool().shifted(*way_m))

    def rotate(self, degrees: float) -> Deed:
        """Turn the tool on the spot."""
        return self._to(self.floor.scene.robot.tool().shifted(dyaw=radians(degrees)))

    def _to(self, pose: ToolPose) -> Deed:
        robot = self.floor.scene.robot
        if robot.arm.inverse(pose) is None:
            raise BadInput(f"({pose.x:.3f}, {pose.y:.3f}, {pose.z:.3f}) m is out of the arm's reach")
        return lambda: self._follow(robot.follow([pose], slow=SLOW))

    def home(self) -> Deed:
        """Bring the arm home, by free cells of the workspace."""
        floor, robot, held = self.floor, self.floor.scene.robot, self.floor.bench.held
        pose = robot.arm.forward(robot.arm.home)
        surveys = next(iter(floor.skillset.skills.values())).surveys
        carried = "" if held is None else comes_as(floor.scene.kind_of[held].part)
        return lambda: self._follow(by_free_cells(floor.bench, surveys, pose, carried))

    def open(self) -> Deed:
        """Open the gripper; what it holds is let go."""

        def deed() -> None:
            self._follow(self.floor.scene.robot.release())
            self.floor.bench.held = None

        return deed

    def close(self) -> Deed:
        """Close the gripper; a part between the fingers is held."""

        def deed() -> None:
            bench = self.floor.bench
            self._follow(self.floor.scene.robot.grip())
            if bench.held is None:
                bench.held = next((body for body in bench.scene.kind_of if bench.holds(body)), None)

        return deed

    def grasp(self) -> Deed:
        """Take up the part nearest to the tool, by the learned skill of the station that it is nearest to."""
        floor = self.floor
        bench, scene = floor.bench, floor.scene
        if bench.held is not None:
            raise BadInput(f"the robot holds {bench.held}: open first")
        tool = scene.robot.tool()

        def off_m(body: str) -> float:
            at = bench.part_pose(body)
            return hypot(at.x - tool.x, at.y - tool.y)

        body = min(scene.kind_of, key=off_m, default=None)
        if body is None or off_m(body) > NEAR_M:
            nearest = "" if body is None else f": the nearest, {body}, is {100 * off_m(body):.0f} cm away"
            raise BadInput(f"no part within {100 * NEAR_M:.0f} cm of the gripper{nearest}")
        at, kind = bench.part_pose(body), scene.kind_of[body].name
        picks = {station: skills for (own, station), skills in floor.skillset.picks.items() if own == kind}
        if not picks:
            raise BadInput(f"no skill of this task takes up {body}, a {kind}")

        def far_m(station: str) -> float:
            return min(hypot(at.x - s.x, at.y - s.y) for s in scene.places.spots(scene.task.station(station)))

        skills = picks[min(picks, key=far_m)]
        self._check_taught(skills)
        return lambda: self._carry_out(skills, body)

    def execute(self, name: str) -> Deed:
        """Carry one skill out, with a part where one is named after it."""
        floor = self.floor
        skills = floor.skillset.skills
        found = next((own for own in sorted(skills, key=len, reverse=True) if f"{name} ".startswith(f"{own} ")), None)
        if found is None:
            raise unknown("skill", name, skills, "execute")
        skill, part = skills[found], name[len(found) :].strip()
        if not skill.moves_arm:
            raise BadInput(f"'{found}' is what a machine does by itself: bring a part there, and it begins")
        bodies, held = floor.scene.kind_of, floor.bench.held
        if part and part not in bodies:
            raise unknown("part", part, bodies, "execute")
        if skill.carries and held is None:
            raise BadInput(f"'{found}' begins with a part in the gripper: grasp one first")
        if not skill.carries and held is not None:
            raise BadInput(f"'{found}' begins with an empty gripper, and the robot holds {held}: open first")
        if skill.carries and part not in ("", held):
            raise BadInput(f"the robot holds {held}, not {part}")
        self._check_taught((skill,))
        if not part:
            part = held or next((body for body in bodies if bodies[body].name == skill.kind), "")
        return lambda: self._carry_out((skill,), part)

    # ---- how it is done ----------------------------------------------------------------------------------------------

    def _check_taught(self, skills: tuple[Skill, ...]) -> None:
        for skill in skills:
            if skill.name not in self.floor.skillset.policies:
                raise BadInput(f"'{skill.name}' is not learned yet: policy, or learn {skill.name}")

    def _carry_out(self, skills: tuple[Skill, ...], part: str) -> None:
        floor = self.floor
        for skill in skills:
            begin = skill.begins_at()
            if skill.carries and begin is not None:
                self._follow(by_free_cells(floor.bench, skill.surveys, begin, skill.kind))
            with self._careful():
                done = floor.run(skill.aim(part)) is Status.SUCCESS
            if floor.bench.held is not None:
                floor.take_out(floor.bench.held)
            if not done:
                raise WorkFailed(f"'{skill.name}' failed: {skill.reason}")

    def _follow(self, motion: Iterator[None]) -> None:
        with self._careful():
            why = self.floor.follow(motion)
        if why:
            raise WorkFailed(why)

    @contextmanager
    def _careful(self) -> Iterator[None]:
        """What the arm presses on already, where a protective stop held it, is no new one: it may be jogged away."""
        _, now_n = self.floor.world.pressed(NAME)
        self.floor.pressing_n = now_n if now_n > self.floor.scene.stops_at_n else 0.0
        try:
            yield
        finally:
            self.floor.pressing_n = 0.0
