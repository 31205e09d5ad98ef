"""The comparison of the arms of a study with people as a page, figures, and a JSON document."""

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.files import check_out, write_whole
from lab.lazy import matplotlib
from lab.studies.people import MeasureCompared, Row, compare_arms
from lab.version import __version__
from lab.view.canvas import BLUE, GREY, INK, picture_bytes
from lab.view.printed_page import printed_page

TEMPLATE = Path(__file__).with_name("people.html")
MOST_NAME = 80  # characters of a figure's file
PAGE, FIGURES = "report.html", "figures"
JITTER = 0.12  # of the distance between two arms
NOTHING = "–"
Json = dict[str, Any]


def people_compared(
    rows: Sequence[Row],
    about: Mapping[str, Any],
    out: Path,
    measures: Sequence[str] = (),
    seed: int = 0,
    model: bool = True,
) -> Json:
    """The document of `lab study people`, after its page and its figures were written to `out`.

    rows: one a lesson of a participant; about: the document of the export (export.json). Raises BadInput as `compare_arms` does,
    and for files that cannot be written.
    """
    check_out(out)
    design, compared, notes = compare_arms(rows, measures, seed, model)
    arms = [*compared[0].arms] if compared else []
    people = len({row["participant"] for row in rows if row["arm"] is not None})
    figures = {measure.name: figure(measure, design == "within") for measure in compared}
    head = (
        f"{about['class']}: {people} participants, {len(arms)} arms, {design} participants; Teaching Lab {__version__}."
    )
    if about.get("withdrawn"):
        head += f" Withdrawn, and in no number here: {about['withdrawn']}."
    text = printed_page(
        TEMPLATE,
        title=f"The arms of the study {about['class']}",
        head=head,
        notes=notes,
        measures=[_shown(measure, figures[measure.name]) for measure in compared],
    )
    places = {name: f"{FIGURES}/{re.sub(r'[^A-Za-z0-9_]', '_', name)[:MOST_NAME]}.svg" for name in figures}
    files = {PAGE: text.encode()} | {places[name]: picture for name, picture in figures.items()}
    try:
        (out / FIGURES).mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            write_whole(out / name, content)
    except OSError as error:
        raise BadInput(f"report '{out}' (--out): {error.strerror or error}") from None
    return {
        "class": about["class"],
        "protocol_sha256": about.get("protocol_sha256"),
        "lab": __version__,
        "design": design,
        "arms": arms,
        "participants": people,
        "withdrawn": about.get("withdrawn"),
        "seed": seed,
        "measures": [asdict(measure) for measure in compared],
        "notes": notes,
        "files": {"report": str(out / PAGE)} | {name: str(out / place) for name, place in places.items()},
    }


def figure(measure: MeasureCompared, within: bool) -> bytes:
    """An SVG picture of every participant's value in each arm, those of one joined by a line, with means and intervals."""
    arms = [*measure.arms]
    people = {person: n for n, person in enumerate(dict.fromkeys(p for arm in arms for p in measure.values[arm]))}
    shift = {person: JITTER * (2 * (n % 7) / 6 - 1) for person, n in people.items()}

    def draw(drawn: "matplotlib.figure.Figure") -> None:
        axes = drawn.add_subplot()
        for person in people:
            at = [n for n, arm in enumerate(arms) if person in measure.values[arm]]
            heights = [measure.values[arms[n]][person] for n in at]
            line = "-" if within else "none"
            axes.plot(
                np.array(at) + shift[person],
                heights,
                line,
                marker="o",
                markersize=3.5,
                color=GREY,
                linewidth=0.6,
                alpha=0.6,
            )
        for n, arm in enumerate(arms):
            known = measure.arms[arm]
            if known.mean is None:
                continue
            low, high = known.ci95 or (known.mean, known.mean)
            axes.vlines(n, low, high, color=INK, linewidth=2.2, zorder=3)
            axes.plot([n], [known.mean], marker="D", markersize=7, color=BLUE, markeredgecolor="white", zorder=4)
        axes.set_xticks(range(len(arms)), arms)
        axes.set(xlim=(-0.5, len(arms) - 0.5), ylabel=f"{measure.title}{f' [{measure.unit}]' if measure.unit else ''}")
        axes.grid(axis="y")

    return picture_bytes(draw, max(4.0, 1.2 + 1.3 * len(arms)), 3.4)


def _shown(measure: MeasureCompared, picture: bytes) -> Json:
    """What the page shows of a measure."""
    unit = f" [{measure.unit}]" if measure.unit else ""
    arms = [
        [arm, known.n, known.missing, _number(known.mean), _range(known.ci95), _number(known.median)]
        for arm, known in measure.arms.items()
    ]
    pairs = [
        [
            f"{pair.second} - {pair.first}",
            pair.n,
            _number(pair.difference),
            _range(pair.difference_ci95),
            _number(pair.correlation),
            _range(pair.correlation_ci95),
            _p(pair.p),
            _p(pair.p_holm),
        ]
        for pair in measure.pairs
    ]
    tables = [
        {"caption": f"Arms{unit}", "head": ["arm", "n", "missing", "mean", "95 %", "median"], "lines": arms},
        {
            "caption": f"Pairs{unit}",
            "head": ["pair", "n", "difference", "95 %", "rank-biserial", "95 %", "p", "p (Holm)"],
            "lines": pairs,
        },
    ]
    note, model = "", measure.model
    if model is not None:
        lines = [[term.name, _number(term.value), _range(term.ci95), _p(term.p)] for term in model.terms]
        tables.append(
            {"caption": f"Mixed-effects model{unit}", "head": ["term", "estimate", "95 %", "p"], "lines": lines}
        )
        note = (
            f"All arms alike: p {_p(model.p, '= ')}. Standard deviation between participants {_number(model.between_sd)}, "
            f"of the rest {_number(model.within_sd)}{unit}.{f' The model: {model.note}.' if model.note else ''}"
        )
    effect = "Kendall's W" if measure.test == "Friedman" else "epsilon squared"
    all_arms = (
        f"{measure.test}: {_number(measure.statistic)}, p {_p(measure.p, '= ')}, {effect} {_number(measure.effect)}."
    )
    return {
        "title": measure.title,
        "figure": f"data:image/svg+xml;base64,{b64encode(picture).decode()}",
        "all_arms": all_arms if measure.test else "",
        "tables": tables,
        "model_note": note,
    }


def _number(value: float | None) -> str:
    """A number with three digits."""
    return NOTHING if value is None else f"{value:.3g}".replace("-", "−") if abs(value) < 1000 else f"{value:.0f}"


def _range(ends: tuple[float, float] | None) -> str:
    return NOTHING if ends is None else f"{_number(ends[0])} to {_number(ends[1])}"


def _p(value: float | None, equals: str = "") -> str:
    return NOTHING if value is None else "< 0.001" if value < 0.001 else f"{equals}{value:.3f}"
