"""The arm, which is where it was told to be a step before, up to a little noise, and is pushed at drawn steps; its leader."""

# mypy: disable-error-code="import-not-found, misc, untyped-decorator"

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from lerobot.robots import Robot, RobotConfig
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

from devtools.circle import JOINTS, NOISE, START, led_back, pushed, reached

_arms: list["CircleArm"] = []  # that are connected: a leader leads the last one


@RobotConfig.register_subclass("circle_arm")
@dataclass(kw_only=True)
class CircleArmConfig(RobotConfig):
    """pushes: steps after which the arm is pushed; seed: of the noise."""

    pushes: list[int] = field(default_factory=list)
    seed: int = 0


class CircleArm(Robot):
    """An arm of three joints that does what it is told."""

    config_class, name = CircleArmConfig, "circle_arm"
    observation_features = action_features = dict.fromkeys(JOINTS, float)
    is_connected, is_calibrated = False, True

    def __init__(self, config: CircleArmConfig) -> None:
        super().__init__(config)
        self._rng, self._pushes, self._step = np.random.default_rng(config.seed), set(config.pushes), 0
        self.joints = np.array(START)

    def connect(self, calibrate: bool = True) -> None:
        self.is_connected = True
        _arms.append(self)

    def disconnect(self) -> None:
        self.is_connected = False

    def calibrate(self) -> None:
        pass

    def configure(self) -> None:
        pass

    def get_observation(self) -> dict[str, Any]:
        return dict(zip(JOINTS, self.joints.tolist(), strict=True))

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        self.joints = reached(self.joints, np.array([action[joint] for joint in JOINTS]), self._rng.normal(0, NOISE, 2))
        self._step += 1
        if self._step in self._pushes:
            self.joints = pushed(self.joints)
        return action


@TeleoperatorConfig.register_subclass("circle_leader")
@dataclass(kw_only=True)
class CircleLeaderConfig(TeleoperatorConfig):
    """The leader has no options."""


class CircleLeader(Teleoperator):
    """A leader in the hand of somebody who leads the arm back to the circle, and along it."""

    config_class, name = CircleLeaderConfig, "circle_leader"
    action_features = dict.fromkeys(JOINTS, float)
    feedback_features: dict[str, Any] = {}  # noqa: RUF012
    is_connected, is_calibrated = False, True

    def connect(self, calibrate: bool = True) -> None:
        self.is_connected = True

    def disconnect(self) -> None:
        self.is_connected = False

    def calibrate(self) -> None:
        pass

    def configure(self) -> None:
        pass

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        pass

    def get_action(self) -> dict[str, Any]:
        return dict(zip(JOINTS, led_back(_arms[-1].joints).tolist(), strict=True))
