"""What differs between systems: locks, drafts and renames as Windows has them, and the lab where nothing of POSIX is there.

A fresh interpreter stands for Windows: the lab's own imports get `os`, `sys` and `signal` without what Windows lacks, no
POSIX modules at all, and an `msvcrt` whose locks are bytes of a file, as there. Other libraries are what they are here.
"""

import ast
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from lab import operating_system
from lab.advice.json_lines import AppendedFile
from lab.errors import BadInput
from lab.operating_system import lock_file, most_descriptors, opened, replace, replace_and_close

POSIX_MODULES = (
    *("fcntl", "termios", "tty", "pty", "resource", "pwd", "grp", "select", "posix", "readline", "syslog"),
    *("curses", "crypt", "nis", "spwd"),
)
POSIX_NAMES = {  # what `os` and `signal` have on POSIX only
    "os": (
        *("fork", "forkpty", "openpty", "getuid", "geteuid", "getgid", "getegid", "getgroups", "setuid", "setgid"),
        *("setsid", "getsid", "setpgid", "getpgid", "getpgrp", "killpg", "nice", "uname", "wait", "wait3", "wait4"),
        *("waitid", "WNOHANG", "mkfifo", "mknod", "chown", "lchown", "fchown", "chroot", "pread", "pwrite", "preadv"),
        *("pwritev", "readv", "writev", "sendfile", "lockf", "fdatasync", "sync", "statvfs", "fstatvfs", "sysconf"),
        *("confstr", "pathconf", "getloadavg", "sched_getaffinity", "sched_setaffinity", "sched_yield", "ctermid"),
        *("ttyname", "tcgetpgrp", "posix_spawn", "getpriority", "setpriority", "register_at_fork", "pidfd_open"),
        *("O_NOFOLLOW", "O_DIRECTORY", "O_CLOEXEC", "O_NONBLOCK", "O_NOCTTY", "O_SYNC", "O_DSYNC", "P_ALL"),
    ),
    "signal": (
        *("SIGALRM", "SIGHUP", "SIGKILL", "SIGQUIT", "SIGPIPE", "SIGCHLD", "SIGUSR1", "SIGUSR2", "SIGTSTP", "SIGCONT"),
        *(
            "SIGSTOP",
            "SIGWINCH",
            "setitimer",
            "getitimer",
            "ITIMER_REAL",
            "alarm",
            "pause",
            "pthread_kill",
            "siginterrupt",
        ),
        *("pthread_sigmask", "sigwait", "sigwaitinfo", "sigtimedwait", "sigpending"),
    ),
}

WINDOWS = f"""
import builtins, ctypes, fcntl, importlib, json, os, pkgutil, signal, struct, sys, types

POSIX_MODULES, POSIX_NAMES = {POSIX_MODULES!r}, {POSIX_NAMES!r}


class Without(types.ModuleType):
    def __init__(self, module, **other):
        super().__init__(module.__name__)
        self.__dict__.update(_module=module, _other=other, _lacks=POSIX_NAMES.get(module.__name__, ()))

    def __getattr__(self, name):
        if name in self._lacks:
            raise AttributeError(f"module '{{self._module.__name__}}' has no attribute '{{name}}'")
        return self._other[name] if name in self._other else getattr(self._module, name)

    def __setattr__(self, name, value):
        setattr(self._module, name, value)


class Msvcrt(types.ModuleType):
    LK_NBLCK = 2

    def locking(self, file, mode, count):
        begin = os.lseek(file, 0, os.SEEK_CUR)
        wanted = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, begin, count, 0)
        try:
            fcntl.fcntl(file, fcntl.F_OFD_SETLK, wanted)
        except BlockingIOError as error:
            raise PermissionError(13, "Permission denied") from error


seen = {{
    "os": Without(os),
    "sys": Without(sys, platform="win32"),
    "signal": Without(signal),
    "msvcrt": Msvcrt("msvcrt"),
    "ctypes": Without(ctypes, CDLL=lambda name: ctypes.CDLL(None if name == "ucrtbase" else name)),
}}
importing = builtins.__import__


def imported(name, globals=None, locals=None, fromlist=(), level=0):
    if level == 0 and str((globals or {{}}).get("__name__", "")).partition(".")[0] in ("lab", "lab_studies"):
        if name.partition(".")[0] in POSIX_MODULES:
            raise ModuleNotFoundError(f"No module named '{{name}}'", name=name)
        if name in seen:
            return seen[name]
    return importing(name, globals, locals, fromlist, level)


builtins.__import__ = imported
"""
IMPORTS = """
import lab, lab_studies
failed = {}
packages = (lab.__path__, "lab."), (lab_studies.__path__, "lab_studies.")
names = [module.name for package in packages for module in pkgutil.walk_packages(*package) if module.name not in %r]
for name in names:
    try:
        importlib.import_module(name)
    except ImportError as error:
        failed[name] = str(error)
print(json.dumps({"imported": len(names) - len(failed), "failed": failed}))
"""
OPTIONAL = ("lab_studies.comparisons.learning_speed_jax",)  # it is jax itself


