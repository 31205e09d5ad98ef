"""`lab study export` and `lab study people` at the command line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.classroom.made_study import made_study

Lab = Callable[..., Any]


def test_a_study_is_exported_and_its_arms_are_compared(lab: Lab, tmp_path: Path) -> None:
    made, data = made_study(tmp_path), tmp_path / "data"
    ran = lab("study", "export", str(made), "--out", str(data), "--json")
    assert ran.code == 0, ran.err
    assert (ran.json["participants"], ran.json["withdrawn"]) == (2, 1)
    own = {
        name: lab("study", "people", str(place), "--out", str(tmp_path / name), "--no-model", "--json")
        for name, place in (("a", data), ("b", made))
    }
    assert [ran.code for ran in own.values()] == [0, 0], own["a"].err
    first, second = (ran.json | {"files": None} for ran in own.values())
    assert first == second
    assert [measure["name"] for measure in first["measures"]][-1] == "tlx_mean"
    assert "2 withdrawn" not in lab("study", "export", str(made), "--out", str(data)).out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["export", "nowhere", "--out", "x"], "'nowhere' (DIR) holds no class"),
        (["people", "nowhere", "--out", "x"], "'nowhere' (DIR) holds neither an export"),
        (["people", "data", "--out", "x"], "participants.csv', line 2: seconds is 'soon': a number is wanted"),
        (["export", "data"], "--out"),
    ],
)
def test_what_is_refused(
    lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    data = tmp_path / "data"
    data.mkdir()
    (data / "export.json").write_text(json.dumps({"format": "teaching-lab export 1", "class": "c"}))
    (data / "dictionary.csv").write_text("table,name,type,unit,meaning,allowed\nparticipants,seconds,number,s,,\n")
    (data / "participants.csv").write_text("participant,arm,lesson,seconds\np,a,1,soon\n")
    ran = lab("study", *words)
    assert (ran.code, ran.out) == (2, "")
    assert said in ran.err
    assert ran.err.count("\n") == 1
    assert not (tmp_path / "x").exists()
