"""Teaching Lab: a robot that learns sub-tasks with advice, orders them and carries them out in physics.

The names in `__all__` are stable: docs/reference.md lists them. Each is imported when it is first used.
"""

from lab.version import __version__ as __version__

TYPE_CHECKING = False  # typing.TYPE_CHECKING without its import, which would dominate the time of `import lab`
if TYPE_CHECKING:
    from typing import Any

    from lab.api.finding import FoundSubtasks, find
    from lab.api.lessons import LessonResult, teach
    from lab.api.orders import OrderResult, sequence
    from lab.api.pictures import Page, Picture
    from lab.api.runs import RunResult, run
    from lab.api.scenes import show
    from lab.api.studies import StudyResult, compare, study, tune
    from lab.errors import BadInput, LabError, WorkFailed
    from lab.learning.gates import Gate, RuleGate, Steps
    from lab.learning.problem import Problem
    from lab.learning.requests import AdviceRequest, AdvisorLeft
    from lab.learning.updates import RuleUpdate, Update
    from lab.mdp import Rewards, TabularMDP, grid
    from lab.mentor.doubts import Doubt
    from lab.mentor.mentor import Mentor
    from lab.recordings.episode import Episode, Recording
    from lab.sequencing.cell.cell import Cell
    from lab.tasks.grid_world import GridWorld
    from lab.teaching.mentor import watch
    from lab.teaching.subjects import world
    from lab.toolbox.policy import Policy
    from lab.toolbox.registry import Toolbox


_FACE = {
    "lab.api.finding": ("FoundSubtasks", "find"),
    "lab.api.lessons": ("LessonResult", "teach"),
    "lab.api.orders": ("OrderResult", "sequence"),
    "lab.api.pictures": ("Page", "Picture"),
    "lab.api.runs": ("RunResult", "run"),
    "lab.api.scenes": ("show",),
    "lab.api.studies": ("StudyResult", "compare", "study", "tune"),
    "lab.teaching.mentor": ("watch",),
    "lab.teaching.subjects": ("world",),
    "lab.errors": ("BadInput", "LabError", "WorkFailed"),
    "lab.learning.gates": ("Gate", "RuleGate", "Steps"),
    "lab.learning.problem": ("Problem",),
    "lab.learning.requests": ("AdviceRequest", "AdvisorLeft"),
    "lab.learning.updates": ("RuleUpdate", "Update"),
    "lab.mdp": ("Rewards", "TabularMDP", "grid"),
    "lab.mentor.doubts": ("Doubt",),
    "lab.mentor.mentor": ("Mentor",),
    "lab.recordings.episode": ("Episode", "Recording"),
    "lab.sequencing.cell.cell": ("Cell",),
    "lab.tasks.grid_world": ("GridWorld",),
    "lab.toolbox.policy": ("Policy",),
    "lab.toolbox.registry": ("Toolbox",),
}
_MODULES = {name: module for module, names in _FACE.items() for name in names}

__all__ = [
    "AdviceRequest",
    "AdvisorLeft",
    "BadInput",
    "Cell",
    "Doubt",
    "Episode",
    "FoundSubtasks",
    "Gate",
    "GridWorld",
    "LabError",
    "LessonResult",
    "Mentor",
    "OrderResult",
    "Page",
    "Picture",
    "Policy",
    "Problem",
    "Recording",
    "Rewards",
    "RuleGate",
    "RuleUpdate",
    "RunResult",
    "Steps",
    "StudyResult",
    "TabularMDP",
    "Toolbox",
    "Update",
    "WorkFailed",
    "compare",
    "find",
    "grid",
    "run",
    "sequence",
    "show",
    "study",
    "teach",
    "tune",
    "watch",
    "world",
]


def __getattr__(name: str) -> "Any":
    if name not in _MODULES:
        raise AttributeError(f"module 'lab' has no attribute '{name}'")
    from importlib import import_module

    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
