"""Leaderboards: ranks by hand, and files that may not stand on one board."""

from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.studies.leaderboard import draw_board, leaderboard, read_scores, scores_file


def rows(*values: float, problem: str = "maze") -> list[dict[str, Any]]:
    """One row a value, whose interval reaches one below and above it, each in a cell of its own."""
    named = ({"problem": problem, "budget": number, "measure": "gain"} for number in range(len(values)))
    return [row | {"value": value, "ci95": [value - 1, value + 1]} for row, value in zip(named, values, strict=True)]


def written(folder: Path, member: str, results: list[dict[str, Any]], version: str = "v1") -> Path:
    path = folder / f"{member}-{version}.csv"
    path.write_text(scores_file("bench", version, member, results, ("problem", "budget")))
    return path


def test_a_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    alone = {"problem": "maze", "budget": None, "measure": "gain", "value": 0.0, "ci95": None}  # nobody's row
    scores = read_scores(written(tmp_path, "a", [alone, *rows(2.0)]))
    assert scores[:3] == ("bench", "v1", "a")
    assert scores.scores == (("maze, 0", "gain", 2.0, 1.0, 3.0),)


def test_a_board_by_hand(tmp_path: Path) -> None:
    """In the first cell a is ahead, in the second they tie: mean ranks (1 + 1.5) / 2 and (2 + 1.5) / 2."""
    paths = [written(tmp_path, "b", rows(-1.0, 5.0)), written(tmp_path, "a", rows(3.0, 5.0))]
    board = leaderboard(paths)
    assert (board["study"], board["version"], board["cells"], board["measures"]) == ("bench", "v1", 2, ["gain"])
    assert board["members"] == [
        {"member": "a", "gain_rank": 1.25, "gain": 4.0, "gain_harm": 0},
        {"member": "b", "gain_rank": 1.75, "gain": 2.0, "gain_harm": 1},  # from -2 on, which is below -1
    ]
    draw_board(board, tmp_path / "board.svg")
    assert b"mean rank" in (tmp_path / "board.svg").read_bytes()


def test_what_does_not_belong_on_one_board_is_refused(tmp_path: Path) -> None:
    first = written(tmp_path, "a", rows(1.0))
    for other, why in (
        (written(tmp_path, "b", rows(1.0), "v2"), "version v2, but .* has v1"),
        (written(tmp_path, "c", rows(1.0, problem="lake")), "other cells"),
        (written(tmp_path, "d", rows(1.0, 2.0)), "other cells"),
        (first, "two files are of 'a'"),
    ):
        with pytest.raises(BadInput, match=why):
            leaderboard([first, other])


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("1.0000", "9.0000", "do not fit its sha256"),
        ("member: a", "member: b", "do not fit its sha256"),
        ("# version", "# wersion", "is no file of scores"),
        ("# teaching-lab scores 1", "", "is no file of scores"),
    ],
)
def test_an_edited_file_is_refused(tmp_path: Path, old: str, new: str, why: str) -> None:
    path = written(tmp_path, "a", rows(1.0))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(BadInput, match=why):
        read_scores(path)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"# teaching-lab scores 1\n# study: x"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.csv"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="is no file of scores"):
        read_scores(path)
    with pytest.raises(BadInput, match="cannot be read"):
        read_scores(tmp_path / "none.csv")
