"""The shortest periods that the lab finds, held against the oracle: one to three parts a cycle, and the best of these a part."""

from dataclasses import dataclass
from math import inf

from oracle import cycle as plain
from oracle.cycle import BestCycle

from against_oracle.compared import cell_of
from against_oracle.drawn import Raw
from against_oracle.translated import plain_cell
from lab.errors import WorkFailed
from lab.sequencing.cyclic.cycle import best_cycle
from lab.sequencing.cyclic.several import EVERY_CYCLE, Rhythm, best_rhythm

MOST_PARTS = 3
SECONDS = 8.0


@dataclass(frozen=True)
class Periods:
    """With so many parts a cycle: the lab's shortest period and whether it calls it proven, and the oracle's [s]."""

    parts: int
    period_s: float
    proven: bool
    oracle: BestCycle


@dataclass(frozen=True)
class Found:
    """The periods of as many parts a cycle, and what the lab says when it looks for the best of them; None: there is none."""

    periods: list[Periods]
    rhythm: Rhythm | None


def fits(raw: Raw) -> bool:
    """Whether a cycle is looked for in a cell: one robot, machines without servers, and nothing comes."""
    return "robot" in raw and "arrivals" not in raw and not any("servers" in one for one in raw["stations"])


def periods(raw: Raw, seconds: float = SECONDS) -> Found:
    """The periods of a cell that makes the first product of its order for ever. BadInput as the lab."""
    name, found = raw["order"][0], list[Periods]()
    raw = {key: value for key, value in raw.items() if key not in ("due_s", "release_s", "sequencing")}
    cell = cell_of(raw | {"order": [name] * MOST_PARTS})
    for parts in range(1, MOST_PARTS + 1):
        oracle = plain.best_cycle(plain_cell(cell), (name,) * parts, seconds)
        try:
            one = best_cycle(cell, (name,) * parts, seconds)
        except WorkFailed as error:
            found.append(Periods(parts, inf, "it is proven" in str(error), oracle))
            continue
        found.append(Periods(parts, one.period_s, one.proven, oracle))
    try:
        rhythm = best_rhythm(cell, (name,), MOST_PARTS, time_limit_s=MOST_PARTS * seconds)
    except WorkFailed:
        rhythm = None
    return Found(found, rhythm)


def judged(found: Found) -> list[tuple[str, str, str]]:
    """What is wrong with them: kind, method and words."""
    wrong = list[tuple[str, str, str]]()
    for one in found.periods:
        near = one.oracle.tick_s + 1e-6
        if one.proven and one.period_s > one.oracle.period_s + near:
            words = f"{one.parts} a cycle: proven {one.period_s:g}, there is one of {one.oracle.period_s:g}"
            wrong.append(("period is beaten", "cyclic", words))
        if one.period_s < one.oracle.bound_s - near:
            words = f"{one.parts} a cycle: {one.period_s:g}, the oracle proves {one.oracle.bound_s:g}"
            wrong.append(("period is below the oracle", "cyclic", words))
    rhythm, near = found.rhythm, found.periods[0].oracle.tick_s + 1e-6
    if rhythm is None:
        if any(one.period_s < inf for one in found.periods):
            wrong.append(("no best cycle of several", "cyclic", "none was found of up to 3 parts, alone there is one"))
        return wrong
    for one in found.periods:
        each_s, least_s = one.oracle.period_s / one.parts, one.oracle.bound_s / one.parts
        told = rhythm.bound_part_s if rhythm.proven_of == EVERY_CYCLE or one.parts <= rhythm.most_parts else 0.0
        if each_s < max(told, rhythm.least_part_s) - near:
            words = f"{rhythm.bound_part_s:g} a part of {rhythm.proven_of}, {rhythm.least_part_s:g} of all"
            wrong.append(("bound a part is beaten", "cyclic", f"{words}; {one.parts} a cycle: {each_s:g}"))
        if one.parts == rhythm.cycle.parts and rhythm.per_part_s < least_s - near:
            words = f"{one.parts} a cycle: {rhythm.per_part_s:g} a part, the oracle proves {least_s:g}"
            wrong.append(("period a part is below the oracle", "cyclic", words))
    return wrong
