"""Where rules would have asked in a recording, against where a person took over: a page, a document, and figures."""

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import counted
from lab.lazy import matplotlib
from lab.mentor.takeovers import RULES, Rule, RulesCompared
from lab.recordings.episode import Episode, Image
from lab.version import __version__
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE_GREY, PURPLE, RED, SKY, picture_bytes, seconds
from lab.view.printed_page import printed_page

TEMPLATE = Path(__file__).with_name("mentor_report.html")
COLOURS = dict(
    zip(RULES, (BLUE, ORANGE, GREEN, PURPLE, RED, SKY, GREY), strict=True)
)  # one of somebody's own is in ink
MOST_EPISODES = 12  # that are drawn, those with takeovers first
MOST_FRAMES = 6  # of an episode
MOST_DOUBT = 3.0  # thresholds high that a plot is
NOTHING = "–"
COLUMNS = ("rule", "alarms", "takeovers warned of", "by chance", "right alarms", "by chance", "lead", "ROC area")
Json = dict[str, Any]


def report_document(compared: RulesCompared) -> Json:
    """The comparison as a JSON document."""
    return {
        "episodes": len(compared.recording.episodes),
        "takeovers": compared.takeovers,
        "minutes": compared.minutes,
        "window_s": compared.window_s,
        "false_alarms": compared.false_alarms,
        "rules": [
            {
                "rule": rule.name,
                "alarms": rule.alarms,
                "precision": rule.precision,
                "recall": rule.caught / compared.takeovers,
                "chance_precision": rule.chance_precision,
                "chance_recall": rule.chance_recall,
                "lead_s": float(np.median(rule.lead_s)) if rule.lead_s else None,
                "auroc": rule.auroc,
            }
            for rule in compared.rules
        ],
        "notes": [*compared.notes],
    }


def table_lines(compared: RulesCompared) -> list[tuple[str, ...]]:
    """The cells of the table, a line a rule; COLUMNS heads it."""
    return [
        (
            rule.name,
            str(rule.alarms),
            f"{rule.caught} of {compared.takeovers}",
            f"{rule.chance_recall * compared.takeovers:.1f}",
            NOTHING if rule.precision is None else f"{rule.right} of {rule.alarms}",
            f"{rule.chance_precision * rule.alarms:.1f}",
            seconds(float(np.median(rule.lead_s))) if rule.lead_s else NOTHING,
            NOTHING if rule.auroc is None else f"{rule.auroc:.2f}",
        )
        for rule in compared.rules
    ]


def report_page(compared: RulesCompared, name: str) -> str:
    """The HTML of the report of a recording called `name`."""
    episodes = sorted(range(len(compared.recording.episodes)), key=lambda number: not _taken(compared, number))
    shown = [number for number in episodes if _taken(compared, number)][:MOST_EPISODES] or episodes[:1]
    return printed_page(
        TEMPLATE,
        title=f"Where rules would have asked in {name}",
        head=(
            f"{counted(len(episodes), 'episode')} of {compared.recording.robot}, {compared.minutes:.1f} minutes of a policy's "
            f"own steps, {counted(compared.takeovers, 'takeover')} by a person; Teaching Lab {__version__}."
        ),
        notes=compared.notes,
        columns=COLUMNS,
        lines=table_lines(compared),
        meaning=(
            "A takeover was warned of, and an alarm right, if the alarm began in the "
            f"{compared.window_s:g} s before it; the lead is the median time between them. The threshold of each rule lets it "
            f"ask in {100 * compared.false_alarms:g} % of the stretches in which nobody took over, by all other episodes; the "
            "doubt in an episode is measured by what was learned from others. By chance: what as many alarms at random steps "
            "reach on average. ROC area: how often a step in the time before a takeover has more doubt than another one "
            "(0.5 by chance)."
        ),
        curves=_embedded(curves_figure(compared)),
        episodes=[
            {
                "title": f"Episode {number}: {compared.recording.episodes[number].task}",
                "figure": _embedded(episode_figure(compared, number)),
            }
            for number in shown
        ],
    )


