"""Figures 7.3 to 7.12 of the thesis as SVG: measured values are lines with intervals, printed ones open markers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.follow import simulate
from lab.studies.charts import PRINTED, Look, bars, curve, legend_below
from lab.studies.findings import Row, those
from lab.studies.runner import seeds_of
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, picture_bytes
from lab_studies.thesis.chapter_7_cells import (
    READINGS,
    SequencingSetting,
    epsilons,
    listing_input,
    optimum_s,
    robot_cell,
)
from lab_studies.thesis.chapter_7_listing import run_sessions

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SESSION = SequencingSetting("II", 3, "srl", 200, reward_factor="A", beta=1.5)  # of figs. 7.3 and 7.4
TRIED = 100  # sessions, of which the first that settles on the optimum is shown
SETTLES_PRINTED = 67  # the episode that section 7.7.1 names for fig. 7.3
SEQUENCE_PRINTED = (1, 2, 1, 2, 1, 2, 3, 2, 3, 3)  # section 7.7.1
BETAS = (1.0, 1.2, 1.5, 1.7)
NAMES = {"srl B": "SRL, type B", "srl A": "SRL, type A", "mc": "Monte Carlo", "random": "random search"}
METHODS, FACTORS = ("srl B", "mc", "random"), ("srl A", "srl B")
COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
SIZE_INCH = 7.0, 4.0


class Compared(NamedTuple):
    """The case, toasts, environment and methods that one picture by session length shows."""

    case: str
    toasts: int
    environment: str
    names: tuple[str, ...] = METHODS


COMPARED = {
    "Figure 7.7: reward factors, 3 toasts, case I": Compared("I", 3, "deterministic", FACTORS),
    "Figure 7.8: reward factors, 4 toasts, case I": Compared("I", 4, "deterministic", FACTORS),
    "Figure 7.9: 3 toasts, case III": Compared("III", 3, "deterministic"),
    "Figure 7.10: 3 toasts, case I, times drawn": Compared("I", 3, "stochastic"),
    "Figure 7.11: 4 toasts, case II": Compared("II", 4, "deterministic"),
    "Figure 7.12: 4 toasts, case I, times drawn": Compared("I", 4, "stochastic"),
}
OF_FACTORS = tuple(caption for caption, shown in COMPARED.items() if shown.names == FACTORS)


def of_case(case: str, table: str) -> dict[str, Compared]:
    """What the four pictures of one of the tables 7.4-7.6 show, by caption."""
    words = {"deterministic": "", "stochastic": ", times drawn"}
    return {
        f"{table}: {toasts} toasts, case {case}{word}": Compared(case, toasts, environment)
        for toasts in (3, 4)
        for environment, word in words.items()
    }


def length_pictures(rows: Sequence[Row], shown_by_caption: Mapping[str, Compared]) -> dict[str, bytes]:
    """Pictures by session length, by caption: SP, or the mean best time if times are random."""
    return {caption: _by_length(rows, shown) for caption, shown in shown_by_caption.items()}


def _by_length(rows: Sequence[Row], shown: Compared) -> bytes:
    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for name, colour, marker in zip(shown.names, COLOURS, "os^", strict=False):
            of = {
                row["episodes"]: row
                for row in those(rows, case=shown.case, toasts=shown.toasts, environment=shown.environment)
                if row["thesis"] is not None
                and _method(row) == name
                and row["measure"] in ("SP_percent", "BR_s")
                and row["table"] != "Table IV.1"
            }
            _beside_print(axes, [of[episodes] for episodes in sorted(of)], "episodes", (colour, marker, NAMES[name]))
        title = f"{shown.toasts} toasts, case {shown.case}"
        axes.set(xlabel="episodes in a session")
        if shown.environment == "deterministic":
            axes.set(title=title, ylabel="sessions that find the optimum [%]", ylim=(0, 104))
        else:
            axes.set(title=f"{title}, processing times drawn", ylabel="mean best makespan [s]")
        axes.plot([], [], label="printed", **(PRINTED | {"marker": "o"}))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, *SIZE_INCH)


def _beside_print(axes: "Axes", rows: Sequence[Row], by: str, look: Look) -> None:
    """Draw the values of rows against one of their settings, and the printed ones as open markers on a dotted line."""
    curve(axes, rows, by, look)
    printed = PRINTED | {"marker": look[1], "linestyle": ":", "linewidth": 0.9, "markeredgecolor": look[0]}
    axes.plot([row[by] for row in rows], [row["thesis"] for row in rows], color=look[0], **printed)


def beta_picture(rows: Sequence[Row]) -> bytes:
    """A picture of SP and CE by beta with type A, a line for each case. Source: thesis fig. 7.5."""
    shown = those(rows, table="Table IV.1", reward_factor="A")

    def draw(figure: "Figure") -> None:
        from matplotlib.ticker import MaxNLocator

        left, right = figure.subplots(1, 2)
        for axes, measure, label in (
            (left, "SP_percent", "sessions that find the optimum [%]"),
            (right, "CE_episode", "mean episode of convergence"),
        ):
            for colour, marker, case in zip(COLOURS, "os^", ("I", "II", "III"), strict=False):
                of = those(shown, measure=measure, case=case)
                _beside_print(axes, of, "beta", (colour, marker, f"case {case}"))
            axes.set(xlabel="β (episode n explores with probability $n^{-β}$)", ylabel=label, xticks=BETAS)
            axes.grid()
        left.yaxis.set_major_locator(MaxNLocator(integer=True))
        left.set_ylim(None, 101)
        right.set_ylim(0, None)
        left.plot([], [], label="printed", **(PRINTED | {"marker": "o"}))
        legend_below(figure)

    return picture_bytes(draw, 8.0, 3.6)


def session_pictures(seed: int) -> dict[str, bytes]:
    """Figures 7.3 and 7.4, of one session, and 7.6, by caption."""
    times_s, sequence = shown_session(seed)
    cell = robot_cell(SESSION.case, SESSION.toasts)
    return {
        "Figure 7.3: a session that settles on the optimum": convergence(times_s),
        "Figure 7.4: where the toasts are, in the sequence found": _places(cell, sequence),
        "Figure 7.6: how fast exploration ends": _exploration(),
    }


def shown_session(seed: int) -> tuple[NDArray[np.float64], list[int]]:
    """The times (E,) of the first session that settles on the optimum [s], and the toasts that its best episode moves."""
    sessions = run_sessions(listing_input(SESSION), epsilons(SESSION), seeds_of(SESSION, TRIED, seed), keep_times=True)
    n = int(np.argmin(sessions.last_s))
    return sessions.times_s[n], [toast for toast in sessions.sequences[n].tolist() if toast]


def convergence(times_s: NDArray[np.float64]) -> bytes:
    """A picture of the times (E,) of a session's episodes [s]. Source: thesis fig. 7.3."""
    best_s = optimum_s(SESSION.case, SESSION.toasts)
    changes = np.flatnonzero(times_s[1:] != times_s[:-1])
    settles = int(changes[-1]) + 2 if len(changes) else 1

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        look: dict[str, Any] = {"marker": ".", "markersize": 4.5, "linewidth": 0.8}
        axes.plot(np.arange(1, len(times_s) + 1), times_s, color=BLUE, label="time of each episode", **look)
        axes.axhline(best_s, color=RED, linestyle="--", linewidth=1.4, label=f"optimum: {best_s:g} s")
        axes.axvline(settles, color=INK, linewidth=1.0, label=f"stays the same from episode {settles} on")
        axes.axvline(
            SETTLES_PRINTED, color=GREY, linestyle=":", linewidth=1.6, label=f"printed: from {SETTLES_PRINTED} on"
        )
        axes.set(xlabel="episode", ylabel="makespan [s]", xlim=(0, 1.01 * len(times_s)))
        axes.set_title(f"SRL type A, β = {SESSION.beta:g}, case {SESSION.case}, {SESSION.toasts} toasts")
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, *SIZE_INCH)


