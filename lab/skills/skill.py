"""The base of all skills: `Skill` with its life cycle, and the `Bench` at which it is carried out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import atan2, hypot
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
from lab.skills.state_words import away_in_words, size_in_words
from lab.tasks.task import Task
from lab.tasks.task_fields import Stage
from lab.toolbox.policy import Policy
from lab.vision import GridView

if TYPE_CHECKING:
    from lab.skills.surveys import SurveyName, Surveys

LOST_M = 0.03  # [m] largest distance of a held part from its place between the fingers
UPRIGHT = 0.97  # cosine of the largest tilt of a part that counts as standing
SETTLE_STEPS = 60  # physics steps until a new scene is at rest
STAND_STEPS = 15  # physics steps until bodies that were moved without physics are at rest
NOT_OFF = (0.0, 0.0, 0.0)  # displacement of a part that stands exactly on its spot


class Status(Enum):
    """The state of a skill's execution."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"


@dataclass
class Bench:
    """The scene in which skills are carried out, and the body (part or pallet) that the robot holds."""

    scene: Scene
    held: str | None = None
    sight: Sight | None = None  # positions from the camera in the hand, in tasks that use it

    def __post_init__(self) -> None:
        if self.scene.task.perception == "camera":
            self.sight = Sight(self.scene)

    def part_pose(self, body: str, like: float = 0.0) -> ToolPose:
        """The tool pose that would hold a part at its known place; its yaw is the one closest to `like` [rad].

        With a camera, the known place is where the part was last seen or set down; otherwise it is the simulator's.
        Raises WorkFailed for a part that the camera has never seen.
        """
        return self.true_pose(body, like) if self.sight is None else self.sight.pose(body, like, self.held)

    def true_pose(self, body: str, like: float = 0.0) -> ToolPose:
        """The pose of `part_pose` from the simulator's state, independent of any camera."""
        position, turn = self.scene.world.pose(body)
        kind = self.scene.kind_of[body]
        yaw = 2.0 * atan2(float(turn[2]), float(turn[3]))
        spot = Spot(float(position[0]), float(position[1]), float(position[2]) - kind.shape.foot_m, yaw)
        pose = kind.held_at(spot)
        return replace(pose, yaw=kind.turned_like(pose.yaw, like))

    def hold(self, name: str, kind: str, pose: ToolPose) -> None:
        """Put a new part between the fingers of the tool at `pose`, and grip it."""
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
        """Whether both fingers touch the part and it is within LOST_M of its place between them."""
        tool = self.scene.robot.tool()
        at = self.part_pose(body, tool.yaw)
        near = hypot(tool.x - at.x, tool.y - at.y, tool.z - at.z) < LOST_M
        return near and self.scene.robot.touches(body)

    def fallen_off(self, name: str, kind: str) -> str:
        """The body of part `name` that has left the body it is carried on, as after a jolt; "" for none."""
        below, *riders = self.scene.bodies_of(name, kind)
        for body in riders:
            at, under = self.true_pose(body), self.true_pose(below)
            if self.upright(body) < UPRIGHT or hypot(at.x - under.x, at.y - under.y) > LOST_M or at.z < under.z:
                return body
            below = body
        return ""

    def stands(self, body: str, spot: Spot, within: float, *, truly: bool = False) -> bool:
        """Whether the part stands upright within `within` [m] of a spot, by its known pose or, `truly`, the simulator's.

        A part that the camera found by its outline is upright: a part that lies on its side has another outline.
        """
        foot = self.scene.kind_of[body].held_at(spot)
        at = self.true_pose(body, foot.yaw) if truly else self.part_pose(body, foot.yaw)
        near = hypot(at.x - foot.x, at.y - foot.y) < within and abs(at.z - foot.z) < 0.006
        return near and (self.upright(body) > UPRIGHT or not (truly or self.sight is None))


@dataclass(frozen=True, eq=False)
class Photo:
    """The picture (H, W, 3), RGB uint8, from which a problem was read, and the grid seen in it."""

    picture: NDArray[np.uint8]
    seen: GridView


