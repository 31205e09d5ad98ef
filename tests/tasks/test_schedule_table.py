"""Schedules as others write them: tables and JSON become the same rows, and what is wrong is said with file and line."""

import json
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.tasks.schedule_table import ScheduleTable, TimedRow, read_schedule

SAW = TimedRow("A", "process", None, "saw", "saw", 0.0, 3.0)
MILL = TimedRow("A", "process", None, "mill", "mill", 4.0, 6.0)


def table(folder: Path, text: str, name: str = "plan.csv", *more: str) -> ScheduleTable:
    """What files say: the first so called, others p1.csv, p2.csv."""
    paths = [folder / name, *(folder / f"p{k}.csv" for k in range(1, len(more) + 1))]
    for path, content in zip(paths, (text, *more), strict=True):
        path.write_text(content, encoding="utf-8")
    return read_schedule(paths)


def document(folder: Path, value: Any, *more: Any) -> tuple[TimedRow, ...]:
    """The rows of JSON files."""
    paths = [folder / f"{k}.json" for k in range(len(more) + 1)]
    for path, content in zip(paths, (value, *more), strict=True):
        path.write_text(json.dumps(content), encoding="utf-8")
    return read_schedule(paths).rows


@pytest.mark.parametrize(
    "text",
    [
        "part,station,start,end\nA,mill,4,6\nA,saw,0,3\n",
        "Job;Machine;Start time;Finish time\nA;saw;0;3\nA;mill;4,0;6,0\n",
        "job_id\tmachine_id\tstart_s\tduration_s\nA\tsaw\t0\t3\nA\tmill\t4\t2\n",
        "\ufeffTask,Resource,Start,Finish\nA,saw,2026-05-04T06:00:00,2026-05-04 06:00:03\n"
        "A,mill,2026-05-04T06:00:04,2026-05-04T06:00:06\n",
        "job,machine,begin [min],processing time [min]\n# first\n\nA,saw,0,0.05\nA,mill,,\n".replace(
            "A,mill,,", "A,mill,0.06666666666666667,0.03333333333333333"
        ),
    ],
)
def test_the_same_schedule_in_the_words_of_others(text: str, tmp_path: Path) -> None:
    assert table(tmp_path, text).rows == (SAW, MILL)


@pytest.mark.parametrize(
    "value",
    [
        [{"job": "A", "machine": "saw", "start": 0, "end": 3}, {"job": "A", "machine": "mill", "start": 4, "end": 6}],
        {"machines": {"saw": [{"job": "A", "start": 0, "end": 3}], "mill": [{"job": "A", "start": 4, "duration": 2}]}},
        {"makespan": 6, "jobs": [{"name": "A", "tasks": [
            {"machine": "saw", "start": 0, "end": 3}, {"machine": "mill", "start": 4, "end": 6}]}]},
        # JobShopLab: what its dashboard draws, and a state of its machine
        {"schedules": [
            {"job": "A", "start": 0, "end": 3, "id": "saw", "type": "Schedule", "meta_info": None},
            {"job": "A", "start": 4, "end": 6, "id": "mill", "type": "Schedule", "meta_info": None}], "buffer": []},
        {"state": {"time": {"time": 6}, "jobs": [{"id": "A", "location": "b-1", "operations": [
            {"id": "o-0-0", "start_time": {"time": 0}, "end_time": {"time": 3}, "machine_id": "saw"},
            {"id": "o-0-1", "start_time": {"time": 4}, "end_time": {"time": 6}, "machine_id": "mill"},
            {"id": "o-0-2", "start_time": {"no_time": None}, "end_time": {"no_time": None}, "machine_id": "saw"}]}]}},
    ],
)  # fmt: skip
def test_the_same_schedule_as_json(value: Any, tmp_path: Path) -> None:
    assert document(tmp_path, value) == (SAW, MILL)


def test_bare_numbers_have_their_column_before_them(tmp_path: Path) -> None:
    (row,) = table(tmp_path, "job_id,machine_id,start,end\n2,0,1,5\n").rows
    assert (row.part, row.origin) == ("job 2", "machine 0")


def test_pyjobshops_solution_with_its_problem_and_without(tmp_path: Path) -> None:
    solution = {"objective": 5, "tasks": [
        {"mode": 0, "resources": [0, 1], "start": 0, "end": 2, "idle": 0, "breaks": 0, "present": True},
        {"mode": 1, "resources": [0], "start": 2, "end": 5, "idle": 0, "breaks": 0, "present": True},
        {"mode": 2, "resources": [], "start": 0, "end": 0, "idle": 0, "breaks": 0, "present": False}]}  # fmt: skip
    problem = {
        "jobs": [{"tasks": [0], "name": "order 7"}, {"tasks": [1], "name": ""}],
        "resources": [{"name": "saw"}, {"name": ""}],
        "tasks": [{"job": 0}, {"job": 1}, {"job": None}],
        "modes": [],
    }
    rows = document(tmp_path, solution, problem)
    assert [(row.part, row.origin, row.end_s) for row in rows] == [
        ("order 7", "saw", 2.0),
        ("order 7", "resource 1", 2.0),
        ("job 1", "saw", 5.0),
    ]
    alone = document(tmp_path, solution)
    assert [(row.part, row.origin) for row in alone] == [
        ("task 0", "resource 0"),
        ("task 0", "resource 1"),
        ("task 1", "resource 0"),
    ]
    solution["tasks"][1]["resources"] = [2]  # type: ignore[index]
    with pytest.raises(BadInput, match=r"0.json: line 1: wanted one of the problem's 2 resources, not '2'"):
        document(tmp_path, solution, problem)


