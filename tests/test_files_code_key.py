"""Keys of own code: any change of a member's file, or of own code that it imports, gives another key."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.files import code_key, source_hash


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    """The key of the package `own_member`, as a new process would find it."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "own_member").mkdir()
    for name, text in {
        "own_member/__init__.py": "",
        "own_member/gate.py": "import numpy\n\n\ndef later():\n    import own_helper\n",
        "own_helper.py": "import own_far\n",
        "own_far.py": "FAR = 1\n",
        "own_stranger.py": "",
    }.items():
        (tmp_path / name).write_text(text)

    def found() -> str:
        code_key.cache_clear()
        source_hash.cache_clear()
        return code_key("own_member.gate")

    return found


@pytest.mark.parametrize("name", ["own_member/__init__.py", "own_member/gate.py", "own_helper.py", "own_far.py"])
def test_a_change_of_what_a_member_consists_of_changes_the_key(
    key: Callable[[], str], name: str, tmp_path: Path
) -> None:
    before = key()
    assert key() == before
    with (tmp_path / name).open("a") as file:
        file.write("# changed\n")
    assert key() != before


def test_what_it_does_not_import_is_not_in_the_key(key: Callable[[], str], tmp_path: Path) -> None:
    before = key()
    (tmp_path / "own_stranger.py").write_text("A = 1\n")
    assert key() == before


def test_no_code_runs(key: Callable[[], str], tmp_path: Path) -> None:
    (tmp_path / "own_far.py").write_text("raise SystemExit\n")
    assert key()
    assert "own_far" not in sys.modules


def test_an_installed_package_is_its_source_alone() -> None:
    assert code_key("gymnasium") == code_key("gymnasium.envs.toy_text.frozen_lake")


def test_a_module_without_a_file_is_refused() -> None:
    with pytest.raises(BadInput, match="'sys': it has no source file"):
        code_key("sys")
