"""Plots of learning results: learning curves (PNG or SVG) and value maps (PNG)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput
from lab.lazy import matplotlib
from lab.mdp import FloatArray, TabularMDP, greedy_path
from lab.view.canvas import BLUE, INK, ORANGE, RED, SKY, check_png, picture_file

if TYPE_CHECKING:
    from lab.vision import GridView, View


class MapMarks(NamedTuple):
    """The content of a map's cells (row, column): the greedy path, blocked cells (rows, columns) bool, start and goal."""

    route: Sequence[tuple[int, int]] = ()
    blocked: ArrayLike | None = None
    start: tuple[int, int] | None = None
    goal: tuple[int, int] | None = None


NOTHING = MapMarks()
FINE = 40_000  # cells of a value map above which they have no outlines and no hatching, which would be smaller than a pixel


class Curve(Protocol):
    """The attributes of a policy that `learning_curves` reads: steps per episode, guided episodes, the fewest possible steps."""

    @property
    def subtask(self) -> str: ...
    @property
    def curve(self) -> Sequence[int]: ...
    @property
    def guided(self) -> Sequence[bool]: ...
    @property
    def optimal_steps(self) -> int | None: ...


def learning_curves(
    policies: Mapping[str, Curve], path: Path, returns: Mapping[str, "NDArray[np.float64]"] | None = None
) -> None:
    """Plot the steps of each episode, one small plot per policy: guided episodes marked, the fewest possible steps as a line.

    returns: by the name of the policy, the returns of its last episodes, which are plotted instead of steps.
    Raises BadInput without policies. Source: the curves of thesis ch. 8 and 9.
    """
    if not policies:
        raise BadInput("learning curves: there is no policy to show")
    columns = min(3, len(policies))
    lines = -(-len(policies) // columns)
    width, height = max(5.0, 1.2 + 3.4 * columns), 0.9 + 2.3 * lines
    with picture_file(path, width, height, solved=False) as figure:
        figure.subplots_adjust(
            left=0.65 / width,
            right=1 - 0.12 / width,
            bottom=0.85 / height,
            top=1 - 0.3 / height,
            wspace=0.25,
            hspace=0.7,
        )
        grid = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes in grid[len(policies) :]:
            axes.remove()
        for axes, (name, policy) in zip(grid, policies.items(), strict=False):
            returned = (returns or {}).get(name)
            if returned is None:
                _draw_curve(axes, policy)
            else:
                _draw_returns(axes, policy, returned)
            axes.set_title(name if policy.subtask in name else f"{name} ({policy.subtask})", fontsize=8.5)
        handles = list(grid[0].get_lines())
        figure.legend(handles=handles, loc="lower center", ncols=len(handles))


def value_map(
    values: ArrayLike,
    picture: NDArray[np.uint8] | None,
    path: Path,
    *,
    corners: ArrayLike | None = None,
    places: MapMarks = NOTHING,
) -> None:
    """Plot values (rows, columns) of grid cells, such as max_a Q, half-transparent over a picture (H, W, 3) RGB, or alone.

    `corners` (rows + 1, columns + 1, 2): pixel (x, y) of the grid lines' crossings, see `cell_corners`; without them rows
    run down and columns to the right. The goal has no value, because an episode ends there. Raises BadInput when the
    shapes do not fit, and for a path that is no PNG file.
    """
    check_png(path)
    table = np.array(values, dtype=np.float64)
    crossings, walls = _fitting(table, corners, places.blocked)
    across, down = crossings[..., 0], crossings[..., 1]
    tall = np.ptp(down) / np.ptp(across) if picture is None else picture.shape[0] / picture.shape[1]
    hidden = walls | ~np.isfinite(table)
    if places.goal is not None:
        hidden[places.goal] = True
    with picture_file(path, 6.8, 1.0 + 5.5 * tall) as figure:
        axes = figure.add_subplot()
        if picture is not None:
            axes.imshow(_muted(picture))
        shown = np.ma.masked_where(hidden, table)
        lines: dict[str, Any] = {} if table.size > FINE else {"edgecolors": "#FFFFFF60", "linewidth": 0.4}
        tint = axes.pcolormesh(across, down, shown, cmap="viridis", alpha=0.5, **lines)
        figure.colorbar(tint, ax=axes, shrink=0.9, label="value of the best action, max Q")
        _draw_places(axes, crossings, walls, places)
        axes.set_aspect("equal")
        if picture is None:
            axes.set(ylim=(down.max(), down.min()), xlabel="column", ylabel="row")
            axes.locator_params(integer=True)
        else:
            axes.set_axis_off()
        axes.set_title("What each cell is worth")
        if axes.get_legend_handles_labels()[0]:
            figure.legend(loc="outside lower center", ncols=4)


def grid_values(q: FloatArray, mdp: TabularMDP, path: Path) -> None:
    """Plot the values (S, A) of a grid problem with two axes, and the greedy path through it; see `value_map`."""
    (goal, *_), (rows, columns) = np.flatnonzero(mdp.goal).tolist(), mdp.shape
    states, _, _ = greedy_path(q, mdp, mdp.n_states)
    route = [divmod(state, columns) for state in states]
    blocked = (mdp.terminal & ~mdp.goal).reshape(mdp.shape)
    places = MapMarks(route, blocked, divmod(mdp.start, columns), divmod(goal, columns))
    value_map(q.max(axis=1).reshape(rows, columns), None, path, places=places)


def _fitting(
    table: NDArray[np.float64], corners: ArrayLike | None, blocked: ArrayLike | None
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The crossings (rows + 1, columns + 1, 2) of the grid lines and the blocked cells of a table of values."""
    if table.ndim != 2:
        raise BadInput(f"value map: values have shape {table.shape}; a grid of cells is needed")
    rows, columns = table.shape
    if corners is None:
        corners = np.stack(np.meshgrid(np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5), axis=-1)
    crossings = np.asarray(corners, dtype=np.float64)
    walls = np.zeros(table.shape, dtype=np.bool_) if blocked is None else np.asarray(blocked, dtype=np.bool_)
    if crossings.shape != (rows + 1, columns + 1, 2) or walls.shape != table.shape:
        raise BadInput(
            f"value map: corners {crossings.shape} and blocked {walls.shape} do not fit values {table.shape}"
        )
    return crossings, walls


def values_seen(q: FloatArray, mdp: TabularMDP, picture: NDArray[np.uint8], seen: "GridView", path: Path) -> None:
    """Plot the values (S, A) of a problem over the picture (H, W, 3) from which it was read, with the learned path."""
    cells = [mdp.state_cell(state) for state in greedy_path(q, mdp, mdp.n_states)[0]]
    value_map(
        q.max(axis=1).reshape(mdp.shape),
        picture,
        path,
        corners=cell_corners(seen.view),
        places=MapMarks(
            route=[(cell[0], cell[1]) for cell in cells],
            blocked=(mdp.terminal & ~mdp.goal).reshape(mdp.shape),
            start=seen.start,
            goal=seen.goal,
        ),
    )


def cell_corners(view: "View") -> NDArray[np.float64]:
    """The pixels (rows + 1, columns + 1, 2) of the crossings of an overhead view's grid lines."""
    along_x, along_y = (
        start + view.cell_m * np.arange(count + 1) for start, count in zip(view.origin_m, view.shape, strict=True)
    )
    x, y = np.meshgrid(along_x, along_y, indexing="ij")
    return view.pixel(np.stack([x, y, np.zeros_like(x)], axis=-1))


def _draw_curve(axes: "matplotlib.axes.Axes", policy: Curve) -> None:
    """Draw one policy's small plot, its lines in the order of the legend."""
    episodes, steps = np.arange(1, len(policy.curve) + 1), np.asarray(policy.curve)
    guided = np.asarray(policy.guided, dtype=np.bool_)
    axes.plot(episodes, steps, color=BLUE, linewidth=0.9, label="steps")
    axes.plot(episodes[guided], steps[guided], "o", color=ORANGE, markersize=3.5, label="guided episodes")
    fewest = policy.optimal_steps or 0
    if fewest:
        axes.axhline(fewest, color=RED, linestyle="--", linewidth=1.2, label="fewest possible")
    axes.set(xlabel="episode", ylabel="steps", xlim=(0, 1.02 * max(2, len(episodes))))
    if max(policy.curve, default=0) > 4 * max(1, fewest):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(matplotlib.ticker.ScalarFormatter())
        axes.yaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    else:
        axes.set_ylim(0, 1.15 * max(2, fewest, *policy.curve))
        axes.yaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
    axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
    axes.grid()


def _draw_returns(axes: "matplotlib.axes.Axes", policy: Curve, returns: "NDArray[np.float64]") -> None:
    """Draw the returns of a policy's last episodes."""
    first = len(policy.curve) - len(returns)
    episodes = np.arange(first + 1, len(policy.curve) + 1)
    guided = np.asarray(policy.guided[first:], dtype=np.bool_)
    axes.plot(episodes, returns, color=BLUE, linewidth=0.9, label="return")
    axes.plot(episodes[guided], returns[guided], "o", color=ORANGE, markersize=3.5, label="guided episodes")
    axes.set(xlabel="episode", ylabel="return", xlim=(0, 1.02 * max(2, len(policy.curve))))
    axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
    axes.grid()


def _draw_places(
    axes: "matplotlib.axes.Axes", crossings: NDArray[np.float64], walls: NDArray[np.bool_], places: MapMarks
) -> None:
    """Draw blocked cells, the greedy path, start and goal on a value map."""
    middles = (crossings[:-1, :-1] + crossings[1:, 1:]) / 2
    fine = walls.size > FINE
    outlines = [] if fine else [crossings[[i, i, i + 1, i + 1], [j, j + 1, j + 1, j]] for i, j in np.argwhere(walls)]
    if fine and walls.any():
        grey = matplotlib.colors.ListedColormap(["#555555"])
        axes.pcolormesh(crossings[..., 0], crossings[..., 1], np.ma.masked_where(~walls, walls), cmap=grey)
        axes.plot([], [], "s", color="#555555", label="blocked")  # its line in the legend
    if outlines:
        hatched = matplotlib.collections.PolyCollection(
            outlines, facecolor="#00000055", edgecolor="white", hatch="xxx", label="blocked"
        )
        axes.add_collection(hatched)
    if len(places.route):
        rows, columns = np.asarray(places.route).T
        x, y = middles[rows, columns].T
        axes.plot(x, y, color="white", linewidth=4.5, solid_capstyle="round")
        axes.plot(x, y, color=INK, linewidth=2, marker=".", markersize=6, label="greedy path")
    for cell, marker, size, colour, name in (
        (places.start, "o", 11, SKY, "start"),
        (places.goal, "*", 18, ORANGE, "goal"),
    ):
        if cell is not None:
            look: dict[str, Any] = {"markersize": size, "color": colour, "markeredgecolor": INK, "linestyle": "none"}
            axes.plot(*middles[cell], marker=marker, label=name, **look)


def _muted(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture (H, W, 3), paler and less saturated, so that a tint on it remains visible."""
    grey = picture.mean(axis=2, keepdims=True)
    muted: NDArray[np.uint8] = (90 + 0.65 * (0.45 * picture + 0.55 * grey)).clip(0, 255).astype(np.uint8)
    return muted
