"""The harness's parts `kills` and `resources`: the shim under a command, and what their judges notice."""

import errno
import os
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest

from devtools import kills, works
from devtools.commands import Ended
from devtools.kills import drawn, fault_of
from devtools.resources import Case
from devtools.resources import fault_of as judged_without
from devtools.shim import KINDS, Strike, built_shim, shim_counts, shim_environment
from devtools.works import (
    WORKS,
    Undisturbed,
    age,
    first_fault,
    first_leftover,
    first_loss,
    first_missing,
    home_state,
    kept_before,
    policy,
    undisturbed_result,
)
from lab.toolbox.registry import Toolbox

WRITER = """
import os, sys
os.mkdir("new")
with open("new/file", "wb", buffering=0) as file:
    for _ in range(4):
        file.write(b"0123456789")
    os.fsync(file)
os.rename("new/file", "file")
os.unlink("file")
os.rmdir("new")
open("/dev/null", "wb").write(b"elsewhere")
"""
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="the shim must be compiled")


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_shim(tmp_path_factory.mktemp("shim"))


def written(library: Path, folder: Path, strike: Strike | None) -> tuple[int, str, dict[str, int]]:
    """How the writer ends under the shim, what it says, and how many calls of each kind were counted."""
    home = folder / "home"
    home.mkdir()
    said = shim_environment(library, home, folder / "counts", strike)
    ran = subprocess.run(
        [sys.executable, "-c", WRITER], cwd=home, env={**os.environ, **said}, capture_output=True, text=True,
        start_new_session=True,
    )  # fmt: skip
    return ran.returncode, ran.stderr, shim_counts(folder / "counts")


def test_what_is_written_is_counted_by_kind(library: Path, tmp_path: Path) -> None:
    code, said, calls = written(library, tmp_path, None)
    assert (code, said) == (0, "")
    assert calls == dict.fromkeys(KINDS.values(), 0) | {"o": 1, "w": 4, "s": 1, "r": 1, "u": 2, "m": 1}


@pytest.mark.parametrize(
    ("strike", "left"),
    [
        (Strike("w", 3, "before"), {"new": None, "new/file": 20}),
        (Strike("w", 3, "half"), {"new": None, "new/file": 25}),
        (Strike("w", 3, "after"), {"new": None, "new/file": 30}),
        (Strike("r", 1, "before"), {"new": None, "new/file": 40}),
        (Strike("r", 1, "after"), {"new": None, "file": 40}),
        (Strike("m", 1, "before"), {}),
        (Strike("ow", 2, "before"), {"new": None, "new/file": 0}),
    ],
    ids=str,
)
def test_it_is_killed_at_the_call_that_was_meant(
    library: Path, tmp_path: Path, strike: Strike, left: dict[str, int | None]
) -> None:
    code, _, _ = written(library, tmp_path, strike)
    assert code == -signal.SIGKILL
    home = tmp_path / "home"
    found = {str(path.relative_to(home)): path.stat().st_size if path.is_file() else None for path in home.rglob("*")}
    assert found == left


@pytest.mark.parametrize(("always", "calls"), [(False, 2), (True, 2)])
def test_it_is_refused_at_the_call_that_was_meant(library: Path, tmp_path: Path, always: bool, calls: int) -> None:
    code, said, found = written(library, tmp_path, Strike("w", calls, str(errno.ENOSPC), always))
    assert (code, found["w"]) == (1, calls)
    assert "No space left on device" in said
    assert (tmp_path / "home" / "new" / "file").stat().st_size == 10


