"""What a class keeps of its run by hand beside the run's journal: who gave which command, and a row for each pupil."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lab.classroom.class_lesson import is_operation
from lab.classroom.kept_lesson import kept_lesson
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import COLUMNS
from lab.errors import BadInput
from lab.files import is_file, json_of, read_limited

RUN = "run"  # the folder of the run, in that of the class
COMMANDS = (
    "commands.jsonl"  # in the folder of the run: a line for each command, as {"pupil": 2, "command": "jog +z 20"}
)
RUN_COLUMNS = ("pupil", "name", "lesson", "skill", "state", "solved", "delivered", "parts", "commands")
MOST_WORDS = 80  # characters of a command
MOST_BYTES = 1 << 26


def keep_command(folder: Path, pupil: int, words: str) -> None:
    """Note that a pupil has given a command. If it cannot be written, the run goes on without the note."""
    with suppress(OSError), (folder / COMMANDS).open("a", encoding="utf-8") as file:
        file.write(json.dumps({"pupil": pupil, "command": words[:MOST_WORDS]}) + "\n")


def counted_commands(folder: Path) -> Counter[int]:
    """How many commands each pupil has given, by number; a damaged line is left out."""
    counts, path = Counter[int](), folder / COMMANDS
    if not is_file(path):
        return counts
    with suppress(OSError, BadInput):
        for line in read_limited(path, MOST_BYTES).splitlines():
            with suppress(ValueError, KeyError, TypeError, RecursionError):
                if type(pupil := json_of(line)["pupil"]) is int:
                    counts[pupil] += 1
    return counts


def rows_of_run(
    pupils: Sequence[Pupil], document: Mapping[str, Any], commands: Mapping[int, int]
) -> list[dict[str, Any]]:
    """A row for each pupil: what came of the run that all have operated, and how many commands the pupil gave.

    document: of `lab operate --json`. commands: by the pupils' numbers.
    """
    shared = {
        "lesson": 1,
        "skill": f"{document['task']} by hand",
        "state": "over",
        "solved": document["success"],
        "delivered": document["delivered"],
        "parts": sum(document["parts"].values()),
    }
    return [
        shared | {"pupil": pupil.number, "name": pupil.name, "commands": commands.get(pupil.number, 0)}
        for pupil in pupils
    ]


def columns_of(roster: Roster) -> tuple[str, ...]:
    """The columns of the table of a class."""
    return RUN_COLUMNS if is_operation(roster.lessons) else COLUMNS


def kept_rows(roster: Roster) -> list[dict[str, Any]]:
    """The rows of a finished run by hand that the folder of a class tells; [] for any other class, and a damaged document."""
    folder = roster.folder / RUN
    kept = kept_lesson(folder) if is_operation(roster.lessons) else None
    if kept is None:
        return []
    try:
        return rows_of_run(roster.present, kept["document"], counted_commands(folder))
    except (KeyError, TypeError, ValueError, AttributeError):
        return []
