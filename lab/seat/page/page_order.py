"""The order of the transfers on the teaching page: which part may be moved next, and the work so far as bars."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from lab.seat.order_text import OrderMove, move_of, title
from lab.sequencing.cell.schedule import Activity, Move, robot_activities
from lab.sequencing.cell.stations import ROBOT
from lab.sequencing.request import SequenceRequest
from lab.sequencing.simulate.run import Run

Json = dict[str, Any]


def order_of(request: SequenceRequest) -> Json:
    """Where the work stands, which moves are allowed, and what it would do."""
    own = move_of(request, request.own)
    return {
        "kind": "order",
        "title": title(request),
        "at": [],
        "moves": [_allowed(move_of(request, decision)) for decision in request.allowed],
        "would": f"Alone it would move {own.name} from {own.origin} to {own.target}.",
        "picture": [],
        "shapes": [],
    }


def _allowed(move: OrderMove) -> Json:
    return {
        "action": move.decision,
        "label": move.name,
        "from": move.origin,
        "to": move.target,
        "ready_s": round(move.wait_s, 1),
        "direction": None,
    }


def made_until(request: SequenceRequest) -> list[Move]:
    """The moves of the episode that is asked about, until now."""
    run = Run(request.run.cell, request.run.times)
    for decision in request.made:
        run.move(decision)
    return run.moves


def bars_of(moves: Sequence[Move], now_s: float | None = None) -> Json:
    """The work as the rows of a chart and its activities: of the robot, and of each machine that was given work.

    now_s: when the last move was made, by default when it ended.
    """
    bars: list[Json] = []
    rows = [ROBOT]
    for number, move in enumerate(moves):
        bars += [chart_row(did) for did in robot_activities(move)]
        if move.process_s > 0:
            rows += [move.target] if move.target not in rows else []
            bars += _machine_bars(moves, number)
    end_s = max((bar["end_s"] for bar in bars), default=0.0)
    last_s = moves[-1].drop_s if moves else 0.0
    return {"rows": rows, "measured": bars, "now_s": last_s if now_s is None else now_s, "end_s": end_s}


def _machine_bars(moves: Sequence[Move], number: int) -> list[Json]:
    """What a machine does with the part that a move has brought: it works, and it is blocked until the part is fetched."""
    brought = moves[number]
    done_s = brought.drop_s + brought.process_s
    fetched = next((m for m in moves[number + 1 :] if m.part == brought.part and m.origin == brought.target), None)
    where = brought.target
    bars = [Activity(where, "process", brought.part, where, where, brought.drop_s, done_s)]
    if fetched is not None and fetched.pick_s > done_s:
        bars.append(Activity(where, "blocked", brought.part, where, where, done_s, fetched.pick_s))
    return [chart_row(bar) for bar in bars]


def chart_row(one: Activity) -> Json:
    """An activity as the page's chart takes it."""
    return asdict(one) | {"start_s": round(one.start_s, 2), "end_s": round(one.end_s, 2)}
