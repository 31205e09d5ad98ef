"""The learning curves of a report, redone by hand."""

from lab.classroom.curve_chart import MOST_BLOCKS, chart_of, middle_of


def curve(*values: float, advised: tuple[int, ...] = ()) -> list[tuple[float, bool]]:
    return [(value, episode in advised) for episode, value in enumerate(values, start=1)]


def test_a_curve_of_two_episodes_begins_high_and_ends_low() -> None:
    chart = chart_of([("own", "deer", curve(4.0, 2.0, advised=(2,)))], best=2.0)
    assert chart is not None
    (line,) = chart.lines
    (x1, y1), (x2, y2) = (tuple(map(float, point.split(","))) for point in line.points.split())
    assert x1 < x2 <= chart.right
    assert y1 < y2 <= chart.bottom
    assert chart.best_y == y2
    assert line.advised == ((x2, y2),)
    assert [text for _, text in chart.x_ticks] == ["0", "0.5", "1", "1.5", "2"]
    assert [text for _, text in chart.y_ticks] == ["0", "1", "2", "3", "4"]


def test_a_long_curve_is_drawn_by_the_means_of_blocks() -> None:
    chart = chart_of([("own", "deer", curve(*[1.0, 3.0] * MOST_BLOCKS))], best=None)
    assert chart is not None
    assert chart.block == 2
    points = chart.lines[0].points.split()
    assert len(points) == MOST_BLOCKS
    assert len({point.split(",")[1] for point in points}) == 1  # each block's mean is 2


def test_large_ratios_have_a_logarithmic_axis() -> None:
    chart = chart_of([("own", "deer", curve(100.0, 10.0))], best=10.0)
    assert chart is not None
    assert [text for _, text in chart.y_ticks] == ["10", "20", "50", "100"]
    tops = [y for y, _ in chart.y_ticks]
    assert round(tops[0] - tops[1], 0) == round(tops[2] - tops[3], 0)  # twice as much is as far everywhere


def test_the_median_is_that_of_each_block_as_far_as_half_of_the_curves_reach() -> None:
    middle = middle_of([curve(9.0, 5.0, 1.0), curve(7.0, 3.0), curve(8.0), curve()])
    assert middle is not None
    assert [(x, value) for x, value, _ in middle.points] == [(1.0, 8.0), (2.0, 4.0)]
    assert middle_of([curve(1.0), curve()]) is None


def test_what_is_no_number_is_left_out() -> None:
    assert chart_of([("own", "deer", curve(float("inf"), float("nan"))), ("open", "hare", [])], best=3.0) is None
    same = chart_of([("own", "deer", curve(0.0))], best=None)
    assert same is not None
    assert "nan" not in same.lines[0].points
