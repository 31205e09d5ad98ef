"""The order of the transfers on the teaching page: which part may be moved next, and the work so far as bars."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from lab.seat.page.page_question import progress_of
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Move, robot_activities
from lab.sequencing.cell.stations import ROBOT
from lab.sequencing.methods.srl_advised import SequenceRequest
from lab.sequencing.simulate.run import Run

Json = dict[str, Any]


def order_of(request: SequenceRequest) -> Json:
    """Where the work stands, which moves are allowed, which one the learner would make, and why it asks."""
    run = request.run
    return {
        "kind": "order",
        "title": f"Episode {request.episode}, {run.now_s:.0f} s: the robot is at {run.cell.names[run.robot]}",
        "at": [],
        "own": request.own,
        "moves": [_allowed(run, decision) for decision in request.allowed],
        "why": str(request.why),
        "undoable": False,
        "picture": [],
        **progress_of(request.improvement_rate, request.current_mean, request.previous_mean),
    }


def _allowed(run: Run, decision: int) -> Json:
    option, part = run.option(decision), part_of(decision, run.cell.parts)
    assert option is not None  # it is allowed
    name = run.cell.part_name(part) + ("'s pallet" if option.carries == "pallet" else "")
    wait_s = max(0.0, run.ready_s[part - 1] - run.now_s) if option.waits else 0.0
    names = run.cell.names
    return {
        "action": decision,
        "label": name,
        "from": names[option.origin],
        "to": names[option.target],
        "ready_s": round(wait_s, 1),
        "direction": None,
    }


@dataclass
class Follower:
    """The moves of the episode that is asked about, made out from the questions: between two of them only one way leads.

    A step that nobody is asked about is one without a choice. `moves` is [] when the way here cannot be made out.
    """

    moves: list[Move] = field(default_factory=list)
    _run: Run | None = None
    _episode: int = 0

    def follow(self, request: SequenceRequest) -> None:
        """Come to where the request is."""
        if self._run is None or request.episode != self._episode:
            self._run, self._episode, self.moves = Run(request.run.cell, request.run.times), request.episode, []
        run = self._run
        while not _same(run, request.run):
            allowed = run.allowed()
            if len(allowed) != 1:
                self._run, self.moves = None, []
                return
            self.moves.append(run.move(allowed[0]))

    def take(self, decision: int) -> None:
        """The decision that followed the last request."""
        if self._run is not None:
            self.moves.append(self._run.move(decision))


def _same(one: Run, other: Run) -> bool:
    return one.now_s == other.now_s and one.locations == other.locations


def bars_of(moves: Sequence[Move], now_s: float | None = None) -> Json:
    """The work as rows of bars [row, kind, part, start, end] in seconds: the robot, and each machine that was given work.

    now_s: when the last move was made, by default when it ended.
    """
    bars: list[list[Any]] = []
    rows = [ROBOT]
    for number, move in enumerate(moves):
        bars += _robot_bars(move)
        if move.process_s > 0:
            rows += [move.target] if move.target not in rows else []
            bars += _machine_bars(moves, number)
    end_s = max((bar[4] for bar in bars), default=0.0)
    last_s = moves[-1].drop_s if moves else 0.0
    return {"rows": rows, "bars": bars, "now_s": last_s if now_s is None else now_s, "end_s": end_s}


def _robot_bars(move: Move) -> list[list[Any]]:
    return [[ROBOT, did.kind, move.part, _s(did.start_s), _s(did.end_s)] for did in robot_activities(move)]


def _machine_bars(moves: Sequence[Move], number: int) -> list[list[Any]]:
    """What a machine does with the part that a move has brought: it works, and it is blocked until the part is fetched."""
    brought = moves[number]
    done_s = brought.drop_s + brought.process_s
    fetched = next((m for m in moves[number + 1 :] if m.part == brought.part and m.origin == brought.target), None)
    bars = [[brought.target, "process", brought.part, _s(brought.drop_s), _s(done_s)]]
    if fetched is not None and fetched.pick_s > done_s:
        bars.append([brought.target, "blocked", brought.part, _s(done_s), _s(fetched.pick_s)])
    return bars


def _s(seconds: float) -> float:
    return round(seconds, 2)
