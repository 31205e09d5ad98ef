"""The sessions of chapter 9: who advises in which world, when the learner asks, and their results."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import BoolArray, FloatArray, TabularMDP, optimal_values, shortest_steps
from lab.studies.runner import Job, said, seeds_of
from lab.tasks.grid_world import AdvisorView, GridWorld

if TYPE_CHECKING:
    from lab.learning.batch import Batch

FORMAT = 1  # of stored results; those of another format are computed again
LEARNED_EPISODES, LEARNED_BETA, LEARNED_SEED = 1000, 0.7, 14
EXAMPLES = 100  # sessions, of which the first successful one is shown

Count = NDArray[np.int64]
# settings on which no result depends, see `gate_of`: of gates that the thesis does not have
OTHER_GATES = (
    *("spare_best", "by_evidence", "fading", "reuse", "bonus", "consistency", "warming", "exploring", "trust"),
    *("wandering", "retry", "strikes", "agreement", "margin"),
)


@dataclass(frozen=True)
class AdviceSetting:
    """One cell of a table: a world, who advises there, and when the learner asks.

    tau None: nobody advises. lambda_threshold, omega, psi: of the gates that have them. advisor_table: "exact" optimal
    values, or "learned" (see `learned_table`). beta and learner None: the world's own. judge_unhelped, memory: see
    GateSettings. success: the "last" episode took the shortest path, or "any" did. table_seed: another learned table.
    wrong: the advisor takes the worst action for the best.
    """

    world: str
    view: Literal["full", "limited"] = "full"
    gate: str = "never"
    tau: float | None = None
    lambda_threshold: float | None = None
    omega: int | None = None
    psi: float | None = None
    beta: float | None = None
    advisor_table: Literal["exact", "learned"] = "learned"
    learner: str | None = None
    judge_unhelped: bool | None = None
    success: Literal["last", "any"] = "last"
    table_seed: int | None = None
    memory: bool = False
    wrong: bool = False

    def __post_init__(self) -> None:
        for name in ("tau", "lambda_threshold", "psi", "beta"):  # 1 and 1.0 are the same setting
            if getattr(self, name) is not None:
                object.__setattr__(self, name, float(getattr(self, name)))

    def key(self, sessions: int, seed: int) -> str:
        """The key of this setting's results among all stored ones."""
        place = world(self.world).model_dump(mode="json")
        for name in OTHER_GATES:
            del place["gate"][name]
        if place["deadly"]:  # as all worlds were, when keys did not say it
            del place["deadly"]
        for name, off in (("tilings", 1), ("start_value", 0.0)):
            if place["learner"][name] == off:
                del place["learner"][name]
        learned = (LEARNED_EPISODES, LEARNED_BETA, LEARNED_SEED)
        whole = [FORMAT, asdict(self, dict_factory=said), sessions, seed, place, *learned]
        return sha256(json.dumps(whole).encode()).hexdigest()[:24]


@dataclass(frozen=True, eq=False)
class AdviceOutcome:
    """The results of N sessions, (N,) each: whether they succeeded (see `AdviceSetting`), helped steps and requests."""

    success: BoolArray
    helped_steps: Count
    requests: Count

    def to_json(self) -> dict[str, list[int]]:
        """The result as lists."""
        return {name: np.asarray(value, np.int64).tolist() for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, record: dict[str, list[int]]) -> "AdviceOutcome":
        """What `to_json` wrote. Raises KeyError, TypeError, ValueError or OverflowError for anything else."""
        success, helped, requests = (np.array(record[n], np.int64) for n in ("success", "helped_steps", "requests"))
        return cls(success.astype(bool), helped, requests)


def measured(job: Job, settings: Sequence[AdviceSetting]) -> dict[AdviceSetting, AdviceOutcome]:
    """The outcome of every setting; the job's folder keeps them, also after Ctrl-C.

    Raises WorkFailed if the folder cannot be written or the cluster cannot be reached.
    """
    distinct = list(dict.fromkeys(settings))
    keys = {setting.key(job.sessions, job.seed): setting for setting in distinct}

    done: dict[AdviceSetting, AdviceOutcome] = job.kept_as(
        lambda entry: (keys[entry["key"]], AdviceOutcome.from_json(entry))
    )
    left = [setting for setting in distinct if setting not in done]
    job.progress(len(done), len(distinct))
    for setting, outcome in job.computed(partial(sessions_of, sessions=job.sessions, seed=job.seed), left):
        done[setting] = outcome
        job.keep({"key": setting.key(job.sessions, job.seed), "setting": asdict(setting), **outcome.to_json()})
        job.progress(len(done), len(distinct))
    return {setting: done[setting] for setting in distinct}


def sessions_of(setting: AdviceSetting, sessions: int, seed: int) -> AdviceOutcome:
    """The outcome of `sessions` sessions of one setting."""
    batch = _learned(setting, seeds_of(setting, sessions, seed))
    return AdviceOutcome(succeeded(setting, batch.steps), batch.helped_steps, batch.requests)


