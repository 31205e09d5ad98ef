"""`lab toolbox`: lists, shows, checks and removes policies."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

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
    removed = lab("toolbox", "remove", name, "--json").json["removed"]
    assert Path(removed).parent == folder / "toolbox"
    assert lab("toolbox", "list", "--json").json["policies"] == []
    assert lab("toolbox", "restore", name, "--json").json == {"restored": removed}
    assert len(lab("toolbox", "list", "--json").json["policies"]) == 1
    assert lab("toolbox", "restore", "nothing").code == 2


def test_versions_promote_rollback_and_log(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    box, first = Toolbox(folder / "toolbox"), policy()
    name, saved = first.name, box.put(first)
    other = box.put(replace(first, seed=7, parent=f"{name}@{saved.hash}", scene="moved cubes"))
    (row,) = lab("toolbox", "list", "--json").json["policies"]
    held = {field: row[field] for field in ("version", "hash", "parent", "scene")}
    assert held == {"version": 2, "hash": other.hash, "parent": f"{name}@{saved.hash}", "scene": "moved cubes"}
    file = str(folder / "toolbox" / saved.file)
    assert lab("toolbox", "promote", name, saved.hash[:5], "--json").json == {
        "name": name,
        "version": 1,
        "hash": saved.hash,
        "file": file,
    }
    assert lab("toolbox", "rollback", name).out == f"'{name}': version 2 ({other.hash}) is in use\n"
    ran = lab("toolbox", "promote", name, "7")
    assert (ran.code, ran.out) == (2, "")
    assert f"no version '7'; there are: 1 ({saved.hash}), 2 ({other.hash})" in ran.err
    events = lab("toolbox", "log", name, "--json").json["events"]
    assert [event["what"] for event in events] == ["learned", "warm-started", "promoted", "rolled back"]
    assert [line.split("  ")[1].split(":")[0] for line in lab("toolbox", "log", name).out.splitlines()] == [
        f"learned version 1 ({saved.hash})",
        f"warm-started version 2 ({other.hash})",
        f"promoted version 1 ({saved.hash})",
        f"rolled back version 2 ({other.hash})",
    ]
    shown = lab("toolbox", "show", name).out
    assert f"warm-started from {name}@{saved.hash}" in shown
    assert "2 versions kept" in shown


def test_a_list_is_filtered(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    box = Toolbox(folder / "toolbox")
    assert lab("toolbox", "list", "--subtask", "anything", "--json").json["policies"] == []  # it holds none at all
    box.save(policy("one"))
    box.save(replace(policy("two"), subtask="grasp", task="mine", advisor="expert", solved=True))
    box.save(replace(policy("three"), subtask="grasp", solved=False))

    def names(*words: str) -> list[str]:
        return sorted(row["name"] for row in lab("toolbox", "list", *words, "--json").json["policies"])

    assert names("--subtask", "grasp") == ["three", "two"]
    assert names("--task", "mine") == names("--advisor", "expert") == names("--subtask", "grasp", "--solved") == ["two"]
    assert "three" in names("--unsolved")
    assert names("--subtask", "cover") == names("--advisor", "tau=0.2") == names("--task", "fms") == []
    for option, word, hint in (("subtask", "gras", "grasp"), ("advisor", "exprt", "expert"), ("task", "mne", "mine")):
        ran = lab("toolbox", "list", f"--{option}", word)
        assert ran.code == 2
        assert f"'{word}' (--{option}, toolbox {box.folder}): did you mean '{hint}'?" in ran.err


def test_of_many_only_the_nearest_are_named(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    box, made = Toolbox(folder / "toolbox"), policy()
    for number in range(40):
        box.save(replace(made, name=f"skill-{number}"))
    err = lab("toolbox", "show", "skil-39").err
    assert "did you mean 'skill-39'? near: skill-39, " in err
    assert err.count("skill-") < 10
    assert err.endswith("lab toolbox list names all 40 policies\n")


def test_a_toolbox_elsewhere(lab: Lab, folder: Path, policy: MakePolicy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    monkeypatch.setenv("XDG_DATA_HOME", str(folder / "data"))
    Toolbox("memory://cli/box").save(policy("far"))
    at = ("--toolbox", "memory://cli/box", "--json")
    (row,) = lab("toolbox", "list", *at).json["policies"]
    assert row["file"] == lab("toolbox", "remove", "far", *at).json["removed"] == "memory://cli/box/far.safetensors"
    assert lab("toolbox", "restore", "far", *at).json == {"restored": row["file"]}
    assert lab("toolbox", "verify", *at).json == {
        "folder": "memory://cli/box",
        "files": [{"file": row["file"], "ok": True, "reason": ""}],
        "damaged": 0,
    }
    ran = lab("toolbox", "list", "--toolbox", "nothing://x")
    assert (ran.code, ran.err.startswith("lab: toolbox nothing://x: ")) == (2, True)


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
