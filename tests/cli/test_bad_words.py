"""Bad input: exit 2, one line that says what is wrong, nothing written."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.advice import advisors
from lab.errors import LabError
from lab.learning import gates
from lab.learning.updates import UPDATES
from lab.sequencing import SEQUENCERS
from lab.tasks.task_file import shipped

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]


SHIPPED = "breakfast, class-hurry, class-maze-back, "
TASKS = f"known: {', '.join(sorted(shipped())[:12])}"  # a message of more is cut
METHODS = f"known: {', '.join(sorted(SEQUENCERS))}"
ADVISORS, LEARNERS, GATES = (
    f"known: {', '.join(sorted(names))}" for names in (advisors.ADVISORS, UPDATES, gates.GATES)
)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("run toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("sequence toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("teach insert --task toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("view toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("show no.csv", "schedule 'no.csv' cannot be read: No such file or directory"),
        ("task show toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        ("task check toas", f"unknown task 'toas' (TASK): did you mean 'toast'? {TASKS}"),
        (
            "run no/task.toml",
            f"no task file 'no/task.toml': give a file that exists, .toml or .txt, or what ships; known: {SHIPPED}",
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
            "unknown sub-task 'inser' (SUBTASK): did you mean 'insert'? known: cover, grasp, insert, place,",
        ),
        ("teach insert --save ", "policy name '' (--save): wanted 1 to 100 printable characters"),
        ("teach insert --gate ccrl --gate=ia", "--gate is given twice, 'ccrl' and 'ia': it takes one value"),
        ("study compare insert --omega 1 --omega 2", "--omega is given twice, '1' and '2': several are separated by"),
        ("teach insert --episodes 0", "invalid value for '--episodes': '0'"),
        ("sequence toast --method srrl", f"unknown method 'srrl' (--method): did you mean 'srl'? {METHODS}"),
        ("sequence toast --plot no/x.png", "picture 'no/x.png': there is no folder 'no'"),
        ("sequence toast --plot x.pdf", "picture 'x.pdf': plots are written as .png or .svg"),
        ("replay no --movie x.gif", "'no': --movie goes with the folder of a run (lab run --out)"),
        ("replay --movie x.gif", "--movie goes with the folder of a run (lab run --out)"),
        ("sequence fms --gantt no/x.svg", "picture 'no/x.svg': there is no folder 'no'"),
        ("sequence fms --case RSR --toasts 3", "--case RSR and --toasts 3: an order is one or the other"),
        ("sequence toast --case IV", "unknown case 'IV' (--case): did you mean 'I'? known: I, II, III"),
        ("sequence world-1", "world-1: it is a world, there is nothing to sequence: learn it with lab teach world-1"),
        ("run toast-case-1", "toast-case-1: it is a cell, not a task: sequence it with lab sequence toast-case-1"),
        ("view toast-case-1", "toast-case-1: it is a cell, which has no scene: look at its order with lab sequence"),
        (
            "teach insert --task toast-case-1",
            "toast-case-1: it is a cell, not a task: sequence it with lab sequence toast-case-1",
        ),
        ("teach fms", "fms: it is a cell, not a world: sequence it with lab sequence fms"),
        ("run --toasts 0", "0 toasts (--toasts): allowed are 1 to 50"),
        ("run --toasts 51", "51 toasts (--toasts): allowed are 1 to 50"),
        ("sequence toast --toasts -1", "-1 toasts (--toasts): allowed are 1 to 50"),
        ("view toast --toasts 51", "51 toasts (--toasts): allowed are 1 to 50"),
        ("task check toast --toasts 0", "0 toasts (--toasts): allowed are 1 to 50"),
        ("run --toasts three", "invalid value for '--toasts' / '-n': 'three'"),
        ("run --seed -1", "invalid value for '--seed': '-1'"),
        ("run --tost 3", "no such option: --tost"),
        ("rnu", "no such command 'rnu'"),
        ("run toast toast", "got unexpected extra argument"),
        ("toolbox show nothing", "unknown policy 'nothing' (toolbox "),
        ("toolbox remove ../x", "unknown policy '../x' (toolbox "),
        ("run world-1", "world-1: it is a world, not a task: learn it with lab teach world-1"),
        ("teach insert --task world-1", "world-1: it is a world, not a task: learn it with lab teach world-1"),
        ("teach toast", "toast: it is a task, not a world: lab run toast, or lab teach SUBTASK --task toast"),
        ("teach wrld-1", "unknown sub-task 'wrld-1' (SUBTASK): did you mean 'world-1'? known: cover, grasp,"),
        (
            "teach no.txt",
            f"no task file 'no.txt': give a file that exists, .toml or .txt, or what ships; known: {SHIPPED}",
        ),
        ("teach world-1 --task toast", "task 'toast' (--task): the world 'world-1' belongs to no task: remove --task"),
        ("teach world-1 --sight half", "unknown sight 'half' (--sight): known: full, limited"),
        (
            "teach world-1 --learner afterstat",
            f"unknown learner 'afterstat' (--learner): did you mean 'afterstate'? {LEARNERS}",
        ),
        ("teach world-1 --save ", "policy name '' (--save): wanted 1 to 100 printable characters"),
        ("teach insert --sight full", "sight 'full' (--sight): only a world has one, 'insert' is none"),
        (
            "teach random:3x3:0:0 --sight limited",
            "sight 'limited' (--sight): the file of world 'random-3x3-0-0' has no [view]",
        ),
        ("teach random:3x3", "world 'random:3x3': wanted random:SHAPE:DENSITY:SEED, such as random:10x10x10:0.06:7"),
        ("teach random:3x3:0.9:1", "random world 3x3: density 0.9: allowed are 0 to 0.6"),
        (
            "task random 10 --out w.toml",
            "SHAPE: shape 10: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells",
        ),
        ("task random 10x10 --density nan --out w.toml", "random world 10x10: density nan: allowed are 0 to 0.6"),
        ("task random 10x10 --out w.txt", "task file 'w.txt' (--out): its name must end in .toml"),
        ("task random 10x10 --out no/w.toml", "no/w.toml: cannot be written: No such file or directory"),
        ("task random 10x10", "missing option '--out'"),
        ("see no.png", "no.png: cannot be read: No such file or directory"),
        ("see . --grid 0x3", "grid '0x3' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12"),
    ],
)
@pytest.mark.parametrize("json_too", [False, True], ids=["", "json"])
def test_bad_words(lab: Lab, folder: Path, words: str, line: str, json_too: bool, tree: Tree) -> None:
    ran = lab(*words.split(" "), *(["--json"] if json_too else []))
    assert (ran.code, ran.gave_nothing, ran.out == "") == (2, True, not json_too)
    assert ran.err.startswith(f"lab: {line}")
    assert len(ran.err.splitlines()) == 1
    assert tree(folder) == []


def changed(toml: str, old: str, new: str) -> str:
    assert old in toml
    return toml.replace(old, new, 1)


PLATE, BUFFER = "pose = [0.0, 0.80, 0.0]", "pose = [0.42, 0.56, 0.0]"


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "[robot]",
            "[robot",
            "t.toml: not valid TOML: Expected ']' at the end of a table declaration (at line 8, column 7)",
        ),
        (PLATE, "pose = [0.0, 2.80, 0.0]", "t.toml: line 46: station 'plate' is out of reach: its spot at "),
        (BUFFER, "pose = [0.0, 0.85, 0.0]", "t.toml: line 46: stations 'plate' and 'toaster_buffer' overlap: at "),
        (BUFFER, "pose = [0.20, 0.80, 0.0]", "t.toml: line 46: stations 'plate' and 'toaster_buffer' overlap: at "),
        (
            "capacity = 4",
            "capacity = 0",
            "t.toml: line 53: stations.1.capacity of station 'toaster_buffer': Input should be greater than or equal to 1",
        ),
        (
            "capacity = 50",
            "capacity = 2",
            "t.toml: line 47: station 'plate': capacity = 2: 3 slices (the sum of their counts) begin or end there, wanted",
        ),
        (
            "processing_s = 60.0",
            "processing_s = -1.0",
            "t.toml: line 60: stations.2.processing_s of station 'toaster': ",
        ),
        (
            'station = "toaster"',
            'station = "toster"',
            "t.toml: line 26: unknown station 'toster' (route of part 'slice'): did you mean 'toaster'?",
        ),
        (
            'learner = "dyna-q"',
            'learner = "qq"',
            "t.toml: line 142: unknown learner 'qq' (subtasks.transfer.learner): ",
        ),
        ('gate = "ccrl"', 'gate = "cc"', "t.toml: line 143: unknown gate 'cc' (subtasks.transfer.gate): "),
        (
            'process = "butter" ',
            "processing_s = 9.0\nprocess = 'butter' #",
            "t.toml: line 85: machine 'butter_applier' needs either processing_s or process, a sub-task to learn, not both",
        ),
        (
            "position_m = [0.68, 0.45]",
            "position_m = [0.42, 0.56]",
            "t.toml: line 123: obstacle 'tower left' stands on station 'toaster_buffer'",
        ),
        (
            "height_m = 0.215",
            "height_m = 0.1",
            "t.toml: line 71: station 'toaster': grid.height_m 0.1: a carried slice would hit it",
        ),
        ("mass_kg", "weight", "t.toml: line 20: parts.0.weight of part 'slice': there is no such key"),
    ],
)
def test_bad_task_files(lab: Lab, folder: Path, toml: str, old: str, new: str, line: str, tree: Tree) -> None:
    (folder / "t.toml").write_text(changed(toml, old, new))
    ran = lab("run", "t.toml", "--json")
    assert (ran.code, ran.json["exit_code"]) == (2, 2)
    assert ran.err.startswith(f"lab: {line}")
    assert len(ran.err.splitlines()) == 1
    assert tree(folder) == ["t.toml"]


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
        (
            "view folder.png",
            "'folder.png' holds no replay.html: give the folder of a run (--out of lab run), a task or a world",
        ),
        ("see taken", "taken: not a picture that can be read: wanted a PNG or JPEG file"),
    ],
)
def test_folders_and_files_that_cannot_be_used(lab: Lab, folder: Path, words: str, line: str, tree: Tree) -> None:
    for name in ("taken", "toast-run"):
        (folder / name).write_text("mine")
    (folder / "folder.png").mkdir()
    before = tree(folder)
    ran = lab(*words.split(), "--json")
    said = str(LabError(line))
    assert (ran.code, ran.json, ran.err) == (2, {"error": said, "exit_code": 2}, f"lab: {said}\n")
    assert tree(folder) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="everything is writable for root")
def test_a_folder_without_the_right_to_write(lab: Lab, folder: Path) -> None:
    (folder / "locked").mkdir(mode=0o500)
    for option in ("--out", "--toolbox"):
        ran = lab("run", option, "locked/new")
        assert (ran.code, ran.out) == (2, "")
        assert "writable" in ran.err or "cannot be written" in ran.err
