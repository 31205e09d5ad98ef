"""Learning curves and value maps: they are written, alike for like data, and show what they should."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.view.canvas import ORANGE, RED
from lab.view.plots import MapMarks, cell_corners, learning_curves, value_map
from lab.vision import plain_view


@dataclass(frozen=True)
class Learned:
    """As much of a policy as the curves need."""

    curve: list[int]
    guided: list[bool]
    subtask: str = "insert"
    optimal_steps: int = 8


def draw_curves(path: Path) -> None:
    policies = {f"policy {n}": Learned([200, 90, 8 + n], [False, True, False]) for n in range(4)}
    learning_curves(policies, path)


def draw_values(path: Path) -> None:
    picture = np.full((60, 80, 3), 200, dtype=np.uint8)
    corners = np.stack(np.meshgrid(np.linspace(5, 75, 5), np.linspace(5, 55, 4)), axis=-1)
    blocked = np.zeros((3, 4), dtype=np.bool_)
    blocked[1, 1] = True
    route = [(0, 0), (0, 1), (0, 2), (1, 2)]
    places = MapMarks(route, blocked, goal=(1, 2))
    value_map(np.arange(12.0).reshape(3, 4), picture, path, corners=corners, places=places)


PLOTS: dict[str, Callable[[Path], None]] = {
    "curves": draw_curves,
    "values": draw_values,
}


def colours(path: Path) -> set[str]:
    """Every colour of a PNG file, as #RRGGBB."""
    from matplotlib.image import imread

    pixels = np.unique((imread(path)[..., :3] * 255).round().astype(int).reshape(-1, 3), axis=0)
    return {"#{:02X}{:02X}{:02X}".format(*pixel) for pixel in pixels}


def test_curves_can_be_scaled_but_a_map_over_a_photo_cannot(tmp_path: Path) -> None:
    draw_curves(tmp_path / "plot.svg")
    assert (tmp_path / "plot.svg").read_bytes().startswith(b"<?xml")
    with pytest.raises(BadInput, match=r"plots are written as \.png$"):
        draw_values(tmp_path / "map.svg")


@pytest.mark.parametrize("name", PLOTS)
def test_same_data_same_bytes(tmp_path: Path, name: str) -> None:
    for file in ("one.png", "two.png"):
        PLOTS[name](tmp_path / file)
    written = (tmp_path / "one.png").read_bytes()
    assert written.startswith(b"\x89PNG")
    assert written == (tmp_path / "two.png").read_bytes()


@pytest.mark.parametrize("name", PLOTS)
def test_only_pictures_and_only_where_files_can_be(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match=r"plots are written as \.png"):
        PLOTS[name](tmp_path / "plot.jpeg")
    with pytest.raises(BadInput, match="there is no folder"):
        PLOTS[name](tmp_path / "missing" / "plot.png")
    assert not list(tmp_path.iterdir())


def test_the_global_style_is_left_alone(tmp_path: Path) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    draw_curves(tmp_path / "plot.png")
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("curve", [[], [8], [8, 9, 8], [201] * 3])
def test_short_and_flat_curves(tmp_path: Path, curve: list[int]) -> None:
    learning_curves({"insert": Learned(curve, [False] * len(curve))}, tmp_path / "plot.png")
    assert RED in colours(tmp_path / "plot.png")


def test_guided_episodes_are_marked(tmp_path: Path) -> None:
    """The legend always has one mark of that colour; eight guided episodes add to it."""

    def amount(guided: bool) -> int:
        from matplotlib.image import imread

        learning_curves({"insert": Learned([40] * 8, [guided] * 8)}, tmp_path / "plot.png")
        pixels = (imread(tmp_path / "plot.png")[..., :3] * 255).round().astype(int)
        return int((pixels == [int(ORANGE[i : i + 2], 16) for i in (1, 3, 5)]).all(axis=-1).sum())

    assert amount(True) > 4 * amount(False) > 0


def test_value_map_without_a_picture(tmp_path: Path) -> None:
    value_map([[0.0, 1.0], [np.nan, 2.0]], None, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").exists()


@pytest.mark.parametrize(
    ("values", "options", "says"),
    [
        (np.zeros(4), {}, r"shape \(4,\)"),
        (np.zeros((2, 2)), {"corners": np.zeros((2, 2, 2))}, r"corners \(2, 2, 2\)"),
        (np.zeros((2, 2)), {"places": MapMarks(blocked=np.zeros((3, 2)))}, r"blocked \(3, 2\)"),
    ],
)
def test_shapes_that_do_not_fit(tmp_path: Path, values: np.ndarray, options: dict[str, Any], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        value_map(values, None, tmp_path / "plot.png", **options)


def test_corners_of_a_plain_view() -> None:
    """A picture that is itself the grid: the corner pixels are the picture's corners, half a pixel out."""
    view = plain_view((60, 80), (3, 4))
    corners = cell_corners(view)
    assert corners.shape == (4, 5, 2)
    x, y = corners.reshape(-1, 2).T
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((-0.5, 79.5, -0.5, 59.5))


def test_nothing_to_show(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no policy"):
        learning_curves({}, tmp_path / "plot.png")
