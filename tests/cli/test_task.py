"""`lab task`: lists, shows, draws and checks task files."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.tasks.task_file import load, load_world

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]
TOML = load("toast")
WALL = (0.55, 0.7, 0.85, 1.0, 1.08)  # x [m] of cubes across the insert task's grid


def test_a_goal_that_no_way_reaches_names_what_encloses_it(lab: Lab, folder: Path, toml: str) -> None:
    wall = [f'[[obstacles]]\nname = "wall {n}"\nposition_m = [{x}, 0.05]\n' for n, x in enumerate(WALL)]
    before, after = toml[: toml.index("[[obstacles]]")], toml[toml.index("# ---- how each") :]
    (folder / "t.toml").write_text(before + "\n".join(wall) + after)
    ran = lab("task", "check", "t.toml", "--json")
    assert ran.code == 2
    assert ran.json["valid"] is False
    (error,) = ran.json["errors"]
    assert ran.err == f"lab: {error}\n"
    said = "insert at toaster: no path reaches the goal; the goal is enclosed by: wall "
    assert re.match(rf"t\.toml: line \d+: {said}", error)


def test_task_list_show_and_check(lab: Lab, folder: Path, toml: str) -> None:
    rows = [line.split() for line in lab("task", "list").out.splitlines()]
    assert rows[0] == ["name", "kind"]
    assert [row for row in rows if row[0] in ("toast", "world-1")] == [["toast", "task"], ["world-1", "world"]]
    assert lab("task", "list", "--json").json == {"tasks": [name for name, _ in rows[1:]], "kinds": dict(rows[1:])}
    assert lab("task", "show", "toast").out == toml
    shown = lab("task", "show", "toast", "--json").json
    assert Path(shown["file"]).name == "toast.toml"
    assert [station["name"] for station in shown["stations"]] == [s.name for s in TOML.stations]
    (folder / "far").mkdir()
    (folder / "far" / "mine.toml").write_text(toml)
    ran = lab("task", "check", "far/mine.toml")
    assert (ran.code, ran.out, ran.err) == (0, "far/mine.toml is sound\n", "")
    assert lab("task", "check", "far/mine.toml", "--toasts", "1", "--json").json == {
        "valid": True,
        "errors": [],
        "warnings": [],
        "files": {},
    }


def test_a_world_is_shown_checked_and_learned(lab: Lab, folder: Path, root: Path) -> None:
    assert lab("task", "show", "world-1").out == (root / "tasks" / "world-1.toml").read_text(encoding="utf-8")
    shown = lab("task", "show", "world-1", "--json").json
    assert (shown["kind"], shown["shape"], len(shown["obstacles"])) == ("world", [10, 10, 10], 59)
    assert lab("task", "check", "world-1").out.startswith("world-1 is sound\nmind: rewards.collision = -1.0: ")
    ran = lab("teach", "world-1", "--sight", "limited", "--json")
    assert (ran.code, ran.err) == (0, "")
    assert (ran.json["subtask"], ran.json["view"], ran.json["optimal_steps"]) == ("world", "limited", 13)
    (row,) = lab("toolbox", "list", "--json").json["policies"]
    assert (row["name"], row["subtask"], row["task"]) == (ran.json["saved_as"], "world", "world-1")
    assert (folder / "toolbox").is_dir()


@pytest.mark.parametrize("kind", ["task", "cell", "world"])
def test_the_schema_of_a_kind_is_shown_or_written(lab: Lab, folder: Path, kind: str) -> None:
    shown = lab("task", "schema", kind).json
    assert shown["required"]
    assert lab("task", "schema", kind, "--out", "keys.json", "--json").json == {"file": "keys.json", "kind": kind}
    assert json.loads((folder / "keys.json").read_text(encoding="utf-8")) == shown
    assert lab("task", "schema", kind, "--out", "keys.md").code == 0
    assert (folder / "keys.md").read_text(encoding="utf-8").startswith(f"# Keys of a {kind} file")


def test_a_schema_of_nothing_is_refused(lab: Lab, folder: Path, tree: Tree) -> None:
    assert lab("task", "schema", "tsk").err == (
        "lab: unknown kind 'tsk' (of file): did you mean 'task'? known: cell, task, world\n"
    )
    assert lab("task", "schema", "--out", "keys.txt").err == (
        "lab: file 'keys.txt' (--out): wanted one that ends with .json or .md\n"
    )
    assert tree(folder) == []


def test_a_random_world_is_written_checked_and_learned(lab: Lab, folder: Path, tree: Tree) -> None:
    words = ("task", "random", "6x5", "--density", "0.3", "--seed", "2", "--out", "w.toml")
    ran = lab(*words, "--json")
    assert (ran.code, ran.json["file"], ran.json["obstacles"]) == (0, "w.toml", 9)
    text = (folder / "w.toml").read_text(encoding="utf-8")
    again = lab(*words)
    assert (again.code, again.out) == (2, "")
    assert "w.toml' (--out): there is one already: choose another name, or remove it" in again.err
    assert lab(*words[:-1], "v.toml").out.startswith("v.toml: 9 obstacles, the shortest path takes ")
    assert (folder / "v.toml").read_text(encoding="utf-8") == text
    assert text.endswith(lab("task", "show", "random:6x5:0.3:2").out)
    assert text.startswith("# Drawn at random. Cells are counted from 0; with two axes they are [row, column]")
    assert load_world("w.toml") == load_world("random:6x5:0.3:2")
    assert lab("task", "show", "random:6x5:0.3:2", "--json").json["file"] is None
    assert lab("task", "check", "w.toml").out == "w.toml is sound\n"
    ran = lab("teach", "w.toml", "--out", "pictures", "--json")
    assert (ran.code, ran.json["solved"]) == (0, True)
    kept = ["inputs", "inputs/subtask", "inputs/subtask/w.toml", "versions.json"]
    pictures = ["learning-curve.png", "value-map.png"]
    assert tree(folder / "pictures") == sorted(["events.jsonl", "receipt.json", *kept, *pictures])


def test_a_world_without_a_way_is_not_sound(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S#.\n##G\n")
    for words in ("task check w.txt", "teach w.txt"):
        ran = lab(*words.split())
        assert (ran.code, ran.out) == (2, "")
        assert ran.err == "lab: world 'w': no path from (0, 0) to (1, 2): the start is enclosed by (0, 1), (1, 0)\n"


def test_a_task_with_room_for_one_part_is_sound_when_it_makes_one(lab: Lab, folder: Path, toml: str) -> None:
    small = toml.replace("capacity = 50", "capacity = 1")
    (folder / "one.toml").write_text(small.replace("count = 3", "count = 1"))
    assert lab("task", "check", "one.toml").code == 0
    (folder / "three.toml").write_text(small)
    ran = lab("task", "check", "three.toml")
    assert (ran.code, "station 'plate': capacity = 1: 3 slices" in ran.err) == (2, True)


def test_a_damaged_task_file_is_reported_by_check(lab: Lab, folder: Path) -> None:
    (folder / "t.toml").write_text("name = 3\n")
    ran = lab("task", "check", "t.toml")
    assert (ran.code, ran.out) == (2, "")
    ran = lab("task", "check", "t.toml", "--json")
    assert (ran.code, ran.json) == (
        2,
        {"valid": False, "errors": [ran.err.removeprefix("lab: ").strip()], "warnings": [], "files": {}},
    )


def test_a_cell_is_drawn_whether_it_is_sound_or_not(lab: Lab, folder: Path, toml: str, tree: Tree) -> None:
    ran = lab("task", "check", "toast", "--plot", "cell.svg", "--json")
    assert (ran.code, ran.json["valid"], ran.json["files"]) == (0, True, {"plot": "cell.svg"})
    assert "blocked by tower left" in (folder / "cell.svg").read_text(encoding="utf-8")
    (folder / "far.toml").write_text(toml.replace("pose = [0.80, -0.52, 0.0]", "pose = [1.30, -0.62, 0.0]"))
    ran = lab("task", "check", "far.toml", "--plot", "far.svg", "--json")
    assert (ran.code, ran.json["valid"], ran.json["files"]) == (2, False, {"plot": "far.svg"})
    (error,) = ran.json["errors"]
    assert ran.err == f"lab: {error}\n"
    assert "station 'butter_applier' is out of reach" in (folder / "far.svg").read_text(encoding="utf-8")


def test_what_cannot_be_drawn_is_refused_or_left_out(lab: Lab, folder: Path, tree: Tree) -> None:
    (folder / "t.toml").write_text("name = 3\n")
    ran = lab("task", "check", "t.toml", "--plot", "t.png", "--json")
    assert (ran.code, ran.json["files"]) == (2, {})
    for what, instead in (("world-1", "lab view world-1"), ("fms", "lab sequence fms --gantt t.png")):
        ran = lab("task", "check", what, "--plot", "t.png")
        assert (ran.code, ran.out) == (2, "")
        assert ran.err == f"lab: --plot draws the cell of a task from above, and {what} is none: see {instead}\n"
    ran = lab("task", "check", "toast", "--plot", "no/t.png")
    assert (ran.code, ran.err) == (2, "lab: picture 'no/t.png': there is no folder 'no'\n")
    assert tree(folder) == ["t.toml"]


def test_convert_writes_an_instance_as_toml_and_says_what_is_wrong(lab: Callable[..., Any], tmp_path: Path) -> None:
    instance, out = tmp_path / "two", tmp_path / "two.toml"
    instance.write_text("2 2\n0 3 1 2\n1 4 0 1\n")
    assert lab("task", "convert", str(instance), "--out", str(out), "--json").json["parts"] == 2
    assert lab("task", "check", str(out)).code == 0
    instance.write_text("2 2\n0 3 1 2\n1 4 7 1\n")
    ran = lab("task", "convert", str(instance))
    assert (ran.code, ran.out, ran.err.count("\n"), "line 3" in ran.err) == (2, "", 1, True)
