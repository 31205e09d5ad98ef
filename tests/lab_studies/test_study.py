"""Studies from the outside: what a folder holds afterwards, what is refused, Ctrl-C; and advice recorded for another session."""

import csv
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lab.errors import BadInput
from lab.studies import STUDIES, Study, run_study
from lab.studies.findings import Findings, row
from lab.studies.runner import STORE, Job
from lab.tasks.task_file import load_world
from lab_studies.thesis import chapter_9_cells, chapter_9_sessions
from lab_studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, sessions_of

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
KNOWN = ", ".join(sorted(STUDIES)[:5])
STUDY_COMMANDS = (["study", "list"], ["study", "run"])


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to run in, with a toolbox of its own that is not there yet; figure 9.4 has two decay factors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(chapter_9_cells, "BETAS", (0.7, 1.3))
    return tmp_path


def tree(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def study(
    name: str = "figure-9.4", out: str = "out", seed: int = 0, advisor_table: str | None = None
) -> dict[str, Any]:
    reading = {} if advisor_table is None else {"advisor_table": advisor_table}
    return run_study(name, Job(10, seed), Path(out), reading)


# ---- what a study writes ------------------------------------------------------------------------------------------


def test_a_study_writes_its_folder(folder: Path) -> None:
    document = study(out="deep/out")
    assert {"report.html", "rows.csv", STORE} <= {*tree(folder / "deep" / "out")}
    files = document["files"]
    assert {path.name for path in map(Path, files.values())} == {*tree(folder / "deep" / "out")}
    assert [Path(files[name]).name for name in ("report", "rows", "sessions")] == ["report.html", "rows.csv", STORE]
    with Path(files["rows"]).open(encoding="utf-8", newline="") as file:
        assert [float(one["value"]) for one in csv.DictReader(file)] == [one["value"] for one in document["rows"]]
    page = Path(files["report"]).read_text(encoding="utf-8")
    assert STUDIES["figure-9.4"].title in page
    assert page.count("<figure>") == 1
    assert all(note in page for note in document["notes"])
    for path in (folder / "deep" / "out").glob("*.svg"):
        ElementTree.fromstring(path.read_text(encoding="utf-8"))
    assert (document["study"], document["seed"], document["sessions"]) == ("figure-9.4", 0, 10)
    assert {"sessions": 10, "seed": 0, "cells": 2}.items() <= document["summary"].items()
    keys = [json.loads(line)["key"] for line in Path(files["sessions"]).read_text(encoding="utf-8").splitlines()]
    assert keys == [AdviceSetting(w, beta=b).key(10, 0) for w in ("world-1", "world-2") for b in (0.7, 1.3)]


def test_the_seed_decides(folder: Path) -> None:
    first, again, other = (study(out=out, seed=seed) for out, seed in (("a", 0), ("b", 0), ("c", 1)))
    assert first["rows"] == again["rows"] != other["rows"]
    assert (folder / "a" / "rows.csv").read_bytes() == (folder / "b" / "rows.csv").read_bytes()


def test_the_advisor_table_is_handed_on() -> None:
    rows = {table: study("table-9.2", advisor_table=table)["rows"] for table in (None, "learned", "exact")}
    assert rows[None] == rows["learned"] != rows["exact"]
    assert {one["advisor_table"] for one in rows["exact"] if one["thesis"] is not None} == {"exact"}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"name": "figure-9.5"},
            r"^unknown study 'figure-9\.5' \(STUDY\): did you mean 'figure-9\.4'\? known: advice-budget, .* more$",
        ),
        ({"advisor_table": "learnt"}, r"^unknown advisor table 'learnt' \(--advisor-table\): did you mean 'learned'\?"),
        ({"out": "taken"}, r"^output folder 'taken' \(--out\): 'taken' is a file; give a folder$"),
        ({"out": "taken/below"}, r"^output folder 'taken/below' \(--out\): 'taken' is a file; give a folder$"),
    ],
)
def test_what_is_refused_writes_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], says: str
) -> None:
    (folder / "taken").write_text("mine", encoding="utf-8")
    monkeypatch.setattr(chapter_9_sessions, "sessions_of", lambda *_, **__: pytest.fail("nothing is to be learned"))
    with pytest.raises(BadInput, match=says):
        study(**changes)
    assert tree(folder) == ["taken"]
    assert (folder / "taken").read_text(encoding="utf-8") == "mine"


