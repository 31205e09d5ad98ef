"""The operator's motions of the arm: jog, rotate, open, close, home, and grasp the nearest part."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import hypot, radians

from lab.errors import BadInput, WorkFailed, unknown
from lab.production.floor import Floor
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import Spot, comes_as
from lab.skills import Skill
from lab.skills.free_way import by_free_cells
from lab.skills.skill import Status
from lab.skills.surveys import Surveys, way_to

SLOW = 0.5  # share of the arm's speed for motions by hand
FORCE_N = 60.0  # force beyond the present contact force that stops a motion by hand, if the task sets none

Deed = Callable[[], None]  # raises WorkFailed


@dataclass
class ByHand:
    """Motions of the arm by hand on a floor; each is checked (BadInput) and returned as a function that makes it.

    ready: gives a skill the policy that it needs; raises BadInput if there is none.
    """

    floor: Floor
    ready: Callable[[Skill], None]

    def jog(self, way_m: tuple[float, float, float]) -> Deed:
        """Move the tool along the world's axes [m]."""
        return self._to(self.floor.scene.robot.tool().shifted(*way_m))

    def rotate(self, degrees: float) -> Deed:
        """Turn the tool on the spot."""
        return self._to(self.floor.scene.robot.tool().shifted(dyaw=radians(degrees)))

    def move(self, to: str | tuple[float, float, float]) -> Deed:
        """Moves the tool in a straight line to a station's approach, or to a point [m]."""
        robot, task = self.floor.scene.robot, self.floor.scene.task
        if not isinstance(to, str):
            return self._to(ToolPose(*to, robot.tool().yaw))
        places = {name: None for station in task.stations for name in (station.name, way_to(task, station.name))}
        if to not in places:
            raise unknown("station", to, places, "move")
        return self._to(self._surveys.approach(to))

    @property
    def _surveys(self) -> Surveys:
        return next(iter(self.floor.skillset.skills.values())).surveys

    def _to(self, pose: ToolPose) -> Deed:
        robot = self.floor.scene.robot
        if robot.arm.inverse(pose) is None:
            raise BadInput(f"({pose.x:.3f}, {pose.y:.3f}, {pose.z:.3f}) m is out of the arm's reach")
        return lambda: self._follow(robot.follow([pose], slow=SLOW))

    def home(self) -> Deed:
        """Moves the arm home through free cells of the workspace."""
        floor, robot, held = self.floor, self.floor.scene.robot, self.floor.bench.held
        pose = robot.arm.forward(robot.arm.home)
        carried = "" if held is None else comes_as(floor.scene.kind_of[held].part)
        return lambda: self._follow(by_free_cells(floor.bench, self._surveys, pose, carried))

    def open(self) -> Deed:
        """Opens the gripper and releases the held part."""

        def deed() -> None:
            self._follow(self.floor.scene.robot.release())
            self.floor.bench.held = None

        return deed

    def close(self) -> Deed:
        """Closes the gripper, which then holds a part between the fingers."""

        def deed() -> None:
            bench = self.floor.bench
            self._follow(self.floor.scene.robot.grip())
            if bench.held is None:
                bench.held = next((body for body in bench.scene.kind_of if bench.holds(body)), None)

        return deed

    def grasp(self) -> Deed:
        """Takes up the part nearest to the tool, with the learned skill of the station nearest to the part."""
        floor = self.floor
        if (held := floor.bench.held) is not None:
            raise BadInput(f"the robot holds {held}: open first")
        tool = floor.scene.robot.tool()
        near = [
            (self._far_m(part, (tool,)), self._far_m(body, self._spots(station)), skills, part)
            for (kind, station), skills in floor.skillset.picks.items()
            for body, part in self._parts(kind).items()
        ]
        if not near:
            raise BadInput("no part is here that a skill of this task takes up")
        *_, skills, part = min(near, key=lambda candidate: candidate[:2])
        return self._carried_out(skills, part)

    def execute(self, name: str) -> Deed:
        """Carries one skill out, with the named part, or else with the part nearest to the skill's spots."""
        floor = self.floor
        skills, held = floor.skillset.skills, floor.bench.held
        named = next((own for own in sorted(skills, key=len, reverse=True) if f"{name} ".startswith(f"{own} ")), None)
        if named is None:
            raise unknown("skill", name, skills, "execute")
        skill, part = skills[named], name[len(named) :].strip()
        if not skill.moves_arm:
            raise BadInput(f"'{named}' is what a machine does by itself: bring a part there, and it begins")
        parts = self._parts(skill.kind)
        if part and part not in floor.scene.kind_of:
            raise unknown("part", part, floor.scene.kind_of, "execute")
        if part and part not in parts.values():
            raise BadInput(f"'{named}' is not done with {part}: wanted {', '.join(parts.values()) or 'no part'}")
        if skill.carries and held is None:
            raise BadInput(f"'{named}' begins with a part in the gripper: grasp one first")
        if not skill.carries and held is not None:
            raise BadInput(f"'{named}' begins with an empty gripper, and the robot holds {held}: open first")
        if skill.carries and (held not in parts or part not in ("", parts[held])):
            raise BadInput(f"the robot holds {held}: '{named}' carries {part or f'a {skill.kind}'}")
        if not part and parts:
            part = parts[held or min(parts, key=lambda body: self._far_m(body, self._spots(skill.station)))]
        return self._carried_out((skill,), part)

    def _parts(self, kind: str) -> dict[str, str]:
        """The parts that may be carried as a kind, by the body that the gripper then holds; "": no part."""
        scene = self.floor.scene
        made = scene.task.made_as(kind).name if kind else ""
        parts = {scene.body_of(name, kind): name for name, own in scene.kind_of.items() if own.part.name == made}
        return {body: name for body, name in parts.items() if body in scene.kind_of}

    def _spots(self, station: str) -> Sequence[Spot]:
        places = self.floor.scene.places
        return places.spots(places.task.station(station)) if station else ()

    def _far_m(self, body: str, places: Sequence[Spot | ToolPose]) -> float:
        """The distance of a body from the nearest of these places along the table [m]; 0 without places."""
        at = self.floor.bench.part_pose(body)
        return min((hypot(at.x - place.x, at.y - place.y) for place in places), default=0.0)

    # ---- how it is done ----------------------------------------------------------------------------------------------

    def _carried_out(self, skills: tuple[Skill, ...], part: str) -> Deed:
        for skill in skills:
            self.ready(skill)
        return lambda: self._carry_out(skills, part)

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
        """A context in which the present contact force causes no protective stop, so that a stopped arm can be jogged away."""
        _, now_n = self.floor.world.pressed(NAME)
        self.floor.pressing_n = now_n if now_n > self.floor.scene.stops_at_n else 0.0
        try:
            yield
        finally:
            self.floor.pressing_n = 0.0
