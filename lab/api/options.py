"""The options that the functions of `import lab` share: settings, advisors and toolboxes; rows as data frames."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict

from lab.advice.advising import Advising
from lab.errors import unknown
from lab.lazy import pandas
from lab.learning.gates import Gate
from lab.learning.requests import Advisor, Ask
from lab.learning.updates import Update
from lab.optional import require
from lab.toolbox.registry import Toolbox


def data_frame(rows: Iterable[Mapping[str, Any]]) -> "pandas.DataFrame":
    """The rows as a DataFrame. Raises BadInput if pandas is not installed."""
    require("to_dataframe()", pandas)
    return pandas.DataFrame.from_records([dict(row) for row in rows])


# ---- settings of learner and gate -----------------------------------------------------------------------------------


class Settings(TypedDict, total=False):
    """The settings of `LearnerSettings` and `GateSettings`; the default of each is the value in the problem's file.

    learner, gate: a name, or a subclass of `Update` or `Gate`.
    """

    learner: str | type[Update]
    alpha: float
    discount: float
    trace: float
    replacing: bool
    tilings: int
    start_value: float
    planning: int
    selection: str
    exploration: float
    beta: float
    episodes: int
    max_steps: int
    count_start: bool
    gate: str | type[Gate]
    lambda_threshold: float
    omega: int
    first_episode: int
    window: int
    psi: float
    spread: float
    rate: float
    fading: float
    consistency: float
    enough_steps: float
    ensemble: int
    budget: int
    judge_unhelped: bool
    spare_best: bool
    memory: bool


# ---- advisors and toolboxes -----------------------------------------------------------------------------------------


OneAdvisor = str | Advisor | Ask
Advisors = OneAdvisor | Sequence[OneAdvisor] | None
ToolboxOrPlace = Toolbox | Path | str | None


def checked(given: Mapping[str, Any], known: type, where: str) -> dict[str, Any]:
    """The options as a dict. Raises BadInput for a name that is not in the TypedDict `known`."""
    for name in given:
        if name not in known.__annotations__:
            raise unknown("option", name, known.__annotations__, where)
    return dict(given)


def several(advisors: Advisors) -> list[OneAdvisor]:
    """The advisors as a list; ["none"] for None."""
    if isinstance(advisors, Sequence) and not isinstance(advisors, str):
        return list(advisors)
    return ["none" if advisors is None else advisors]


def advising_of(advisors: Advisors, toolbox: ToolboxOrPlace) -> Advising:
    """The advisors of a session; the toolbox (None: the user's own) holds the policies that advise."""
    box = None if toolbox is None else toolbox_of(toolbox, "")
    return replace(Advising.of(several(advisors)), toolbox=box)


def toolbox_of(given: ToolboxOrPlace, nowhere: str) -> Toolbox:
    """The given toolbox, or one in the folder `nowhere` if there is none."""
    return given if isinstance(given, Toolbox) else Toolbox(nowhere if given is None else given)
