"""Part `class`: honest pupils are taught in a class that a stranger or another pupil attacks; they must not notice.

Their journals are compared byte for byte with those of a class that nobody attacked. Attempts alternate between a class on
this computer alone and one in a network, over TLS.
"""

import json
import os
import re
import ssl
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from threading import Barrier, BrokenBarrierError
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from devtools.class_attackers import ATTACKS, Target, parent_of
from devtools.commands import LAB, environment, kill_session, module, search_path
from devtools.parts import Outcome, Part

ANOTHER_USER = "65534"
LESSON = ("world-1", "--gate", "always", "--episodes", "6", "--pupils", "6", "--typed-names", "--json")
NETWORK = "127.0.0.2"  # an address of this computer that plays the one in a school's network
NAMES = ("Ada", "Emmy", "Sonja")
TAUGHT = 60  # questions that each pupil answers; then the learner continues alone
ATTACK_S = 6.0
WAIT_S = 60.0  # the longest wait for anything, after which the class counts as lost
MORE_MB = 150.0  # memory that the server, or a desk, may need beyond that of a class that nobody attacks
MOST_KB = 4096.0  # that an attack may add to the class's folder
ROUNDS = 6  # of the long run: every attack on every kind of class so often


@dataclass(frozen=True)
class Taught:
    """How a class ended. journals: a hash of each honest pupil's; p95_s, longest_s: from an answer to the next question.

    peak_mb, desk_mb: the most memory of the server, and of the largest process of a desk.
    """

    code: int
    journals: dict[str, str]
    stderr: str
    p95_s: float
    longest_s: float
    peak_mb: float
    desk_mb: float
    disk_kb: float


@dataclass
class Running:
    """A class that runs: its process, addresses, and its honest pupils' pages (the addresses of their websockets)."""

    process: "subprocess.Popen[bytes]"
    folder: Path
    base: str
    code: str
    teacher: str
    tls: ssl.SSLContext | None
    pages: dict[str, str] = field(default_factory=dict)

    @property
    def sockets(self) -> str:
        """The beginning of the addresses of websockets."""
        return self.base.replace("http", "ws", 1)

    def join(self, name: str) -> tuple[int, dict[str, Any]]:
        """The status and what is said to somebody with the code."""
        body = json.dumps({"code": self.code, "name": name}).encode()
        try:
            with urlopen(Request(f"{self.base}/join", data=body), timeout=WAIT_S, context=self.tls) as answer:
                return answer.status, json.load(answer)
        except HTTPError as error:
            return error.code, {}

    def open(self, address: str) -> Any:
        """An open websocket."""
        from websockets.sync.client import connect

        return connect(self.sockets + address, ssl=self.tls, max_size=None, open_timeout=WAIT_S, proxy=None)


def taught(folder: Path, secured: bool, attacked: Callable[[Running], Any], sweeps: bool = False) -> Taught:
    """Hold a class and return how it ended; `attacked` runs in a thread once all honest pupils have their first question.

    sweeps: the teacher closes the door after the attack and removes everybody who is not known. Raises RuntimeError if the
    class does not begin, or a pupil's page is lost.
    """
    folder.mkdir(parents=True)
    command = [*LAB, "class", *LESSON, "--out", "class", *(("--lan", NETWORK) if secured else ())]
    with (folder / "stdout").open("wb") as stdout, (folder / "stderr").open("wb") as stderr:
        child = subprocess.Popen(
            command, cwd=folder, env=environment(folder), stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr,
            start_new_session=True,
        )  # fmt: skip
    try:
        running = _begun(child, folder, secured)
        for name in NAMES:
            status, said = running.join(name)
            if status != 200:
                raise RuntimeError(f"{name} cannot join: {status}")
            running.pages[name] = said["page"].replace("/?", "/frames?")
        with ThreadPoolExecutor(len(NAMES) + 1) as pool:
            attack: list[Any] = []
            barrier = Barrier(len(NAMES), lambda: attack.append(pool.submit(attacked, running)))
            pupils = [pool.submit(_pupil, running, name, barrier, attack) for name in NAMES]
            waits_s = sorted(wait for pupil in pupils for wait in pupil.result())
        peak_mb, desk_mb = _peak_mb(child.pid), max(map(_peak_mb, _descendants(child.pid)), default=0.0)
        _end(running, sweeps)
        child.wait(WAIT_S)
    finally:
        kill_session(child.pid)
    own = folder / "class"
    journals = {
        name: sha256(file.read_bytes()).hexdigest()
        for name in NAMES
        for file in own.glob(f"[0-9]*-{name}/lesson-1/events.jsonl")
    }
    size = sum(file.stat().st_size for file in own.rglob("*") if file.is_file())
    return Taught(
        child.returncode, journals, (folder / "stderr").read_text(errors="replace"), waits_s[int(0.95 * len(waits_s))],
        waits_s[-1], peak_mb, desk_mb, size / 1024,
    )  # fmt: skip


