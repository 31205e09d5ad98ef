"""What the lab says of a cell, held against the oracle: what it calls proven, its bounds, and the plans of all its methods."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

from oracle.cell import Objective
from oracle.model import Best, best
from oracle.rules import value_of, violations

from against_oracle.drawn import Raw, as_toml, features, smaller
from against_oracle.translated import moves_of, plain_cell, plain_plan
from lab.errors import BadInput, WorkFailed
from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.one_robot import one_robot, why_not
from lab.sequencing.methods.portfolio import best_known
from lab.sequencing.search import Search
from lab.tasks.cell_file import CellFile
from lab.tasks.toml_text import TomlText

LAB_S, ORACLE_S = 10.0, 15.0
NEAR = 1e-4
METHODS = ("fifo", "nearest-ready", "srl-time", "random", "anneal")


@dataclass(frozen=True)
class Claim:
    """What a method says: its best value, the bound, and whether it calls the value proven; inf, proven: there is no order."""

    method: str
    value: float
    bound: float
    proven: bool
    sequence: tuple[int, ...] = ()


@dataclass(frozen=True)
class Compared:
    """A cell, what the oracle says, what the lab says, and what is wrong with it: kind, method and words."""

    raw: Raw
    oracle: Best
    claims: tuple[Claim, ...]
    wrong: tuple[tuple[str, str, str], ...]
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of what is wrong, each once."""
        return tuple(dict.fromkeys(kind for kind, *_ in self.wrong))


def cell_of(raw: Raw) -> Cell:
    """The lab's cell of the values of a cell file. BadInput for what cannot be one.

    Of every other one, by how many parts it has, two routes that differ in one stage are one route with alternatives there.
    """
    if len(raw["order"]) % 2:
        raw = raw | {"products": [one | {"routes": _with_alternatives(one["routes"])} for one in raw["products"]]}
    return CellFile.checked(TomlText.parsed(Path("drawn.toml"), as_toml(raw))).cell()


def _with_alternatives(routes: list[list[Any]]) -> list[list[Any]]:
    """One route for two that differ in the station of one stage, which is no pallet's; else the same routes."""
    if len(routes) != 2 or len(routes[0]) != len(routes[1]):
        return routes
    names = [[one if isinstance(one, str) else one["station"] for one in route] for route in routes]
    apart = [n for n, (a, b) in enumerate(zip(*names, strict=True)) if a != b]
    if len(apart) != 1 or any(isinstance(one, dict) and "pallet" in one for route in routes for one in route):
        return routes
    at, other = routes[0][apart[0]], routes[1][apart[0]]
    merged = ({"station": at} if isinstance(at, str) else at) | {"alternatives": [other]}
    return [[*routes[0][: apart[0]], merged, *routes[0][apart[0] + 1 :]]]


def compared(raw: Raw, methods: Sequence[str] = METHODS, lab_s: float = LAB_S, oracle_s: float = ORACLE_S) -> Compared:
    """The lab against the oracle on a cell. BadInput for a cell that the lab refuses."""
    cell, objective = cell_of(raw), raw.get("sequencing", {}).get("objective", MAKESPAN)
    plain = plain_cell(cell)
    begun = time.perf_counter()
    oracle = best(plain, objective, oracle_s)
    between = time.perf_counter()
    claims = [*proofs(cell, objective, lab_s), *(one for name in methods for one in _found(cell, name, objective))]
    seconds = {"oracle": between - begun, "lab": time.perf_counter() - between}
    wrong, near = list[tuple[str, str, str]](), NEAR + oracle.within
    if oracle.plan is not None:
        broken = violations(plain, oracle.plan)
        wrong += [("oracle", "oracle", one) for one in broken]
        value = value_of(plain, oracle.plan, objective)
        if oracle.status == "optimal" and abs(value - oracle.value) > near:
            wrong.append(("oracle", "oracle", f"says {oracle.value:g}, its plan comes to {value:g}"))
    for claim in claims:
        wrong += [(kind, claim.method, words) for kind, words in _judged(claim, oracle, near)]
        if claim.sequence:
            plan = plain_plan(cell, moves_of(cell, claim.sequence))
            wrong += [("broken rule", claim.method, one) for one in violations(plain, plan)]
            value = value_of(plain, plan, objective)
            if abs(value - claim.value) > near:
                wrong.append(("wrong value", claim.method, f"says {claim.value:g}, its plan comes to {value:g}"))
    return Compared(raw, oracle, tuple(claims), tuple(wrong), seconds)


