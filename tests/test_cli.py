"""The command line: exit codes, one document on stdout, one line for what is wrong, nothing written after bad input."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.advice import advisors, gates, panel
from lab.errors import WorkFailed
from lab.learning.session import run_session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES
from lab.mdp import grid
from lab.policy import Policy
from lab.sequencing import SEQUENCERS
from lab.sequencing.advised import FITTING
from lab.sequencing.objectives import OBJECTIVES
from lab.taskfile import load, load_world, shipped
from lab.toolbox import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
TOML = load("toast")
COMMANDS = (
    *(["run"], ["teach"], ["sequence"], ["see"], ["view"]),
    *(["toolbox", name] for name in ("list", "show", "verify", "remove")),
    *(["task", name] for name in ("list", "show", "check", "random")),
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to run in, with a toolbox of its own that is not there yet."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


@pytest.fixture(scope="session")
def toml(root: Path) -> str:
    return (root / "tasks" / "toast.toml").read_text(encoding="utf-8")


def tree(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def policy(name: str = "insert at toaster 12345678") -> Policy:
    mdp = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))
    learner, gate = LearnerSettings(episodes=8, max_steps=20), GateSettings()
    result = run_session(mdp, learner, gate, None, np.random.default_rng(0))
    return Policy.of(
        result,
        mdp,
        name=name,
        subtask="insert",
        task="toast",
        learner=learner,
        gate=gate,
        advisor="none",
        seed=0,
    )


# ---- help ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_every_command_has_help_with_an_example(lab: Lab, words: list[str]) -> None:
    ran = lab(*words, "--help")
    assert (ran.code, ran.err) == (0, "")
    assert f"Example: lab {' '.join(words)}" in " ".join(ran.out.split())
    assert "--json" in ran.out


ORDER_ADVISORS = [*advisors.SKILLS, "tau=X", "wrong", *advisors.PEOPLE]


@pytest.mark.parametrize(
    ("command", "option", "following", "members"),
    [
        ("teach", "--learner", "--gate", UPDATES),
        ("teach", "--gate", "--advisor", gates.GATES),
        ("teach", "--advisor", "--ask", [*advisors.ADVISORS, *advisors.FORMS]),
        ("teach", "--ask", "--decide", panel.ASKED),
        ("teach", "--decide", "--episodes", panel.DECISIONS),
        ("run", "--advisor", "--ask", [*advisors.ADVISORS, *advisors.FORMS]),
        ("sequence", "--objective", "--episodes", OBJECTIVES),
        ("sequence", "--advisor", "--gate", ORDER_ADVISORS),
        ("sequence", "--gate", "--plot", FITTING),
    ],
)
def test_help_names_all_members(lab: Lab, command: str, option: str, following: str, members: Iterable[str]) -> None:
    """It is written by hand, as help loads no table: each list stands in its option's help, and nothing else does."""
    text = " ".join(lab(command, "--help").out.replace("│", " ").split())
    told = re.sub(r" \([^)]*\)", "", text[text.index(f" {option} ") : text.index(f" {following} ")])
    listed = re.search(r"(\S+, )+\S+", told)
    assert listed is not None
    assert {name.strip(";.") for name in listed[0].split(", ")} == {*members}


def test_no_words_give_help(lab: Lab) -> None:
    for words in ([], ["toolbox"], ["task"]):
        ran = lab(*words)
        assert ran.code == 2
        assert "Usage: lab" in ran.out + ran.err


def test_help_loads_nothing_heavy(root: Path) -> None:
    heavy = (
        "numpy",
        "scipy",
        "pydantic",
        "matplotlib",
        "cv2",
        "trimesh",
        "meshcat",
        "numba",
        "pybullet",
        "safetensors",
        "ortools",
        "pymoo",
    )
    code = f"""
import sys
from lab.cli import main
sys.argv = ["lab", "--help"]
try:
    main()
finally:
    print([name for name in {heavy} if name in sys.modules], file=sys.stderr)
"""
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "[]\n")


# ---- bad input: exit 2, one line, nothing written -----------------------------------------------------------------

