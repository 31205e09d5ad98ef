"""`lab.sequence`: the document of the command, and what is read from it."""

import json
from pathlib import Path

import pytest

import lab
from lab.sequencing.simulate.follow import simulate
from lab.tasks.task_file import load_cell


def test_it_finds_what_the_command_finds(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    told = request.getfixturevalue("lab")("sequence", "toast", "--case", "II", "--toasts", "3", "--json")
    order = lab.sequence("toast", case="II", toasts=3)
    command = json.loads(told.out)
    assert {name: command[name] for name in order.document} == order.document
    assert order.proven
    assert order.cost == order.bound == command["best_cost"]
    assert order.moves[0] == "toast 1: plate > toaster"
    assert order.gantt.save(tmp_path / "order.svg").is_file()
    assert "<svg" in order._repr_html_()


def test_a_cell_itself_is_ordered() -> None:
    cell = load_cell("toast-case-2").cell(2)
    order = lab.sequence(cell, method="fifo")
    assert order.cost == pytest.approx(simulate(cell, order.document["best_sequence"]).makespan_s)
    assert max(row["end_s"] for row in order.rows()) == pytest.approx(order.cost)
    assert len(order.to_dataframe()) == len(order.rows())


def test_what_cannot_be_is_said_in_a_line() -> None:
    with pytest.raises(lab.BadInput, match=r"unknown option 'tosts' .*did you mean 'toasts'"):
        lab.sequence("toast", tosts=3)  # type: ignore[call-arg]
    with pytest.raises(lab.BadInput, match="beside a Cell"):
        lab.sequence(load_cell("toast-case-2").cell(2), toasts=3)
    with pytest.raises(lab.BadInput, match="unknown method"):
        lab.sequence("toast", case="I", method="srrl")
