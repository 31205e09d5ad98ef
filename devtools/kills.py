"""Part `kills`: commands that write are killed, at a drawn system call or at any time; then the next command runs.

No earlier file is lost, every kept file is whole, and resuming (or repeating) the command gives the result of an undisturbed
one and leaves no temporary files. The remains of the killed command are dated back an hour for the next one.
"""

import random
import shutil
from functools import cache
from pathlib import Path

from devtools.commands import Ended
from devtools.forked import forked
from devtools.parts import Outcome, Part
from devtools.shim import Strike, built_shim
from devtools.works import (
    LONGEST_S,
    WORKS,
    CarriedOut,
    Undisturbed,
    age,
    base,
    by_itself,
    disturbed,
    environment_in,
    first_fault,
    first_leftover,
    first_loss,
    first_missing,
    fresh_home,
    kept_before,
    names,
    next_words,
    own_folder,
    undisturbed_result,
)

COUNT = 1000
LATE = 12  # every second kill is at one of so many last calls of a command
ALONE = 40  # one command in so many is a process of its own; the others are forked from one that has loaded the lab
COLD = 2 * ALONE  # one command in so many finds nothing compiled, and keeps what it compiles in its home
AT_RANDOM = 0.1  # the share of kills at any time


def prepare(room: Path, seed: int) -> None:
    """Build the shim, and the home that every command begins in."""
    built_shim(room)
    base(room)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Kill one command, and judge what it left and the next command."""
    chance = random.Random(f"{seed} {number}")
    shuffled = list(names())
    random.Random(seed).shuffle(shuffled)
    name = shuffled[number % len(shuffled)]
    expected = expected_result(name, room)
    home = fresh_home(room / f"kill-{number}", room, WORKS[name])
    carried_out = by_itself if number % ALONE == 0 or "workers" in name else forked(built_shim(room), room)
    share = chance.random() if chance.random() < AT_RANDOM else None
    longest_s = expected.seconds if carried_out is by_itself else forked_s(name, room)
    at_s = None if share is None else share * longest_s
    strike = None if at_s is not None else drawn(expected.calls, chance)
    caches = home if number % COLD == 0 else room
    killed = disturbed(home, WORKS[name].words, built_shim(room), strike, caches, at_s or LONGEST_S, carried_out)
    how = f"after {at_s:.2f} s" if at_s is not None else str(strike)
    broke = fault_of(name, expected, home, killed, room, carried_out)
    if not broke:
        shutil.rmtree(home.parent)
    return Outcome(name, f"{number}, seed {seed}: {name}: {how}", broke, figures={"MB": killed.peak_bytes / 1e6})


@cache
def expected_result(name: str, room: Path) -> Undisturbed:
    """The result of an undisturbed command, read once."""
    return undisturbed_result(name, room)


@cache
def forked_s(name: str, room: Path) -> float:
    """The time [s] that a forked command takes, measured once."""
    home = fresh_home(own_folder(room, "forked"), room, WORKS[name])
    took_s = disturbed(
        home, WORKS[name].words, built_shim(room), None, room, LONGEST_S, forked(built_shim(room), room)
    ).seconds
    shutil.rmtree(home.parent)
    return took_s


def drawn(calls: dict[str, int], chance: random.Random) -> Strike | None:
    """A kill at a random call of a random kind; None for a command without such calls."""
    kinds = [letter for letter, many in calls.items() if many]
    if not kinds:
        return None
    kind = chance.choice(kinds)
    many = calls[kind]
    at = chance.randint(max(1, many - LATE), many) if chance.random() < 0.5 else chance.randint(1, many)
    return Strike(kind, at, chance.choice(("before", "after", "half") if kind == "w" else ("before", "after")))


def fault_of(
    name: str, expected: Undisturbed, home: Path, killed: Ended, room: Path, carried_out: CarriedOut = by_itself
) -> str:
    """What is wrong after a kill or after the next command; "" if nothing is."""
    before, changes = kept_before(room), WORKS[name].changes
    if killed.code >= 0 and killed.code != expected.code:
        return f"it was not killed: exit {killed.code}: {killed.stderr[-200:]}"
    if wrong := first_loss(before, home, changes) or first_fault(home):
        return f"after the kill: {wrong}"
    age(home)
    words = next_words(name, expected, home)
    then = carried_out(words, home, environment_in(home, home if (home / "cache").exists() else room), LONGEST_S)
    said = f"then lab {' '.join(words)}"
    if fault := then.fault((0, expected.code)):
        return f"{said}: {fault}"
    is_over = words[:2] == ("toolbox", "verify") and WORKS[name].session  # pictures and receipt are not made again
    wrong = first_loss(before, home, changes) or first_fault(home) or first_leftover(home)
    if not wrong and not is_over:
        wrong = first_missing(expected, home)
    return f"{said}: {wrong}" if wrong else ""


PART = Part(
    "kills at every kind of write call, and at any time",
    "nothing lost or damaged, no leftover after the next run",
    COUNT,
    prepare,
    attempt,
)
