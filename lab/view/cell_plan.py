"""The ground plan of a cell as a picture: stations, obstacles, the arm's reach, and the workspace's blocked cells by cause."""

from collections.abc import Iterator
from itertools import cycle
from math import degrees
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon, Wedge

from lab.sim.scene.ground_plan import (
    Block,
    BlockedCells,
    CameraCells,
    GroundPlan,
    PlannedObstacle,
    PlannedStation,
    Ring,
)
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE_GREY, PURPLE, RED, SKY, YELLOW, picture_file, tip

Look = dict[str, Any]

FAULT = "#B00020"
WOOD = "#B98A55"
BODIES = {"storage": "#FFFFFF", "buffer": "#C9CED6", "machine": "#F6D9A8"}
CAUSES = (PURPLE, YELLOW, GREEN, SKY, ORANGE, RED, BLUE)  # colours of causes, in turn; cells out of reach are hatched
OUT_OF_REACH = "out of reach"
LEGEND_INCH = 3.3
FAULT_WIDTH = 125  # characters per line of the fault's message
_AROUND_M = 0.06


def draw_cell(plan: GroundPlan, path: Path) -> None:
    """Draw the cell from above, as far as the plan knows it, into a PNG or SVG file.

    Stations and obstacles at fault have a thick red edge and a red name; the message stands below. Raises BadInput for a
    path that cannot be written.
    """
    (low_x, low_y), (high_x, high_y) = _extent(plan)
    tall = (high_y - low_y) / (high_x - low_x)
    with picture_file(path, LEGEND_INCH + 7.0 / max(tall, 1.0), 0.8 + 7.0 * min(tall, 1.0)) as figure:
        axes = figure.add_subplot()
        _add(axes, plan.table, facecolor="#FAF9F6", edgecolor=GREY, linewidth=1.0, zorder=0)
        legend: list[Patch] = []
        if plan.blocked is not None:
            legend += _draw_blocked(axes, plan.blocked)
        if plan.reach is not None:
            legend.append(_draw_reach(axes, plan.reach, plan.height_m))
        axes.add_patch(Circle((0.0, 0.0), 0.09, facecolor=GREY, edgecolor=INK, zorder=3))
        axes.annotate("arm", (0.0, 0.0), ha="center", va="center", fontsize=7, color="white", zorder=4)
        for camera in plan.cameras:
            _draw_camera(axes, camera)
        for obstacle in plan.obstacles:
            _draw_obstacle(axes, obstacle, obstacle.name in plan.at_fault)
        for station in plan.stations:
            _draw_station(axes, station, station.name in plan.at_fault)
        _draw_approaches(axes, plan)
        axes.set(xlim=(low_x, high_x), ylim=(low_y, high_y), xlabel="x [m]", ylabel="y [m]", title=plan.title)
        axes.set_aspect("equal")
        figure.legend(handles=[*_kinds(plan), *legend], loc="outside right upper", fontsize=8)
        if plan.fault:
            figure.supxlabel(fill(plan.fault, FAULT_WIDTH), fontsize=9, color=FAULT, x=0.02, ha="left")


def _extent(plan: GroundPlan) -> tuple[list[float], list[float]]:
    """The x and the y coordinates [m] of the corners of everything that is drawn."""
    blocks = [plan.table, *(station.body for station in plan.stations), *(o.stays_in for o in plan.obstacles)]
    blocks += [spot.block for station in plan.stations for spot in station.spots]
    corners = [block.corners() for block in blocks]
    corners += [np.array([a.at]) for a in plan.approaches]
    corners += [np.array([c.origin, np.add(c.origin, np.multiply(c.shape, c.cell))]) for c in plan.cameras]
    if plan.blocked is not None:
        far = np.add(plan.blocked.origin, np.multiply(plan.blocked.causes.shape, plan.blocked.cell))
        corners.append(np.array([plan.blocked.origin, far]))
    points = np.concatenate(corners)
    return (points.min(axis=0) - _AROUND_M).tolist(), (points.max(axis=0) + _AROUND_M).tolist()


def _add(axes: Axes, block: Block, **look: object) -> Patch:
    patch: Patch = axes.add_patch(Polygon(block.corners(), **look))  # type: ignore[arg-type]
    return patch


def _draw_blocked(axes: Axes, blocked: BlockedCells) -> "Iterator[Patch]":
    """Draw the workspace's grid and its blocked cells; yields the legend's rows, by the number of cells that a cause blocks."""
    (x, y), (wide, high), (columns, rows) = blocked.origin, blocked.cell, blocked.causes.shape
    lines: Look = {"color": "#D5D8DC", "linewidth": 0.5, "zorder": 0.5}
    axes.vlines(x + wide * np.arange(columns + 1), y, y + high * rows, **lines)
    axes.hlines(y + high * np.arange(rows + 1), x, x + wide * columns, **lines)
    causes, counts = np.unique(blocked.causes[blocked.causes != ""], return_counts=True)
    colours = cycle(CAUSES)
    for cause in causes[np.argsort(-counts, kind="stable")].tolist():
        look: Look = {"facecolor": PALE_GREY, "hatch": "////", "edgecolor": "#C4C8CE", "linewidth": 0.0, "zorder": 0.6}
        if cause != OUT_OF_REACH:
            look = {"facecolor": next(colours), "alpha": 0.45, "linewidth": 0.0, "zorder": 0.6}
        for i, j in np.argwhere(blocked.causes == cause).tolist():
            cell = Block(x + (i + 0.5) * wide, y + (j + 0.5) * high, wide, high)
            tip(_add(axes, cell, **look), f"blocked: {cause}")
        yield Patch(label=cause if cause == OUT_OF_REACH else f"blocked by {cause}", **look)


