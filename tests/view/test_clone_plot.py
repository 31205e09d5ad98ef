"""The picture of a cloning session, read as SVG."""

from pathlib import Path

from lab.view.clone_plot import success_by_questions


def test_it_shows_each_round(tmp_path: Path) -> None:
    rounds = [[True, False, False, False], [True, True, False, False], [True] * 4]
    success_by_questions(rounds, [0, 10, 17], "grasp <by> distance", tmp_path / "rounds.svg")
    drawn = (tmp_path / "rounds.svg").read_text(encoding="utf-8")
    assert all(f">round {number}</text>" in drawn for number in range(3))
    assert "grasp &lt;by&gt; distance" in drawn
    assert "successes of 4 episodes" in drawn
