"""The choices of options, from the families' tables, for help texts, the glossary and the shell's completion.

An option's help, or the text below a command's options, contains "{gates}" where the members of that family belong. They
are filled in when the help of that command is requested, so that `lab --help` loads no table.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import typer
from typer.core import TyperCommand

from lab.cli import deferred
from lab.cli.output import complain
from lab.errors import BadInput

TERMS = {
    "gate": "the rule by which a learner decides when to ask",
    "improvement": "how many fewer steps the last episodes took than those before them, in percent",
    "helped step": "a step that was taken on advice",
    "guided episode": "an episode with at least one helped step",
    "mislead": "an episode with questions that was no shorter than the mean of those before it: advice did not help",
    "Lambda": "the improvement that is enough: below it ccrl asks",
    "Omega": "how many misleads are tolerated before an advisor is rejected; a budget of helped steps may end advice earlier",
    "psi": "the distance between action values at which ia, combined and importance decide",
    "trust": "the share of an advisor's answers that led nearer to the goal, by the learner's estimate",
    "tau": "the skill of a simulated advisor, the smaller the better: .01 an expert, .1 moderate, .3 limited, 1 a novice",
    "accuracy": "the share of optimal answers of a simulated advisor, over the states in which an action is worse than another",
    "praise": "the judgement that a move was good, and blame that it was bad: they act in the episodes in which the learner asks",
    "sight": "where in a world a simulated advisor sees the robot and can advise: everywhere, or in a region",
}
TEXTS = {  # name of the text below a command's options -> its headings, each with a family
    "words of teaching": {"Learners": "learners", "Gates": "gates", "Words": "terms"},
    "words of sequencing": {"Methods": "methods", "Instance files": "instances"},
    "words of instances": {"Instance files": "instances"},
    "words of exporting": {"Formats": "export formats"},
}


# ---- the families' tables, and the help that lists them -----------------------------------------------------------------


Tables = dict[str, Mapping[str, Any] | Sequence[str]]


def _of_teaching() -> Tables:
    return {
        "terms": TERMS,
        "skills": deferred.SKILLS,
        "problems": deferred.PROBLEMS,
        "learners": deferred.UPDATES,
        "gates": deferred.GATES,
        "selections": deferred.SELECTIONS,
        "advisors": deferred.ADVISORS,
        "asked": deferred.ASKED,
        "decisions": deferred.DECISIONS,
    }


def _of_sequencing() -> Tables:
    return {"methods": deferred.SEQUENCERS, "objectives": deferred.OBJECTIVES, "order gates": deferred.FITTING}


def _of_studies() -> Tables:
    return {"studies": deferred.STUDIES}


def _of_tasks() -> Tables:
    return {"arms": deferred.MODELS, "instances": deferred.INSTANCES}


def _of_export() -> Tables:
    return {"export formats": deferred.FORMATS}


def _of_mentor() -> Tables:
    return {"doubts": deferred.DOUBTS}


def members(family: str) -> Mapping[str, Any] | Sequence[str]:
    """The table of a family, such as "gates", or its names; only the tables needed for it are loaded."""
    for room in (_of_studies, _of_teaching, _of_sequencing, _of_tasks, _of_export, _of_mentor):
        if family in (family_room := room()):
            return family_room[family]
    raise KeyError(family)


def offers(*families: str) -> Callable[[str], list[str]]:
    """The function that gives the shell's completions for families."""

    def offered(incomplete: str) -> list[str]:
        return [name for family in families for name in members(family) if name.startswith(incomplete)]

    return offered


def from_files(*families: str) -> Callable[[Any, Any], Any]:
    """The callback of an option that loads "./mine.py:MyGate" into its family, with a notice, because its code runs.

    Of several families, the first that accepts the member is used.
    """

    def taken(context: typer.Context, value: Any) -> Any:
        if context.resilient_parsing or not value:
            return value

        def member(word: str) -> str:
            if not deferred.is_file_word(word.strip()):
                return word
            return deferred.take([cast(Any, members(family)) for family in families], word.strip(), complain)

        if isinstance(value, str):
            return ",".join(map(member, value.split(",")))
        return [*map(member, value)]

    return taken


class CommandOfFamilies(TyperCommand):
    """A command whose help lists the members of families, and which refuses an option that would replace an earlier one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments that are left. Raises BadInput for an option of one value that is given twice with different values."""
        options: list[Any] = [param for param in self.params if not (param.multiple or getattr(param, "is_flag", True))]
        named = {name: option for option in options for name in option.opts}
        seen: dict[Any, str] = {}
        for word, following in pairwise([*args, ""]):
            name, equals, value = word.partition("=")
            if word == "--":
                break
            if name in named:
                option, now = named[name], value if equals else following
                before = seen.setdefault(option, now)
                if before != now:
                    allowed = "several are separated by commas" if "commas" in option.help else "it takes one value"
                    raise BadInput(f"{name} is given twice, '{before}' and '{now}': {allowed}")
        return super().parse_args(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help with the members filled in."""
        for param in self.params:
            described: Any = param  # an argument or an option, which share no class with a help
            described.help = _filled(described.help or "")
        self.epilog = _filled(self.epilog or "")
        super().format_help(ctx, formatter)


def _filled(text: str) -> str:
    def told(match: "re.Match[str]") -> str:
        name = match[1]
        if name not in TEXTS:
            return ", ".join(members(name))
        return "\n\n".join(_explained(heading, family) for heading, family in TEXTS[name].items())

    return re.sub(r"\{([a-z ]+)\}", told, text)


def _explained(heading: str, family: str) -> str:
    """The members of a family with their meanings, one per line, in typer's format of the text below the options."""
    table: Any = members(family)
    rows = [f"  {name}: {getattr(row, 'help', row)}" for name, row in table.items()]
    return "\n".join([f"{heading}:", *rows])
