"""Cell files: cells for the sequencer, without physics; orders of their parts from words; and the text of such a file."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial
from math import inf
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import PrivateAttr, ValidationError

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import Cell, check_parts
from lab.sequencing.cell.chance import Chance
from lab.sequencing.cell.routes import positions_of
from lab.sequencing.cell.stations import ROBOT, UNLIMITED, Arrivals, Begins
from lab.tasks.cell_faults import FileFault, file_faults, layout_faults, loc_of, missing_times, travel_faults
from lab.tasks.cell_fields import CellFields, CellStage, Times
from lab.tasks.task_faults import fields_at
from lab.tasks.toml_text import TomlText, explain, finding

TOAST_CASES = {"I": "toast-case-1", "II": "toast-case-2", "III": "toast-case-3"}


class CellFile(CellFields):
    """A whole cell file: the cell, the ordered parts, and the settings of the search for a sequence."""

    _toml: TomlText | None = PrivateAttr(default=None)

    @classmethod
    def checked(cls, toml: TomlText) -> Self:
        """The cell file of a text; raises BadInput, with file and line, when its own order is invalid."""
        try:
            cell_file = cls.model_validate(toml.raw)
        except ValidationError as error:
            raise toml.refusal(finding(error)["loc"], explain(error, partial(fields_at, cls), raw=toml.raw)) from None
        cell_file._toml = toml
        cell_file.cell()
        return cell_file

    def cell(self, order: Sequence[str] | int | None = None) -> Cell:
        """The cell for an order: a product for each part, or a number of parts of the only product; None: the file's own.

        Raises BadInput for an invalid cell, with file and line when it was read from a file.
        """
        built = self._cell_or_fault(order)
        if isinstance(built, Cell):
            return built
        raise BadInput(built.message) if self._toml is None else self._toml.refusal(built.loc, built.message)

    def chance(self) -> Chance:
        """The distributions from which --stochastic draws."""
        return self.stochastic.built()

    def work_s(self, product: str) -> float:
        """The least time of a single part of a product: moves, processing and service on its quickest route [s].

        The file must be free of faults. Raises BadInput for an unknown product.
        """
        if product not in self.names:
            raise unknown("product", product, self.names, f"cell '{self.name}'")
        return min(self._route_s(route) for route in self.products[self.names.index(product)].routes)

    def ordered(self, order: Sequence[str] | int | None = None) -> tuple[str, ...]:
        """The product of each part of an order as `cell` takes it; raises BadInput for an order that does not fit the cell."""
        if order is None:
            return self.order if self.order is not None else (self.names[0],) * (self.parts or 0)
        count = order if isinstance(order, int) else len(order)
        if isinstance(order, int) and len(self.products) > 1:
            wanted = f"give their order with --case, such as {_example(self.names)}"
            raise BadInput(f"{order} parts (--toasts): cell '{self.name}' makes several products: {wanted}")
        check_parts(count)
        parts = (self.names[0],) * count if isinstance(order, int) else tuple(order)
        for name in parts:
            if name not in self.names:
                raise unknown("product", name, self.names, f"order for cell '{self.name}'")
        return parts

    def with_robots(self, count: int) -> Self:
        """The file with `count` robots like its first one; raises BadInput for a cell without a robot, and for missing times."""
        first = self.robot or next(iter(self.robots or ()), None)
        if first is None:
            raise BadInput(f"--robots {count}: cell '{self.name}' has none: its parts go on by themselves")
        named = tuple(first.model_copy(update={"name": f"{ROBOT} {n}"}) for n in range(1, count + 1))
        several = {"robot": None, "robots": named}
        alone = {"robot": first, "robots": None, "track": None, "travel": self.times}  # a single robot needs no track
        changed = self.model_copy(update=several if count > 1 else alone)
        changed.cell()
        return changed

    def _cell_or_fault(self, order: Sequence[str] | int | None) -> Cell | FileFault:
        """The cell, or the first fault; each kind of fault is searched only when all kinds before it are absent."""
        for faults in (file_faults, layout_faults, travel_faults):
            if (fault := next(faults(self), None)) is not None:
                return fault
        parts = self.ordered(order)
        if (fault := next(missing_times(self, len(parts)), None)) is not None:
            return fault
        try:
            return self._built(parts)
        except BadInput as error:
            return FileFault(loc_of(self, str(error)), str(error))

    def _built(self, parts: tuple[str, ...]) -> Cell:
        arrivals, due_s = self.arrivals, self.due_s
        came_s = [0.0 if arrivals is None else number * arrivals.interval_s for number in range(1, len(parts) + 1)]
        if self.due_factor is not None:
            due_s = tuple(came + self.due_factor * self.work_s(name) for came, name in zip(came_s, parts, strict=True))
        return Cell(
            self.built_stations,
            self.built_products,
            parts,
            self._table(self.times),
            self._table(self.times, self.loaded),
            self.built_robots,
            None if arrivals is None else Arrivals((arrivals.interval_s,) * len(parts), arrivals.after),
            self.buffers,
            due_s,
            None if self.release_s is None else self._begins(parts, self.release_s),
            track=() if self.track is None else self.track.built(),
        )

    def _begins(self, parts: tuple[str, ...], release_s: tuple[float, ...]) -> tuple[Begins, ...]:
        """The state of all parts at time 0: at their first stations, each ready at its release time."""
        if len(release_s) != len(parts):
            raise BadInput(f"release_s has {len(release_s)} times; {len(parts)} parts need {len(parts)}")
        places = positions_of(self.built_stations, self.built_products, self.buffers, self.built_robots)
        first = {place.product: number for number, place in reversed([*enumerate(places)])}
        return tuple(
            Begins(first[self.names.index(name)], seconds) for name, seconds in zip(parts, release_s, strict=True)
        )

    def _table(self, *tables: Times) -> NDArray[np.float64]:
        """The seconds (n, n) from station row to station column, NaN where there is no time; later tables override earlier."""
        names = self.station_names
        seconds = np.full((len(names), len(names)), np.nan)
        for table in tables:
            for origin, row in table.items():
                for target, time_s in row.items():
                    seconds[names.index(origin), names.index(target)] = time_s
        return seconds

    def _route_s(self, route: tuple[CellStage, ...]) -> float:
        """The least time of one part along a route without waits, moves of its pallet included [s]."""
        own_s = {station.name: station.processing_s or 0.0 for station in self.stations}

        def carried_s(origin: str, target: str) -> float:
            return self.loaded.get(origin, {}).get(target, self.travel.get(origin, {}).get(target, 0.0))

        at_s = {route[0].station: 0.0}  # by station of the stage, the least until a part can leave it
        for number, stage in enumerate(route):
            before_s, at_s = at_s, dict[str, float]()
            for way in (stage, *stage.alternatives):
                work_s = way.service_s + (own_s[way.station] if way.processing_s is None else way.processing_s)
                if way.pallet:
                    work_s += carried_s(route[number - 1].station, route[number + 1].station)
                comes_s = min(s + carried_s(origin, way.station) for origin, s in before_s.items())
                at_s[way.station] = min(at_s.get(way.station, inf), comes_s + work_s)
        return min(at_s.values())


def toast_case(word: str) -> str:
    """The name of the cell file of a case of the thesis's toast cell: I, II or III, or 1, 2 or 3; raises BadInput for others."""
    for number, (case, name) in enumerate(TOAST_CASES.items(), 1):
        if word.strip().upper() in (case, str(number)):
            return name
    raise unknown("case", word, TOAST_CASES, "--case")


