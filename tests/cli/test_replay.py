"""`lab replay`: a kept session again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def test_a_session_is_replayed_listed_and_not_gone_on_with_when_it_is_over(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    taught = lab(
        "teach", "w.txt", "--advisor", "terminal", "--gate", "always", "--out", "lesson", stdin="right\nauto\n"
    )
    assert (taught.code, "receipt" in taught.out) == (0, False)
    ran = lab("replay", "lesson", "--json")
    assert (ran.code, ran.out.count("\n")) == (0, 1)
    assert (
        ran.err
        == f"lab: journal 'lesson/events.jsonl' names, outside its folder, what is read now: {folder / 'w.txt'}\n"
    )
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
    rows = lab("replay", "--json").json["sessions"]
    places = [(row["problem"], row["advisor"], Path(row["session"]).name) for row in rows]
    assert places == [("w", "none", "w-2"), ("w", "terminal", "lesson")]
    again = lab("teach", "w.txt", "--out", "lesson")
    assert (again.code, again.out, again.err.count("\n")) == (2, "", 1)
    assert "'lesson' (--out) holds a session that is over: look at it again (lab replay lesson)" in again.err
    assert lab("replay", "lesson", "--json").json == ran.json


def test_ctrl_c_ends_a_replay_at_once(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While it shows answers, and when it is over and goes on serving its page; nothing was learned, nor is it said."""
    lab("teach", "world-1", "--out", "lesson", "--episodes", "40", "--gate", "always")
    shown: list[float] = []

    def stop(pause_s: float) -> None:
        shown.append(pause_s)
        if pause_s in (0.25, 3600):
            raise KeyboardInterrupt

    monkeypatch.setattr("lab.seat.lesson_seat.ReplayPace.wait", lambda pace: stop(pace.pause_s))
    monkeypatch.setattr("lab.seat.lesson_seat.time.sleep", stop)
    monkeypatch.setattr("lab.seat.lesson_seat.PAGE_S", 0.0)
    for words in (["--pause", "0.25"], ["--pause", "0.25", "--page"], ["--pause", "0", "--page"]):
        ran = lab("replay", "lesson", *words)
        assert (ran.code, ran.err.splitlines()[-1]) == (130, "lab: stopped by Ctrl-C")
        assert ("over after" in ran.out) == ("0" in words)
    assert shown[:2] == [0.25, 0.25]
    assert shown[-1] == 3600


def test_a_lesson_in_sentences_is_learned_from_and_replayed(lab: Lab, folder: Path) -> None:
    """Each answer of a sentence is a move in the journal, so that the replay and the resumed session need no grammar."""
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    said = "go around the cube on the left\nkeep away from the fridge\ngo to the goal\nlike last time\nnever ask me again\n"
    words = ("w.txt", "--advisor", "terminal", "--gate", "always", "--memory", "--episodes", "30", "--out", "lesson")
    taught = lab("teach", *words, stdin=said)
    assert taught.code == 0, taught.err
    assert "Understood: to the goal." in taught.err
    assert "'fridge': not understood" in taught.err
    events = lab("replay", "lesson", "--json").json["events"]
    answers = [event["action"] for event in events if event["kind"] == "answer" and not event["left"]]
    assert answers[:4] == [1, 1, 3, 3]  # down, down, right, right
    assert lab("replay", "lesson", "--json").json["events"] == events


def test_what_was_said_and_holds_is_resumed(lab: Lab, folder: Path) -> None:
    """A rule and a time without questions are in the journal where they were said, and hold after --resume."""
    (folder / "w.txt").write_text("S....\n.....\n..#..\n.....\n....G\n")
    said = "keep away from the cube, then go right\nno questions for 3 steps\nquit\n"
    words = ("w.txt", "--advisor", "terminal", "--gate", "always", "--episodes", "2", "--seed", "3", "--out", "lesson")
    lab("teach", *words, stdin=said)
    lines = [json.loads(line) for line in (folder / "lesson" / "events.jsonl").read_text().splitlines()]
    holds = [line["holds"] for line in lines if line.get("holds") is not None]
    assert holds[0] == [{"rule": {"avoid": "cube"}, "problem": holds[0][0]["problem"]}]
    assert [each[1:] for each in holds[1:]] == [[{"quiet": left, "episode": 1}] for left in (2, 1, 0)]
    again = lab("teach", "--resume", "lesson", stdin="right\nquit\n")
    assert "Your rules: keep away from the cube." in again.err
