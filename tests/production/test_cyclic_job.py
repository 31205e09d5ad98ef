"""What `lab sequence --cyclic` answers, and what it refuses."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
CONTRACT = {"robots", "period_s", "bound_s", "proven", "moves"}  # of what CLI.md promises


def test_the_document_of_a_cell(lab: Lab) -> None:
    ran = lab("sequence", "toast-case-2", "--cyclic", "--json")
    assert ran.code == 0, ran.err
    found = ran.json
    assert set(found) >= CONTRACT
    assert (found["period_s"], found["bound_s"], found["proven"]) == (200.0, 200.0, True)
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
    ran = lab("sequence", "hoist-pu", "--cyclic", "--gantt", str(picture))
    assert ran.code == 0, ran.err
    lines = ran.out.splitlines()
    assert lines[0] == "every 521.00 s: 1 carrier, 6.9 parts an hour (seed 0)"
    assert lines[1] == "proven: no cycle of 1 carrier is shorter; 4 parts in work at once at the most"
    assert sum(" > tank-" in line or " > unload" in line for line in lines) == 13
    assert lines[-1] == str(picture)
    assert "the period: 521 s" in picture.read_text(encoding="utf-8")


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


def test_a_run_has_one_order(lab: Lab) -> None:
    ran = lab("run", "toast", "--cyclic", "--order", "1,2")
    assert (ran.code, ran.out) == (2, "")
    assert "--cyclic and --order 1,2: an order is one or the other" in ran.err
