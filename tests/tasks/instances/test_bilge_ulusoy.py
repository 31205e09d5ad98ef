"""Job sets as CSV: which set and layout --case names, and the times that are retyped from Bilge and Ulusoy's paper."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.tasks.cell_file import CellFile
from lab.tasks.instances import InstanceRequest

JOBS = "set,job,operation,machine,time\n7,1,1,M1,8\n7,1,2,M2,16\n7,2,1,M2,20\n8,1,1,M1,3\n"


@pytest.mark.parametrize("case", ["7:1", "EX71"])
def test_a_case_names_set_and_layout(read: Callable[..., CellFile], tmp_path: Path, case: str) -> None:
    layouts = tmp_path / "layouts.csv"
    pairs = [(a, b) for a in ("LU", "M1", "M2") for b in ("LU", "M1", "M2") if a != b]
    rows = [f"{n},{a},{b},{n * 10 + len(a + b)}" for n in (1, 2) for a, b in pairs]
    layouts.write_text("\n".join(["layout,from,to,time", *rows]))
    file = read(JOBS, "jobs.csv", InstanceRequest(layouts, 2, case))
    cell = file.cell()
    assert file.name == "EX71"
    assert (cell.order, len(cell.robots)) == (("job1", "job2"), 2)
    assert {*cell.loaded_s[cell.loaded_s > 0]} == {14.0}
    # The makespan is the end of the last operation: the routes end at the machines.
    assert [product.routes[0][-1].station for product in cell.products] == ["M2", "M2"]


@pytest.mark.parametrize(
    ("old", "new", "case", "expected"),
    [
        ("7,2,1", "7,2,x", "7:1", "line 4: wanted the operation, a whole number from 1 to 99, not 'x'"),
        ("7,2,1", "7,1,1", "7:1", "line 4: wanted operation 1 of job 1 of set 7 once: this is the second"),
        ("7,1,2", "7,1,3", "7:1", "line 3: wanted operation 2 of job 1 before, not '3'"),
        ("7,2,1", "7,3,1", "7:1", "line 4: wanted job 2 before job 3: it has no row"),
        ("M2,20", "M9,20", "7:1", "line 4: wanted a machine of the layout (M1, M2), not 'M9'"),
        (",20", "", "7:1", "line 4: wanted 5 values (set,job,operation,machine,time), not '7,2,1,M2'"),
        ("", "", "9:1", "wanted one set of jobs; the file has 7, 8: there is no set '9' (--case)"),
        ("", "", None, "wanted one set of jobs; the file has 7, 8: say which with --case SET:LAYOUT, such as 7:1"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    refused: Callable[..., str], layout: Path, old: str, new: str, case: str | None, expected: str
) -> None:
    assert refused(JOBS.replace(old, new, 1), "jobs.csv", InstanceRequest(layout, 2, case)) == f"jobs.csv: {expected}"


def test_a_layout_of_other_machines_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("from,to,time\nA,M1,2\n")
    said = refused(JOBS, "jobs.csv", InstanceRequest(other, 1, "7:1"))
    assert "wanted a" in said
