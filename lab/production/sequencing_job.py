"""The order of the robot's transfers: of a task, over measured durations, or of a cell file; what `lab sequence` does."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lab.advice.advisors import EXTERNAL, AdvisorName
from lab.advice.entries import Closed
from lab.advice.journal import Again, Journal
from lab.errors import BadInput, unknown
from lab.interrupts import uninterrupted
from lab.learning.requests import Ask
from lab.learning.settings import GateSettings
from lab.production import deferred
from lab.production.any_time import CTRL_C, MethodSession, SearchPlan, SearchResults, looked_for
from lab.production.order import NOBODY, KeepOrder, OrderAdvice, advised_session
from lab.production.order_policy import (
    DECIDES,
    LEARNS,
    PREFIX,
    check_keeping,
    kept_policy,
    learned_policy,
    policy_named,
    practice_cells,
)
from lab.sequencing import SEQUENCERS, carried_reaction, check_method, find_sequence
from lab.sequencing import deferred as methods
from lab.sequencing.cell.cell import EVERY_PLAN, Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import (
    MAKESPAN,
    OBJECTIVES,
    WITH_DUE_TIMES,
    check_objective,
    cost,
    stuck_cost,
)
from lab.sequencing.cell.schedule import check_table, rows_of, write_table
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.methods.shared import NO_LIMITS, Limits
from lab.sequencing.search import SAME, LearnedSequence, Reference, Search, SequenceResult
from lab.sequencing.simulate.follow import follow, simulate, steps
from lab.sequencing.simulate.several import replicate
from lab.statistics import interval
from lab.tasks.cell_file import CellFile, order_from_word, toast_case
from lab.tasks.grid_world import GridWorld
from lab.tasks.instances import InstanceRequest
from lab.tasks.sequencing import Sequencing, policy_record, search_for
from lab.tasks.task import Task
from lab.tasks.task_file import load_beside
from lab.teaching.events import Event, PhaseBegan, SequenceFound, Tell, unheard
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.canvas import check_picture
from lab.view.gantt import gantt
from lab.view.sequencing_plots import sequence_plot

PORTFOLIO = "portfolio"  # the method of which it is told what in it found the order
REPLICATIONS = 200  # drawn episodes in which a list and a policy are compared
PLANNED = 2000  # of a policy that plans at every decision so many by parts squared, at least FEWEST: it takes its time
FEWEST = 20


@dataclass(frozen=True)
class SequencingOptions:
    """What `lab sequence` is asked for; None: as the file says. advisor: who may be asked which part to move next.

    keep: gives the journal of what people say, by default one that is not written. durations: those of a task's moves
    (`Durations.to_json`), None: they are measured. layout, robots: beside an instance file (see `InstanceRequest`).
    policy: the file, or the name in the toolbox, of the policy that the method `carried` decides by (None: what ships), or that
    `srl-linear` begins with; policy_from: the option that names it. seconds, gap: when to end early (see `Limits.of`).
    practice: names of further cells in which `srl-linear` learns, separated by commas; keep_policy: the name or file under which
    its policy is kept.
    A method "policy:NAME" stands for `carried` by the policy NAME (see `by_policy`).
    """

    method: str | None = None
    episodes: int | None = None
    objective: str | None = None
    sessions: int = 1
    seed: int = 0
    stochastic: bool = False
    advisor: AdvisorName = NOBODY
    gate: str = "ccrl"
    people: Mapping[str, Ask] = field(default_factory=dict)
    keep: KeepOrder = lambda cell, objective: Journal()
    parts: str | None = None
    durations: Mapping[str, Any] | None = None
    layout: Path | None = None
    robots: int | None = None
    policy: Path | None = None
    seconds: float | None = None
    gap: float | None = None
    practice: str | None = None
    keep_policy: str | None = None
    policy_from: str = "--policy"

    def by_policy(self) -> "SequencingOptions":
        """The options with a method "policy:NAME" as `carried` and its policy. Raises BadInput beside another policy."""
        if self.method is None or not self.method.startswith(PREFIX):
            return self
        if not (name := self.method.removeprefix(PREFIX)):
            raise BadInput(
                f"--method {PREFIX}: no policy: wanted {PREFIX}NAME, a name that --keep-policy kept, or its .json file"
            )
        if self.policy is not None:
            raise BadInput(f"--policy {self.policy} beside --method {self.method}: the method names its policy")
        return replace(self, method=DECIDES, policy=Path(name), policy_from="--method")


def sequence_named(
    name: str,
    case: str | None,
    toasts: int | None,
    wanted: SequencingOptions,
    *,
    teacher: Teacher,
    files: dict[str, Path],
) -> dict[str, Any]:
    """The document of `lab sequence` for a name as in `named_cell`; files: what is drawn, by name (see `draw`).

    Raises BadInput as `named_cell` and `sequence_cell` do, and before any work for a file that cannot be drawn.
    """
    for kind, path in files.items():
        check_table(path) if kind == "schedule" else check_picture(path)
    named, box = named_cell(name, case, toasts, wanted, teacher), teacher.toolbox
    document, found = sequence_cell(named.cell, named.settings, wanted, named.chance, tell=teacher.tell, toolbox=box)
    if files:
        draw(named.cell, document, found, files)
    return {"task": named.name} | document


class NamedCell(NamedTuple):
    """A cell file's cell, or a task's over durations measured in simulation, with the settings and the chance of its file."""

    name: str
    cell: Cell
    settings: Sequencing
    chance: Chance


def named_cell(
    name: str,
    case: str | None,
    toasts: int | None,
    wanted: SequencingOptions,
    teacher: Teacher,
    toolbox: Toolbox | None = None,
) -> NamedCell:
    """The cell of that name; a task's skills are learned first. toolbox: of the policies of sequencing, None: the teacher's.

    Raises BadInput for a world and what does not fit its file.
    """
    wanted = wanted.by_policy()
    loaded, case = _loaded(name, case, wanted, toolbox or teacher.toolbox)
    if isinstance(loaded, CellFile):
        cell, chance = ordered_cell(loaded, case, toasts), loaded.chance()
    else:
        cell, chance = measured_cell(loaded, toasts, wanted, teacher), Chance()
    check_objective(wanted.objective or loaded.sequencing.objective, cell)
    return NamedCell(loaded.name, cell, loaded.sequencing, chance)


def check_named(name: str, case: str | None, toasts: int | None, wanted: SequencingOptions, toolbox: Toolbox) -> None:
    """Raises BadInput for what `named_cell` refuses before it measures anything."""
    wanted = wanted.by_policy()
    loaded, case = _loaded(name, case, wanted, toolbox)
    objective = wanted.objective or loaded.sequencing.objective
    if isinstance(loaded, CellFile):
        check_objective(objective, ordered_cell(loaded, case, toasts))
    else:
        loaded.ordered(toasts, wanted.parts)
        _check_due_times(objective)


def _loaded(
    name: str, case: str | None, wanted: SequencingOptions, toolbox: Toolbox
) -> tuple[CellFile | Task, str | None]:
    """The cell file or task of that name, and the case of it that is left to choose. Raises BadInput."""
    if case is not None and name == "toast":
        name, case = toast_case(case), None
    loaded, case = load_beside(name, InstanceRequest(wanted.layout, wanted.robots, case))
    if isinstance(loaded, GridWorld):
        raise BadInput(f"{name}: it is a world, there is nothing to sequence: learn it with lab teach {name}")
    _check_names(wanted, loaded.sequencing, toolbox)
    if isinstance(loaded, CellFile):
        if wanted.parts is not None:
            raise BadInput(f"--parts {wanted.parts}: '{loaded.name}' is a cell: give its order with --case or --toasts")
    elif case is not None:
        which = "toast has I, II and III, a cell its orders"
        raise BadInput(f"case '{case}' (--case): task '{name}' has none; {which}")
    return loaded, case


def _check_names(wanted: SequencingOptions, settings: Sequencing, toolbox: Toolbox) -> None:
    """Raise BadInput, before any work, for an unknown name, and for advice to a method that asks for none."""
    method, objective = wanted.method or settings.method, wanted.objective or settings.objective
    check_method(method)
    if objective not in OBJECTIVES:
        raise unknown("objective", objective, OBJECTIVES, "--objective")
    if wanted.advisor.row != "none" or wanted.gate != SequencingOptions.gate:
        methods.check_gate(wanted.gate)
    if wanted.policy is not None:
        if method not in (DECIDES, LEARNS):
            who = f"only {DECIDES} decides by one, and {LEARNS} begins with one"
            raise BadInput(f"--policy {wanted.policy} with --method {method}: {who}")
        policy_named(str(wanted.policy), toolbox, wanted.policy_from)
    for option, word in (("--practice", wanted.practice), ("--keep-policy", wanted.keep_policy)):
        if word is not None and method != LEARNS:
            raise BadInput(f"{option} {word} with --method {method}: only {LEARNS} learns a policy")
    practice_cells(wanted.practice)
    if wanted.keep_policy is not None:
        check_keeping(wanted.keep_policy, toolbox)
    if wanted.advisor.row != "none" and method != "srl":
        raise BadInput(f"--advisor {wanted.advisor} with --method {method}: only srl asks for advice")
    if Limits.of(wanted.seconds, wanted.gap) != NO_LIMITS and wanted.advisor.row != "none":
        raise BadInput(
            f"--seconds or --gap beside --advisor {wanted.advisor}: a session with advice is as long as its episodes: --episodes"
        )


def ordered_cell(file: CellFile, case: str | None, toasts: int | None) -> Cell:
    """The cell of a file, for its own order, or the one that --case or --toasts asks for."""
    if case is not None and toasts is not None:
        raise BadInput(f"--case {case} and --toasts {toasts}: an order is one or the other")
    return file.cell(order_from_word(file, case) if case is not None else toasts)


def measured_cell(task: Task, toasts: int | None, wanted: SequencingOptions, teacher: Teacher) -> Cell:
    """The cell of a task, once its skills are learned and their durations measured."""
    _check_due_times(wanted.objective or task.sequencing.objective)
    if wanted.durations is not None:
        order = task.ordered(toasts, wanted.parts)
        skills = deferred.SkillSet.of(task, order)
        return deferred.cell_of(task, deferred.Durations.from_json(wanted.durations, skills), order)
    return deferred.teach_all(deferred.prepare(task, task.ordered(toasts, wanted.parts), teacher.seed), teacher).cell


def _check_due_times(objective: str) -> None:
    """Raises BadInput for an objective that needs due times, for a task."""
    if objective in WITH_DUE_TIMES:
        raise BadInput(f"objective '{objective}' (--objective) needs due times, and a task has none: use a cell file")


def sequence_cell(
    cell: Cell,
    settings: Sequencing,
    wanted: SequencingOptions,
    chance: Chance,
    *,
    tell: Tell = unheard,
    toolbox: Toolbox | None = None,
) -> tuple[dict[str, Any], list[SequenceResult]]:
    """The document of `lab sequence`, and the results of the method's sessions on a cell, beside a lower bound or a proof.

    The sessions are run from their beginning each time an answer is taken back. toolbox: of the policies of sequencing, None: the
    user's own. Raises BadInput for an unknown method or objective, and for an objective that the cell has no times for.
    """
    wanted, box = wanted.by_policy(), Toolbox() if toolbox is None else toolbox
    _check_names(wanted, settings, box)
    method = wanted.method or settings.method
    search = search_for(
        settings,
        episodes=wanted.episodes,
        objective=wanted.objective,
        chance=chance if wanted.stochastic and SEQUENCERS[method].drawn else NO_CHANCE,
    )
    begun = None if wanted.policy is None else policy_named(str(wanted.policy), box, wanted.policy_from)
    search = replace(search, policy=begun, practice=practice_cells(wanted.practice))
    check_objective(search.objective, cell)
    tell(PhaseBegan("sequence", wanted.sessions))
    journal = wanted.keep(cell, search.objective) if wanted.advisor.row in EXTERNAL else None
    plan = SearchPlan(method, search, wanted.sessions, Limits.of(wanted.seconds, wanted.gap))
    find: MethodSession = partial(find_sequence, cell, method, seed=wanted.seed)
    if wanted.advisor.row != "none":
        plan = replace(plan, gate=GateSettings(wanted.gate, spare_best=True))
        advice = OrderAdvice("", wanted.advisor, wanted.gate, wanted.people)

        def find(search: Search, session: int) -> SequenceResult:
            return advised_session(cell, search, advice, (wanted.seed, session), journal, tell)

    def say(event: Event) -> None:
        if journal is None or not (journal.folding and isinstance(event, SequenceFound)):
            tell(event)

    try:
        looked = None
        while looked is None:
            try:
                looked = looked_for(cell, plan, find, say)
            except Again:  # an answer was taken back
                assert journal is not None
                journal.rewind()
        found, interrupted = looked.sessions, looked.stopped_by == CTRL_C
        document = _document(cell, search, looked, wanted)
        if method == LEARNS:
            document |= _policy(learned_policy(cell, search, found, wanted.seed), wanted.keep_policy, box)
        if wanted.stochastic and not interrupted:
            best = min(found, key=lambda one: one.cost)
            document["stochastic"] = stochastic(cell, method, search, best, chance, wanted.seed)
        if journal is not None and not interrupted:
            proven = document["optimal_cost"]
            is_best = proven is not None and document["gap"] == 0.0
            episodes = wanted.sessions * search.episodes
            journal.closes(Closed(episodes, document["cost"], proven, is_best, saved_as=""))
    finally:
        if journal is not None:
            journal.close()
    return document, found


@uninterrupted
def _policy(learned: CarriedPolicy | None, keep: str | None, toolbox: Toolbox) -> dict[str, Any]:
    """What a document says of a learned policy, None where the search was stopped before, once it is kept as it is asked for."""
    kept = kept_policy(keep, learned, toolbox) if keep is not None and learned is not None else None
    return {
        "policy": None if learned is None else policy_record(learned),
        "policy_kept": None if kept is None else str(kept),
    }


@uninterrupted
def _document(cell: Cell, search: Search, looked: SearchResults, wanted: SequencingOptions) -> dict[str, Any]:
    found, known, method = looked.sessions, looked.known, looked.method
    timed, same_times = search.objective == MAKESPAN, search.chance == NO_CHANCE  # a lucky draw is no success
    # What was found in drawn times is judged by the means, too.
    costs = [result.cost if same_times else cost(follow(cell, result.sequence), search.objective) for result in found]
    best, least = found[costs.index(min(costs))], min(costs)
    optimal, mean = known.bound if known.proven else None, float(np.mean([result.cost for result in found]))
    answer = _best_known(cell, method, search.objective, (least, best.sequence), known)
    return {
        "toasts": cell.parts,
        "order": list(cell.order),
        "seed": wanted.seed,
        "method": method,
        "objective": search.objective,
        "episodes": len(best.episode_costs),
        "sessions": wanted.sessions,
        "makespan_s": least if timed else simulate(cell, best.sequence).makespan_s,
        "cost": least,
        "found_at_episode": best.episode_costs.index(best.cost) + 1,
        "luckiest_cost": None if same_times else min(result.cost for result in found),
        "sequence": list(best.sequence),
        "moves": _in_words(cell, best.sequence),
        "episode_costs": list(best.episode_costs),
        "episode_makespans_s": list(best.episode_costs) if timed else None,
        "optimal_s": optimal if timed else None,
        "optimal_cost": optimal,
        "optimum_proven": known.proven,
        "proven_of": EVERY_PLAN,
        "bound_s": known.bound if timed else None,
        "bound_cost": known.bound,
        "bound_by": known.method,
        "gap": known.gap(least),
        **_success(found, known.bound if known.proven and same_times else None),
        "mean_best_s": mean if timed else None,
        "mean_best_cost": mean,
        **answer,
        "srl_s": least if timed and method.startswith("srl") else None,
        "proven": known.proven and known.gap(answer["best_cost"]) == 0.0,
        "robots": len(cell.robots),
        "advisor": str(wanted.advisor),
        "advice": _advice(found) if wanted.advisor.row != "none" else None,
        "advised": getattr(best, "advised", None),  # None: nobody was to be asked, or the best session was stopped
        "stochastic": None,
        "files": {},
        "stopped_by": looked.stopped_by,
        "interrupted": looked.stopped_by == CTRL_C,
    }


def _best_known(
    cell: Cell, method: str, objective: str, own: tuple[float, tuple[int, ...]], known: Reference
) -> dict[str, Any]:
    """The best order known: the method's own, unless the one found beside the bound costs less."""
    value, sequence = own
    by = known.found_by if method == PORTFOLIO else method
    if known.sequence:
        theirs = cost(follow(cell, known.sequence), objective)
        if theirs < value - SAME or (theirs <= value + SAME and len(known.sequence) < len(sequence)):
            value, sequence, by = theirs, known.sequence, known.found_by
    schedule = simulate(cell, sequence)
    return {
        "best_s": schedule.makespan_s,
        "best_cost": value,
        "best_by": by,
        "best_sequence": list(sequence),
        "best_moves": _in_words(cell, sequence),
        "schedule": rows_of(schedule, cell, "planned"),
    }


