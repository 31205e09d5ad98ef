"""The index of a toolbox: what its policies are, so that a list need not read them all. Made again when lost or stale."""

import json
import zlib
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput
from lab.files import write_whole
from lab.toolbox.names import SUFFIX, hash_of
from lab.toolbox.place import Place

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

FILE = "index.json"  # in the place's local folder
FORMAT = "teaching-lab-index-1"
Row = dict[str, Any]
Key = tuple[str, str]  # sub-task, signature
_LEFT_OUT = ("learner", "gate", "versions", "curve", "guided", "start")
_HEAD, _REST = '{"crc32": "', '", "index": '
_STALE_SHARE = 0.01  # of the rows; with fewer stale ones it is not worth writing again


class Index:
    """A row for each policy in use: its metadata without curve and settings, or why it is damaged.

    Only files that changed since they were read are read. Any number of processes may use it at once: it is written whole,
    and what it says of a file counts only while the file's stamp is the same.
    """

    def __init__(self, place: Place) -> None:
        self._place = place
        self._rows: dict[str, Row] | None = None
        self._stamps: dict[str, str] = {}

    def rows(self) -> dict[str, Row]:
        """The rows by file name, in order; a damaged file's row holds "damaged" alone, the reason."""
        if self._rows is None:
            self._rows, self._stamps = self._loaded()
        now = {name: state.stamp for name, state in self._place.files().items() if name.endswith(SUFFIX)}
        stale = [name for name, stamp in now.items() if not stamp or self._stamps.get(name) != stamp]
        gone = self._rows.keys() - now.keys()
        if not stale and not gone:
            return self._rows
        rows = {name: self._rows[name] for name in now.keys() - set(stale)}
        for name in stale:
            rows[name] = self._read(name)
        self._rows, self._stamps = dict(sorted(rows.items())), {name: stamp for name, stamp in now.items() if stamp}
        changed = sum(bool(now[name]) and "damaged" not in rows[name] for name in stale) + len(gone)
        if changed > _STALE_SHARE * len(now):
            self._keep()
        return self._rows

    def _read(self, name: str) -> Row:
        from lab.toolbox.policy_file import decode, described, unreadable
        from lab.toolbox.versions import Versions

        where = self._place.where(name)
        try:
            content = self._place.read(name)
        except BadInput as error:
            return {"damaged": str(unreadable(where, error))}
        try:
            policy = decode(content, where)
        except BadInput as error:
            return {"damaged": str(error)}
        kept, made = Versions(self._place, name.removesuffix(SUFFIX)).kept(), hash_of(content)
        number = kept[made].number if made in kept else None if kept else 1
        found = {fact: value for fact, value in described(policy).items() if fact not in _LEFT_OUT}
        return {**found, "version": number, "hash": made}

    def _loaded(self) -> tuple[dict[str, Row], dict[str, str]]:
        """What is kept of it; nothing when that is lost or damaged."""
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            text = (self._place.folder / FILE).read_bytes()
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
        with suppress(OSError):  # a toolbox that may only be read is read all the same
            self._place.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._place.folder / FILE, f"{_HEAD}{_checksum(body)}{_REST}".encode() + body + b"}")


def _checksum(body: bytes) -> str:
    return f"{zlib.crc32(body):08x}"


class KnownPolicies(MutableMapping[Key, "Policy"]):
    """Policies by sub-task and signature, each read when it is first asked for; one that is gone by then is not there."""

    def __init__(self, files: dict[Key, str], load: Callable[[str], "Policy"]) -> None:
        self._files, self._load = files, load
        self._read: dict[Key, Policy] = {}

    def __getitem__(self, key: Key) -> "Policy":
        if key not in self._read:
            try:
                self._read[key] = self._load(self._files[key])
            except BadInput:
                raise KeyError(key) from None
        return self._read[key]

    def __setitem__(self, key: Key, policy: "Policy") -> None:
        self._read[key] = policy

    def __delitem__(self, key: Key) -> None:
        if key not in self:
            raise KeyError(key)
        self._read.pop(key, None)
        self._files.pop(key, None)

    def __iter__(self) -> Iterator[Key]:
        return iter(self._files | dict.fromkeys(self._read, ""))

    def __len__(self) -> int:
        return len(self._files.keys() | self._read.keys())
