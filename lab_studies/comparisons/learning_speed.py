"""The speed of sessions: the compiled kernel, alone and with gates, compared with rivals, all in one run on one core."""

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any

import numpy as np

from lab.learning.batch import is_compiled, run_sessions
from lab.learning.gates import GATES as FAMILY
from lab.learning.gates import RuleGate, Steps
from lab.learning.gates.gate import Values
from lab.learning.gates.rule_gate import GateNow
from lab.learning.own_rules import Uncompiled
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.studies.findings import Findings, Row, agreement, median_row, those
from lab.studies.runner import Job
from lab_studies.comparisons.learning_speed_rivals import C_LANES, RIVALS
from lab_studies.comparisons.learning_speed_session import Measured, Missing
from lab_studies.thesis.chapter_9_sessions import learned_table, world

SESSIONS = 500
ABOUT = (
    "{} sessions of 200 episodes in world I, one process on one core, median of five runs; compile time is not counted. "
    "The kernel runs many sessions side by side, so that a few of them leave it half empty; 'c scalar' runs one after the "
    "other, 'c lanes' one in each SIMD lane of the processor, in single precision. Rivals run at most 500 sessions, the "
    "tutorial loop 5, as their figure is a rate. 'kernel' and 'kernel gated' learn by the world's own learner, the others by the "
    "one that they name. 'kernel q ia' learns by q and asks an advisor of tau 0.1 as the gate ia does; 'session' in its place "
    "says that it is not compiled, and runs 5 sessions. 'own rule' is a gate of other code whose decisions are functions, "
    "'own gate' one that decides the same in methods. These rows count processor time, which others on the computer disturb less."
)
FEW = {"gymnasium tutorial loop": 5}  # the sessions of a rival so slow that few show its rate
REPEATS = 5
Clock = Callable[[], float]  # [s]
UNCOMPILED = 5  # the sessions of what is not compiled, whose figure is a rate, too
LEARNERS = ("q", "sarsa", "q-lambda", "sarsa-lambda", "dyna-q", "afterstate")
GATES = (GateSettings("ccrl", omega=1), GateSettings("ia"), GateSettings("combined", omega=1))
ALONE = GateSettings("never")
OTHERS = tuple(GateSettings(name) for name in ("uncertainty", "earned-trust", "advice-reuse"))
BESIDE = {gate.gate: gate for gate in (ALONE, *GATES, *OTHERS)}  # the gates measured with each learner


class OwnRule(RuleGate):
    """As ia, in functions."""

    @staticmethod
    def opens_rule(episode: int, steps: Steps, now: GateNow, settings: GateSettings) -> bool:
        """Every episode from X on may ask."""
        return episode >= settings.first_episode

    @staticmethod
    def asks_rule(state: int, values: Values, now: GateNow, settings: GateSettings) -> bool:
        """Whether the values span at most Psi."""
        return max(values) - min(values) <= settings.psi


class OwnGate(OwnRule):
    """The same in methods, which run in the session only."""

    def begins(self, state: int) -> None:
        """Does nothing; that it is overridden keeps the gate from being compiled."""


OWN: dict[str, type[OwnRule]] = {"own rule": OwnRule, "own gate": OwnGate}


def speed(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The speeds in world I [million environment steps per second], median of five runs; the reading has no effect."""
    place = world("world-1")
    mdp, learner = place.mdp(), place.learner
    advice = Advice.of(advice_chances(learned_table(place), 0.1))
    seeds = np.arange(job.seed, job.seed + job.sessions, dtype=np.uint64)

    def learned(
        *gates: GateSettings, how: LearnerSettings = learner, most: int = job.sessions, clock: Clock = time.perf_counter
    ) -> Measured:
        began, moves = clock(), 0
        for gate in gates:
            moves += int(run_sessions(mdp, how, gate, advice, seeds[:most]).moves.sum())
        return Measured(moves, clock() - began)

    def beside(name: str, gate: GateSettings) -> Row:
        """The row of a learner with a gate."""
        how = replace(learner, learner=name)
        compiled = is_compiled(mdp, how, gate, advice)
        most = min(SESSIONS if compiled else UNCOMPILED, job.sessions)
        kind = "kernel" if compiled else "session"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Uncompiled)
            run = partial(learned, gate, how=how, most=most, clock=time.process_time)
            return _row(f"{kind} {name} {gate.gate}", run)

    def against(name: str) -> Row | str:
        """The row of a rival, or the reason why there is none."""
        sessions = min(FEW.get(name, SESSIONS), job.sessions)
        try:
            return _row(name, lambda: RIVALS[name](mdp, learner, sessions, job.seed))
        except Missing as error:
            return f"{name}: not measured: {error}"

    rows = [_row("kernel", partial(learned, ALONE)), _row("kernel gated", partial(learned, *GATES))]
    rows += [_row(f"kernel {name}", partial(learned, ALONE, how=replace(learner, learner=name))) for name in LEARNERS]
    greedy = replace(learner, learner="q", selection="epsilon-greedy")
    rows.append(_row("kernel q epsilon-greedy", partial(learned, ALONE, how=greedy)))
    gates = [*BESIDE.values(), *(GateSettings(FAMILY.use(name, gate)) for name, gate in OWN.items())]
    rows += [beside(name, gate) for name in LEARNERS for gate in gates]
    measured = job.in_turn([partial(against, name) for name in RIVALS])
    rivals = [result for result in measured if not isinstance(result, str)]
    fastest = max((row["value"] for row in rivals), default=inf)
    lanes = those(rivals, name=C_LANES)
    missing = [result for result in measured if isinstance(result, str)]
    summary = agreement(rows + rivals) | {
        "kernel to the fastest rival": round(rows[0]["value"] / fastest, 2) if rivals else None,
        "kernel to C lanes": round(rows[0]["value"] / lanes[0]["value"], 2) if lanes else None,
    }
    return Findings(rows + rivals, summary, {}, (ABOUT.format(job.sessions), *missing))


def _row(name: str, run: Callable[[], Measured]) -> Row:
    run()  # compiles
    rates = [measured.moves / measured.seconds / 1e6 for measured in (run() for _ in range(REPEATS))]
    return median_row({"name": name, "world": "world-1"}, "speed_million steps per s", rates)
