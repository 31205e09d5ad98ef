"""The pictures of AdviceBench: ranks, means and profiles of both scores, gains by advisor, worst cells, answers against gain."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lab.studies.findings import Row
from lab.view.canvas import BLUE, GREY, INK, ORANGE, RED, picture_bytes
from lab_studies.comparisons.advice_bench.aggregates import THRESHOLDS, Aggregate
from lab_studies.comparisons.advice_bench.ranks import Ranks
from lab_studies.comparisons.advice_bench.rules import BUDGETS, NOBODY, OURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST = 40.0  # points, where the colours of the gains end


def distances(ranked: Ranks) -> bytes:
    """A picture of the mean ranks, best first, with the critical difference as bars; ranks within one do not differ."""
    rules = list(ranked.mean)

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for line, rule in enumerate(rules):
            rank, colour = ranked.mean[rule], ORANGE if rule == OURS else BLUE
            axes.hlines(line, rank, rank + ranked.critical, color=GREY, linewidth=1.0)
            axes.plot(rank, line, "o", color=colour, markersize=5)
            axes.text(rank - 0.3, line, f"{rank:.1f}", ha="right", va="center", color=INK)
        axes.set_yticks(range(len(rules)), rules)
        axes.set(xlabel=f"mean rank (bar: critical difference {ranked.critical:.1f})", ylim=(len(rules) - 0.5, -0.5))
        axes.set_xlim(0.0, len(rules) + ranked.critical)
        axes.grid(axis="x")

    return picture_bytes(draw, 7.5, 0.9 + 0.24 * len(rules))


def means(found: Mapping[str, Mapping[str, Aggregate]], rules: Sequence[str]) -> bytes:
    """A picture of the interquartile means by score and rule, with their intervals."""

    def draw(figure: "Figure") -> None:
        columns = np.atleast_1d(figure.subplots(1, len(found), sharey=True))
        for axes, (score, by_rule) in zip(columns, found.items(), strict=True):
            for line, rule in enumerate(rules):
                value, low, high = by_rule[rule].iqm
                colour = ORANGE if rule == OURS else BLUE
                axes.hlines(line, low, high, color=colour, linewidth=1.6)
                axes.plot(value, line, "o", color=colour, markersize=4)
            axes.set(xlabel="points, interquartile mean", title=score, ylim=(len(rules) - 0.5, -0.5))
            axes.grid(axis="x")
        columns[0].set_yticks(range(len(rules)), rules)

    return picture_bytes(draw, 9.5, 1.0 + 0.24 * len(rules))


def profiles(found: Mapping[str, Mapping[str, Aggregate]]) -> bytes:
    """A picture of the share of sessions above each score: ours, nobody, the best other rule, and all others in grey."""

    def draw(figure: "Figure") -> None:
        columns = np.atleast_1d(figure.subplots(1, len(found), sharey=True))
        for axes, (score, by_rule) in zip(columns, found.items(), strict=True):
            others = {rule: own for rule, own in by_rule.items() if rule not in (OURS, NOBODY)}
            best = max(others, key=lambda rule: others[rule].iqm[0], default=OURS)
            for own in others.values():
                axes.plot(THRESHOLDS, own.profile, color=GREY, linewidth=0.5)
            lines = {best: (BLUE, "-"), NOBODY: (INK, "--"), OURS: (ORANGE, "-")}
            for rule, (colour, dash) in lines.items():
                if rule in by_rule:
                    own = by_rule[rule]
                    axes.plot(THRESHOLDS, own.profile, color=colour, linestyle=dash, linewidth=1.6, label=rule)
            axes.set(xlabel="points", title=score, ylim=(0.0, 1.02))
            axes.grid()
            axes.legend(loc="lower left")
        columns[0].set_ylabel("share of sessions above")

    return picture_bytes(draw, 9.5, 3.8)


def gains(rows: Sequence[Row], rules: Sequence[str]) -> bytes:
    """A map of rules by advisors for each budget, with the mean gain over nobody as colour and number."""
    advisors = list(dict.fromkeys(row["advisor"] for row in rows))
    shown = [rule for rule in rules if any(row["rule"] == rule for row in rows)]

    def draw(figure: "Figure") -> None:
        both = figure.subplots(1, len(BUDGETS), sharey=True)
        for axes, budget in zip(np.atleast_1d(both), BUDGETS, strict=True):
            table = [[_mean(rows, budget, rule, advisor) for advisor in advisors] for rule in shown]
            axes.imshow(table, cmap="RdBu", vmin=-LARGEST, vmax=LARGEST, aspect="auto")
            for line, values in enumerate(table):
                for column, value in enumerate(values):
                    pale = "white" if abs(value) > 0.6 * LARGEST else INK
                    axes.text(column, line, f"{value:+.0f}", ha="center", va="center", color=pale, fontsize=7)
            axes.set_xticks(range(len(advisors)), advisors, rotation=45, ha="right")
            axes.set_title(f"budget: {budget} answers" if budget != "any" else "any number of answers")
        np.atleast_1d(both)[0].set_yticks(range(len(shown)), shown)

    return picture_bytes(draw, 10.5, 1.6 + 0.24 * len(shown))


def _mean(rows: Sequence[Row], budget: str, rule: str, advisor: str) -> float:
    those = [row["value"] for row in rows if (row["budget"], row["rule"], row["advisor"]) == (budget, rule, advisor)]
    return float(np.mean(those))


def worst_cells(rows: Sequence[Row], rules: Sequence[str], target: float) -> bytes:
    """A picture of each rule's cell with the lowest end of its interval, and of the target."""
    lowest = {}
    for rule in rules:
        own = [row for row in rows if row["rule"] == rule]
        if own:
            lowest[rule] = min(own, key=lambda row: row["ci95"][0])

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for line, (rule, row) in enumerate(lowest.items()):
            colour = ORANGE if rule == OURS else BLUE
            axes.hlines(line, *row["ci95"], color=colour, linewidth=1.6)
            axes.plot(row["value"], line, "o", color=colour, markersize=4)
        axes.axvline(target, color=RED, linewidth=1.0, linestyle="--", label=f"target {target:g}")
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set_yticks(range(len(lowest)), lowest)
        axes.set(xlabel="points below nobody, with 95 % interval", ylim=(len(lowest) - 0.5, -0.5))
        axes.grid(axis="x")
        axes.legend(loc="lower left")

    return picture_bytes(draw, 7.5, 0.9 + 0.24 * len(lowest))


def answers_and_gain(rows: Sequence[Row], rules: Sequence[str]) -> bytes:
    """A picture of each rule's answers and gain, as means over all cells, by budget."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for budget, marker in zip(BUDGETS, "ox", strict=True):
            for rule in rules:
                own = [row for row in rows if (row["rule"], row["budget"]) == (rule, budget)]
                at = max(1.0, float(np.mean([row["answers"] for row in own]))), np.mean([row["value"] for row in own])
                axes.plot(*at, marker, color=ORANGE if rule == OURS else BLUE, markersize=5)
                if budget == "any" or rule == OURS:
                    axes.annotate(rule, at, xytext=(4, 2), textcoords="offset points", fontsize=6.5)
            axes.plot([], [], marker, color=INK, label=f"budget: {budget}")
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        axes.set(xscale="log", xlabel="answers of a session", ylabel="points gained over nobody")
        axes.grid()
        axes.legend(loc="lower left")

    return picture_bytes(draw, 8.0, 4.6)
