"""Pictures of the curriculum: the savings at each place of an order, and what becomes of the skills of each task."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from lab.studies.charts import curve, legend_below
from lab.studies.findings import Row, those
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE_GREY, PURPLE, RED, SKY, YELLOW, picture_bytes, tip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# measure -> colour, hatch, name
FATES = {
    "taken_percent": (BLUE, None, "taken from an earlier task"),
    "adapted_percent": (SKY, None, "adapted from an earlier task"),
    "own_percent": (PALE_GREY, "xxx", "taken or adapted within the task"),
    "learned_percent": (ORANGE, "///", "learned from scratch"),
}
# colour and marker of each task, by name
TASKS = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (PURPLE, "D"), (YELLOW, "v"), (RED, "P"), (SKY, "X"))
SHOWN = 12.0  # [%] the least part of a bar that has room for its number


def by_place(rows: Sequence[Row]) -> bytes:
    """A picture of the episodes saved by place: each order with its tasks, and the mean of all with its interval."""
    means = [
        row for row in those(rows, subtask=None, task=None, measure="saved_episodes_percent") if row["place"] != "later"
    ]
    lives: dict[int, list[Row]] = {}
    for row in those(rows, source="all", measure="skills"):
        lives.setdefault(row["order"], []).append(row)
    looks = dict(zip(sorted({row["task"] for life in lives.values() for row in life}), TASKS, strict=False))
    lowest = min((row["saved_percent"] or 0.0 for life in lives.values() for row in life), default=0.0)

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        if means:
            curve(axes, means, "place", (BLUE, "", "mean of the orders, 95 % interval"))
        for number, life in lives.items():
            x, y = [row["place"] for row in life], [row["saved_percent"] for row in life]
            (line,) = axes.plot(x, y, color=GREY, linewidth=0.6, label="one order", zorder=2.4)
            tip(line, f"order {number}: {', '.join(row['task'] for row in life)}")
            for row in life:
                colour, marker = looks[row["task"]]
                look: dict[str, Any] = {"color": colour, "marker": marker, "markeredgecolor": INK, "markersize": 6}
                (point,) = axes.plot(
                    row["place"], row["saved_percent"], linestyle="none", label=row["task"], zorder=3, **look
                )
                tip(point, f"order {number}: {row['task']} {row['saved_percent']:.0f} %")
        axes.set(xlabel="place in the order", ylabel="episodes saved [%]", ylim=(min(0.0, lowest) - 5, 105))
        axes.set_xticks(sorted({row["place"] for life in lives.values() for row in life}))
        axes.grid(axis="y")
        legend_below(figure)

    return picture_bytes(draw, 6.0, 4.2)


def by_task(rows: Sequence[Row]) -> bytes:
    """A picture with a bar for each task after the first of its order: what became of its skills, the mean of the orders."""
    tasks = [*dict.fromkeys(row["task"] for row in rows if row.get("place") == "later" and row.get("task"))]

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for at, task in enumerate(tasks):
            left = 0.0
            for measure, (colour, hatch, name) in FATES.items():
                for row in those(rows, place="later", task=task, measure=measure):
                    look: dict[str, Any] = {"color": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0.6}
                    axes.barh(at, row["value"], left=left, label=name, height=0.7, **look)
                    if row["value"] >= SHOWN:
                        text: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8}
                        ink = "white" if colour == BLUE else INK
                        back = None if hatch is None else {"facecolor": colour, "edgecolor": "none", "pad": 1.0}
                        axes.text(left + row["value"] / 2, at, f"{row['value']:.0f}", color=ink, bbox=back, **text)
                    left += row["value"]
        axes.set_yticks(range(len(tasks)), tasks)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.set(xlabel="skills of a task that is not the first of its order [%]", xlim=(0, 100))
        legend_below(figure)

    return picture_bytes(draw, 6.5, 1.6 + 0.4 * len(tasks))