SHIPPED = ", ".join(shipped())
TASKS, METHODS = (f"known: {', '.join(sorted(names))}" for names in (shipped(), SEQUENCERS))
ADVISORS, LEARNERS, GATES = (
    f"known: {', '.join(sorted(names))}" for names in ([*advisors.ADVISORS, *advisors.FORMS], UPDATES, gates.GATES)
)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("run toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("sequence toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("teach insert --task toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("view toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("task show toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("task check toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        (
            "run no/task.toml",
            f"no task file 'no/task.toml': give a file that exists, .toml or a .txt grid, or what ships: {SHIPPED}",
        ),
        ("run a\nb\x1b[31m", rf"unknown task 'a\nb\x1b[31m' (TASK): {TASKS}"),
        ("run --advisor exprt", f"unknown advisor 'exprt' (--advisor): did you mean 'expert'? {ADVISORS}"),
        ("teach insert --advisor x", f"unknown advisor 'x' (--advisor): {ADVISORS}"),
        ("run --advisor tau=0", "advisor 'tau=0' (--advisor): tau must be a number above 0, such as tau=0.05"),
        (
            "teach insert --learner qlambda",
            f"unknown learner 'qlambda' (--learner): did you mean 'q-lambda'? {LEARNERS}",
        ),
        ("teach insert --gate cclr", f"unknown gate 'cclr' (--gate): did you mean 'ccrl'? {GATES}"),
        (
            "teach inser",
            "unknown sub-task 'inser' (SUBTASK): did you mean 'insert'? known: butter, grasp, insert, place,",
        ),
        ("teach insert --save ", "policy name '' (--save): wanted 1 to 100 printable characters"),
        ("teach insert --episodes 0", "invalid value for '--episodes'"),
        ("sequence toast --method srrl", f"unknown method 'srrl' (--method): did you mean 'srl'? {METHODS}"),
        ("sequence toast --episodes 99999999", "invalid value for '--episodes'"),
        ("sequence toast --plot no/x.png", "picture 'no/x.png': there is no folder 'no'"),
        ("sequence toast --plot x.pdf", "picture 'x.pdf': plots are written as .png or .svg"),
        ("sequence fms --gantt no/x.svg", "picture 'no/x.svg': there is no folder 'no'"),
        ("sequence fms --case RSR --toasts 3", "--case RSR and --toasts 3: an order is one or the other"),
        ("sequence toast --case IV", "unknown case 'IV' (--case): did you mean 'I'? known: I, II, III"),
        ("sequence world-1", "world-1: it is a world, there is nothing to sequence: learn it with lab teach world-1"),
        ("run fms", "fms: it is a cell, not a task: sequence it with lab sequence fms"),
        ("view fms", "fms: it is a cell, not a task: sequence it with lab sequence fms"),
        ("teach insert --task fms", "fms: it is a cell, not a task: sequence it with lab sequence fms"),
        ("teach fms", "fms: it is a cell, not a world: sequence it with lab sequence fms"),
        ("run --toasts 0", "0 toasts (--toasts): allowed are 1 to 50"),
        ("run --toasts 51", "51 toasts (--toasts): allowed are 1 to 50"),
        ("sequence toast --toasts -1", "-1 toasts (--toasts): allowed are 1 to 50"),
        ("view toast --toasts 51", "51 toasts (--toasts): allowed are 1 to 50"),
        ("task check toast --toasts 0", "0 toasts (--toasts): allowed are 1 to 50"),
        ("run --toasts three", "invalid value for '--toasts'"),
        ("run --seed -1", "invalid value for '--seed'"),
        ("run --tost 3", "no such option: --tost"),
        ("rnu", "no such command 'rnu'"),
        ("run toast toast", "got unexpected extra argument"),
        ("toolbox show nothing", "unknown policy 'nothing' (toolbox "),
        ("toolbox remove ../x", "unknown policy '../x' (toolbox "),
        ("run world-1", "world-1: it is a world, not a task: learn it with lab teach world-1"),
        ("view world-1", "world-1: it is a world, not a task: learn it with lab teach world-1"),
        ("teach insert --task world-1", "world-1: it is a world, not a task: learn it with lab teach world-1"),
        ("teach toast", "toast: it is a task, not a world: lab run toast, or lab teach SUBTASK --task toast"),
        ("teach wrld-1", "unknown sub-task 'wrld-1' (SUBTASK): did you mean 'world-1'? known: butter, grasp,"),
        (
            "teach no.txt",
            f"no task file 'no.txt': give a file that exists, .toml or a .txt grid, or what ships: {SHIPPED}",
        ),
        ("teach world-1 --task toast", "task 'toast' (--task): the world 'world-1' belongs to no task: leave --task"),
        ("teach world-1 --view half", "unknown view 'half' (--view): known: full, limited"),
        (
            "teach world-1 --learner afterstat",
            f"unknown learner 'afterstat' (--learner): did you mean 'afterstate'? {LEARNERS}",
        ),
        ("teach world-1 --save ", "policy name '' (--save): wanted 1 to 100 printable characters"),
        ("teach insert --view full", "view 'full' (--view): only a world has one, 'insert' is none"),
        (
            "teach random:3x3:0:0 --view limited",
            "view 'limited' (--view): the file of world 'random-3x3-0-0' has no [view]",
        ),
        ("teach random:3x3", "world 'random:3x3': wanted random:SHAPE:DENSITY:SEED, such as random:10x10x10:0.06:7"),
        ("teach random:3x3:0.9:1", "random world 3x3: density 0.9: allowed are 0 to 0.6"),
        ("task random 10 --out w.toml", "SHAPE: shape 10: allowed are 2 or 3 axes of 1 to 100 cells"),
        ("task random 10x10 --density nan --out w.toml", "random world 10x10: density nan: allowed are 0 to 0.6"),
        ("task random 10x10 --out w.txt", "task file 'w.txt' (--out): its name must end in .toml"),
        ("task random 10x10 --out no/w.toml", "no/w.toml: cannot be written: No such file or directory"),
        ("task random 10x10", "missing option '--out'"),
        ("see no.png", "no.png: cannot be read: No such file or directory"),
        ("see . --grid 0x3", "grid '0x3' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12"),
    ],
)
@pytest.mark.parametrize("json_too", [False, True], ids=["", "json"])
def test_bad_words(lab: Lab, folder: Path, words: str, line: str, json_too: bool) -> None:
    ran = lab(*words.split(" "), *(["--json"] if json_too and not words.startswith("rnu") else []))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"lab: {line}")
    assert len(ran.err.splitlines()) == 1
    assert tree(folder) == []


