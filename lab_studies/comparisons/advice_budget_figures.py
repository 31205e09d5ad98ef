"""Pictures of the cost of advice: success against helped steps, a panel for each world."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any, Literal

from lab.learning.gates import GATES
from lab.studies.charts import legend_below
from lab.studies.findings import Row, those
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, YELLOW, picture_bytes, tip

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PALETTE = cycle((BLUE, ORANGE, GREEN, PURPLE, RED, SKY, YELLOW, INK))
COLOURS = dict(zip((gate for gate in GATES if gate != "never"), PALETTE, strict=False))
MARKERS = {"expert": "o", "moderate": "s", "limited": "^", "novice": "D", "wrong": "X"}
PANEL_INCH = 5.6, 4.6
YLABEL = "sessions that end optimal [%]"

Point = tuple[str, str, bool, float, float]  # gate, advisor, memory, helped steps, success [%]


def gates_picture(rows: Sequence[Row]) -> bytes:
    """A picture of every gate and advisor: hollow marks without memory, filled ones with it; horizontal lines: nobody."""

    def draw(axes: "Axes", place: str, points: Sequence[Point]) -> None:
        for gate, name, memory, helped, success in points:
            colour = COLOURS[gate]
            look: dict[str, Any] = {"markerfacecolor": colour if memory else "none", "markeredgecolor": colour}
            edge = INK if memory else colour
            look |= {"markeredgecolor": edge, "markeredgewidth": 0.5 if memory else 1.3, "markersize": 6.5}
            (drawn,) = axes.plot(helped, success, MARKERS[name], clip_on=False, zorder=3 + memory, **look)
            kept = "memory" if memory else "no memory"
            tip(drawn, f"{gate}, {name}, {kept}: {success:.1f} %, {helped:.1f} helped steps")

    return _panels(rows, draw, _gate_keys())


def ccrl_picture(rows: Sequence[Row], targets: Mapping[str, tuple[float, float]]) -> bytes:
    """A picture of CCRL: an arrow for each advisor from no memory to memory; stars: the project's targets in world I."""

    def draw(axes: "Axes", place: str, points: Sequence[Point]) -> None:
        at = {(name, memory): (hs, sp) for gate, name, memory, hs, sp in points}
        for name, marker in MARKERS.items():
            arrow = {"arrowstyle": "-|>", "color": GREY, "shrinkA": 5, "shrinkB": 5, "linewidth": 1.1}
            axes.annotate("", at[name, True], at[name, False], arrowprops=arrow)
            for memory in (False, True):
                face = BLUE if memory else "white"
                axes.plot(*at[name, memory], marker, color=BLUE, markerfacecolor=face, markersize=7, clip_on=False)
            if place == "world-1" and name in targets:
                axes.plot(targets[name][1], targets[name][0], "*", color=ORANGE, markeredgecolor=INK, markersize=11)
                offset: dict[str, Any] = {
                    "xytext": (0, 7),
                    "textcoords": "offset points",
                    "ha": "center",
                    "fontsize": 8,
                }
                axes.annotate(name, targets[name][::-1], color=INK, **offset)

    shown = [row for row in rows if row["gate"] in ("ccrl", "never")]
    return _panels(shown, draw, _ccrl_keys())


def _panels(rows: Sequence[Row], draw: Any, keys: Sequence[Any]) -> bytes:
    """A picture with a panel for each world, and in it horizontal lines for nobody, without and with memory."""
    by_world = {place: _points(those(rows, world=place)) for place in ("world-1", "world-2")}

    def whole(figure: "Figure") -> None:
        panels = figure.subplots(1, len(by_world), sharey=True)
        for axes, (place, points) in zip(panels, by_world.items(), strict=True):
            axes.set_title(place)
            axes.set_xscale("symlog", linthresh=5, linscale=0.5)
            axes.set(xlabel="helped steps of a session", ylim=(0, 107))
            axes.grid()
            for gate, _, memory, _, success in points:
                if gate == "never":
                    axes.axhline(success, color=INK, linewidth=1.2, linestyle="-" if memory else ":", zorder=1)
            draw(axes, place, [point for point in points if point[0] != "never"])
            axes.set_xlim(0, 1.3 * max(5.0, *(point[3] for point in points)))
            _name_ticks(axes)
        panels[0].set_ylabel(YLABEL)
        legend_below(figure, {key.get_label(): key for key in keys})

    return picture_bytes(whole, len(by_world) * PANEL_INCH[0], PANEL_INCH[1])


def _name_ticks(axes: "Axes") -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    axes.xaxis.set_major_locator(FixedLocator([0, 5, 10, 30, 100, 300, 1000, 3000, 10000, 30000]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))


def _points(rows: Sequence[Row]) -> list[Point]:
    measures: dict[tuple[str, str, bool], dict[str, float]] = {}
    for row in rows:
        measures.setdefault((row["gate"], row["advisor"], row["memory"]), {})[row["measure"]] = row["value"]
    return [(*cell, measured["HS_steps"], measured["SP_percent"]) for cell, measured in measures.items()]


def _key(label: str, marker: str, colour: str, filled: bool = True) -> Any:
    from matplotlib.lines import Line2D

    face = colour if filled else "none"
    return Line2D([], [], linestyle="none", marker=marker, color=colour, markerfacecolor=face, label=label)


def _line(label: str, style: Literal[":", "-"]) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], linestyle=style, color=INK, linewidth=1.2, label=label)


def _shared_keys() -> list[Any]:
    advisors = [_key(name, marker, GREY) for name, marker in MARKERS.items()]
    kept = [_key("without memory", "o", GREY, filled=False), _key("with memory", "o", GREY)]
    return [*advisors, *kept, _line("nobody", ":"), _line("nobody, memory", "-")]


def _gate_keys() -> list[Any]:
    return [_key(gate, "o", colour) for gate, colour in COLOURS.items()] + _shared_keys()


def _ccrl_keys() -> list[Any]:
    return [*_shared_keys(), _key("target, world I", "*", ORANGE)]
