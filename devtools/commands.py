"""Runs of the lab's command in the harness: exit code, output, time and memory."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import IO

ROOT = Path(__file__).resolve().parent.parent
LAB = (sys.executable, "-c", "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()")
ERROR, LINE_CHARACTERS = "lab: ", 300
CODES = (0, 1, 2, 130)


@dataclass(frozen=True)
class Ended:
    """A finished command: its exit code (minus the signal that killed it), output, wall time [s], and peak memory [bytes]."""

    code: int
    stdout: str
    stderr: str
    seconds: float
    peak_bytes: int
    late: bool = False  # it took too long, and was killed
    cpu_s: float = 0.0

    def fault(self, codes: Sequence[int] = CODES) -> str:
        """What is wrong with how the command ended, such as a traceback or an unknown exit code; "" if nothing is."""
        if self.late:
            return f"no end within {self.seconds:.0f} s"
        for printed in (self.stderr, self.stdout):
            if "Traceback (most recent call last)" in printed:
                return f"traceback: {printed.strip().splitlines()[-1][:200]}"
        if self.code not in codes:
            return f"exit {self.code}, allowed {', '.join(map(str, codes))}: {self.stderr.strip()[-200:]}"
        if self.code in (1, 2) and not self.stderr.strip():
            return f"exit {self.code} without a message"
        errors = [line for line in re.split(r"[\r\n]", self.stderr) if line.startswith(ERROR)]
        longest = max(map(len, errors), default=0)
        return f"an error of {longest} characters" if longest > LINE_CHARACTERS else ""


def module(name: str) -> tuple[str, ...]:
    """The command that runs a module of this package in a process of its own, with an `environment`."""
    return (sys.executable, "-m", f"devtools.{name}")


def search_path() -> str:
    """The PYTHONPATH by which a process in any folder imports this checkout."""
    return os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


def environment(home: Path, **more: str) -> dict[str, str]:
    """This process's environment, changed so that a command has its home and toolbox in `home` and imports this checkout."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("LAB_", "XDG_"))}
    return {
        **kept,
        "PYTHONPATH": search_path(),
        "HOME": str(home),
        "LAB_TOOLBOX": str(home / "toolbox"),
        "PYTHONUNBUFFERED": "1",
        "COLUMNS": "120",
        **more,
    }


def lab(
    *arguments: str | Path,
    cwd: Path,
    env: Mapping[str, str],
    timeout_s: float = 120.0,
    stdin: str = "",
    before: Callable[[], None] | None = None,
    command: Sequence[str] = LAB,
) -> Ended:
    """Run `lab ARGUMENTS` to its end in a session of its own; `before` runs in the child, `command` replaces `lab`."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err, tempfile.TemporaryFile() as given:
        given.write(stdin.encode())
        given.seek(0)
        begun = time.monotonic()
        child = subprocess.Popen(
            [*command, *map(str, arguments)],
            cwd=cwd, env=dict(env), stdin=given, stdout=out, stderr=err, start_new_session=True, preexec_fn=before,
        )  # fmt: skip
        late: list[bool] = []

        def stop() -> None:
            late.append(True)
            kill_session(child.pid)

        timer = Timer(timeout_s, stop)
        timer.start()
        try:
            _, status, used = os.wait4(child.pid, 0)
        finally:
            timer.cancel()
            kill_session(child.pid)
        child.returncode = os.waitstatus_to_exitcode(status)
        took_s, cpu_s = time.monotonic() - begun, used.ru_utime + used.ru_stime
        return Ended(child.returncode, _text(out), _text(err), took_s, used.ru_maxrss * 1024, bool(late), cpu_s)


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")


def kill_session(leader: int) -> None:
    """Kill whatever is left of the session that `leader` began."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)
