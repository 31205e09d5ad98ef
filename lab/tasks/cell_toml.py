"""A cell file as TOML text: what reading it gives again is the same cell."""

import json
import re
from collections.abc import Mapping
from typing import Any

from lab.sequencing.cell.stations import UNLIMITED
from lab.tasks.cell_file import CellFile

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_TABLES = ("robot", "products", "robots", "track", "travel", "loaded", "arrivals", "stochastic", "sequencing")


def toml_of(file: CellFile) -> str:
    """The text of a cell file; fields that are as they are without being said are left out."""
    raw = {"name": file.name, "kind": file.kind} | file.model_dump(exclude_defaults=True)
    lines = [f"{_key(key)} = {_value(value)}" for key, value in raw.items() if key not in (*_TABLES, "stations")]
    if raw.get("robots") == ():
        lines.append("robots = []")
    lines += ["", "stations = [", *(f"  {_value(_station(one))}," for one in raw["stations"]), "]"]
    for key in _TABLES:
        value = raw.get(key)
        for one in value if isinstance(value, tuple) else ():
            lines += ["", f"[[{key}]]", *_pairs(one)]
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *_pairs(value)]
    return "\n".join(lines) + "\n"


def _station(one: Mapping[str, Any]) -> dict[str, Any]:
    return {key: "unlimited" if key == "capacity" and value >= UNLIMITED else value for key, value in one.items()}


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [
        f"routes = [{', '.join(_value(tuple(_stage(stage) for stage in route)) for route in value)}]"
        if key == "routes"
        else f"{_key(key)} = {_value(value)}"
        for key, value in table.items()
    ]


def _stage(stage: Mapping[str, Any]) -> Any:
    """A stage that is a station's name and nothing else, as its name."""
    return stage["station"] if len(stage) == 1 else stage


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    """A value in one line of TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(inner) for inner in value)}]"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() else repr(value)
    return json.dumps(value)
