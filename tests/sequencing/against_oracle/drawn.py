"""Small cells of every kind that a cell file can say, drawn from a seed, as the values of such a file."""

import json
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from itertools import pairwise
from typing import Any

import numpy as np

Raw = dict[str, Any]
OBJECTIVES = ("makespan", "mean-tardiness", "tardy-parts", "robot-idle", "machine-idle")


def drawn(seed: int, number: int) -> Raw:
    """The values of a cell file: two to four parts, one to three machines, none to two robots."""
    rng = np.random.default_rng([33, seed, number])

    def chance(share: float) -> bool:
        return bool(rng.random() < share)

    def whole(low: int, high: int) -> int:
        return int(rng.integers(low, high + 1))

    robots = int(rng.choice([0, 1, 1, 1, 2, 2, 2]))
    machines = whole(1, 3)
    served = robots == 0 or chance(0.25)
    parts = whole(2, 4 if machines < 3 else 3)
    stations: list[Raw] = [{"name": "in", "kind": "storage", "capacity": 9}]
    for number_ in range(1, machines + 1):
        one: Raw = {"name": f"m{number_}", "kind": "machine", "capacity": 1, "processing_s": whole(1, 30)}
        if served and (robots == 0 or chance(0.7)):
            one["servers"] = 2 if chance(0.2) else 1
            one["capacity"] = whole(one["servers"], 3) if chance(0.6) else "unlimited"
        elif chance(0.2):
            one["capacity"] = 2
        stations.append(one)
    stations.append({"name": "out", "kind": "storage", "capacity": 9})
    raw: Raw = {"kind": "cell", "name": f"drawn {seed} {number}", "stations": stations}
    if chance(0.3) and robots:
        raw["buffers"] = "free" if chance(0.4) else "busy"
        for n in range(1, machines + 1):
            if chance(0.5):
                stations.insert(-1, {"name": f"b{n}", "kind": "buffer", "capacity": whole(1, 2)})
    shelf = bool(robots) and chance(0.12)
    if shelf:
        stations.insert(-1, {"name": "shelf", "kind": "storage" if chance(0.5) else "buffer", "capacity": whole(1, 2)})
    pallet = bool(robots) and chance(0.1)
    if pallet:
        stations.insert(-1, {"name": "dock", "kind": "buffer", "capacity": whole(1, 2)})
        stations.insert(-1, {"name": "rest", "kind": "buffer", "capacity": whole(1, 2)})
    products = ["p", "q"] if chance(0.4) else ["p"]
    known = {one["name"]: one for one in stations}
    raw["products"] = [
        {"name": name, "routes": _routes(known, machines, shelf, pallet, chance, whole, bool(robots))}
        for name in products
    ]
    if max(_many(route) for one in raw["products"] for route in one["routes"]) > 3:
        parts = min(parts, 3)
    raw["order"] = [products[whole(0, len(products) - 1)] for _ in range(parts)]
    used = {name for pair in _legs(raw) for name in pair}
    raw["stations"] = stations = [one for one in stations if one["name"] in used]
    if chance(0.45):
        _windows(raw, chance, whole)
    if chance(0.5):
        for one in stations:
            if "servers" in one:
                one["setup_s"] = {a: {b: whole(0, 15) for b in products if a != b or chance(0.2)} for a in products}
    _ways(raw, robots, chance, whole)
    come = rng.random()
    if come < 0.15:
        raw["arrivals"] = {"interval_s": whole(3, 40), "after": "clock" if chance(0.6) else "pick"}
    elif come < 0.35:
        raw["release_s"] = [whole(0, 60) for _ in range(parts)]
    objective = "makespan"
    if chance(0.45):
        objective = str(rng.choice(OBJECTIVES if robots else [o for o in OBJECTIVES if o != "robot-idle"]))
    if objective in ("mean-tardiness", "tardy-parts"):
        last = raw.get("arrivals", {}).get("interval_s", 0) * parts
        raw["due_s"] = [last + whole(20, 130) for _ in range(parts)]
    raw["sequencing"] = {"objective": objective}
    return raw


