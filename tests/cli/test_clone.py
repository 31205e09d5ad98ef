"""`lab clone`, with few short episodes."""

from collections.abc import Callable
from pathlib import Path
from shutil import rmtree
from typing import Any

import pytest

from lab.recordings.lerobot_read import read

SHORT = ("--demonstrations", "1", "--evaluated", "1", "--epochs", "2", "--rule", "always", "--questions", "1")


@pytest.mark.slow
def test_it_clones_asks_and_goes_on(lab: Callable[..., Any], tmp_path: Path) -> None:
    out = tmp_path / "grasp"
    first = lab("clone", "grasp", *SHORT, "--rounds", "0", "--out", str(out), "--json").json
    assert [one["questions"] for one in first["rounds"]] == [0]
    again = lab("clone", "--resume", str(out), "--json").json  # it keeps its number of rounds
    assert [one["round"] for one in again["rounds"]] == [0]
    assert lab("clone", "--resume", str(out), "--rule", "never").err.startswith("lab: --rule beside --resume")
    plot = tmp_path / "rounds.svg"
    after = lab("clone", "--resume", str(out), "--rounds", "1", "--plot", str(plot))
    assert ">round 1</text>" in plot.read_text(encoding="utf-8")
    assert "1 question" in after.err
    assert "LeRobot" in after.out
    shown, other = read(out / "demonstrations"), tmp_path / "other"
    begun = ("--dataset", str(out / "demonstrations"), "--evaluated", "1", "--epochs", "2", "--rounds", "0")
    ran = lab("clone", "grasp", *begun, "--seed", "5", "--out", str(other))
    assert "1 demonstration of 'grasp at plate'" in ran.err
    assert read(other / "demonstrations").episodes[0].actions.tobytes() == shown.episodes[0].actions.tobytes()

    rmtree(other / "demonstrations")
    assert "came from a dataset" in lab("clone", "--resume", str(other)).err


def test_a_person_demonstrates_on_the_command_line(lab: Callable[..., Any], tmp_path: Path) -> None:
    out = tmp_path / "mine"
    words = ("--teacher", "terminal", "--demonstrator", "person", "--rounds", "0", "--out", str(out))
    ran = lab("clone", "grasp", *SHORT, *words, "--json", stdin="teacher\n" * 10)
    assert ran.json["demonstrator"] == "person"
    (episode,) = read(out / "demonstrations").episodes
    assert episode.success
    assert not episode.corrected.any()


def test_what_a_person_shows_needs_a_folder(lab: Callable[..., Any]) -> None:
    ran = lab("clone", "grasp", "--teacher", "terminal", stdin="wait\n")
    assert ran.code == 2
    assert "--out" in ran.err


def test_a_session_of_ones_own_task_goes_on_from_another_folder_with_the_same_task(
    lab: Callable[..., Any], root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    toast = (root / "tasks" / "toast.toml").read_text(encoding="utf-8")
    Path("mine.toml").write_text(toast, encoding="utf-8")
    begun = lab("clone", "grasp", "--task", "mine.toml", *SHORT, "--rounds", "0", "--out", "ses", "--json").json
    monkeypatch.chdir(tmp_path)
    after = lab("clone", "--resume", "work/ses", "--json").json
    assert after["rounds"] == begun["rounds"]
    Path("work/mine.toml").write_text(toast.replace("grip_force_n = 25.0", "grip_force_n = 24.0"), encoding="utf-8")
    ran = lab("clone", "--resume", "work/ses")
    assert (ran.code, "has changed since it was begun" in ran.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "--resume"),
        (["grasp", "--rule", "distanc"], "did you mean 'distance'"),
        (["grasp", "--false-alarms", "0"], "false_alarms"),
        (["grasp", "--false-alarms", "0.1", "--rule", "clock"], "--false-alarms beside --rule clock"),
        (["grap"], "did you mean 'grasp'?"),
        (["grasp", "--task", "toas"], "toas"),
        (["--resume", "nothing"], "session 'nothing' (--resume): 'session.json': No such file"),
        (["grasp", "--plot", "x.gif"], "x.gif"),
        (["grasp", "--resume", "nothing"], "one of the two"),
        (["grasp", "--dataset", "nothing"], "nothing"),
        (["grasp", "--demonstrator", "person"], "--teacher page"),
        (["grasp", "--demonstrator", "persn"], "did you mean 'person'"),
        (["grasp", "--demonstrator", "dataset"], "person, scripted"),
        (["grasp", "--dataset", "nothing", "--demonstrations", "3"], "--demonstrations beside --dataset"),
    ],
)
def test_bad_input_is_one_line(
    lab: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = lab("clone", *words, *(["--out", "new"] if "--resume" not in words else []))
    assert ran.code == 2
    assert told in ran.err
    assert len(ran.err.strip().splitlines()) == 1
    assert not [*tmp_path.iterdir()]