def test_a_drawn_kill_is_one_of_the_commands_calls() -> None:
    import random

    calls = {"o": 2, "w": 5, "s": 0}
    for number in range(50):
        strike = drawn(calls, random.Random(number))
        assert strike is not None
        assert 1 <= strike.at <= calls[strike.kinds]
    assert drawn({"o": 0}, random.Random(0)) is None


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A base with two policies, and one that `toolbox remove` was carried out in, undisturbed."""
    box = Toolbox(tmp_path / "base" / "toolbox")
    for name in ("bystander", "doubled"):
        box.save(policy(name, 1.0))
    shutil.copytree(tmp_path / "base", tmp_path / "home")
    Toolbox(tmp_path / "home" / "toolbox").remove("doubled")
    return tmp_path


def test_what_is_wrong_after_a_kill(room: Path) -> None:
    home, before, changes = room / "home", kept_before(room), WORKS["toolbox remove"].changes
    expected = Undisturbed(0, home_state(home), {}, 1.0)
    assert (
        first_loss(before, home, changes),
        first_fault(home),
        first_leftover(home),
        first_missing(expected, home),
    ) == ("", "", "", "")
    assert first_missing(expected, room / "base").startswith(
        "not as undisturbed: 1 missing: toolbox/trash: policy doubled"
    )
    (home / "toolbox" / ".doubled.safetensors.0123abcd.tmp").touch()
    assert first_leftover(home) == "left over: toolbox/.doubled.safetensors.0123abcd.tmp"
    (home / "toolbox" / "log" / "doubled.jsonl").write_text("shorter")
    assert first_loss(before, home, changes) == "changed: toolbox/log/doubled.jsonl"
    (home / "toolbox" / "bystander.safetensors").write_bytes(b"damaged")
    assert "bystander" in first_fault(home)
    (home / "toolbox" / "bystander.safetensors").unlink()
    assert first_loss(before, home, changes) == "lost: toolbox/bystander.safetensors"


def test_a_killed_command_is_done_again(room: Path) -> None:
    home = room / "home"
    expected = Undisturbed(0, home_state(home), {}, 1.0)
    killed, again = Ended(-9, "", "", 0.1, 0), Ended(0, "{}", "", 0.1, 0)
    words: list[tuple[str, ...]] = []

    def carried_out(wanted: tuple[str, ...], *_: object) -> Ended:
        words.append(wanted)
        return again

    assert fault_of("toolbox remove", expected, home, killed, room, carried_out) == ""
    assert words == [("toolbox", "verify", "--repair")]
    shutil.rmtree(home)
    shutil.copytree(room / "base", home)
    assert "then lab toolbox remove doubled --json: not as undisturbed" in fault_of(
        "toolbox remove", expected, home, killed, room, carried_out
    )


def test_two_workers_measure_a_command_in_homes_of_their_own(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both are at the same command at the same time: each finds there what it began from, until it is over."""
    together = Barrier(2, timeout=20)

    def disturbed(home: Path, *_: object) -> Ended:
        together.wait()
        (home / "measured").mkdir()
        together.wait()
        shim_environment(room / "write_shim.so", home, home.parent / f"{home.name}-counts")  # nothing is counted
        return Ended(0, "", "", 1.5, 0)

    for module in (kills, works):
        monkeypatch.setattr(module, "disturbed", disturbed)
        monkeypatch.setattr(module, "built_shim", lambda _: room / "write_shim.so")
    with ThreadPoolExecutor(2) as pool:
        forked = [pool.submit(kills.forked_s, "toolbox remove", room) for _ in range(2)]
        assert [one.result() for one in forked] == [1.5, 1.5]
        alone = [pool.submit(undisturbed_result, "toolbox remove", room) for _ in range(2)]
        assert [one.result().seconds for one in alone] == [1.5, 1.5]
    assert sorted(path.name for path in room.iterdir()) == ["base", "home", "toolbox-remove.json"]


@pytest.mark.parametrize(
    ("ended", "said"),
    [
        (Ended(0, "{}", "", 0.1, 0), ""),
        (Ended(1, "{}", "", 0.1, 0), "exit 1 without a"),
        (Ended(1, "{}", "lab: no room\n", 0.1, 0), ""),
        (Ended(2, "{}", "lab: no room\n", 0.1, 0), "exit 2, but it has kept toolbox/trash"),
        (
            Ended(1, '{"saved_as": "more"}', "lab: no room\n", 0.1, 0),
            "'more', which is not there",
        ),
        (Ended(1, "{}", "Traceback (most recent call last):\nKeyError", 0.1, 0), "traceback: KeyError"),
        (Ended(0, "{}", "Exception ignored in: <_io>", 0.1, 0), "stderr says 'Exception ignored"),
        (Ended(1, "{}", f"lab: {'x' * 300}\n", 0.1, 0), "an error of 305 characters"),
    ],
)
def test_what_is_wrong_with_a_command_that_lacks_something(room: Path, ended: Ended, said: str) -> None:
    import random

    home = room / "home"
    expected = Undisturbed(0, home_state(home), {}, 1.0)
    case = Case("toolbox remove", home, expected, random.Random(0))
    age(home)
    wrong = judged_without(case, ended, room, lambda *_: Ended(0, "{}", "", 0.1, 0))
    assert said in wrong
    assert bool(said) == bool(wrong)
