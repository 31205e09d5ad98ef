"""How fast sessions are: the compiled kernel, alone and with gates, beside rivals, all in one run on one core."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from lab.learning.batch import run_sessions
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.studies.findings import Findings, Row, agreement, median_row
from lab.studies.ours.learning_speed_rivals import RIVALS
from lab.studies.ours.learning_speed_session import Missing
from lab.studies.runner import Job
from lab.studies.thesis.chapter_9_sessions import learned_table, world

SESSIONS = 500
ABOUT = (
    "{} sessions of 200 episodes in world I, one process on one core, median of five runs; compile time is not counted. "
    "The kernel walks many sessions side by side, so a few of them leave it half empty; the C program does one after "
    "the other. Rivals run at most 500 sessions, the tutorial loop 5: their figure is a rate."
)
FEW = {"gymnasium tutorial loop": 5}  # sessions of a rival so slow that its rate shows with few
REPEATS = 5
GATES = (GateSettings("ccrl", omega=1), GateSettings("ia"), GateSettings("combined", omega=1))


def speed(job: Job, reading: Mapping[str, Any]) -> Findings:
    """Million environment steps a second in world I, median of five runs; the reading changes nothing here."""
    place = world("world-1")
    mdp, learner = place.mdp(), place.learner
    advice = Advice.of(advice_chances(learned_table(place), 0.1))
    seeds = np.arange(job.seed, job.seed + job.sessions, dtype=np.uint64)

    def learned(*gates: GateSettings) -> tuple[int, float]:
        began, moves = time.perf_counter(), 0
        for gate in gates:
            moves += int(run_sessions(mdp, learner, gate, advice, seeds).moves.sum())
        return moves, time.perf_counter() - began

    def against(name: str) -> tuple[int, float]:
        measured = RIVALS[name](mdp, learner, min(FEW.get(name, SESSIONS), job.sessions), job.seed)
        return measured.moves, measured.seconds

    rows = [_row("kernel", partial(learned, GateSettings("never"))), _row("kernel gated", partial(learned, *GATES))]
    missing = []
    for number, name in enumerate(RIVALS):
        job.progress(number, len(RIVALS))
        try:
            rows.append(_row(name, partial(against, name)))
        except Missing as error:
            missing.append(f"{name}: not measured: {error}")
    job.progress(len(RIVALS), len(RIVALS))
    fastest = max(one["value"] for one in rows[2:]) if len(rows) > 2 else None
    summary = agreement(rows) | {
        "kernel to the fastest rival": None if fastest is None else round(rows[0]["value"] / fastest, 2)
    }
    return Findings(rows, summary, {}, (ABOUT.format(job.sessions), *missing))


def _row(name: str, run: Callable[[], tuple[int, float]]) -> Row:
    run()  # compiles
    rates = [moves / seconds / 1e6 for moves, seconds in (run() for _ in range(REPEATS))]
    return median_row({"name": name, "world": "world-1"}, "speed_million steps per s", rates)