def _routes(
    known: Mapping[str, Raw], machines: int, shelf: bool, pallet: bool, chance: Callable[[float], bool],
    whole: Callable[[int, int], int], robots: bool,
) -> list[list[Any]]:  # fmt: skip
    """One route through the machines, or two where one machine may stand for another."""
    names = [f"m{n}" for n in range(1, machines + 1)]
    through = names[: whole(1, machines)] if chance(0.3) else list(names)
    if chance(0.3):
        through.reverse()
    again = through[0]
    if len(through) == 2 and "servers" in known[again] and chance(0.4):
        through.append(again)
    ends_there = not robots or ("servers" in known[through[-1]] and chance(0.4))
    found = list[list[Any]]()
    instead: dict[str, str] = {}
    for variant in range(2 if len(names) > 1 and len(through) < 3 and chance(0.4) else 1):
        if variant:
            others = [name for name in names if name not in through]
            instead = {through[0]: others[0]} if others else {}
            if not others:
                through = through[::-1]
                ends_there = not robots or (ends_there and "servers" in known[through[-1]])
        route: list[Any] = ["in"]
        for n, name in enumerate(through):
            stage: Raw = {"station": instead.get(name, name)}
            if chance(0.3):
                stage["processing_s"] = whole(1, 30)
            buffer = f"b{stage['station'][1:]}"
            if buffer in known and not any(isinstance(one, dict) and one.get("buffer") == buffer for one in route):
                stage["buffer"] = buffer
            if robots and chance(0.15):
                stage["service_s"] = whole(1, 10)
            if pallet and n == 0 and "servers" not in known[stage["station"]]:
                stage.pop("buffer", None)
                stage["pallet"] = True
                route += ["dock", stage, "rest"]
                continue
            route.append(stage)
            if shelf and n == 0 and len(through) > 1:
                route.append("shelf")
        ends = ends_there and "servers" in known[instead.get(through[-1], through[-1])]
        found.append(route if ends else [*route, "out"])
    return found


def _many(route: list[Any]) -> int:
    """How many ways a route is: each buffer is used or not."""
    return 1 << sum(isinstance(one, dict) and "buffer" in one for one in route)


def _legs(raw: Raw) -> Iterator[tuple[str, str]]:
    """Where something is carried: from station to station, through buffers, and empty pallets."""
    for product in raw["products"]:
        for route in product["routes"]:
            stages = [{"station": one} if isinstance(one, str) else one for one in route]
            for n, (one, then) in enumerate(pairwise(stages), 1):
                yield one["station"], then["station"]
                if "buffer" in then:
                    yield one["station"], then["buffer"]
                    yield then["buffer"], then["station"]
                if then.get("pallet"):
                    yield one["station"], stages[n + 1]["station"]


def _windows(raw: Raw, chance: Callable[[float], bool], whole: Callable[[int, int], int]) -> None:
    for one in raw["stations"]:
        if one["kind"] == "machine" and chance(0.6):
            service_s = [stage.get("service_s", 0) for stage in _stages(raw) if stage["station"] == one["name"]]
            one["at_most_s"] = max(service_s, default=0) + whole(0, 12)
    if chance(0.3):
        for stage in _stages(raw):
            if stage["station"].startswith("m"):
                stage["at_most_s"] = whole(stage.get("service_s", 0), 25)


