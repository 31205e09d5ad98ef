"""Runs the sessions that a study asks for: in this process, in several, or on a Dask cluster, always the same ones.

The chance of a session depends on the study's seed and on its own setting only. A study may keep what is done in its
folder, a line a setting, so that it is not done again.
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
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, LabError, WorkFailed
from lab.files import read_limited
from lab.optional import optional

STORE = "sessions.jsonl"
BATCH = 4  # items that a worker is given at once, where there are many
PARENT_LOOK_S = 0.2  # how often a worker looks whether its parent is still there
Progress = Callable[[int, int], None]  # settings done, of how many
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Job:
    """How a study is run: sessions a setting, the seed, by how many processes or on which cluster, and where it is kept."""

    sessions: int = 500
    seed: int = 0
    workers: int = 1
    dask: str | None = None
    folder: Path | None = None
    progress: Progress = lambda done, total: None

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> dict[Item, Result]:
        """What `work`, a function of a module, makes of each item, done where the job says; nothing is kept in the folder."""
        wanted = list(dict.fromkeys(items))
        done: dict[Item, Result] = {}
        self.progress(0, len(wanted))
        for item, result in self.computed(work, wanted):
            done[item] = result
            self.progress(len(done), len(wanted))
        return {item: done[item] for item in wanted}

    def in_turn(self, steps: Sequence[Callable[[], Result]]) -> list[Result]:
        """What each step comes to, one after another in this process: what is timed has a core to itself."""
        done: list[Result] = []
        self.progress(0, len(steps))
        for step in steps:
            done.append(step())
            self.progress(len(done), len(steps))
        return done

    def computed(
        self, work: Callable[[Item], Result], items: list[Item], most: int = BATCH
    ) -> Iterator[tuple[Item, Result]]:
        """Each item with what `work` makes of it, as soon as it is done; a process is handed `most` at a time at the most.

        Raises BadInput without Dask, WorkFailed when the cluster cannot be reached or is lost.
        """
        if self.dask is not None:
            yield from _on_cluster(work, items, self.dask)
        elif self.workers == 1 or len(items) <= 1:
            yield from ((item, work(item)) for item in items)
        else:
            from joblib import Parallel, delayed

            # a process that has grown is replaced, and nothing is lost
            warnings.filterwarnings("ignore", "A worker stopped while some jobs were given", UserWarning)

            ending: dict[str, Any] = {"initializer": _end_with_parent, "initargs": (os.getpid(),)}
            # few items are long ones: each is shared out alone
            batch = min(most, max(1, len(items) // (4 * self.workers)))
            pool = Parallel(self.workers, return_as="generator", batch_size=batch, **ending)
            yield from zip(items, pool(delayed(work)(item) for item in items), strict=True)

    def kept(self) -> Iterator[Any]:
        """What `keep` wrote, line by line; lines that were cut off, or are no JSON, are passed over."""
        path = None if self.folder is None else self.folder / STORE
        if path is None or not path.is_file():
            return
        try:
            content = read_limited(path)
        except OSError as error:
            raise BadInput(f"'{path}': what is kept cannot be read: {error.strerror or error}") from None
        for line in BytesIO(content):
            try:
                yield json.loads(line.decode("utf-8", errors="replace"))
            except (ValueError, RecursionError):
                continue

    def kept_as(self, read: Callable[[Any], tuple[Any, Result] | None]) -> dict[Any, Result]:
        """What `keep` wrote, as `read` understands a line: a key and what it holds, None where it is not wanted.

        Lines that it cannot understand, such as another study's or damaged ones, are passed over: they are done again.
        """
        found = {}
        for entry in self.kept():
            try:
                if (understood := read(entry)) is not None:
                    found[understood[0]] = understood[1]
            except (BadInput, KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
                continue
        return found

    def keep(self, record: dict[str, Any]) -> None:
        """Add a line to what the folder keeps; WorkFailed when it cannot be written."""
        if self.folder is None:
            return
        path = self.folder / STORE
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            if path.is_file() and _is_cut(path):  # a line that was cut off: it is done again now
                os.truncate(path, read_limited(path).rfind(b"\n") + 1)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(record) + "\n")
        except OSError as error:
            raise WorkFailed(f"output folder '{self.folder}' (--out) cannot be written: {error.strerror}") from error


def record_of(kind: type[Result], record: Any) -> Result:
    """A dataclass from what JSON holds of it, every field as its type says. Raises ValueError for anything else."""
    from pydantic import TypeAdapter

    return TypeAdapter(kind).validate_python(record)


def _is_cut(path: Path) -> bool:
    """Whether the last line of a file has no end."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 1))
        return file.read(1) not in (b"", b"\n")


def seeds_of(setting: Any, sessions: int, seed: int) -> NDArray[np.uint64]:
    """The seeds (N,) of a setting's sessions, whichever dataclass it is: its own, whoever runs it."""
    digest = sha256(json.dumps(asdict(setting, dict_factory=said)).encode()).digest()
    rng = np.random.default_rng([seed, int.from_bytes(digest[:8], "big")])
    return rng.integers(2**64, size=sessions, dtype=np.uint64)


def said(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """What seeds and stored results go by: a switch that was added later counts only where it is on."""
    off = {"memory": False, "wrong": False, "tilings": 1, "start_value": 0.0}
    return {name: value for name, value in pairs if name not in off or value != off[name]}


def _end_with_parent(parent: int) -> None:
    """Ends this process soon after its parent's end, which may be a kill -9 that leaves no time to say so."""

    from psutil import STATUS_ZOMBIE, NoSuchProcess, Process

    def watch() -> None:
        with suppress(NoSuchProcess):
            process = Process(parent)
            while process.is_running() and process.status() != STATUS_ZOMBIE:
                time.sleep(PARENT_LOOK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _on_cluster(work: Callable[[Item], Result], items: list[Item], address: str) -> Iterator[tuple[Item, Result]]:
    with optional(f"--dask {address}"):
        from distributed import Client, as_completed
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
