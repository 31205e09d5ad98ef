"""Members from files are taken again in a further process: those of a lesson's families."""

from pathlib import Path
from typing import Any

import pytest

from lab.plugins.family import Family
from lab.teaching import own_members


def test_what_no_lesson_has_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gates: Family[Any] = Family("gates", {}, lambda name, thing: thing)
    monkeypatch.setattr(own_members, "FAMILIES", {"gates": gates})
    (tmp_path / "mine.py").write_text("GATE = 7\n")
    word = f"{tmp_path}/mine.py:GATE"
    own_members.take_again({"other.RULE": ("doubts", "nowhere.py:RULE"), "mine.GATE": ("gates", word)})
    assert dict(gates) == {"mine.GATE": 7}
