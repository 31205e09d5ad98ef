"""The cycle of a line as a constraint model for OR-Tools' CP-SAT: the begins of its moves, and the period."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, floor, gcd, inf, isfinite
from typing import Any, NamedTuple

from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.cyclic.line import Line, LineSpan
from lab.sequencing.methods.cp_sat_solver import cp_model

TICKS = round(TICKS_PER_S)
COARSE = 1000  # units per second of the coarse model, where times are not integers in fewer units
# The fine model has so many times the units of the coarse one: where times are not integers, and where they are (840 units make
# fractions with a denominator up to 8 integers, too).
FINE = (10**4, 840)
NEAR = 1e-3  # tolerance of sums of times, in units


class CycleSolution(NamedTuple):
    """The solver's result for a line. above_s: a lower bound of the period [s]; inf: no cycle exists.

    order, wraps: of the best cycle found, as in `cycle.arcs_of`; empty: none was found.
    """

    above_s: float
    order: tuple[int, ...] = ()
    wraps: tuple[int, ...] = ()


class Units(NamedTuple):
    """The units per second of a line's models: a coarse one, in which the solver is quick, and a fine one for the last step.

    rounded: whether times are rounded in these units. resolution_s: a period within this much of its bound is the shortest. Where
    all times are integers, a shortest period is an integer divided by the number of cycles that a circuit of constraints spans,
    and two such numbers lie further apart; where they are not, it is the effect of rounding.
    """

    coarse: int
    fine: int
    rounded: bool
    resolution_s: float

    @classmethod
    def of(cls, line: Line) -> "Units":
        """The units of a line's models."""
        numbers = range(len(line.moves))
        times = {move.work_s for move in line.moves} | {s for span in line.needs for s in (span.least_s, span.most_s)}
        times |= {line.after_s(number, then) for number in numbers for then in numbers}
        whole = TICKS // gcd(TICKS, *(round(time * TICKS) for time in times if isfinite(time)))
        if whole > COARSE:
            fine = COARSE * FINE[0]
            return cls(COARSE, fine, True, (2 * len(numbers) + 1) / fine)
        return cls(whole, whole * FINE[1], False, 1.5 / (whole * FINE[1]))