def _begun(child: "subprocess.Popen[bytes]", folder: Path, secured: bool) -> Running:
    """The class, once it has printed its addresses. Raises RuntimeError if it does not."""
    said = ""
    for _ in range(600):
        said = (folder / "stderr").read_text(errors="replace")
        found = re.search(r"pupils: (\S+)/\?code=(\S+)\s.*?(/teacher/\?token=\S+)\n", said, re.S)
        if found and (not secured or "SHA-256" in said):
            tls = ssl.create_default_context(cafile=str(folder / "class" / "certificate.pem")) if secured else None
            return Running(child, folder, found[1], found[2], found[3].replace("/?", "/frames?"), tls)
        if child.poll() is not None:
            break
        time.sleep(0.1)
    raise RuntimeError(f"no class began: {said[-300:]}")


def _pupil(running: Running, name: str, barrier: Barrier, attack: list[Any]) -> list[float]:
    """Answer TAUGHT questions, the last one after the attack has ended; return the waits for the next question [s]."""
    waits_s: list[float] = []
    known: dict[str, Any] = {}
    answered, asked_s = 0, 0.0
    try:
        with running.open(running.pages[name]) as page:
            while not known.get("ended"):
                told = json.loads(page.recv(timeout=WAIT_S))
                if told.get("class", {"name": name})["name"] != name:
                    raise RuntimeError(f"{name} is told {told}")
                known |= told.get("seat", {})
                question = known.get("question")
                if not question or question["number"] <= answered or not known.get("you", {}).get("seat"):
                    continue
                if not answered:
                    barrier.wait(WAIT_S)
                else:
                    waits_s.append(time.monotonic() - asked_s)
                answered = question["number"]
                if answered > TAUGHT:
                    attack[0].result()
                    page.send(json.dumps({"answer": {"question": answered, "word": "auto"}}))
                    continue
                if not attack[0].done():
                    time.sleep(ATTACK_S / TAUGHT)
                asked_s = time.monotonic()
                move = question["moves"][(answered + NAMES.index(name)) % len(question["moves"])]["action"]
                page.send(json.dumps({"answer": {"question": answered, "action": move}}))
    except (TimeoutError, BrokenBarrierError):
        raise RuntimeError(f"{name} waits {WAIT_S:g} s for question {answered + 1}") from None
    except (OSError, EOFError) as reason:
        raise RuntimeError(f"{name} is cut off at question {answered}: {reason}") from None
    except Exception as reason:
        raise RuntimeError(f"{name} is cut off at question {answered}: {reason!r}") from None
    finally:
        barrier.abort()
    return waits_s


def _descendants(process: int) -> set[int]:
    """The processes that a process and its descendants have started."""
    parents = {int(folder.name): parent_of(folder) for folder in Path("/proc").glob("[0-9]*")}
    found, more = set[int](), {process}
    while more:
        more = {one for one, parent in parents.items() if parent in more}
        found |= more
    return found


def _peak_mb(process: int) -> float:
    """The most memory of a process so far [MB]; 0 if it has ended."""
    with suppress(OSError):
        if match := re.search(r"VmHWM:\s*(\d+) kB", Path(f"/proc/{process}/status").read_text()):
            return int(match[1]) / 1024
    return 0.0


def _end(running: Running, sweeps: bool) -> None:
    """End the class from the teacher's page; see `taught` for sweeps."""
    tiles: dict[int, Any] = {}
    with running.open(running.teacher) as page:

        def told(wanted: Callable[[dict[str, Any]], object]) -> None:
            while True:
                news = json.loads(page.recv(timeout=WAIT_S))
                if "refusal" in news:
                    raise RuntimeError(f"the teacher is refused: {news['refusal']}")
                tiles.update({tile["number"]: tile for tile in news.get("tiles", [])})
                for number in news.get("gone", []):
                    tiles.pop(number, None)
                if wanted(news):
                    return

        told(lambda news: news.get("tiles"))
        if sweeps:
            page.send(json.dumps({"do": "door", "open": False}))
            told(lambda news: news.get("class", {}).get("open") is False)
            for number in [number for number, tile in tiles.items() if tile["name"] not in NAMES]:
                page.send(json.dumps({"do": "remove", "pupil": number}))
            told(lambda news: len(tiles) == len(NAMES))
            closed = running.join("Late")[0]
            page.send(json.dumps({"do": "door", "open": True}))
            told(lambda news: news.get("class", {}).get("open"))
            again = running.join("Late")[0]
            if (closed, again) != (403, 200):
                raise RuntimeError(f"a late pupil is answered {closed} at the closed door, then {again}")
        page.send(json.dumps({"do": "end"}))
        with suppress(Exception):
            while True:
                page.recv(timeout=WAIT_S)