def order_from_word(cellfile: CellFile, word: str) -> tuple[str, ...]:
    """The order that a word stands for: products by initials, "RSR", or names, "rook,sign,rook"; raises BadInput for others."""
    if "," in word or word in cellfile.names:
        return cellfile.ordered([name.strip() for name in word.split(",")])
    meant: dict[str, list[str]] = {}
    for name in cellfile.names:
        meant.setdefault(name[0].upper(), []).append(name)
    known = ", ".join(f"{letter} ({' or '.join(names)})" for letter, names in meant.items())
    order: list[str] = []
    for number, letter in enumerate(word.strip(), 1):
        initials = meant.get(letter.upper(), [])
        if len(initials) != 1:
            wrong = f"letter {number}, '{letter}', means {'no' if not initials else 'more than one'} product"
            wanted = f"known: {known}; or names with commas between them"
            raise BadInput(f"order '{word[:80]}' (--case) for cell '{cellfile.name}': {wrong}: {wanted}")
        order += initials
    return cellfile.ordered(order)


def _example(names: Sequence[str]) -> str:
    """An example of an order, in the shortest form that `order_from_word` takes."""
    letters = [name[0].upper() for name in names]
    return "".join([*letters, letters[0]]) if len(set(letters)) == len(letters) else ",".join([*names, names[0]])


# ---- The text of a cell file ------------------------------------------------------------------------------------------


_BARE = re.compile(r"[A-Za-z0-9_-]+")
_TABLES = ("robot", "products", "robots", "track", "travel", "loaded", "arrivals", "stochastic", "sequencing")


def toml_of(file: CellFile) -> str:
    """The text of a cell file, without the fields that have their default values."""
    raw = {"name": file.name, "kind": file.kind} | file.model_dump(exclude_defaults=True)
    lines = [f"{_key(key)} = {_value(value)}" for key, value in raw.items() if key not in (*_TABLES, "stations")]
    if raw.get("robots") == ():
        lines.append("robots = []")
    lines += ["", "stations = [", *(f"  {_value(_station(station))}," for station in raw["stations"]), "]"]
    for key in _TABLES:
        value = raw.get(key)
        for item in value if isinstance(value, tuple) else ():
            lines += ["", f"[[{key}]]", *_pairs(item)]
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *_pairs(value)]
    return "\n".join(lines) + "\n"


def _station(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {key: "unlimited" if key == "capacity" and value >= UNLIMITED else value for key, value in fields.items()}


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [
        f"routes = [{', '.join(_value(tuple(_stage(stage) for stage in route)) for route in value)}]"
        if key == "routes"
        else f"{_key(key)} = {_value(value)}"
        for key, value in table.items()
    ]


def _stage(stage: Mapping[str, Any]) -> Any:
    """A stage as its station's name where it has no other field, else as a table."""
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
