"""Part `ctrl-c`: Ctrl-C during a search of `lab sequence`, which must still print an order with its bound, and exit with 130."""

import json
import random
import signal
import subprocess
import time
from pathlib import Path

from devtools.commands import LAB, Ended, environment, kill_session
from devtools.parts import Outcome, Part
from devtools.plain_pairs import KINDS, random_shop, shop_files
from lab.sequencing import SEQUENCERS
from lab.sequencing.search import SAME

EACH = 20  # times that each method is stopped
LATEST_S = 2.5  # the longest time from the begin of a search to Ctrl-C
MOST_S = 60.0
BEGINS = "Find the order"  # the first words of the line that a search prints when it begins
SHOP, LATE = "larger job shop, 1 vehicle", "larger job shop, due dates"  # kinds of `plain_pairs`
ON = {"earliest-due": LATE, "srl-time": "toast-case-2"}  # what is ordered by methods that do not take SHOP
METHODS = tuple(SEQUENCERS)


def prepare(room: Path, seed: int) -> int:
    """Write the shops; return the number of attempts, EACH for every method."""
    for name in (SHOP, LATE):
        kind = next(known for known in KINDS if known.name == name)
        (room / name).mkdir(exist_ok=True)
        words, _ = shop_files(random_shop(kind, seed), kind, room / name)
        (room / name / "words.json").write_text(json.dumps(words), encoding="utf-8")
    return EACH * len(METHODS)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Stop one method at a drawn moment."""
    method, after_s = METHODS[number % len(METHODS)], LATEST_S * random.Random(f"{seed} {number}").random()
    shop = ON.get(method, SHOP)
    file = room / shop / "words.json"
    words = json.loads(file.read_text(encoding="utf-8")) if file.exists() else [shop, "--toasts", "24"]
    more = ["--method", method, "--seconds", f"{MOST_S / 2:g}", "--episodes", "100000", "--json"]
    ended = stopped_command(["sequence", *words, *more], after_s, room)
    (room / f"{number}.txt").write_text(ended.stderr, encoding="utf-8")
    if ended.code == 0:
        return Outcome(f"{method}: it had ended", f"{method} after {after_s:.2f} s")
    return Outcome(
        method, f"{method} after {after_s:.2f} s", fault_of(ended), figures={"until_end_s": round(ended.seconds, 2)}
    )


def stopped_command(words: list[str], after_s: float, room: Path) -> Ended:
    """The end of a command that is sent SIGINT `after_s` after its search has begun; its `seconds` count from then."""
    child = subprocess.Popen(
        [*LAB, *words], cwd=room, env=environment(room, PYTHONFAULTHANDLER="1"), text=True, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background jobs ignore it
    )  # fmt: skip
    assert child.stderr is not None
    said = [child.stderr.readline()]
    while said[-1] and not said[-1].startswith(BEGINS):
        said.append(child.stderr.readline())
    time.sleep(after_s)
    child.send_signal(signal.SIGINT)
    begun, late = time.monotonic(), False
    try:
        out, rest = child.communicate(timeout=MOST_S)
    except subprocess.TimeoutExpired:
        late = True
        kill_session(child.pid)
        out, rest = child.communicate()
    return Ended(child.returncode, out, "".join([*said, rest]), time.monotonic() - begun, 0, late)


def fault_of(ended: Ended) -> str:
    """What is wrong with how a stopped command ended; "" if nothing is."""
    if broke := ended.fault((130,)):
        return broke
    if ended.stdout.count("\n") != 1:
        return f"{ended.stdout.count(chr(10))} lines instead of one document"
    document = json.loads(ended.stdout)
    if "error" in document:
        return f"no order: {document['error']}"
    if (document["stopped_by"], document["interrupted"]) != ("Ctrl-C", True):
        return f"stopped by {document['stopped_by']}"
    if not document["best_sequence"] or len(document["best_moves"]) != len(document["best_sequence"]):
        return "the order is empty, or moves are missing"
    if not 0 < document["bound_cost"] <= document["best_cost"] + SAME and document["objective"] == "makespan":
        return f"bound {document['bound_cost']}, best {document['best_cost']}"
    if document["optimum_proven"] != (document["best_cost"] <= document["bound_cost"] + SAME):
        return f"proven: {document['optimum_proven']}, bound {document['bound_cost']}, best {document['best_cost']}"
    return ""


PART = Part(
    what="Ctrl-C at any time of a search, for each method of `lab sequence`",
    target="every command prints an order with its bound",
    count=None,
    prepare=prepare,
    attempt=attempt,
)