def sources(root: Path) -> list[Path]:
    """The Python files of both packages."""
    return [path for package in ("lab", "lab_studies") for path in (root / package).rglob("*.py")]


def on_windows(root: Path, code: str, *words: str) -> subprocess.CompletedProcess[str]:
    """What a fresh interpreter without POSIX does with a program."""
    env = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-c", WINDOWS + code, *words]
    return subprocess.run(
        command, env=env, capture_output=True, text=True, timeout=300, check=False, stdin=subprocess.DEVNULL
    )


def test_every_module_is_imported_without_posix(root: Path) -> None:
    ran = on_windows(root, IMPORTS % (OPTIONAL,))
    assert ran.returncode == 0, ran.stderr
    said = json.loads(ran.stdout)
    assert said["failed"] == {}
    assert said["imported"] == len(sources(root)) - 2 - len(OPTIONAL)  # all but the __init__.py of both packages


def test_what_windows_lacks_is_missed_where_it_is_imported(root: Path) -> None:
    """The interpreter above can fail: for the lab's modules, and for those only."""
    ran = on_windows(
        root,
        """
frame = {"__name__": "lab.mine"}
for line in ("import fcntl", "from os import fork", "import os; os.O_NOFOLLOW", "import signal; signal.SIGKILL"):
    try:
        exec(line, frame)
    except (ImportError, AttributeError) as error:
        print(type(error).__name__)
exec("import fcntl, os, sys; os.fork, sys.platform", {"__name__": "theirs"})
exec("import sys; print(sys.platform)", frame)
""",
    )
    assert ran.stdout.split() == ["ModuleNotFoundError", "ImportError", "AttributeError", "AttributeError", "win32"]
    assert ran.stderr == ""


def test_commands_do_their_work_without_posix(root: Path, tmp_path: Path) -> None:
    """A lesson is taught, kept, listed, replayed and gone on with; an order is found; a file is written and read."""

    def lab(*words: str) -> dict[str, object]:
        code = "import sys\nfrom lab.cli import main\nsys.argv = ['lab', *sys.argv[1:]]\nmain()\n"
        ran = on_windows(root, code, *words, "--json")
        assert ran.returncode == 0, (words, ran.stderr)
        found: dict[str, object] = json.loads(ran.stdout)
        return found

    box = ("--toolbox", str(tmp_path / "box"))
    lesson = str(tmp_path / "lesson")
    assert lab("teach", "world-1", "--advisor", "expert", "--episodes", "200", "--out", lesson, *box)["episodes"] == 200
    policies = lab("toolbox", "list", *box)["policies"]
    assert isinstance(policies, list)
    assert len(policies) == 1
    assert lab("replay", lesson, *box)["problem"]
    plan = tmp_path / "plan.csv"
    assert lab("sequence", "toast-case-1", "--toasts", "1", "--schedule", str(plan))["makespan_s"] == 217.0
    assert {path.suffix for path in tmp_path.rglob("*") if path.is_file()} >= {".jsonl", ".safetensors", ".csv"}
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".tmp", ".lock")]


