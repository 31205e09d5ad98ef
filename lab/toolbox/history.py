"""What happened to the policies of one name: a log of JSON lines, and what follows from it."""

import json
from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Any

from lab.errors import BadInput
from lab.files import json_of

EVALUATED = "evaluated"
ROLLED_BACK = "rolled back"

Event = dict[str, Any]  # at least "time", ISO 8601 in UTC, and "what"


def event(what: str, **facts: Any) -> Event:
    """Something that happens now."""
    return {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "what": what, **facts}


def line_of(happened: Event) -> bytes:
    """An event as a line of the log. Raises BadInput for facts that JSON cannot hold."""
    try:
        return json.dumps(happened, allow_nan=False).encode()
    except (TypeError, ValueError) as error:
        raise BadInput(f"log entry '{happened['what']}': {error}") from error


def read_events(lines: Iterable[bytes]) -> tuple[list[Event], list[int]]:
    """The events of a log, and the numbers (from 1) of the lines that are damaged."""
    events, damaged = [], []
    for number, line in enumerate(lines, 1):
        try:
            read = json_of(line)
        except (ValueError, RecursionError):
            read = None
        if isinstance(read, dict) and isinstance(read.get("time"), str) and isinstance(read.get("what"), str):
            events.append(read)
        elif line.strip():
            damaged.append(number)
    return events, damaged


def success_percents(lines: Iterable[bytes]) -> dict[str, float]:
    """How often the evaluated versions succeeded, by hash: the last evaluation of each."""
    word = f'"{EVALUATED}"'.encode()
    events, _ = read_events(line for line in lines if word in line)
    return {
        read["hash"]: float(read["success_percent"])
        for read in events
        if read["what"] == EVALUATED
        and isinstance(read.get("success_percent"), int | float)
        and isinstance(read.get("hash"), str)
    }


def in_use_before(events: Iterable[Event], current: str | None) -> list[str]:
    """The hashes that were in use before the current one, the last first; a rollback takes back what came since.

    >>> put = [{"what": "learned", "hash": name, "in_use": True} for name in "abc"]
    >>> in_use_before(put, "c")
    ['b', 'a']
    >>> in_use_before([*put, {"what": "rolled back", "hash": "b"}], "b")
    ['a']
    """
    stack: list[str] = []
    for read in events:
        name = read.get("hash")
        if not isinstance(name, str):
            continue
        if read["what"] == ROLLED_BACK:
            while stack and stack[-1] != name:
                stack.pop()
        if (read.get("in_use") is True or read["what"] == ROLLED_BACK) and stack[-1:] != [name]:
            stack.append(name)
    if current is not None and stack[-1:] != [current]:  # a crash came before the log was written
        stack.append(current)
    return stack[-2::-1] if current is not None else stack[::-1]
