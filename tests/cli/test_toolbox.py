"""`lab toolbox`: lists, shows, checks and removes policies."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.cli.toolbox import evaluation_summary
from lab.mdp import optimal_values
from lab.production.evaluation import Evaluation, SceneResult
from lab.skills.prepared_scene import prepare
from lab.tasks.task_file import load
from lab.toolbox.policy import GOAL, ON, OUT, Policy
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


# ---- toolbox archive --------------------------------------------------------------------------------------------------


NAME = "insert at toaster 12345678"


def test_an_archive_goes_out_and_comes_in(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    box = Toolbox(folder / "toolbox")
    for name in (NAME, "second"):
        box.save(policy(name))
    whole = lab("toolbox", "export", "--out", "all.zip", "--json").json
    assert [row["name"] for row in whole["policies"]] == [NAME, "second"]
    assert (whole["file"], whole["damaged"]) == ("all.zip", [])
    assert whole["bytes"] == Path("all.zip").stat().st_size
    assert lab("toolbox", "export", "second", "--out", "one.zip").out.startswith("one.zip: 1 policy, ")
    came = lab("toolbox", "import", "one.zip", "--toolbox", "other", "--json").json
    assert came == {"file": "one.zip", "toolbox": "other", "imported": ["second"], "replaced": [], "unchanged": []}
    ran = lab("toolbox", "import", "all.zip", "--toolbox", "other")
    assert ran.out == f"imported: {NAME}\nthere already: second\n"
    assert lab("toolbox", "verify", "--toolbox", "other", "--json").json["damaged"] == 0
    again = lab("toolbox", "export", "--toolbox", "other", "--out", "again.zip")
    assert again.code == 0
    assert Path("again.zip").read_bytes() == Path("all.zip").read_bytes()


def test_another_policy_of_that_name_stays_unless_it_is_to_be_replaced(
    lab: Lab, folder: Path, policy: MakePolicy
) -> None:
    box, other = Toolbox(folder / "toolbox"), Toolbox(folder / "other")
    box.save(policy("a"))
    lab("toolbox", "export", "--out", "a.zip")
    other.save(replace(policy("a"), seed=9, created="2020-01-01T00:00:00+00:00"))
    ran = lab("toolbox", "import", "a.zip", "--toolbox", "other")
    assert ran.code == 2
    assert ran.err.startswith("lab: toolbox other: 'a' is there already with other content: --replace")
    assert [row["seed"] for row in other.list()] == [9]
    assert lab("toolbox", "import", "a.zip", "--toolbox", "other", "--replace").out == "in place of another: a\n"
    assert [row["seed"] for row in other.list()] == [0]


def test_damaged_policies_are_left_out_and_named(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    box = Toolbox(folder / "toolbox")
    box.save(policy("a")).write_bytes(b"cut")
    ran = lab("toolbox", "export", "--out", "all.zip")
    assert (ran.code, ran.err) == (2, f"lab: toolbox {box.folder}: there is nothing to export\n")
    box.save(policy("b"))
    ran = lab("toolbox", "export", "--out", "all.zip", "--json")
    assert [row["name"] for row in ran.json["policies"]] == ["b"]
    assert len(ran.json["damaged"]) == 1
    assert ran.err.startswith("lab: left out: policy file ")


def test_what_is_refused(lab: Lab, folder: Path, policy: MakePolicy, tree: Tree) -> None:
    Path("bad.zip").write_bytes(b"PK\x03\x04 and nothing more")
    Path("empty").mkdir()
    before = tree(folder)
    for words, said in (
        ("import bad.zip", "archive bad.zip: it is no zip file, or a damaged one"),
        ("import nowhere.zip", "file nowhere.zip: there is no such file"),
        ("import empty", "folder empty: it holds no model.safetensors"),
        ("export --out all.zip", "there is nothing to export"),
        ("export nobody --out all.zip", "unknown policy 'nobody'"),
        ("card nobody --out card", "unknown policy 'nobody'"),
        ("publish nobody --out hub", "unknown policy 'nobody'"),
        ("evaluate nobody", "unknown policy 'nobody'"),
    ):
        ran = lab("toolbox", *words.split(), "--json")
        assert (ran.code, ran.gave_nothing) == (2, True), words
        assert said in ran.err
        assert len(ran.err.splitlines()) == 1
    assert tree(folder) == before
    Toolbox(folder / "toolbox").save(policy("a"))
    ran = lab("toolbox", "export", "--out", "no/all.zip")
    assert (ran.code, ran.err) == (
        2,
        "lab: archive 'no/all.zip' (--out) cannot be written: No such file or directory\n",
    )
    ran = lab("toolbox", "publish", "a", "--out", "hub", "--license", "my own")
    assert (ran.code, Path("hub").exists()) == (2, False)


def test_a_card_and_a_folder_for_the_hub(lab: Lab, folder: Path, policy: MakePolicy) -> None:
    Toolbox(folder / "toolbox").save(policy())
    made = lab("toolbox", "card", NAME, "--out", "card", "--json").json
    assert (made["policy"], made["files"]["card.md"]) == (NAME, "card/card.md")
    assert Path("card/card.md").read_text().startswith(f"# {NAME}\n")
    assert lab("toolbox", "card", NAME, "--out", "card").out == "the card: card/card.md\n"
    ran = lab("toolbox", "publish", NAME, "--out", "hub", "--license", "mit")
    assert ran.out == "6 files in hub; hf upload YOUR-NAME/REPOSITORY hub pushes it to the Hub\n"
    assert "\nlicense" in Path("hub/README.md").read_text()
    assert lab("toolbox", "import", "hub", "--toolbox", "other").out == f"imported: {NAME}\n"
    assert lab("toolbox", "import", "hub").out == f"there already: {NAME}\n"


# ---- toolbox evaluate -------------------------------------------------------------------------------------------------


PLACE = "place at toaster_buffer"


@pytest.fixture
def place(folder: Path, policy: Callable[..., Policy]) -> Policy:
    """A policy in the toolbox that sets a slice down by a shortest way."""
    mdp = prepare(load("toast"), ("slice",) * 3, 0, PLACE).problems[PLACE].mdp
    q = optimal_values(mdp, 0.99)
    ends = np.where(mdp.goal, GOAL, np.where(mdp.terminal, OUT, ON)).astype(np.uint8)
    grid: dict[str, Any] = {"shape": mdp.shape, "start": mdp.start, "action_labels": mdp.action_labels, "ends": ends}
    made = replace(policy(f"{PLACE} 12345678"), subtask="place", q=q, visits=np.zeros(q.shape, np.int64), **grid)
    Toolbox(folder / "toolbox").save(made)
    return made


def test_it_counts(lab: Lab, place: Policy) -> None:
    found = lab("toolbox", "evaluate", place.name, "--scenes", "2", "--seed", "3", "--json").json
    assert found.items() >= {
        "policy": place.name, "skill": PLACE, "task": "toast", "seed": 3, "scenes": 2, "successes": 2,
        "success_percent": 100.0, "unsolvable": 0, "interrupted": False,
    }.items()  # fmt: skip
    assert [row["seed"] for row in found["rows"]] == [3, 4]
    assert found["ci95"] == pytest.approx([34.24, 100.0], abs=0.01)
    noted = lab("toolbox", "log", place.name, "--json").json["events"][-1]
    assert (noted["what"], noted["successes"], noted["success_percent"]) == ("evaluated", 2, 100.0)
    lab("toolbox", "publish", place.name, "--out", "hub")
    text = Path("hub/README.md").read_text()
    assert "2 drawn scenes of toast from seed 3: 2 succeeded, 100 % (95 % interval 34 to 100)" in text
    assert "      value: 1.0000\n      name: share of 2 scenes that succeed" in text


def test_it_says_what_is_wrong(lab: Lab, place: Policy, toml: str) -> None:
    ran = lab("toolbox", "evaluate", place.name, "--skill", "place at toster_buffer")
    assert ran.code == 2
    assert (
        "unknown skill 'place at toster_buffer' (--skill, task 'toast'): did you mean 'place at toaster_buffer'?"
        in ran.err
    )
    assert lab("toolbox", "evaluate", place.name, "--task", "toas").code == 2
    assert lab("toolbox", "evaluate", place.name, "--scenes", "0").code == 2
    blocked = toml.replace(
        "position_m = [0.68, 0.45]\ncubes = 7\narea = [0.04, 0.04]", "position_m = [0.42, 0.56]\ncubes = 7"
    )
    assert blocked != toml
    Path("blocked.toml").write_text(blocked)
    ran = lab("toolbox", "evaluate", place.name, "--task", "blocked.toml", "--scenes", "2")
    assert (ran.code, ran.err) == (1, f"lab: in none of 2 drawn scenes can '{PLACE}' reach its goal\n")
    assert "not counted: 2 scenes in which nobody could reach the goal\nseed 0: blocked.toml: line" in ran.out
    assert "obstacle 'tower left' stands on" in ran.out


def test_ctrl_c_shows_what_was_done(lab: Lab, place: Policy, monkeypatch: pytest.MonkeyPatch) -> None:
    from lab.production import evaluation

    whole = evaluation.in_scene

    def stop(policy: Policy, task: Any, name: str, seed: int) -> SceneResult:
        if seed == 1:
            raise KeyboardInterrupt
        return whole(policy, task, name, seed)

    monkeypatch.setattr(evaluation, "in_scene", stop)
    ran = lab("toolbox", "evaluate", place.name, "--scenes", "9", "--json")
    assert (ran.code, ran.err) == (130, "lab: stopped by Ctrl-C after 1 scene of 9\n")
    assert (ran.json["successes"], ran.json["interrupted"]) == (1, True)


def test_a_line_for_each_scene_that_failed() -> None:
    scenes = [
        SceneResult(0, None, None, 2.0),
        SceneResult(1, "physics", "it fell", 1.0),
        SceneResult(2, "table", "it goes round", 0.0),
    ]
    document = Evaluation("mine", "grasp at plate", "toast", 0, 3, scenes, 1.5).to_json()
    lines = [str(line) for line in evaluation_summary(document).renderables]  # type: ignore[union-attr]
    assert lines == [
        "'mine' as 'grasp at plate': 1 of 3 drawn scenes of toast from seed 0 succeeded",
        "success 33.3 % (95 % interval 6.1 to 79.2)",
        "a success takes 2.0 s on average",
        "seed 1: it fell",
        "seed 2: it goes round",
    ]
