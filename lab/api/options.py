"""The options that the functions of `import lab` share: settings, advisors and toolboxes; rows as data frames."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, TypedDict, get_type_hints

from annotated_types import Ge, Le

from lab.advice.advising import Advising
from lab.advice.advisors import MODEL, split_praise
from lab.errors import check_value, unknown
from lab.lazy import pandas
from lab.learning.gates import Gate
from lab.learning.requests import Advisor, Ask
from lab.learning.updates import Update
from lab.optional import require
from lab.teaching.events import Tell, told_to, unheard
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
    reuse: float
    bonus: float
    consistency: float
    warming: float
    exploring: float
    trust: float
    wandering: float
    retry: float
    strikes: float
    agreement: float
    margin: float
    enough_steps: float
    ensemble: int
    budget: int
    judge_unhelped: bool
    spare_best: bool
    by_evidence: bool
    memory: bool


# ---- checks of what is handed in ------------------------------------------------------------------------------------


COMMON: dict[str, Any] = {  # the arguments that several functions share
    "seed": Annotated[int, Ge(0)],
    "sessions": Annotated[int, Ge(1)],
    "trials": Annotated[int, Ge(1)],
    "workers": Annotated[int, Ge(1), Le(256)],
    "toasts": int,
    "parts": str,
    "task": str,
    "record": bool,
    "out": Path,
}


def check_common(where: str, **given: object) -> None:
    """Raises BadInput for an argument that `COMMON` does not allow; None stands for a default, which a seed does not have."""
    for name, value in given.items():
        if value is not None or name == "seed":
            check_value(name, value, COMMON[name], where)


def checked(given: Mapping[str, Any], known: type, where: str) -> dict[str, Any]:
    """The options as a dict. Raises BadInput for a name or a value that the TypedDict `known` does not allow; None: default."""
    allowed = get_type_hints(known, include_extras=True)
    for name, value in given.items():
        if name not in allowed:
            raise unknown("option", name, allowed, where)
        if value is not None:
            check_value(name, value, allowed[name], where)
    return dict(given)


# ---- advisors and toolboxes -----------------------------------------------------------------------------------------


OneAdvisor = str | Advisor | Ask | type[Advisor]
Advisors = OneAdvisor | Sequence[OneAdvisor] | None
ToolboxOrPlace = Toolbox | Path | str | None


def several(advisors: Advisors) -> list[OneAdvisor]:
    """The advisors as a list; ["none"] for None."""
    if isinstance(advisors, Sequence) and not isinstance(advisors, str):
        return list(advisors)
    return ["none" if advisors is None else advisors]


def advising_of(
    advisors: Advisors, toolbox: ToolboxOrPlace, asked: Mapping[str, Ask] = MappingProxyType({})
) -> Advising:
    """The advisors of a session; the toolbox (None: the user's own) holds the policies that advise.

    asked: the functions that ask people, by the name of the advisor.
    """
    box, names = None if toolbox is None else toolbox_of(toolbox, ""), several(advisors)
    people: dict[str, Ask] = {**asked}
    if models := [name for name in names if isinstance(name, str) and name.startswith(MODEL)]:
        from lab.seat.language_model import language_models

        people |= language_models(models)
    return replace(Advising.of(names, people), toolbox=box)


def asks_page(advisors: Advisors) -> bool:
    """Whether a person at a page is among the advisors."""
    return any(isinstance(name, str) and split_praise(name)[0] == "web" for name in several(advisors))


def heard_by(advising: Advising, tell: Tell) -> Tell:
    """A listener to a lesson's events that passes them to the language models, too, which ask in the words of the lesson."""
    return told_to(*(getattr(ask, "hear", unheard) for ask in advising.people.values()), tell)


def toolbox_of(given: ToolboxOrPlace, nowhere: str) -> Toolbox:
    """The given toolbox, or one in the folder `nowhere` if there is none."""
    return given if isinstance(given, Toolbox) else Toolbox(nowhere if given is None else given)
