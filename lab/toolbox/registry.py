"""The toolbox: learned policies and measured records in a folder, written whole or not at all, never loaded damaged."""

import errno
import hashlib
import json
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError, create_model

from lab import files
from lab.errors import BadInput, WorkFailed, unknown
from lab.toolbox.policy import Policy

FORMAT = "teaching-lab-policy-1"
SUFFIX = ".safetensors"
MAX_FILE_BYTES = 1 << 30
MAX_SLUG_LENGTH = 60
Paths = list[Path]
Summaries = list[dict[str, Any]]
Words = list[str]
Report = list[tuple[Path, bool, str]]  # path, whether it is sound, what is wrong

_TENSORS = {"q": "F64", "visits": "I64", "ends": "U8"}
_SINCE_LINEAGE = {"ends", "parent", "scene"}  # older files have none of them
_METADATA = tuple(field.name for field in fields(Policy) if field.name not in _TENSORS)
_NOT_WRITABLE = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EEXIST, errno.EISDIR, errno.ENAMETOOLONG}


def default_folder() -> Path:
    """LAB_TOOLBOX if it is set, else the folder "toolbox" in the user's data folder."""
    named = os.environ.get("LAB_TOOLBOX")
    if named:
        return Path(named)
    from platformdirs import user_data_dir

    return Path(user_data_dir("teaching-lab", appauthor=False)) / "toolbox"


