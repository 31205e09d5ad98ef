"""`lab.compare` and `lab.study`: rows, pictures, a report."""

from pathlib import Path

import pytest

import lab
from lab.learning.requests import AdviceRequest

ROWS = "S..\n.#.\n..G"


def right_then_down(request: AdviceRequest) -> int:
    _, column = request.mdp.state_cell(request.state)
    return request.mdp.action_labels.index("right" if column < 2 else "down")


def test_settings_and_advisors_are_compared(tmp_path: Path) -> None:
    found = lab.compare(
        lab.world(ROWS), advisor=["none", right_then_down], gate=["always", "never"], episodes=20, sessions=5
    )
    steps = {(row["advisor"], row["gate"]): row for row in found.rows if row["measure"] == "mean_steps"}
    assert len(steps) == 4
    assert steps["right_then_down", "always"]["value"] == 4.0
    assert steps["none", "always"]["value"] == steps["none", "never"]["value"] > 4.0
    assert found.summary["best"] == "advisor right_then_down, gate always, episodes 20"
    assert len(found.to_dataframe()) == len(found.rows) == 4 * 11
    assert "Mean steps of each episode" in found.figures
    assert "right_then_down" in found.report(tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_study_is_run_by_its_name() -> None:
    found = lab.study("figure-9.4", sessions=10)
    assert found.rows
    with pytest.raises(lab.BadInput, match="unknown study"):
        lab.study("figure-9.44")
    with pytest.raises(lab.BadInput, match="takes 10 at the least"):
        lab.study("figure-9.4", sessions=3)
    with pytest.raises(lab.BadInput, match="has none to choose"):
        lab.study("figure-9.4", sessions=10, seconds=3.0)
