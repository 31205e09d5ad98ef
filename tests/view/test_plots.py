"""The pictures: they are written, alike for like data, and show what they should."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.overhead import plain_view
from lab.sequencing.cell import Cell, Stage, Station
from lab.sequencing.events import Activity, Schedule, simulate
from lab.view import gantt as gantt_chart
from lab.view.canvas import BLUE, ORANGE, RED, SKY, YELLOW, seconds
from lab.view.plots import cell_corners, gantt, learning_curves, sequence_plot, value_map


def schedule(loaded_s: float = 2.0, room: int = 1) -> Schedule:
    """Two toasts, in -> buffer or oven -> out; the second waits in the buffer while the first bakes."""
    stations = (
        Station("in", "storage", 2),
        Station("buffer", "buffer", 2),
        Station("oven", "machine", room, 5.0),
        Station("out", "storage", 2),
    )
    off_diagonal = np.ones((4, 4)) - np.eye(4)
    route = (Stage("in"), Stage("oven", "buffer"), Stage("out"))
    cell = Cell(stations, route, off_diagonal, loaded_s * off_diagonal, "in", 2)
    return simulate(cell, [1, 2, 1, 2, 2] if room == 1 else [1, 2, 1, 2])


@dataclass(frozen=True)
class Learned:
    """As much of a policy as the curves need."""

    curve: list[int]
    guided: list[bool]
    subtask: str = "insert"
    optimal_steps: int = 8


def draw_gantt(path: Path) -> None:
    gantt(schedule(2.1), path, predicted=schedule())


def draw_curves(path: Path) -> None:
    policies = {f"policy {n}": Learned([200, 90, 8 + n], [False, True, False]) for n in range(4)}
    learning_curves(policies, path)


def draw_values(path: Path) -> None:
    picture = np.full((60, 80, 3), 200, dtype=np.uint8)
    corners = np.stack(np.meshgrid(np.linspace(5, 75, 5), np.linspace(5, 55, 4)), axis=-1)
    blocked = np.zeros((3, 4), dtype=np.bool_)
    blocked[1, 1] = True
    route = [(0, 0), (0, 1), (0, 2), (1, 2)]
    value_map(np.arange(12.0).reshape(3, 4), picture, path, corners=corners, route=route, blocked=blocked, goal=(1, 2))


def draw_episodes(path: Path) -> None:
    sequence_plot([30.0, 28.5, 29.0, 25.0], 25.0, path)


PLOTS: dict[str, Callable[[Path], None]] = {
    "gantt": draw_gantt,
    "curves": draw_curves,
    "values": draw_values,
    "episodes": draw_episodes,
}


def colours(path: Path) -> set[str]:
    """Every colour of a PNG file, as #RRGGBB."""
    from matplotlib.image import imread

    pixels = np.unique((imread(path)[..., :3] * 255).round().astype(int).reshape(-1, 3), axis=0)
    return {"#{:02X}{:02X}{:02X}".format(*pixel) for pixel in pixels}


@pytest.mark.parametrize("name", PLOTS)
def test_same_data_same_bytes(tmp_path: Path, name: str) -> None:
    for file in ("one.png", "two.png"):
        PLOTS[name](tmp_path / file)
    written = (tmp_path / "one.png").read_bytes()
    assert written.startswith(b"\x89PNG")
    assert written == (tmp_path / "two.png").read_bytes()


@pytest.mark.parametrize("name", PLOTS)
def test_only_png_and_only_where_files_can_be(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match=r"plots are written as \.png"):
        PLOTS[name](tmp_path / "plot.jpeg")
    with pytest.raises(BadInput, match="there is no folder"):
        PLOTS[name](tmp_path / "missing" / "plot.png")
    assert not list(tmp_path.iterdir())


def test_the_global_style_is_left_alone(tmp_path: Path) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    draw_episodes(tmp_path / "plot.png")
    assert dict(matplotlib.rcParams) == before


def test_gantt_shows_each_kind_of_activity(tmp_path: Path) -> None:
    draw_gantt(tmp_path / "plot.png")
    assert {BLUE, SKY, ORANGE, RED} <= colours(tmp_path / "plot.png")


def test_a_machine_with_two_toasts_gets_two_lanes() -> None:
    from matplotlib.figure import Figure

    row = [activity for activity in schedule(room=2).machines if activity.resource == "oven"]
    bars = gantt_chart._draw_row(Figure().add_subplot(), row, 0.0, 1.0)
    lanes = {(activity.toast, top, height) for activity, top, height in bars}
    assert lanes == {(1, 0.0, 0.5), (2, 0.5, 0.5)}


@pytest.mark.parametrize("overlap_s", [0.0, 1e-4])
def test_one_after_the_other_stays_in_one_lane(overlap_s: float) -> None:
    from matplotlib.figure import Figure

    row = [
        Activity("robot", "empty", None, "in", "oven", 0.0, 1.0 + overlap_s),
        Activity("robot", "carry", 1, "oven", "out", 1.0, 2.0),
    ]
    bars = gantt_chart._draw_row(Figure().add_subplot(), row, 0.0, 1.0)
    assert {(top, height) for _, top, height in bars} == {(0.0, 1.0)}


def test_a_run_that_failed_before_its_first_carry(tmp_path: Path) -> None:
    stopped = Schedule.from_activities([Activity("robot", "empty", None, "in", "oven", 0.0, 3.0)], [])
    gantt(stopped, tmp_path / "plot.png")
    assert SKY in colours(tmp_path / "plot.png")
    assert YELLOW not in colours(tmp_path / "plot.png")


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
        (np.zeros((2, 2)), {"blocked": np.zeros((3, 2))}, r"blocked \(3, 2\)"),
    ],
)
def test_shapes_that_do_not_fit(tmp_path: Path, values: np.ndarray, options: dict[str, np.ndarray], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        value_map(values, None, tmp_path / "plot.png", **options)  # type: ignore[arg-type]


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
    with pytest.raises(BadInput, match="no episodes"):
        sequence_plot([], None, tmp_path / "plot.png")
    with pytest.raises(BadInput, match="no activities"):
        gantt(Schedule((), (), (), 0.0, ()), tmp_path / "plot.png")


def test_seconds() -> None:
    assert [seconds(513), seconds(12.34), seconds(10.04)] == ["513 s", "12.3 s", "10 s"]
