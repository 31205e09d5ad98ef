"""Skills of the lab's tasks as continuous-control problems in Gymnasium (`import lab.control`), and a teacher who can do them."""

import gymnasium

from lab.control.control_env import ControlEnv
from lab.control.roll_out import demonstrations, recording, roll_out
from lab.control.scripted_teacher import ScriptedTeacher

__all__ = ["ENVIRONMENTS", "ControlEnv", "ScriptedTeacher", "demonstrations", "recording", "register", "roll_out"]

ENVIRONMENTS = {  # id -> the skill of the task "toast"
    "TeachingLab/Grasp-control-v0": "grasp at plate",
    "TeachingLab/Insert-control-v0": "insert at toaster",
    "TeachingLab/Place-control-v0": "place at finished_plate",
    "TeachingLab/Transfer-control-v0": "transfer toaster to butter_applier with slice",
}


def register() -> None:
    """Registers the environments of ENVIRONMENTS that are not registered yet."""
    for name, skill in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, "lab.control.control_env:ControlEnv", kwargs={"skill": skill})


register()
