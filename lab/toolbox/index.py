"""The index of a toolbox: a cache of the policies' metadata, so that a list need not read all files; lazily read policies."""

import json
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from contextlib import suppress
from typing import Any

from lab.errors import BadInput
from lab.files import read_limited, write_whole
from lab.toolbox import deferred
from lab.toolbox.folder_place import FilePlace, FileState
from lab.toolbox.names import SUFFIX, VERSIONS, hash_of

FILE = "index.json"  # in the place's cache
FORMAT = "teaching-lab-index-1"
Row = dict[str, Any]
Key = tuple[str, str]  # sub-task, signature
_LEFT_OUT = ("learner", "gate", "versions", "curve", "guided", "start")
_HEAD, _REST = '{"crc32": "', '", "index": '
_MANY = 20  # from this many files, or this fraction of all, their versions are listed in one call
_STALE_SHARE = 0.01  # the share of stale rows from which the index is written again
_LEAST = 50  # policies; for fewer no index is written


class Index:
    """A row per policy in use: its metadata without curve and settings, or why it is damaged.

    Only files that changed since they were read are read again. The index is written from 50 policies on. Several processes may
    use it at once, because it is written atomically and a row counts only while the stamp of its file is unchanged.
    """

    def __init__(self, place: FilePlace) -> None:
        self._place = place
        self._rows: dict[str, Row] | None = None
        self._stamps: dict[str, str] = {}

    def rows(self) -> dict[str, Row]:
        """The rows by file name, in order; a damaged file's row holds "damaged" alone, the reason."""
        if self._rows is None:
            self._rows, self._stamps = self._loaded()
        now = {name: state for name, state in self._place.files().items() if name.endswith(SUFFIX)}
        stale = {name: at for name, at in now.items() if not at.stamp or self._stamps.get(name) != at.stamp}
        gone = self._rows.keys() - now.keys()
        if not stale and not gone:
            return self._rows
        rows = {name: self._rows[name] for name in now.keys() - stale.keys()} | self._read(stale)
        self._rows = dict(sorted(rows.items()))
        self._stamps = {name: at.stamp for name, at in now.items() if at.stamp}
        changed = sum(bool(at.stamp) and "damaged" not in rows[name] for name, at in stale.items()) + len(gone)
        if len(now) >= _LEAST and changed > _STALE_SHARE * len(now):
            self._keep()
        return self._rows

    def _read(self, states: Mapping[str, FileState]) -> dict[str, Row]:
        """The rows of these files."""
        rows: dict[str, Row] = {}
        numbers = self._numbers(states)
        for name, content in self._place.read_many(states):
            where = self._place.where(name)
            try:
                if isinstance(content, BadInput):
                    raise deferred.unreadable(where, content)
                facts = deferred.described(deferred.decode(content, where))
            except BadInput as error:
                rows[name] = {"damaged": str(error)}
                continue
            row, made = {fact: value for fact, value in facts.items() if fact not in _LEFT_OUT}, hash_of(content)
            kept = numbers.get(name.removesuffix(SUFFIX), {})
            rows[name] = {**row, "version": kept.get(made) if kept else 1, "hash": made}
        return rows

    def _numbers(self, states: Mapping[str, FileState]) -> dict[str, dict[str, int]]:
        """The numbers of the versions of these files, by stem and hash."""
        numbers: dict[str, dict[str, int]] = {}
        folders = [f"{VERSIONS}/{name.removesuffix(SUFFIX)}" for name in states]
        if len(folders) < max(_MANY, len(self._rows or ()) // _MANY):
            files = [f"{folder}/{name}" for folder in folders for name in self._place.names(folder)]
        else:
            files = self._place.tree(VERSIONS)
        for file in files:
            if (version := deferred.version_of(file)) is not None:
                numbers.setdefault(file.split("/")[1], {})[version.hash] = version.number
        return numbers

    def _loaded(self) -> tuple[dict[str, Row], dict[str, str]]:
        """The stored rows and stamps, empty if the file is missing or damaged."""
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            text = read_limited(self._place.cache / FILE)
            end = len(_HEAD) + 8
            body = text[end + len(_REST) : -1]
            if text[len(_HEAD) : end].decode() == _checksum(body):
                kept = json.loads(body)
                if kept["format"] == FORMAT:
                    return kept["rows"], kept["stamps"]
        return {}, {}

    def _keep(self) -> None:
        assert self._rows is not None
        rows = {name: row for name, row in self._rows.items() if name in self._stamps and "damaged" not in row}
        stamps = {name: self._stamps[name] for name in rows}
        body = json.dumps({"format": FORMAT, "stamps": stamps, "rows": rows}).encode()
        with suppress(OSError):  # a read-only toolbox works without a stored index
            self._place.cache.mkdir(parents=True, exist_ok=True)
            write_whole(self._place.cache / FILE, f"{_HEAD}{_checksum(body)}{_REST}".encode() + body + b"}")


def _checksum(body: bytes) -> str:
    return f"{zlib.crc32(body):08x}"


class KnownPolicies(MutableMapping[Key, "deferred.Policy"]):
    """Policies by (sub-task, signature), each read when it is first used; one that cannot be read raises KeyError.

    rows: of the index, with at least name, solved, created, states, actions and file; load: reads a file.
    """

    def __init__(self, rows: Mapping[Key, Row], load: Callable[[str], "deferred.Policy"]) -> None:
        self._rows, self._load = dict(rows), load
        self._read: dict[Key, deferred.Policy] = {}

    @classmethod
    def of(cls, policies: Iterable["deferred.Policy"]) -> "KnownPolicies":
        """These policies, which are in memory already."""
        known = cls({}, lambda file: NotImplemented)
        known.update({(policy.subtask, policy.signature): policy for policy in policies})
        return known

    def alike(self, subtask: str, states: int, actions: int) -> list[tuple[Key, str]]:
        """(key, name) of the solved policies of a sub-task with this table size, the newest first; no file is read."""
        wanted = {"solved": True, "states": states, "actions": actions}
        keys = [key for key, row in self._rows.items() if key[0] == subtask and row | wanted == row]
        keys.sort(key=lambda key: str(self._rows[key]["created"]), reverse=True)
        return [(key, self._rows[key]["name"]) for key in keys]

    def made(self) -> dict[str, str]:
        """The creation time of each policy, by "sub-task signature"."""
        return {" ".join(key): str(row["created"]) for key, row in self._rows.items()}

    def only(self, made: Mapping[str, str]) -> "KnownPolicies":
        """The policies that are in such a table with the same creation time."""
        rows = {key: row for key, row in self._rows.items() if made.get(" ".join(key)) == str(row["created"])}
        return KnownPolicies(rows, self._load)

    def __getitem__(self, key: Key) -> "deferred.Policy":
        if key not in self._read:
            try:
                self._read[key] = self._load(self._rows[key]["file"])
            except BadInput:
                raise KeyError(key) from None
        return self._read[key]

    def __setitem__(self, key: Key, policy: "deferred.Policy") -> None:
        states, actions = policy.q.shape
        about = {"name": policy.name, "solved": policy.solved, "created": policy.created}
        self._read[key], self._rows[key] = policy, about | {"states": states, "actions": actions}

    def __delitem__(self, key: Key) -> None:
        if key not in self:
            raise KeyError(key)
        self._read.pop(key, None)
        self._rows.pop(key, None)

    def __iter__(self) -> Iterator[Key]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)
