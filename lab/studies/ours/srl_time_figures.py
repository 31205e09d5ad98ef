"""Pictures of the comparison of sequencers: small plots side by side, one legend, the same colours everywhere."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lab.studies.thesis.chapter_9_cells import Row
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = {  # by method and reward factor: colour, marker, name
    ("srl-time", None): (BLUE, "o", "srl-time"),
    ("srl", "B"): (ORANGE, "s", "SRL, type B"),
    ("srl", "A"): (RED, "D", "SRL, type A"),
    ("mc", None): (GREEN, "^", "Monte Carlo"),
    ("random", None): (GREY, "v", "random search"),
    ("ga", None): (PURPLE, "X", "genetic"),
}
SINGLE = {  # one sequence, no episodes
    "fifo": (INK, "P", "FIFO"),
    "nearest-ready": (SKY, "<", "nearest-ready"),
    "shortest-move": (SKY, ">", "shortest-move"),
    "longest-remaining-work": (SKY, "d", "longest-remaining-work"),
    "most-urgent-machine": (SKY, "h", "most-urgent-machine"),
    "exact": (INK, "*", "exact, proven"),
}
PANEL_INCH = 2.9, 2.5
LETTERS_AN_INCH = 13  # of a legend


def by_episodes(rows: Sequence[Row], measure: str) -> bytes:
    """A percentage by session length, a plot for each case and number of few toasts."""
    of = [one for one in rows if one["measure"] == measure and "episodes" in one and "case" in one]
    counts = sorted({one["toasts"] for one in of if one["toasts"] <= 4})
    cases = sorted({one["case"] for one in of})
    panels = {
        f"{count} toasts, case {case}": [one for one in of if (one["toasts"], one["case"]) == (count, case)]
        for count in counts
        for case in cases
    }
    ylabel = "sessions that find the optimum [%]" if measure == "SP_percent" else "sessions that end optimal [%]"

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        for look in LOOKS:
            _curve(axes, look, [one for one in shown if _look(one) == look], "episodes")
        axes.set(xscale="log", xlabel="episodes", ylim=(-3, 104))
        _plain_ticks(axes, sorted({one["episodes"] for one in shown}))

    return _grid(panels, len(cases), draw, ylabel)


def of_orders(rows: Sequence[Row]) -> bytes:
    """The gap by session length for each order and interval of the FMS; methods with one sequence as lines across."""
    of = [one for one in rows if one["measure"] == "gap_percent" and "order" in one]
    means = sorted({one["interval_s"] for one in of})
    orders = list(dict.fromkeys(one["order"] for one in of))
    panels = {
        f"{order}, every {mean:g} s": [one for one in of if (one["order"], one["interval_s"]) == (order, mean)]
        for mean in means
        for order in orders
    }

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        for look in LOOKS:
            _curve(axes, look, [one for one in shown if _look(one) == look and "episodes" in one], "episodes")
        fifo = next(one["value"] for one in shown if one["method"] == "fifo")
        rule = min(one["value"] for one in shown if "episodes" not in one and one["method"] not in ("fifo", "exact"))
        axes.axhline(fifo, color=INK, linestyle="--", linewidth=1.0, label="FIFO")
        axes.axhline(rule, color=SKY, linestyle=":", linewidth=1.6, label="best dispatching rule")
        axes.set(xscale="log", xlabel="episodes")
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])
        _plain_ticks(axes, sorted({one["episodes"] for one in shown if "episodes" in one}))

    return _grid(panels, len(orders), draw, "gap to the optimum [%]")


def by_wall_time(rows: Sequence[Row]) -> bytes:
    """The gap by the seconds of a session for many toasts: a line for each case and method, a mark for one sequence."""
    of = [one for one in rows if one.get("toasts", 0) > 4]
    counts = sorted({one["toasts"] for one in of})
    panels = {f"{count} toasts": [one for one in of if one["toasts"] == count] for count in counts}

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        looks: Mapping[Any, tuple[str, str, str]] = LOOKS | {(method, None): look for method, look in SINGLE.items()}
        for look, (colour, marker, name) in looks.items():
            size = 9 if marker == "*" else 5
            for case in sorted({one["case"] for one in shown}):
                mine = [one for one in shown if one["case"] == case and _look(one) == look]
                walls, gaps = ([one["value"] for one in mine if one["measure"] == m] for m in ("wall_s", "gap_percent"))
                if walls:
                    axes.plot(walls, gaps, color=colour, marker=marker, markersize=size, linewidth=0.9, label=name)
        axes.set(xscale="log", xlabel="seconds of a session")
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])

    return _grid(panels, len(panels), draw, "gap to the optimum [%]", tall=1.3)


def _grid(panels: Mapping[str, Sequence[Row]], columns: int, draw: Any, ylabel: str, tall: float = 1.0) -> bytes:
    """A plot for each of the panels, title -> rows, row by row, and one legend below."""
    lines = -(-len(panels) // columns)

    def whole(figure: "Figure") -> None:
        plots = figure.subplots(lines, columns, squeeze=False)
        for axes, (title, shown) in zip(plots.flat, panels.items(), strict=True):
            draw(axes, shown)
            axes.set_title(title)
            axes.grid()
        figure.supylabel(ylabel, fontsize=9)
        found = [axes.get_legend_handles_labels() for axes in plots.flat]
        known = {label: handle for handles, labels in found for handle, label in zip(handles, labels, strict=True)}
        fitting = int(LETTERS_AN_INCH * width_inch / (max(map(len, known)) + 6))
        figure.legend(known.values(), known, loc="outside lower center", ncols=min(len(known), max(1, fitting)))

    width_inch = columns * PANEL_INCH[0]
    return picture_bytes(whole, width_inch, lines * PANEL_INCH[1] * tall + 0.5, "svg")


def _look(one: Row) -> tuple[str, str | None]:
    return one["method"], one.get("reward_factor")


def _curve(axes: "Axes", look: tuple[str, str | None], rows: Sequence[Row], by: str) -> None:
    if not rows:
        return
    colour, marker, name = LOOKS[look]
    x, y = [one[by] for one in rows], [one["value"] for one in rows]
    low, high = ([(one["ci95"] or [one["value"]] * 2)[end] for one in rows] for end in (0, 1))
    axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(x, y, color=colour, marker=marker, markersize=4.5, linewidth=1.4, label=name)


def _plain_ticks(axes: "Axes", values: Sequence[float]) -> None:
    """The session lengths themselves as ticks of a logarithmic axis."""
    axes.set_xticks(values, [f"{value:g}" for value in values])
    axes.set_xticks([], minor=True)
