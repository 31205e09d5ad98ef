"""Processes that work beside this one, on the other cores. What they do comes out the same as if it was done here.

They are new interpreters, so a script of a user's needs no guard around its own code, and threads do no harm. A
worker ends when its connection to the parent does, which is when the parent ends, however that happens.
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


MOST = 8  # processes, where nobody says how many: each is an interpreter of about 100 MB


def cores() -> int:
    """How many processors this process may use, at most MOST."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(usable, MOST)


Packed = tuple[bytes, bytes]  # a function and its arguments as they are sent: as they were when it was handed out


class _Lost(Exception):
    """What was handed to a worker did not come back: it could not be sent, or the worker is gone."""


class Task(Generic[Result]):
    """Work that was handed out. Whoever needs its result before a worker has begun, or when one is lost, does it here."""

    def __init__(self, work: Callable[..., Result], arguments: Sequence[Any], packed: Packed | None = None) -> None:
        self.work, self.arguments, self.packed = work, arguments, packed
        self.future: Future[Result] = Future()
        self._done_here: tuple[Result] | None = None

    @property
    def running(self) -> bool:
        """Whether a worker is at it."""
        return self.future.running()

    def result(self) -> Result:
        """What the work comes to; raises what it raises."""
        if self._done_here is None:
            if not self.future.cancel():
                try:
                    return self.future.result()
                except _Lost:
                    pass
            self._done_here = (self.work(*self.arguments),)
        return self._done_here[0]


class Workers:
    """This process and `count` - 1 others, which end with the block; with 1, everything is done here.

    count: None for one a core, at most MOST. first: what each of the others does as soon as it has begun, such as loading
    what it will need. What is handed out are functions of modules with arguments that can be pickled, as they are at that
    moment; what cannot be is done here.
    """

    def __init__(self, count: int | None = 1, first: Callable[[], object] | None = None) -> None:
        self._others, self._first = (count or cores()) - 1, first
        self._handed_out: SimpleQueue[Task[Any] | None] = SimpleQueue()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._listener: Listener | None = None

    def __enter__(self) -> Self:
        if self._others > 0:
            key = token_hex(32)
            # Where there is no room for another process or thread, those that are there do the work.
            with suppress(OSError, RuntimeError):
                self._listener = Listener(authkey=key.encode(), backlog=self._others)
                told = {"address": self._listener.address, "key": key}
                for _ in range(self._others):
                    threading.Thread(target=self._hand_out, args=[self._listener], daemon=True).start()
                    self._processes.append(_started(json.dumps(told)))
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

    def begin(self, work: Callable[..., Result], *arguments: Any) -> Task[Result]:
        """Hand work out; another process begins with it as soon as one is free. Raises nothing that the work raises."""
        return self._handed(work, arguments, self._pack(work))

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
        """What the work makes of each item, in the order of the items; meanwhile this process works from the end on.

        What the work raises is raised in the item's turn.
        """
        packed = self._pack(work)
        tasks = [self._handed(work, (item,), packed) for item in items]
        first_own = len(tasks)
        for number, task in enumerate(tasks):
            while task.running and number < first_own:
                first_own -= 1
                if not tasks[first_own].running:
                    with suppress(Exception):  # it is raised when its turn comes
                        tasks[first_own].result()
            yield task.result()

    def _pack(self, thing: object) -> bytes | None:
        """How it is sent; None where nothing is, or where it cannot be."""
        if not self._processes:
            return None
        try:
            return bytes(ForkingPickler.dumps(thing))
        except Exception:  # pickle says in many ways that it cannot
            return None

    def _handed(self, work: Callable[..., Result], arguments: Sequence[Any], packed: bytes | None) -> Task[Result]:
        sent = None if packed is None else self._pack(arguments)
        task = Task(work, arguments, None if packed is None or sent is None else (packed, sent))
        if task.packed is not None:
            self._handed_out.put(task)
        return task

    def _hand_out(self, listener: Listener) -> None:
        """Give one worker task after task, as long as it takes them; the same function is sent once."""
        try:
            worker = listener.accept()
            if self._first is not None:
                worker.send_bytes(bytes(ForkingPickler.dumps(self._first)))
                worker.send_bytes(bytes(ForkingPickler.dumps(())))
                worker.recv()
        except Exception:  # it did not begin, or this process ends: whatever it is, nothing was handed out yet
            return
        known = b""
        while (task := self._handed_out.get()) is not None:
            if not task.future.set_running_or_notify_cancel():
                continue
            assert task.packed is not None
            work, arguments = task.packed
            try:
                worker.send_bytes(b"" if work == known else work)
                worker.send_bytes(arguments)
                known = work
                done, came = worker.recv()
            except Exception:  # the worker is gone, or what came of it cannot be read here
                task.future.set_exception(_Lost())
                return
            task.future.set_result(came) if done else task.future.set_exception(_Lost())


def _started(told: str) -> "subprocess.Popen[bytes]":
    # -P: what lies in the working folder is not imported, as it is not in this process.
    command = [sys.executable, "-P", "-c", "from lab.workers import serve; serve()"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    )
    assert process.stdin is not None
    process.stdin.write(told.encode() + b"\n")
    process.stdin.flush()
    return process


def serve() -> None:
    """Work for the process that has begun this one, until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    told = json.loads(sys.stdin.readline())
    with Client(told["address"], authkey=told["key"].encode()) as parent:
        messages: SimpleQueue[tuple[bytes, bytes]] = SimpleQueue()
        threading.Thread(target=_receive, args=[parent, messages], daemon=True).start()
        _work_for(parent, messages)


def _receive(parent: Connection, messages: "SimpleQueue[tuple[bytes, bytes]]") -> None:
    """Take what the parent sends; when it is gone, however it ended, this process ends."""
    try:
        while True:
            messages.put((parent.recv_bytes(), parent.recv_bytes()))
    except (EOFError, OSError):
        os._exit(1)


def _work_for(parent: Connection, messages: "SimpleQueue[tuple[bytes, bytes]]") -> None:
    """Answer each task with whether it was done, and with what came of it.

    What was not done, for whatever reason, the parent does itself: so it raises what the work raises, with its own lines.
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
        except Exception:  # what came of it cannot be pickled
            parent.send((False, None))
