"""Teaching Lab: a robot that learns sub-tasks with advice, orders them and carries them out in physics."""

__version__ = "0.1.0"