def slug(name: str) -> str:
    """A file stem for any name: plain lower-case ones stay, others are cleaned and get a hash that keeps them apart."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:MAX_SLUG_LENGTH]
    if plain and plain == name:
        return plain
    return f"{plain or 'policy'}-{hashlib.sha256(name.encode('utf-8', 'replace')).hexdigest()[:10]}"


class Toolbox:
    """Policies and records in one folder; the folder is made when something is first saved.

    All methods raise BadInput when the folder is no folder, cannot be read or cannot be written.
    """

    def __init__(self, folder: Path | str | None = None):
        self.folder = Path(folder) if folder is not None else default_folder()

    def check(self) -> None:
        """Raises BadInput unless policies can be saved here; makes nothing."""
        try:
            place = files.nearest(self.folder)
        except OSError as error:
            raise BadInput(f"toolbox {self.folder}: {error.strerror}") from error
        if not place.is_dir():
            raise BadInput(f"toolbox {self.folder}: '{place}' is a file, a folder is needed")
        if not os.access(place, os.R_OK | os.W_OK | os.X_OK):
            raise BadInput(f"toolbox {self.folder}: '{place}' cannot be written")

    def save(self, policy: Policy) -> Path:
        """Writes a policy, replacing one of the same name; at no time is there half a file."""
        return _write_whole(self._path(policy.name), _encode(policy))

    def load(self, path: Path | str) -> Policy:
        """Reads one file. Raises BadInput, naming it, for anything but a whole and sound policy."""
        return _decode(Path(path))

    def find(self, subtask: str, signature: str, name: str | None = None) -> Policy | None:
        """The policy of a sub-task for exactly this problem, None if there is none.

        Solved ones come before unsolved ones, then the newest. Damaged files are skipped; `verify` reports them.
        """
        fitting = [
            policy
            for _, policy in self._sound()
            if policy.subtask == subtask and policy.signature == signature and name in (None, policy.name)
        ]
        return max(fitting, key=_worth, default=None)

    def index(self) -> tuple[dict[tuple[str, str], Policy], Words]:
        """What `find` would give, for every (sub-task, signature) at once; and what is wrong with each damaged file."""
        found: dict[tuple[str, str], Policy] = {}
        damaged = []
        for path in self._files(SUFFIX):
            try:
                policy = _decode(path)
            except BadInput as error:
                damaged.append(str(error))
                continue
            key = (policy.subtask, policy.signature)
            found[key] = max(found.get(key, policy), policy, key=_worth)
        return found, damaged

    def list(self) -> Summaries:
        """What is stored, in file order: the metadata of each sound policy without curve and settings."""
        brief = ("learner", "gate", "versions", "curve", "guided", "action_labels", "shape", "start")
        return [{k: v for k, v in _describe(path, policy).items() if k not in brief} for path, policy in self._sound()]

    def show(self, name: str) -> dict[str, Any]:
        """All metadata of one policy. Raises BadInput for an unknown name or a damaged file."""
        path = self._locate(name)
        return _describe(path, self.load(path))

    def remove(self, name: str) -> Path:
        """Deletes a policy by its name, or a damaged file by its stem; returns the path. Raises BadInput if unknown."""
        path = self._locate(name)
        try:
            path.unlink()
        except OSError as error:
            raise _refused("remove", path, error) from error
        return path

    def verify(self) -> Report:
        """Checks every file: (path, whether it is sound, "" or what is wrong)."""
        report = []
        for path in [*self._files(SUFFIX), *self._files(".json", "records/*/")]:
            try:
                _decode(path) if path.suffix == SUFFIX else _read_record(path)
                report.append((path, True, ""))
            except BadInput as error:
                report.append((path, False, str(error)))
        return report

    def save_record(self, kind: str, key: str, record: dict[str, Any]) -> Path:
        """Keeps a JSON record, such as the measured duration of a transfer, under its kind and key."""
        try:
            text = json.dumps({"kind": kind, "key": key, "record": record}, indent=1, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise BadInput(f"record '{key}' ({kind}): {error}") from error
        return _write_whole(self._record_path(kind, key), text.encode())

    def load_record(self, kind: str, key: str) -> dict[str, Any] | None:
        """The record of that kind and key; None when there is none or its file is damaged (see `verify`)."""
        try:
            whole = _read_record(self._record_path(kind, key))
        except BadInput:
            return None
        record: dict[str, Any] = whole["record"]
        return record if (whole["kind"], whole["key"]) == (kind, key) else None

    def _path(self, name: str) -> Path:
        return self.folder / f"{slug(name)}{SUFFIX}"

    def _record_path(self, kind: str, key: str) -> Path:
        return self.folder / "records" / slug(kind) / f"{slug(key)}.json"

    def _files(self, suffix: str, below: str = "") -> Paths:
        try:
            if self.folder.exists() and not self.folder.is_dir():
                raise BadInput(f"toolbox {self.folder}: it is a file, a folder is needed")
            if self.folder.exists():
                os.scandir(self.folder).close()  # glob would hide a folder that may not be read
            return sorted(self.folder.glob(f"{below}*{suffix}"))
        except OSError as error:
            raise _refused("read", self.folder, error) from error

    def _sound(self) -> Iterator[tuple[Path, Policy]]:
        for path in self._files(SUFFIX):
            with suppress(BadInput):
                yield path, _decode(path)

    def _locate(self, name: str) -> Path:
        files = self._files(SUFFIX)
        for path in (self._path(name), self.folder / f"{name}{SUFFIX}"):
            if path in files:
                return path
        named = {policy.name: path for path, policy in self._sound()}
        if name not in named:
            raise unknown("policy", name, named, f"toolbox {self.folder}")
        return named[name]


def _worth(policy: Policy) -> tuple[bool, str]:
    return policy.solved, policy.created


def _refused(verb: str, path: Path, error: OSError) -> BadInput | WorkFailed:
    reason = f"cannot {verb} {path}: {error.strerror or error}"
    return BadInput(reason) if error.errno in _NOT_WRITABLE or verb == "read" else WorkFailed(reason)


def _write_whole(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_whole(path, content)
    except OSError as error:
        raise _refused("write", path, error) from error
    return path


def _read_record(path: Path) -> dict[str, Any]:
    try:
        whole = json.loads(path.read_bytes(), parse_constant=_reject_constant)
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(f"record file {path}: {error}") from error
    if not isinstance(whole, dict) or not isinstance(whole.get("record"), dict) or not {"kind", "key"} <= whole.keys():
        raise BadInput(f"record file {path}: it must hold kind, key and record")
    return whole


def _reject_constant(text: str) -> None:
    raise ValueError(f"{text} is not allowed")


def _date(text: str) -> str:
    datetime.fromisoformat(text)
    return text


@cache
def _metadata() -> type[BaseModel]:
    """What a policy's file holds beside its tables: the fields of `Policy`."""
    held: dict[str, Any] = {
        field.name: (field.type, field.default if field.name in _SINCE_LINEAGE else ...)
        for field in fields(Policy)
        if field.name in _METADATA
    }
    held["created"] = (Annotated[str, AfterValidator(_date)], ...)
    held["learner"] = held["gate"] = (dict[str, str | bool | int | float], ...)
    return create_model("Metadata", __config__=ConfigDict(strict=True, allow_inf_nan=False), **held)


