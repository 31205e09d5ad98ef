"""Work handed to other processes comes out as if it was done here, whatever becomes of the processes."""

import operator
import os
import subprocess
import sys
from concurrent.futures import wait
from functools import partial
from math import factorial
from pathlib import Path

import pytest

from lab.workers import Workers

HERE = os.getpid()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_results_come_in_the_order_of_the_items(count: int) -> None:
    with Workers(count) as workers:
        assert list(workers.each(factorial, range(6))) == [1, 1, 2, 6, 24, 120]
        assert list(workers.each(factorial, [])) == []


def test_alone_everything_is_done_here_and_when_it_is_asked_for() -> None:
    done = list[int]()
    with Workers(1) as workers:
        task = workers.begin(done.append, 1)
        assert not done
        task.result()
        results = workers.each(lambda number: done.append(number) or len(done), [2, 3])  # type: ignore[func-returns-value]
        assert next(results) == 2
    assert done == [1, 2]


def test_others_work_too() -> None:
    with Workers(2) as workers:
        task = workers.begin(os.getpid)
        wait([task.future])
        assert task.result() != HERE


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_is_raised_where_the_result_is_asked_for(count: int) -> None:
    with Workers(count) as workers:
        task = workers.begin(operator.truediv, 1, 0)
        with pytest.raises(ZeroDivisionError):
            task.result()


def test_what_cannot_be_sent_is_done_here() -> None:
    with Workers(2) as workers:
        assert workers.begin(lambda: os.getpid()).result() == HERE
        assert list(workers.each(lambda number: number + 1, [1, 2])) == [2, 3]


def test_arguments_are_sent_as_they_are_when_they_are_handed_out() -> None:
    with Workers(2) as workers:
        numbers = [1, 2]
        task = workers.begin(sum, numbers)
        numbers.append(3)
        wait([task.future])
        assert task.result() == 3


def test_a_worker_that_is_killed_loses_nothing() -> None:
    with Workers(2) as workers:
        ended = workers.begin(os._exit, 1)
        wait([ended.future])  # the worker took it, and is gone
        assert list(workers.each(factorial, range(5))) == [1, 1, 2, 6, 24]


@pytest.mark.parametrize("then", ["pass", "os.kill(os.getpid(), 9)"])
def test_workers_end_with_the_block_and_with_their_parent(tmp_path: Path, then: str) -> None:
    """A worker holds the writing end of a pipe: it reads as ended when the worker is gone."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    script = f"""
import os
from lab.workers import Workers
with Workers(2) as workers:
    workers.begin(os.open, {str(pipe)!r}, os.O_WRONLY)
    with open({str(pipe)!r}):
        {then}
"""
    with subprocess.Popen([sys.executable, "-c", script]), pipe.open("rb") as reading:
        assert reading.read() == b""


@pytest.mark.parametrize("what", ["Listener", "subprocess.Popen", "threading.Thread"])
def test_where_no_process_can_be_started_everything_is_done_here(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    def refused(*_: object, **__: object) -> None:
        raise (
            RuntimeError("can't start new thread") if what == "threading.Thread" else OSError(24, "Too many open files")
        )

    monkeypatch.setattr(f"lab.workers.{what}", refused)
    with Workers(2) as workers:
        assert workers.begin(os.getpid).result() == HERE
        assert list(workers.each(factorial, range(3))) == [1, 1, 2]


def test_no_file_of_the_working_folder_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker imports what this process would: a file that is called as a module of Python is not among it."""
    (tmp_path / "queue.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nfrom nowhere import nothing\n")
    monkeypatch.chdir(tmp_path)
    with Workers(2) as workers:
        task = workers.begin(os.getpid)
        wait([task.future])
        assert task.result() != HERE
    assert not (tmp_path / "ran").exists()


def test_what_a_worker_cannot_load_is_done_here_and_no_other_function_in_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A function of the script that is run can be pickled, and is nowhere in a worker."""

    def times(one: int, other: int) -> int:
        return one * other

    times.__module__, times.__qualname__ = "__main__", "times"
    monkeypatch.setattr("__main__.times", times, raising=False)
    with Workers(2) as workers:
        tasks = [workers.begin(operator.add, 3, 4), workers.begin(times, 3, 4), workers.begin(times, 3, 4)]
        wait([task.future for task in tasks])
        assert [task.result() for task in tasks] == [7, 12, 12]


def test_a_result_that_is_asked_for_again_is_not_made_again() -> None:
    done = list[int]()
    with Workers(1) as workers:
        task = workers.begin(done.append, 1)
        task.result()
        task.result()
    assert done == [1]


@pytest.mark.parametrize("count", [1, 2])
def test_the_first_item_that_fails_is_the_one_that_is_told(count: int) -> None:
    with Workers(count) as workers:
        results = workers.each(partial(operator.truediv, 6), [1, 2, 0, 3, 0])
        assert [next(results), next(results)] == [6, 3]
        with pytest.raises(ZeroDivisionError):
            next(results)


def test_work_that_was_taken_back_keeps_no_worker_from_the_next() -> None:
    with Workers(2) as workers:
        tasks = [workers.begin(os.getpid) for _ in range(20)]
        assert {task.result() for task in reversed(tasks)} >= {HERE}  # some are done here before a worker has begun
        later = workers.begin(os.getpid)
        wait([later.future], timeout=60)
        assert later.result() != HERE
