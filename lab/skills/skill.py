"""What all skills share: one life, from what a task needs of them to what they show, and the bench they work at."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import atan2, degrees, hypot
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed
from lab.learning.problem import Problem
from lab.mdp import NoPath, TabularMDP, greedy_path
from lab.sim.arms.kinematics import ToolPose
from lab.sim.frames import Body
from lab.sim.parts.kinds import Kind, Spot, on_its_pallet
from lab.sim.scene.blocked_cells import FINGERS_OFF_M
from lab.sim.scene.scene import Scene, pallet_of
from lab.skills.sight import Sight, SkillFailed
from lab.tasks.task import Task
from lab.tasks.task_fields import Stage
from lab.vision import GridView

if TYPE_CHECKING:
    from lab.skills.surveys import SurveyName, Surveys
    from lab.toolbox.policy import Policy


BESIDE = {
    "left": "left of",
    "right": "right of",
    "backward": "in front of",
    "forward": "behind",
    "down": "below",
    "up": "above",
    "lower": "below",
    "higher": "above",
    "in": "inside",
    "out": "out from",
}  # what a move is called -> where it leads to
TURN = "turn "  # a move about the vertical; its step is an angle


def size_in_words(label: str, step: float) -> str:
    """How far a move goes: "1.2 cm" for a step in metres, "3 degrees" for a turn's in radians."""
    if label.startswith(TURN):
        return f"{degrees(step):.0f} degrees"
    return f"{100.0 * step:.1f}".removesuffix(".0") + " cm"


def away_in_words(what: str, goal: str, by: Sequence[int], labels: Sequence[str], steps: Sequence[float]) -> str:
    """ "The fingers are 2.4 cm left of and 3 cm above the slice, turned 3 degrees to the left."

    what: with its verb; by: cells from the goal along each axis; labels: the moves down and up each axis, one axis after the
    other; steps: [m], of a turn [rad].
    """
    places, turned = list[str](), ""
    for axis, cells in enumerate(by):
        label = labels[2 * axis + (cells > 0)]
        if not cells:
            continue
        size = size_in_words(label, abs(cells) * steps[axis])
        if label.startswith(TURN):
            turned = f", turned {size} to the {label.removeprefix(TURN)}"
        else:
            places.append(f"{size} {BESIDE.get(label, label)}")
    joined = f"{', '.join(places[:-1])} and {places[-1]}" if len(places) > 1 else "".join(places)
    return f"{what} {joined or 'at'} {goal}{turned}."


def plain(name: str) -> str:
    """A station's or a kind's name as it is read aloud."""
    return f"the {name.replace('_', ' ')}"


# ---- skill ------------------------------------------------------------------------------------------------------------


LOST_M = 0.03  # [m] a part farther than this from where the fingers hold it is not held
UPRIGHT = 0.97  # cosine of the largest tilt of a part that stands
SETTLE_STEPS = 60  # physics steps until a new scene is at rest
STAND_STEPS = 15  # physics steps until what was put somewhere at once is at rest
NOT_OFF = (0.0, 0.0, 0.0)  # of a part that stands on its spot


