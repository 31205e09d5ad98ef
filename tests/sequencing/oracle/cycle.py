"""The shortest period in which one robot can repeat its transfers for ever, so many parts entering in each, by a plain model.

What is allowed is what `model` allows: waits on purpose, also with a part in the gripper. Parts all wait at the beginning. A
period begins when its first part is picked there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from ortools.sat.python import cp_model

from oracle.cell import Carried, Cell, Plan, ticks_per_s
from oracle.ways import Step, Way, ways_of

FINER = 2  # ticks of the model in one of the cell: a shortest period is a whole number of these divided by a few cycles
MOST_OVER = 2  # periods that begin while a part stays in one place, at the most


@dataclass(frozen=True)
class BestCycle:
    """The shortest period, "optimal" to a tick of the model; `bound_s`: none is shorter. steps: of one cycle, as timed transfers.

    A part's steps are given for the part that enters in the cycle that begins at 0, in whichever cycles they fall.
    """

    status: Literal["optimal", "feasible", "impossible", "unknown"]
    period_s: float
    bound_s: float
    tick_s: float
    steps: tuple[Carried, ...]
    wall_s: float


class _Move(NamedTuple):
    """A step of a part: pick and drop within the period; over: how many periods have begun since its part entered."""

    slot: int
    way: int
    number: int
    step: Step
    there: cp_model.IntVar
    pick: cp_model.IntVar
    drop: cp_model.IntVar
    over: cp_model.IntVar


def best_cycle(cell: Cell, mix: Sequence[str], seconds: float = 60.0, seed: int = 0, workers: int = 1) -> BestCycle:
    """The shortest period with these products in a cycle. ValueError for a cell without just one robot, or with servers."""
    if len(cell.robots) != 1 or any(one.servers is not None for one in cell.stations) or cell.interval_s is not None:
        raise ValueError("a cycle is of one robot, and of machines without servers, and nothing comes")
    model = _Model(cell, mix)
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = seconds
    solver.parameters.random_seed = seed
    solver.parameters.num_workers = workers
    code = solver.solve(model.model)
    tick_s = 1.0 / model.per_s
    if code == cp_model.INFEASIBLE:
        return BestCycle("impossible", float("inf"), float("inf"), tick_s, (), solver.wall_time)
    if code not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return BestCycle("unknown", float("inf"), solver.best_objective_bound * tick_s, tick_s, (), solver.wall_time)
    return BestCycle(
        "optimal" if code == cp_model.OPTIMAL else "feasible",
        solver.objective_value * tick_s, solver.best_objective_bound * tick_s, tick_s, tuple(model.steps(solver)),
        solver.wall_time,
    )  # fmt: skip


def repeated(found: BestCycle, parts_a_cycle: int, cycles: int) -> Plan:
    """The plan of so many cycles, begun with an empty line: parts are numbered as they enter."""
    least_s = min(one.leave_s for one in found.steps)
    carried = list[Carried]()
    for cycle in range(cycles):
        later_s = cycle * found.period_s - least_s
        for one in found.steps:
            carried.append(
                replace(
                    one, part=one.part + cycle * parts_a_cycle, leave_s=one.leave_s + later_s, pick_s=one.pick_s + later_s,
                    out_s=one.out_s + later_s, drop_s=one.drop_s + later_s,
                )
            )  # fmt: skip
    return Plan(tuple(sorted(carried, key=lambda one: one.pick_s)))


class _Model:
    """Every transfer's pick and drop lie in one period; a part's next transfer may be one of a later period."""

    def __init__(self, cell: Cell, mix: Sequence[str]) -> None:
        self.cell, self.model, self.mix = cell, cp_model.CpModel(), mix
        self.per_s = ticks_per_s(cell) * FINER
        self.robot = cell.robots[0]
        self.ways = {name: ways_of(cell, name) for name in set(mix)}
        self.longest = self._longest()
        self.period = self.model.new_int_var(1, self.longest, "period")
        self.moves = list[_Move]()
        for slot, name in enumerate(mix):
            taken = [self.model.new_bool_var(f"slot {slot} way {n}") for n in range(len(self.ways[name]))]
            self.model.add_exactly_one(taken)
            for number, (way, there) in enumerate(zip(self.ways[name], taken, strict=True)):
                self._add_way(slot, number, way, there)
        self._before = [[self._ahead(m, n) for n in range(len(self.moves))] for m in range(len(self.moves))]
        self._add_tour()
        self._add_rooms()
        self._add_alike()
        self.model.minimize(self.period)

    def ticks(self, seconds: float) -> int:
        """A time in ticks."""
        return round(seconds * self.per_s)

    def _drive(self, table: str, origin: str, target: str) -> int | None:
        if origin == target:
            return 0
        times = self.cell.empty_s if table == "empty" else self.cell.loaded_s
        return self.ticks(times[origin, target] / self.robot.speed) if (origin, target) in times else None

    def _carry(self, step: Step) -> int | None:
        return self._drive("loaded", step.origin, step.target)

    def _longest(self) -> int:
        """A period in which all can be done one after the other."""
        empty = max([self.ticks(one / self.robot.speed) for one in self.cell.empty_s.values()], default=0)
        return sum(
            max(
                sum(
                    empty + self.ticks(step.service_s + step.processing_s) + (self._carry(step) or 0)
                    for step in way.steps
                )
                for way in self.ways[name]
            )
            for name in self.mix
        )  # fmt: skip

    def _add_way(self, slot: int, number: int, way: Way, there: cp_model.IntVar) -> None:
        own = list[_Move]()
        for n, step in enumerate(way.steps):
            name, carry = f"{slot}.{number}.{n}", self._carry(step)
            pick, drop = (self.model.new_int_var(0, self.longest, f"{what} {name}") for what in ("pick", "drop"))
            most = MOST_OVER * n
            over = self.model.new_int_var(0, most, f"over {name}")
            move = _Move(slot, number, n, step, there, pick, drop, over)
            if carry is None:
                self.model.add(there == 0)
            self.model.add(drop >= pick + (carry or 0))
            own.append(move)
            if n:
                self.model.add(self._lasts(own[n - 1], move) >= 0).only_enforce_if(there)
            if step.ready is not None and step.ready >= 0:
                lasts = self._lasts(own[step.ready], move)
                done = self.ticks(own[step.ready].step.processing_s)
                self.model.add(lasts >= done + self.ticks(step.service_s)).only_enforce_if(there)
                if step.at_most_s is not None:
                    self.model.add(lasts <= done + self.ticks(step.at_most_s)).only_enforce_if(there)
        self.moves += own

    def _lasts(self, since: _Move, until: _Move) -> cp_model.IntVar:
        """How long a part is where a step brings it, until another one takes it, whole periods counted."""
        most = MOST_OVER * (until.number - since.number)
        lasts = self.model.new_int_var(-self.longest, self.longest * (most + 1), "")
        over = [self.model.new_bool_var("") for _ in range(most + 1)]
        self.model.add_exactly_one(over)
        for times, these in enumerate(over):
            self.model.add(until.over - since.over == times).only_enforce_if(these)
            self.model.add(lasts == until.pick - since.drop + times * self.period).only_enforce_if(these)
        return lasts

    def _ahead(self, m: int, n: int) -> cp_model.IntVar:
        """Whether a move is made before another one in the period."""
        return self.model.new_bool_var(f"{m} before {n}")

    def _add_tour(self) -> None:
        """One transfer after the other, the last of a period before the first of the next."""
        moves, busy = self.moves, list[cp_model.LinearExprT]()
        for m, one in enumerate(moves):
            self.model.add(self._before[m][m] == 0)
            for n, then in enumerate(moves[:m]):
                ahead, behind = self._before[m][n], self._before[n][m]
                self.model.add(ahead + behind == 1)
                self.model.add(then.pick >= one.drop).only_enforce_if(ahead, one.there, then.there)
                self.model.add(one.pick >= then.drop).only_enforce_if(behind, one.there, then.there)
        arcs = list[tuple[int, int, cp_model.LiteralT]]()
        for n, move in enumerate(moves, 1):
            arcs.append((n, n, move.there.negated()))
            carry = self._carry(move.step) or 0
            if move.slot == 0 and move.number == 0:
                arcs.append((0, n, move.there))
                self.model.add(move.pick == 0).only_enforce_if(move.there)
                self.model.add(move.over == 0)
            home = self._drive("empty", move.step.target, moves[0].step.origin)
            if home is not None:
                arc = self.model.new_bool_var("")
                arcs.append((n, 0, arc))
                self.model.add(self.period >= move.drop + home).only_enforce_if(arc)
                busy.append(arc * (home + carry))
            for m, then in enumerate(moves, 1):
                drive = self._drive("empty", move.step.target, then.step.origin)
                if m == n or drive is None:
                    continue
                needs, arc = drive + self.ticks(then.step.service_s), self.model.new_bool_var("")
                arcs.append((n, m, arc))
                self.model.add(then.pick >= move.drop + needs).only_enforce_if(arc)
                self.model.add_implication(arc, self._before[n - 1][m - 1])
                busy.append(arc * (needs + carry))
        self.model.add_circuit(arcs)
        self.model.add(self.period >= cp_model.LinearExpr.sum(busy))  # follows; a solver is quicker with it

    def _add_rooms(self) -> None:
        """At each drop no station holds more than it can; at each pick that needs one to be full, it is."""
        stays = dict[str, list[tuple[int, int]]]()
        first = 0
        while first < len(self.moves):
            move = self.moves[first]
            way = self.ways[self.mix[move.slot]][move.way]
            for room in way.rooms:
                stays.setdefault(room.station, []).append((first + room.since, first + room.until))
            first += len(way.steps)
        for name, held in stays.items():
            capacity = self.cell.station(name).capacity
            if capacity is None:
                continue
            lasting = list[cp_model.LinearExprT]()
            for since, until in held:
                one, then = self.moves[since], self.moves[until]
                lasts = self.model.new_int_var(0, self.longest * 9, "")
                self.model.add(lasts >= self._lasts(one, then)).only_enforce_if(one.there)
                lasting.append(lasts)
                here = [self._copies(stay, since, True) for stay in held]
                self.model.add(cp_model.LinearExpr.sum(here) <= capacity).only_enforce_if(one.there)
            self.model.add(capacity * self.period >= cp_model.LinearExpr.sum(lasting))  # follows, too
        for n, move in enumerate(self.moves):
            if move.step.only_full is not None:
                capacity = self.cell.station(move.step.only_full).capacity
                here = [self._copies(stay, n, False) for stay in stays.get(move.step.only_full, [])]
                if capacity is None:
                    self.model.add(move.there == 0)
                else:
                    self.model.add(cp_model.LinearExpr.sum(here) >= capacity).only_enforce_if(move.there)

    def _copies(self, stay: tuple[int, int], at: int, dropped: bool) -> cp_model.IntVar:
        """How many parts are in a stay once a move has dropped its own, or when it picks it."""
        since, until = stay
        one, then = self.moves[since], self.moves[until]
        come = 1 if dropped and since == at else self._before[since][at]
        gone = 1 if dropped and until == at else self._before[until][at]
        copies = self.model.new_int_var(0, MOST_OVER * 2 + 1, "")
        self.model.add(copies == then.over - one.over + come - gone).only_enforce_if(one.there)
        self.model.add(copies == 0).only_enforce_if(one.there.negated())
        return copies

    def _add_alike(self) -> None:
        """Of parts of one product the first to enter has the lowest number; all enter in the cycle that is looked at."""
        firsts = dict[int, list[_Move]]()
        for move in self.moves:
            if move.number == 0:
                firsts.setdefault(move.slot, []).append(move)
                self.model.add(move.over == 0)
        for slot in range(1, len(self.mix)):
            if self.mix[slot] == self.mix[slot - 1]:
                for one in firsts[slot - 1]:
                    for then in firsts[slot]:
                        self.model.add(one.pick <= then.pick).only_enforce_if(one.there, then.there)

    def steps(self, solver: cp_model.CpSolver) -> Iterator[Carried]:
        """The transfers of the parts that enter in cycle 0. The robot leaves for each as late as it can."""
        period, made = solver.value(self.period), [one for one in self.moves if solver.value(one.there)]
        made.sort(key=lambda one: solver.value(one.pick))
        for before, move in zip([made[-1], *made[:-1]], made, strict=True):
            later = solver.value(move.over) * period
            pick_s, drop_s = ((solver.value(at) + later) / self.per_s for at in (move.pick, move.drop))
            drive_s = (self._drive("empty", before.step.target, move.step.origin) or 0) / self.per_s
            yield Carried(
                move.slot + 1, self.robot.name, move.step.origin, move.step.target,
                pick_s - move.step.service_s - drive_s, pick_s, pick_s, drop_s, move.step.service_s,
                "pallet" if move.step.pallet else "part",
            )  # fmt: skip