def test_a_toolbox_without_posix_loses_no_version(root: Path, tmp_path: Path) -> None:
    """Processes that save into one toolbox at a time, as Windows locks it."""
    code = """
from lab.toolbox.folder_place import FolderPlace
place = FolderPlace(__import__("pathlib").Path(sys.argv[1]))
for _ in range(20):
    with place.lock("log"):
        place.write("number", str(int(place.read("number")) + 1).encode())
"""
    (tmp_path / "number").write_bytes(b"0")
    env = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-c", WINDOWS + code, str(tmp_path)]
    running = [subprocess.Popen(command, env=env, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    assert [process.communicate(timeout=120)[1] for process in running] == ["", "", ""]
    assert (tmp_path / "number").read_bytes() == b"60"


# ---- the walls ------------------------------------------------------------------------------------------------------


def posix_uses(source: str) -> list[str]:
    """Names of `os` and `signal` in a source that Windows lacks."""
    return [
        f"{node.lineno}: {node.value.id}.{node.attr}"
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
        if node.attr in POSIX_NAMES.get(node.value.id, ())
    ]


def test_no_module_but_the_door_uses_what_windows_lacks(root: Path) -> None:
    """The door asks first where it is; Ctrl-C's timer and the processors of this process are looked for before they are used."""
    uses = {path: posix_uses(path.read_text(encoding="utf-8")) for path in sources(root)}
    found = {path.relative_to(root).as_posix() for path, lines in uses.items() if lines}
    assert found == {"lab/cli/interrupt.py", "lab/operating_system.py", "lab/workers.py"}
    assert posix_uses("import os\nos.fork()\nos.getpid()\nsignal.SIGINT") == ["2: os.fork"]


# ---- here -----------------------------------------------------------------------------------------------------------


def test_a_lock_ends_with_its_holder(tmp_path: Path) -> None:
    """Who dies without a word holds nothing any more."""
    path = tmp_path / "mine.lock"
    code = f"""
import os, sys
from pathlib import Path
from lab.operating_system import lock_file
with lock_file(Path({str(path)!r})):
    print("locked", flush=True)
    sys.stdin.read()
"""
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"locked\n"
        with pytest.raises(BlockingIOError), lock_file(path, wait=False):
            pass
        os.kill(holder.pid, signal.SIGKILL)
        holder.wait()
    with lock_file(path, wait=False):
        assert path.exists()
    assert not path.exists()


def test_whoever_waited_for_a_lock_file_that_is_gone_makes_another(tmp_path: Path) -> None:
    path = tmp_path / "mine.lock"
    taken = operating_system.lock
    turns = []

    def removed(file: int, *, wait: bool = True) -> None:
        taken(file, wait=wait)
        turns.append(file)
        if len(turns) == 1:  # the one that held it removes it as it leaves
            path.unlink()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(operating_system, "lock", removed)
        with lock_file(path):
            assert len(turns) == 2
            with pytest.raises(BlockingIOError), lock_file(path, wait=False):
                pass


def test_a_link_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the system itself cannot be told."""
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    for flag in (operating_system._NO_FOLLOW, 0):
        monkeypatch.setattr(operating_system, "_NO_FOLLOW", flag)
        with pytest.raises(OSError, match="symbolic links"):
            opened(tmp_path / "link", os.O_RDWR | os.O_CREAT, follow=False)
    assert not (tmp_path / "elsewhere").exists()


def test_a_file_that_somebody_has_open_is_replaced_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where the first tries are refused; here it is refused at once."""
    for name in ("new", "old"):
        (tmp_path / name).write_bytes(name.encode())
    rename: Callable[[Path, Path], None] = os.replace
    tries = []

    def refused(source: Path, target: Path) -> None:
        tries.append(source)
        if len(tries) < 3:
            raise PermissionError(13, "Permission denied")
        rename(source, target)

    monkeypatch.setattr(os, "replace", refused)
    with pytest.raises(PermissionError):
        replace(tmp_path / "new", tmp_path / "old")
    monkeypatch.setattr(operating_system, "WINDOWS", True)
    replace(tmp_path / "new", tmp_path / "old")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"new"]


@pytest.mark.parametrize("windows", [False, True])
def test_an_open_file_is_renamed_and_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, windows: bool) -> None:
    monkeypatch.setattr(operating_system, "WINDOWS", windows)
    file = opened(tmp_path / "one", os.O_RDWR | os.O_CREAT)
    replace_and_close(file, tmp_path / "one", tmp_path / "other")
    assert [path.name for path in tmp_path.iterdir()] == ["other"]
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(file)


def test_a_journal_has_one_writer(tmp_path: Path) -> None:
    journal = AppendedFile.new(tmp_path / "journal")
    with pytest.raises(BadInput, match="another command is writing it"):
        AppendedFile.again(tmp_path / "journal")
    journal.write("{}")
    journal.put_aside(tmp_path / "before")
    journal.close()
    AppendedFile.new(tmp_path / "journal").close()
    assert (tmp_path / "before").read_bytes() == b"{}\n"


def test_descriptors_are_counted_where_they_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    there = most_descriptors()
    assert there is None or there > 3
    monkeypatch.setattr(operating_system, "WINDOWS", True)
    assert most_descriptors() is None
