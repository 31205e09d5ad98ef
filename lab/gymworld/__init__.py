"""Any Gymnasium environment with discrete states and actions as a problem for the lab."""

from lab.gymworld.made import PREFIX, names_environment, parse_name
from lab.gymworld.world import GymWorld, gym_world

__all__ = ["PREFIX", "GymWorld", "gym_world", "names_environment", "parse_name"]
