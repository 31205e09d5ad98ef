"""Where the work of a study is done: in this process, in several that end with it, or on a cluster."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from lab.studies.runner import STORE, Job, record_of

ROOT = str(Path(__file__).parents[2])


def test_other_work_is_shared_out_alike(tmp_path: Path, cluster: str) -> None:
    """`abs` of numbers, one of them twice: in the order asked for, told one by one, and nothing is written."""
    told: list[tuple[int, int]] = []
    folder = tmp_path / "study"
    job = Job(folder=folder, progress=partial(_tell, told))
    for where in ({}, {"workers": 2}, {"dask": cluster}):
        told.clear()
        assert [*replace(job, **where).each(abs, [-3, 5, -3, -1]).items()] == [(-3, 3), (5, 5), (-1, 1)]
        assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert not folder.exists()


def _tell(told: list[tuple[int, int]], done: int, total: int) -> None:
    told.append((done, total))


ENDLESS = """
import time
from lab.studies.runner import Job

if __name__ == "__main__":
    seconds = [0.0, 0.1, 0.2, 0.3, *range(3600, 3608)]  # shared out four at a time
    Job(workers=2, progress=lambda done, total: print(done, flush=True)).each(time.sleep, seconds)
"""


def running() -> dict[int, int]:
    """Every process that is not over, and its parent."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has just ended
            state, parent = stat.read_text().rpartition(") ")[2].split()[:2]
            if state != "Z":
                found[int(stat.parent.name)] = int(parent)
    return found


def test_workers_end_with_a_study_that_is_killed(tmp_path: Path) -> None:
    (tmp_path / "endless.py").write_text(ENDLESS, encoding="utf-8")
    command = [sys.executable, str(tmp_path / "endless.py")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": ROOT}) as study:
        assert study.stdout is not None
        assert [study.stdout.readline() for _ in range(5)] == [f"{done}\n" for done in range(5)]
        workers = {pid for pid, parent in running().items() if parent == study.pid}
        study.kill()
    assert len(workers) >= 2
    try:
        deadline = time.monotonic() + 60
        while left := workers & running().keys():
            assert time.monotonic() < deadline, f"{len(left)} workers go on"
            time.sleep(0.05)
    finally:
        for pid in workers:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


@dataclass(frozen=True)
class Found:
    """What a study of these tests keeps."""

    name: str
    steps: list[int]


def test_what_was_kept_is_read_and_what_is_not_understood_passed_over(tmp_path: Path) -> None:
    job = Job(folder=tmp_path)
    for steps in ([1, 2], [3], "x", [10**400], None):
        job.keep({"key": str(steps), "found": {"name": "a", "steps": steps}})
    job.keep({"key": "more", "found": {"name": "a", "steps": [1], "more": 2}})
    job.keep({"key": ["no key"], "found": {"name": "a", "steps": [1]}})
    with (tmp_path / STORE).open("ab") as file:
        file.write(b'{"key": []}\n[1]\nnull\n"text"\n{"key": {}, "found": 1}\n\xff\xfe\n' + b"[" * 100_000 + b"\n7")
    kept = job.kept_as(lambda entry: (entry["key"], record_of(Found, entry["found"])))
    assert {key: found.steps for key, found in kept.items() if key != "more"} == {"[1, 2]": [1, 2], "[3]": [3]} | {
        f"[{10**400}]": [10**400]
    }
    job.keep({"key": "last", "found": {"name": "b", "steps": []}})  # on a line of its own
    assert "last" in job.kept_as(lambda entry: (entry["key"], record_of(Found, entry["found"])))


def test_a_line_that_was_cut_off_is_written_anew(tmp_path: Path) -> None:
    job = Job(folder=tmp_path)
    store = tmp_path / STORE
    for left in ("", '{"a": 1}\n{"b"'):
        store.write_text(left)
        job.keep({"b": 2})
        assert store.read_text()[: left.rfind("\n") + 1] == left[: left.rfind("\n") + 1]
        assert [*job.kept()][-1] == {"b": 2}
    assert [*job.kept()] == [{"b": 2}]  # the other line does not say by which code it was made


def test_what_other_code_has_kept_is_not_read(tmp_path: Path) -> None:
    for code in ("mine", "mine, edited"):
        Job(folder=tmp_path, code=code).keep({"by": code})
    assert [*Job(folder=tmp_path, code="mine, edited").kept()] == [{"by": "mine, edited"}]
    assert [*Job(folder=tmp_path).kept()] == []
