"""Leaderboards: a file of scores for each member of a study, with a checksum, and the board that is drawn from such files.

The version of a study is a hash of what its scores depend on, so that only scores of the same measurement are compared.
"""

import csv
from collections.abc import Sequence
from hashlib import sha256
from io import StringIO
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lab.errors import BadInput
from lab.files import read_limited
from lab.lazy import matplotlib
from lab.studies.findings import Row
from lab.view.canvas import BLUE, ORANGE, check_picture, picture_file

FIRST = "# teaching-lab scores 1"
HEADER = ("study", "version", "member", "sha256")
COLUMNS = ("cell", "measure", "value", "ci95_low", "ci95_high")
HARM = -1.0  # an interval of a gain that reaches below it
MOST_BYTES = 20_000_000


class Score(NamedTuple):
    """A member's score by one measure in a cell, with the ends of its interval."""

    cell: str
    measure: str
    value: float
    low: float
    high: float


class Scores(NamedTuple):
    """The scores of a member of a study, in one version of it."""

    study: str
    version: str
    member: str
    scores: tuple[Score, ...]


def scores_file(study: str, version: str, member: str, rows: Sequence[Row], cell: Sequence[str]) -> str:
    """The text of a member's file of scores: its header, then a line for each row with an interval.

    cell: the names of the settings that make a cell. The SHA-256 is over the rest of the text, so that a file which was cut or
    edited is refused; it does not prove who measured.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        if row["ci95"] is not None:
            where = ", ".join(str(row[name]) for name in cell)
            writer.writerow([where, row["measure"], *(f"{number:.4f}" for number in (row["value"], *row["ci95"]))])
    body = text.getvalue()
    values = study, version, member, _checksum(study, version, member, body)
    return "\n".join([FIRST, *(f"# {name}: {value}" for name, value in zip(HEADER, values, strict=True)), body])


def _checksum(study: str, version: str, member: str, body: str) -> str:
    return sha256("\n".join((study, version, member, body)).encode()).hexdigest()


def read_scores(path: Path) -> Scores:
    """The scores in a file. Raises BadInput for a file that cannot be read, is none of these, or does not fit its checksum."""
    try:
        text = read_limited(path, MOST_BYTES).decode().replace("\r\n", "\n")
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadInput(f"'{path}' is no file of scores: it is no text") from None
    first, *lines = text.split("\n", len(HEADER) + 1)
    named = [line.removeprefix(f"# {name}: ") for name, line in zip(HEADER, lines, strict=False)]
    begins = all(line.startswith(f"# {name}: ") for name, line in zip(HEADER, lines, strict=False))
    if first != FIRST or len(lines) <= len(HEADER) or not begins:
        raise BadInput(f"'{path}' is no file of scores: wanted one of the folder scores that a study wrote")
    study, version, member, checksum = named
    if checksum != _checksum(study, version, member, lines[-1]):
        raise BadInput(
            f"'{path}': its rows do not fit its sha256: it was cut or edited; wanted it as the study wrote it"
        )
    try:
        table = [Score(row[0], row[1], *map(float, row[2:])) for row in list(csv.reader(StringIO(lines[-1])))[1:]]
    except (TypeError, ValueError, IndexError):
        table = []
    if not table or not all(map(isfinite, (number for row in table for number in row[2:]))):
        raise BadInput(f"'{path}': wanted rows of {', '.join(COLUMNS)}, with finite numbers")
    return Scores(study, version, member, tuple(table))


def leaderboard(paths: Sequence[Path]) -> dict[str, Any]:
    """The board as JSON: study, version, measures, cells, and a row for each member, the best mean rank first.

    A row has, by measure, the mean rank over cells (1 is best, ties share), the mean value, and the number of intervals that
    reach below HARM. Raises BadInput for files of different studies, versions or cells, and for a member that comes twice.
    """
    from scipy.stats import rankdata

    all_scores = [read_scores(path) for path in paths]
    for path, scores in zip(paths, all_scores, strict=True):
        for what in ("study", "version"):
            if getattr(scores, what) != getattr(all_scores[0], what):
                own, first = getattr(scores, what), getattr(all_scores[0], what)
                raise BadInput(f"'{path}': {what} {own}, but '{paths[0]}' has {first}: wanted scores of one {what}")
        if [row[:2] for row in scores.scores] != [row[:2] for row in all_scores[0].scores]:
            raise BadInput(f"'{path}': other cells than in '{paths[0]}': wanted scores of the same cells")
    members = [scores.member for scores in all_scores]
    for member in members:
        if members.count(member) > 1:
            raise BadInput(f"two files are of '{member}': wanted one for each member")
    measures = list(dict.fromkeys(row.measure for row in all_scores[0].scores))
    rows: list[Row] = [{"member": member} for member in members]
    for measure in measures:
        cells = [[row for row in scores.scores if row.measure == measure] for scores in all_scores]
        ranks = rankdata([[-row.value for row in own] for own in cells], axis=0).mean(axis=1)
        for row, own, rank in zip(rows, cells, ranks.tolist(), strict=True):
            row[f"{measure}_rank"] = round(rank, 2)
            row[measure] = round(float(np.mean([score.value for score in own])), 2)
            row[f"{measure}_harm"] = sum(score.low < HARM for score in own)
    rows.sort(key=lambda row: (row[f"{measures[0]}_rank"], row["member"]))
    count = sum(row.measure == measures[0] for row in all_scores[0].scores)
    board = {"study": all_scores[0].study, "version": all_scores[0].version, "cells": count, "measures": measures}
    return board | {"members": rows}


def draw_board(board: dict[str, Any], path: Path) -> None:
    """Writes a picture of the mean ranks by measure, PNG or SVG. Raises BadInput for a path that is neither."""
    check_picture(path)
    members = [row["member"] for row in board["members"]]
    with picture_file(path, 8.0, 1.2 + 0.24 * len(members)) as figure:
        columns: list[matplotlib.axes.Axes] = [*np.atleast_1d(figure.subplots(1, len(board["measures"]), sharey=True))]
        for axes, measure in zip(columns, board["measures"], strict=True):
            for line, row in enumerate(board["members"]):
                axes.plot(row[f"{measure}_rank"], line, "o", color=BLUE if line else ORANGE, markersize=5)
            axes.set(xlabel="mean rank", title=measure.replace("_", " "), ylim=(len(members) - 0.5, -0.5))
            axes.grid(axis="x")
        columns[0].set_yticks(range(len(members)), members)