def example_session(setting: AdviceSetting, seed: int) -> tuple[NDArray[np.int32], BoolArray]:
    """The steps and guided episodes (E,) of the first successful session of a setting, of EXAMPLES."""
    batch = _learned(setting, seeds_of(setting, EXAMPLES, seed))
    n = int(np.argmax(succeeded(setting, batch.steps)))
    return batch.steps[n], batch.guided[n]


def succeeded(setting: AdviceSetting, steps: NDArray[np.integer[Any]]) -> BoolArray:
    """Whether each session took the shortest path, (N,) bool, by the steps of its episodes (N, E)."""
    shown = steps[:, -1] if setting.success == "last" else steps.min(axis=1)
    return np.asarray(shown == shortest_steps(problem(setting.world)) + world(setting.world).learner.count_start)


@lru_cache(maxsize=128)
def world(name: str) -> GridWorld:
    """The world of that name or file, read once."""
    from lab.tasks.task_file import load_world

    return load_world(name)


@lru_cache(maxsize=128)
def problem(name: str) -> TabularMDP:
    """The world of that name or file as a decision problem."""
    return world(name).mdp()


@lru_cache(maxsize=128)
def known_values(name: str, seed: int | None) -> FloatArray:
    """What an advisor knows in the world of that name, (S, A): the table learned with a seed, for None the exact values."""
    return (
        optimal_values(problem(name), world(name).learner.discount)
        if seed is None
        else learned_table(world(name), seed)
    )


def limited_view(place: GridWorld) -> BoolArray:
    """Whether an advisor with a limited view sees the robot in each state, (S,) bool.

    A world without a view has the middle half of each axis, 6 x 6 x 6 of 10 x 10 x 10 cells; the views of the thesis's worlds
    have 5 x 7 x 6 and 5 x 5 x 7.
    """
    middle = AdvisorView(lower=tuple(n // 4 for n in place.shape), upper=tuple(n - n // 4 - 1 for n in place.shape))
    return place.model_copy(update={"view": place.view or middle}).region()


def learned_table(place: GridWorld, seed: int = LEARNED_SEED) -> FloatArray:
    """The advisor's table (S, A) float64, learned alone in 1000 episodes that begin in any free cell.

    The thesis loads a table without naming its source; of the recipes that the study `readings` compares, this one comes
    nearest to the printed values.
    """
    from lab.learning.batch import run_sessions

    mdp = place.mdp()
    anywhere = replace(mdp, starts=tuple(np.flatnonzero(~mdp.terminal).tolist()))
    learner = replace(place.learner, episodes=LEARNED_EPISODES, beta=LEARNED_BETA, count_start=False)
    seeds = np.array([seed], np.uint64)
    table: FloatArray = run_sessions(anywhere, learner, GateSettings("never"), None, seeds, keep_tables=True).q[0]
    return table


def walk_of_advisor(place: GridWorld, table: FloatArray, tau: float, walks: int = 1000) -> NDArray[np.int32]:
    """The steps (walks,) of an advisor that follows its own advice; max_steps + 1 if it does not arrive (fig. 9.1)."""
    from lab.learning.batch import run_sessions
    from lab.learning.simulated_advice import Advice, advice_chances

    learner = replace(place.learner, episodes=1)
    advice = Advice.of(advice_chances(table, tau))
    seeds = np.arange(walks, dtype=np.uint64)
    return run_sessions(place.mdp(), learner, GateSettings("always"), advice, seeds).steps[:, 0]


def table_of(setting: AdviceSetting) -> FloatArray:
    """What the advisor of a setting knows, (S, A)."""
    learned = LEARNED_SEED if setting.table_seed is None else setting.table_seed
    return known_values(setting.world, learned if setting.advisor_table == "learned" else None)


def learner_of(setting: AdviceSetting) -> LearnerSettings:
    """The world's learner, changed by the setting."""
    return replace(world(setting.world).learner, **_given(setting, "beta", "learner"))


def gate_of(setting: AdviceSetting, gate: GateSettings) -> GateSettings:
    """The world's gate, changed by the setting, with misleads judged as in the thesis."""
    names = ("gate", "lambda_threshold", "omega", "psi", "judge_unhelped", "memory")
    return replace(gate, **{"spare_best": False} | _given(setting, *names))


def _given(setting: AdviceSetting, *names: str) -> dict[str, Any]:
    return {name: getattr(setting, name) for name in names if getattr(setting, name) is not None}


def _learned(setting: AdviceSetting, seeds: NDArray[np.uint64]) -> "Batch":
    from lab.learning.batch import run_sessions
    from lab.learning.simulated_advice import Advice, advice_chances

    place, advice = world(setting.world), None
    if setting.tau is not None:
        table = -table_of(setting) if setting.wrong else table_of(setting)
        advice = Advice.of(
            advice_chances(table, setting.tau), limited_view(place) if setting.view == "limited" else None
        )
    gate = gate_of(setting, place.gate)
    return run_sessions(problem(setting.world), learner_of(setting), gate, advice, seeds)
