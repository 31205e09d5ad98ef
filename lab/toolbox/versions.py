"""The versions under one policy name: all are kept, one is in use, and it is not replaced by a worse one.

The events of the log come first, then the class `Versions`, then the comparison of two policies.
"""

import json
import re
from collections.abc import Iterable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any, NamedTuple

from lab.errors import BadInput, WorkFailed
from lab.files import json_of
from lab.toolbox.folder_place import FilePlace
from lab.toolbox.names import LOG, SUFFIX, TRASH, VERSIONS, hash_of
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode, encode, unreadable

EVALUATED = "evaluated"
ROLLED_BACK = "rolled back"

Event = dict[str, Any]  # at least "time", ISO 8601 in UTC, and "what"


def event(what: str, **facts: Any) -> Event:
    """An event with the current time."""
    return {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "what": what, **facts}


def line_of(happened: Event) -> bytes:
    """An event as a line of the log. Raises BadInput if a fact has no JSON form."""
    try:
        return json.dumps(happened, allow_nan=False).encode()
    except (TypeError, ValueError) as error:
        raise BadInput(f"log entry '{happened['what']}': {error}") from error


def read_events(lines: Iterable[bytes]) -> tuple[list[Event], list[int]]:
    """(events, damaged): the events of a log, and the numbers (from 1) of its damaged lines."""
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
    """The success rate [%] of each evaluated version by hash, from its last evaluation."""
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
    """The hashes that were in use before the current one, the last first; a rollback discards what came since.

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
    if current is not None and stack[-1:] != [current]:  # a crash kept the log from being written
        stack.append(current)
    return stack[-2::-1] if current is not None else stack[::-1]


# ---- the versions ---------------------------------------------------------------------------------------------------


_VERSION = re.compile(rf"(\d{{4,}})-([0-9a-f]{{12}}){re.escape(SUFFIX)}")
_LEAST_DIGITS = 4  # the fewest digits of an abbreviated hash
_SHOWN = 5  # the most versions that an error names


class Version(NamedTuple):
    """A version: its number, the hash of its bytes, and the name of its file in the place."""

    number: int
    hash: str
    file: str


def version_of(file: str) -> Version | None:
    """The version that a file's name denotes, None if it denotes none."""
    match = _VERSION.fullmatch(file.rpartition("/")[2])
    return None if match is None else Version(int(match[1]), match[2], file)


class Saved(NamedTuple):
    """The result of saving a policy: its file, version and hash, and why it was not put in use ("" if it was)."""

    file: str
    version: int
    hash: str
    why_not: str

    @property
    def in_use(self) -> bool:
        """Whether it is the version in use now."""
        return not self.why_not


class InUse(NamedTuple):
    """The policy in use: its bytes, their hash, and the policy."""

    content: bytes
    hash: str
    policy: Policy