def _encode(policy: Policy) -> bytes:
    from safetensors.numpy import save

    metadata = {name: json.dumps(getattr(policy, name), allow_nan=False) for name in _METADATA}
    found = {name: getattr(policy, name) for name in _TENSORS}
    tensors = {name: np.ascontiguousarray(table) for name, table in found.items() if table is not None}
    content: bytes = save(tensors, {"format": FORMAT, **metadata})
    return content


def _decode(path: Path) -> Policy:
    from safetensors import SafetensorError

    try:
        if not path.is_file():
            raise ValueError("it is not a file" if path.exists() else "there is no such file")
        if path.stat().st_size > MAX_FILE_BYTES:
            raise ValueError(f"it has {path.stat().st_size} bytes, allowed {MAX_FILE_BYTES}")
        tensors, metadata = _read_tensors(path)
        held: dict[str, Any] = tensors | _read_metadata(metadata)
        return Policy(**held)
    except (BadInput, SafetensorError, OSError, ValueError, TypeError, RecursionError, MemoryError) as error:
        raise BadInput(f"policy file {path}: {' '.join(str(error).split()) or type(error).__name__}") from error


def _read_tensors(path: Path) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, str]]:
    from safetensors import safe_open

    with safe_open(path, framework="np") as file:
        metadata = file.metadata() or {}
        if metadata.get("format") != FORMAT:
            raise ValueError(f"format {metadata.get('format')!r}, allowed '{FORMAT}'")
        found = set(file.keys())
        if not set(_TENSORS) - _SINCE_LINEAGE <= found <= set(_TENSORS):
            raise ValueError(f"it holds the tensors {sorted(found)}, allowed {sorted(_TENSORS)}")
        for name in sorted(found):
            dtype = _TENSORS[name]
            if file.get_slice(name).get_dtype() != dtype:
                raise ValueError(f"{name} has type {file.get_slice(name).get_dtype()}, allowed {dtype}")
        return {name: file.get_tensor(name) for name in found}, metadata


def _read_metadata(metadata: dict[str, str]) -> dict[str, Any]:
    values = {
        name: json.loads(metadata[name], parse_constant=_reject_constant) for name in _METADATA if name in metadata
    }
    try:
        found = _metadata().model_validate_json(json.dumps(values))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field, why = ".".join(map(str, first["loc"][:1])), first["msg"]
        if first["type"] == "missing":
            raise ValueError(f"its field '{field}' is missing") from None
        raise ValueError(
            f"its field '{field}' is {str(metadata.get(field))[:60]!r}, which is not allowed: {why}"
        ) from None
    return dict(found)


def _describe(path: Path, policy: Policy) -> dict[str, Any]:
    states, actions = policy.q.shape
    values = {field.name: getattr(policy, field.name) for field in fields(policy) if field.name not in _TENSORS}
    return {**values, "states": states, "actions": actions, "episodes": len(policy.curve), "file": str(path)}