def changed(toml: str, old: str, new: str) -> str:
    assert old in toml
    return toml.replace(old, new, 1)


PLATE, BUFFER = "pose = [0.0, 0.80, 0.0]", "pose = [0.42, 0.56, 0.0]"
TOASTER = '[[route]]\nstation = "toaster"'


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "[robot]",
            "[robot",
            "t.toml: not valid TOML: Expected ']' at the end of a table declaration (at line 8, column 7)",
        ),
        (PLATE, "pose = [0.0, 2.80, 0.0]", "station 'plate' is out of reach: its spot at "),
        (BUFFER, "pose = [0.0, 0.85, 0.0]", "t.toml: stations 'plate' and 'toaster_buffer' overlap: 0.050 m apart"),
        (BUFFER, "pose = [0.20, 0.80, 0.0]", "stations 'plate' and 'toaster_buffer' overlap: with 3 toasts, slices"),
        ("capacity = 4", "capacity = 0", "t.toml: stations.1.capacity: Input should be greater than or equal to 1"),
        (
            "capacity = 50",
            "capacity = 2",
            "3 toasts (--toasts) do not fit on 'plate': its capacity in the task file is 2",
        ),
        ("processing_s = 60.0", "processing_s = -1.0", "t.toml: stations.2.processing_s: "),
        (
            TOASTER,
            TOASTER.replace("toaster", "toster"),
            "t.toml: unknown station 'toster' (route): did you mean 'toaster'?",
        ),
        ('learner = "q-lambda"', 'learner = "qq"', "t.toml: unknown learner 'qq' (subtasks.transfer.learner): "),
        ('gate = "ccrl"', 'gate = "cc"', "t.toml: unknown gate 'cc' (subtasks.transfer.gate): "),
        (
            'process = "butter" ',
            "processing_s = 9.0 #",
            "machines 'toaster' and 'butter_applier' both have processing_s",
        ),
        (
            "position_m = [0.68, 0.45]",
            "position_m = [0.42, 0.56]",
            "obstacle 'tower left' stands on station 'toaster_buffer'",
        ),
        ("height_m = 0.215", "height_m = 0.1", "insert.height_m 0.1: a carried slice would hit the toaster"),
        ("mass_kg", "weight", "t.toml: slices.weight: there is no such key"),
    ],
)
def test_bad_task_files(lab: Lab, folder: Path, toml: str, old: str, new: str, line: str) -> None:
    (folder / "t.toml").write_text(changed(toml, old, new))
    ran = lab("run", "t.toml", "--json")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"lab: {line}")
    assert len(ran.err.splitlines()) == 1
    assert tree(folder) == ["t.toml"]


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
    assert error.startswith("insert at toaster: no path reaches the goal; the goal is enclosed by: wall ")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("run --out taken", "output folder 'taken' (--out): 'taken' is a file; give a folder"),
        ("run --out taken/below", "output folder 'taken/below' (--out): 'taken' is a file; give a folder"),
        ("run", "output folder 'toast-run' (--out): 'toast-run' is a file; give a folder"),
        ("teach insert --out taken", "output folder 'taken' (--out): 'taken' is a file; give a folder"),
        (f"run --out {'x' * 300}", f"output folder '{'x' * 300}' (--out): File name too long"),
        ("run --out new --toolbox taken", "toolbox taken: 'taken' is a file, a folder is needed"),
        (f"run --out new --toolbox {'x' * 300}", f"toolbox {'x' * 300}: File name too long"),
        ("teach insert --toolbox taken/below", "toolbox taken/below: 'taken' is a file, a folder is needed"),
        ("sequence toast --toolbox taken", "toolbox taken: 'taken' is a file, a folder is needed"),
        ("toolbox list --toolbox taken", "toolbox taken: it is a file, a folder is needed"),
        ("sequence toast --plot folder.png", "picture 'folder.png': it is a folder, a file is wanted"),
        ("view folder.png", "'folder.png' holds no replay.html: give the folder of a run (--out of lab run) or a task"),
        ("see taken", "taken: not a picture that can be read: wanted a PNG or JPEG file"),
    ],
)
def test_folders_and_files_that_cannot_be_used(lab: Lab, folder: Path, words: str, line: str) -> None:
    for name in ("taken", "toast-run"):
        (folder / name).write_text("mine")
    (folder / "folder.png").mkdir()
    before = tree(folder)
    ran = lab(*words.split(), "--json")
    assert (ran.code, ran.out, ran.err) == (2, "", f"lab: {line}\n")
    assert tree(folder) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="everything is writable for root")
