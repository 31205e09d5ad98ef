"""The speed of the sequencers: episodes per second, seconds to the optimum and to a proof, in one run on one core."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from itertools import chain
from math import inf, isfinite
from typing import Any

import numpy as np

from lab.sequencing import SEQUENCERS
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.session_readable import learn_readably
from lab.sequencing.methods.srl import Srl
from lab.sequencing.search import EpisodeSequenced, Search, SrlSettings
from lab.studies.findings import Findings, Row, agreement, median_row, row, those
from lab.studies.runner import Job
from lab_studies.many_sessions import run_sessions
from lab_studies.thesis.chapter_7_cells import robot_cell

CASES = ("I", "II", "III")
EPISODES, TOASTS = 400, 4  # of the sessions whose rate is measured
READABLE_SESSIONS = 3  # few sessions show the rate of readable ones
PROVEN = (30, 100)  # toasts
MANY, MANY_EPISODES, MANY_SESSIONS = 30, 1000, 10
NEAR = 0.01  # the gap to the optimum, as a fraction, that counts as near
CP_SAT_LIMIT_S = 60.0
REPEATS = 5
RATE, SECONDS = "speed_thousand episodes per s", "wall_s"
ABOUT = (
    f"One process on one core, the median of {REPEATS} runs with the lowest and the highest; compiling is not counted. Rates: "
    f"SRL of type B and random search, {{}} sessions of {EPISODES} episodes, {TOASTS} toasts in case I; 'readable' is the same "
    f"session in plain Python, {READABLE_SESSIONS} of them. exact: seconds to the proof."
)
ABOUT_MANY = (
    f"{MANY} toasts: the seconds of srl-time until its best sequence is within {NEAR:.0%} of the optimum, median of the sessions "
    f"({MANY_SESSIONS} at most; the interval is the fastest and the slowest). CP-SAT: the gap of its best sequence after "
    "{:g} s with one thread, without building the model; it begins with the sequence of first come, first served."
)


def sequencing_speed(job: Job, reading: Mapping[str, Any]) -> Findings:
    """Rates, seconds and their ratios; the reading has no effect."""
    steps: list[Callable[[], list[Row]]] = [
        *(partial(_rate, name, run) for name, run in _rated(job).items()),
        *(partial(_proof, case, toasts) for toasts in PROVEN for case in CASES),
        *(partial(near_rows, case, job) for case in CASES),
        *(partial(solved_rows, case, job.seed) for case in CASES),
    ]
    measured = job.in_turn(steps)
    rates, learned, solved = measured[:3], measured[-2 * len(CASES) : -len(CASES)], measured[-len(CASES) :]
    notes = (ABOUT.format(job.sessions), ABOUT_MANY.format(CP_SAT_LIMIT_S))
    rows = list(chain(*measured))
    summary = ratios(*(list(chain(*some)) for some in (rates, learned, solved)))
    return Findings(rows, summary | agreement(rows), {}, notes)


def _rated(job: Job) -> dict[str, Callable[[], int]]:
    """The functions that are timed, by name; each returns the number of its episodes."""
    cell, search = robot_cell("I", TOASTS), Search(EPISODES, settings=SrlSettings(beta=0.5, factor="B"))

    def compiled(method: str) -> int:
        run_sessions(cell, method, search, job.sessions, job.seed)
        return job.sessions * EPISODES

    def readable() -> int:
        for seed in range(READABLE_SESSIONS):
            learn_readably(cell, search, seed, Srl)
        return READABLE_SESSIONS * EPISODES

    return {
        "srl, compiled": partial(compiled, "srl"),
        "random, compiled": partial(compiled, "random"),
        "srl, readable": readable,
    }


def _rate(name: str, run: Callable[[], int]) -> list[Row]:
    run()  # compiles
    rates = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        rates.append(run() / (time.perf_counter() - began) / 1e3)
    named: Row = {"name": name, "case": "I", "toasts": TOASTS}
    return [median_row(named | ({"reward_factor": "B"} if name.startswith("srl") else {}), RATE, rates)]


def _proof(case: str, toasts: int) -> list[Row]:
    """The row of the seconds to the proof, or, under another name, to the end of a search without one."""
    cell, seconds, proven = robot_cell(case, toasts), list[float](), True
    for _ in range(REPEATS):
        began = time.perf_counter()
        proven &= optimum(cell).proven
        seconds.append(time.perf_counter() - began)
    name = "exact" if proven else "exact, not proven"
    return [median_row({"name": name, "case": case, "toasts": toasts}, SECONDS, seconds)]


def near_rows(case: str, job: Job) -> list[Row]:
    """Rows of the share of srl-time's sessions that come near the optimum, and, if all do, of the seconds until then."""
    cell, seconds = robot_cell(case, MANY), list[float]()
    near_cost = (1.0 + NEAR) * optimum(cell).bound_s
    for session in range(min(job.sessions, MANY_SESSIONS)):
        reached, began = [inf], time.perf_counter()

        def listen(tried: EpisodeSequenced, reached: list[float] = reached, began: float = began) -> None:
            if tried.best_cost <= near_cost:
                reached[0] = min(reached[0], time.perf_counter() - began)

        rng = np.random.default_rng([job.seed, session])
        SEQUENCERS["srl-time"](cell, Search(MANY_EPISODES, on_episode=listen), rng)
        seconds.append(reached[0])
    return rows_of_near(case, seconds)


def rows_of_near(case: str, seconds: list[float]) -> list[Row]:
    """The rows of the sessions' seconds until they came near, inf for one that never did."""
    named: Row = {"name": "srl-time, near the optimum", "case": case, "toasts": MANY}
    near = row(named, "near_percent", 100.0 * sum(map(isfinite, seconds)) / len(seconds))
    return [near, median_row(named, SECONDS, seconds)] if near["value"] == 100.0 else [near]


def solved_rows(case: str, seed: int) -> list[Row]:
    """The rows of CP-SAT's gap after its time limit, and of its seconds."""
    cell = robot_cell(case, MANY)
    best, solved = optimum(cell), cp_sat(cell, time_limit_s=CP_SAT_LIMIT_S, seed=seed)
    named: Row = {"name": "cp-sat", "case": case, "toasts": MANY, "limit_s": CP_SAT_LIMIT_S}
    gap = max(0.0, 100.0 * best.gap(solved.cost))
    return [row(named, "gap_percent", gap), row(named, SECONDS, solved.wall_s)]


def ratios(rates: list[Row], learned: list[Row], solved: list[Row]) -> Row:
    """The ratios of speeds; CP-SAT needs at least its time limit where its sequence was not near the optimum by then."""
    fast, random, slow = (result["value"] for result in rates)
    says: Row = {
        "compiled to readable SRL": round(fast / slow, 1),
        "random search to SRL, both compiled": round(random / fast, 2),
    }
    for result in those(learned, measure=SECONDS):
        other = {own["measure"]: own["value"] for own in those(solved, case=result["case"])}
        far = other.get("gap_percent", 0.0) > 100.0 * NEAR
        ratio = round(other[SECONDS] / result["value"]) if far else None
        says[f"CP-SAT's seconds to srl-time's, case {result['case']}, at least"] = ratio
    return says
