"""`ControlEnv`: a skill of a task as a continuous-control problem for Gymnasium, in physics, with velocities as actions."""

from collections.abc import Iterator
from dataclasses import replace
from math import cos, sin
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from lab.control.control_scene import ControlScene
from lab.control.controlled_skill import Aim, ControlledSkill, controlled_skill
from lab.control.streamed_motion import PHYSICS_STEPS, Limits, StreamedMotion, StreamedTool
from lab.errors import BadInput, unknown
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.camera import Camera, hand_camera
from lab.sim.world import TIME_STEP

CONTROL_S = PHYSICS_STEPS * TIME_STEP  # [s] from one action to the next
SPEED_SHARE = 0.6  # of the task's tool speed, as in the skills near stations
FASTEST_M_S = 0.5
YAW_RAD_S, YAW_RAD_S2 = 1.2, 12.0  # of the tool
JOINT_RAD_S, JOINT_RAD_S2 = 0.6, 6.0  # of each joint, or less where the arm is slower
PRESSED_EVERY = 4  # physics steps from one look at the forces to the next
SUNK_M = 0.02  # a part that is lower than at the start by more has fallen off its place
LOST_STEPS = 5  # control steps after which a part that is neither held nor in its place is lost
LEAST_S, PATHS = 8.0, 3.0  # until an episode is cut
PIXELS, RENDERED_PIXELS = 96, 256
CAMERA_UP_M = 1.6  # [m] the overhead camera, above the middle of the box
MOST = 4.0  # no number of a state is larger [m]
ACTIONS, OBSERVATIONS = ("tool", "joints"), ("state", "pictures")

STATE_NAMES = (
    *("tool x", "tool y", "tool z", "sin tool yaw", "cos tool yaw", "opening", "closes"),
    *("part ahead", "part left", "part up", "sin part yaw", "cos part yaw"),
    *("goal ahead", "goal left", "goal up", "sin goal yaw", "cos goal yaw"),
    *("left touches", "right touches"),
)
METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": round(1 / CONTROL_S)}
_AT_END = object()

Info = dict[str, Any]
Array = NDArray[np.float64]
Action = NDArray[np.float32]


