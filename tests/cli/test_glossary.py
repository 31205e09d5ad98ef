"""The glossary: all gates and learners, in the help and in the README, from one table."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lab.cli import glossary
from lab.learning.gates import GATES
from lab.learning.updates import UPDATES

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def names(words: dict[str, str]) -> set[str]:
    return {name for entry in words for name in entry.split(", ")}


def test_every_gate_and_learner_is_explained() -> None:
    assert names(glossary.GATES) == set(GATES)
    assert names(glossary.LEARNERS) == set(UPDATES)


def test_help_explains_every_word(lab: Lab) -> None:
    text = " ".join(lab("teach", "--help").out.split())
    for words in (glossary.LEARNERS, glossary.GATES, glossary.TERMS):
        for word, meaning in words.items():
            assert f"{word}: {meaning}" in text
    assert {"psi", "tau", "mislead", "helped step"} <= glossary.TERMS.keys()


def test_the_readme_shows_the_same_table(root: Path) -> None:
    assert glossary.readme_table() in (root / "README.md").read_text(encoding="utf-8")
