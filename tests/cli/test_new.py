"""`lab new`: a task file of one's own, which runs."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.tasks.task_file import load

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]


def test_a_new_task_runs(lab: Lab, folder: Path) -> None:
    ran = lab("new", "pens", "--part", "pen=cylinder:0.02x0.1:1", "--json")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json == {"file": "pens.toml", "arm": "up6", "parts": 1, "stations": 2}
    ran = lab("run", "pens.toml", "--json")
    assert (ran.code, ran.json["success"], ran.json["delivered"]) == (0, True, 1)


def test_options_say_all_and_nothing_is_asked(lab: Lab, folder: Path) -> None:
    words = "new bakery --part box:0.12x0.015x0.12:2 --machine oven:60 --machine paint:5 --arm up6 --buffer"
    assert lab(*words.split()).out == (
        "bakery.toml: 2 parts and 6 stations around the arm up6\n"
        "look at it: lab task check bakery.toml --plot cell.png\nrun it: lab run bakery.toml\n"
    )
    task = load("bakery.toml")
    assert [s.name for s in task.stations] == ["input", "oven_buffer", "oven", "paint_buffer", "paint", "output"]
    assert task.station("oven").processing_s == 60.0


def test_questions_are_answered_by_lines(lab: Lab, folder: Path) -> None:
    ran = lab("new", "cups", stdin="\ncup=cylinder:0.03x0.1:2\n\nno\n")
    assert ran.code == 0
    assert "Which arm: up6, panda, iiwa, xarm6? [up6]" in ran.err
    assert [part.name for part in load("cups.toml").parts] == ["cup"]
    text = (folder / "cups.toml").read_text(encoding="utf-8")
    assert lab("new", "cups", "--yes").err == (
        "lab: task file 'cups.toml' (NAME): there is one already: choose another name, or remove it\n"
    )
    assert (folder / "cups.toml").read_text(encoding="utf-8") == text


def test_yes_takes_the_defaults(lab: Lab, folder: Path) -> None:
    assert lab("new", "mine", "--yes", "--json").json == {"file": "mine.toml", "arm": "up6", "parts": 3, "stations": 3}


def test_thin_parts_of_an_own_mass_and_a_machine_for_two(lab: Lab, folder: Path) -> None:
    words = "new pins --part pin=cylinder:0.012x0.04:2 --mass pin=0.05 --friction pin=0.6 --machine oven:5 --capacity oven=2"
    assert lab(*words.split()).code == 0
    task = load("pins.toml")
    assert (task.part("pin").mass_kg, task.part("pin").friction, task.station("oven").capacity) == (0.05, 0.6, 2)
    assert lab("task", "check", "pins.toml").code == 0


def test_a_machine_with_batches(lab: Lab, folder: Path) -> None:
    words = ["new", "pins", "--part", "pin=cylinder:0.02x0.04:2", "--machine", "oven:5", "--batch", "oven"]
    assert (
        lab(*words).err.strip()
        == "lab: 'oven' (--batch): it holds 1 part, a batch needs room for 2: add --capacity oven=2"
    )
    assert "unknown machine 'oben' (--batch): did you mean 'oven'?" in lab(*words[:-1], "oben").err
    assert not Path("pins.toml").exists()
    assert lab(*words, "--capacity", "oven=2").code == 0
    assert load("pins.toml").station("oven").batch


@pytest.mark.slow
def test_a_refusal_says_the_mass_that_would_do(lab: Lab, folder: Path, tree: Tree) -> None:
    words = "new x --part pin=cylinder:0.03x0.08:1 --friction pin=0.15"
    refused = lab(*words.split(), "--mass", "pin=2", "--json")
    assert (refused.code, refused.gave_nothing, tree(folder)) == (2, True, [])
    said = "lab: robot.grip_force_n = 200, chosen for it: pin of 2 kg, friction 0.15, is not held: "
    assert refused.err.splitlines()[-1].startswith(said)
    (wanted,) = re.findall("held with --mass (pin=[0-9.]+)$", refused.err.strip())
    assert lab(*words.split(), "--mass", wanted).code == 0


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            "new x",
            "the input ended at 'Which arm: up6, panda, iiwa, xarm6?': with --yes nothing is asked, see lab new --help",
        ),
        ("new x --arm pnda", "unknown arm 'pnda' (--arm): did you mean 'panda'? known: iiwa, panda, up6, xarm6"),
        ("new x --machine oven:-3", "machine 'oven:-3' (--machine): '-3' seconds: allowed are 0 to 86400"),
        ("new x --part box:0.06x0.05x0.1:2", "part 'box' cannot be gripped: "),
        ("new no/x --yes", "task file 'no/x.toml' (NAME): there is no folder 'no'"),
    ],
)
def test_wrong_words_write_nothing(lab: Lab, folder: Path, tree: Tree, words: str, line: str) -> None:
    ran = lab(*words.split(), "--json")
    assert (ran.code, ran.gave_nothing) == (2, True)
    assert ran.err.splitlines()[-1].startswith(f"lab: {line}")
    assert tree(folder) == []
