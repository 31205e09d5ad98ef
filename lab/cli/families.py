"""What a person can choose from, as help, glossary and the shell's completion show it: read from the families' tables.

An option's help, or the text below a command's options, holds "{gates}" where the members of that family belong. They
are filled in when the help of that very command is asked for: `lab --help` loads no table.
"""

import re
from collections.abc import Callable, Iterable
from typing import Any

from typer.core import TyperCommand

from lab.cli import glossary


def _of_teaching() -> dict[str, Iterable[str]]:
    from lab.advice.advisors import ADVISORS
    from lab.advice.panel import ASKED, DECISIONS
    from lab.learning.gates import GATES
    from lab.learning.updates import UPDATES
    from lab.skills import SKILLS

    return {
        "skills": SKILLS,
        "learners": UPDATES,
        "gates": GATES,
        "advisors": ADVISORS,
        "asked": ASKED,
        "decisions": DECISIONS,
    }


def _of_sequencing() -> dict[str, Iterable[str]]:
    from lab.sequencing import SEQUENCERS
    from lab.sequencing.cell.objectives import OBJECTIVES
    from lab.sequencing.methods.srl_advised import FITTING

    return {"methods": SEQUENCERS, "objectives": OBJECTIVES, "order gates": FITTING}


def _of_studies() -> dict[str, Iterable[str]]:
    from lab.studies import STUDIES

    return {"studies": STUDIES}


def members(family: str) -> Iterable[str]:
    """The names in a family's table, such as "gates"; only tables are loaded that are needed to find it."""
    for room in (_of_studies, _of_teaching, _of_sequencing):
        if family in (found := room()):
            return found[family]
    raise KeyError(family)


def offers(family: str) -> Callable[[str], list[str]]:
    """What the shell completes with."""

    def offered(incomplete: str) -> list[str]:
        return [name for name in members(family) if name.startswith(incomplete)]

    return offered


class CommandOfFamilies(TyperCommand):
    """A command whose help names the members of families."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The help, filled in."""
        for param in self.params:
            described: Any = param  # an argument or an option: they have no class in common that has a help
            described.help = _filled(described.help or "")
        self.epilog = _filled(self.epilog or "")
        super().format_help(ctx, formatter)


def _filled(text: str) -> str:
    def told(match: "re.Match[str]") -> str:
        name = match[1]
        return glossary.TEXTS[name]() if name in glossary.TEXTS else ", ".join(members(name))

    return re.sub(r"\{([a-z ]+)\}", told, text)