def curves_figure(compared: RulesCompared) -> bytes:
    """An SVG picture: the share of takeovers that each rule warns of, against its alarms a minute."""
    most = 4.0 * max(compared.takeovers / compared.minutes, 0.5)  # alarms a minute

    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        for rule in compared.rules:
            axes.plot(
                *rule.curve.T, color=COLOURS.get(rule.name, INK), linewidth=1.6, label=rule.name, drawstyle="steps-post"
            )
        window_min = compared.window_s / 60.0
        rates = np.linspace(0.0, most, 60)
        axes.plot(rates, 1.0 - np.exp(-rates * window_min), "--", color=INK, linewidth=1.0, label="at random")
        axes.set(xlim=(0.0, most), ylim=(0.0, 1.02), xlabel="alarms a minute", ylabel="share of takeovers warned of")
        axes.grid()
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))

    return picture_bytes(draw, 7.2, 3.4)


def episode_figure(compared: RulesCompared, number: int) -> bytes:
    """An SVG picture of one episode: each rule's doubt, in thresholds; takeovers, alarms, and pictures where they begin."""
    episode, fps = compared.recording.episodes[number], compared.recording.fps
    frames = _frames(episode, compared.rules, number)
    camera = next(iter(episode.pictures), None)
    shown = list[tuple[int, str, Image]]()
    if camera is not None:
        shown = [(step, why, episode.pictures[camera][step]) for step, why in frames]

    def draw(figure: "matplotlib.figure.Figure") -> None:
        grid = figure.add_gridspec(2 if shown else 1, max(len(shown), 1), height_ratios=[1.5, 1] if shown else [1])
        axes = figure.add_subplot(grid[0, :])
        times = np.arange(len(episode)) / fps
        for taken, back in episode.takeovers():
            axes.axvspan(taken / fps, back / fps, color=PALE_GREY, zorder=0)
        for rule in compared.rules:
            heights = _in_thresholds(rule, number)
            colour = COLOURS.get(rule.name, INK)
            axes.plot(times, np.minimum(heights, MOST_DOUBT), color=colour, linewidth=1.2, label=rule.name)
            asked = [*rule.asked[number]]
            axes.plot(
                times[asked],
                np.minimum(heights[asked], MOST_DOUBT),
                "v",
                color=colour,
                markersize=7,
                markeredgecolor="white",
            )
        axes.axhline(1.0, color=INK, linewidth=0.8)
        axes.set(xlim=(0.0, max(len(episode) / fps, 1 / fps)), ylim=(0.0, MOST_DOUBT * 1.05), xlabel="time [s]")
        axes.set_ylabel("doubt [thresholds]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        for column, (step, why, picture) in enumerate(shown):
            below = figure.add_subplot(grid[1, column])
            below.imshow(picture)
            below.set_axis_off()
            below.set_title(f"{step / fps:.1f} s: {why}", fontsize=7)

    return picture_bytes(draw, 8.2, 4.2 if shown else 2.4)


def _in_thresholds(rule: Rule, number: int) -> Any:
    """The doubt (n,) in an episode as a multiple of its threshold; differences where the threshold is not above 0."""
    doubts, threshold = rule.doubts[number], rule.thresholds[number]
    return doubts / threshold if threshold > 0.0 else 1.0 + doubts - threshold


def _frames(episode: Episode, rules: Sequence[Rule], number: int) -> list[tuple[int, str]]:
    """The steps of which pictures are shown, and why: where takeovers begin, and each rule's first alarms before them."""
    steps = dict.fromkeys((taken for taken, _ in episode.takeovers()), "takeover")
    for rule in rules:
        for step in rule.asked[number]:
            steps.setdefault(step, f"{rule.name} asks")
    chosen = sorted(steps, key=lambda step: (steps[step] != "takeover", step))[:MOST_FRAMES]
    return [(step, steps[step]) for step in sorted(chosen)]


def _taken(compared: RulesCompared, number: int) -> bool:
    return bool(compared.recording.episodes[number].corrected.any())


def _embedded(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{b64encode(svg).decode()}"
