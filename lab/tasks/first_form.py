"""Task files as they were before there were kinds of parts: slices on one route, a toaster, a butter applier."""

from typing import Any

from lab.tasks.toml_text import Loc

TOASTER = {"body": "toaster.urdf", "floor_m": 0.015, "approach": "camera", "finish": [0.70, 0.42, 0.16]}
TOASTER_MARKER = [0.0, 0.03825, 0.1]
APPLIER = {"body": "applier.urdf", "floor_m": 0.02}
COUNT = 3
SLICE = {"name": "slice", "shape": "box", "size_m": [0.12, 0.015, 0.12], "look": "slice.urdf"}
HEAD = {"head_speed_m_s": ("speed_m_s", 0.02), "dwell_s": ("dwell_s", 3.0)}


def renewed(raw: dict[str, Any]) -> dict[str, Any]:
    """A file's values with [slices], [[route]] and [insert] as parts, stations and processes; others as they are."""
    old = ("slices", "route", "insert")
    if "parts" in raw or not any(name in raw for name in old):
        return raw
    kept = {name: value for name, value in raw.items() if name not in old}
    slices, grid = raw.get("slices", {}), raw.get("insert", {})
    stations = raw.get("stations")
    own = {"count": _count(stations), "routes": [raw.get("route", [])]}
    kept["parts"] = [SLICE | (slices if isinstance(slices, dict) else {}) | own]
    if isinstance(stations, list):
        kept["stations"] = [_station(station, grid) if isinstance(station, dict) else station for station in stations]
        heads = {s["process"]: s for s in stations if isinstance(s, dict) and isinstance(s.get("process"), str)}
        kept["processes"] = {
            name: {"grid": [3, 3]} | {new: station.get(was, value) for was, (new, value) in HEAD.items()}
            for name, station in heads.items()
        }
    subtasks = raw.get("subtasks")
    if isinstance(subtasks, dict) and "butter" in subtasks:
        kept["subtasks"] = {("cover" if name == "butter" else name): table for name, table in subtasks.items()}
    return kept


def _count(stations: Any) -> int:
    """Three slices, or as many as the plates hold."""
    plates = (
        [s for s in stations if isinstance(s, dict) and s.get("kind") == "storage"]
        if isinstance(stations, list)
        else []
    )
    room = [s["capacity"] for s in plates if isinstance(s.get("capacity"), int) and s["capacity"] > 0]
    return int(min([COUNT, *room]))


def own_loc(raw: dict[str, Any], loc: Loc) -> Loc:
    """The way to a value in the file itself, given the way in what `renewed` made of it."""
    if renewed(raw) is raw or not loc:
        return loc
    match loc:
        case ("parts", 0, "routes", 0, *rest):
            return ("route", *rest)
        case ("parts", *rest):
            return ("slices", *rest[1:]) if "slices" in raw else ("route",)
        case ("stations", _, "grid", *rest):
            return ("insert", *rest)
        case ("processes", name, *rest):
            number = next(n for n, s in enumerate(raw["stations"]) if isinstance(s, dict) and s.get("process") == name)
            return ("stations", number, *(was for was, (new, _) in HEAD.items() if rest[:1] == [new]))
        case ("subtasks", "cover", *rest) if "butter" in raw["subtasks"]:
            return ("subtasks", "butter", *rest)
    return loc


def _station(station: dict[str, Any], grid: Any) -> dict[str, Any]:
    own = {name: value for name, value in station.items() if name not in HEAD}
    if station.get("kind") != "machine":
        return own
    if "process" in station:
        return APPLIER | own
    return TOASTER | {"grid": grid | {"marker_m": TOASTER_MARKER} if isinstance(grid, dict) else grid} | own
