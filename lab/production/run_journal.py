"""A run's journal, `run.jsonl` in its folder: what decides the run, one line of JSON each, written before it counts.

A run is a function of its task, its options and seed, what the toolbox held when it began, what people answered, and at
which physics steps it was stopped or told to do something. So these are kept, and with them what came of it: a run is
resumed by carrying it out again from its beginning: the journal stands in for the people, and each move is compared with
its line. Skills that were learned before are taken from the run's folder.
"""

import json
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from shutil import rmtree
from typing import Any, NamedTuple

from lab.advice.entries import MAX_BYTES
from lab.advice.json_lines import AppendedFile, EntryKinds, differing
from lab.errors import BadInput, WorkFailed
from lab.files import json_of, read_limited
from lab.production.controls import Held, StopKind, StopsChanged
from lab.sim.world import TIME_STEP
from lab.tasks.record import write_whole
from lab.toolbox.folder_place import FolderPlace
from lab.toolbox.index import KnownPolicies
from lab.toolbox.names import SUFFIX, slug
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode, encode
from lab.version import __version__

FILE = "run.jsonl"
KNOWN = "known.json"  # which policies the toolbox held when the run began
SKILLS = "skills"  # the folder for the policies of the run
LED = "led"  # the folder for what people led the arm along, a file of answers a skill
SCHEMA = 1
MAX_STEP = 10**12  # physics steps, more than a century


@dataclass(frozen=True)
class RunBegan:
    """The first line: the words that began the run, the task's file as a hash, and the version that wrote it.

    command: "run", or "operate" where it is done by hand.
    """

    words: dict[str, Any]
    task: str
    task_hash: str
    command: str = "run"
    lab: str = __version__
    schema: int = SCHEMA


@dataclass(frozen=True)
class SessionKept:
    """People are asked in a lesson, or about the order: the folder of its own journal."""

    name: str
    folder: str


@dataclass(frozen=True)
class SkillKept:
    """A skill is there: its row as `lab run --json` shows it, and the file with its policy in the run's folder."""

    row: dict[str, Any]
    file: str


@dataclass(frozen=True)
class DurationsKept:
    """How long moves take, as `Durations.to_json` has it."""

    times: dict[str, dict[str, float]]
    sim_s: float


@dataclass(frozen=True)
class Stopped:
    """From a physics step on these stops were pressed, each its kind, why and by whom; none: the run went on."""

    step: int
    stops: list[tuple[str, str, str]]


@dataclass(frozen=True)
class Commanded:
    """The operator gave a command at a physics step; refused: why it was not followed, "" when it was."""

    step: int
    words: str
    by: str
    refused: str = ""


@dataclass(frozen=True)
class Led:
    """A person has led the arm along a skill's way: the move that was shown in each state, by their labels."""

    step: int
    skill: str
    by: str
    said: dict[str, str]


@dataclass(frozen=True)
class Moved:
    """A part was brought on, until this physics step."""

    step: int
    part: str
    origin: str
    target: str
    pick_s: float
    drop_s: float


@dataclass(frozen=True)
class Met:
    """Something was not as planned, and what was done about it."""

    step: int
    what: str
    answer: str
    part: str
    station: str


@dataclass(frozen=True)
class RunEnded:
    """The last line: how many parts were delivered, and why not all were."""

    delivered: int
    failure: str


Entry = RunBegan | SessionKept | SkillKept | DurationsKept | Stopped | Commanded | Led | Moved | Met | RunEnded
KINDS: dict[str, type[Any]] = {
    "run": RunBegan,
    "session": SessionKept,
    "skill": SkillKept,
    "durations": DurationsKept,
    "stopped": Stopped,
    "commanded": Commanded,
    "led": Led,
    "moved": Moved,
    "met": Met,
    "ended": RunEnded,
}
_LINES = EntryKinds(KINDS)


class KeptSkill(NamedTuple):
    """A skill that was there when the run was stopped."""

    row: dict[str, Any]
    policy: Policy


