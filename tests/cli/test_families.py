"""The glossary: words and members of families, in the help and in the documentation, from one table each."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.cli import families
from lab.learning.gates import GATES
from lab.learning.updates import UPDATES
from lab.sequencing import SEQUENCERS

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


@pytest.mark.parametrize(("command", "table"), [("teach", UPDATES), ("teach", GATES), ("sequence", SEQUENCERS)])
def test_help_explains_every_member(lab: Lab, command: str, table: dict[str, Any]) -> None:
    text = " ".join(lab(command, "--help").out.split())
    for name, row in table.items():
        assert f"{name}: {row.help}" in text


def test_help_explains_every_word(lab: Lab) -> None:
    text = " ".join(lab("teach", "--help").out.split())
    for word, meaning in families.TERMS.items():
        assert f"{word}: {meaning}" in text
    assert {"psi", "tau", "mislead", "helped step"} <= families.TERMS.keys()


def test_the_documentation_shows_the_same_table(root: Path) -> None:
    meanings = families.TERMS | {name: row.help for name, row in GATES.items()}
    table = ["| word | what it means |", "|---|---|", *(f"| `{word}` | {means} |" for word, means in meanings.items())]
    assert "\n".join(table) in (root / "docs" / "words.md").read_text(encoding="utf-8")
