"""The policy: as with any of LeRobot's, what it sees and gives is normalized. `python -m` this module saves it in a folder."""

# mypy: disable-error-code="import-not-found, misc"

import sys
from typing import Any

import numpy as np
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.pretrained import PreTrainedPolicy
from lerobot.processor import make_default_pre_post_processors

from devtools.circle import JOINTS, chosen

from .configuration_circle import CircleConfig

MIDDLE, SCALE = np.array([5.0, -5.0, 40.0]), np.array([30.0, 25.0, 10.0])


class CirclePolicy(PreTrainedPolicy):
    """Stirs along the circle where it is near, and stands still elsewhere."""

    config_class, name = CircleConfig, "circle"

    def __init__(self, config: CircleConfig, **_: Any) -> None:
        super().__init__(config)
        self.unused = torch.nn.Parameter(torch.zeros(1))  # a file of weights holds one or more

    def get_optim_params(self) -> dict[str, Any]:
        return {}

    def reset(self) -> None:
        pass

    def forward(self, batch: dict[str, Any]) -> tuple[Any, None]:
        raise NotImplementedError

    def predict_action_chunk(self, batch: dict[str, Any], **_: Any) -> Any:
        return self.select_action(batch)[:, None]

    def select_action(self, batch: dict[str, Any], **_: Any) -> Any:
        joints = batch["observation.state"][0].numpy() * SCALE + MIDDLE
        return torch.tensor((chosen(joints) - MIDDLE) / SCALE, dtype=torch.float32)[None]


def save(folder: str) -> None:
    """Write the policy and its normalization to a folder, as LeRobot's training does."""
    width = (len(JOINTS),)
    config = CircleConfig(
        input_features={"observation.state": PolicyFeature(FeatureType.STATE, width)},
        output_features={"action": PolicyFeature(FeatureType.ACTION, width)},
        device="cpu",
    )
    one = {"mean": torch.tensor(MIDDLE, dtype=torch.float32), "std": torch.tensor(SCALE, dtype=torch.float32)}
    CirclePolicy(config).save_pretrained(folder)
    for processor in make_default_pre_post_processors(config, {"observation.state": one, "action": one}):
        processor.save_pretrained(folder)


if __name__ == "__main__":
    save(sys.argv[1])