class Versions:
    """The files of one policy name in a place; stem: the file stem of the name.

    "STEM.safetensors" is the version in use, "versions/STEM/NUMBER-HASH.safetensors" are all versions, "log/STEM.jsonl" the log,
    "trash/STEM.safetensors" the removed policy. A file that was copied there by hand becomes a version before it is replaced.
    """

    def __init__(self, place: FilePlace, stem: str) -> None:
        self._place = place
        self.in_use_file = f"{stem}{SUFFIX}"
        self.trash_file = f"{TRASH}/{stem}{SUFFIX}"
        self._folder, self._log = f"{VERSIONS}/{stem}", f"{LOG}/{stem}.jsonl"

    def kept(self) -> dict[str, Version]:
        """The kept versions by hash, in the order of their numbers."""
        versions = (version_of(f"{self._folder}/{name}") for name in self._place.names(self._folder))
        return {version.hash: version for version in sorted(filter(None, versions))}

    def in_use(self) -> InUse | None:
        """The policy in use, None if there is none or it is damaged. Raises BadInput if the file cannot be read."""
        try:
            content = self._place.read(self.in_use_file)
            return InUse(content, hash_of(content), decode(content, self._place.where(self.in_use_file)))
        except BadInput as error:
            if isinstance(error.__cause__, OSError):  # it may be sound, and must not be replaced
                raise unreadable(self._place.where(self.in_use_file), error) from error
            return None

    def read(self, version: Version) -> Policy:
        """The policy of a version. Raises BadInput if its bytes do not have the hash in its name, or are no sound policy."""
        return decode(self._bytes_of(version), self._place.where(version.file))

    def put(self, policy: Policy) -> Saved:
        """The result of saving a policy as a version, which is put in use unless the one in use is better."""
        content = encode(policy)
        name = hash_of(content)
        with self._place.lock(self._log):
            current, kept = self._kept_current()
            version = self._keep(content, kept)
            why_not = "" if current is None else self._does_worse(policy, name, current)
            if current is None or current.hash != name:
                if not why_not:
                    self._use(content)
                self._tell(
                    _how_learned(policy, current),
                    version,
                    in_use=not why_not,
                    **({"why_not": why_not} if why_not else {}),
                    solved=policy.solved,
                    episodes=len(policy.curve),
                    final_steps=policy.final_steps,
                    **{fact: text for fact in ("parent", "scene") if (text := getattr(policy, fact))},
                )
            if not self._place.alone:
                self._settle(kept)
        return Saved(version.file if why_not else self.in_use_file, version.number, name, why_not)

    def promote(self, wanted: str) -> Version:
        """Puts a version in use, given by number or hash, even if it is worse. Raises BadInput if there is no such version."""
        with self._place.lock(self._log):
            current, kept = self._kept_current()
            version = self._chosen(wanted, kept)
            if current is None or current.hash != version.hash:
                self._use(self._sound_bytes(version))
                self._tell("promoted", version, in_use=True, **_instead_of(current))
        return version

    def rollback(self) -> Version:
        """Puts the previous version back in use. Raises BadInput if there was none."""
        with self._place.lock(self._log):
            current, kept = self._kept_current()
            events, _ = self.events()
            before = [name for name in in_use_before(events, current and current.hash) if name in kept]
            if not before:
                raise BadInput(
                    f"policy {self._place.where(self.in_use_file)}: nothing was in use before, to go back to"
                )
            version = kept[before[0]]
            self._use(self._sound_bytes(version))
            self._tell(ROLLED_BACK, version, in_use=True, **_instead_of(current))
        return version

    def remove(self) -> None:
        """Removes the policy in use; `restore` brings it back, and its versions remain."""
        with self._place.lock(self._log):
            current, kept = self._kept_current()
            self._place.move(self.in_use_file, self.trash_file)
            self._tell("removed", kept.get(current.hash) if current else None)

    def restore(self) -> None:
        """Restores the removed policy. Raises BadInput if there is none, or if another one is in use."""
        with self._place.lock(self._log):
            if self._place.exists(self.in_use_file):
                raise BadInput(
                    f"policy {self._place.where(self.in_use_file)}: one is in use; promote chooses among its versions"
                )
            self._place.move(self.trash_file, self.in_use_file)
            current = self.in_use()
            self._tell("restored", self.kept().get(current.hash) if current else None, in_use=True)

    def note(self, what: str, **facts: object) -> None:
        """Adds an event to the log, about the version in use or the one whose `hash` is given."""
        with self._place.lock(self._log):
            current = self.in_use() if "hash" not in facts else None
            about = facts.get("hash", current and current.hash)
            self._tell(what, self.kept().get(str(about)), **({"hash": about} if about else {}) | facts)

    def events(self) -> tuple[list[Event], list[int]]:
        """(events, damaged): the events of the log, and the numbers of its damaged lines."""
        return read_events(self._place.lines(self._log))

    def faults(self) -> list[tuple[str, str]]:
        """(file, reason) of damaged versions, and of a damaged log."""
        faulty = []
        for version in self.kept().values():
            try:
                self.read(version)
            except BadInput as error:
                faulty.append((version.file, str(error)))
        if damaged := self.events()[1]:
            where = self._place.where(self._log)
            lines = ", ".join(map(str, damaged[:_SHOWN])) + (", ..." if len(damaged) > _SHOWN else "")
            faulty.append((self._log, f"log {where}: damaged lines: {lines}"))
        return faulty

    def _kept_current(self) -> tuple[InUse | None, dict[str, Version]]:
        """The policy in use, and the versions, to which it is added if necessary. The caller holds the lock."""
        self._place.sweep(self._folder)
        current, kept = self.in_use(), self.kept()
        if current is not None and current.hash not in kept:
            kept[current.hash] = version = self._keep(current.content, kept)
            self._tell("found", version, in_use=True)
        return current, kept

    def _keep(self, content: bytes, kept: dict[str, Version]) -> Version:
        """The version of these bytes, written unless it exists. Raises WorkFailed for other bytes with the same hash."""
        name = hash_of(content)
        version = kept.get(name)
        if version is None:
            number = 1 + max((version.number for version in kept.values()), default=0)
            version = Version(number, name, f"{self._folder}/{number:04}-{name}{SUFFIX}")
        else:
            with suppress(BadInput):  # a damaged version is written again
                if self._bytes_of(version) == content:
                    return version
                raise WorkFailed(f"policy file {self._place.where(version.file)}: it has the same hash and other bytes")
        self._place.write(version.file, content)
        return version

    def _use(self, content: bytes) -> None:
        self._place.write(self.in_use_file, content, drafts=self._folder)

    def _does_worse(self, policy: Policy, name: str, current: InUse) -> str:
        rates = success_percents(self._place.lines(self._log))
        return does_worse(policy, current.policy, rates.get(name), rates.get(current.hash))

    def _settle(self, known: dict[str, Version]) -> None:
        """Puts a better version in use that another process saved meanwhile; for places without a lock."""
        for version in self.kept().values():
            current = self.in_use()
            if current is None or version.hash in known or current.hash == version.hash:
                continue
            with suppress(BadInput):
                content = self._bytes_of(version)
                other = InUse(content, version.hash, decode(content, version.file))
                if self._does_worse(current.policy, current.hash, other):
                    self._use(content)

    def _tell(self, what: str, version: Version | None, **facts: object) -> None:
        known = {} if version is None else {"version": version.number, "hash": version.hash}
        self._place.append(self._log, line_of(event(what, **(known | facts))))

    def _bytes_of(self, version: Version) -> bytes:
        """The bytes of a version. Raises BadInput if they do not have its hash."""
        try:
            content = self._place.read(version.file)
        except BadInput as error:
            raise unreadable(self._place.where(version.file), error) from error
        if hash_of(content) != version.hash:
            raise unreadable(self._place.where(version.file), ValueError(f"its hash is {hash_of(content)}: damaged"))
        return content

    def _sound_bytes(self, version: Version) -> bytes:
        content = self._bytes_of(version)
        decode(content, self._place.where(version.file))
        return content

    def _chosen(self, wanted: str, kept: dict[str, Version]) -> Version:
        chosen = [version for version in kept.values() if str(version.number) == wanted]
        if not chosen and len(wanted) >= _LEAST_DIGITS:
            chosen = [version for version in kept.values() if version.hash.startswith(wanted.lower())]
        if len(chosen) == 1:
            return chosen[0]
        choices = chosen or [*kept.values()][-_SHOWN:]
        shown = ", ".join(f"{version.number} ({version.hash})" for version in choices)
        what = "several versions" if chosen else "no version"
        raise BadInput(f"policy {self._place.where(self.in_use_file)}: {what} '{wanted}'; there are: {shown or 'none'}")


