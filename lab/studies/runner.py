"""Runs the sessions that a study asks for: in this process, in several, or on a Dask cluster, always the same ones.

The chance of a session depends on the study's seed and on its own setting only. What is done is written to a file at
once, a line a setting, and not done again.
"""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, LabError, WorkFailed
from lab.gridworld import GridWorld
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, TabularMDP, optimal_values, shortest_steps

if TYPE_CHECKING:
    from lab.learning.batch import Batch

FORMAT = 1  # of what is stored; another one is computed anew
STORE = "sessions.jsonl"
PARENT_LOOK_S = 0.2  # how often a worker looks whether its parent is still there
Progress = Callable[[int, int], None]  # settings done, of how many
Count = NDArray[np.int64]
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Setting:
    """One cell of a table: a world, who advises there, and when the learner asks.

    tau None: nobody advises. lambda_threshold, omega and psi are those of the gates that have them. advisor_table:
    "exact" optimal values, or "learned" (see `learned_values`). beta and learner None: the world's own. judge_unhelped:
    see GateSettings. success: the "last" episode took the shortest way, or "any" did. table_seed: another learned table.
    memory: advice is remembered, see GateSettings; wrong: the advisor takes the worst action for the best.
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
        """What names this setting's results among all that are stored."""
        place = world(self.world).model_dump(mode="json")
        whole = [
            FORMAT,
            asdict(self, dict_factory=_named),
            sessions,
            seed,
            place,
            LEARNED_EPISODES,
            LEARNED_BETA,
            LEARNED_SEED,
        ]
        return sha256(json.dumps(whole).encode()).hexdigest()[:24]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What N sessions came to, one number each (N,): whether they succeeded (see `Setting`), and the advice in them."""

    success: NDArray[np.bool_]
    helped_steps: Count
    requests: Count

    def to_json(self) -> dict[str, list[int]]:
        """Plain lists."""
        return {name: np.asarray(getattr(self, name), np.int64).tolist() for name in _FIELDS}

    @classmethod
    def from_json(cls, record: dict[str, list[int]]) -> "Outcome":
        """What `to_json` wrote. Raises KeyError, TypeError or ValueError for anything else."""
        success, helped, requests = (np.array(record[name], np.int64) for name in _FIELDS)
        if not success.shape == helped.shape == requests.shape == (len(success),):
            raise ValueError("three lists of one length are wanted")
        return cls(success.astype(bool), helped, requests)


def _named(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """What seeds and stored results go by: a switch that was added later counts only where it is on."""
    return {name: value for name, value in pairs if name not in ("memory", "wrong") or value}


_FIELDS = ("success", "helped_steps", "requests")


@dataclass(frozen=True)
class Job:
    """How a study is run: sessions a setting, the seed, by how many processes or on which cluster, and where it is kept."""

    sessions: int = 500
    seed: int = 0
    workers: int = 1
    dask: str | None = None
    folder: Path | None = None
    progress: Progress = lambda done, total: None

    def run(self, settings: Sequence[Setting]) -> dict[Setting, Outcome]:
        """The outcome of every setting; those that the folder holds are read, the others computed and kept there.

        Raises WorkFailed when the folder cannot be written or the cluster cannot be reached. After Ctrl-C all that is
        finished is kept.
        """
        wanted = list(dict.fromkeys(settings))
        keys = {setting.key(self.sessions, self.seed): setting for setting in wanted}
        done = {
            keys[key]: found for key, found in self._stored() if key in keys and len(found.success) == self.sessions
        }
        left = [setting for setting in wanted if setting not in done]
        self.progress(len(done), len(wanted))
        for setting, outcome in self._computed(partial(sessions_of, sessions=self.sessions, seed=self.seed), left):
            done[setting] = outcome
            self._keep(setting, outcome)
            self.progress(len(done), len(wanted))
        return {setting: done[setting] for setting in wanted}

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> dict[Item, Result]:
        """What `work`, a function of a module, makes of each item, done where the job says; nothing is kept in the folder."""
        wanted = list(dict.fromkeys(items))
        done: dict[Item, Result] = {}
        self.progress(0, len(wanted))
        for item, result in self._computed(work, wanted):
            done[item] = result
            self.progress(len(done), len(wanted))
        return {item: done[item] for item in wanted}

    def _computed(self, work: Callable[[Item], Result], items: list[Item]) -> Iterator[tuple[Item, Result]]:
        if self.dask is not None:
            yield from _on_cluster(work, items, self.dask)
        elif self.workers == 1 or len(items) <= 1:
            yield from ((item, work(item)) for item in items)
        else:
            from joblib import Parallel, delayed

            pool = Parallel(
                self.workers,
                return_as="generator",
                batch_size=4,
                initializer=_end_with_parent,
                initargs=(os.getpid(),),
            )
            yield from zip(items, pool(delayed(work)(item) for item in items), strict=True)

    def _stored(self) -> Iterator[tuple[str, Outcome]]:
        path = None if self.folder is None else self.folder / STORE
        if path is None or not path.is_file():
            return
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                entry = json.loads(line)
                key, outcome = str(entry["key"]), Outcome.from_json(entry)
            except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
                continue  # cut off, or not ours: computed anew
            yield key, outcome

    def _keep(self, setting: Setting, outcome: Outcome) -> None:
        if self.folder is None:
            return
        line = {"key": setting.key(self.sessions, self.seed), "setting": asdict(setting), **outcome.to_json()}
        path = self.folder / STORE
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            cut = path.is_file() and not path.read_bytes().endswith(b"\n")
            with path.open("a", encoding="utf-8") as file:
                file.write(("\n" if cut else "") + json.dumps(line) + "\n")
        except OSError as error:
            raise WorkFailed(f"output folder '{self.folder}' (--out) cannot be written: {error.strerror}") from error


def _end_with_parent(parent: int) -> None:
    """Ends this process soon after its parent's end, which may be a kill -9 that leaves no time to say so."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_LOOK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _on_cluster(work: Callable[[Item], Result], items: list[Item], address: str) -> Iterator[tuple[Item, Result]]:
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise BadInput(f"--dask {address}: Dask is not installed: pip install 'teaching-lab[dask]'") from None
    try:
        client = Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise WorkFailed(f"--dask {address}: no cluster answers there: {error}") from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise WorkFailed(f"--dask {address}: the cluster has no workers")
        tasks = {client.submit(work, item, pure=False): item for item in items}
        for task in as_completed(tasks):  # type: ignore[no-untyped-call]
            try:
                found = task.result()
            except LabError:
                raise
            except Exception as error:  # whatever a lost worker or scheduler comes to; what is done is kept
                raise WorkFailed(f"--dask {address}: the cluster gave up: {type(error).__name__}: {error}") from None
            yield tasks[task], found