@dataclass
class RunJournal:
    """The journal of a run under way; without a path, one that is not written.

    known: the lines of a run that is resumed, without its head; what the run tells again is compared with them.
    """

    path: Path | None = None
    head: RunBegan | None = None
    known: tuple[Entry, ...] = ()
    file: AppendedFile | None = None
    _again: list[Entry] = field(default_factory=list)  # outputs that are still to be told again
    _made: set[str] = field(default_factory=set)  # the problems of the policies that were kept, as `KnownPolicies.made`

    @classmethod
    def begin(cls, folder: Path, head: RunBegan) -> "RunJournal":
        """A new journal in a folder, which is made; one that is there, and not being written, is put aside. BadInput."""
        path = folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if path.exists():
                AppendedFile.again(path).put_aside(path.with_name("run-before.jsonl"))
            path.with_name(KNOWN).unlink(missing_ok=True)
            journal = cls(path, head, file=AppendedFile.new(path))
        except OSError as error:
            raise BadInput(f"journal '{path}' (--out) cannot be written: {error.strerror or error}") from error
        journal.write(head)
        return journal

    @classmethod
    def resume(cls, folder: Path) -> "RunJournal":
        """Go on with the journal in a folder; what was cut off at its end is taken away. BadInput when it is over."""
        path = folder / FILE
        try:
            journal = cls(path, file=AppendedFile.again(path))
        except OSError as error:
            raise BadInput(f"journal '{path}' (--resume): {error.strerror or error}: no run was begun there") from None
        assert journal.file is not None
        try:
            journal.head, journal.known, whole = read_run(folder, "--resume")
            if isinstance(journal.known[-1] if journal.known else None, RunEnded):
                raise BadInput(f"the run in '{folder}' (--resume) is over: look at it again with lab replay {folder}")
            journal.file.cut(whole)
        except BadInput:
            journal.close()
            raise
        journal._again = [entry for entry in journal.known if isinstance(entry, Led | Moved | Met)]
        return journal

    # ---- what is known of a run that is resumed --------------------------------------------------------------------

    def known_at_first(self, now: KnownPolicies) -> KnownPolicies:
        """Of the toolbox's policies those that were there when the run began, and those that it has kept since.

        So a run does not depend on whether it was interrupted.
        """
        if self.path is None:
            return now
        path = self.path.with_name(KNOWN)
        if not path.exists():
            write_whole(path, json.dumps(now.made(), indent=0) + "\n")
            return now
        try:
            made = json_of(read_limited(path, MAX_BYTES))
        except (OSError, ValueError) as error:
            raise BadInput(f"'{path}' (--resume): cannot be read: {error}") from None
        own = {key: at for key, at in now.made().items() if key in self._made}
        return now.only((made if isinstance(made, dict) else {}) | own)

    def skill(self, name: str) -> "KeptSkill | None":
        """What was kept of a skill. BadInput when its policy is damaged or gone."""
        kept = next((e for e in self.known if isinstance(e, SkillKept) and e.row.get("name") == name), None)
        if kept is None or self.path is None:
            return None
        return KeptSkill(kept.row, decode(FolderPlace(self.path.parent / SKILLS).read(kept.file), kept.file))

    def keep_skill(self, row: dict[str, Any], policy: Policy) -> None:
        """A skill is there: its policy is written to the run's folder, then its line."""
        if self.path is not None:
            file = f"{slug(str(row['name']))}{SUFFIX}"
            FolderPlace(self.path.parent / SKILLS).write(file, encode(policy))
            self.write(SkillKept(row, file))
            self._made.add(f"{policy.subtask} {policy.signature}")

    def keep_led(self, led: Led) -> None:
        """What was led: its line, then a file of answers in the run's folder. WorkFailed where it was led otherwise before."""
        self.tell(led)
        if self.path is not None:
            answers = self.path.parent / LED / f"{slug(led.skill)}.json"
            with suppress(OSError):  # it is not written then, and says why
                answers.parent.mkdir(exist_ok=True)
            write_whole(answers, json.dumps(led.said, indent=0) + "\n")

    def sessions(self, name: str) -> list[Path]:
        """The folders of the sessions that were begun under a name, the first one first: what changed is learned again."""
        return [Path(e.folder) for e in self.known if isinstance(e, SessionKept) and e.name == name]

    def durations(self) -> DurationsKept | None:
        """The durations that it planned with."""
        return next((entry for entry in self.known if isinstance(entry, DurationsKept)), None)

    def stops(self) -> list[StopsChanged]:
        """When it was stopped and went on."""
        return [stops_of(entry) for entry in self.known if isinstance(entry, Stopped)]

    def commands(self) -> list[Commanded]:
        """What the operator said."""
        return [entry for entry in self.known if isinstance(entry, Commanded)]

    def last_step(self) -> int:
        """The last physics step that it knows of."""
        return max((e.step for e in self.known if isinstance(e, Stopped | Commanded | Led | Moved | Met)), default=0)

    # ---- what is written -------------------------------------------------------------------------------------------

    def note_stops(self, changed: StopsChanged) -> None:
        """Write that stops were pressed or released, before that counts."""
        self.write(Stopped(changed.step, [(str(held.kind), held.why, held.by) for held in changed.stops]))

    def tell(self, entry: Entry) -> None:
        """Write an outcome; of a run that is resumed, compare it with the line written before. WorkFailed if it differs."""
        if not self._again:
            self.write(entry)
            return
        before = self._again.pop(0)
        if line_of(before) != line_of(entry):
            raise WorkFailed(
                f"journal '{self.path}': the run cannot be carried out again: {differing(line_of(before), line_of(entry))}: "
                "another lab made it, or the task has changed"
            )

    def write(self, entry: Entry) -> None:
        """Append a line; raises WorkFailed when it cannot be."""
        if self.file is not None:
            self.file.write(line_of(entry))

    def forget(self) -> None:
        """Delete what was written of a run that cannot be carried out."""
        self.close()
        if self.path is not None:
            self.path.unlink(missing_ok=True)
            self.path.with_name(KNOWN).unlink(missing_ok=True)
            rmtree(self.path.with_name(SKILLS), ignore_errors=True)
            with suppress(OSError):  # it holds something else, or was there before
                self.path.parent.rmdir()

    def close(self) -> None:
        """Close the file; safe to call again."""
        if self.file is not None:
            self.file.close()