def _success(found: Sequence[SequenceResult], optimal: float | None) -> dict[str, float | None]:
    """How many of the sessions found the optimum, and how many end with it [%]; None where it is not known."""
    finals = [result.final_cost for result in found if isinstance(result, LearnedSequence)]
    rates: dict[str, float | None] = {}
    for name, costs in (("success_percent", [result.cost for result in found]), ("final_success_percent", finals)):
        hits = [optimal is not None and cost <= optimal + SAME for cost in costs]
        rates[name] = 100.0 * sum(hits) / len(hits) if hits and optimal is not None else None
    return rates


def _advice(found: "Sequence[Any]") -> list[dict[str, Any]]:
    """What became of the advice, session by session."""
    names = ("requests", "helped_steps", "misleads", "rejected_at_episode")
    return [{name: getattr(result, name, None) for name in names} for result in found]  # None: it was stopped


def _in_words(cell: Cell, sequence: Sequence[int]) -> list[str]:
    """What each decision of a sequence does."""
    words = []
    for run, decision, wait in steps(cell, sequence):
        move = run.move(decision, wait)
        what = cell.part_name(move.part) + ("'s pallet" if move.carries == "pallet" else "")
        words.append(f"{what}: {move.origin} > {move.target}")
    return words


@uninterrupted
def draw(cell: Cell, document: dict[str, Any], found: Sequence[SequenceResult], files: dict[str, Path]) -> None:
    """Write the files that are asked for by name: "plot", the costs of the episodes; "gantt" and "schedule", the best order."""

    if "plot" in files:
        label = "makespan [s]" if document["objective"] == MAKESPAN else document["objective"]
        costs = [result.episode_costs for result in found]
        stuck = stuck_cost(cell, document["objective"])
        sequence_plot(
            costs,
            document["optimal_cost"],
            files["plot"],
            ylabel=label,
            deadlock=stuck,
        )
    if "gantt" in files:
        gantt(simulate(cell, document["best_sequence"]), files["gantt"], due_s=cell.due_s)
    if "schedule" in files:
        write_table(document["schedule"], files["schedule"])
    document["files"] = {name: str(path) for name, path in files.items()}


