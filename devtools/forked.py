"""Commands forked from a process that has already loaded the lab, which is ten times as fast.

The process, `python -m devtools.forked`, reads requests from stdin, a line of JSON each, and answers each with two lines: the
child's process number, and its exit code.
"""

import ctypes
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from devtools.commands import Ended, kill_session, module
from devtools.works import environment_in

_WARM_UP = (
    ("teach", "world-1", "--advisor", "expert", "--episodes", "30", "--out", "lesson", "--json"),
    ("toolbox", "verify", "--json"),
    ("sequence", "toast-case-1", "--toasts", "2", "--gantt", "order.svg", "--json"),
    ("task", "random", "8x8x8", "--out", "world.toml", "--json"),
)
_MODULES = (
    "lab.production.run",
    "lab.sim.world",
    "lab.tasks.new_task",
    "lab.toolbox.archive",
    "lab.cli.new",
    "lab.view.meshcat",
)
_LOCAL = threading.local()


def forked(library: Path, room: Path) -> Callable[[tuple[str, ...], Path, Mapping[str, str], float], Ended]:
    """A function that carries out commands in children of a process with the lab and the shim loaded, one a thread."""

    def carried_out(words: tuple[str, ...], home: Path, env: Mapping[str, str], timeout_s: float) -> Ended:
        if getattr(_LOCAL, "server", None) is None:
            warm = room / f"warm-{threading.get_ident()}"
            warm.mkdir(exist_ok=True)
            said = environment_in(warm, room) | {"LD_PRELOAD": str(library)}
            _LOCAL.server = subprocess.Popen(
                module("forked"),
                cwd=warm,
                env=said,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
        return _asked(_LOCAL.server, words, home, env, timeout_s)

    return carried_out


def _asked(
    server: "subprocess.Popen[str]", words: tuple[str, ...], home: Path, env: Mapping[str, str], timeout_s: float
) -> Ended:
    assert server.stdin is not None
    assert server.stdout is not None
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder, "out"), Path(folder, "err")
        out.touch()  # a command may be killed before it opens its files
        err.touch()
        begun = time.monotonic()
        request = {"words": words, "cwd": str(home), "env": dict(env), "out": str(out), "err": str(err)}
        server.stdin.write(json.dumps(request) + "\n")
        server.stdin.flush()
        child = int(server.stdout.readline())
        late = threading.Event()

        def stop() -> None:
            late.set()
            kill_session(child)

        timer = threading.Timer(timeout_s, stop)
        timer.start()
        ended: dict[str, Any] = json.loads(server.stdout.readline())
        timer.cancel()
        kill_session(child)
        return Ended(
            ended["code"], out.read_text(errors="replace"), err.read_text(errors="replace"), time.monotonic() - begun, 0,
            late.is_set(),
        )  # fmt: skip


def serve() -> None:
    """Load the lab, carry out some commands, and then every request in a child."""
    from importlib import import_module

    answers = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    from lab.cli import main

    for words in _WARM_UP:
        _run(main, words)
    for name in _MODULES:
        import_module(name)
    for line in sys.stdin:
        request = json.loads(line)
        child = os.fork()
        if child == 0:
            os.close(answers)
            _child(main, request)
        os.write(answers, f"{child}\n".encode())
        _, status, _ = os.wait4(child, 0)
        os.write(answers, (json.dumps({"code": os.waitstatus_to_exitcode(status)}) + "\n").encode())


def _child(main: Callable[[], None], request: dict[str, Any]) -> None:
    """Carry out the command of a request in this process, and end it."""
    code = 1
    try:
        os.setsid()
        os.chdir(request["cwd"])
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(request[name], os.O_WRONLY | os.O_CREAT, 0o644), number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.environ.clear()
        os.environ.update(request["env"])
        ctypes.CDLL(None).write_shim_begin()
        code = _run(main, request["words"])
        sys.stdout.flush()
    finally:
        os._exit(code)


def _run(main: Callable[[], None], words: tuple[str, ...]) -> int:
    sys.argv = ["lab", *words]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0)
    except BaseException:
        import traceback

        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    serve()
