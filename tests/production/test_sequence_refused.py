"""What `lab sequence` refuses: exit 2 before anything is done; what fails: exit 1."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.sequencing import SEQUENCERS
from lab.tasks.task import Order

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def listed(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


KNOWN = ", ".join(sorted(SEQUENCERS))


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("world-1", "world-1: it is a world, there is nothing to sequence: learn it with lab teach world-1"),
        (
            "ovn.toml",
            "no task file 'ovn.toml': give a file that exists, .toml or .txt, or what ships; known: breakfast, class-hurry, ",
        ),
        ("fsm", "unknown task 'fsm' (TASK): did you mean 'fms'? known: breakfast, class-hurry, "),
        ("fms --case RSR --toasts 3", "--case RSR and --toasts 3: an order is one or the other"),
        ("oven.toml --case T --toasts 1", "--case T and --toasts 1: an order is one or the other"),
        (
            "fms --toasts 3",
            "3 parts (--toasts): cell 'fms' makes several products: give their order with --case, such as RSR",
        ),
        (
            "fms --case RXR",
            "order 'RXR' (--case) for cell 'fms': letter 2, 'X', means no product: known: R (rook), S (sign)",
        ),
        ("fms --case rook,sgn", "unknown product 'sgn' (order for cell 'fms'): did you mean 'sign'? known: rook, sign"),
        ("toast --case IV", "unknown case 'IV' (--case): did you mean 'I'? known: I, II, III"),
        ("oven.toml --toasts 0", "an order of 0 parts: allowed are 1 to 200"),
        ("toast --case I --toasts 201", "an order of 201 parts: allowed are 1 to 200"),
        ("oven.toml --toasts 10", "station 'in': capacity 9 cannot hold all 10 parts"),
        ("oven.toml --episodes 0", "invalid value for '--episodes': '0'"),
        ("oven.toml --sessions 0", "invalid value for '--sessions': '0'"),
        ("oven.toml --plot p.pdf", "picture 'p.pdf': plots are written as .png or .svg"),
        ("oven.toml --gantt g", "picture 'g': plots are written as .png or .svg"),
        ("oven.toml --gantt no/g.svg", "picture 'no/g.svg': there is no folder 'no'"),
        ("fms --method carried --policy no.json", "no.json: cannot be read: "),
        ("fms --method carried --policy oven.toml", "policy oven.toml (--policy): Invalid JSON: "),
        (
            "fms --method srl --policy no.json",
            "--policy no.json with --method srl: only carried decides by one, and srl-linear begins",
        ),
        ("fms --cyclic --policy no.json", "--cyclic beside --policy no.json: "),
        ("toast --method srrl", f"unknown method 'srrl' (--method): did you mean 'srl'? known: {KNOWN}"),
    ],
)
@pytest.mark.parametrize("json_too", [False, True], ids=["", "json"])
def test_what_is_refused_at_once(lab: Lab, folder: Path, words: str, line: str, json_too: bool) -> None:
    before = listed(folder)
    ran = lab("sequence", *words.split(), *(["--json"] if json_too else []))
    assert (ran.code, ran.gave_nothing) == (2, True)
    assert line in ran.err
    assert re.fullmatch(r"lab: .*\n", ran.err), "one line"
    assert listed(folder) == before


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("--method srrl", f"unknown method 'srrl' (--method): did you mean 'srl'? known: {KNOWN}"),
        (
            "--objective makespn",
            "unknown objective 'makespn' (--objective): did you mean 'makespan'? known: machine-idle, makespan, ",
        ),
        (
            "--objective tardy-parts",
            "objective 'tardy-parts': the cell has no due times (due_s); without them: makespan, robot-idle, machine-idle",
        ),
        (
            "--advisor exprt --method srl",
            "unknown advisor 'exprt' (--advisor): did you mean 'expert'? known: accuracy=X, ",
        ),
        ("--advisor tau=0 --method srl", "advisor 'tau=0' (--advisor): tau must be a number above 0"),
        (
            "--advisor expert --gate cclr --method srl",
            "unknown gate 'cclr' (--gate, for sequencing): did you mean 'ccrl'? known: always, ccrl, never",
        ),
        (
            "--advisor expert --gate ia --method srl",
            "gate 'ia' (--gate): it needs a table of states, which sequencing does not have; allowed here: ccrl, ",
        ),
        (
            "--gate cclr",
            "unknown gate 'cclr' (--gate, for sequencing): did you mean 'ccrl'? known: always, ccrl, never",
        ),
        ("--advisor exprt", "unknown advisor 'exprt' (--advisor): did you mean 'expert'? known: accuracy=X, "),
        ("--advisor expert", "--advisor expert with --method srl-time: only srl asks for advice"),
        ("--advisor expert --method exact", "--advisor expert with --method exact: only srl asks for advice"),
        ("--advisor terminal --method mc", "--advisor terminal with --method mc: only srl asks for advice"),
    ],
)
def test_what_does_not_fit_is_refused(lab: Lab, folder: Path, words: str, line: str) -> None:
    before = listed(folder)
    for more in ([], ["--json"]):
        ran = lab("sequence", "oven.toml", *words.split(), *more)
        assert (ran.code, ran.gave_nothing) == (2, True)
        assert ran.err.startswith(f"lab: {line}")
        assert len(ran.err.splitlines()) == 1
    assert listed(folder) == before


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("--parts slise=1", "unknown part 'slise' (--parts): did you mean 'slice'? known: cup, slice"),
        ("--parts slice=0,cup=0", "0 parts (--toasts, --parts) for task 'breakfast': allowed are 1 to 50"),
        ("--parts slice=50,cup=1", "51 parts (--toasts, --parts) for task 'breakfast': allowed are 1 to 50"),
        ("--parts cup=1,cup=1", "'cup=1,cup=1' (--parts): wanted kind=number once each, such as slice=2,cup=1"),
        ("--parts two", "'two' (--parts): wanted kind=number once each, such as slice=2,cup=1"),
        ("--parts cup=4", "4 cups (--toasts, --parts) do not fit on 'shelf': its capacity in the task file is 3"),
        ("--toasts 1 --parts cup=1", "--toasts 1 and --parts cup=1: an order is one or the other"),
    ],
)
@pytest.mark.parametrize("command", ["run", "sequence", "view"])
def test_parts_that_cannot_be(lab: Lab, folder: Path, command: str, words: str, line: str) -> None:
    before = listed(folder)
    ran = lab(command, "breakfast", *words.split())
    assert (ran.code, ran.out, ran.err) == (2, "", f"lab: {line}\n")
    assert listed(folder) == before


def test_a_cell_has_no_parts_to_name(lab: Lab) -> None:
    ran = lab("sequence", "fms", "--parts", "rook=1")
    assert ran.err == "lab: --parts rook=1: 'fms' is a cell: give its order with --case or --toasts\n"


def test_run_leads_from_the_cell_to_its_task_in_physics(lab: Lab) -> None:
    ran = lab("run", "fms", "--parts", "rok=1")
    assert (ran.code, ran.err) == (2, "lab: unknown part 'rok' (--parts): did you mean 'rook'? known: rook, sign\n")


@pytest.mark.parametrize(
    "words",
    [
        *("--method x", "--objective x", "--objective mean-tardiness", "--gate x", "--method srl --advisor x"),
        "--advisor expert --method fifo",
    ],
)
def test_bad_names_are_known_before_a_task_is_measured(
    lab: Lab, measured: list[tuple[str, Order, int]], words: str
) -> None:
    ran = lab("sequence", "toast", *words.split())
    assert (ran.code, ran.out, len(ran.err.splitlines()), measured) == (2, "", 1, [])


def test_a_folder_for_a_picture(lab: Lab, folder: Path) -> None:
    (folder / "p.png").mkdir()
    ran = lab("sequence", "oven.toml", "--plot", "p.png")
    assert (ran.code, ran.out, ran.err) == (2, "", "lab: picture 'p.png': it is a folder, a file is wanted\n")


def test_a_deadlock_is_work_that_failed(lab: Lab) -> None:
    """The queue puts both products into the machines at once; a search that looks further gets around it."""
    ran = lab("sequence", "crossing.toml", "--method", "fifo", "--json")
    assert (ran.code, ran.gave_nothing) == (1, True)
    assert ran.err.splitlines()[-1] == "lab: no sequence for 2 parts came to its end in 1 episode: deadlocks"
    document = lab(*["sequence", "crossing.toml", "--method", "random", "--episodes", "50", "--json"]).json
    assert document["makespan_s"] < max(document["episode_costs"])
