"""The order of a job's transfers: as an operator gives it, as people advise it, and as a method finds it alone."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lab.advice.advising import through
from lab.advice.advisors import EXTERNAL, MODEL, PEOPLE, AdvisorName, make_advisor
from lab.advice.entries import Closed
from lab.advice.journal import Again, Journal
from lab.advice.order_level import OrderLevel, signature_of
from lab.advice.receipt import receipt
from lab.errors import BadInput, counted
from lab.learning.requests import Ask
from lab.learning.session_events import EpisodeEnded
from lab.learning.session_events import Event as SessionEvent
from lab.learning.settings import GateSettings
from lab.production.cyclic_order import cyclic_order
from lab.production.order_learning import OrderLearning, bound_shares
from lab.sequencing import deferred, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, MAKESPAN, cost
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.cyclic.cycle import check_cyclic
from lab.sequencing.cyclic.line import lines
from lab.sequencing.cyclic.several import Rhythm
from lab.sequencing.methods.exact import Optimum, optimum
from lab.sequencing.methods.portfolio import BestKnown, best_known
from lab.sequencing.search import SAME, Reference, Search, SequenceResult
from lab.sequencing.simulate.follow import follow, waits_in
from lab.sequencing.simulate.rest import rest_of
from lab.sequencing.simulate.run import NO_WAIT, Run, branch
from lab.tasks.sequencing import Sequencing, search_for
from lab.teaching.events import (
    ORDER,
    LessonEvent,
    OrderChosen,
    OrderLearned,
    SequenceFound,
    SequencingBegan,
    Tell,
    unheard,
)
from lab.teaching.lesson_sessions import TellingAdvisor

NOBODY = AdvisorName.of("none")
KeepOrder = Callable[[Cell, str], Journal]  # given the cell and the objective
UNKNOWN = "nothing: CP-SAT has no rule for this objective"
SECOND_OPINION_S = 20.0  # how long CP-SAT may look where A* does not apply
ADVISED, UNADVISED, GIVEN, EXACT, CYCLIC = "advised", "unadvised", "given", "exact", "cyclic"  # by whom an order is


def checked_order(cell: Cell, words: str, where: str = "--order") -> tuple[int, ...]:
    """A whole order as it is typed, "1 2 1 3" or "1,2,1,3", as a sequence.

    A number is a decision as in a sequence (see `Run`): the part's number, + the number of parts for its second choice.
    BadInput for words that are no moves, for the first move that may not be made, with the reason, and for what is left.
    """
    typed = words.replace(",", " ").split()
    if not typed:
        raise BadInput(f"{where} '{words}': no moves; wanted part numbers such as 1 2 1")
    for position, word in enumerate(typed, 1):
        if not (word.isascii() and word.isdigit()) or len(word) > 6:
            raise BadInput(f"{where} '{words}': move {position} '{word}' is no part's number, 1 to {cell.parts}")
    sequence = tuple(map(int, typed))
    moves_from(Run(cell), sequence, f"{where} '{words}'")
    return sequence


def check_order(cell: Cell, words: str | None, mix: Sequence[str]) -> None:
    """Raise BadInput for an order in words, or for a cycle of a mix of products, that no durations make possible.

    cell: not timed yet (see `durations.untimed`). mix: empty, there is no cycle.
    """
    if words is not None:
        checked_order(cell, words)
    if mix:
        check_cyclic(cell, mix)
        next(lines(cell, mix))


def moves_from(start: Run, sequence: Sequence[int], what: str) -> list[Move]:
    """The moves of a sequence from where a run is to the end of the work; the run stays where it is. BadInput, of `what`."""
    run, moves, waits = branch(start), list[Move](), waits_in(start, sequence)
    for position, decision in enumerate(sequence, 1):
        if reason := run.refusal(decision):
            raise BadInput(f"{what}: move {position} '{decision}': {reason}; {_allowed(run)}")
        moves.append(run.move(decision, waits[position - 1] if waits else NO_WAIT))
    if not run.done:
        part = run.finished_s.index(None) + 1
        station = run.cell.names[run.cell.positions[run.locations[part - 1]].station]
        made = counted(len(moves), "move")
        raise BadInput(
            f"{what}: it ends after {made}, but {run.cell.part_name(part)} is still at '{station}'; {_allowed(run)}"
        )
    return moves


def _allowed(run: Run) -> str:
    """What may be moved now, in words."""
    if run.done:
        return "all parts are done"
    names = [f"{decision} ({run.cell.part_name(part_of(decision, run.cell.parts))})" for decision in run.allowed()]
    return f"allowed here: {', '.join(names)}" if names else "nothing can move any more"


@dataclass(frozen=True)
class OrderAdvice:
    """Whose word counts on the order: one that is given whole, or whom SRL may ask which part to move next, and when.

    given: the words of an order, "" for none. cyclic: the order is to repeat the shortest cycle, of at most parts_per_cycle
    parts, and nobody is asked. people: those behind such names as "terminal"; keep: gives the journal of what they say, by
    default one that is not written.
    """

    given: str = ""
    advisor: AdvisorName = NOBODY
    gate: str = "ccrl"
    people: Mapping[str, Ask] = field(default_factory=dict)
    keep: KeepOrder = lambda cell, objective: Journal()
    cyclic: bool = False
    parts_per_cycle: int | None = None


def person_of(names: Sequence[str]) -> AdvisorName:
    """Who of a run's advisors is asked about the order, too: the first person, or else language model; or else nobody."""
    asked = [name for name in names if name in PEOPLE] + [name for name in names if name.startswith(MODEL)]
    return AdvisorName.of(asked[0]) if asked else NOBODY