def test_a_row_is_all_that_a_new_study_needs(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is listed, run and reported as the others are."""

    def dummy(job: Job, reading: Mapping[str, Any]) -> Findings:
        return Findings([row({"seed": job.seed}, "answer_steps", 42.0)], {"read": dict(reading)})

    monkeypatch.setitem(STUDIES, "dummy", Study("A dummy", dummy, reads=("advisor_table",)))
    assert {"name": "dummy", "title": "A dummy"} in lab("study", "list", "--json").json["studies"]
    document = lab("study", "run", "dummy", "--advisor-table", "exact", "--seed", "7", "--json").json
    assert [(one["seed"], one["value"]) for one in document["rows"]] == [(7, 42.0)]
    assert document["summary"]["read"] == {"advisor_table": "exact"}
    assert "<h1>A dummy</h1>" in Path(document["files"]["report"]).read_text(encoding="utf-8")


# ---- Ctrl-C -------------------------------------------------------------------------------------------------------


def stop_after(count: int, monkeypatch: pytest.MonkeyPatch) -> list[AdviceSetting]:
    """The settings that are done; the one after `count` is stopped."""
    done: list[AdviceSetting] = []

    def stopped(setting: AdviceSetting, sessions: int, seed: int) -> AdviceOutcome:
        if len(done) == count:
            raise KeyboardInterrupt
        done.append(setting)
        return sessions_of(setting, sessions, seed)

    monkeypatch.setattr(chapter_9_sessions, "sessions_of", stopped)
    return done


@pytest.mark.parametrize(
    ("done", "said"), [(0, "nothing is kept"), (1, "'mine' keeps what is done, and the same command goes on")]
)
def test_ctrl_c_says_where_to_go_on(monkeypatch: pytest.MonkeyPatch, done: int, said: str) -> None:
    stop_after(done, monkeypatch)
    with pytest.raises(KeyboardInterrupt) as stopped:
        study(out="mine")
    assert str(stopped.value) == f"stopped by Ctrl-C; {said}"


def test_the_same_command_goes_on(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("study", "run", "figure-9.4", "--sessions", "10", "--json", "--out")
    stop_after(3, monkeypatch)
    ran = lab(*words, "out")
    assert (ran.code, ran.gave_nothing) == (130, True)
    assert ran.err == "lab: stopped by Ctrl-C; 'out' keeps what is done, and the same command goes on\n"
    assert tree(folder / "out") == [STORE]
    done = stop_after(9, monkeypatch)
    ran = lab(*words, "out")
    assert (ran.code, ran.err, len(done)) == (0, "", 1)
    assert ran.json["rows"] == lab(*words, "other").json["rows"]


# ---- the commands -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", STUDY_COMMANDS, ids=" ".join)
def test_help_with_an_example(lab: Lab, words: list[str]) -> None:
    ran = lab(*words, "--help")
    assert (ran.code, ran.err) == (0, "")
    assert f"Example: lab {' '.join(words)}" in " ".join(ran.out.split())
    assert "--json" in ran.out


def test_the_studies_are_listed(lab: Lab, folder: Path) -> None:
    ran = lab("study", "list", "--json")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json == {"studies": [{"name": name, "title": one.title} for name, one in STUDIES.items()]}
    assert {"table-9.2", "table-9.5", "appendix-v", "figure-9.4", "speed"} <= {
        one["name"] for one in ran.json["studies"]
    }
    lines = lab("study", "list").out.splitlines()
    assert [line.split()[0] for line in lines] == ["name", *STUDIES]
    assert tree(folder) == []


def test_a_study_as_json(lab: Lab, folder: Path) -> None:
    """The fields that scripts rely on."""
    ran = lab("study", "run", "figure-9.4", "--sessions", "10", "--seed", "4", "--json", "--out", "out")
    assert (ran.code, ran.err, ran.out.count("\n")) == (0, "", 1)
    document = ran.json
    assert document.keys() >= {"study", "seed", "rows", "summary", "files"}
    assert (document["study"], document["seed"], len(document["rows"])) == ("figure-9.4", 4, 4)
    for one in document["rows"]:
        assert one.keys() >= {"world", "view", "gate", "beta", "measure", "value", "ci95", "thesis", "within"}
        low, high = one["ci95"]
        assert 0 <= low <= one["value"] <= high <= 100
    assert document["summary"]["cells"] == 2
    assert document["summary"]["within"] == sum(one["within"] is True for one in document["rows"])
    assert tree(folder) == ["out", *sorted(document["files"].values())]


def test_a_study_to_read(lab: Lab, folder: Path) -> None:
    """Without --out its folder is named after it."""
    ran = lab("study", "run", "figure-9.4", "--sessions", "10")
    assert (ran.code, ran.err) == (0, "")
    head, *rows = ran.out.splitlines()
    assert head.split() == ["world", "beta", "measure", "value", "95", "%", "printed", "inside"]
    assert [row.split()[:3] for row in rows[:4]] == [
        [world, beta, "SP_percent"] for world in ("world-1", "world-2") for beta in ("0.7", "1.3")
    ]
    assert "report: figure-9.4-study/report.html" in rows
    assert (folder / "figure-9.4-study" / "report.html").is_file()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("study run figure-94", f"unknown study 'figure-94' (STUDY): did you mean 'figure-9.4'? known: {KNOWN}, "),
        ("study run figure-9.4 --sessions 0", "invalid value for '--sessions'"),
        ("study run figure-9.4 --sessions 9", "9 sessions (--sessions): 'figure-9.4' takes 10 at the least"),
        ("study run reuse --sessions 121", "121 orders (--sessions) of 5 tasks: allowed are 1 to 120"),
        ("study run figure-9.4 --workers 0", "invalid value for '--workers'"),
        ("study run figure-9.4 --seed -1", "invalid value for '--seed'"),
        (
            "study run figure-9.4 --advisor-table best",
            "unknown advisor table 'best' (--advisor-table): known: exact, learned",
        ),
        ("study rum", "no such command 'rum'"),
        ("teach world-1 --advisor recorded:missing", "journal 'missing' (--advisor): cannot be read: "),
        ("teach world-1 --advisor recorded:", "advisor 'recorded:"),
    ],
)
def test_bad_words(lab: Lab, folder: Path, words: str, line: str) -> None:
    ran = lab(*words.split(" "))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"lab: {line}")
    assert len(ran.err.splitlines()) == 1
    assert tree(folder) == []


# ---- world II -----------------------------------------------------------------------------------------------------


def test_a_reconstruction_is_written(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is found is up to `reconstruct`; here it finds world I."""
    asked: list[int] = []

    def found(seed: int, progress: Any) -> Any:
        asked.append(seed)
        progress(1, 1)
        return load_world("world-1")

    monkeypatch.setattr("lab_studies.thesis.world_2.reconstruct", found)
    ran = lab("study", "run", "world-2", "--seed", "6", "--out", "w", "--json")
    assert (ran.code, ran.err, asked) == (0, "", [6])
    assert ran.json["files"]["world-1.toml"] == "w/world-1.toml"
    assert load_world("w/world-1.toml") == load_world("world-1")
    assert "# Made by: lab study run world-2 --seed 6\n" in Path("w/world-1.toml").read_text(encoding="utf-8")


# ---- advice for another session -----------------------------------------------------------------------------------

GRID = "S...\n.##.\n...G\n"  # 5 moves


def test_recorded_advice_leads_another_session(lab: Lab, folder: Path) -> None:
    """An expert is asked about every step, and what was said leads a learner with a toolbox of its own the same way."""
    (folder / "maze.txt").write_text(GRID, encoding="utf-8")
    words = ("teach", "maze.txt", "--gate", "always", "--episodes", "20", "--json")
    first = lab(*words, "--advisor", "expert", "--out", "said")
    assert (first.code, first.err) == (0, "")
    lines = [json.loads(line) for line in (folder / "said" / "events.jsonl").read_text(encoding="utf-8").splitlines()]
    said = [line for line in lines if line["kind"] == "advice"]
    assert len(said) == first.json["helped_steps"] == sum(first.json["steps_per_episode"]) >= 100
    again = lab(*words, "--advisor", "recorded:said", "--toolbox", "other")
    assert (again.code, again.err, again.json["advisor"]) == (0, "", "recorded:said")
    assert again.json["steps_per_episode"] == [again.json["optimal_steps"]] * 20 == [5] * 20
    assert again.json["helped_steps"] == 100
    (folder / "other.txt").write_text(GRID.replace("##", ".."), encoding="utf-8")
    ran = lab("teach", "other.txt", "--advisor", "recorded:said")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("lab: advisor 'recorded:said': it is advice about another problem, 'maze' (")


def test_an_advisor_table_where_there_is_none_to_choose(folder: Path) -> None:
    with pytest.raises(BadInput, match=r"^--advisor-table: the study 'figure-9\.4' has none to choose"):
        study(advisor_table="exact")
    assert tree(folder) == []