class ControlEnv(gymnasium.Env[Any, Action]):
    """A skill of a task: 10 actions a second, each from -1 to 1, until its aim is reached, or the part is lost.

    Actions "tool": velocities of the tool along x, y, z and about the vertical, as shares of `limits.speeds`, and the gripper,
    which closes above 0; "joints": velocities of the joints instead. A command out of reach or of the box is not followed.
    Observations "state": see `state_names`, poses relative to the tool in its own axes; "pictures": a dict of "state" (the
    joints [rad] and the fingers' opening), "overhead" and "hand" (96, 96, 3) uint8. The reward is 1 at success, else 0.
    info: "is_success", and "reason", why the episode failed ("" if it has not).
    The same seed gives the same episode bit for bit, whatever was done before.

        >>> import gymnasium, lab.control
        >>> env = gymnasium.make("TeachingLab/Grasp-control-v0")
        >>> observation, info = env.reset(seed=1)
        >>> observation.shape == env.observation_space.shape, env.action_space.shape
        (True, (5,))
    """

    metadata = METADATA

    def __init__(
        self,
        task: str = "toast",
        skill: str = "grasp",
        layout_seed: int = 0,
        actions: str = "tool",
        observations: str = "state",
        noise: float = 0.0,
        seconds: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        """task: a file or a name that ships; skill: its name, or that of its sub-task; layout_seed: of the obstacles.

        noise: the standard deviation of a seeded disturbance of each velocity, as a share of the largest one that is
        commanded, so that an arm at rest stays at rest; 0.1 is much where a part goes into a slot. seconds: until an episode
        is cut; None: LEAST_S, and PATHS times what the table's path takes at full speed.
        Raises BadInput.
        """
        for name, value, allowed in (("actions", actions, ACTIONS), ("observations", observations, OBSERVATIONS)):
            if value not in allowed:
                raise unknown(name, value, allowed, "ControlEnv")
        for name, number, most in (("noise", noise, 1.0), ("seconds", seconds or 0.0, 600.0)):
            if not 0.0 <= number <= most:
                raise BadInput(f"{name} {number!r} (ControlEnv): wanted 0 to {most:g}")
        self.skill: ControlledSkill = controlled_skill(task, skill, layout_seed)
        self.arm, self.noise, self.render_mode = self.skill.arm, noise, render_mode
        self.by_joints, self.by_pictures = actions == "joints", observations == "pictures"
        self.limits = _joint_limits(self.skill) if self.by_joints else _tool_limits(self.skill)
        moved = self.arm.joints if self.by_joints else ("vx", "vy", "vz", "yaw rate")
        self.action_names: tuple[str, ...] = (*moved, "gripper")
        self.state_names = (*self.arm.joints, "opening") if self.by_pictures else STATE_NAMES
        usual_s = LEAST_S + PATHS * self.skill.path_m / self.speed_m_s
        self.max_episode_steps = max(round((usual_s if seconds is None else seconds) / CONTROL_S), 1)
        self.action_space = spaces.Box(-1.0, 1.0, (len(self.action_names),), np.float32)
        self.observation_space: Any = _space(self.state_names, self.by_pictures)
        self._scene: ControlScene | None = None

    @property
    def scene(self) -> ControlScene:
        """The scene of the current episode. Raises BadInput before the first reset."""
        if self._scene is None:
            raise BadInput("ControlEnv: wanted reset() before step(), render() and a teacher")
        return self._scene

    @property
    def closes(self) -> bool:
        """Whether the last command was to close the fingers."""
        return self.scene.robot.closed

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Info]:
        """The observation and info at a drawn start. Raises WorkFailed if no start is clear of all bodies."""
        super().reset(seed=seed)
        if self._scene is not None and not self._scene.is_fresh:
            self.close()
        if self._scene is None:
            self._scene = ControlScene(self.skill)
        scene = self._scene
        scene.begin(self.np_random)
        joints = self.arm.inverse(scene.start)
        assert joints is not None  # the arm stands there
        self.motion: StreamedMotion = (
            StreamedMotion(self.arm, self.limits, joints)
            if self.by_joints
            else StreamedTool(self.arm, self.limits, joints, scene.start)
        )
        self._fingers: Iterator[None] = iter(())
        self.moves_fingers = False  # whether they are still on their way
        self._steps = self._lost = 0
        self.reason, self.tool = "", scene.robot.tool()
        return self._observed(), self._info(False)

    def step(self, action: Action) -> tuple[Any, float, bool, bool, Info]:
        """The outcome of 0.1 s of physics. Raises BadInput for an action of another shape or with numbers that are not finite."""
        scene, asked = self.scene, np.asarray(action, np.float64)
        if asked.shape != self.action_space.shape or not np.isfinite(asked).all():
            raise BadInput(
                f"action {action!r} (ControlEnv): wanted {len(self.action_names)} finite numbers from -1 to 1"
            )
        asked = np.clip(asked, -1.0, 1.0)
        if self.noise:
            most = self.noise * float(np.abs(asked[:-1]).max())
            asked[:-1] = np.clip(asked[:-1] + self.np_random.normal(0.0, most, len(asked) - 1), -1.0, 1.0)
        self._command_fingers(bool(asked[-1] > 0.0))
        self._move(asked[:-1])
        self._steps, self.tool = self._steps + 1, scene.robot.tool()
        success = not self.reason and scene.is_done(self.tool)
        if not success and not self.reason:
            self.reason = self._failure()
        terminated = success or bool(self.reason)
        truncated = not terminated and self._steps >= self.max_episode_steps
        if truncated:
            self.reason = "out of time"
        return self._observed(), float(success), terminated, truncated, self._info(success)

    def _command_fingers(self, close: bool) -> None:
        """Let the fingers begin to close or to open, if that is another command than the last one."""
        scene = self.scene
        if close != scene.robot.closed:
            self._fingers = scene.robot.grip(scene.grip_n) if close else scene.robot.release()
            self.moves_fingers = True

    def _move(self, shares: Array) -> None:
        """Carry out a control step of physics; a force that is too large ends it."""
        scene = self.scene
        for row, _ in enumerate(scene.robot.along(self.motion.follow(shares))):
            if self.moves_fingers:
                self.moves_fingers = next(self._fingers, _AT_END) is not _AT_END
            scene.world.step()
            if row % PRESSED_EVERY == 0:
                body, force_n = scene.world.pressed(NAME)
                if force_n > scene.scene.stops_at_n:
                    self.reason = f"collision: the arm presses on '{body}' with {force_n:.0f} N"
                    return

    def _failure(self) -> str:
        """Why the episode has failed; "" if it has not."""
        scene = self.scene
        if not scene.body:
            return ""
        if scene.aim is Aim.TAKE:
            lost = not any(scene.touches()) and not (scene.is_upright() and scene.lifted_m() > -SUNK_M)
        else:
            lost = not any(scene.touches()) and (scene.aim is Aim.REACH or not scene.stands())
        self._lost = self._lost + 1 if lost else 0
        return f"dropped part: {scene.body} is neither held nor in its place" if self._lost >= LOST_STEPS else ""

    def close(self) -> None:
        """Free the scene of the last episode."""
        if self._scene is not None:
            self._scene.close()
            self._scene = None

    def render(self) -> NDArray[np.uint8] | None:
        """The overhead picture (256, 256, 3) RGB; None unless the render mode is "rgb_array"."""
        if self.render_mode != "rgb_array":
            return None
        return self._camera(RENDERED_PIXELS).picture(self.scene.world)

    # ---- for teachers ------------------------------------------------------------------------------------------------

    @property
    def speed_m_s(self) -> float:
        """The tool's largest speed along each axis [m/s]."""
        return _speed_m_s(self.skill)

    def action(self, velocity: Array, close: bool) -> Action:
        """The action (d,) for a velocity of the tool, x, y, z [m/s] and yaw [rad/s] (4,), with the fingers closing or opening."""
        if not self.by_joints:
            shares = velocity / self.limits.speeds
        else:
            tool, moved = self.tool, velocity * CONTROL_S
            now = self.scene.world.joints(NAME, self.arm.joints)
            next_pose = np.array([[tool.x, tool.y, tool.z, tool.yaw]]) + moved
            joints = np.nan_to_num(self.arm.inverse_path(next_pose, now)[0] - now)
            shares = joints / CONTROL_S / self.limits.speeds
            shares /= max(float(np.abs(shares).max()), 1.0)
        return np.append(np.clip(shares, -1.0, 1.0), 1.0 if close else -1.0).astype(np.float32)

    # ---- what is observed --------------------------------------------------------------------------------------------

    def _camera(self, pixels: int) -> Camera:
        low, high = (end[:3] for end in self.skill.box)
        middle = (low + high) / 2
        angle = 2.0 * np.arctan(float((high - low)[:2].max()) / 2 / CAMERA_UP_M)
        return Camera.overhead((float(middle[0]), float(middle[1]), CAMERA_UP_M), float(angle), pixels)

    def pictures(self) -> dict[str, NDArray[np.uint8]]:
        """The pictures (96, 96, 3) RGB of the cameras "overhead" and "hand" now."""
        world = self.scene.world
        hand = replace(hand_camera(self.tool), width=PIXELS, height=PIXELS)
        return {"overhead": self._camera(PIXELS).picture(world), "hand": hand.picture(world)}

    def _observed(self) -> Any:
        scene = self.scene
        if not self.by_pictures:
            return self.state()
        joints = scene.world.joints(NAME, self.arm.joints)
        return {"state": np.append(joints, scene.opening()).astype(np.float32), **self.pictures()}

    def state(self) -> NDArray[np.float32]:
        """The state by STATE_NAMES (d,) now."""
        scene, tool = self.scene, self.tool
        touches = scene.touches()
        part = scene.part_pose(tool.yaw) if scene.body else tool
        goal = scene.goal_like(tool.yaw)
        values = [
            *(tool.x, tool.y, tool.z, sin(tool.yaw), cos(tool.yaw), scene.opening(), float(self.closes)),
            *_relative(part, tool),
            *_relative(goal, tool),
            *map(float, touches),
        ]
        return np.clip(np.array(values, np.float32), -MOST, MOST)

    def _info(self, success: bool) -> Info:
        return {"is_success": success, "reason": self.reason}


