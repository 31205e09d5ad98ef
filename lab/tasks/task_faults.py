"""Where in a task file the thing stands that a fault is about, and which fields each of its tables may have."""

import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_args

from pydantic import BaseModel

from lab.errors import BadInput
from lab.tasks.first_form import own_loc, renewed
from lab.tasks.toml_text import Loc, TomlText

MEMBERS = {"part": "parts", "station": "stations", "machine": "stations", "obstacle": "obstacles"}  # table by word
_THING = re.compile(rf"\b({'|'.join(MEMBERS)})s? '([^']*)'")
_DOTTED = re.compile(r"\b(robot|workspace|camera|processes|subtasks|sequencing)((?:\.[\w-]+)+)")
_QUOTED = re.compile(r"'([^']*)'")
_WORD = re.compile(r"[a-z_]+")


def refusal(toml: TomlText, message: str) -> BadInput:
    """The error that says in which file, and on which line of it, the thing stands that a message is about."""
    return toml.refusal(own_loc(toml.raw, loc_of(renewed(toml.raw), message)), message)


def loc_of(raw: dict[str, Any], message: str) -> Loc:
    """The way to what a message about a task is about: the value that it quotes, the field that it names, or the table.

    () for a message that names nothing of the file.
    """
    things = [(found.start(), loc) for found in _THING.finditer(message) if (loc := _member(raw, *found.groups()))]
    dotted = _DOTTED.search(message)
    if dotted is not None and (not things or dotted.start() < things[0][0]):
        return (dotted[1], *dotted[2][1:].split("."))
    if not things:
        return _named(raw, message)
    loc = things[0][1]
    table = _at(raw, loc)
    own = table.get("name") if isinstance(table, dict) else None
    quoted = [word for word in _QUOTED.findall(message) if word != own]
    for inner, value in _leaves(table):
        if isinstance(value, str) and value in quoted and inner != ("name",):
            return (*loc, *inner)
    words = _WORD.findall(_QUOTED.sub("", message))
    field = next((word for word in words if isinstance(table, dict) and word in table), None)
    return loc if field is None else (*loc, *_deeper(table, field, words))


def _deeper(table: dict[str, Any], field: str, words: list[str]) -> Loc:
    """A field, and of a table the field within it that is also named."""
    inner = table[field]
    below = next((word for word in words if isinstance(inner, dict) and word in inner), None)
    return (field,) if below is None else (field, below)


def _member(raw: dict[str, Any], word: str, name: str) -> Loc:
    """The last part, station or obstacle of a name: of two of one name that one is too many."""
    table = MEMBERS[word]
    members = raw.get(table)
    for number, member in reversed(list(enumerate(members if isinstance(members, list) else ()))):
        if isinstance(member, dict) and member.get("name") == name:
            return (table, number)
    return ()


def _named(raw: dict[str, Any], message: str) -> Loc:
    """The station or obstacle whose name is the first that a message says, or the file that it names."""
    found: list[tuple[int, int, Loc]] = []
    for loc, value in _leaves(raw):
        names = loc[-1] == "name" and loc[0] in ("stations", "obstacles")
        if not isinstance(value, str) or not (names or re.search(r"\w\.(urdf|obj|stl)$", value, re.IGNORECASE)):
            continue
        said = re.search(rf"(?<![\w-]){re.escape(value)}(?![\w-])", message)
        if said is not None:
            found.append((said.start(), -len(value), loc))
    return min(found)[2] if found else ()


def _at(raw: Any, loc: Loc) -> Any:
    for part in loc:
        raw = raw[part]
    return raw


def _leaves(value: Any, loc: Loc = ()) -> Iterator[tuple[Loc, Any]]:
    """Every plain value within a value, and the way to it."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if pairs is None:
        yield loc, value
        return
    for key, inner in pairs:
        yield from _leaves(inner, (*loc, key))


def fields_at(model: type[BaseModel], loc: Loc) -> list[str]:
    """The fields that a record takes, or the one to which `loc` leads from it."""
    records: list[type] = [model]
    for part in loc:
        inner = [_annotations(record)[part] for record in records if part in _annotations(record)]
        records = [found for one in inner for found in _records(one)] or records
    return sorted({str(name) for record in records for name in _annotations(record)})


def _annotations(record: type) -> dict[str | int, Any]:
    if issubclass(record, BaseModel):
        return {name: field.annotation for name, field in record.model_fields.items()}
    return {field.name: field.type for field in fields(record)} if is_dataclass(record) else {}


def _records(annotation: Any) -> list[type]:
    """The records that a type is made of."""
    if isinstance(annotation, type) and (is_dataclass(annotation) or issubclass(annotation, BaseModel)):
        return [annotation]
    return [found for inner in get_args(annotation) for found in _records(inner)]
