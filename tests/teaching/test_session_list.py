"""The list of sessions: a damaged journal is a row of its own, whatever it holds, and hides no other."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.advice.entries import FILE, SessionEntry, line_of, read_journal
from lab.errors import BadInput
from lab.teaching.kept_session import KeptSession
from lab.teaching.session_list import session_rows
from lab.toolbox.names import SESSIONS
from lab.toolbox.registry import Toolbox

HEAD = line_of(SessionEntry({"subtask": "maze.toml", "advisors": ["novice", "expert"], "seed": 3}, "maze", "0a", "0.1"))
Damage = Callable[[dict[str, Any]], dict[str, Any]]


def keep(folder: Path, head: str) -> Path:
    """A session that has only begun."""
    folder.mkdir(parents=True)
    (folder / FILE).write_text(head + "\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda head: {"kind": []}, "schema None: this version of the lab reads schema 1"),
        (lambda head: head | {"kind": []}, "is none of session, "),
        (
            lambda head: head | {"words": head["words"] | {"advisors": [1]}},
            r"advisors\.0: Input should be a valid string",
        ),
        (
            lambda head: head | {"words": head["words"] | {"seed": -1}},
            "seed: Input should be greater than or equal to 0",
        ),
        (lambda head: head | {"words": []}, "words: Input should be an object"),
        (lambda head: head | {"problem": "\x1b[31mred"}, "problem: it holds what cannot be printed"),
    ],
)
def test_a_damaged_journal_is_a_row_and_hides_no_other(tmp_path: Path, damage: Damage, why: str) -> None:
    sound = keep(tmp_path / "box" / SESSIONS / "maze-1", HEAD)
    bad = keep(tmp_path / "box" / SESSIONS / "maze-2", json.dumps(damage(json.loads(HEAD))))
    rows = {row["session"]: row for row in session_rows(Toolbox(tmp_path / "box"))}
    assert {str(sound): "not over", str(bad): "damaged"} == {folder: row["state"] for folder, row in rows.items()}
    assert (rows[str(sound)]["problem"], rows[str(sound)]["advisor"]) == ("maze", "novice + expert")
    with pytest.raises(BadInput, match=why) as refused:
        KeptSession(bad, "toolbox")
    assert len(str(refused.value)) < 400
    assert rows[str(bad)]["why"] == str(refused.value)


def test_who_advised_by_a_damaged_record_is_refused_in_a_line(tmp_path: Path) -> None:
    bad = keep(tmp_path / "lesson", json.dumps(json.loads(HEAD) | {"problem": "a\nb"}))
    with pytest.raises(BadInput, match=r"^journal '.*' \(--advisor\): line 1: .*cannot be printed$"):
        read_journal(bad, "--advisor")


def test_a_toolbox_that_is_a_file_holds_no_list(tmp_path: Path) -> None:
    (tmp_path / "box").write_text("")
    with pytest.raises(BadInput, match=r"box: it is a file, a folder is needed$"):
        session_rows(Toolbox(tmp_path / "box"))
    assert session_rows(Toolbox(tmp_path / "none")) == []
