"""Worker processes on the other cores; the results are the same as without them.

Workers are new interpreters, so a user's script needs no `if __name__ == "__main__"`, and threads of this process do no harm. A
worker ends when its connection to this process closes, which happens however this process ends.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.connection import Client, Connection, Listener
from multiprocessing.reduction import ForkingPickler
from queue import SimpleQueue
from secrets import token_hex
from typing import Any, Generic, Self, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


MOST = 8  # default limit on processes: each is an interpreter of about 100 MB


def cores() -> int:
    """The number of processors that this process may use, at most MOST."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(usable, MOST)


Packed = tuple[bytes, bytes]  # a function and its arguments, pickled when the task was submitted


class _Lost(Exception):
    """A task has no result from its worker: it could not be pickled, or the worker has ended."""


class WorkerTask(Generic[Result]):
    """A submitted function call; `result` makes the call in this process if no worker has begun it, or if its worker was lost."""

    def __init__(self, work: Callable[..., Result], arguments: Sequence[Any], packed: Packed | None = None) -> None:
        self.work, self.arguments, self.packed = work, arguments, packed
        self.future: Future[Result] = Future()
        self._done_here: tuple[Result] | None = None

    @property
    def running(self) -> bool:
        """Whether a worker has begun the task."""
        return self.future.running()

    def result(self) -> Result:
        """The result of the call. Raises what the call raises."""
        if self._done_here is None:
            if not self.future.cancel():
                try:
                    return self.future.result()
                except _Lost:
                    pass
            self._done_here = (self.work(*self.arguments),)
        return self._done_here[0]


class Workers:
    """A pool of this process and `count` - 1 worker processes, which end with the `with` block.

    count: default 1, without workers; None for one process per core, at most MOST.
    first: a function that each worker calls when it starts, such as one that imports what it will need.
    Tasks are module-level functions with arguments that can be pickled; they are pickled at once. This process itself does
    what cannot be pickled.
    """

    def __init__(self, count: int | None = 1, first: Callable[[], object] | None = None) -> None:
        self._others, self._first = (count or cores()) - 1, first
        self._handed_out: SimpleQueue[WorkerTask[Any] | None] = SimpleQueue()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._listener: Listener | None = None

    def __enter__(self) -> Self:
        if self._others > 0:
            key = token_hex(32)
            # If the system refuses another process or thread, the existing ones do the work.
            with suppress(OSError, RuntimeError):
                self._listener = Listener(authkey=key.encode(), backlog=self._others)
                connection = {"address": self._listener.address, "key": key}
                for _ in range(self._others):
                    threading.Thread(target=self._hand_out, args=[self._listener], daemon=True).start()
                    self._processes.append(_started(json.dumps(connection)))
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            self._handed_out.put(None)
            process.kill()
        for process in self._processes:
            process.communicate()
        self._processes.clear()
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def begin(self, work: Callable[..., Result], *arguments: Any) -> WorkerTask[Result]:
        """The submitted task, which a worker begins as soon as one is free. What the call raises, `WorkerTask.result` raises."""
        return self._submitted(work, arguments, self._pack(work))

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
        """The results of the function for each item, in order; while it waits, this process does items from the end.

        An exception is raised when its item's turn comes.
        """
        packed = self._pack(work)
        tasks = [self._submitted(work, (item,), packed) for item in items]
        first_own = len(tasks)
        for number, task in enumerate(tasks):
            while task.running and number < first_own:
                first_own -= 1
                if not tasks[first_own].running:
                    with suppress(Exception):  # raised again when the item's turn comes
                        tasks[first_own].result()
            yield task.result()

    def _pack(self, item: object) -> bytes | None:
        """The pickled object; None without workers, or if it cannot be pickled."""
        if not self._processes:
            return None
        try:
            return bytes(ForkingPickler.dumps(item))
        except Exception:  # pickle raises many kinds of errors
            return None

    def _submitted(
        self, work: Callable[..., Result], arguments: Sequence[Any], packed: bytes | None
    ) -> WorkerTask[Result]:
        """A task, put into the queue of the workers if function and arguments can be pickled."""
        sent = None if packed is None else self._pack(arguments)
        task = WorkerTask(work, arguments, None if packed is None or sent is None else (packed, sent))
        if task.packed is not None:
            self._handed_out.put(task)
        return task

    def _hand_out(self, listener: Listener) -> None:
        """Sends one worker task after task until it ends; a function is sent only when it differs from the one before."""
        try:
            worker = listener.accept()
            if self._first is not None:
                worker.send_bytes(bytes(ForkingPickler.dumps(self._first)))
                worker.send_bytes(bytes(ForkingPickler.dumps(())))
                worker.recv()
        except Exception:  # the worker did not start, or this process ends; no task was taken yet
            return
        sent_before = b""
        while (task := self._handed_out.get()) is not None:
            if not task.future.set_running_or_notify_cancel():
                continue
            assert task.packed is not None
            work, arguments = task.packed
            try:
                worker.send_bytes(b"" if work == sent_before else work)
                worker.send_bytes(arguments)
                sent_before = work
                done, result = worker.recv()
            except Exception:  # the worker has ended, or its result cannot be unpickled here
                task.future.set_exception(_Lost())
                return
            task.future.set_result(result) if done else task.future.set_exception(_Lost())


def _started(connection: str) -> "subprocess.Popen[bytes]":
    """A new worker process, which reads the address and the key of its parent from its standard input."""
    # -P keeps the working folder off the import path, as in this process.
    command = [sys.executable, "-P", "-c", "from lab.workers import serve; serve()"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    )
    assert process.stdin is not None
    process.stdin.write(connection.encode() + b"\n")
    process.stdin.flush()
    return process


def serve() -> None:
    """Runs a worker: does the tasks of the parent process until that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    connection = json.loads(sys.stdin.readline())
    with Client(connection["address"], authkey=connection["key"].encode()) as parent:
        messages: SimpleQueue[tuple[bytes, bytes]] = SimpleQueue()
        threading.Thread(target=_receive, args=[parent, messages], daemon=True).start()
        _work_for(parent, messages)


def _receive(parent: Connection, messages: "SimpleQueue[tuple[bytes, bytes]]") -> None:
    """Queues what the parent sends; when the connection closes, however the parent ended, this process ends."""
    try:
        while True:
            messages.put((parent.recv_bytes(), parent.recv_bytes()))
    except (EOFError, OSError):
        os._exit(1)


def _work_for(parent: Connection, messages: "SimpleQueue[tuple[bytes, bytes]]") -> None:
    """Answers each task with (done, result).

    The parent repeats a task that was not done, whatever the reason, so an exception is raised there, with its own traceback.
    """
    work: Callable[..., object] | None = None
    while True:
        packed, arguments = messages.get()
        try:
            if packed:
                work = None
                work = ForkingPickler.loads(packed)
            assert work is not None
            answer = (True, work(*ForkingPickler.loads(arguments)))
        except Exception:
            answer = (False, None)
        try:
            parent.send(answer)
        except Exception:  # the result cannot be pickled
            parent.send((False, None))
