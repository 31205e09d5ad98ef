"""Runs the sessions of a study in this process, in several, or on a Dask cluster, with the same results.

The randomness of a session depends only on the study's seed and on the session's own setting. A study may store finished work
in its folder, one line per setting, so that it is not repeated.
"""

import json
import os
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from lab.errors import BadInput, LabError, WorkFailed
from lab.files import source_hash
from lab.lazy import distributed, joblib, psutil
from lab.optional import require

STORE = "sessions.jsonl"
BATCH = 4  # the most items that a worker is given at once
PARENT_LOOK_S = 0.2  # the interval at which a worker checks whether its parent still runs
Progress = Callable[[int, int], None]  # settings done, of how many
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Job:
    """How a study is run.

    sessions: per setting; seed: of all randomness; workers: the number of processes; dask: the address of a cluster, None for
    none; folder: stores finished work, None for nowhere; progress: called with the numbers of finished and of all settings.
    code: a key of the study's own code, "" for none; work that was stored under another one, or by another lab, is repeated.
    """

    sessions: int = 500
    seed: int = 0
    workers: int = 1
    dask: str | None = None
    folder: Path | None = None
    progress: Progress = lambda done, total: None
    code: str = ""

    @property
    def _code(self) -> str:
        return f"{source_hash()[:16]} {self.code}".strip()

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> dict[Item, Result]:
        """The result of `work`, a module-level function, by item; nothing is stored in the folder."""
        wanted = list(dict.fromkeys(items))
        done: dict[Item, Result] = {}
        self.progress(0, len(wanted))
        for item, result in self.computed(work, wanted):
            done[item] = result
            self.progress(len(done), len(wanted))
        return {item: done[item] for item in wanted}

    def in_turn(self, steps: Sequence[Callable[[], Result]]) -> list[Result]:
        """The result of each step, one after the other in this process, so that each has a core to itself while it is timed."""
        done: list[Result] = []
        self.progress(0, len(steps))
        for step in steps:
            done.append(step())
            self.progress(len(done), len(steps))
        return done

    def computed(
        self, work: Callable[[Item], Result], items: list[Item], most: int = BATCH
    ) -> Iterator[tuple[Item, Result]]:
        """(item, result) pairs, each as soon as it is finished; a process is given at most `most` items at a time.

        Raises BadInput if Dask is not installed, WorkFailed if the cluster cannot be reached or is lost.
        """
        if self.dask is not None:
            yield from _on_cluster(work, items, self.dask)
        elif self.workers == 1 or len(items) <= 1:
            yield from ((item, work(item)) for item in items)
        else:
            # joblib replaces a process that has grown too large; no work is lost
            warnings.filterwarnings("ignore", "A worker stopped while some jobs were given", UserWarning)

            ending: dict[str, Any] = {"initializer": _end_with_parent, "initargs": (os.getpid(),)}
            # if there are few items, each of them takes long and is given out alone
            batch = min(most, max(1, len(items) // (4 * self.workers)))
            pool = joblib.Parallel(min(self.workers, len(items)), return_as="generator", batch_size=batch, **ending)
            yield from zip(items, pool(joblib.delayed(work)(item) for item in items), strict=True)

    def kept(self) -> Iterator[Any]:
        """The records that `keep` stored; those of other code, incomplete lines and lines that are no JSON are skipped."""
        path = None if self.folder is None else self.folder / STORE
        if path is None or not path.is_file():
            return
        try:
            with path.open("rb") as file:
                for line in file:
                    try:
                        record = json.loads(line.decode("utf-8", errors="replace"))
                    except (ValueError, RecursionError):
                        continue
                    if isinstance(record, dict) and record.pop("code", None) == self._code:
                        yield record
        except OSError as error:
            raise BadInput(f"'{path}': what is kept cannot be read: {error.strerror or error}") from None

    def kept_as(self, read: Callable[[Any], tuple[Any, Result] | None]) -> dict[Any, Result]:
        """The stored results by key; read: returns (key, result) for a record, None if it is not needed.

        Records for which it fails, such as those of another study, are skipped, so that their work is repeated.
        """
        results = {}
        for entry in self.kept():
            try:
                if (keyed_result := read(entry)) is not None:
                    results[keyed_result[0]] = keyed_result[1]
            except (BadInput, KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
                continue
        return results

    def keep(self, record: dict[str, Any]) -> None:
        """Stores a record in the folder, if there is one. Raises WorkFailed if it cannot be written."""
        if self.folder is None:
            return
        path = self.folder / STORE
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            if path.is_file() and _is_cut(path):  # an incomplete line, whose work has just been repeated
                with path.open("r+b") as cut:
                    cut.truncate(cut.read().rfind(b"\n") + 1)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(record | {"code": self._code}) + "\n")
        except OSError as error:
            raise WorkFailed(f"output folder '{self.folder}' (--out) cannot be written: {error.strerror}") from error


def record_of(kind: type[Result], record: Any) -> Result:
    """An instance of a dataclass from its JSON values. Raises ValueError if a value does not have its field's type."""
    return TypeAdapter(kind).validate_python(record)


def _is_cut(path: Path) -> bool:
    """Whether the last line of a file is incomplete."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 1))
        return file.read(1) not in (b"", b"\n")


def seeds_of(setting: Any, sessions: int, seed: int) -> NDArray[np.uint64]:
    """The seeds (N,) uint64 of the sessions of a setting, a dataclass; they depend on its values and on `seed` alone."""
    digest = sha256(json.dumps(asdict(setting, dict_factory=said)).encode()).digest()
    rng = np.random.default_rng([seed, int.from_bytes(digest[:8], "big")])
    return rng.integers(2**64, size=sessions, dtype=np.uint64)


def said(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The items of a setting that identify it; options that were added later count only if they are not at their defaults."""
    off = {"memory": False, "wrong": False, "tilings": 1, "start_value": 0.0}
    return {name: value for name, value in pairs if name not in off or value != off[name]}


def _end_with_parent(parent: int) -> None:
    """Starts a thread that ends this process soon after its parent has ended, even by kill -9."""

    def watch() -> None:
        with suppress(psutil.NoSuchProcess):
            process = psutil.Process(parent)
            while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
                time.sleep(PARENT_LOOK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _on_cluster(work: Callable[[Item], Result], items: list[Item], address: str) -> Iterator[tuple[Item, Result]]:
    """(item, result) pairs from a Dask cluster, each as soon as it is finished."""
    require(f"--dask {address}", distributed)
    try:
        client = distributed.Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise WorkFailed(f"--dask {address}: no cluster answers there: {error}") from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise WorkFailed(f"--dask {address}: the cluster has no workers")
        tasks = {client.submit(work, item, pure=False): item for item in items}
        for task in distributed.as_completed(tasks):  # type: ignore[no-untyped-call]
            try:
                result = task.result()
            except LabError:
                raise
            except Exception as error:  # whatever a lost worker or scheduler comes to; what is done is kept
                raise WorkFailed(f"--dask {address}: the cluster gave up: {type(error).__name__}: {error}") from None
            yield tasks[task], result