class Status(Enum):
    """Where a skill is in its life."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"


@dataclass
class Bench:
    """The cell in which skills are carried out, and the body that the robot holds: a part, or a pallet."""

    scene: Scene
    held: str | None = None
    sight: Sight | None = None  # what was seen by the camera in the hand, where the task says so

    def __post_init__(self) -> None:
        if self.scene.task.perception == "camera":
            self.sight = Sight(self.scene)

    def part_pose(self, body: str, like: float = 0.0) -> ToolPose:
        """The tool pose that would hold a part where it is, as far as is known; of its yaws the nearest to `like` [rad].

        Known is, with the camera, where it was seen or set down last; WorkFailed for a part that was never seen.
        """
        return self.true_pose(body, like) if self.sight is None else self.sight.pose(body, like, self.held)

    def true_pose(self, body: str, like: float = 0.0) -> ToolPose:
        """The pose of `part_pose` as the simulator knows it, whatever a camera sees."""
        position, turn = self.scene.world.pose(body)
        kind = self.scene.kind_of[body]
        yaw = 2.0 * atan2(float(turn[2]), float(turn[3]))
        spot = Spot(float(position[0]), float(position[1]), float(position[2]) - kind.shape.foot_m, yaw)
        pose = kind.held_at(spot)
        return replace(pose, yaw=kind.turned_like(pose.yaw, like))

    def hold(self, name: str, kind: str, pose: ToolPose) -> None:
        """Stand a new part between the fingers of the tool that is at `pose`, and grip it."""
        scene = self.scene
        own = scene.kinds[kind]
        scene.robot.open_at_once(own.grip.width_m / 2 + FINGERS_OFF_M)
        scene.add(name, kind, own.foot_at(pose))
        for _ in scene.robot.grip(scene.grips_n[kind]):
            scene.world.step()
        self.held = scene.body_of(name, kind)

    def upright(self, body: str) -> float:
        """Cosine of a part's tilt: 1 when it stands."""
        x, y, _, _ = self.scene.world.pose(body)[1]
        return float(1.0 - 2.0 * (x * x + y * y))

    def holds(self, body: str) -> bool:
        """Whether the fingers touch the part on both sides and it is where they hold it."""
        tool = self.scene.robot.tool()
        at = self.part_pose(body, tool.yaw)
        near = hypot(tool.x - at.x, tool.y - at.y, tool.z - at.z) < LOST_M
        return near and self.scene.robot.touches(body)

    def fallen_off(self, name: str, kind: str) -> str:
        """Which body of part `name` does not stand on what it is carried on, as when a pallet was jolted; "": none."""
        below, *riders = self.scene.bodies_of(name, kind)
        for body in riders:
            at, under = self.true_pose(body), self.true_pose(below)
            if self.upright(body) < UPRIGHT or hypot(at.x - under.x, at.y - under.y) > LOST_M or at.z < under.z:
                return body
            below = body
        return ""

    def stands(self, body: str, spot: Spot, within: float, *, truly: bool = False) -> bool:
        """Whether the part stands upright within `within` [m] of a spot, as far as is known, or truly.

        What the camera has found by its outline stands upright: a part that lies has another one.
        """
        foot = self.scene.kind_of[body].held_at(spot)
        at = self.true_pose(body, foot.yaw) if truly else self.part_pose(body, foot.yaw)
        near = hypot(at.x - foot.x, at.y - foot.y) < within and abs(at.z - foot.z) < 0.006
        return near and (self.upright(body) > UPRIGHT or not (truly or self.sight is None))


@dataclass(frozen=True, eq=False)
class Photo:
    """The picture (H, W, 3) that a problem was read from, RGB uint8, and the grid that was seen in it."""

    picture: NDArray[np.uint8]
    seen: GridView