def test_a_folder_without_the_right_to_write(lab: Lab, folder: Path) -> None:
    (folder / "locked").mkdir(mode=0o500)
    for option in ("--out", "--toolbox"):
        ran = lab("run", option, "locked/new")
        assert (ran.code, ran.out) == (2, "")
        assert "writable" in ran.err or "cannot be written" in ran.err


# ---- exit codes 0, 1, 130 -----------------------------------------------------------------------------------------


def test_a_failed_piece_of_work_ends_with_1(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise WorkFailed("the arm is stuck\nat the table")

    monkeypatch.setattr("lab.production.prepared.prepare", fail)
    ran = lab("run", "--json")
    assert (ran.code, ran.out, ran.err) == (1, "", r"lab: the arm is stuck\nat the table" + "\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [("run", "; what was learned is kept"), ("teach insert", "; what was learned is kept"), ("view toast", "")],
)
def test_ctrl_c_ends_with_130(lab: Lab, monkeypatch: pytest.MonkeyPatch, words: str, said: str) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lab.production.prepared.prepare", stop)
    monkeypatch.setattr("lab.lesson.load", stop)
    monkeypatch.setattr("lab.look.load", stop)
    ran = lab(*words.split(), "--json")
    assert (ran.code, ran.out, ran.err) == (130, "", f"lab: stopped by Ctrl-C{said}\n")


def test_what_the_system_refuses_is_one_line(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "x")

    monkeypatch.setattr("lab.production.prepared.prepare", full)
    ran = lab("run")
    assert (ran.code, ran.err) == (1, "lab: [Errno 28] No space left on device: 'x'\n")


def test_a_reader_that_leaves_early_is_no_drama(root: Path) -> None:
    code = "import sys; from lab.cli import main; sys.argv = ['lab', 'task', 'show', 'toast']; main()"
    read, write = os.pipe()
    os.close(read)
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=root, stdout=write, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write)
    assert (ran.returncode, ran.stderr) == (1, "")