@dataclass(frozen=True)
class Ordered:
    """The order that is used, and by whom it is; what each order that was found costs; what the advice was worth.

    learning: how the order that is used was found, or, where that one was not looked for, the one beside it.
    receipt: None where nobody was asked and nothing was given; `guided_best` in it: the cheapest episode with advice. rhythm:
    what the order repeats, where that was asked for.
    """

    found: SequenceResult
    proven: Optimum
    used: str
    costs: dict[str, float]
    learning: OrderLearning
    receipt: dict[str, Any] | None = None
    rhythm: Rhythm | None = None


def ordered(cell: Cell, settings: Sequencing, advice: OrderAdvice, seed: int, tell: Tell = unheard) -> Ordered:
    """The order of a job beside its proven optimum or bound: the given one, or the best of those that were found.

    A cyclic order is used like a given one. With advice, SRL looks for one with it, and the settings' method for one alone; what
    the exact search finds stands beside them, and is used where the method is `exact`. Of orders that cost the same the advised
    one is used, then the method's; one of SRL that no move was advised to is no advised one, and comes after them.
    Raises BadInput as `checked_order`, `advised_srl` and
    `cyclic_order` do, WorkFailed and KeyboardInterrupt.
    """
    search, proven = search_for(settings), optimum(cell)
    is_timed = search.objective == MAKESPAN
    known = Reference(proven.bound_s, proven.proven, "A*") if is_timed else reference(cell, search.objective)
    orders = dict[str, SequenceResult]()
    if advice.given:
        taken = checked_order(cell, advice.given)
        own = cost(follow(cell, taken), search.objective)
        orders[GIVEN] = SequenceResult(taken, own, (own,))
    rhythm = None
    if advice.cyclic:
        rhythm, repeated = cyclic_order(cell, seed, advice.parts_per_cycle)
        own = cost(follow(cell, repeated.sequence), search.objective)
        orders[CYCLIC] = SequenceResult(repeated.sequence, own, (own,))
    said: dict[str, Any] = {}
    asked: deferred.AdvisedResult | None = None
    if advice.advisor.row != "none" and not orders:
        asked, said = _with_advice(cell, search, advice, seed, known, tell)
    if asked is not None and asked.advised:
        orders[ADVISED] = asked
    alone = search
    if asked is None:  # else the page goes on showing what people were asked about
        tell(SequencingBegan(search.episodes, known, method=settings.method))
        alone = replace(search, on_episode=tell)
    orders[settings.method] = find_sequence(cell, settings.method, alone, seed)
    if asked is not None and not asked.advised:
        orders[UNADVISED] = asked
    used = next((name for name in (GIVEN, CYCLIC) if name in orders), None) or _cheapest(orders)
    costs = {name: order.cost for name, order in orders.items()}
    if is_timed and len(orders) > 1 and proven.sequence:
        costs[EXACT] = proven.cost
    learned = settings.method if used in (GIVEN, CYCLIC) else used
    shares = bound_shares(cell, learned, search, seed)
    learning = OrderLearning(learned, search.objective, orders[learned], known, shares)
    tell(SequenceFound(orders[used], known, cell.parts, used))
    tell(OrderLearned(tuple(learning.lines())))
    if len(orders) == 1:
        return Ordered(orders[used], proven, used, costs, learning)
    tell(OrderChosen(used, costs, search.objective))
    worth = {"used": used, "costs": costs, "objective": search.objective, "bound": known.bound}
    return Ordered(orders[used], proven, used, costs, learning, worth | said, rhythm)