@dataclass
class CycleModel:
    """The variables and constraints of a line: each move's begin in [0, period), the first move's at 0.

    least_s: a lower bound of the period. below_s: only shorter periods are searched. unit: units per second. loose: whether
    times are rounded so that the model's bound holds for the line: least times down and largest times up; a cycle that is found
    may then miss a time window by some units.
    """

    line: Line
    away_s: Sequence[Sequence[float]]
    least_s: float
    below_s: float
    unit: int
    loose: bool
    model: cp_model.CpModel = field(default_factory=cp_model.CpModel)

    def __post_init__(self) -> None:
        moves, longest_s = self.line.moves, self.line.longest_s
        self._longest = ceil(longest_s * self.unit) if self.below_s > longest_s else ceil(self.below_s * self.unit) - 1
        self._period = self.model.new_int_var(min(self._down(self.least_s), self._longest), self._longest, "period")
        self._work = [self._down(move.work_s) for move in moves]
        self._begin = [self.model.new_int_var(0, 0 if n == 0 else self._longest, "") for n in range(len(moves))]
        self._before: dict[tuple[int, int], Any] = {(n, n): 0 for n in range(len(moves))}  # a literal, or 0 or 1
        for one in range(len(moves)):
            for then in range(one):
                self._apart(then, one)
        self._most_wraps = [self._most(stay) for stay in self.line.stays]
        self._wraps = [self.model.new_int_var(0, most, "") for most in self._most_wraps]
        for number, stay in enumerate(self.line.stays):
            self._lasts(stay, self._wraps[number], self._most_wraps[number])
        for span in self.line.needs:
            self._within(span)
        for number in range(len(moves)):
            self._add_room(number)
        self._add_tour()
        self._add_turns()
        self.model.minimize(self._period)

    def solve(self, time_limit_s: float, seed: int) -> CycleSolution:
        """The best cycle that is found within the time limit [s], and a lower bound of the period."""
        solver = cp_model.CpSolver()
        solver.parameters.max_time_in_seconds = time_limit_s
        solver.parameters.num_workers = 1
        solver.parameters.random_seed = seed
        status = solver.solve(self.model)
        if status == cp_model.INFEASIBLE:
            return CycleSolution(inf if self._longest >= self.line.longest_s * self.unit else self._longest / self.unit)
        # Begins rounded down satisfy all constraints with the period rounded up, which is longer by less than one unit.
        above_s = (solver.best_objective_bound - 1) / self.unit
        if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            return CycleSolution(above_s)
        numbers = range(len(self.line.moves))
        before = {pair: one if isinstance(one, int) else solver.value(one) for pair, one in self._before.items()}
        order = sorted(numbers, key=lambda move: sum(before[other, move] for other in numbers))
        return CycleSolution(above_s, tuple(order), tuple(solver.value(wraps) for wraps in self._wraps))

    def _down(self, time_s: float) -> int:
        return floor(time_s * self.unit + NEAR)

    def _away(self, one: int, then: int) -> int:
        moves = self.line.moves
        return self._down(self.away_s[moves[one].option.target][moves[then].option.origin])

    def _apart(self, one: int, then: int) -> None:
        """Keeps two moves of the robot apart: one ends, and the robot drives to the other, in this cycle and into the next."""
        there, back = (self._work[a] + self._away(a, b) for a, b in ((one, then), (then, one)))
        if one == 0:
            self._before[0, then], self._before[then, 0] = 1, 0
            self.model.add(self._begin[then] >= there)
            self.model.add(self._period - self._begin[then] >= back)
            return
        first = self.model.new_bool_var("")
        self._before[one, then], self._before[then, one] = first, first.negated()
        later = self._begin[then] - self._begin[one]
        for literal, ahead, first_s, second_s in ((first, later, there, back), (first.negated(), -later, back, there)):
            self.model.add(ahead >= first_s).only_enforce_if(literal)
            self.model.add(self._period - ahead >= second_s).only_enforce_if(literal)

    def _most(self, stay: LineSpan) -> int:
        """The largest number of cycles that may begin while a part stays."""
        cell, moves = self.line.cell, self.line.moves
        room = min(cell.capacities[station] for station in cell.positions[moves[stay.pick].place].holds)
        if any(move.option.if_full is not None for move in moves):
            return room  # it may pay to keep a station full
        inside_s = max((s.least_s for s in self.line.needs if s.drop <= stay.drop and s.pick >= stay.pick), default=0.0)
        return min(room, 2 + ceil(inside_s / max(self.least_s, 1e-9)))

    def _within(self, span: LineSpan) -> None:
        """Adds the processing time before a pick, and its latest time."""
        inside = [n for n, stay in enumerate(self.line.stays) if span.drop < stay.pick <= span.pick]
        if len(inside) == 1:
            self._lasts(span, self._wraps[inside[0]], self._most_wraps[inside[0]])
            return
        most = sum(self._most_wraps[n] for n in inside)
        total = self.model.new_int_var(0, most, "")
        self.model.add(total == sum(self._wraps[n] for n in inside))
        self._lasts(span, total, most)

    def _lasts(self, span: LineSpan, wraps: cp_model.IntVar, most_wraps: int) -> None:
        apart = self._begin[span.pick] - self._begin[span.drop] - self._work[span.drop]
        for times in range(most_wraps + 1):
            these = self._is(wraps, times)
            lasts = apart + times * self._period
            self.model.add(lasts >= self._down(span.least_s)).only_enforce_if(these)
            if span.most_s < inf:
                slack = times + 1 if self.loose else 0  # since the period is rounded up and the work down
                self.model.add(lasts <= ceil(span.most_s * self.unit - NEAR) + slack).only_enforce_if(these)

    def _is(self, wraps: cp_model.IntVar, times: int) -> cp_model.IntVar:
        these = self.model.new_bool_var("")
        self.model.add(wraps == times).only_enforce_if(these)
        self.model.add(wraps != times).only_enforce_if(these.negated())
        return these

    def _taken(self, station: int, move: int) -> cp_model.LinearExpr:
        """The number of parts at a station when a move is decided."""
        held = [(self._wraps[n], self.line.stays[n]) for n in self.line.holds.get(station, ())]
        terms = [wraps + self._before[stay.drop, move] - self._before[stay.pick, move] for wraps, stay in held]
        return cp_model.LinearExpr.sum(terms)

    def _add_room(self, move: int) -> None:
        """Adds that the stations which a move needs have room, and that the one which must be full for it is full."""
        option, room = self.line.moves[move].option, self.line.cell.capacities
        for station in option.needs:
            self.model.add(self._taken(station, move) <= room[station] - 1)
        if option.if_full is not None:
            self.model.add(self._taken(option.if_full, move) >= room[option.if_full])

    def _add_tour(self) -> None:
        """Adds a tour of the robot where the direct drive between two moves takes longer than a detour, or does not exist."""
        numbers = range(len(self.line.moves))
        straight = {(a, b): self.line.after_s(a, b) for a in numbers for b in numbers if a != b}
        if len(numbers) == 1:
            self.model.add(self._period >= self._work[0] + self._down(self.line.after_s(0, 0)))
        if all(isfinite(time) and self._down(time) <= self._away(*pair) for pair, time in straight.items()):
            return
        arcs = list[tuple[int, int, cp_model.IntVar]]()
        for (one, then), time in straight.items():
            if not isfinite(time):
                continue
            arc = self.model.new_bool_var("")
            arcs.append((one, then, arc))
            gap = self._work[one] + self._down(time)
            begin = self._period if then == 0 else self._begin[then]
            self.model.add(begin - self._begin[one] >= gap).only_enforce_if(arc)
            if 0 not in (one, then):
                self.model.add_implication(arc, self._before[one, then])
        self.model.add_circuit(arcs)

    def _add_turns(self) -> None:
        """Orders the begins of parts with the same path by their numbers, since such parts are identical."""
        firsts = [n for n, move in enumerate(self.line.moves) if n == 0 or self.line.moves[n - 1].slot != move.slot]
        last: dict[object, int] = {}
        for slot, first in enumerate(firsts):
            path = self.line.paths[slot]
            if path in last:
                self.model.add(self._begin[last[path]] <= self._begin[first])
            last[path] = first