def prepare(room: Path, seed: int) -> None:
    """Hold the classes that nobody attacks, once."""
    for secured in (False, True):
        kept = room / f"quiet-{secured}.json"
        if not kept.exists():
            quiet = taught(room / f"quiet-{secured}", secured, lambda running: None)
            assert quiet.code == 0, quiet.stderr
            kept.write_text(json.dumps(asdict(quiet)))


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Attack one class in one way."""
    kind, secured = [*ATTACKS][number // 2 % len(ATTACKS)], bool(number % 2)
    quiet = Taught(**json.loads((room / f"quiet-{secured}.json").read_text()))
    tried: dict[str, Any] = {"tries": 0, "inside": ["the attacker did not begin"], "figures": {}}

    def attacked(running: Running) -> None:
        stranger = ATTACKS[kind][1].startswith("a stranger")
        status, said = (0, {"page": "=", "name": ""}) if stranger or kind == "seats" else running.join("Mallory")
        host, _, port = running.base.partition("://")[2].rpartition(":")
        secrets = {f"the key of {name}": page.partition("=")[2] for name, page in running.pages.items()}
        secrets |= {"the teacher's key": running.teacher.partition("=")[2]}
        if status:
            secrets |= {f"the name of {name}": f'"{name}"' for name in NAMES}
        elif kind != "seats":
            secrets |= {"the code": running.code}
        target = Target(
            host, int(port), secured, running.code, running.teacher.partition("=")[2], said["page"].partition("=")[2],
            said["name"], secrets, str(running.folder / "class"), running.process.pid,
        )  # fmt: skip
        uid = [ANOTHER_USER] if os.getuid() == 0 else []
        attacker = subprocess.run(
            [*module("class_attackers"), kind, str(ATTACK_S), str(seed * 1000 + number), *uid],
            input=json.dumps(asdict(target)), capture_output=True, text=True, timeout=300,
            env={**os.environ, "PYTHONPATH": search_path()},
        )  # fmt: skip
        tried.update(
            json.loads(attacker.stdout) if attacker.returncode == 0 else {"inside": [attacker.stderr.strip()[-300:]]}
        )

    group = f"{ATTACKS[kind][1]}{', TLS' if secured else ''}"
    case = f"{number}, seed {seed}: {kind}{', TLS' if secured else ''}"
    try:
        ended = taught(room / f"{number}", secured, attacked, sweeps=kind == "seats")
    except Exception as reason:
        return Outcome(group, case, f"the class was lost: {reason} {tried['inside'][:1]}"[:600], tried["tries"])
    figures = {
        "p95 ms": round(1000 * ended.p95_s),
        "quiet p95 ms": round(1000 * quiet.p95_s),
        "longest ms": round(1000 * ended.longest_s),
        "MB": round(ended.peak_mb),
        "desk MB": round(ended.desk_mb),
        "more KB": round(ended.disk_kb - quiet.disk_kb),
    }
    return Outcome(group, case, fault_of(ended, quiet, tried["inside"]), tried["tries"], figures | tried["figures"])


def fault_of(ended: Taught, quiet: Taught, inside: list[str]) -> str:
    """What is wrong with an attacked class compared with the quiet one; "" if nothing is."""
    if inside:
        return f"{len(inside)} got in, the first: {inside[0]}"
    if ended.code != quiet.code:
        return f"exit {ended.code} instead of {quiet.code}: {ended.stderr[-300:]}"
    if strange := [line for line in ended.stderr.splitlines() if line.strip() and not _expected(line)]:
        return f"stderr says {strange[0][:300]!r}"
    if ended.journals != quiet.journals:
        return f"journals differ: {sorted(name for name in quiet.journals if ended.journals.get(name) != quiet.journals[name])}"
    if ended.peak_mb > quiet.peak_mb + MORE_MB:
        return f"{ended.peak_mb:.0f} MB instead of {quiet.peak_mb:.0f} MB"
    if ended.desk_mb > quiet.desk_mb + MORE_MB:
        return f"a desk of {ended.desk_mb:.0f} MB instead of {quiet.desk_mb:.0f} MB"
    return f"{ended.disk_kb:.0f} KB written" if ended.disk_kb > quiet.disk_kb + MOST_KB else ""


def _expected(line: str) -> bool:
    """Whether the class says such a line when nothing is wrong."""
    begins = r"pupils: |code: |your own page, |certificate, SHA-256: |.+ \(\d+\) has |.+ \(\d+\), lesson 1: (open|over|stopped)"
    return re.match(begins, line) is not None


PART = Part(
    "attacks on a class",
    "pupils learn the same, nobody gets in, the class goes on",
    ROUNDS * 2 * len(ATTACKS),
    prepare,
    attempt,
)