def _ways(raw: Raw, robots: int, chance: Callable[[float], bool], whole: Callable[[int, int], int]) -> None:
    """Robots, and how long they drive."""
    names = [one["name"] for one in raw["stations"]]
    raw["robots"] = [{"name": f"r{n + 1}", "start": "in" if chance(0.6) else names[-1]} for n in range(robots)]
    if robots == 1:
        raw["robot"] = raw.pop("robots")[0] | {"name": "robot"}
    if robots == 2 and chance(0.3):
        raw["track"] = {"stretches": [[a, b, whole(1, 8)] for a, b in pairwise(names)]}
    elif robots:
        at = {name: (whole(0, 10), whole(0, 10)) for name in names}
        far = chance(0.3)
        raw["travel"] = {
            a: {
                b: whole(1, 15) if far else 1 + abs(at[a][0] - at[b][0]) + abs(at[a][1] - at[b][1])
                for b in names
                if a != b
            }
            for a in names
        }
        if chance(0.2):
            raw["loaded"] = {a: {b: s + whole(0, 4) for b, s in row.items()} for a, row in raw["travel"].items()}
        if chance(0.15):
            for one in raw.get("robots", [raw.get("robot")]):
                if one is not None:
                    one["speed"] = 2.0 if chance(0.5) else 0.5
    if robots == 2 and chance(0.3):
        inner = [name for name in names if name not in ("in", "out")]
        shared = inner[whole(0, len(inner) - 1)]
        cut = names.index(shared)
        raw["robots"][0]["serves"] = names[: cut + 1]
        if chance(0.7):
            raw["robots"][1]["serves"] = names[cut:]
        able = [one.get("serves", names) for one in raw["robots"]]
        if not all(any(a in one and b in one for one in able) for a, b in _legs(raw)):
            raw["robots"] = [{key: value for key, value in one.items() if key != "serves"} for one in raw["robots"]]


# ---- what a cell has, and the same without it


def features(raw: Raw) -> list[str]:
    """What a cell has beside one robot and machines in a row, in words."""
    return [name for name, (has, _) in FEATURES.items() if has(raw)]


def _stages(raw: Raw) -> Iterator[Raw]:
    for product in raw["products"]:
        for route in product["routes"]:
            for stage in route:
                if isinstance(stage, dict):
                    yield stage


def _twice(route: list[Any]) -> bool:
    names = [one["station"] for one in route if isinstance(one, dict)]
    return len(set(names)) < len(names)


def _count(raw: Raw) -> int:
    return len(raw.get("robots", ())) if "robots" in raw else 1


def _drop(key: str) -> Callable[[Raw], None]:
    return lambda raw: raw.pop(key, None) and None


def _no_windows(raw: Raw) -> None:
    for one in (*raw["stations"], *_stages(raw)):
        one.pop("at_most_s", None)


def _without(key: str) -> Callable[[Raw], None]:
    def strip(raw: Raw) -> None:
        for one in (*raw["stations"], *_stages(raw)):
            one.pop(key, None)

    return strip


def _no_servers(raw: Raw) -> None:
    for one in raw["stations"]:
        if "servers" in one:
            one.pop("servers")
            one.pop("setup_s", None)
            one["capacity"] = 1 if one["capacity"] == "unlimited" else one["capacity"]


def _one_robot(raw: Raw) -> None:
    first = raw.pop("robots")[0]
    raw["robot"] = {"name": "robot", "start": first["start"]}
    if "track" in raw:
        _no_track(raw)


def _no_track(raw: Raw) -> None:
    names = [one["name"] for one in raw["stations"]]
    seconds = [s for *_, s in raw.pop("track")["stretches"]]
    raw["travel"] = {
        a: {b: sum(seconds[min(i, j) : max(i, j)]) for j, b in enumerate(names) if i != j} for i, a in enumerate(names)
    }


def _narrow(raw: Raw) -> None:
    for one in raw["stations"]:
        if one["kind"] in ("machine", "buffer") and one["capacity"] not in (1, "unlimited"):
            one["capacity"] = one.get("servers", 1)


def _one_way(raw: Raw) -> None:
    for product in raw["products"]:
        product["routes"] = product["routes"][:1]


def _one_product(raw: Raw) -> None:
    raw["order"] = [raw["order"][0]] * len(raw["order"])
    raw["products"] = [one for one in raw["products"] if one["name"] == raw["order"][0]]
    for one in raw["stations"]:
        if "setup_s" in one:
            own = raw["order"][0]
            one["setup_s"] = {
                a: {b: s for b, s in row.items() if b == own} for a, row in one["setup_s"].items() if a == own
            }


