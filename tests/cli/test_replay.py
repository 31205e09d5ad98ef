"""`lab replay`: a kept session again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def test_a_session_is_replayed_listed_and_not_gone_on_with_when_it_is_over(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    taught = lab(
        "teach", "w.txt", "--advisor", "terminal", "--gate", "always", "--out", "lesson", stdin="right\nauto\n"
    )
    assert (taught.code, "receipt" in taught.out) == (0, False)
    ran = lab("replay", "lesson", "--json")
    assert (ran.code, ran.out.count("\n"), ran.err) == (0, 1, "")
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
