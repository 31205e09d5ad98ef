"""The words that a newcomer cannot guess, for help and README: the members of families by their tables, the rest here."""

from collections.abc import Callable, Mapping
from typing import Any

TERMS = {
    "gate": "the rule by which a learner decides when to ask",
    "improvement": "how many fewer steps the last episodes took than those before them, in percent",
    "helped step": "a step that was made on advice",
    "guided episode": "an episode with at least one helped step",
    "mislead": "an episode in which it asked and that was no shorter than the mean of those before it: advice did not help",
    "Lambda": "the improvement that is enough: below it ccrl asks",
    "Omega": "how many misleads are tolerated before an advisor is rejected",
    "psi": "the distance between values with which ia, combined and importance compare",
    "trust": "the share of an advisor's answers that led nearer to the goal, as far as the learner can tell",
    "tau": "the skill of a simulated advisor, the smaller the better: .01 an expert, .1 moderate, .3 limited, 1 a novice",
    "sight": "where in a world a simulated advisor sees the robot, and so can advise: everywhere, or in a region",
}


def of_teaching() -> str:
    """What the help of `lab teach` explains."""
    from lab.learning.gates import GATES
    from lab.learning.updates import UPDATES

    return _lines({"Learners": _meanings(UPDATES), "Gates": _meanings(GATES), "Words": TERMS})


def of_sequencing() -> str:
    """What the help of `lab sequence` explains."""
    from lab.sequencing import SEQUENCERS

    return _lines({"Methods": _meanings(SEQUENCERS)})


TEXTS: dict[str, Callable[[], str]] = {"words of teaching": of_teaching, "words of sequencing": of_sequencing}


def _meanings(table: Mapping[str, Any]) -> dict[str, str]:
    """The one line of help in each row."""
    return {name: row.help for name, row in table.items()}


def _lines(groups: Mapping[str, Mapping[str, str]]) -> str:
    """All words, one a line, as typer sets the text below a command's options."""
    return "\n\n".join(
        "\n".join([f"{name}:", *(f"  {word}: {meaning}" for word, meaning in words.items())])
        for name, words in groups.items()
    )


def readme_table() -> str:
    """The terms and the gates as the README shows them."""
    from lab.learning.gates import GATES

    rows = [f"| `{word}` | {meaning} |" for word, meaning in (TERMS | _meanings(GATES)).items()]
    return "\n".join(["| word | what it means |", "|---|---|", *rows])