class Skill:
    """The base class of skills: one sub-task at one place, with its life cycle.

    The life cycle: which skills a task needs (`at_pick` to `at_service`), the survey of the problem (`setup`), the part
    (`aim`), the motion (`start`, `step`, `stop`), what people see (`show` to `photo`), the trial in physics (`begins_at`).
    A subclass defines `subtask`, `help` and `doing`, at least one of `at_pick` to `at_service`, `setup` and `motion`, and
    `pose` if the arm moves. A skill like one that ships is shorter as a subclass of `Grasp`, `Transfer`, `PlacePart`,
    `Insert` or `Cover`. An entry point in the group `teaching_lab.skills` adds it, under the name `subtask`.

    name: of the skill, unique in a task; kind: of the part that it handles or carries, "" for none.
    subtask: the name of the family of problems; help: what is learned, in one line; doing: what the robot does meanwhile, a
    predicate in which "{part}" stands for the part's name. Class attributes.
    moves_arm: False for a machine's process; tried: whether a lesson ends with a trial in physics; near: whether it stays around
    its station's first spot. Class attributes.
    station: where it takes place, if anywhere; carries: whether the gripper holds a part meanwhile.
    surveys, problem: what `setup` was given and what it returned; it has to keep both.

        >>> import lab
        >>> from lab.skills import Skill
        >>> class Dial(Skill):
        ...     '''The toaster finds the setting of its dial.'''
        ...     subtask, help, doing = "dial", "a machine finds the setting of its dial", "waits for {part}"
        ...     moves_arm = False
        ...     @classmethod
        ...     def at_machine(cls, task, station):
        ...         return cls(f"dial of {station}") if station == "toaster" else None
        ...     def setup(self, surveys):
        ...         board = lab.grid((5,), [0] * 5, (0,), (3,), None, ("less", "more"))
        ...         self.surveys, self.problem = surveys, lab.Problem(self.name, self.subtask, board)
        ...         return self.problem
        ...     def motion(self, bench, policy):
        ...         for _ in range(240):  # a second
        ...             yield
        >>> from lab.testing import check_skill
        >>> check_skill(Dial)
    """

    subtask: ClassVar[str]
    help: ClassVar[str]  # what is learned, in one line
    doing: ClassVar[str]  # what the robot does meanwhile, as a predicate; "{part}" stands for the part's name
    moves_arm: ClassVar[bool] = True  # False for a machine's process
    tried: ClassVar[bool] = False  # whether a lesson ends with a trial in physics
    looks_from: ClassVar[tuple[float, float]] = (-72.0, 36.0)  # [deg] azimuth and elevation of the camera in a lesson
    near: ClassVar[bool] = False  # whether the skill stays around its station's first spot, as grasp and place do

    station = ""  # the station at which it takes place, if any
    blocking: NDArray[np.str_] | None = None  # the causes of each blocked cell of the problem's grid, "" for a free one
    carries = False  # whether the gripper holds a part meanwhile
    surveys: "Surveys"  # set by `setup`
    problem: Problem

    def __init__(self, name: str, kind: str = "") -> None:
        """kind: of the part that the skill handles or carries; "": none."""
        self.name, self.kind = name, kind
        self.part = ""  # the name of the part that it handles, set by `aim`
        self.spot: Spot | None = None
        self.deviations_m: list[float] = []  # deviations of the gripper from its target that a camera has seen
        self.status = Status.IDLE
        self.reason = ""
        self._motion: Iterator[None] | None = None

    # ---- which skills a task needs: None where this skill has no share ----------------------------------------------

    @classmethod
    def at_pick(cls, task: Task, kind: str, station: str) -> "Skill | None":
        """The skill that takes a part of a kind from a station."""
        return None

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> "Skill | None":
        """The skill's share in carrying a part in the gripper from one station to another and setting it down."""
        return None

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Skill | None":
        """The skill's share in moving the empty gripper from one station to another."""
        return None

    @classmethod
    def at_machine(cls, task: Task, station: str) -> "Skill | None":
        """The skill that a machine carries out itself on the part that stands in it."""
        return None

    @classmethod
    def at_service(cls, task: Task, stage: Stage) -> "Skill | None":
        """The skill that the robot carries out at a stage of a route before it takes the part out."""
        return None

    # ---- the problem, and the part that it is about ------------------------------------------------------------------

    @property
    def needs(self) -> "tuple[SurveyName, ...]":
        """The surveys that `setup` needs, which workers can make in parallel; those after the first build on the first."""
        return ()

    def setup(self, surveys: "Surveys") -> Problem:
        """The problem to learn, from a survey of the scene: `surveys.task`, its kinds of parts, their places, free cells.

        Raises BadInput, which names what blocks it, if it has no solution. The same scene gives the same problem.
        """
        raise NotImplementedError

    def aim(self, name: str, spot: Spot | None = None) -> Self:
        """The skill itself, after setting its part and the spot to set it down on (by default the station's first)."""
        self.part, self.spot = name, spot
        return self

    @property
    def own_kind(self) -> Kind:
        """The kind of its part in the simulated scene; available after `setup`."""
        return self.surveys.kinds[self.kind]

    def stands_on(self) -> Spot:
        """The spot, or the place on a pallet there, at which its part stands or is to be set down."""
        places, station = self.surveys.places, self.surveys.task.station(self.station)
        spot = self.spot if self.carries else None
        return places.raised(self.kind, station, spot or places.spots(station, self.kind)[0])

    def pose(self, state: int) -> ToolPose:
        """The tool pose of a state of the problem; that of a blocked state may be out of reach."""
        raise NotImplementedError

    # ---- what people read and see ------------------------------------------------------------------------------------

    def in_words(self, state: int) -> str:
        """The tool's position relative to the goal in a state, as a sentence for people who do not read tables."""
        mdp = self.problem.mdp
        if len(mdp.action_labels) != 2 * len(mdp.shape):
            return f"{self.way_in_words()[0]} in state {mdp.state_label(state)}."
        goal = mdp.state_cell(int(np.flatnonzero(mdp.goal)[0]))
        by = [here - there for here, there in zip(mdp.state_cell(state), goal, strict=True)]
        return away_in_words(*self.way_in_words(), by, mdp.action_labels, self.cell_steps())

    def way_in_words(self) -> tuple[str, str]:
        """The subject that moves, with its verb, and its aim: "The open fingers are", "where they close on the slice"."""
        return "The tool is", "its goal"

    def cell_steps(self) -> tuple[float, ...]:
        """The size of a cell along each axis of the problem's grid [m], about the vertical [rad]."""
        shape = self.problem.mdp.shape
        cells = [(0,) * len(shape), *np.eye(len(shape), dtype=int)]
        first, *others = (self.pose(int(np.ravel_multi_index(cell, shape, mode="clip"))) for cell in cells)
        return tuple(hypot(p.x - first.x, p.y - first.y, p.z - first.z) or abs(p.yaw - first.yaw) for p in others)

    def moves_in_words(self) -> tuple[str, ...]:
        """The length of each action, such as "1.2 cm"."""
        labels = self.problem.mdp.action_labels
        if len(labels) != 2 * len(self.problem.mdp.shape):
            return ("",) * len(labels)
        steps = self.cell_steps()
        return tuple(size_in_words(label, steps[action // 2]) for action, label in enumerate(labels))

    def show(self, bench: Bench, state: int) -> bool:
        """Put the bench into a state without physics; returns False, and moves nothing, when the arm cannot reach it."""
        pose = self.pose(state)
        if not bench.scene.robot.stand(pose):
            return False
        if bench.held is not None:
            bench.scene.put(self.part, self.kind, pose)
        return True

    def does(self, name: str) -> str:
        """A predicate for what the robot does now with part `name`."""
        return f"{self.doing.format(part=name)} at '{self.station}'"

    def on_part(self, name: str, kind: Kind) -> tuple[Body, ...]:
        """The bodies that this skill may make visible on a part."""
        return ()

    def shown(self) -> list[str]:
        """The names of the bodies that are visible on its part now."""
        return []

    def shown_in(self, state: int, name: str) -> dict[str, bool]:
        """By name of each body on a part: whether it is visible in a state of the problem."""
        return {}

    def photo(self) -> Photo | None:
        """The picture from which `setup` read the problem; None when it used none."""
        return None

    # ---- the motion, and its trial in physics ------------------------------------------------------------------------

    def begins_at(self) -> ToolPose | None:
        """The tool pose from which the skill begins; None: any."""
        return None

    def begin(self, bench: Bench, off: Sequence[float] = NOT_OFF) -> None:
        """Put arm and part where the skill begins, without physics, for a trial; the part is on its spot or in the gripper.

        off: displacement of the part from its spot, x, y [m] and yaw [rad].
        """
        scene, pose, name = bench.scene, self.begins_at(), self.trial_part()
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
        """Add the bodies on which its part stands or is to be set down: parts of a lower layer, or its pallet."""
        task, name, places = self.surveys.task, self.trial_part(), self.surveys.places
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

    def trial_part(self) -> str:
        """The name of the part in a trial of the skill; "" when it handles none."""
        return self.kind and f"{self.surveys.task.made_as(self.kind).name} 1"

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Follows the policy: each `next` sets the targets of one physics step of 1/240 s. Raises SkillFailed.

        bench: the scene, with `bench.scene.robot` and `bench.scene.world`; policy: `policy.q` is the learned table.
        """
        raise NotImplementedError

    def start(self, bench: Bench, policy: Policy) -> None:
        """Begins to follow `policy` from the bench's current state."""
        self._motion = self.motion(bench, policy)
        self.status, self.reason = Status.RUNNING, ""

    def step(self) -> Status:
        """The status after setting the targets of the next physics step; the caller then steps the world."""
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
        """End the motion as failed, for `reason`."""
        self._motion, self.status, self.reason = None, Status.FAILURE, reason

    def stop(self) -> None:
        """Abort the motion; the skill can be started again."""
        self._motion, self.status = None, Status.IDLE


def stand_below(scene: Scene, station: str, below: Sequence[tuple[str, Spot]]) -> None:
    """Add to a scene the parts `below` (kind, spot) that carry others at a station, unless they are there already."""
    for kind, spot in below:
        name = f"{kind} below at {spot.x:.3f} {spot.y:.3f} {spot.z:.3f} {station}"
        if name not in scene.kind_of:
            scene.add(name, kind, spot)


def learned_path(policy: Policy, mdp: TabularMDP, start: int) -> list[int]:
    """The states on the policy's greedy path from `start` to the goal; SkillFailed when it does not reach the goal."""
    if mdp.goal[start]:
        return [start]
    states, _, reached = greedy_path(policy.q, mdp, mdp.n_states, start)
    if not reached:
        raise SkillFailed(f"policy '{policy.name}' does not reach its goal from {mdp.state_label(start)}")
    return states


def no_path_error(what: str, error: NoPath, names: Sequence[str]) -> BadInput:
    """The error for a goal that no path reaches; it names what encloses start or goal."""
    return BadInput(
        f"{what}: no path reaches the goal; the {error.around} is enclosed by: {', '.join(names) or 'the border'}"
    )
