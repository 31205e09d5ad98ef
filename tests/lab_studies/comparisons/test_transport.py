"""The board of orders of work: its instances, an entry of each sort, what is told of them, and what the checker catches."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput, WorkFailed
from lab.studies import run_study
from lab.studies.findings import those
from lab.studies.runner import STORE, Job
from lab_studies.comparisons.transport import entries_of, faults_of, measured, rows_of, transport, verification
from lab_studies.comparisons.transport_entries import CYCLIC, PROVERS, Entry, EntryResult, entry_result
from lab_studies.comparisons.transport_instances import Instance, board, cell_of, own_instances

TOAST = next(one for one in board() if one.name == "case I, 3 toasts")
EX11 = next(one for one in board() if (one.name, one.robots) == ("bu-11", 2))
HOIST = next(one for one in board() if one.is_cyclic)
# One job of two operations, on two machines: 3 + 4.
TINY = "1 2\n0 3 1 4\n"


@pytest.fixture
def tiny(tmp_path: Path) -> Instance:
    path = tmp_path / "tiny.jsp"
    path.write_text(TINY, encoding="utf-8")
    return own_instances([path])[0]


def test_every_instance_that_comes_with_the_lab_can_be_read() -> None:
    instances = board()
    assert len({(one.family, one.name) for one in instances}) == len(instances) == 114
    assert [len(cell_of(one).order) for one in (EX11, TOAST)] == [5, 3]
    assert len(cell_of(EX11).robots) == 2
    assert all(cell_of(one).parts > 0 for one in instances)
    assert all((one.printed is None) == (one.printed_is == "") for one in instances)


@pytest.mark.parametrize("method", ["fifo", "anneal", "exact", "portfolio"])
def test_an_entry_by_hand(tiny: Instance, method: str) -> None:
    """7 s, which a machine that has one job only cannot be late for."""
    found = entry_result(Entry(tiny, method, 0.1, 0))
    if found.refused:
        assert (method, found.cost) == ("exact", None)
        assert found.refused.startswith("neither by states nor by tours: ")
        return
    assert (found.cost, found.ends_s, found.trace[-1][1]) == (7.0, 7.0, 7.0)
    assert {one[1] for one in found.schedule} >= {"process"}
    assert (found.bound == 7.0) == (method in PROVERS)


def test_what_a_method_does_not_take_is_told() -> None:
    found = entry_result(Entry(EX11, "exact", 0.1, 0))
    assert (found.cost, found.refused) == (None, "neither by states nor by tours: it needs one robot")


def test_a_cycle_is_measured_by_its_period_and_shown_part_by_part() -> None:
    found = entry_result(Entry(HOIST, CYCLIC, 60.0, 0))
    assert found.cost == pytest.approx(521.0)
    assert found.bound == pytest.approx(521.0)
    assert found.ends_s > 12 * 521.0
    assert faults_of(Entry(HOIST, CYCLIC, 60.0, 0), found) == []


def test_a_line_a_method() -> None:
    of = {
        "fifo": EntryResult(120.0, "fifo", trace=((0.01, 120.0),)),
        "portfolio": EntryResult(100.0, "CP-SAT", 100.0, "CP-SAT", ((2.0, 100.0),)),
        "srl": EntryResult(refused="not found"),
    }
    rows = rows_of(replace(EX11, printed=100.0), of)
    assert [one["method"] for one in those(rows, measure="cost")] == ["fifo", "portfolio"]
    assert [one["value"] for one in those(rows, measure="gap_percent")] == [pytest.approx(20.0), 0.0]
    costs = those(rows, measure="cost")
    assert [(one["proven"], one["proven by"]) for one in costs] == [(False, None), (True, "CP-SAT")]
    assert [(one["robots"], one["bound"], one["seconds"]) for one in costs] == [(2, 100.0, 0.01), (2, 100.0, 2.0)]
    assert {(one["printed"], one["printed as"]) for one in rows} == {(100.0, EX11.printed_is)}


def test_what_is_kept_is_not_measured_again(tiny: Instance, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job(1, folder=tmp_path / "out")
    entries = entries_of([tiny], ["fifo", "nearest-ready"], 0.1, 0)
    found = measured(job, entries)
    store = tmp_path / "out" / STORE
    store.write_text(store.read_text(encoding="utf-8") + '{"entry": 3}\nno json\n', encoding="utf-8")
    monkeypatch.setattr("lab_studies.comparisons.transport.entry_result", lambda _: pytest.fail("it is kept"))
    assert measured(job, entries) == found
    assert len(found) == 2


def changed(record: dict[str, Any], column: int, value: object) -> dict[str, Any]:
    """With another value in the schedule's first process."""
    rows = record["found"]["schedule"]
    next(row for row in rows if row[1] == "process")[column] = value
    return record


@pytest.mark.parametrize(
    ("column", "value", "says"),
    [
        (5, 1.0, r"^1 schedule of 1 found wrong: tiny\.jsp, fifo: "),  # it begins later
        (2, "elsewhere", r"^1 schedule of 1 found wrong: tiny\.jsp, fifo: "),
        (0, "nobody", r"^1 schedule of 1 found wrong: tiny\.jsp, fifo: an impossible row: "),
    ],
)
def test_a_schedule_that_was_tampered_with_is_found(
    tiny: Instance, tmp_path: Path, column: int, value: object, says: str
) -> None:
    out = tmp_path / "out"
    reading: Mapping[str, Any] = {"instances": [Path(tiny.file)], "methods": ["fifo"], "verify": True}
    assert run_study("transport", Job(1), out, reading)["summary"]["schedules that the checker found right"] == "1 of 1"
    store = out / STORE
    record = changed(json.loads(store.read_text(encoding="utf-8")), column, value)
    store.write_text(json.dumps(record) + "\n", encoding="utf-8")
    with pytest.raises(WorkFailed, match=says):
        run_study("transport", Job(1), out, reading)


def test_a_claim_of_another_cost_is_found(tiny: Instance) -> None:
    entry = Entry(tiny, "fifo", 0.1, 0)
    found = entry_result(entry)
    assert verification({entry: found}) == "1 of 1"
    with pytest.raises(WorkFailed, match=r"it ends at 7, not at 6$"):
        verification({entry: replace(found, cost=6.0)})


def test_what_is_told_of_all(tiny: Instance) -> None:
    reading = {"instances": [Path(tiny.file)], "methods": ["fifo", "portfolio"], "seconds": 0.1}
    told = transport(Job(1), reading)
    assert told.summary == {"instances": 1, "entries": 2, "optima proven here": 1}
    means = those(told.rows, measure="mean gap_percent")
    assert [one["value"] for one in means] == [0.0, 0.0]
    assert [one["best known found"] for one in means] == ["1 of 1", "1 of 1"]
    assert [one["proven alone"] for one in means] == ["0 of 1", "1 of 1"]
    assert len(told.figures) == 2


@pytest.mark.parametrize(
    ("reading", "says"),
    [
        ({"methods": ["fifa"]}, r"^unknown method 'fifa' \(--methods\): did you mean 'fifo'\?"),
        (
            {"instances": [Path("nowhere.jsp")]},
            r"^instance 'nowhere\.jsp' \(--instances\): there is no such file or folder$",
        ),
        (
            {"advisor_table": "exact"},
            r"^--advisor-table: the study 'transport' has none to choose; it is for table-9\.2, ",
        ),
    ],
)
def test_what_is_refused(tmp_path: Path, reading: Mapping[str, Any], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        run_study("transport", Job(1), tmp_path / "out", reading)
    assert not (tmp_path / "out").exists()
