"""The operator's console on the page: what it steers, and the documents that say where the run stands."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Protocol

from lab.production.controls import Controls, StopKind
from lab.production.operation.commands import Done
from lab.production.run_status import RunStatus
from lab.seat.event_text import PHASES
from lab.seat.order_text import OrderMove, move_of, title
from lab.sequencing import BESIDE_METHODS
from lab.sequencing.cell.schedule import Activity, Move, robot_activities
from lab.sequencing.cell.stations import ROBOT
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run
from lab.teaching.events import Event, MoveMade, PartLost, PlanMade, SkillBegan

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


# ---- page console -----------------------------------------------------------------------------------------------------


MOST_DONE = 20  # commands that are shown with what came of them
ONLOOKER = "onlooker"  # who stops in an emergency without having the seat
PARTS = ("run", "plan", "measured")
STOP = "stop"


class Console(Protocol):
    """What a page steers: all but `hear` is called in the server's thread.

    words: the commands that are taken; names: what may follow some of them. busy: the command under way, "" for none.
    done: what came of all that was said.
    """

    @property
    def controls(self) -> Controls: ...
    @property
    def words(self) -> Sequence[str]: ...
    @property
    def names(self) -> Mapping[str, Sequence[str]]: ...
    @property
    def done(self) -> Sequence[Done]: ...
    @property
    def busy(self) -> str: ...

    def now(self) -> RunStatus:
        """Where the run stands."""

    def say(self, line: str, by: str) -> Done | None:
        """Take a command; returns at once."""

    def watched(self, pages: int) -> None:
        """So many pages are open."""

    def hear(self, event: Event) -> None:
        """What happens, in the session's thread."""


def changed_by(event: Event) -> tuple[str, ...]:
    """The parts of the page's document that an event has changed."""
    match event:
        case PlanMade():
            return ("run", "plan")
        case MoveMade() | PartLost() | SkillBegan():
            return ("run", "measured")
    return ("run",)


def run_of(console: Console | None) -> Json | None:
    """Where the run stands, and what may be said; without what has an own part."""
    if console is None:
        return None
    status, done = console.now(), console.done
    return {
        "now_s": status.now_s,
        "phase": status.phase,
        "phase_words": PHASES.get(status.phase, status.phase),
        "words": status.words,
        "next_station": status.next_station,
        "move": status.move,
        "moves": status.moves,
        "finished": status.finished,
        "parts": [asdict(part) for part in status.parts],
        "machines": [asdict(machine) for machine in status.machines],
        "trouble": [asdict(one) for one in status.trouble],
        "commands": list(console.words),
        "names": {word: list(names) for word, names in console.names.items()},
        "busy": console.busy,
        "said": len(done),
        "done": [asdict(one) for one in done[-MOST_DONE:]],
    }


def plan_of(console: Console | None) -> Json | None:
    """The plan in use: of the robot and the machines, without the parts' own rows."""
    status = None if console is None else console.now()
    if status is None or status.plan is None:
        return None
    plan, rows = status.plan, {ROBOT, *(machine.station for machine in status.machines)}
    return {
        "makespan_s": plan.makespan_s,
        "gap": plan.gap,
        "proven": plan.proven,
        "why": plan.why,
        "by": BESIDE_METHODS.get(plan.method, plan.method),
        "rows": [chart_row(one) for one in plan.rows if one.resource in rows],
    }


def measured_of(console: Console | None) -> list[Json]:
    """What was done so far, without what machines are doing now."""
    return [] if console is None else [chart_row(one) for one in console.now().measured]


def held_of(console: Console) -> Json:
    """What stops the run now, what may be said next ("": nothing has to be), and the pace."""
    controls = console.controls
    held = controls.held
    if held is None:
        return {"kind": "", "speed": controls.speed}
    after = "reset" if held.kind is StopKind.EMERGENCY else "go"
    return {"kind": held.kind, "why": held.why, "by": held.by, "next": after, "speed": controls.speed}