class Skill:
    """One sub-task at one place, with all of its life; a new one is a class of these in a file, and a row in `SKILLS`.

    What a task needs of it (`at_pick` to `at_service`), the survey of its problem (`setup`), what it is about (`aim`), its
    motion (`start`, `step`, `stop`), what it shows (`show` to `photo`), and how it is tried in physics (`begins_at`).
    """

    subtask: ClassVar[str]
    help: ClassVar[str]  # what is learned, in one line of plain words
    doing: ClassVar[str]  # what the robot does meanwhile, in words; "{part}" is what it does it with
    moves_arm: ClassVar[bool] = True  # a machine's process does not
    tried: ClassVar[bool] = False  # whether a lesson ends with a trial in physics
    looks_from: ClassVar[tuple[float, float]] = (-72.0, 36.0)  # [deg] the camera of a lesson, azimuth and elevation
    near: ClassVar[bool] = False  # whether all takes place around its station's first spot; looks_from is then its own

    station = ""  # where it takes place, if it is at one
    carries = False  # whether a part is in the gripper meanwhile
    surveys: "Surveys"  # once it is set up
    problem: Problem

    def __init__(self, name: str, kind: str = "") -> None:
        """kind: of the part that it is about, or the one that it carries; "": none."""
        self.name, self.kind = name, kind
        self.part = ""  # the one part that it is about, once it is aimed
        self.spot: Spot | None = None
        self.deviations_m: list[float] = []  # how far off a camera has seen the gripper
        self.status = Status.IDLE
        self.reason = ""
        self._motion: Iterator[None] | None = None

    # ---- what a task needs of it: None where it has no part ------------------------------------------------------

    @classmethod
    def at_pick(cls, task: Task, kind: str, station: str) -> "Skill | None":
        """The skill that takes a part of a kind up from a station."""
        return None

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> "Skill | None":
        """The skill's share in bringing a part that is in the gripper from one station to another, and setting it down."""
        return None

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Skill | None":
        """The skill's share in taking the empty gripper from one station to another."""
        return None

    @classmethod
    def at_machine(cls, task: Task, station: str) -> "Skill | None":
        """What a machine does by itself with the part that stands in it."""
        return None

    @classmethod
    def at_service(cls, task: Task, stage: Stage) -> "Skill | None":
        """What the robot does at a stage of a route before it takes the part out."""
        return None

    # ---- survey and aim ------------------------------------------------------------------------------------------

    @property
    def needs(self) -> "tuple[SurveyName, ...]":
        """The surveys that its set-up needs, which can be made beside others; all after the first build on the first."""
        return ()

    def setup(self, surveys: "Surveys") -> Problem:
        """Survey the scene and state the problem to learn. BadInput when it has no solution, naming what is in the way."""
        raise NotImplementedError

    def aim(self, name: str, spot: Spot | None = None) -> Self:
        """The same skill, told which part it is about, and on which spot to set it down, by default the station's first."""
        self.part, self.spot = name, spot
        return self

    @property
    def own_kind(self) -> Kind:
        """The kind that it is about, as physics has it, once it is set up."""
        return self.surveys.kinds[self.kind]

    def stands_on(self) -> Spot:
        """Where the part that it is about stands at its station, or is to be set down: on a spot, or on the pallet there."""
        places, station = self.surveys.places, self.surveys.task.station(self.station)
        spot = self.spot if self.carries else None
        return places.raised(self.kind, station, spot or places.spots(station, self.kind)[0])

    def pose(self, state: int) -> ToolPose:
        """The tool pose that the motion goes through in a state of the problem; a blocked one may be out of reach."""
        raise NotImplementedError

    # ---- what it shows -------------------------------------------------------------------------------------------

    def in_words(self, state: int) -> str:
        """Where the tool is in a state of the problem, seen from the goal, for somebody who knows no table."""
        mdp = self.problem.mdp
        if len(mdp.action_labels) != 2 * len(mdp.shape):
            return f"{self.way_in_words()[0]} in state {mdp.state_label(state)}."
        goal = mdp.state_cell(int(np.flatnonzero(mdp.goal)[0]))
        by = [here - there for here, there in zip(mdp.state_cell(state), goal, strict=True)]
        return away_in_words(*self.way_in_words(), by, mdp.action_labels, self.cell_steps())

    def way_in_words(self) -> tuple[str, str]:
        """What moves, with its verb, and to where: "The open fingers are", "where they close on the slice"."""
        return "The tool is", "its goal"

    def cell_steps(self) -> tuple[float, ...]:
        """How far a cell is from the next along each axis of the problem's grid [m], about the vertical [rad]."""
        shape = self.problem.mdp.shape
        cells = [(0,) * len(shape), *np.eye(len(shape), dtype=int)]
        first, *others = (self.pose(int(np.ravel_multi_index(cell, shape, mode="clip"))) for cell in cells)
        return tuple(hypot(p.x - first.x, p.y - first.y, p.z - first.z) or abs(p.yaw - first.yaw) for p in others)

    def moves_in_words(self) -> tuple[str, ...]:
        """How far each action goes, such as "1.2 cm"."""
        labels = self.problem.mdp.action_labels
        if len(labels) != 2 * len(self.problem.mdp.shape):
            return ("",) * len(labels)
        steps = self.cell_steps()
        return tuple(size_in_words(label, steps[action // 2]) for action, label in enumerate(labels))

    def show(self, bench: Bench, state: int) -> bool:
        """Put the bench into a state at once, without physics; False, and nothing moves, when the arm cannot reach it."""
        pose = self.pose(state)
        if not bench.scene.robot.stand(pose):
            return False
        if bench.held is not None:
            bench.scene.put(self.part, self.kind, pose)
        return True

    def does(self, name: str) -> str:
        """What the robot does now with part `name`, in words for people."""
        return f"{self.doing.format(part=name)} at '{self.station}'"

    def on_part(self, name: str, kind: Kind) -> tuple[Body, ...]:
        """What this skill may make to be seen on a part."""
        return ()

    def shown(self) -> list[str]:
        """The names of what is to be seen on its part now."""
        return []

    def shown_in(self, state: int, name: str) -> dict[str, bool]:
        """What is to be seen on a part in a state of the problem, and what is not, by name."""
        return {}

    def photo(self) -> Photo | None:
        """The picture that its problem was read from, once it is set up; None: it was surveyed without one."""
        return None

    # ---- how it is tried, and its motion ---------------------------------------------------------------------------

    def begins_at(self) -> ToolPose | None:
        """Where the tool is when the skill begins; None: anywhere."""
        return None

    def begin(self, bench: Bench, off: Sequence[float] = NOT_OFF) -> None:
        """Put all at once to where the set-up skill begins, to try it: the arm, and a part on its spot or in the gripper.

        off: how far off its spot the part stands, x, y [m] and yaw [rad].
        """
        scene, pose, name = bench.scene, self.begins_at(), self.tried_with()
        self.aim(name)
        self.furnish(bench)
        if self.near and not self.carries:
            scene.add(name, self.kind, self.stands_on(), off)
        if pose is not None:
            scene.robot.stand(pose)
            if self.carries:
                bench.hold(name, self.kind, pose)
            else:
                scene.robot.open_at_once()
        for _ in range(STAND_STEPS):
            scene.world.step()

    def furnish(self, bench: Bench) -> None:
        """Put there what its part stands on, or is to be set down on: other parts in a layer, its pallet where it has one."""
        task, name, places = self.surveys.task, self.tried_with(), self.surveys.places
        if self.station and self.kind and self.near:
            station = task.station(self.station)
            stand_below(bench.scene, self.station, places.below(station, places.spots(station, self.kind)[0]))
        if self.station and self.kind and on_its_pallet(task, self.kind, self.station):
            pallet, spot = (
                task.part(self.kind).pallet,
                self.surveys.places.spots(task.station(self.station), self.kind)[0],
            )
            if pallet_of(name) not in bench.scene.kind_of:
                bench.scene.add(name, str(pallet), spot)

    def tried_with(self) -> str:
        """What the part is called with which the skill is tried; "": there is none."""
        return self.kind and f"{self.surveys.task.made_as(self.kind).name} 1"

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Carry the policy out: each `next` sets what one physics step needs; raises SkillFailed."""
        raise NotImplementedError

    def start(self, bench: Bench, policy: "Policy") -> None:
        """Begin to carry `policy` out from the state the bench is in."""
        self._motion = self.motion(bench, policy)
        self.status, self.reason = Status.RUNNING, ""

    def step(self) -> Status:
        """Set what the next physics step needs; the caller then steps the world."""
        if self.status is not Status.RUNNING or self._motion is None:
            return self.status
        try:
            next(self._motion)
        except StopIteration:
            self._motion, self.status = None, Status.SUCCESS
        except (SkillFailed, WorkFailed) as failure:
            self.fail(str(failure))
        return self.status

    def fail(self, reason: str) -> None:
        """End without success."""
        self._motion, self.status, self.reason = None, Status.FAILURE, reason

    def stop(self) -> None:
        """Break off; the skill can be started again."""
        self._motion, self.status = None, Status.IDLE


def stand_below(scene: Scene, station: str, below: Sequence[tuple[str, Spot]]) -> None:
    """Stand parts in a scene, kinds and spots, that carry others at a station; those that are there already stay."""
    for kind, spot in below:
        name = f"{kind} below at {spot.x:.3f} {spot.y:.3f} {spot.z:.3f} {station}"
        if name not in scene.kind_of:
            scene.add(name, kind, spot)


def learned_path(policy: "Policy", mdp: TabularMDP, start: int) -> list[int]:
    """The states that the policy's greedy actions visit from `start` to the goal; SkillFailed when they do not reach it."""
    if mdp.goal[start]:
        return [start]
    states, _, reached = greedy_path(policy.q, mdp, mdp.n_states, start)
    if not reached:
        raise SkillFailed(f"policy '{policy.name}' does not reach its goal from {mdp.state_label(start)}")
    return states


def no_way(what: str, error: NoPath, names: Sequence[str]) -> BadInput:
    """The error for a goal that no path reaches: says what encloses it."""
    return BadInput(
        f"{what}: no path reaches the goal; the {error.around} is enclosed by: {', '.join(names) or 'the border'}"
    )
