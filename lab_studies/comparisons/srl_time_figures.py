"""Pictures of the comparison of sequencers: small plots side by side, one legend, the same colours everywhere."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lab.studies.charts import Look, curve, legend_below
from lab.studies.findings import Row, those
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS: dict[tuple[str, str | None], Look] = {  # by method and reward factor
    ("srl-time", None): (BLUE, "o", "srl-time"),
    ("srl-time without the bound", None): (BLUE, "x", "srl-time without the bound"),
    ("srl", "B"): (ORANGE, "s", "SRL, type B"),
    ("srl", "A"): (RED, "D", "SRL, type A"),
    ("mc", None): (GREEN, "^", "Monte Carlo"),
    ("random", None): (GREY, "v", "random search"),
    ("ga", None): (PURPLE, "X", "genetic"),
}
SINGLE: dict[str, Look] = {  # methods with one sequence and no episodes
    "fifo": (INK, "P", "FIFO"),
    "nearest-ready": (SKY, "<", "nearest-ready"),
    "shortest-move": (SKY, ">", "shortest-move"),
    "longest-remaining-work": (SKY, "d", "longest-remaining-work"),
    "most-urgent-machine": (SKY, "h", "most-urgent-machine"),
    "exact": (INK, "*", "exact, proven"),
}
PANEL_INCH = 2.9, 2.5


def by_episodes(rows: Sequence[Row], measure: str) -> bytes:
    """A picture of a percentage by session length, a plot for each case and small number of toasts."""
    shown = [row for row in those(rows, measure=measure) if "episodes" in row and "case" in row]
    counts = sorted({row["toasts"] for row in shown if row["toasts"] <= 4})
    cases = sorted({row["case"] for row in shown})
    panels = {
        f"{count} toasts, case {case}": those(shown, toasts=count, case=case) for count in counts for case in cases
    }
    ylabel = "sessions that find the optimum [%]" if measure == "SP_percent" else "sessions that end optimal [%]"

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        _curves(axes, shown)
        axes.set(ylim=(-3, 104))

    return _grid(panels, len(cases), draw, ylabel)


def of_orders(rows: Sequence[Row]) -> bytes:
    """A picture of the gap by session length for each order and interval of the FMS; horizontal lines: single sequences."""
    gaps = [row for row in those(rows, measure="gap_percent") if "order" in row]
    means = sorted({row["interval_s"] for row in gaps})
    orders = list(dict.fromkeys(row["order"] for row in gaps))
    panels = {
        f"{order}, every {mean:g} s": those(gaps, order=order, interval_s=mean) for mean in means for order in orders
    }

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        _curves(axes, shown)
        fifo = those(shown, method="fifo")[0]["value"]
        rule = min(row["value"] for row in shown if "episodes" not in row and row["method"] not in ("fifo", "exact"))
        axes.axhline(fifo, color=INK, linestyle="--", linewidth=1.0, label="FIFO")
        axes.axhline(rule, color=SKY, linestyle=":", linewidth=1.6, label="best dispatching rule")
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])

    return _grid(panels, len(orders), draw, "gap to the optimum [%]")


def by_wall_time(rows: Sequence[Row]) -> bytes:
    """A picture of the gap by the seconds of a session for many toasts: a line for each case and method."""
    many = [row for row in rows if row.get("toasts", 0) > 4]
    counts = sorted({row["toasts"] for row in many})
    panels = {f"{count} toasts": those(many, toasts=count) for count in counts}

    def draw(axes: "Axes", shown: Sequence[Row]) -> None:
        looks = LOOKS | {(method, None): look for method, look in SINGLE.items()}
        for look, (colour, marker, name) in looks.items():
            size = 9 if marker == "*" else 5
            for case in sorted({row["case"] for row in shown}):
                mine = those(shown, case=case, method=look[0], reward_factor=look[1])
                walls, gaps = ([row["value"] for row in those(mine, measure=m)] for m in ("wall_s", "gap_percent"))
                if walls:
                    axes.plot(walls, gaps, color=colour, marker=marker, markersize=size, linewidth=0.9, label=name)
        axes.set(xscale="log", xlabel="seconds of a session")
        axes.set_ylim(bottom=-0.04 * axes.get_ylim()[1])

    return _grid(panels, len(panels), draw, "gap to the optimum [%]", tall=1.3)


def _grid(panels: Mapping[str, Sequence[Row]], columns: int, draw: Any, ylabel: str, tall: float = 1.0) -> bytes:
    """A picture with a plot for each of the panels, title -> rows, and one legend below."""
    lines = -(-len(panels) // columns)

    def whole(figure: "Figure") -> None:
        plots = figure.subplots(lines, columns, squeeze=False)
        for axes, (title, shown) in zip(plots.flat, panels.items(), strict=True):
            draw(axes, shown)
            axes.set_title(title)
            axes.grid()
        figure.supylabel(ylabel, fontsize=9)
        legend_below(figure)

    size_inch = columns * PANEL_INCH[0], lines * PANEL_INCH[1] * tall + 0.5
    return picture_bytes(whole, *size_inch)


def _curves(axes: "Axes", rows: Sequence[Row]) -> None:
    """Draw the methods that learn by session length, on a logarithmic axis with the lengths as ticks."""
    tried = [row for row in rows if "episodes" in row]
    for (method, factor), look in LOOKS.items():
        if own := those(tried, method=method, reward_factor=factor):
            curve(axes, own, "episodes", look)
    lengths = sorted({row["episodes"] for row in tried})
    axes.set(xscale="log", xlabel="episodes")
    axes.set_xticks(lengths, [f"{length:g}" for length in lengths])
    axes.set_xticks([], minor=True)
