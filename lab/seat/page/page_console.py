"""The operator's console on the page: its interface to a run, and the JSON documents of questions, work and status."""

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
    """The page's document of a question on the order: state of the work, allowed moves, and the learner's own choice."""
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
    """The moves of the current episode up to the question."""
    run = Run(request.run.cell, request.run.times)
    for decision in request.made:
        run.move(decision)
    return run.moves


def bars_of(moves: Sequence[Move], now_s: float | None = None) -> Json:
    """A chart's rows and activities for these moves: of the robot, and of each machine that has received work.

    now_s: the current time [s]; by default the end of the last move.
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
    """The activities of the machine to which a move brought a part: processing, then blocked until the part is fetched."""
    brought = moves[number]
    done_s = brought.drop_s + brought.process_s
    fetched = next((m for m in moves[number + 1 :] if m.part == brought.part and m.origin == brought.target), None)
    where = brought.target
    bars = [Activity(where, "process", brought.part, where, where, brought.drop_s, done_s)]
    if fetched is not None and fetched.pick_s > done_s:
        bars.append(Activity(where, "blocked", brought.part, where, where, done_s, fetched.pick_s))
    return [chart_row(bar) for bar in bars]


def chart_row(activity: Activity) -> Json:
    """An activity as a record of the page's chart."""
    return asdict(activity) | {"start_s": round(activity.start_s, 2), "end_s": round(activity.end_s, 2)}


# ---- the console of a run ---------------------------------------------------------------------------------------------


MOST_DONE = 20  # latest commands that are shown with their results
ONLOOKER = "onlooker"  # recorded as the author of an emergency stop from a page without the seat
PARTS = ("run", "plan", "measured")
STOP = "stop"


class Console(Protocol):
    """The interface through which a page steers a run; all but `hear` is called in the server's thread.

    words: the accepted commands; names: the names that may follow some of them. busy: the command under way, "" for none.
    done: all commands with their results.
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
        """The status of the run."""

    def say(self, line: str, by: str) -> Done | None:
        """Accept a command; returns at once, with its result if that is known already."""

    def watched(self, pages: int) -> None:
        """Take note of the number of open pages."""

    def hear(self, event: Event) -> None:
        """Take over an event, in the session's thread."""


def changed_by(event: Event) -> tuple[str, ...]:
    """The parts of the page's document that an event has changed."""
    match event:
        case PlanMade():
            return ("run", "plan")
        case MoveMade() | PartLost() | SkillBegan():
            return ("run", "measured")
    return ("run",)


def run_of(console: Console | None) -> Json | None:
    """The status of the run and the accepted commands, without what other parts of the document hold."""
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
        "trouble": [asdict(trouble) for trouble in status.trouble],
        "commands": list(console.words),
        "names": {word: list(names) for word, names in console.names.items()},
        "busy": console.busy,
        "said": len(done),
        "done": [asdict(result) for result in done[-MOST_DONE:]],
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
        "rows": [chart_row(row) for row in plan.rows if row.resource in rows],
    }


def measured_of(console: Console | None) -> list[Json]:
    """The activities so far, without those that machines are carrying out now."""
    return [] if console is None else [chart_row(activity) for activity in console.now().measured]


def held_of(console: Console) -> Json:
    """What holds the run now, the command that is required next ("" for none), and the pace."""
    controls = console.controls
    held = controls.held
    if held is None:
        return {"kind": "", "speed": controls.speed}
    after = "reset" if held.kind is StopKind.EMERGENCY else "go"
    return {"kind": held.kind, "why": held.why, "by": held.by, "next": after, "speed": controls.speed}