# ---- small commands -----------------------------------------------------------------------------------------------


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
    assert lab("task", "check", "far/mine.toml", "--toasts", "1", "--json").json == {"valid": True, "errors": []}


def test_a_world_is_shown_checked_and_learned(lab: Lab, folder: Path, root: Path) -> None:
    assert lab("task", "show", "world-1").out == (root / "tasks" / "world-1.toml").read_text(encoding="utf-8")
    shown = lab("task", "show", "world-1", "--json").json
    assert (shown["kind"], shown["shape"], len(shown["obstacles"])) == ("world", [10, 10, 10], 59)
    assert lab("task", "check", "world-1").out == "world-1 is sound\n"
    ran = lab("teach", "world-1", "--view", "limited", "--json")
    assert (ran.code, ran.err) == (0, "")
    assert (ran.json["subtask"], ran.json["view"], ran.json["optimal_steps"]) == ("world", "limited", 13)
    (row,) = lab("toolbox", "list", "--json").json["policies"]
    assert (row["name"], row["subtask"], row["task"]) == (ran.json["saved_as"], "world", "world-1")
    assert (folder / "toolbox").is_dir()


def test_a_random_world_is_written_checked_and_learned(lab: Lab, folder: Path) -> None:
    words = ("task", "random", "6x5", "--density", "0.3", "--seed", "2", "--out", "w.toml")
    ran = lab(*words, "--json")
    assert (ran.code, ran.json["file"], ran.json["obstacles"]) == (0, "w.toml", 9)
    text = (folder / "w.toml").read_text(encoding="utf-8")
    again = lab(*words)
    assert (again.code, again.out) == (2, "")
    assert "w.toml' (--out): there is one already: choose another name, or remove it" in again.err
    assert lab(*words[:-1], "v.toml").out.startswith("v.toml: 9 obstacles, the shortest way takes ")
    assert (folder / "v.toml").read_text(encoding="utf-8") == text
    assert text.endswith(lab("task", "show", "random:6x5:0.3:2").out)
    assert text.startswith("# Drawn at random. Cells are counted from 0; with two axes they are [row, column]")
    assert load_world("w.toml") == load_world("random:6x5:0.3:2")
    assert lab("task", "show", "random:6x5:0.3:2", "--json").json["file"] is None
    assert lab("task", "check", "w.toml").out == "w.toml is sound\n"
    ran = lab("teach", "w.toml", "--out", "pictures", "--json")
    assert (ran.code, ran.json["solved"]) == (0, True)
    assert tree(folder / "pictures") == ["events.jsonl", "learning-curve.png", "receipt.json", "value-map.png"]


