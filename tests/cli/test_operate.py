"""`lab operate` from a pipe: the document, the exit codes, what is kept."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]


def test_commands_come_from_a_pipe_and_are_kept(lab: Lab, tmp_path: Path) -> None:
    ran = lab(
        "operate",
        "toast",
        "--toasts",
        "1",
        "--json",
        "--out",
        str(tmp_path),
        stdin="jog +z 20\nspeed max\nhome\nquit\n",
    )
    assert ran.code == 0
    assert [row["words"] for row in ran.json["commands"]] == ["jog +z 20", "speed max", "home"]
    assert (ran.json["task"], ran.json["seed"], ran.json["parts"]) == ("toast", 0, {"slice": 1})
    assert (ran.json["success"], ran.json["status"]["parts"][0]["state"]) == (False, "waiting")
    kept = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert [line["words"] for line in kept if line["kind"] == "commanded"] == ["jog +z 20", "speed max", "home"]


@pytest.mark.parametrize(
    ("lines", "options", "why"),
    [
        ("gresp\n", ("toast",), "did you mean 'grasp'?"),
        ("run\n", ("toast",), "there is no plan yet"),
        ("", ("toast", "--speed", "fast"), "'fast' is no number of times real time, or max"),
        ("", ("toats",), "did you mean 'toast'?"),
    ],
)
def test_what_is_wrong_ends_it_with_exit_code_2(
    lab: Lab, tmp_path: Path, lines: str, options: tuple[str, ...], why: str
) -> None:
    ran = lab("operate", *options, "--json", "--out", str(tmp_path / "out"), stdin=lines)
    assert ran.code == 2
    assert why in ran.err.splitlines()[-1]
    assert len(ran.out.splitlines()) == 1


def test_a_refused_line_does_not_end_the_pipe(lab: Lab, tmp_path: Path) -> None:
    """The run is replayed with the command that goes on with it."""
    out = str(tmp_path / "out")
    ran = lab("operate", "toast", "--toasts", "1", "--json", "--out", out, stdin="gresp\njog +z 20\n")
    assert (ran.code, [row["words"] for row in ran.json["commands"]][-1]) == (2, "jog +z 20")
    assert "did you mean 'grasp'?" in ran.err.splitlines()[-1]
    assert lab("replay", out, "--json").json["command"] == "operate"
    assert f"not over: lab operate --resume {out}" in lab("replay", out).out.replace("\n", " ")


def test_a_motion_that_is_stopped_ends_it_with_exit_code_1(lab: Lab, tmp_path: Path) -> None:
    lines = "close\n" + 80 * "jog -z 10\n" + "home\n"
    ran = lab("operate", "toast", "--toasts", "1", "--json", "--out", str(tmp_path), stdin=lines)
    assert ran.code == 1
    assert "protective stop: the arm presses on '" in ran.err.splitlines()[-1]
    assert ran.json["commands"][-1]["failed"]


def test_a_lead_that_was_broken_off_goes_on_and_is_in_the_toolbox(lab: Lab, tmp_path: Path) -> None:
    out, box, skill = str(tmp_path / "led"), str(tmp_path / "box"), "transfer plate to insert with slice"
    lines = f"lead {skill}\nmove plate\n"
    ran = lab("operate", "toast", "--toasts", "1", "--json", "--out", out, "--toolbox", box, stdin=lines)
    assert (ran.code, ran.json["demonstrations"]) == (0, [])
    ran = lab("operate", "--resume", out, "--json", "--toolbox", box, stdin="move insert\nlead end\n")
    (row,) = ran.json["demonstrations"]
    assert (ran.code, row["skill"], row["begins_at_start"], row["reached"]) == (0, skill, True, True)
    words = [done["words"] for done in ran.json["commands"]]
    assert words == [f"lead {skill}", "move plate", "move insert", "lead end"]
    listed = lab("toolbox", "list", "--json", "--toolbox", box).json
    assert [(one["name"], one["advisor"]) for one in listed["policies"]] == [(row["policy"], "led by operator")]


def test_what_was_done_by_hand_is_done_again_and_gone_on_with(lab: Lab, tmp_path: Path) -> None:
    """Nobody ran it to its end; the jog is done again at its step, and a run is not gone on with as another command's."""
    out = tmp_path / "mine"
    first = lab("operate", "toast", "--toasts", "1", "--out", str(out), "--json", stdin="jog +z 20\nquit\n")
    assert first.code == 0
    again = lab("operate", "--resume", str(out), "--json", stdin="jog -z 20\nquit\n")
    assert again.code == 0
    said = [one["words"] for one in again.json["commands"]]
    assert said == ["jog +z 20", "jog -z 20"]
    lines = [json.loads(line) for line in (out / "run.jsonl").read_text().splitlines()]
    steps = [line["step"] for line in lines if line["kind"] == "commanded"]
    assert steps[0] == 0 < steps[1]
    other = lab("run", "--resume", str(out))
    assert other.err.endswith(f"lab operate --resume {out}\n")
