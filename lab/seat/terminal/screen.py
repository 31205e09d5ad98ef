"""The layout of one question on a screen of any size: the picture, with the numbers beside it or below it."""

import os
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from textwrap import wrap

from rich.console import Console
from rich.text import Text

from lab.learning.requests import AdviceRequest
from lab.seat import request_text
from lab.seat.grid_text import GAP, Marks, StateWords, TextPicture, both_views, picture_of
from lab.seat.terminal.typed_answer import example, letters

Parts = dict[str, list[Text]]
BRIEF = 60  # columns, below which numbers come with fewer words
PANEL = 38  # least columns for the numbers beside a picture
FEWEST_ROWS = 6  # of a picture; the least important lines are dropped to make room for them
ROWS_WITH_LEGEND = 12
DROPPED = ("legend", "choice", "standing", "progress", "moves")  # dropped in this order when there is too little room


def room(console: Console) -> tuple[int, int]:
    """The columns and lines of a console; rich takes every dumb terminal for one of 80 x 25."""
    if console.is_dumb_terminal:
        try:
            return os.get_terminal_size(console.file.fileno())
        except (OSError, ValueError):  # it is no terminal
            pass
    return console.size


def folded(lines: Iterable[str], width: int, style: str = "") -> list[Text]:
    """The lines of text, wrapped between words."""
    return [Text(part, style) for line in lines for part in wrap(line, max(width, 8)) or [""]]


def packed(parts: Sequence[Text], width: int, gap: str = "  ") -> list[Text]:
    """The parts side by side; a part that does not fit begins a new line."""
    lines = [parts[0]]
    for part in parts[1:]:
        if lines[-1].cell_len + len(gap) + part.cell_len > width:
            lines.append(part)
        else:
            lines[-1] = Text.assemble(lines[-1], gap, part)
    return lines


def question(request: AdviceRequest, marks: Marks, width: int) -> str:
    """The prompt before the cursor, the longest one that leaves room to type."""
    own = marks.named(request.mdp, request.own)
    forms = (f"Which way? [enter = {own}, ? explains] ", f"Which way? [enter = {own}] ", f"Which way? [{own}] ")
    if request.judgement == "only":
        forms = (
            f"It goes {own}. How is that? [+ good, - bad, ? explains] ",
            f"It goes {own}: good? [+, -] ",
            f"{own}: [+, -] ",
        )
    return next((form for form in forms if len(form) + 12 <= width), "Which way? ")


def screen(
    request: AdviceRequest, marks: Marks, width: int, height: int, known: StateWords | None = None
) -> list[Text]:
    """The lines of a question, in `width` columns and `height` lines (more if the picture is the environment's own).

    known: describes states in words.
    """
    head = _head(request, width, known)
    left = height - len(head)
    if known is not None and (views := both_views(request, marks, width, left)) is not None:
        beside = _beside_views(request, marks, views, known, width)
        if len(beside) <= left:
            return head + beside
    whole = picture_of(request, marks, width, left)
    if whole is None:
        return head + _below(request, marks, None, width, left)
    if whole.width + GAP + PANEL <= width:
        beside = _beside(request, marks, whole, width, left)
        if len(beside) <= left:
            return head + beside
    return head + _below(request, marks, whole, width, left)


def _head(request: AdviceRequest, width: int, known: StateWords | None) -> list[Text]:
    """The lines with the number of the step and the learner's position."""
    if known is not None:
        step = f"Episode {request.episode}, step {request.step}"
        return folded([step], width, "bold") + folded([known.in_words(request.state)], width)
    step, at = f"step {request.step}: at", request.mdp.state_label(request.state)
    title = f"Episode {request.episode}, {step} {at}"
    return folded([title if len(title) <= width else f"{step.capitalize()} {at}"], width, "bold")


