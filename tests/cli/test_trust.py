"""A session received from somebody else: no name in a file is imported or opened outside its folder without being said."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran

DOOR = """
from pathlib import Path

import gymnasium

Path("ran").touch()


class Door(gymnasium.Env):
    observation_space = action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return 0, {}

    def step(self, action):
        return 1, 1.0, True, False, {}


gymnasium.register("LabTestDoor-v0", Door)
"""


def test_a_session_of_somebody_else_runs_no_code_unasked(lab: Lab, folder: Path) -> None:
    """Its journal names a module that lies beside it: that is imported by --trust-module and its name alone."""
    import gymnasium

    module = folder / "lab_test_door.py"
    module.write_text(DOOR, encoding="utf-8")

    def ran(*words: str) -> tuple[int, str, bool]:
        """The exit code, what was complained of, and whether the module's code has run."""
        gymnasium.registry.pop("LabTestDoor-v0", None)
        sys.modules.pop(module.stem, None)
        (folder / "ran").unlink(missing_ok=True)
        done = lab(*words)
        return done.code, done.err, (folder / "ran").exists()

    try:
        name = f"gym:{module.stem}:LabTestDoor-v0"
        assert ran("teach", name, "--out", "lesson", "--episodes", "3") == (0, "", True)  # typed, it is wanted
        broken = folder / "broken"
        broken.mkdir()
        lines = (folder / "lesson" / "events.jsonl").read_bytes().splitlines(keepends=True)
        (broken / "events.jsonl").write_bytes(b"".join(lines[:-1]))
        for words in (["replay", "lesson", "--json"], ["teach", "--resume", "broken"]):
            for trusted in ([], ["--trust-module", "lab_test"]):
                code, said, has_run = ran(*words, *trusted)
                assert (code, said.count("\n"), has_run) == (2, 1, False)
                assert f"whose code would run: if you trust whoever made it, say --trust-module {module.stem}" in said
            assert ran(*words, "--trust-module", module.stem) == (0, "", True)
        code, said, has_run = ran("teach", "world-1", "--advisor", "recorded:lesson")
        assert (code, "it is advice about another problem" in said, has_run) == (2, True, False)
    finally:
        gymnasium.registry.pop("LabTestDoor-v0", None)
        sys.modules.pop(module.stem, None)


def test_an_environment_without_a_module_imports_nothing_from_the_current_folder(lab: Lab, folder: Path) -> None:
    """What an environment of Gymnasium's own would like to have, and is not installed, is not taken from here."""
    import gymnasium

    (folder / "lab_test_missing.py").write_text("from pathlib import Path\nPath('ran').touch()\n", encoding="utf-8")
    gymnasium.register("LabTestNeeds-v0", entry_point="lab_test_missing:Env")
    try:
        refused = lab("teach", "gym:LabTestNeeds-v0")
    finally:
        gymnasium.registry.pop("LabTestNeeds-v0")
        sys.modules.pop("lab_test_missing", None)
    assert (refused.code, (folder / "ran").exists()) == (2, False)
    assert "it needs what is not installed: ModuleNotFoundError: No module named 'lab_test_missing'" in refused.err


def test_files_that_a_session_names_outside_its_folder_are_said(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    lab("teach", "w.txt", "--out", "lesson", "--episodes", "3")
    assert f"names, outside its folder, what is read now: {folder / 'w.txt'}\n" in lab("replay", "lesson").err
    (folder / "w.txt").rename(folder / "lesson" / "w.txt")
    journal = folder / "lesson" / "events.jsonl"
    inside = journal.read_text().replace(str(folder / "w.txt"), str(folder / "lesson" / "w.txt"))
    journal.write_text(inside)
    again = lab("replay", "lesson")
    assert (again.code, "outside its folder" in again.err) == (0, False)