def test_a_session_is_replayed_listed_and_not_gone_on_with_when_it_is_over(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    taught = lab(
        "teach", "w.txt", "--advisor", "terminal", "--gate", "always", "--out", "lesson", stdin="right\nauto\n"
    )
    assert (taught.code, "receipt" in taught.out) == (0, False)
    ran = lab("replay", "lesson", "--json")
    assert (ran.code, ran.out.count("\n")) == (0, 1)
    assert ran.json.keys() == {"session", "problem", "words", "seed", "lab", "closed", "cut", "events", "receipt"}
    answers = [event for event in ran.json["events"] if event["kind"] == "answer"]
    assert [(answer["action"], answer["left"]) for answer in answers] == [(3, False), (None, True)]
    assert ran.json["closed"]["episodes"] == json.loads((folder / "lesson" / "receipt.json").read_text())["episodes"]
    shown = lab("replay", "lesson", "--pause", "0")
    assert shown.code == 0
    assert "w in lesson: over after" in shown.out
    assert "right" in shown.err
    again = lab("teach", "--resume", "lesson")
    assert (again.code, again.err) == (2, "lab: the session in 'lesson' is over: look at it again with lab replay\n")
    lab("teach", "w.txt", "--advisor", "none", "--episodes", "3")
    (row,) = lab("replay", "--json").json["sessions"]
    assert (row["problem"], row["advisor"], Path(row["session"]).name) == ("w", "none", "w-1")


def test_a_session_goes_on_from_another_folder(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    whole = lab("teach", "w.txt", "--advisor", "expert", "--gate", "always", "--out", "lesson", "--json").json
    journal = folder / "lesson" / "events.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:7]) + lines[7][:11])
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    ran = lab("teach", "--resume", "../lesson", "--json")
    assert ran.code == 0
    assert "its last line was cut off and is left out" in ran.err
    kept = ("steps_per_episode", "helped_steps", "solved", "saved_as")
    assert [ran.json[name] for name in kept] == [whole[name] for name in kept]
    assert journal.read_bytes() == b"".join(lines)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("teach", "nothing to learn (SUBTASK): name a sub-task, a world or gym:ID, or go on with --resume DIR"),
        ("teach --resume nowhere", "journal 'nowhere' (--resume): cannot be read: No such file or directory"),
        ("replay nowhere", "journal 'nowhere' (DIR): cannot be read: No such file or directory"),
        (
            "teach world-1 --resume lesson",
            "SUBTASK beside --resume lesson: a session goes on as it was begun",
        ),
        ("teach world-1 --advisor recorded:lesson", "it is advice about another problem, 'w'"),
        ("teach world-1 --ask all", "unknown way of asking 'all' (--ask): known: in-turn, together"),
        ("teach world-1 --decide majorit", "unknown way of deciding 'majorit' (--decide): did you mean 'majority'?"),
        ("teach --resume lesson --ask in-turn", "--ask beside --resume lesson: a session goes on as it was begun"),
        (
            "teach --resume lesson --out other",
            "--out other beside --resume lesson: a session goes on in its own folder",
        ),
        ("teach world-1 --advisor none --advisor expert", "advisor 'none' (--advisor) beside 1 more"),
        ("teach world-1 --advisor web --advisor web", "advisor 'web' (--advisor) is named 2 times: once is enough"),
        ("teach world-1 --wait 0", "invalid value for '--wait'"),
        ("teach gym:FrozenLak-v1", "FrozenLake-v1"),
        ("teach gym:Pendulum-v1", "its observation space is Box"),
        ("teach gym:Pendulum-v1", "supported are Discrete, MultiDiscrete, MultiBinary"),
        (
            "teach gym:FrozenLake-v1 --task toast",
            "--task toast: a Gymnasium environment, 'gym:FrozenLake-v1', has none",
        ),
    ],
)
def test_bad_words_about_sessions(lab: Lab, folder: Path, words: str, reason: str) -> None:
    (folder / "w.txt").write_text("S.G\n")
    lab("teach", "w.txt", "--out", "lesson", "--episodes", "2", "--gate", "always")
    before = tree(folder)
    ran = lab(*words.split())
    assert (ran.code, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1
    assert tree(folder) == before


def test_a_gymnasium_environment_is_taught(lab: Lab, folder: Path) -> None:
    ran = lab("teach", "gym:FrozenLake-v1?is_slippery=false", "--advisor", "expert", "--json")
    assert (ran.code, ran.json["solved"], ran.json["final_steps"]) == (0, True, 6)


def test_a_world_without_a_way_is_not_sound(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S#.\n##G\n")
    for words in ("task check w.txt", "teach w.txt"):
        ran = lab(*words.split())
        assert (ran.code, ran.out) == (2, "")
        assert ran.err == "lab: world 'w': no path from (0, 0) to (1, 2): the start is enclosed by (0, 1), (1, 0)\n"


@pytest.mark.parametrize("words", ["teach world-1", "sequence fms --method fifo --gantt order.svg"])
def test_what_is_not_simulated_loads_no_simulator(root: Path, folder: Path, words: str) -> None:
    code = f"""
import sys
from lab.cli import main
sys.argv = ["lab", *{words.split()}, "--json"]
try:
    main()
finally:
    print("pybullet" in sys.modules, file=sys.stderr)
"""
    env = {**os.environ, "PYTHONPATH": str(root)}
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr.splitlines()[-1]) == (0, "False")


def test_a_task_with_room_for_one_toast_is_sound(lab: Lab, folder: Path, toml: str) -> None:
    (folder / "one.toml").write_text(toml.replace("capacity = 50", "capacity = 1"))
    assert lab("task", "check", "one.toml").code == 0


def test_a_damaged_task_file_is_reported_by_check(lab: Lab, folder: Path) -> None:
    (folder / "t.toml").write_text("name = 3\n")
    ran = lab("task", "check", "t.toml")
    assert (ran.code, ran.out) == (2, "")
    ran = lab("task", "check", "t.toml", "--json")
    assert (ran.code, ran.json) == (2, {"valid": False, "errors": [ran.err.removeprefix("lab: ").strip()]})


def test_an_empty_toolbox(lab: Lab, folder: Path) -> None:
    box = str(folder / "toolbox")
    assert lab("toolbox", "list").out == f"nothing in {box}\n"
    assert lab("toolbox", "list", "--json").json == {"folder": box, "policies": []}
    assert lab("toolbox", "verify", "--json").json == {"folder": box, "files": [], "damaged": 0}
    assert tree(folder) == []


def test_toolbox_list_show_and_remove(lab: Lab, folder: Path) -> None:
    Toolbox(folder / "toolbox").save(policy())
    name = "insert at toaster 12345678"
    (row,) = lab("toolbox", "list", "--json").json["policies"]
    assert row.keys() >= {"name", "subtask", "task", "signature", "created", "solved"}
    assert lab("toolbox", "list").out.splitlines()[1].startswith(name)
    shown = lab("toolbox", "show", name, "--json").json
    assert (shown["name"], shown["shape"], len(shown["curve"])) == (name, [2, 3], 8)
    assert "guided         0 episodes" in lab("toolbox", "show", name).out
    ran = lab("toolbox", "show", "insert at toster")
    assert ran.err.endswith(f"did you mean '{name}'? known: {name}\n")
    assert Path(lab("toolbox", "remove", name, "--json").json["removed"]).parent == folder / "toolbox"
    assert lab("toolbox", "list", "--json").json["policies"] == []


def test_damaged_policies_are_named_and_never_listed(lab: Lab, folder: Path) -> None:
    box = Toolbox(folder / "toolbox")
    sound = policy()
    for name in ("cut", "padded", "not a number", "wrong shape", "fine"):
        box.save(replace(sound, name=name))
    paths = {path.stem.rpartition("-")[0] or path.stem: path for path in box.folder.glob("*.safetensors")}
    paths["cut"].write_bytes(paths["cut"].read_bytes()[:-9])
    paths["padded"].write_bytes(paths["padded"].read_bytes() + b"more")
    whole, nan = paths["not-a-number"].read_bytes(), np.full(1, np.nan).tobytes()
    data = 8 + int.from_bytes(whole[:8], "little")  # where the first of the two tensors begins
    paths["not-a-number"].write_bytes(whole[:data] + nan + whole[data + 8 : -8] + nan)
    paths["wrong-shape"].write_bytes(paths["wrong-shape"].read_bytes().replace(b"[6,4]", b"[4,6]"))
    ran = lab("toolbox", "verify", "--json")
    assert ran.code == 1
    assert ran.err == "lab: 4 of 5 files in the toolbox are damaged\n"
    assert sorted(Path(row["file"]).stem for row in ran.json["files"] if row["ok"]) == ["fine"]
    ran = lab("toolbox", "verify")
    assert ran.out.startswith(f"1 of 5 files in {box.folder} are sound\n")
    assert all(str(paths[name]) in ran.out for name in ("cut", "padded", "not-a-number", "wrong-shape"))
    assert [row["name"] for row in lab("toolbox", "list", "--json").json["policies"]] == ["fine"]


def test_a_name_that_ascii_cannot_hold_does_not_end_a_command(root: Path, folder: Path) -> None:
    Toolbox(folder / "toolbox").save(policy("grüße ▁█"))
    code = "import sys; from lab.cli import main; sys.argv = ['lab', 'toolbox', 'list']; main()"
    env = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "PYTHONPATH": str(root)}
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert r"gr\xfc\xdfe _#" in ran.stdout


def test_json_is_one_line_and_finite(lab: Lab) -> None:
    ran = lab("task", "show", "toast", "--json")
    assert ran.out.count("\n") == 1
    json.loads(ran.out, parse_constant=lambda text: pytest.fail(text))
