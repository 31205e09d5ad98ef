"""`lab.run`: a toast is made, and what is left of it."""

from pathlib import Path

import pytest

import lab


@pytest.mark.slow
def test_a_toast_is_made_and_its_folder_goes_on(tmp_path: Path) -> None:
    run = lab.run("toast", toasts=1, out=tmp_path / "run", toolbox=tmp_path / "box", seed=1)
    assert run.success
    assert run.failure is None
    assert str(run).startswith("toast: 1 of 1 parts in ")
    assert run.makespan_s == pytest.approx(max(row["end_s"] for row in run.rows()))
    assert len(run.to_dataframe()) == len(run.rows())
    assert run.document["files"]["replay"] == str(tmp_path / "run" / "replay.html")
    assert run.replay.html == (tmp_path / "run" / "replay.html").read_text(encoding="utf-8")
    assert (tmp_path / "run" / "run.jsonl").is_file()
    assert b"<svg" in run.gantt.data
    again = lab.run("toast", toasts=1, toolbox=tmp_path / "box", seed=1)  # nothing is learned again, nothing written
    assert {row["source"] for row in again.document["skills"]} == {"reused"}
    assert again.document["files"] == {}


def test_what_cannot_be_is_said_in_a_line(tmp_path: Path) -> None:
    with pytest.raises(lab.BadInput, match=r"unknown option 'toast' .*did you mean 'toasts'"):
        lab.run("toast", toast=3)  # type: ignore[call-arg]
    with pytest.raises(lab.BadInput, match="can only name advisors that have a name"):
        lab.run("toast", advisor=lambda request: 0, out=tmp_path / "run")
    assert not [*tmp_path.iterdir()]