def _places(cell: Cell, sequence: Sequence[int]) -> bytes:
    """A picture of the station of each toast over time; its line slopes while the robot carries it."""
    schedule = simulate(cell, sequence)

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for part, colour in zip(range(1, cell.parts + 1), COLOURS, strict=False):
            own = [activity for activity in schedule.parts if activity.part == part]
            times = [time for activity in own for time in (activity.start_s, activity.end_s)]
            places = [cell.index(name) for activity in own for name in (activity.origin, activity.target)]
            lifted = np.array(places) + 0.09 * (
                part - (cell.parts + 1) / 2
            )  # so that equal lines do not hide each other
            axes.plot(times, lifted, color=colour, linewidth=2.2, label=f"toast {part}", solid_capstyle="butt")
        names = [f"{number}  {name.replace('_', ' ')}" for number, name in enumerate(cell.names, 1)]
        axes.set_yticks(range(len(names)), names)
        axes.set(xlabel="time [s]", xlim=(0, 1.01 * schedule.makespan_s), ylim=(-0.4, len(names) - 0.6))
        moved = [", ".join(map(str, toasts)) for toasts in (sequence, SEQUENCE_PRINTED)]
        axes.set_title(f"toasts moved: {moved[0]}; {schedule.makespan_s:g} s (printed: {moved[1]})")
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, *SIZE_INCH)


def _exploration() -> bytes:
    """A picture of eq. 5.1 for the betas that the thesis compares."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for beta, colour in zip(BETAS, COLOURS, strict=True):
            setting = replace(SESSION, beta=beta)
            axes.plot(range(1, setting.episodes + 1), epsilons(setting), color=colour, label=f"β = {beta:g}")
        axes.set(xlabel="episode", ylabel="probability of a random choice", xlim=(0, 60), ylim=(0, 1.02))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 6.0, 3.4)


def readings(rows: Sequence[Row]) -> dict[str, bytes]:
    """Pictures of the distance of each reading from the printed SP, bars by method, one for each number of toasts."""
    off = {(row["reading"], row["toasts"], _method(row)): row for row in those(rows, measure="off_points")}
    groups = [fill(name, 14) for name in READINGS]
    return {
        f"Distance from the printed SP by reading, {toasts} toasts, case I": bars(
            groups,
            {shown: [off[reading, toasts, name] for reading in READINGS] for name, shown in NAMES.items()},
            "mean distance from print [points]",
        )
        for toasts in (3, 4)
    }


def _method(row: Row) -> str:
    return " ".join(filter(None, (row["method"], row.get("reward_factor"))))