def _serves_all(raw: Raw) -> None:
    for one in raw["robots"]:
        one.pop("serves", None)


def _one_speed(raw: Raw) -> None:
    for one in raw.get("robots", [raw.get("robot")]):
        one.pop("speed", None)


def _for_makespan(raw: Raw) -> None:
    raw["sequencing"] = {"objective": "makespan"}
    raw.pop("due_s", None)


def _one_less(raw: Raw) -> None:
    raw["order"] = raw["order"][:-1]
    for key in ("due_s", "release_s"):
        if key in raw:
            raw[key] = raw[key][:-1]


FEATURES: dict[str, tuple[Callable[[Raw], bool], Callable[[Raw], None]]] = {
    "no robot": (lambda raw: _count(raw) == 0, lambda raw: None),
    "two robots": (lambda raw: _count(raw) > 1, _one_robot),
    "track": (lambda raw: "track" in raw, _no_track),
    "reach": (lambda raw: any("serves" in one for one in raw.get("robots", ())), _serves_all),
    "speed": (lambda raw: any("speed" in one for one in raw.get("robots", [raw.get("robot", {})])), _one_speed),
    "loaded": (lambda raw: "loaded" in raw, _drop("loaded")),
    "windows": (lambda raw: any("at_most_s" in one for one in (*raw["stations"], *_stages(raw))), _no_windows),
    "servers": (lambda raw: any("servers" in one for one in raw["stations"]), _no_servers),
    "setups": (lambda raw: any("setup_s" in one for one in raw["stations"]), _without("setup_s")),
    "busy buffers": (
        lambda raw: raw.get("buffers", "busy") == "busy" and any("buffer" in one for one in _stages(raw)),
        _without("buffer"),
    ),
    "free buffers": (
        lambda raw: raw.get("buffers") == "free" and any("buffer" in one for one in _stages(raw)),
        _without("buffer"),
    ),
    "capacity": (
        lambda raw: any(
            one["kind"] == "machine" and one["capacity"] not in (1, "unlimited", one.get("servers"))
            for one in raw["stations"]
        ),
        _narrow,
    ),
    "machine twice": (
        lambda raw: any(_twice(route) for one in raw["products"] for route in one["routes"]),
        lambda raw: None,
    ),
    "alternatives": (lambda raw: any(len(one["routes"]) > 1 for one in raw["products"]), _one_way),
    "products": (lambda raw: len(set(raw["order"])) > 1, _one_product),
    "service": (lambda raw: any("service_s" in one for one in _stages(raw)), _without("service_s")),
    "pallets": (lambda raw: any("pallet" in one for one in _stages(raw)), _without("pallet")),
    "shelf": (
        lambda raw: any("shelf" in route for one in raw["products"] for route in one["routes"]),
        lambda raw: None,
    ),
    "arrivals": (lambda raw: "arrivals" in raw, _drop("arrivals")),
    "releases": (lambda raw: "release_s" in raw, _drop("release_s")),
    **{
        f"objective {name}": (lambda raw, name=name: raw["sequencing"]["objective"] == name, _for_makespan)  # type: ignore[misc]
        for name in OBJECTIVES[1:]
    },
}


def smaller(raw: Raw) -> Iterator[Raw]:
    """The same with a part less, and without each of the things that it has."""
    if len(raw["order"]) > 2:
        other = deepcopy(raw)
        _one_less(other)
        yield other
    for has, strip in FEATURES.values():
        if has(raw):
            other = deepcopy(raw)
            strip(other)
            if other != raw:
                yield other


def as_toml(raw: Raw) -> str:
    """The text of a cell file with these values."""
    plain = {key: value for key, value in raw.items() if key not in ("stations", "products")}
    lines = [f"{key} = {_value(value)}" for key, value in plain.items()]
    for key in ("stations", "products"):
        for one in raw[key]:
            lines += ["", f"[[{key}]]", *(f"{name} = {_value(value)}" for name, value in one.items())]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value)
