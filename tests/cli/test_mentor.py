"""`lab mentor`, on recordings of a cart."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_write import write


def cart(places: list[float], corrected: tuple[int, ...] = ()) -> Episode:
    states = np.array(places, np.float32)[:, None]
    return Episode("go", states, states, np.isin(np.arange(len(places)), corrected), True)


@pytest.fixture(scope="module")
def datasets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """With takeovers, demonstrations, and rollouts."""
    folder = tmp_path_factory.mktemp("datasets")
    straight, strayed = [0.1 * step for step in range(11)], [0.0, 0.1, 0.2, 5.0, 5.1, 0.3]
    episodes = {
        "taken": [cart(straight) for _ in range(12)] + [cart(strayed, (5,)) for _ in range(3)],
        "shown": [cart(straight) for _ in range(4)],
        "alone": [cart([place + 0.01 * number for place in straight]) for number in range(1, 10)],
    }
    for name, held in episodes.items():
        write(Recording(1, "cart", ("x",), ("dx",), held), folder / name)
    write(Recording(1, "cart", ("y",), ("dx",), episodes["alone"]), folder / "other")
    unknown = [replace(episode, success=None) for episode in episodes["alone"]]
    write(Recording(1, "cart", ("x",), ("dx",), unknown), folder / "unknown")
    return {name: folder / name for name in (*episodes, "other", "unknown")}


def test_it_compares_the_rules(lab: Any, datasets: dict[str, Path], tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    document = lab("mentor", str(datasets["taken"]), "--window", "2", "--report", str(page), "--json").json
    assert document["takeovers"] == 3
    assert {row["rule"]: row["recall"] for row in document["rules"]}["distance"] == 1.0
    assert "distance" in page.read_text(encoding="utf-8")
    assert "distance" in lab("mentor", str(datasets["taken"]), "--window", "2").out


def test_a_rule_from_a_file_is_compared_with_those_that_ship(lab: Any, datasets: dict[str, Path], root: Path) -> None:
    words = "mentor", str(datasets["taken"]), "--window", "2", "--json", "--rule"
    ran = lab(*words, f"{root}/examples/own_doubt.py:Hesitation")
    assert [row["rule"] for row in ran.json["rules"]][-1] == "own_doubt.Hesitation"
    assert "runs the code of" in ran.err
    assert "unknown rule 'distence' (--rule): did you mean 'distance'?" in lab(*words, "distence").err


def test_it_keeps_a_mentor_with_its_promise(lab: Any, datasets: dict[str, Path], tmp_path: Path) -> None:
    kept = tmp_path / "mentor.safetensors"
    words = [
        "mentor",
        *map(str, (datasets["shown"], "--rollouts", datasets["alone"], "--keep", kept, "--false-alarms", 0.2)),
    ]
    document = lab(*words, "--json").json
    assert (document["successes"], document["expected"]) == (9, 0.2)
    mentor = Mentor.load(kept)
    assert mentor.threshold == document["threshold"]
    assert mentor([9.0], [0.0])
    assert "20" in lab(*words).out


def test_who_watched_the_rollouts_says_which_failed(lab: Any, datasets: dict[str, Path], tmp_path: Path) -> None:
    """A recording of a real robot rarely marks it; of nine rollouts, those number 0 and 8 failed here."""
    words = ["mentor", *map(str, (datasets["shown"], "--rollouts", datasets["unknown"], "--false-alarms", 0.2))]
    said = [lab(*words, "--keep", str(tmp_path / "m"), "--failed", failed, "--json") for failed in ("0, 8", "none")]
    assert [ran.json["successes"] for ran in said] == [7, 9]
    refused = lab(*words, "--keep", str(tmp_path / "n"))
    assert (refused.code, "--failed" in refused.err, "next.success" in refused.err) == (2, True, True)


FAULTY = """
import lab

class Learns(lab.Doubt):
    @classmethod
    def learned(cls, demonstrated, rollouts, rng):
        return {"a": "text"}

    def __call__(self, step):
        return 1.0
"""


def test_a_rule_that_learns_no_arrays_is_refused_before_anything_is_kept(
    lab: Any, datasets: dict[str, Path], tmp_path: Path
) -> None:
    (tmp_path / "bad.py").write_text(FAULTY)
    words = map(str, (datasets["shown"], "--rollouts", datasets["alone"], "--keep", tmp_path / "m"))
    ran = lab("mentor", *words, "--rule", f"{tmp_path}/bad.py:Learns")
    assert ran.code == 2
    assert "'text'" in ran.err
    assert not (tmp_path / "m").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing"], "nothing"),
        (["nothing", "--false-alarms", "7"], "share 7.0 (--false-alarms)"),
        (["nothing", "--false-alarms", "nan"], "share nan (--false-alarms)"),
        (["{taken}", "--failed", "1"], "--failed 1 without --rollouts"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--failed", "1,9"], "'9' (--failed): wanted numbers"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--failed", "-1"], "'-1' (--failed)"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--failed", ""], "'' (--failed)"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--failed", "9" * 5000], "(--failed): wanted numbers"),
        (["{shown}"], "takeovers"),
        (["{taken}", "--keep", "x"], "--rollouts"),
        (["{taken}", "--rule", "failure"], "--keep"),
        (["{shown}", "--rollouts", "{other}", "--keep", "m"], "state_names"),
        (["{shown}", "--rollouts", "{shown}", "--keep", "m"], "has learned from it"),
        (["{taken}", "--report", "no/such/folder.html"], "--report"),
        (["{taken}", "--false-alarms", "0.01"], "0.01"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--rule", "distanc"], "did you mean 'distance'"),
        (["{shown}", "--rollouts", "{taken}", "--keep", "m", "--rule", "failure"], "failure"),
        (["{shown}", "--rollouts", "{alone}", "--keep", "m", "--report", "r.html"], "--report"),
    ],
)
def test_bad_input_is_one_line(
    lab: Any, datasets: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = lab("mentor", *(word.format(**datasets) for word in words))
    assert ran.code == 2
    assert told in ran.err
    assert len(ran.err.strip().splitlines()) == 1
    assert not [*tmp_path.iterdir()]