def _judged(claim: Claim, oracle: Best, near: float) -> list[tuple[str, str]]:
    found = list[tuple[str, str]]()
    if claim.value == inf and claim.bound == inf and claim.proven:
        if oracle.plan is not None:
            found.append(("says there is none", f"there is a plan of {oracle.value:g}"))
        return found
    if claim.proven and claim.value > oracle.value + near:
        found.append(("proven is beaten", f"proven {claim.value:g}, a plan of {oracle.value:g} keeps to all rules"))
    elif claim.bound > oracle.value + near:
        found.append(("bound is beaten", f"bound {claim.bound:g}, a plan of {oracle.value:g} keeps to all rules"))
    if claim.value < oracle.bound - near:
        found.append(("below the oracle", f"{claim.value:g}, the oracle proves {oracle.bound:g}"))
    return found


def proofs(cell: Cell, objective: Objective, seconds: float) -> list[Claim]:
    """What each method that proves something says."""
    found = list[Claim]()

    def asked(name: str, ask: Callable[[], Claim]) -> None:
        try:
            found.append(ask())
        except WorkFailed as error:
            proven = "proven" in str(error) and "not proven" not in str(error)
            found.append(Claim(name, inf, inf if proven else 0.0, proven))

    def known() -> Claim:
        one = best_known(cell, objective, seconds)
        return Claim("best known", one.cost, one.bound, one.proven, one.sequence)

    def by_cp_sat() -> Claim:
        one = cp_sat(cell, objective, seconds)
        proven = one.status in ("optimal", "impossible")
        return Claim("cp-sat", one.cost, one.bound, proven, one.sequence)

    def by_states() -> Claim:
        one = optimum(cell)
        return Claim("exact", one.cost, one.bound_s, one.proven, one.sequence)

    def by_tours() -> Claim:
        one = one_robot(cell, seconds)
        return Claim("tours", one.cost, one.bound, one.proven, one.sequence)

    asked("best known", known)
    asked("cp-sat", by_cp_sat)
    if objective == MAKESPAN and cell.serial:
        asked("exact", by_states)
    if objective == MAKESPAN and not why_not(cell):
        asked("tours", by_tours)
    return found


def _found(cell: Cell, method: str, objective: Objective) -> list[Claim]:
    """What a method that proves nothing finds; nothing where it finds none, or has no rule for it."""
    try:
        one = find_sequence(cell, method, Search(20, objective), 1)
    except (BadInput, WorkFailed):
        return []
    return [Claim(method, one.cost, 0.0, False, one.sequence)]


def least(raw: Raw, kind: str, methods: Sequence[str] = (), most: int = 15, seconds: float = 3.0) -> Compared:
    """The smallest cell of which that is wrong still, by leaving away one thing after the other; `most`: how many are tried.

    methods: beside those that prove something; seconds: for each proof."""
    now, tried = compared(raw, methods, seconds, 2 * seconds), 0
    if kind not in now.kinds:
        return now
    again = True
    while again:
        again = False
        for other in smaller(now.raw):
            tried += 1
            if tried > most:
                return now
            try:
                one = compared(other, methods, seconds, 2 * seconds)
            except (BadInput, ValueError):
                continue
            if kind in one.kinds:
                now, again = one, True
                break
    return now


def freedom(one: Compared) -> str:
    """What the better plan needs that the lab's do not have, as far as the oracle without it can tell."""
    if one.oracle.plan is None:
        return "unknown"
    objective = one.raw.get("sequencing", {}).get("objective", MAKESPAN)
    without = best(plain_cell(cell_of(one.raw)), objective, ORACLE_S, may_hold=False)
    if without.status == "optimal" and without.value > one.oracle.value + NEAR + one.oracle.within:
        least_value = min((claim.value for claim in one.claims if claim.proven), default=inf)
        half = without.value < least_value - NEAR - one.oracle.within
        return "holding a part while waiting, and more than that" if half else "holding a part while waiting"
    return "waiting, or transfers of several robots that are under way at once and make room for each other"


def label(raw: Raw) -> str:
    """What a cell has, in one line."""
    return ", ".join(features(raw)) or "one robot, machines in a row"