def reference(cell: Cell, objective: str, time_limit_s: float = SECOND_OPINION_S, workers: int = 1) -> Reference:
    """The proven optimum, or the best bound, and the best order that it took to find it (see `best_known`)."""
    if objective not in BUILT_IN:
        return Reference(0.0, False, UNKNOWN, unit_of(objective))
    return reference_of(cell, objective, best_known(cell, objective, time_limit_s, workers=workers))


def reference_of(cell: Cell, objective: str, found: BestKnown) -> Reference:
    """The optimum or bound of a cell that is known, as a reference for other sequences."""
    by = found.bound_by if objective in BUILT_IN else UNKNOWN
    return Reference(found.bound, found.proven, by, unit_of(objective), found.sequence, found.found_by)


def unit_of(objective: str) -> str:
    """The unit of a cost, to be written behind it."""
    return "" if objective == "tardy-parts" else " s"


def _cheapest(orders: Mapping[str, SequenceResult]) -> str:
    """The first of the cheapest orders, by who found it."""
    least = min(order.cost for order in orders.values())
    return next(name for name, order in orders.items() if order.cost <= least + SAME)


def _with_advice(
    cell: Cell, search: Search, advice: OrderAdvice, seed: int, known: Reference, tell: Tell
) -> "tuple[deferred.AdvisedResult, dict[str, Any]]":
    """SRL's order with advice, and its receipt; it begins again each time an answer is taken back."""
    is_kept = advice.advisor.row in EXTERNAL
    journal = advice.keep(cell, search.objective) if is_kept else Journal()
    try:
        while True:
            tell(SequencingBegan(search.episodes, known, GateSettings(advice.gate, spare_best=True), "srl"))
            try:
                found = advised_session(cell, search, advice, (seed, 0), journal, tell)
                break
            except Again:
                journal.rewind()
        bound = known.bound if known.proven else None
        is_best = bound is not None and found.cost <= bound + SAME
        journal.closes(Closed(search.episodes, found.cost, bound, is_best, saved_as=""))
    finally:
        journal.close()
    made = receipt(journal.entries, None, None, certain=False)
    guided = [entry.steps for entry in journal.entries if isinstance(entry, EpisodeEnded) and entry.guided]
    return found, made.to_json() | {"lines": made.lines(), "guided_best": min(guided, default=None)}


def advised_session(
    cell: Cell, search: Search, advice: OrderAdvice, seeds: tuple[int, int], journal: Journal | None, tell: Tell
) -> "deferred.AdvisedResult":
    """The result of a session of SRL with advice; seeds: the command's, and the session's number.

    Raises Again, and as `advised_srl`.
    """
    seed, session = seeds
    rng, own = (np.random.default_rng([seed, stream, session]) for stream in (2, 3))
    people, signature = through(journal, advice.people), signature_of(cell, search.objective)
    advisor = make_advisor(advice.advisor, OrderLevel(cell, own, people, search.episodes, signature))
    if advisor is not None:
        advisor = TellingAdvisor(advisor, tell)

    def hear(event: SessionEvent) -> None:
        tell(LessonEvent(ORDER, event, True if journal is None else journal.tell(event)))

    return deferred.advised_srl(cell, search, rng, GateSettings(advice.gate, spare_best=True), advisor, hear)


@dataclass(frozen=True)
class TypedOrder:
    """A sequence that may be carried out: when it ends [s] and how much longer that is than the proven optimum or bound.

    gap: a fraction; proven: against an optimum, not only a bound.
    """

    sequence: tuple[int, ...]
    schedule: Schedule
    gap: float
    proven: bool

    @property
    def words(self) -> str:
        """What came of the check, for people."""
        against = "proven optimum" if self.proven else "proven bound"
        longer = (
            f"{100 * self.gap:.1f} % longer than the {against}" if self.gap > 1e-9 else f"as short as the {against}"
        )
        return f"{counted(len(self.sequence), 'move')}, {self.schedule.makespan_s:.1f} s: {longer}"


def checked(state: Run, sequence: Sequence[int]) -> TypedOrder:
    """A typed sequence from a state on, to the end of the work. BadInput names the first move that may not be made, and why."""
    moves = moves_from(state, sequence, "order")
    schedule = Schedule.from_moves(state.cell, moves, sequence)
    rest = rest_of(state, fallback_s=float(np.nanmax(state.cell.empty_s, initial=0.0))).cell
    proven = optimum(state.cell if rest is None else rest)
    gap = proven.gap(schedule.makespan_s - state.now_s)
    return TypedOrder(tuple(sequence), schedule, gap, proven.proven)
