"""Chapter 7 again: the printed figures of tables 7.4-7.6, IV.1 and IV.2, and the sessions that measure them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from lab.errors import unknown
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.search import SAME, Search, SrlSettings
from lab.statistics import Comparison, compare, part_means
from lab.studies.findings import Row, mean_row, share_row
from lab.studies.runner import Job, seeds_of
from lab_studies.many_sessions import run_sessions
from lab_studies.thesis import chapter_7_listing as listing
from lab_studies.thesis import printed_lines
from lab_studies.thesis.chapter_7_listing import LISTING, Reading
from lab_studies.thesis.used_to_choose import DECAY_TABLE, is_used_7

Floats = NDArray[np.float64]
Environment = Literal["deterministic", "stochastic"]
Factor = Literal["A", "B"]

SESSION_LENGTHS, DECAY_FACTORS = "tables-7.4-7.6-iv.2.csv", "table-iv.1.csv"
SPREAD = 0.1  # section 7.6: the standard deviation of processing times as a share of their mean
REPLICATIONS = 10  # section 7.6
PRINTED_SESSIONS, DECAY_SESSIONS = {3: 1000, 4: 300}, 100  # section 7.6, by number of toasts; for table IV.1
DECAY_EPISODES = 200  # section 7.6, the test of beta
LISTED = "listing"
AS_PRINTED = "figure 5.1"
READINGS: Mapping[str, Reading | None] = {  # None: the lab's own SRL, which is fig. 5.1
    LISTED: LISTING,
    "Monte Carlo averages": replace(LISTING, averages=True),
    "no phantoms": replace(LISTING, phantoms=False),
    "no null moves": replace(LISTING, null_moves=False),
    "ties at random": replace(LISTING, last_of_ties=False),
    "toaster freed by its own toast": replace(LISTING, frees_by_place=False),
    "(5,1,1), (4,5,4) allowed": replace(LISTING, bans_too=False),
    AS_PRINTED: None,
}


@dataclass(frozen=True)
class SequencingSetting:
    """One cell of a table: a method, its toasts and its episodes. reading: one of READINGS.

    reward_factor is of SRL, beta of SRL and Monte Carlo; other methods have none. Raises BadInput for an unknown reading.
    """

    case: str
    toasts: int
    method: str
    episodes: int
    environment: Environment = "deterministic"
    reward_factor: Factor | None = None
    beta: float | None = None
    reading: str = LISTED

    def __post_init__(self) -> None:
        if self.reading not in READINGS:
            raise unknown("reading", self.reading, READINGS, "chapter 7")


@dataclass(frozen=True, eq=False)
class SequencingOutcome:
    """The results of N sessions, (N,) each: the best time [s], that of the last episode, the episode of convergence.

    With the reading AS_PRINTED the last time is that of the final greedy policy.
    """

    best_s: Floats
    last_s: Floats
    converged: NDArray[np.int64]


@dataclass(frozen=True)
class PrintedFigure:
    """One printed value."""

    setting: SequencingSetting
    measure: str
    value: float


@cache
def printed(file: str) -> tuple[PrintedFigure, ...]:
    """The values of a printed table, in its order."""
    read = _decay_cells if file == DECAY_FACTORS else _length_cells
    return tuple(cell for line in printed_lines(file) for cell in read(line))


def _length_cells(line: dict[str, str]) -> list[PrintedFigure]:
    method, toasts = line["method"].lower(), int(line["toasts"])
    setting = SequencingSetting(
        line["case"],
        toasts,
        method,
        int(line["session_episodes"]),
        cast(Environment, line["environment"]),
        cast("Factor | None", line["reward_factor"] or None),
        None if method == "random" else beta_of(toasts),
    )
    return [PrintedFigure(setting, line["measure"].replace("_seconds", "_s"), float(line["value"]))]


def beta_of(parts: int) -> float:
    """The beta where the thesis does not compare several. Source: section 7.6, App. III."""
    return 1.0 if parts == 3 else 0.5


def _decay_cells(line: dict[str, str]) -> list[PrintedFigure]:
    """The values of a line of table IV.1, with reward factor A, which the thesis does not name but its values show."""
    setting = SequencingSetting(line["case"], 3, "srl", DECAY_EPISODES, reward_factor="A", beta=float(line["beta"]))
    return [PrintedFigure(setting, measure, float(line[measure])) for measure in ("SP_percent", "CE_episode")]


@cache
def optimum_s(case: str, toasts: int) -> float:
    """The printed shortest makespan [s]."""
    lines = printed_lines("optimal-makespans.csv")
    return next(
        float(line["optimum_seconds"]) for line in lines if (line["case"], line["toasts"]) == (case, str(toasts))
    )


@lru_cache(maxsize=16)
def robot_cell(case: str, toasts: int) -> Cell:
    """The thesis's toast cell with the times of a case."""
    from lab.tasks.cell_file import TOAST_CASES
    from lab.tasks.task_file import load_cell

    return load_cell(TOAST_CASES[case]).cell(toasts)


