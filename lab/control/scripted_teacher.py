"""A teacher who follows the skill's table: from any state of an episode, the action that leads to the goal.

The table's paths go round what is in the way. A tool that has strayed into a blocked cell first rises clear of it; the last
motion (close and lift, or open and rise) follows from where the part is.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.control.control_env import ControlEnv
from lab.control.controlled_skill import Aim
from lab.control.table_paths import TablePaths
from lab.errors import BadInput
from lab.mdp import optimal_values
from lab.sim.arms.kinematics import ToolPose
from lab.toolbox.policy import Policy

CLOSE_M, CLOSE_RAD = 0.003, 0.02  # at which the fingers close or open
OPEN = 0.95  # the opening from which the tool may move away
DISCOUNT = 0.99

Array = NDArray[np.float64]


class ScriptedTeacher:
    """The teacher of one environment, whom any number of its episodes may ask: `teacher(observation)` returns an action.

    It reads the true state from the environment, not from the observation. Episodes whose part has been lost cannot be saved.
    """

    def __init__(self, env: ControlEnv, policy: Policy | None = None) -> None:
        """policy: learned for the same problem; None: an optimal table. Raises BadInput for a policy of another problem."""
        skill = env.skill
        if policy is not None and policy.q.shape != (skill.mdp.n_states, skill.mdp.n_actions):
            raise BadInput(
                f"policy '{policy.name}' (ScriptedTeacher): it was learned for another problem than '{skill.skill.name}'"
            )
        q = optimal_values(skill.mdp, DISCOUNT) if policy is None else policy.q
        self.env, self.skill = env, skill
        self.paths = TablePaths(skill, q)

    def __call__(self, observation: Any) -> NDArray[np.float32]:
        """The action (d,) for the environment's current state; `observation` is not read."""
        env = self.env
        velocity, close = {Aim.TAKE: self._take, Aim.SET_DOWN: self._set_down, Aim.REACH: self._reach}[self.skill.aim](
            env.tool
        )
        most = np.abs(velocity[:3]).max() / env.speed_m_s
        velocity[:3] /= max(most, 1.0)
        return env.action(velocity, close)

    def _take(self, tool: ToolPose) -> tuple[Array, bool]:
        scene = self.env.scene
        goal = scene.part_pose(tool.yaw)
        if self.env.closes and scene.holds(tool):
            return (_still() if self.env.moves_fingers else self._up()), True
        if _is_at(tool, goal):
            return _still(), True
        if self.env.closes or scene.opening() < OPEN:
            return _still(), False
        return self.paths.velocity(tool, goal), False

    def _set_down(self, tool: ToolPose) -> tuple[Array, bool]:
        scene = self.env.scene
        if scene.holds(tool):
            release = scene.release_pose(tool)
            lets_go = _is_at(tool, release) or (not self.env.closes and scene.stands())
            return (_still(), False) if lets_go else (self.paths.velocity(tool, release), True)
        return (_still() if self.env.closes or scene.opening() < OPEN else self._up()), False

    def _reach(self, tool: ToolPose) -> tuple[Array, bool]:
        return self.paths.velocity(tool, self.env.scene.goal_like(tool.yaw)), self.skill.skill.carries

    def _up(self) -> Array:
        return np.array([0.0, 0.0, self.env.speed_m_s, 0.0])


def _still() -> Array:
    return np.zeros(4)


def _is_at(tool: ToolPose, goal: ToolPose) -> bool:
    off = np.array([tool.x - goal.x, tool.y - goal.y, tool.z - goal.z])
    return bool(np.linalg.norm(off) < CLOSE_M and abs(tool.yaw - goal.yaw) < CLOSE_RAD)
