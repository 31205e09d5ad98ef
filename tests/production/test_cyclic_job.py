"""What `lab sequence --cyclic` answers, and what it refuses."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
CONTRACT = {"robots", "period_s", "bound_s", "proven", "proven_of", "moves"}  # of what CLI.md promises
MILLS = """
name = "mills"
kind = "cell"
title = "Two mills"
order = ["part", "part", "part", "part"]
stations = [
  { name = "in", kind = "storage", capacity = 9 },
  { name = "mill-1", kind = "machine", capacity = 1, processing_s = 30 },
  { name = "mill-2", kind = "machine", capacity = 1, processing_s = 30 },
  { name = "out", kind = "storage", capacity = 9 },
]
robot = { start = "in" }
products = [{ name = "part", routes = [["in", "mill-1", "out"], ["in", "mill-2", "out"]] }]
[travel]
in = { mill-1 = 1, mill-2 = 1, out = 1 }
mill-1 = { in = 1, mill-2 = 1, out = 1 }
mill-2 = { in = 1, mill-1 = 1, out = 1 }
out = { in = 1, mill-1 = 1, mill-2 = 1 }
"""


def test_the_document_of_a_cell(lab: Lab) -> None:
    ran = lab("sequence", "toast-case-2", "--cyclic", "--json")
    assert ran.code == 0, ran.err
    found = ran.json
    assert set(found) >= CONTRACT
    assert (found["period_s"], found["bound_s"], found["proven"], found["proven_of"]) == (
        200.0,
        200.0,
        True,
        "all cycles",
    )
    assert (found["per_part_s"], found["parts_per_hour"], found["most_in_work"]) == (200.0, 18.0, 2)
    assert [(move["origin"], move["target"]) for move in found["moves"]] == [
        ("plate", "toaster"),
        ("butter_applier", "finished_plate"),
        ("toaster", "butter_applier"),
    ]
    finite = found["finite"]
    assert (finite["parts"], finite["cyclic_makespan_s"], finite["best_s"]) == (6, 1310.0, 1300.0)
    assert finite["best_proven"] is True


def test_several_parts_a_cycle_are_asked_for_as_an_order_is(lab: Lab) -> None:
    two = lab("sequence", "toast", "--case", "I", "-n", "2", "--cyclic", "--json").json
    assert (two["mix"], two["period_s"], two["per_part_s"]) == (["toast", "toast"], 300.0, 150.0)


def test_the_hoist_that_ships(lab: Lab, tmp_path: Path) -> None:
    picture = tmp_path / "cycle.svg"
    ran = lab("sequence", "hoist-pu", "--cyclic", "--parts-per-cycle", "1", "--gantt", str(picture))
    assert ran.code == 0, ran.err
    lines = ran.out.splitlines()
    assert lines[0] == "every 521.00 s: 1 carrier, 6.9 parts an hour (seed 0)"
    assert lines[1] == "4 parts in work at once at the most"
    assert lines[2] == "proven: of cycles of 1 carrier none needs less a part; of all cycles none less than 374.00 s"
    assert sum(" > tank-" in line or " > unload" in line for line in lines) == 13
    assert lines[-1] == str(picture)
    assert "the period: 521 s" in picture.read_text(encoding="utf-8")


def test_several_parts_a_cycle_are_looked_for(lab: Lab, tmp_path: Path) -> None:
    """Two mills in parallel: (30 + 3) / 2 s a part."""
    file = tmp_path / "mills.toml"
    file.write_text(MILLS, encoding="utf-8")
    found = lab("sequence", str(file), "--cyclic", "--json").json
    assert (found["parts_a_cycle"], found["mix"]) == (2, ["part", "part"])
    assert (found["per_part_s"], found["bound_per_part_s"], found["proven_of"]) == (16.5, 16.5, "all cycles")
    assert [(row["parts_a_cycle"], row["period_s"]) for row in found["tried"]] == [(1, 33.0), (2, 33.0)]
    assert (found["most_parts_a_cycle"], found["why_no_more"]) == (2, None)
    one = lab("sequence", str(file), "--cyclic", "--parts-per-cycle", "1", "--json").json
    assert (one["per_part_s"], one["proven"], one["proven_of"]) == (33.0, True, "cycles of 1 part")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (
            "toast-case-1 --method srl",
            "--cyclic beside --method srl: the shortest cycle of its parts is found and proven",
        ),
        ("toast-case-1 --stochastic", "--cyclic beside --stochastic: "),
        ("toast-case-1 --sessions 3", "--cyclic beside --sessions 3: "),
        ("toast-case-1 --objective mean-tardiness", "--cyclic beside --objective mean-tardiness: "),
        ("toast-case-1 --plot a.png", "--cyclic beside --plot a.png: a cycle has no episodes"),
        ("toast-case-1 --gantt a.gif", "picture 'a.gif'"),
        ("toast-case-1 --resume here", "--cyclic beside --resume here"),
        ("toast-case-1 --parts toast=2", "is a cell: give its cycle with --case or --toasts"),
        ("toast-case-1 --case TT -n 2", "--case TT and --toasts 2: a cycle is one or the other"),
        ("toast-case-1 -n 40", "too many for a cycle of 40 parts"),
        ("toast-case-1 -n 0", "0"),
        (
            "toast-case-1 --parts-per-cycle 0",
            "--parts-per-cycle 0: a cycle has 1 toast at the least: allowed are 1 or more",
        ),
        (
            "toast-case-1 -n 3 --parts-per-cycle 2",
            "--parts-per-cycle 2: a cycle has 3 toasts at the least: allowed are 3 or more",
        ),
        ("fms", "--cyclic: parts arrive one by one in this cell"),
        ("world-1", "it is a world, there is nothing to sequence"),
        ("two-toasters --case I", "case 'I' (--case): task 'two-toasters' has none"),
    ],
)
def test_what_cannot_be_combined_is_refused_in_words(lab: Lab, words: str, reason: str) -> None:
    ran = lab("sequence", *words.split(), "--cyclic")
    assert ran.code == 2
    assert ran.out == ""
    assert reason in ran.err
    assert ran.err.strip().splitlines()[-1].startswith("lab: ")


@pytest.mark.parametrize("words", ["sequence toast-case-1", "run toast"])
def test_only_a_cycle_has_so_many_parts(lab: Lab, words: str) -> None:
    ran = lab(*words.split(), "--parts-per-cycle", "2")
    assert (ran.code, ran.out) == (2, "")
    assert "--parts-per-cycle 2: only a cycle has as many: add --cyclic" in ran.err


def test_a_run_s_cycle_has_a_mix_at_the_least(lab: Lab) -> None:
    ran = lab("run", "breakfast", "--cyclic", "--parts-per-cycle", "1")
    assert (ran.code, ran.out) == (2, "")
    assert "--parts-per-cycle 1: a cycle has " in ran.err


def test_a_run_has_one_order(lab: Lab) -> None:
    ran = lab("run", "toast", "--cyclic", "--order", "1,2")
    assert (ran.code, ran.out) == (2, "")
    assert "--cyclic and --order 1,2: an order is one or the other" in ran.err
