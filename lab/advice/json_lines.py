"""Append-only files of JSON lines: their entries, and writing them by one process at a time."""

import json
import os
import stat
from collections.abc import Hashable, Mapping
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path
from typing import Any, Self

from pydantic import ConfigDict, TypeAdapter, ValidationError

from lab.errors import BadInput, WorkFailed
from lab.files import json_of
from lab.operating_system import lock, opened, replace_and_close

MAX_LINE_BYTES = 1 << 22
_SHOWN = 40  # characters that an error shows of each of two differing lines
_PLAINLY = {"predicate_failed": "it holds what cannot be printed"}  # kind of fault -> text that replaces pydantic's


class EntryKinds:
    """The kinds of entries in one file format: dataclasses by the value of "kind" in their lines."""

    def __init__(self, kinds: Mapping[str, type[Any]]) -> None:
        self._kinds = dict(kinds)
        self._name_of = {kind: name for name, kind in kinds.items()}

    def line_of(self, entry: Any) -> str:
        """An entry as one line of JSON, without a line break; a field that is written if it is not None is left out if it is."""
        record = asdict(entry)
        kind: Any = type(entry)
        for name in _seldom(kind):
            if record[name] is None:
                del record[name]
        return json.dumps({"kind": self._name_of[kind], **record}, allow_nan=False)

    def entry_of(self, line: bytes) -> Any:
        """The entry in a line. Raises ValueError if it holds none."""
        if len(line) > MAX_LINE_BYTES:
            raise ValueError(f"{len(line)} bytes long, allowed {MAX_LINE_BYTES}")
        record = json_of(line.decode("utf-8"))
        kind = record.pop("kind", None) if isinstance(record, dict) else None
        if not isinstance(kind, str) or kind not in self._kinds:
            raise ValueError(f"kind {kind!r} is none of {', '.join(self._kinds)}")
        model: Any = self._kinds[kind]
        try:
            entry = _reader(model).validate_json(json.dumps(record))
        except ValidationError as error:
            wrong = [
                f"{'.'.join(map(str, finding['loc']))}: {_PLAINLY.get(finding['type'], finding['msg'])}"
                for finding in error.errors(include_url=False)
            ]
            raise ValueError(f"{kind}: {'; '.join(wrong)}") from None
        return model(**{name: getattr(entry, name) for name in entry.__dataclass_fields__})


def differing(before: str, now: str) -> str:
    """The difference of two lines of JSON, shortened for an error: their common beginning, and each from the difference on."""
    same = next((at for at, (one, other) in enumerate(zip(before, now, strict=False)) if one != other), len(before))
    begin = max(before.rfind(mark, 0, same) for mark in (", ", "{")) + 1
    then, comes = (line[begin : begin + _SHOWN].strip() for line in (before, now))
    return f"in {before[:begin][:_SHOWN]}... it says {then}, now comes {comes}"


@cache
def _seldom(model: Hashable) -> tuple[str, ...]:
    """The fields of a kind of entries that are left out if they are None."""
    kind: Any = model
    return tuple(field.name for field in fields(kind) if field.metadata.get("written") == "if not None")


@cache
def _reader(model: Hashable) -> Any:
    strict = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    kind: Any = model
    return TypeAdapter(type(kind.__name__, (kind,), {"__pydantic_config__": strict, "__doc__": kind.__doc__}))


def is_unwritten(path: Path, head: bytes) -> bool:
    """Whether the file holds only an incomplete first line, which would begin with `head`: its writer was killed."""
    try:
        with path.open("rb") as file:
            begun = file.read(MAX_LINE_BYTES + 1) if stat.S_ISREG(os.fstat(file.fileno()).st_mode) else b"\n"
    except OSError:
        return False
    ours = begun.startswith(head) or head.startswith(begun)
    return ours and b"\n" not in begun and len(begun) <= MAX_LINE_BYTES


class AppendedFile:
    """A file open for appending; its lock is held until it is closed, so only one process writes."""

    def __init__(self, path: Path, flags: int) -> None:
        """Opens the file with these flags and O_APPEND. Raises OSError, and BadInput if another process writes it."""
        self.path = path
        self._file: int | None = opened(path, flags | os.O_APPEND)
        try:
            lock(self._file, wait=False)
            there = os.stat(path)
        except BlockingIOError:
            self.close()
            raise BadInput(f"journal '{path}': another command is writing it: wait until that has ended") from None
        except OSError:
            self.close()
            raise
        if not os.path.samestat(os.fstat(self._file), there):
            self.close()
            raise BadInput(f"journal '{path}': another command has just put it aside and begun a new one")

    @classmethod
    def new(cls, path: Path) -> Self:
        """A new file. Raises FileExistsError if it exists."""
        return cls(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL)

    @classmethod
    def again(cls, path: Path) -> Self:
        """An existing file."""
        return cls(path, os.O_WRONLY)

    def put_aside(self, to: Path) -> None:
        """Renames the file while it is locked, and closes it. Raises OSError."""
        file, self._file = self._file, None
        assert file is not None
        replace_and_close(file, self.path, to)

    def cut(self, size: int) -> None:
        """Truncates the file to `size` bytes. Raises OSError."""
        assert self._file is not None
        os.ftruncate(self._file, size)

    def write(self, line: str) -> None:
        """Appends a line; afterwards it survives the end of this process. Raises WorkFailed if it cannot be written."""
        if self._file is None:
            return
        left = (line + "\n").encode()
        try:
            while left:
                left = left[os.write(self._file, left) :]
        except OSError as error:
            raise WorkFailed(f"journal '{self.path}' cannot be written: {error.strerror or error}") from error

    def sync(self) -> None:
        """Flushes what was written to the disk. Raises WorkFailed."""
        if self._file is None:
            return
        try:
            os.fsync(self._file)
        except OSError as error:
            raise WorkFailed(f"journal '{self.path}' cannot be written: {error.strerror or error}") from error

    def close(self) -> None:
        """Closes the file; may be called again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
