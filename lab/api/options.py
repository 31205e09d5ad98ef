"""What the functions take beside their own arguments: options by name, advisors, toolboxes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.advice.advising import Advising
from lab.errors import unknown
from lab.learning.requests import Advisor, Ask
from lab.toolbox.registry import Toolbox

OneAdvisor = str | Advisor | Ask
Advisors = OneAdvisor | Sequence[OneAdvisor] | None
ToolboxOrPlace = Toolbox | Path | str | None


def checked(given: Mapping[str, Any], known: type, where: str) -> dict[str, Any]:
    """The options that a TypedDict knows; BadInput for a name that it does not."""
    for name in given:
        if name not in known.__annotations__:
            raise unknown("option", name, known.__annotations__, where)
    return dict(given)


def several(advisors: Advisors) -> list[OneAdvisor]:
    """One advisor, several or nobody as a list."""
    if isinstance(advisors, Sequence) and not isinstance(advisors, str):
        return list(advisors)
    return ["none" if advisors is None else advisors]


def advising_of(advisors: Advisors, toolbox: ToolboxOrPlace) -> Advising:
    """Who advises; policies that do are in that toolbox, None: in the user's own."""
    box = None if toolbox is None else toolbox_of(toolbox, "")
    return replace(Advising.of(several(advisors)), toolbox=box)


def toolbox_of(given: ToolboxOrPlace, nowhere: str) -> Toolbox:
    """The toolbox that is given, or one in the folder `nowhere`."""
    return given if isinstance(given, Toolbox) else Toolbox(nowhere if given is None else given)
