"""The place in a task file that an error message is about, and the fields that each table may have."""

import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_args

from pydantic import BaseModel

from lab.errors import BadInput
from lab.tasks.toml_text import Loc, TomlText

# the file's table by the word that messages use for its members
MEMBERS = {"part": "parts", "product": "parts", "station": "stations", "machine": "stations", "obstacle": "obstacles"}
_THING = re.compile(rf"\b({'|'.join(MEMBERS)})s? '([^']*)'")
_DOTTED = re.compile(r"\b(robot|workspace|camera|processes|subtasks|sequencing)((?:\.[\w-]+)+)")
_STAGE = re.compile(r"(?:stage (\d+) of )?(?:the route|route (\d+))\b(?: of '([^']*)')?(?= has|:| \()")
_NUMBERED = re.compile(r"\b(fault|after) (\d+)\b")
_QUOTED = re.compile(r"'([^']*)'")
_SIZE = ("size_m", "file")  # the fields that determine a width or a height
_WORD = re.compile(r"[a-z_]+")


def refusal(toml: TomlText, message: str) -> BadInput:
    """The error with the file, and the line of what the message is about."""
    return toml.refusal(loc_of(toml.raw, message), message)


def loc_of(raw: dict[str, Any], message: str) -> Loc:
    """The path to what a message is about: the value that it quotes, the field that it names, or the table.

    The path is () for a message that names nothing in the file.
    """
    if (stage := _stage(raw, message)) is not None:
        return stage
    if (numbered := _NUMBERED.search(message)) is not None:
        loc: Loc = ("faults" if numbered[1] == "fault" else "after", int(numbered[2]) - 1)
        return loc + within(raw, loc, message)
    things = [(match.start(), loc) for match in _THING.finditer(message) if (loc := _member(raw, *match.groups()))]
    dotted = _DOTTED.search(message)
    if dotted is not None and (not things or dotted.start() < things[0][0]):
        return (dotted[1], *dotted[2][1:].split("."))
    if things:
        return things[0][1] + within(raw, things[0][1], message)
    return _named(raw, message)


def within(raw: dict[str, Any], loc: Loc, message: str) -> Loc:
    """The path from the table at `loc` on: to the value that a message quotes, or to the field that it names."""
    table: Any = raw
    for part in loc:
        table = table[part]
    if not isinstance(table, dict):
        return ()
    quoted = {word for word in _QUOTED.findall(message) if word != table.get("name")}
    for inner, value in _leaves(table):
        if isinstance(value, str) and value in quoted and inner != ("name",):
            return inner
    words = _WORD.findall(_QUOTED.sub("", message))
    said = [field for word in words for field in (word, f"{word}s", *(_SIZE if word in ("wide", "high") else ()))]
    field = next((word for word in said if word in table and word != "name"), None)
    if field is None:
        return ("name",) if "name" in table else ()
    inside = table[field]
    below = next((word for word in words if isinstance(inside, dict) and word in inside), None)
    return (field,) if below is None else (field, below)


def _stage(raw: dict[str, Any], message: str) -> Loc | None:
    """The path to the stage in a sequencer's message, which names the part when an order has several kinds."""
    match = _STAGE.search(message)
    if match is None:
        return None
    parts = [part if isinstance(part, dict) else {} for part in raw["parts"]]
    kind = next(n for n, part in enumerate(parts) if part.get("routes") and match[3] in (None, part.get("name")))
    return ("parts", kind, "routes", int(match[2] or 1) - 1, *((int(match[1]) - 1,) if match[1] else ()))


def _member(raw: dict[str, Any], word: str, name: str) -> Loc:
    """The path to the last part, station or obstacle with a name: of two with the same name, that one is at fault."""
    table = MEMBERS[word]
    members = raw.get(table)
    for number, member in reversed(list(enumerate(members if isinstance(members, list) else ()))):
        if isinstance(member, dict) and member.get("name") == name:
            return (table, number)
    return ()


def _named(raw: dict[str, Any], message: str) -> Loc:
    """The path to the station or obstacle whose name comes first in a message, or to the file that it names."""
    subtasks = raw.get("subtasks")
    if isinstance(subtasks, dict) and "subtasks" in message:
        return next((("subtasks", name) for name in _QUOTED.findall(message) if name in subtasks), ("subtasks",))
    places: list[tuple[int, int, Loc]] = []
    for loc, value in _leaves(raw):
        names = loc[-1] == "name" and loc[0] in ("stations", "obstacles")
        if not isinstance(value, str) or not (names or re.search(r"\w\.(urdf|obj|stl)$", value, re.IGNORECASE)):
            continue
        said = re.search(rf"(?<![\w-]){re.escape(value)}(?![\w-])", message)
        if said is not None:
            places.append((said.start(), -len(value), loc))
    return min(places)[2] if places else ()


def _leaves(value: Any, loc: Loc = ()) -> Iterator[tuple[Loc, Any]]:
    """Every plain value within a value, with the path to it."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if pairs is None:
        yield loc, value
        return
    for key, inner in pairs:
        yield from _leaves(inner, (*loc, key))


def fields_at(model: type[BaseModel], loc: Loc) -> list[str]:
    """The fields of a record, or of the record at path `loc` within it."""
    records: list[type] = [model]
    for part in loc:
        inner = [_annotations(record)[part] for record in records if part in _annotations(record)]
        records = [record for annotation in inner for record in _records(annotation)] or records
    return sorted({str(name) for record in records for name in _annotations(record)})


def _annotations(record: type) -> dict[str | int, Any]:
    if issubclass(record, BaseModel):
        return {name: field.annotation for name, field in record.model_fields.items()}
    return {field.name: field.type for field in fields(record)} if is_dataclass(record) else {}


def _records(annotation: Any) -> list[type]:
    """The records within a type annotation."""
    if isinstance(annotation, type) and (is_dataclass(annotation) or issubclass(annotation, BaseModel)):
        return [annotation]
    return [record for inner in get_args(annotation) for record in _records(inner)]