def _relative(pose: ToolPose, tool: ToolPose) -> tuple[float, ...]:
    """A pose in the tool's axes: ahead, left, up [m], sine and cosine of its turn."""
    dx, dy, turn = pose.x - tool.x, pose.y - tool.y, pose.yaw - tool.yaw
    c, s = cos(tool.yaw), sin(tool.yaw)
    return c * dx + s * dy, -s * dx + c * dy, pose.z - tool.z, sin(turn), cos(turn)


def _speed_m_s(skill: ControlledSkill) -> float:
    return min(SPEED_SHARE * skill.task.robot.speed_m_s, FASTEST_M_S)


def _tool_limits(skill: ControlledSkill) -> Limits:
    robot, (low, high) = skill.task.robot, skill.box
    speed = _speed_m_s(skill)
    speeds = np.array([speed, speed, speed, YAW_RAD_S])
    accelerations = np.array([*[robot.acceleration_m_s2] * 3, YAW_RAD_S2])
    return Limits(speeds, accelerations, low, high)


def _joint_limits(skill: ControlledSkill) -> Limits:
    arm = skill.arm
    return Limits(np.minimum(arm.speed, JOINT_RAD_S), np.full(len(arm.joints), JOINT_RAD_S2), arm.lower, arm.upper)


def _space(state_names: tuple[str, ...], by_pictures: bool) -> spaces.Space[Any]:
    most = 4 * np.pi if by_pictures else MOST
    state = spaces.Box(-most, most, (len(state_names),), np.float32)
    if not by_pictures:
        return state
    picture = spaces.Box(0, 255, (PIXELS, PIXELS, 3), np.uint8)
    return spaces.Dict({"state": state, "overhead": picture, "hand": picture})
