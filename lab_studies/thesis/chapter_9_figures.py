"""Figures 9.1 to 9.13: their cells and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.advice.advisors import SKILL_TAUS
from lab.errors import BadInput
from lab.learning.gates import improvement
from lab.studies.charts import PRINTED, bars, curve, legend_below
from lab.studies.findings import Row, mean_row, share_row, those
from lab.studies.runner import Job
from lab.view.canvas import BLUE, GREY, INK, ORANGE, RED, picture_bytes
from lab_studies.thesis.chapter_9_cells import BEST_BETA, TAUS, describe
from lab_studies.thesis.chapter_9_sessions import (
    AdviceSetting,
    example_session,
    measured,
    table_of,
    walk_of_advisor,
    world,
)
from lab_studies.thesis.used_to_choose import is_used

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ADVISORS = tuple(f"{name} ({tau:g})" for name, tau in SKILL_TAUS.items())
METHODS = {"ccrl": "CCRL", "ia": "IA", "combined": "combined"}
NEVER_REJECTS = 1_000_000  # an Omega that no advisor reaches
OPTIMUM = 13  # steps in world I
WALKERS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)  # the taus of fig. 9.1
PRINTED_WALKS = {0.01: (100.0, 13.0), 1.0: (None, 178.0)}  # tau -> share of shortest paths [%], mean steps
LOWEST_RATE = -2.0  # lower improvement rates are drawn as a mark at the edge
WINDOW = 5  # K of the improvement rate

Series = Mapping[str, Mapping[str, AdviceSetting]]  # of a figure: series -> group -> setting


def figures(job: Job, reading: Mapping[str, Any]) -> tuple[list[Row], dict[str, bytes]]:
    """The rows of figures 9.1, 9.3 and 9.5-9.13, and their pictures by caption."""
    rows = walk_rows(reading)
    pictures = {
        "Figure 9.1: an advisor's own way by tau": bars(
            [f"{tau:g}" for tau in WALKERS],
            {
                "shortest way [%]": those(rows, measure="SP_percent"),
                "mean steps (201: not arrived)": those(rows, measure="mean_steps"),
            },
            "percent, steps",
            xlabel="tau",
        )
    }
    guided = AdviceSetting("world-1", gate="ccrl", tau=0.01, lambda_threshold=0.05, omega=1)
    for caption, setting, threshold in (
        ("Figure 9.3: a session in world I, learning alone", AdviceSetting("world-1"), None),
        ("Figures 9.5 and 9.6: a session with CCRL and an expert", replace(guided, **reading), 0.05),
    ):
        steps, helped = example_session(setting, job.seed)
        pictures[caption] = convergence(steps.tolist(), helped.tolist(), OPTIMUM, threshold)
    for caption, series in figure_series().items():
        more, drawn = _compared(job, reading, caption, series)
        rows += more
        pictures |= drawn
    return rows, pictures


def _compared(job: Job, reading: Mapping[str, Any], caption: str, series: Series) -> tuple[list[Row], dict[str, bytes]]:
    """The rows of success and helped steps of one of the figures 9.7-9.13, and their pictures."""
    asked = {name: [replace(setting, **reading) for setting in line.values()] for name, line in series.items()}
    outcomes = measured(job, [setting for line in asked.values() for setting in line])
    groups = list(next(iter(series.values())))
    xlabel = "Λ" if "by Lambda" in caption else "Ψ" if "by Psi" in caption else ""
    rows, pictures = [], {}
    for what, measure in (("sessions that end optimal [%]", "SP_percent"), ("helped steps", "HS_steps")):
        lines = {
            name: [
                share_row({"table": caption, **describe(setting)}, measure, outcomes[setting].success)
                if measure == "SP_percent"
                else mean_row({"table": caption, **describe(setting)}, measure, outcomes[setting].helped_steps)
                for setting in line
            ]
            for name, line in asked.items()
        }
        rows += [row for line in lines.values() for row in line]
        pictures[f"{caption}: {what}"] = bars(groups, lines, what, xlabel=xlabel)
    return rows, pictures


def figure_series() -> dict[str, Series]:
    """The series of figures 9.7-9.13, by caption."""
    by_skill = dict(zip(ADVISORS, TAUS, strict=True))
    in_world_1 = AdviceSetting("world-1", "limited", "ccrl", 0.01, 0.05, 1)
    two = AdviceSetting("world-2", "limited", "ccrl", 0.01, 0.05, 7)
    introspecting = AdviceSetting("world-2", "limited", "ia", 0.01, psi=1.0)

    def skills(setting: AdviceSetting) -> dict[str, AdviceSetting]:
        return {name: replace(setting, tau=tau) for name, tau in by_skill.items()}

    def by_threshold(setting: AdviceSetting) -> dict[str, AdviceSetting]:
        return {f"{value:g}": replace(setting, lambda_threshold=value) for value in (0.01, 0.05, 0.1, 0.3, 0.5, 0.9)}

    both = AdviceSetting("world-2", "limited", "combined", 0.01, 0.05, 5, 1.0)
    return {
        "Figure 9.7: CCRL by Lambda, expert, world II, limited view": {
            "never rejects": by_threshold(replace(two, omega=NEVER_REJECTS)),
            "Omega 7": by_threshold(two),
        },
        "Figures 9.8 and 9.9: CCRL without and with the assessment of advice, world I, limited view": {
            "never rejects": skills(replace(in_world_1, omega=NEVER_REJECTS)),
            "Omega 1": skills(in_world_1),
        },
        "Figure 9.10: CCRL by Omega, world I, limited view": {
            f"Omega {omega}": skills(replace(in_world_1, omega=omega)) for omega in (1, 3, 5, 7)
        },
        "Figure 9.11: IA by Psi, expert, world II, limited view": {
            "IA": {f"{psi:g}": replace(introspecting, psi=psi) for psi in (0.1, 0.3, 0.7, 1.0, 1.3)}
        },
        "Figures 9.12 and 9.13: IA and the combined method by advisor, world II, limited view": {
            "IA": skills(introspecting),
            "combined, Omega 5": skills(both),
        },
    }


def walk_rows(reading: Mapping[str, Any]) -> list[Row]:
    """The rows of fig. 9.1: how often advisors of several skills take the shortest path themselves, and their mean steps."""
    known = reading.get("advisor_table", "learned")
    place, table = world("world-1"), table_of(AdviceSetting("world-1", advisor_table=known))
    rows = []
    for tau in WALKERS:
        steps = walk_of_advisor(place, table, tau)
        named = {"table": "Figure 9.1", "world": "world-1", "advisor": "alone", "tau": tau, "advisor_table": known}
        share, mean = PRINTED_WALKS.get(tau, (None, None))
        more = [share_row(named, "SP_percent", steps == OPTIMUM, share), mean_row(named, "mean_steps", steps, mean)]
        rows += [row if row["thesis"] is None else row | {"used": is_used("world-1", tau)} for row in more]
    return rows


def beta_picture(rows: Sequence[Row]) -> bytes:
    """A picture of the success percentage against beta with intervals, a curve for each world. Source: thesis fig. 9.4."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for (place, best), look in zip(BEST_BETA.items(), ((BLUE, "o"), (ORANGE, "s")), strict=True):
            curve(axes, those(rows, world=place), "beta", (*look, place))
            axes.plot(*best, label="printed", zorder=3, **PRINTED)
        axes.set(xlabel="β (softmax temperature $n^{-β}$ in episode n)", ylabel="sessions that end optimal [%]")
        axes.set_ylim(0, 1.08 * max(20.0, *(row["ci95"][1] for row in rows)))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 6, 3.8)