def _beside_views(
    request: AdviceRequest, marks: Marks, views: TextPicture, known: StateWords, width: int
) -> list[Text]:
    """The views with the moves on their right if there is room, else below; the learner's lines below both."""
    panel = width - views.width - GAP
    keys = {action: letter for letter, action in letters(request.mdp).items()}
    moves = [
        Text.assemble((f"{keys.get(action, ''):2}", "bold"), line)
        for action, line in enumerate(request_text.bars(request, marks, known.moves_in_words()))
    ]
    ranges = request_text.shown_in_words(request, views)
    said = folded(
        [request_text.choice(request, marks), *request_text.progress(request), request_text.standing(request)], width
    )
    typed = f"Type a letter, an arrow key or a word, or several moves at once, such as {example(request.mdp)}."
    typed = "" if request.judgement == "only" else typed
    notes = folded(filter(None, [views.legend, ranges, typed]), width, "dim")
    if max(move.cell_len for move in moves) > panel:
        return [*views.lines, *notes, *moves, *said]
    return [*_joined(views.lines, moves, views.width + GAP), *notes, *said]


def _joined(pictured: Sequence[Text], numbers: Sequence[Text], column: int) -> list[Text]:
    """The lines of a picture joined with other lines, which begin at `column`."""
    lines = []
    for drawn, number in zip_longest(pictured, numbers):
        left = drawn.copy() if drawn is not None else Text()
        if number is not None:
            left.pad_right(column - left.cell_len)
            left.append_text(number)
        lines.append(left)
    return lines


def _beside(request: AdviceRequest, marks: Marks, whole: TextPicture, width: int, height: int) -> list[Text]:
    """The picture with the numbers on its right and its legend below it."""
    panel = width - whole.width - GAP
    texts = [request_text.choice(request, marks), "", *request_text.progress(request), request_text.standing(request)]
    numbers = [*request_text.bars(request, marks), Text(), *folded(texts, panel)]
    notes = folded([whole.legend] * bool(whole.legend), width, "dim")
    picture = picture_of(request, marks, width, height - len(notes) - 1) or whole
    note = request_text.beyond(request, picture)
    lines = _joined(picture.lines, numbers, whole.width + GAP)
    return lines + notes + folded([note] * bool(note), width)


def _below(request: AdviceRequest, marks: Marks, whole: TextPicture | None, width: int, height: int) -> list[Text]:
    """The picture with the numbers below it; numbers are dropped if the picture would have too few rows."""
    brief = width < BRIEF
    parts: Parts = {
        "legend": folded([whole.legend] if whole and whole.legend else [], width, "dim"),
        "note": [],
        "moves": packed(request_text.moves(request, marks), width),
        "choice": folded(filter(None, [request_text.choice(request, marks, brief)]), width),
        "progress": folded(request_text.progress(request, brief), width, "dim"),
        "standing": folded([request_text.standing(request, brief)], width, "dim"),
    }
    whole = whole or TextPicture([])
    if whole.is_fixed and len(whole.lines) + len(parts["moves"]) > height:
        return [*whole.lines, *_all(parts)]  # it scrolls in any case
    picture = whole
    for dropped in (None, *DROPPED):
        if dropped is not None:
            parts[dropped] = []
        picture = _under_its_note(request, marks, whole, parts, width, height)
        fits = len(picture.lines) + len(_all(parts)) <= height
        enough = ROWS_WITH_LEGEND if dropped is None else FEWEST_ROWS
        if fits and len(picture.lines) >= min(enough, len(whole.lines)):
            break
    return [*picture.lines, *_all(parts)]


def _all(parts: Parts) -> list[Text]:
    return [line for lines in parts.values() for line in lines]


def _under_its_note(
    request: AdviceRequest, marks: Marks, whole: TextPicture, parts: Parts, width: int, height: int
) -> TextPicture:
    """The picture that fits beside the numbers and its own note, which is the longer the less the picture shows."""
    picture, parts["note"] = whole, []
    for _ in range(4):
        picture = picture_of(request, marks, width, height - len(_all(parts))) or whole
        note = request_text.beyond(request, picture, width < BRIEF)
        parts["note"] = folded([note] * bool(note), width)
        if len(picture.lines) + len(_all(parts)) <= height:
            break
    return picture
