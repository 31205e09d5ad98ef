"""Gymnasium both ways: its environments as problems to teach, ours as registered environments (`import lab.gym`)."""

from lab.gym.environment_name import PREFIX, names_environment, parse_name
from lab.gym.gym_problem import GymWorld, gym_world
from lab.gym.our_environments import (
    ENVIRONMENTS,
    CellEnv,
    FmsEnv,
    InsertEnv,
    TableEnv,
    ToastCellEnv,
    WorldEnv,
    register,
)

__all__ = [
    "ENVIRONMENTS",
    "PREFIX",
    "CellEnv",
    "FmsEnv",
    "GymWorld",
    "InsertEnv",
    "TableEnv",
    "ToastCellEnv",
    "WorldEnv",
    "gym_world",
    "names_environment",
    "parse_name",
    "register",
]

register()