def _draw_reach(axes: Axes, ring: Ring, height_m: float) -> Patch:
    look: Look = {"facecolor": "none", "edgecolor": BLUE, "linewidth": 1.3, "linestyle": (0, (5, 3)), "zorder": 2}
    edges = (-degrees(ring.right_rad), degrees(ring.left_rad))
    wedge: Patch = Wedge((0.0, 0.0), ring.farthest_m, *edges, width=ring.farthest_m - ring.nearest_m, **look)
    wedge.set_label(f"reach, tips {height_m:.2f} m up:\n{ring.nearest_m:.2f} to {ring.farthest_m:.2f} m")
    return axes.add_patch(wedge)


def _draw_camera(axes: Axes, camera: CameraCells) -> None:
    (x, y), (columns, rows) = camera.origin, camera.shape
    wide, high = columns * camera.cell, rows * camera.cell
    lines: Look = {"color": GREEN, "linewidth": 0.35, "alpha": 0.7, "zorder": 1.5}
    axes.vlines(x + camera.cell * np.arange(columns + 1), y, y + high, **lines)
    axes.hlines(y + camera.cell * np.arange(rows + 1), x, x + wide, **lines)
    _add(
        axes, Block(x + wide / 2, y + high / 2, wide, high), facecolor="none", edgecolor=GREEN, linewidth=1.2, zorder=2
    )
    axes.plot(
        *camera.start, marker="o", markersize=6, color="white", markeredgecolor=GREEN, markeredgewidth=1.5, zorder=7
    )


def _draw_obstacle(axes: Axes, obstacle: PlannedObstacle, at_fault: bool) -> None:
    edge = FAULT if at_fault else WOOD
    if obstacle.moves:
        _add(axes, obstacle.stays_in, facecolor="none", edgecolor=edge, linewidth=0.9, linestyle=(0, (2, 2)), zorder=4)
    look: Look = {"edgecolor": FAULT if at_fault else "#6F4E26", "linewidth": 2.5 if at_fault else 0.8}
    tip(_add(axes, obstacle.stands, facecolor=WOOD, zorder=5, **look), obstacle.name)
    low = obstacle.stays_in.corners()[:, 1].min()
    _name(axes, obstacle.name, obstacle.stays_in.x, low, at_fault, 6.5)


def _draw_station(axes: Axes, station: PlannedStation, at_fault: bool) -> None:
    look: Look = {"edgecolor": FAULT if at_fault else INK, "linewidth": 2.5 if at_fault else 1.0}
    body = _add(axes, station.body, facecolor=BODIES[station.kind], alpha=0.85, zorder=3, **look)
    tip(body, f"{station.name} ({station.kind})")
    for spot in station.spots:
        colour = FAULT if not spot.reached else INK if spot.used else GREY
        width = 1.0 if spot.used else 0.4
        _add(axes, spot.block, facecolor="none", edgecolor=colour, linewidth=width, zorder=6)
    lowest = min(block.corners()[:, 1].min() for block in (station.body, *(spot.block for spot in station.spots)))
    _name(axes, station.name, station.body.x, lowest, at_fault, 8)


def _name(axes: Axes, name: str, x: float, y: float, at_fault: bool, size: float) -> None:
    look: Look = {"color": FAULT if at_fault else INK, "fontweight": "bold" if at_fault else "normal", "fontsize": size}
    behind = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6}
    at: Look = {"xytext": (0, -4), "textcoords": "offset points", "ha": "center", "va": "top", "zorder": 9}
    axes.annotate(name, (x, y), bbox=behind, **at, **look)


def _draw_approaches(axes: Axes, plan: GroundPlan) -> None:
    """Draw an arrow from the last cell of a transfer to its end; a cross where there is no such cell."""
    for approach in plan.approaches:
        if approach.dock is None:
            axes.plot(*approach.at, marker="X", markersize=11, color=FAULT, markeredgecolor="white", zorder=8)
            continue
        arrow: Look = {
            "arrowstyle": "-|>",
            "color": BLUE,
            "linewidth": 1.1,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 8,
        }
        axes.plot(*approach.dock, marker=".", markersize=5, color=BLUE, zorder=7)
        axes.annotate("", approach.at, approach.dock, arrowprops=arrow, zorder=7)


def _kinds(plan: GroundPlan) -> "Iterator[object]":
    """The legend's rows for the symbols that occur in the plan."""
    for kind in dict.fromkeys(station.kind for station in plan.stations):
        yield Patch(facecolor=BODIES[kind], edgecolor=INK, label=kind)
    spots = [spot for station in plan.stations for spot in station.spots]
    if spots:
        yield Patch(facecolor="none", edgecolor=INK, label="spot of a part")
    if not all(spot.reached for spot in spots):
        yield Patch(facecolor="none", edgecolor=FAULT, label="spot out of reach")
    if plan.obstacles:
        area = ", with the area\nin which it may stand" if any(o.moves for o in plan.obstacles) else ""
        yield Patch(facecolor=WOOD, edgecolor="#6F4E26", label=f"obstacle{area}")
    if plan.cameras:
        yield Line2D([], [], color=GREEN, marker="o", markerfacecolor="white", label="camera's grid and its start")
    if any(approach.dock for approach in plan.approaches):
        yield Line2D([], [], color=BLUE, marker=">", markersize=4, linewidth=1.1, label="approach to a station")
    if any(approach.dock is None for approach in plan.approaches):
        yield Line2D([], [], color=FAULT, marker="X", markersize=9, linestyle="none", label="no approach")
