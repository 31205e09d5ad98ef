"""Policies as safetensors files: writing is reproducible, and a damaged file is never read."""

import json
import struct
from dataclasses import fields
from datetime import datetime
from functools import cache
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError, create_model
from safetensors import SafetensorError
from safetensors.numpy import load, save

from lab.errors import BadInput
from lab.files import json_of
from lab.toolbox.names import FORMAT
from lab.toolbox.policy import Policy

_TENSORS = {"q": "F64", "visits": "I64", "ends": "U8"}
_METADATA = tuple(field.name for field in fields(Policy) if field.name not in _TENSORS)


def encode(policy: Policy) -> bytes:
    """The bytes of a policy's file; the same policy always gives the same bytes."""
    metadata = {name: json.dumps(getattr(policy, name), allow_nan=False) for name in _METADATA}
    tensors = {name: np.ascontiguousarray(getattr(policy, name)) for name in _TENSORS}
    return ordered(save(tensors, {"format": FORMAT, **metadata}))


def decode(content: bytes, where: str) -> Policy:
    """The policy in these bytes, completely checked. Raises BadInput, which names the file `where`, if anything is wrong."""
    try:
        tensors, metadata = _read(content)
        held: dict[str, Any] = tensors | _read_metadata(metadata)
        return Policy(**held)
    except (BadInput, SafetensorError, ValueError, TypeError, KeyError, RecursionError, MemoryError) as error:
        raise unreadable(where, error) from error


def unreadable(where: str, error: Exception) -> BadInput:
    """The error for a policy file that cannot be read or is damaged."""
    return BadInput(f"policy file {where}: {' '.join(str(error).split()) or type(error).__name__}")


def described(policy: Policy) -> dict[str, Any]:
    """All metadata of a policy, and the size of its table."""
    states, actions = policy.q.shape
    values = {name: getattr(policy, name) for name in _METADATA}
    return {**values, "states": states, "actions": actions, "episodes": len(policy.curve)}


def ordered(content: bytes) -> bytes:
    """The file with a sorted header, because the library writes metadata in arbitrary order."""
    data = content[8 + _header_bytes(content) :]
    header = json.dumps(header_of(content), sort_keys=True, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)  # tables begin at a multiple of 8 bytes
    return struct.pack("<Q", len(header)) + header + data


def _header_bytes(content: bytes) -> int:
    length: int = struct.unpack_from("<Q", content)[0]
    return length


def header_of(content: bytes) -> dict[str, Any]:
    """The header of a safetensors file that the library has read."""
    header = json.loads(content[8 : 8 + _header_bytes(content)])
    assert isinstance(header, dict)  # the library has already read it
    return header


def _read(content: bytes) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, str]]:
    tensors: dict[str, np.ndarray[Any, Any]] = load(content)
    header = header_of(content)
    metadata = header.get("__metadata__") or {}
    if metadata.get("format") != FORMAT:
        raise ValueError(f"format {metadata.get('format')!r}, allowed '{FORMAT}'")
    if set(tensors) != set(_TENSORS):
        raise ValueError(f"it holds the tensors {sorted(tensors)}, allowed {sorted(_TENSORS)}")
    for name in sorted(tensors):
        if header[name]["dtype"] != _TENSORS[name]:
            raise ValueError(f"{name} has type {header[name]['dtype']}, allowed {_TENSORS[name]}")
    return {name: table if table.flags.writeable else table.copy() for name, table in tensors.items()}, metadata


def _date(text: str) -> str:
    datetime.fromisoformat(text)
    return text


@cache
def _metadata() -> type[BaseModel]:
    """A model of the metadata in a policy's file: the fields of `Policy` without its arrays."""
    held: dict[str, Any] = {field.name: (field.type, ...) for field in fields(Policy) if field.name in _METADATA}
    held["created"] = (Annotated[str, AfterValidator(_date)], ...)
    held["learner"] = held["gate"] = (dict[str, str | bool | int | float], ...)
    return create_model("Metadata", __config__=ConfigDict(strict=True, allow_inf_nan=False), **held)


def _read_metadata(metadata: dict[str, str]) -> dict[str, Any]:
    values = {name: json_of(metadata[name]) for name in _METADATA if name in metadata}
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