def stochastic(
    cell: Cell, method: str, search: Search, found: SequenceResult, chance: Chance, seed: int
) -> dict[str, Any]:
    """The costs of the fixed sequence and of a policy that reacts, in the same drawn episodes; means with 95 % intervals."""

    fixed = _planned(cell, method, search, found, seed)
    reaction = SEQUENCERS[method].react(cell, search.objective, seed, fixed)
    policy = getattr(found, "policy", None) or search.policy
    if policy is not None:
        reaction = carried_reaction(policy)
    episodes = max(FEWEST, min(REPLICATIONS, PLANNED // cell.parts**2)) if reaction.replans else REPLICATIONS
    costs = [replicate(cell, how, chance, episodes, seed, search.objective) for how in (fixed, reaction.policy)]
    difference = costs[0] - costs[1]
    return {
        "processing": chance.processing,
        "arrivals": chance.arrivals if cell.arrivals else None,
        "spread": chance.spread,
        "robot_breaks_every_s": chance.robot_breaks_every_s,
        "robot_repair_s": chance.robot_repair_s,
        "replications": episodes,
        "fixed": _mean(costs[0]) | {"sequence": list(fixed)},
        "reacting": _mean(costs[1]) | {"policy": reaction.words, "replans": reaction.replans},
        "saved_by_reacting": _mean(difference),
    }


def _planned(cell: Cell, method: str, search: Search, found: SequenceResult, seed: int) -> Sequence[int]:
    """The fixed sequence: what the method finds for the mean times."""
    if search.chance == NO_CHANCE:
        return found.sequence
    return find_sequence(cell, method, replace(search, chance=NO_CHANCE, on_episode=None), seed).sequence


def _mean(values: "np.ndarray[Any, np.dtype[np.float64]]") -> dict[str, Any]:

    mean, low, high = interval(values)
    return {"mean": mean, "ci95": [low, high]}
