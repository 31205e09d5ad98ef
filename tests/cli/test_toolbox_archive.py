"""`lab toolbox card`, `export`, `import` and `publish`: what goes out comes in again, and nothing else does."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]
MakePolicy = Callable[..., Policy]
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