def ranks_picture(rows: Sequence[Row]) -> bytes:
    """A picture of scores by advisor and method, with ranks on the bars, from the rows of one of the tables 9.2-9.5."""
    score_rows = {(row["gate"], row["tau"]): row for row in those(rows, measure="score")}
    groups = [*ADVISORS, "all"]
    lines = {name: [score_rows[gate, tau] for tau in (*TAUS, "all")] for gate, name in METHODS.items()}
    return bars(groups, lines, "score", xlabel="advisor, number on a bar: rank among the methods", label="rank")


def convergence(steps: Sequence[int], guided: Sequence[bool], optimum: int, threshold: float | None = None) -> bytes:
    """A picture of the steps (n,) of a session's episodes, with guided ones marked, above the improvement rate before each.

    optimum: the fewest possible steps; threshold: Lambda, below which the learner asks. Raises BadInput without episodes,
    and for lengths that differ. Source: thesis figs. 9.3, 9.5, 9.6; eq. 6.1.
    """
    if not len(steps) or len(steps) != len(guided):
        raise BadInput(f"convergence: {len(steps)} episodes, {len(guided)} marks of guided ones")

    def draw(figure: "Figure") -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        draw_steps(above, np.asarray(steps), np.asarray(guided, dtype=np.bool_), optimum)
        draw_rate(below, list(steps), WINDOW, threshold)
        legend_below(figure)

    return picture_bytes(draw, 7, 4.6)


def draw_steps(axes: "Axes", steps: NDArray[np.int64], guided: NDArray[np.bool_], optimum: int) -> None:
    """Draw the steps of each episode (n,)."""
    from matplotlib.ticker import MaxNLocator

    episodes = np.arange(1, len(steps) + 1)
    axes.plot(episodes, steps, color=BLUE, linewidth=0.9, label="steps")
    if guided.any():
        look: dict[str, Any] = {"markersize": 4, "markeredgecolor": INK, "markeredgewidth": 0.4}
        axes.plot(episodes[guided], steps[guided], "o", color=ORANGE, label="guided episodes", **look)
    axes.axhline(optimum, color=RED, linestyle="--", linewidth=1.2, label=f"fewest possible: {optimum}")
    axes.set(ylabel="steps", xlim=(0, 1.02 * max(2, len(steps))), ylim=(0, 1.08 * max(optimum, int(steps.max()), 2)))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid()


def draw_rate(axes: "Axes", steps: Sequence[int], window: int, threshold: float | None) -> None:
    """Draw the improvement rate that the learner knows before each episode; it exists from episode 2K + 1."""
    known = [
        (n + 1, improved.rate) for n in range(len(steps)) if (improved := improvement(steps[:n], window)) is not None
    ]
    if known:
        axes.plot(*zip(*known, strict=True), color=INK, linewidth=0.9)
        cut = [(episode, LOWEST_RATE) for episode, rate in known if rate < LOWEST_RATE]
        if cut:
            look: dict[str, Any] = {"color": GREY, "markersize": 5, "clip_on": False, "label": "rate below −2"}
            axes.plot(*zip(*cut, strict=True), "v", **look)
    axes.axhline(0, color=GREY, linewidth=0.6)
    if threshold is not None:
        axes.axhline(threshold, color=ORANGE, linestyle=":", linewidth=1.4, label=f"asks below Λ = {threshold:g}")
    axes.set(xlabel="episode", ylabel="improvement rate")
    axes.set_ylim(max(LOWEST_RATE, min([-0.1, *(1.1 * rate for _, rate in known)])), 1.05)
    axes.grid()
