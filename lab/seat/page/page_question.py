"""What the learner asks, as the teaching page shows it: plain data of one step of a lesson."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from lab.learning.requests import AdviceRequest, Request
from lab.seat.grid_text import Marks, safe_ansi
from lab.seat.grid_views import StateWords
from lab.seat.page.page_grid import directions, spot
from lab.seat.page.page_order import order_of
from lab.seat.request_text import choice, leads, outcome
from lab.sequencing.request import SequenceRequest

if TYPE_CHECKING:
    from rich.text import Text

Json = dict[str, Any]


def question_of(request: Request, known: StateWords | None = None) -> Json:
    """Where the learner is, what may be done, what it would do, and why it asks; known: what says the first in words."""
    if isinstance(request, AdviceRequest):
        shown = step_of(request, known)
    else:
        assert isinstance(request, SequenceRequest)
        shown = order_of(request)
    lately = request.improvement
    return shown | {
        "own": request.own,
        "why": str(request.reason or ""),
        "rate": None if lately is None else lately.rate,
        "current": None if lately is None else lately.current_mean,
        "previous": None if lately is None else lately.previous_mean,
    }


def step_of(request: AdviceRequest, known: StateWords | None = None) -> Json:
    """Where in the table the learner is, what it may do, and how sure it is."""
    mdp, state = request.mdp, request.state
    return {
        "kind": "step",
        "title": f"Episode {request.episode}, step {request.step}"
        + (f": at {mdp.state_label(state)}" if known is None else ""),
        "where": "" if known is None else known.in_words(state),
        "at": spot(mdp, state),
        "moves": moves_of(request, () if known is None else known.moves_in_words()),
        "would": choice(request, Marks()),
        "temperature": request.temperature,
        "selection": request.selection,
        "picture": picture_of(request.picture),
        "shapes": request.shapes,
    }


def said_of(request: Request, action: int | None) -> str:
    """What was answered to a request, and what came of it where that is out of the ordinary; None: nothing was said."""
    if isinstance(request, AdviceRequest):
        marks, done = Marks(), request.own if action is None else action
        where = leads(request, done)
        move = marks.named(request.mdp, done) + (f"; that {where}" if where else "")
    else:
        move = f"move {request.own if action is None else action}"
    return f"Left to the learner: it chose {move}." if action is None else f"The answer was {move}."


def moves_of(request: AdviceRequest, sizes: Sequence[str] = ()) -> list[Json]:
    """Each action: its label, how far it goes, where it points, the learner's chance and value of it, where it leads to."""
    mdp, state = request.mdp, request.state
    rows = zip(mdp.action_labels, directions(mdp), request.chances, request.q[state], strict=True)
    return [
        {
            "action": action,
            "label": label,
            "size": sizes[action] if sizes else "",
            "direction": direction,
            "chance": round(chance, 3),
            "value": float(f"{value:.4g}"),
            "leads": "" if request.picture else outcome(request, action),
        }
        for action, (label, direction, chance, value) in enumerate(rows)
    ]


def picture_of(drawing: str) -> list[list[list[str]]]:
    """An environment's own drawing: lines of [text, classes], such as "bg-1 bold"; [] for none.

    Colours are those of a terminal: 1 red, 2 green, 3 yellow, 4 blue, 5 magenta, 6 cyan, 7 white.
    """
    if not drawing.strip():
        return []
    return [_runs(line) for line in safe_ansi(drawing).split("\n", allow_blank=True)]


def _runs(line: "Text") -> list[list[str]]:
    """A line of text as stretches of one style."""
    edges = {0, len(line.plain)} | {edge for span in line.spans for edge in (span.start, span.end)}
    return [[line.plain[start:end], _classes(line, start)] for start, end in pairwise(sorted(edges))]


def _classes(line: "Text", at: int) -> str:
    found: dict[str, str] = {}
    for span in line.spans:
        style = span.style
        if isinstance(style, str) or not span.start <= at < span.end:
            continue
        found |= {"bold": "bold"} if style.bold else {}
        for kind, color in (("fg", style.color), ("bg", style.bgcolor)):
            if color is not None and color.number is not None and color.number < 16:
                found[kind] = f"{kind}-{color.number % 8}"
    return " ".join(sorted(found.values()))
