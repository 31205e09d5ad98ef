"""Part `requests`: a lesson taught on its page, while another local user attacks that page; the lesson must not notice.

The attacked lesson is compared with one that nobody attacked: same steps, same table, same words on stderr.
"""

import json
import os
import re
import resource
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from safetensors.numpy import load_file

from devtools.attackers import ATTACKS
from devtools.commands import LAB, environment, kill_session, module, search_path
from devtools.parts import Outcome, Part

ANOTHER_USER = "65534"
LESSON = ("teach", "world-1", "--advisor", "web", "--gate", "always", "--episodes", "6", "--json")
TAUGHT = 60  # questions that are answered; then the learner continues alone
ATTACK_S = 4.0
ANSWER_S = 20.0  # the longest wait for a question, after which the lesson counts as lost
DESCRIPTORS = (1024, 256)


@dataclass(frozen=True)
class LessonResult:
    """The result of a finished lesson, and the time and memory that it took.

    learned: a hash of the steps of its episodes and of its table; slowest_s: the longest wait for a question.
    """

    code: int
    learned: str
    stderr: str
    slowest_s: float
    cpu_s: float
    peak_mb: float


@dataclass(frozen=True)
class AttackReport:
    """An attacker's report: how often it tried, and what got in."""

    tries: int
    inside: list[str]


def lesson(
    folder: Path, descriptors: int, attacked: Callable[[int, str, int], Any] = lambda port, token, process: None
) -> LessonResult:
    """Teach a lesson through its page, and return its result; `attacked` runs in a thread once the lesson has begun.

    attacked: called with port, token and process. Raises RuntimeError if the lesson ends early or asks no more.
    """
    folder.mkdir(parents=True)
    stderr = (folder / "stderr").open("w+b")
    child = subprocess.Popen(
        [*LAB, *LESSON], cwd=folder, env=environment(folder), stdin=subprocess.DEVNULL, stdout=(folder / "stdout").open("wb"),
        stderr=stderr, start_new_session=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors)),
    )  # fmt: skip
    try:
        with ThreadPoolExecutor(1) as pool:
            port, token = _address(child, folder / "stderr")
            slowest_s = _answers(port, token, lambda: pool.submit(attacked, port, token, child.pid))
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    finally:
        kill_session(child.pid)
    document = json.loads((folder / "stdout").read_text() or "{}")
    learned = sha256(json.dumps([document.get("steps_per_episode"), document.get("helped_steps")]).encode())
    for file in sorted((folder / "toolbox" / "versions").rglob("*.safetensors")):
        for name, table in sorted(load_file(file).items()):
            learned.update(name.encode() + table.tobytes())
    said = re.sub(r"\d{4,}|token=\S+", "", (folder / "stderr").read_text(errors="replace"))
    return LessonResult(
        child.returncode, learned.hexdigest(), said, slowest_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    )


def _address(child: "subprocess.Popen[bytes]", said: Path) -> tuple[int, str]:
    """Port and token of the page, once the lesson has printed them. Raises RuntimeError if it does not."""
    for _ in range(600):
        if match := re.search(r"127\.0\.0\.1:(\d+)/\?token=(\S+)", said.read_text(errors="replace")):
            return int(match[1]), match[2]
        if child.poll() is not None:
            break
        time.sleep(0.1)
    raise RuntimeError(f"no page came: {said.read_text(errors='replace')[-300:]}")


def _answers(port: int, token: str, begin: Callable[[], Any]) -> float:
    """Answer TAUGHT questions, the last one after the attack has ended; return the longest wait for a question [s]."""
    from websockets.sync.client import connect

    slowest_s, attack = 0.0, None
    with connect(f"ws://127.0.0.1:{port}/frames?token={token}", max_size=None, open_timeout=ANSWER_S) as page:
        for number in range(1, TAUGHT + 2):
            asked_s = time.monotonic()
            question: Any = None
            while not question or question["number"] < number:
                try:
                    told = json.loads(page.recv(timeout=ANSWER_S))
                except TimeoutError:
                    raise RuntimeError(f"question {number} did not come within {ANSWER_S:g} s") from None
                question = told.get("seat", {}).get("question") or question
            if number > 1:
                slowest_s = max(slowest_s, time.monotonic() - asked_s)
            attack = attack or begin()
            if number > TAUGHT:
                attack.result()
                page.send(json.dumps({"answer": {"question": question["number"], "word": "auto"}}))
                return slowest_s
            if not attack.done():
                time.sleep(ATTACK_S / TAUGHT)
            move = number % len(question["moves"])
            page.send(json.dumps({"answer": {"question": question["number"], "action": move}}))
    raise AssertionError


def prepare(room: Path, seed: int) -> int:
    """Teach the lesson that nobody attacks, once; return the number of attempts."""
    if not (room / "quiet.json").exists():
        quiet = lesson(room / "quiet", DESCRIPTORS[0])
        assert quiet.code in (0, 1), quiet.stderr
        (room / "quiet.json").write_text(json.dumps(vars(quiet)))
    return len(ATTACKS) * len(DESCRIPTORS)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Attack one lesson in one way."""
    kind = [*ATTACKS][number % len(ATTACKS)]
    descriptors = DESCRIPTORS[number // len(ATTACKS) % len(DESCRIPTORS)]
    quiet = LessonResult(**json.loads((room / "quiet.json").read_text()))
    folder = room / f"{number}"
    told = AttackReport(0, ["the attacker did not begin"])

    def attacked(port: int, token: str, process: int) -> None:
        nonlocal told
        env = {**os.environ, "PYTHONPATH": search_path(), "SPIED": str(folder / "toolbox")}
        uid = [ANOTHER_USER] if os.getuid() == 0 else []
        attacker = subprocess.run(
            [*module("attackers"), kind, str(port), str(ATTACK_S), str(seed), str(process), *uid],
            input=token, capture_output=True, text=True, timeout=300, env=env,
        )  # fmt: skip
        told = (
            AttackReport(**json.loads(attacker.stdout))
            if attacker.returncode == 0
            else AttackReport(0, [attacker.stderr[-300:]])
        )

    group, case = ATTACKS[kind][1], f"{kind}, {descriptors} descriptors, seed {seed}"
    try:
        taught = lesson(folder, descriptors, attacked)
    except Exception as reason:
        return Outcome(group, case, f"the lesson was lost: {reason}"[:600], told.tries)
    figures = {
        "slowest question ms": round(1000 * taught.slowest_s),
        "MB": round(taught.peak_mb),
        "more CPU s": round(taught.cpu_s - quiet.cpu_s, 2),
    }
    return Outcome(group, case, fault_of(taught, quiet, told.inside), told.tries, figures)


def fault_of(taught: LessonResult, quiet: LessonResult, inside: list[str]) -> str:
    """What is wrong with an attacked lesson compared with the quiet one; "" if nothing is."""
    if inside:
        return f"{len(inside)} got in, the first: {inside[0]}"
    if taught.code != quiet.code:
        return f"exit {taught.code} instead of {quiet.code}: {taught.stderr[-300:]}"
    if taught.stderr != quiet.stderr:
        return f"stderr differs: {taught.stderr[-300:]!r}"
    if taught.learned != quiet.learned:
        return "the learned table or the steps differ"
    return f"{taught.peak_mb:.0f} MB" if taught.peak_mb > quiet.peak_mb + 300 else ""


PART = Part("attacks on the page of a lesson", "lesson and page survive, nobody gets in", None, prepare, attempt)
