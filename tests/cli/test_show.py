"""`lab show`: a schedule as one page."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
PLAN = "job,machine,start,end\nA,saw,0,3\nA,mill,4,6\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plan.csv").write_text(PLAN)


def test_a_page_beside_which_nothing_is_needed(lab: Lab) -> None:
    ran = lab("show", "plan.csv", "--json")
    assert ran.code == 0
    assert json.loads(ran.out) == {
        "file": "plan.html",
        "parts": ["A"],
        "stations": ["saw", "mill"],
        "vehicles": [],
        "rows": 2,
        "makespan_s": 6.0,
    }
    page = Path("plan.html").read_text(encoding="utf-8")
    assert "<title>plan: 1 part, 2 stations, 6 s</title>" in page
    assert 'src="' not in page.partition("<script>")[0]
    assert "connect-src" not in page  # nothing is fetched


def test_out_names_the_page(lab: Lab) -> None:
    assert lab("show", "plan.csv", "--out", "a/b.html").out == "a/b.html\n"
    assert Path("a/b.html").is_file()
    ran = lab("show", "plan.csv", "--out", "plan.htm")
    assert (ran.code, ran.err) == (2, "lab: page 'plan.htm' (--out): its name must end in .html\n")


def test_the_plan_of_lab_sequence(lab: Lab) -> None:
    planned = lab("sequence", "toast-case-1", "--toasts", "1", "--schedule", "order.csv", "--json")
    assert planned.code == 0
    told = json.loads(lab("show", "order.csv", "--json").out)
    Path("order.json").write_text(planned.out)
    again = json.loads(lab("show", "order.json", "--json").out)
    assert told["makespan_s"] == again["makespan_s"] == json.loads(planned.out)["best_s"]
    assert told["vehicles"] == again["vehicles"] == ["robot"]
    assert told["parts"] == again["parts"]
    assert told["rows"] == again["rows"]


def test_a_runs_folder_and_a_place_for_each_station(lab: Lab) -> None:
    Path("run").mkdir()
    Path("run/schedule.csv").write_text(PLAN)
    Path("places.csv").write_text("station,x,y\nsaw,0,0\nmill,0,3\n")
    assert json.loads(lab("show", "run", "places.csv", "--json").out)["file"] == "run.html"
    ran = lab("show", "places.csv")
    assert ran.code == 2
    assert "none has a start and an end" in ran.err


def test_the_table_in_the_docs(lab: Lab, root: Path) -> None:
    page = (root / "docs" / "ordering.md").read_text(encoding="utf-8")
    Path("agvs.csv").write_text(page.partition("```csv\n")[2].partition("```")[0])
    told = json.loads(lab("show", "agvs.csv", "--json").out)
    assert (told["vehicles"], told["parts"], told["makespan_s"]) == (["AGV 1"], ["frame 1", "frame 2"], 90.0)


def test_a_bad_table_writes_nothing(lab: Lab) -> None:
    Path("plan.csv").write_text(PLAN + "B,saw,9,8\n")
    ran = lab("show", "plan.csv")
    assert ran.code == 2
    assert ran.err == "lab: plan.csv: line 4: wanted an end that is not before the start, 9 s, not '8 s'\n"
    assert [path.name for path in Path().iterdir()] == ["plan.csv"]
