"""The policy's configuration, as LeRobot wants it."""

# mypy: disable-error-code="import-not-found, misc, untyped-decorator"

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs.policies import PreTrainedConfig
from lerobot.configs.types import NormalizationMode


@PreTrainedConfig.register_subclass("circle")
@dataclass
class CircleConfig(PreTrainedConfig):
    """A policy of one step, which is not trained."""

    normalization_mapping: dict[str, NormalizationMode] = field(
        default_factory=lambda: dict.fromkeys(("STATE", "ACTION"), NormalizationMode.MEAN_STD)
    )
    observation_delta_indices = action_delta_indices = reward_delta_indices = None

    def get_optimizer_preset(self) -> Any:
        raise NotImplementedError

    def get_scheduler_preset(self) -> None:
        return None

    def validate_features(self) -> None:
        pass
