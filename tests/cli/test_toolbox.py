"""`lab toolbox`: lists, shows, checks and removes policies."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]
MakePolicy = Callable[..., Policy]


def test_an_empty_toolbox(lab: Lab, folder: Path, tree: Tree) -> None:
    box = str(folder / "toolbox")
    assert lab("toolbox", "list").out == f"nothing in {box}\n"
    assert lab("toolbox", "list", "--json").json == {"folder": box, "policies": []}
    assert lab("toolbox", "verify", "--json").json == {"folder": box, "files": [], "damaged": 0}
    assert tree(folder) == []


def test_toolbox_list_show_and_remove(lab: Lab, folder: Path, policy: MakePolicy) -> None:
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


def test_damaged_policies_are_named_and_never_listed(lab: Lab, folder: Path, policy: MakePolicy) -> None:
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