def does_worse(new: Policy, old: Policy, new_percent: float | None, old_percent: float | None) -> str:
    """Why a policy is worse than the one in use, "" if it is not.

    Solved is better than unsolved. In the same problem the higher success rate is better if both were evaluated, otherwise the
    shorter path, relative to the shortest possible.
    """
    if new.solved != old.solved:
        return "the one in use is solved" if old.solved else ""
    if (new.subtask, new.signature) != (old.subtask, old.signature):
        return ""
    if new_percent is not None and old_percent is not None and new_percent != old_percent:
        return (
            f"the one in use succeeds in {old_percent:g} %, it in {new_percent:g} %"
            if new_percent < old_percent
            else ""
        )
    if _length(new) > _length(old):
        steps = "does not reach the goal" if new.final_steps is None else f"takes {new.final_steps} steps"
        return f"the one in use takes {old.final_steps} steps, it {steps}"
    return ""


def _length(policy: Policy) -> float:
    if policy.final_steps is None:
        return float("inf")
    return policy.final_steps / (policy.optimal_steps or 1)


def _how_learned(policy: Policy, current: InUse | None) -> str:
    if policy.parent:
        return "warm-started"
    before = current.policy.curve if current is not None else []
    on = 0 < len(before) < len(policy.curve) and policy.curve[: len(before)] == before
    return "continued" if on else "learned"


def _instead_of(current: InUse | None) -> dict[str, str]:
    return {} if current is None else {"instead_of": current.hash}