def test_vehicles_and_an_arm(tmp_path: Path) -> None:
    vehicles = "job,machine,agv,from,to,start,end\nA,,v1,load,saw,0,2\nA,saw,,,,2,5\n,,v1,saw,load,2,3\n"
    found = table(tmp_path, vehicles)
    assert not found.has_arm
    assert found.rows == (
        TimedRow("A", "carry", "v1", "load", "saw", 0.0, 2.0),
        TimedRow(None, "empty", "v1", "saw", "load", 2.0, 3.0),
        TimedRow("A", "process", None, "saw", "saw", 2.0, 5.0),
    )
    transport = {"transports": [{"type": "Transport", "id": "t-0", "job": "A", "start": 1, "end": 2}]}
    assert document(tmp_path, transport) == (TimedRow("A", "carry", "t-0", None, None, 1.0, 2.0),)
    ours = (
        "part,product,operation,station,target,resource,robot,start_s,end_s,when\n"
        "slice 1,slice,carry,plate,toaster,robot,robot,0,2,planned\n"
        "slice 1,slice,carry,plate,toaster,robot,robot,0,3,measured\n"
        "slice 1,slice,process,toaster,toaster,toaster,,3,9,measured\n"
    )
    found = table(tmp_path, ours)
    assert found.has_arm
    assert [row.end_s for row in found.rows] == [3.0, 9.0]
    assert [row.end_s for row in found.planned] == [2.0]
    assert found.rows[0] == TimedRow("slice 1", "carry", "robot", "plate", "toaster", 0.0, 3.0)


def test_where_stations_stand(tmp_path: Path) -> None:
    found = table(tmp_path, "part,station,start,end\nA,saw,0,3\n", "plan.csv", "station,x,y\nsaw,1.5,-2\n")
    assert found.places_m == {"saw": (1.5, -2.0)}
    assert found.rows == (SAW,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("job,machine,strat,end\nA,saw,0,3\n", r"line 1: no column among .* is a start; did you mean 'start' by 'strat'\?"),
        ("job,start,end\nA,0,3\n", "line 1: no column among 'job, start, end' is a station; known: station, machine"),
        ("job,machine,start,end\nA,saw,0,3\nB,saw,x3,4\n", "line 3: wanted a number from 0 to 1e.08 as 'start', or .*'x3'"),
        ("job,machine,start,end\nA,saw,-1,3\n", "line 2: wanted a number from 0 .*, not '-1'"),
        ("job,machine,start,end\nA,saw,nan,3\n", "line 2: wanted a number from 0 .*, not 'nan'"),
        ("job,machine,start,end\nA,saw,5,3\n", "line 2: wanted an end that is not before the start, 5 s, not '3 s'"),
        ("job,machine,start,end\nA,saw,5\n", "line 2: wanted 4 values, as the header has, not '3: A,saw,5'"),
        ("job,machine,start,end\nA,saw,5,\n", "line 2: wanted an end or a duration in every row"),
        (
            "job,operation,robot,from,to,start,end\nA,carry,arm,in,saw,0,3\n,carry,arm,saw,out,4,6\n",
            "line 3: wanted a part in a row that says 'carry'",
        ),
        ("job,machine,start,end\nA,saw,0,1\nB,saw,2026-01-01,2026-01-02\n", "line 3: wanted all times to be numbers or all"),
        ("job,machine,start,end\n", "none has a start and an end"),
        ("", "wanted a header such as part,station,start,end"),
        ('{"a": 1}', "none has a start and an end"),
        ('[{"job": "A", "machine": 1, "strat": 0}]', "none has a start and an end; did you mean 'start' by 'strat'"),
        ('[{"job": "A", "start": 0, "end": 1}]', "none has a machine, not only end, job, start"),
        ('{\n"tasks": [\n{"job": 1, "machine": 2, "start": 4, "end": 2}]}', "line 3: wanted an end that is not before"),
        ('[{"job": 1, "machine": 2, "start": 0, "end": 1%s}]' % ("0" * 400), "line 1: wanted a number from 0 .* as 'end'"),
        ('{"a": 1', "line 1: wanted JSON"),
        ("[" * 60 + "]" * 60, "wanted JSON in which nothing is more than 50 deep"),
        ('{"a": NaN}', "wanted JSON that can be read: NaN is not allowed"),
        ("part,station,start,end\n" + "A,saw,0,1\n" * 20_001, "20001 rows: at most 20000 are shown"),
        ("part,station,start,end\n" + "".join(f"p{k},saw,0,1\n" for k in range(1001)), "1001 parts: at most 1000"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_file_and_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=said) as error:
        table(tmp_path, text)
    assert "plan.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"nothing.csv' cannot be read: No such file"):
        read_schedule([tmp_path / "nothing.csv"])
    (tmp_path / "dead.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match=r"dead.csv' is no text: wanted a table \(.csv\) or a .json file"):
        read_schedule([tmp_path / "dead.csv"])
