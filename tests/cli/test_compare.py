"""`lab study compare`: an option for every setting, values with commas between, a folder with report and rows."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.learning.settings import SETTINGS

Lab = Callable[..., Any]


@pytest.fixture(autouse=True)
def maze(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("maze.txt").write_text("S..\n.#.\n..G\n")


@pytest.mark.slow
def test_every_combination_is_in_the_rows(lab: Lab) -> None:
    words = ("--gate", "ccrl, ia", "--advisor", "expert,none", "--episodes", "12", "--memory", "true")
    ran = lab("study", "compare", "maze.txt", *words, "--sessions", "3", "--out", "out", "--json")
    document = json.loads(ran.out)
    named = {(row["gate"], row["advisor"], row["episodes"], row["memory"]) for row in document["rows"]}
    assert named == {(gate, advisor, 12, True) for gate in ("ccrl", "ia") for advisor in ("expert", "none")}
    with Path("out/rows.csv").open(encoding="utf-8", newline="") as file:
        assert len([*csv.DictReader(file)]) == len(document["rows"])
    assert "Compared: maze.txt" in Path("out/report.html").read_text(encoding="utf-8")


def test_every_setting_is_an_option(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    told = lab("study", "compare", "--help").out
    for name in SETTINGS:
        assert f"--{name.replace('_', '-')} " in told


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--psi", "x"), "--psi 'x': allowed are numbers"),
        (("--omega", "1.5"), "--omega '1.5': allowed are whole numbers"),
        (("--memory", "maybe"), "--memory 'maybe': allowed are true or false"),
        (("--gate", "ccrl,,ia"), "--gate 'ccrl,,ia': wanted one value, or several with commas between"),
        (("--gate", "cccrl"), "unknown gate 'cccrl' (--gate): did you mean 'ccrl'?"),
        (("--advisor", "terminal"), "has no prompt to ask a person through"),
        (("--alpha", "2"), "alpha = 2.0: allowed above 0 and at most 1"),
    ],
)
def test_a_bad_word_is_said_in_a_line(words: tuple[str, ...], fault: str, lab: Lab) -> None:
    ran = lab("study", "compare", "maze.txt", *words, "--sessions", "2")
    assert ran.code == 2
    assert fault in ran.err
    assert len(ran.err.splitlines()) == 1
    assert not [path.name for path in Path().iterdir() if path.name != "maze.txt"]
