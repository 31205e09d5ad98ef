"""Gymnasium: its environments as problems of lessons, and the lab's problems as registered environments (`import lab.gym`)."""

from lab.gym.environment_name import parse_name
from lab.gym.our_environments import (
    ENVIRONMENTS,
    CellEnv,
    FmsEnv,
    InsertEnv,
    RiverSwimEnv,
    TableEnv,
    ToastCellEnv,
    WorldEnv,
    register,
)

__all__ = [
    "ENVIRONMENTS",
    "CellEnv",
    "FmsEnv",
    "InsertEnv",
    "RiverSwimEnv",
    "TableEnv",
    "ToastCellEnv",
    "WorldEnv",
    "parse_name",
    "register",
]

register()