def stops_of(entry: Stopped) -> StopsChanged:
    """A line about stops as the simulation knows them."""
    return StopsChanged(entry.step, tuple(Held(StopKind(kind), why, by) for kind, why, by in entry.stops))


def line_of(entry: Entry) -> str:
    """An entry as one line of JSON, without the line's end."""
    return _LINES.line_of(entry)


def _check(entry: Entry) -> None:
    """ValueError for a value that cannot be."""
    if isinstance(entry, Stopped):
        for kind, _, _ in entry.stops:
            StopKind(kind)
    if isinstance(entry, SkillKept):
        _check_row(entry.row)
    if isinstance(entry, Stopped | Commanded | Led | Moved | Met) and not 0 <= entry.step <= MAX_STEP:
        raise ValueError(f"step {entry.step}: wanted 0 to {MAX_STEP}")


def _check_row(row: dict[str, Any]) -> None:
    """ValueError for the row of a skill that lacks what is told of it at the end of a run."""
    for name in ("name", "source"):
        if not isinstance(row.get(name), str):
            raise ValueError(f"row: it has no {name}")
    for name in ("episodes", "moves", "helped_steps", "saved_episodes", "saved_helped_steps"):
        if not isinstance(row.get(name), int):
            raise ValueError(f"row: it has no whole number of {name}")
    if not isinstance(row.get("from_task"), str | None) or not {"from_task", "fitness"} <= row.keys():
        raise ValueError("row: it has no from_task, or no fitness")


def read_run(folder: Path, where: str) -> tuple[RunBegan, tuple[Entry, ...], int]:
    """A run's head, its other lines, and how many bytes are whole lines; BadInput, naming the line, for no such journal."""
    path = folder / FILE if folder.is_dir() else folder
    try:
        raw = read_limited(path, MAX_BYTES)
    except OSError as error:
        raise BadInput(f"journal '{path}' ({where}): cannot be read: {error.strerror or error}") from None
    whole = raw.rfind(b"\n") + 1
    entries: list[Entry] = []
    for number, line in enumerate(raw[:whole].split(b"\n")[:-1], start=1):
        try:
            entries.append(_LINES.entry_of(line))
            _check(entries[-1])
        except ValueError as error:
            why = " ".join(str(error).split())[:160]
            raise BadInput(f"journal '{path}' ({where}): line {number}: {line[:60]!r}: {why}") from None
    head = entries[0] if entries else None
    if not isinstance(head, RunBegan) or head.schema != SCHEMA:
        raise BadInput(f"journal '{path}' ({where}): it does not begin with a run of schema {SCHEMA}")
    if any(isinstance(entry, RunBegan) for entry in entries[1:]):
        raise BadInput(f"journal '{path}' ({where}): a second run in one journal")
    return head, tuple(entries[1:]), whole


def replayed_run(folder: Path, where: str) -> dict[str, Any]:
    """The document of `lab replay --json` for a run: what was done in it and what came of it, with times [s]. BadInput."""
    head, entries, _ = read_run(folder, where)
    events = [json.loads(line_of(entry)) for entry in entries if not isinstance(entry, SkillKept | DurationsKept)]
    for event in events:
        if "step" in event:
            event["at_s"] = event["step"] * TIME_STEP
    ended = next((entry for entry in entries if isinstance(entry, RunEnded)), None)
    return {
        "run": str(folder),
        "task": head.task,
        "command": head.command,
        "words": head.words,
        "lab": head.lab,
        "skills": [entry.row["name"] for entry in entries if isinstance(entry, SkillKept)],
        "delivered": None if ended is None else ended.delivered,
        "failure": None if ended is None else ended.failure or None,
        "over": ended is not None,
        "events": events,
    }


def is_run(folder: Path) -> bool:
    """Whether a folder holds a run's journal."""
    return (folder / FILE).is_file()