def epsilons(setting: SequencingSetting) -> Floats:
    """The exploration probability of each episode (E,), eq. 5.1; 1 without a beta, as in random search."""
    numbers = np.arange(1, setting.episodes + 1, dtype=np.float64)
    return np.asarray(numbers ** -(setting.beta or 0.0))


def sessions_of(setting: SequencingSetting, sessions: int, seed: int) -> SequencingOutcome:
    """The results of `sessions` sessions of one setting."""
    reading, seeds = READINGS[setting.reading], seeds_of(setting, sessions, seed)
    cell, drawn = robot_cell(setting.case, setting.toasts), setting.environment == "stochastic"
    if reading is None:
        search = Search(
            setting.episodes,
            chance=Chance("normal", spread=SPREAD) if drawn else NO_CHANCE,
            settings=SrlSettings(beta=setting.beta or 0.0, factor=setting.reward_factor or "B"),
        )
        printed = run_sessions(cell, setting.method, search, sessions, int(seeds[0]))
        return SequencingOutcome(printed.best_cost, printed.final_cost, printed.convergence)
    outcomes = listing.run_sessions(listing_input(setting, SPREAD if drawn else 0.0), epsilons(setting), seeds)
    return SequencingOutcome(outcomes.best_s, outcomes.last_s, outcomes.converged)


def listing_input(setting: SequencingSetting, spread: float = 0.0) -> listing.ListingInput:
    """The input of the listing for a setting."""
    toasts = robot_cell(setting.case, setting.toasts)
    return listing.ListingInput.of(
        toasts, setting.method, setting.reward_factor, READINGS[setting.reading] or LISTING, spread
    )


class Measured:
    """The outcomes of all settings that are asked for, computed together as the job says."""

    def __init__(self, job: Job, settings: Iterable[SequencingSetting]) -> None:
        self.sessions = job.sessions
        work = partial(sessions_of, sessions=job.sessions, seed=job.seed)
        self.outcomes = job.each(work, list(dict.fromkeys(settings)))

    def succeeds(self, setting: SequencingSetting, times_s: Floats) -> NDArray[np.bool_]:
        """Whether times (N,) are those of the optimum, (N,) bool."""
        return np.asarray(times_s <= optimum_s(setting.case, setting.toasts) + SAME)

    def row(self, table: str, setting: SequencingSetting, measure: str, thesis: float | None, **more: Any) -> Row:
        """One row of a study; more: further fields after the settings. Source: section 7.6 (SP, CE, BR)."""
        named, outcome = {"table": table, **describe(setting), **more}, self.outcomes[setting]
        theirs = printed_sessions(table, setting.toasts)
        if measure in ("BR_s", "CE_episode"):
            result = mean_row(
                named, measure, outcome.best_s if measure == "BR_s" else outcome.converged, thesis, theirs
            )
        else:
            times_s = outcome.last_s if measure == "final_percent" else outcome.best_s
            result = share_row(named, measure, self.succeeds(setting, times_s), thesis, theirs)
        return result if thesis is None else result | {"used": is_used_7(table, setting.reward_factor, setting.toasts)}

    def replicated(self, setting: SequencingSetting) -> Floats:
        """The SP [%] of each of ten replications, or the BR [s] if times are random."""
        values = self.outcomes[setting].best_s
        if setting.environment == "deterministic":
            values = np.where(self.succeeds(setting, values), 100.0, 0.0)
        return part_means(values, REPLICATIONS)

    def compared(self, settings: Sequence[SequencingSetting]) -> Comparison:
        """The comparison of several methods or reward factors at one session length (Appendix II)."""
        groups = {short_name(setting): self.replicated(setting) for setting in settings}
        return compare(groups, lowest_is_best=settings[0].environment == "stochastic")


def printed_sessions(table: str, toasts: int) -> int:
    """The number of sessions that the thesis ran for each cell of a table."""
    return DECAY_SESSIONS if table == DECAY_TABLE else PRINTED_SESSIONS[toasts]


def describe(setting: SequencingSetting) -> Row:
    """The fields of a setting that apply to it, as in rows."""
    names = ("environment", "case", "toasts", "method", "reward_factor", "beta", "episodes", "reading")
    return {name: getattr(setting, name) for name in names if getattr(setting, name) is not None}


def short_name(setting: SequencingSetting) -> str:
    """The short name of a setting's method, such as "srl B" or "mc"."""
    return " ".join(part for part in (setting.method, setting.reward_factor) if part)