def world(name: str) -> GridWorld:
    """The world of that name or file, read once."""
    return _world(name)


@lru_cache(maxsize=64)
def _world(name: str) -> GridWorld:
    from lab.taskfile import load_world

    return load_world(name)


@lru_cache(maxsize=64)
def _problem(name: str) -> TabularMDP:
    return world(name).mdp()


LEARNED_EPISODES, LEARNED_BETA, LEARNED_SEED = 1000, 0.7, 14


@lru_cache(maxsize=64)
def learned_values(name: str, seed: int) -> FloatArray:
    """`learned_table` of the world of that name or file."""
    return learned_table(world(name), seed)


def learned_table(place: GridWorld, seed: int = LEARNED_SEED) -> FloatArray:
    """The advisor's table as the thesis may have had it: learned alone, in 1000 episodes that begin in any free cell.

    (S, A) float64. The thesis loads a table and does not say where it came from; this recipe came nearest to its
    figures among those that the study `readings` compares.
    """
    from lab.learning.batch import run_sessions

    mdp = place.mdp()
    anywhere = replace(mdp, starts=tuple(np.flatnonzero(~mdp.terminal).tolist()))
    learner = replace(place.learner, episodes=LEARNED_EPISODES, beta=LEARNED_BETA, count_start=False)
    seeds = np.array([seed], np.uint64)
    table: FloatArray = run_sessions(anywhere, learner, GateSettings("never"), None, seeds, keep_tables=True).q[0]
    return table


