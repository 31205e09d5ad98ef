"""The picture of a cell from above: what it says, what it marks."""

import re
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sim.scene.ground_plan import (
    Approach,
    Block,
    BlockedCells,
    CameraCells,
    GroundPlan,
    PlannedObstacle,
    PlannedSpot,
    PlannedStation,
    Ring,
)
from lab.view.cell_plan import FAULT, draw_cell

CAUSES = np.array([["", "oven", "oven"], ["wall <1>", "out of reach", ""]])
WHOLE = GroundPlan(
    "Baking",
    Block(0.35, 0.0, 2.2, 2.9),
    Ring(0.36, 1.2, 2.9, 2.9),
    0.3,
    (
        PlannedStation("oven", "machine", Block(0.8, 0.0, 0.2, 0.2), (PlannedSpot(Block(0.8, 0.0, 0.1, 0.1)),)),
        PlannedStation(
            "rack", "storage", Block(0.0, 1.5, 0.3, 0.2), (PlannedSpot(Block(0, 1.5, 0.1, 0.1), True, False),)
        ),
    ),
    (PlannedObstacle("wall <1>", Block(0.5, 0.4, 0.1, 0.1, 0.3), Block(0.5, 0.4, 0.2, 0.2)),),
    BlockedCells((0.3, -0.3), (0.2, 0.2), CAUSES),
    (CameraCells((0.5, -0.3), 0.05, (12, 12), (0.55, -0.25)),),
    (Approach("oven", (0.8, 0.0), (0.7, 0.1)), Approach("rack", (0.0, 1.5), None)),
    "station 'rack' is out of reach",
    frozenset({"rack"}),
)


def svg(plan: GroundPlan, folder: Path) -> str:
    draw_cell(plan, folder / "cell.svg")
    return (folder / "cell.svg").read_text(encoding="utf-8")


def texts(picture: str) -> list[str]:
    """What stands in the picture, in no order."""
    return [re.sub(r"<[^>]*>", "", text).strip() for text in re.findall(r"<text[^>]*>.*?</text>", picture, re.DOTALL)]


def test_everything_has_its_name_and_its_row_in_the_legend(tmp_path: Path) -> None:
    said = texts(svg(WHOLE, tmp_path))
    rows = (
        *(
            "machine",
            "storage",
            "spot of a part",
            "spot out of reach",
            "obstacle, with the area",
            "approach to a station",
        ),
        *("no approach", "out of reach", "blocked by oven", "blocked by wall &lt;1&gt;", "camera's grid and its start"),
        *("reach, tips 0.30 m up:", "0.36 to 1.20 m"),
    )
    for row in ("Baking", "oven", "rack", "wall &lt;1&gt;", *rows):
        assert row in said, row
    assert "buffer" not in said


def test_every_blocked_cell_says_what_blocks_it(tmp_path: Path) -> None:
    titles = re.findall(r"<title>(.*?)</title>", svg(WHOLE, tmp_path))
    assert titles.count("blocked: oven") == 2
    assert titles.count("blocked: out of reach") == 1
    assert "oven (machine)" in titles


def test_what_is_at_fault_is_red_and_what_is_wrong_is_said(tmp_path: Path) -> None:
    picture = svg(WHOLE, tmp_path)
    assert "station 'rack' is out of reach" in texts(picture)
    looks = {name: re.findall(rf'<text style="([^"]*)"[^>]*>{name}</text>', picture) for name in ("oven", "rack")}
    assert [FAULT.lower() in look for look in looks["oven"]] == [False]
    assert [FAULT.lower() in look for look in looks["rack"]] == [True]


def test_a_plan_of_which_little_is_known_is_drawn_whole_or_not_at_all(tmp_path: Path) -> None:
    draw_cell(GroundPlan("Nothing yet", Block(0.35, 0.0, 2.2, 2.9)), tmp_path / "cell.png")
    assert (tmp_path / "cell.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(BadInput, match=r"plots are written as \.png or \.svg"):
        draw_cell(WHOLE, tmp_path / "cell.pdf")
    assert [path.name for path in tmp_path.iterdir()] == ["cell.png"]


def test_the_same_plan_gives_the_same_bytes(tmp_path: Path) -> None:
    assert svg(WHOLE, tmp_path) == svg(WHOLE, tmp_path)
