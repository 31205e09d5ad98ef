"""How fast the sequencers are: episodes a second, seconds to the optimum and to a proof, all in one run on one core."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from math import inf, isfinite
from statistics import median
from typing import Any

import numpy as np

from lab.sequencing import SEQUENCERS
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.many_sessions import run_sessions
from lab.sequencing.methods.session_readable import learn_readably
from lab.sequencing.methods.srl import Srl
from lab.sequencing.search import EpisodeSequenced, Search, SrlSettings
from lab.studies.chapter7 import robot_cell
from lab.studies.chapter9 import Row, agreement, row
from lab.studies.findings import Findings
from lab.studies.runner import Job

CASES = ("I", "II", "III")
EPISODES, TOASTS = 400, 4  # of the sessions whose rate is measured
READABLE_SESSIONS = 3  # its rate shows with few
PROVEN = (30, 100)  # toasts
MANY, MANY_EPISODES, MANY_SESSIONS = 30, 1000, 10
NEAR = 0.01  # above the optimum, as a fraction
CP_SAT_LIMIT_S = 60.0
REPEATS = 5
RATE, SECONDS = "speed_thousand episodes per s", "wall_s"
Timed = tuple[float, float]  # what was done, and in how many seconds
ABOUT = (
    f"One process on one core, median of {REPEATS} runs, lowest and highest beside it; compiling is not counted. Rates: SRL of "
    f"type B and random search, {{}} sessions of {EPISODES} episodes, {TOASTS} toasts in case I; 'readable' is the same session "
    f"in plain Python, {READABLE_SESSIONS} of them. exact: seconds to the proof."
)
ABOUT_MANY = (
    f"{MANY} toasts: srl-time's seconds until its best sequence is within {NEAR:.0%} of the optimum, median of the sessions "
    f"({MANY_SESSIONS} at most; the interval is the fastest and the slowest). CP-SAT: the gap of its best sequence after "
    "{:g} s with one thread, building the model not counted; it begins with the sequence of first come, first served."
)


def sequencing_speed(job: Job, reading: Mapping[str, Any]) -> Findings:
    """Rates, seconds and their ratios; the reading changes nothing here."""
    total = 3 + len(CASES) * (len(PROVEN) + 2)
    tell = _Count(job, total)
    rates = _rates(job, tell)
    proofs = [_proof(case, toasts, tell) for toasts in PROVEN for case in CASES]
    learned, missed, solved = [], list[str](), []
    for case in CASES:
        near_s = _seconds_to_near(case, job)
        learned += _near_rows(case, near_s)
        tell()
        solved += _solved(case, missed, job.seed)
        tell()
    rows = [*rates, *proofs, *learned, *solved]
    notes = (ABOUT.format(job.sessions), ABOUT_MANY.format(CP_SAT_LIMIT_S), *missed)
    return Findings(rows, _ratios(rates, learned, solved) | agreement(rows), {}, notes)


class _Count:
    """Tells the job how much of all is done, one more at each call."""

    def __init__(self, job: Job, total: int) -> None:
        self._job, self._done, self._total = job, -1, total
        self()

    def __call__(self) -> None:
        self._done += 1
        self._job.progress(self._done, self._total)


def _rates(job: Job, tell: Callable[[], None]) -> list[Row]:
    cell = robot_cell("I", TOASTS)
    search = Search(EPISODES, settings=SrlSettings(beta=0.5, factor="B"))

    def compiled(method: str) -> Timed:
        began = time.perf_counter()
        run_sessions(cell, method, search, job.sessions, job.seed)
        return job.sessions * EPISODES, time.perf_counter() - began

    def readable() -> Timed:
        began = time.perf_counter()
        for seed in range(READABLE_SESSIONS):
            learn_readably(cell, search, seed, Srl)
        return READABLE_SESSIONS * EPISODES, time.perf_counter() - began

    named: Row = {"case": "I", "toasts": TOASTS, "reward_factor": "B"}
    rows = []
    for name, run in (
        ("srl, compiled", partial(compiled, "srl")),
        ("random, compiled", partial(compiled, "random")),
        ("srl, readable", readable),
    ):
        run()  # compiles
        rates = [done / seconds / 1e3 for done, seconds in (run() for _ in range(REPEATS))]
        own = named if name.startswith("srl") else {key: named[key] for key in ("case", "toasts")}
        rows.append(row({"name": name, **own}, RATE, median(rates), (min(rates), max(rates)), None))
        tell()
    return rows


def _proof(case: str, toasts: int, tell: Callable[[], None]) -> Row:
    """Seconds to the proof; of a search that gives up, to that, under another name."""
    cell, seconds, proven = robot_cell(case, toasts), list[float](), True
    for _ in range(REPEATS):
        began = time.perf_counter()
        proven &= optimum(cell).proven
        seconds.append(time.perf_counter() - began)
    tell()
    name = "exact" if proven else "exact, not proven"
    named = {"name": name, "case": case, "toasts": toasts}
    return row(named, SECONDS, median(seconds), (min(seconds), max(seconds)), None)


def _seconds_to_near(case: str, job: Job) -> list[float]:
    """Of each session of srl-time, the seconds until it was near enough; inf where it was not."""
    cell = robot_cell(case, MANY)
    wanted, found = (1.0 + NEAR) * optimum(cell).bound_s, []
    for session in range(min(job.sessions, MANY_SESSIONS)):
        reached, began = [inf], time.perf_counter()

        def listen(tried: EpisodeSequenced, reached: list[float] = reached, began: float = began) -> None:
            if tried.best_cost <= wanted:
                reached[0] = min(reached[0], time.perf_counter() - began)

        rng = np.random.default_rng([job.seed, session])
        SEQUENCERS["srl-time"](cell, Search(MANY_EPISODES, on_episode=listen), rng)
        found.append(reached[0])
    return found


def _near_rows(case: str, seconds: list[float]) -> list[Row]:
    """The share of sessions that came near, and where all did, their seconds."""
    named: Row = {"name": "srl-time, near the optimum", "case": case, "toasts": MANY}
    share = 100.0 * sum(map(isfinite, seconds)) / len(seconds)
    rows = [row(named, "near_percent", share, None, None)]
    if share == 100.0:
        rows.append(row(named, SECONDS, median(seconds), (min(seconds), max(seconds)), None))
    return rows


def _solved(case: str, missed: list[str], seed: int) -> list[Row]:
    """CP-SAT's gap after its limit; where it found nothing at all, a word of that is added to `missed`."""
    cell = robot_cell(case, MANY)
    best, found = optimum(cell), cp_sat(cell, time_limit_s=CP_SAT_LIMIT_S, seed=seed)
    if not found.sequence:
        missed.append(f"CP-SAT found no sequence for {MANY} toasts in case {case} within {CP_SAT_LIMIT_S:g} s.")
        return []
    named: Row = {"name": "cp-sat", "case": case, "toasts": MANY, "limit_s": CP_SAT_LIMIT_S}
    gap = max(0.0, 100.0 * best.gap(found.cost))
    return [row(named, "gap_percent", gap, None, None), row(named, SECONDS, found.wall_s, None, None)]


def _ratios(rates: list[Row], learned: list[Row], solved: list[Row]) -> Row:
    """How many times as fast; CP-SAT's seconds are at least those of its limit where its sequence was not near yet."""
    fast, random, slow = (one["value"] for one in rates)
    says: Row = {
        "compiled to readable SRL": round(fast / slow, 1),
        "random search to SRL, both compiled": round(random / fast, 2),
    }
    for one in learned:
        if one["measure"] == SECONDS:
            other = {own["measure"]: own["value"] for own in solved if own["case"] == one["case"]}
            near = other.get("gap_percent", inf) <= 100.0 * NEAR
            if near or not other:
                ratio: float | None = None
            else:
                ratio = round(other[SECONDS] / one["value"])
            says[f"CP-SAT's seconds to srl-time's, case {one['case']}, at least"] = ratio
    return says