@lru_cache(maxsize=64)
def _exact_values(name: str) -> FloatArray:
    return optimal_values(_problem(name), world(name).learner.discount)


def seeds_of(setting: Any, sessions: int, seed: int) -> NDArray[np.uint64]:
    """The seeds (N,) of a setting's sessions, whichever dataclass it is: its own, whoever runs it."""
    digest = sha256(json.dumps(asdict(setting, dict_factory=_named)).encode()).digest()
    rng = np.random.default_rng([seed, int.from_bytes(digest[:8], "big")])
    return rng.integers(2**64, size=sessions, dtype=np.uint64)


def sessions_of(setting: Setting, sessions: int, seed: int) -> Outcome:
    """Learns so many sessions of one setting."""
    batch, learner = _learned(setting, seeds_of(setting, sessions, seed))
    shortest = shortest_steps(_problem(setting.world)) + learner.count_start
    shown = batch.steps[:, -1] if setting.success == "last" else batch.steps.min(axis=1)
    return Outcome(shown == shortest, batch.helped_steps, batch.requests)


def example(setting: Setting, seed: int) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Steps and guided episodes (E,) of the first session of a setting that ends on the shortest way, of 100."""
    batch, learner = _learned(setting, seeds_of(setting, 100, seed))
    shortest = shortest_steps(_problem(setting.world)) + learner.count_start
    n = int(np.argmax(batch.steps[:, -1] == shortest))
    return batch.steps[n], batch.guided[n]


def walk_of_advisor(place: GridWorld, table: FloatArray, tau: float, walks: int = 1000) -> NDArray[np.int32]:
    """The steps (walks,) of an advisor who walks by own advice alone; max_steps + 1 where it does not arrive (fig. 9.1)."""
    from lab.advice.advisors import Advice, skill
    from lab.learning.batch import run_sessions

    learner = replace(place.learner, episodes=1)
    advice = Advice.of(skill(table, tau))
    seeds = np.arange(walks, dtype=np.uint64)
    return run_sessions(place.mdp(), learner, GateSettings("always"), advice, seeds).steps[:, 0]


def _learned(setting: Setting, seeds: NDArray[np.uint64]) -> tuple["Batch", LearnerSettings]:
    from lab.advice.advisors import Advice, skill
    from lab.learning.batch import run_sessions

    place = world(setting.world)
    changes = {name: getattr(setting, name) for name in ("beta", "learner") if getattr(setting, name) is not None}
    learner = replace(place.learner, **changes)
    advice = None
    if setting.tau is not None:
        learned = setting.advisor_table == "learned"
        seed = LEARNED_SEED if setting.table_seed is None else setting.table_seed
        table = learned_values(setting.world, seed) if learned else _exact_values(setting.world)
        advice = Advice.of(
            skill(-table if setting.wrong else table, setting.tau),
            place.region() if setting.view == "limited" else None,
        )
    gate = gate_of(setting, place.gate)
    return run_sessions(_problem(setting.world), learner, gate, advice, seeds), learner


def gate_of(setting: Setting, gate: GateSettings) -> GateSettings:
    """The world's gate with what the setting says."""
    changes: dict[str, Any] = {
        name: getattr(setting, name)
        for name in ("gate", "lambda_threshold", "omega", "psi", "judge_unhelped", "memory")
        if getattr(setting, name) is not None
    }
    return replace(gate, **changes)
