"""Measured records in a toolbox, such as how long moves take: JSON files, by kind and key."""

import json
from typing import Any

from lab.errors import BadInput
from lab.files import json_of
from lab.toolbox.names import hash_of, slug
from lab.toolbox.place import Place

FOLDER = "records"
_SUFFIX = ".json"


def file_of(kind: str, key: str) -> str:
    """The file of a record in the toolbox."""
    return f"{FOLDER}/{slug(kind)}/{slug(key)}{_SUFFIX}"


def save(place: Place, kind: str, key: str, record: dict[str, Any]) -> None:
    """Writes a record. Raises BadInput for what JSON cannot hold."""
    try:
        whole = {"kind": kind, "key": key, "hash": _hash(record), "record": record}
        text = json.dumps(whole, indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise BadInput(f"record '{key}' ({kind}): {error}") from error
    place.write(file_of(kind, key), text.encode())


def load(place: Place, kind: str, key: str) -> dict[str, Any] | None:
    """The record of that kind and key; None when there is none. Raises BadInput when its file is damaged or was edited."""
    file = file_of(kind, key)
    folder, _, name = file.rpartition("/")
    if name not in place.names(folder):
        return None
    whole = _read(place, file)
    record: dict[str, Any] = whole["record"]
    return record if (whole["kind"], whole["key"]) == (kind, key) else None


def faults(place: Place) -> dict[str, str]:
    """What is wrong with each record's file, by file; "" where nothing is."""
    found = {}
    for folder in place.folders(FOLDER):
        for name in sorted(place.names(f"{FOLDER}/{folder}")):
            file = f"{FOLDER}/{folder}/{name}"
            if name.endswith(_SUFFIX):
                try:
                    _read(place, file)
                    found[file] = ""
                except BadInput as error:
                    found[file] = str(error)
    return found


def _read(place: Place, file: str) -> dict[str, Any]:
    try:
        whole = json_of(place.read(file))
    except (BadInput, ValueError, RecursionError) as error:
        raise BadInput(f"record file {place.where(file)}: {error}") from error
    if (
        not isinstance(whole, dict)
        or not isinstance(whole.get("record"), dict)
        or not {"kind", "key", "hash"} <= whole.keys()
    ):
        raise BadInput(f"record file {place.where(file)}: it must hold kind, key, hash and record")
    if whole["hash"] != _hash(whole["record"]):
        raise BadInput(f"record file {place.where(file)}: it does not hold what was written: it was changed")
    return whole


def _hash(record: dict[str, Any]) -> str:
    """The hash of a record, however its file is laid out."""
    return hash_of(json.dumps(record, sort_keys=True).encode())
