"""The names of a scene as words: its objects, or its parts and stations, with their synonyms and the work in each station."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lab.words.scene import GridScene, Scene
from lab.words.vocabulary import ORDINALS, as_read

SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "cube": ("cube", "block", "brick", "die"),
    "goal": ("goal", "slot", "target", "destination", "hole"),
    "bin": ("bin", "box", "container", "basket"),
    "plate": ("plate", "dish"),
    "machine": ("machine", "device", "apparatus"),
    "toaster": ("toaster",),
    "toast": ("toast", "slice", "bread", "slice of toast", "slice of bread", "piece of toast", "piece of bread"),
    "cup": ("cup", "mug"),
    "shaft": ("shaft", "axle"),
    "gear": ("gear", "cog", "gearwheel", "gear wheel", "cogwheel"),
    "slice": (
        "slice",
        "bread",
        "toast",
        "slice of bread",
        "piece of bread",
        "bread slice",
        "slice of toast",
        "piece of toast",
    ),
}
OBSTACLES = ("obstacle", "object", "block", "hurdle")
STATION_WORDS: Mapping[str, tuple[str, ...]] = {
    "washer": ("washer", "washing machine", "washing station", "wash"),
    "mill": ("mill", "milling machine", "milling station"),
    "lathe": ("lathe", "turning machine"),
    "tray": ("tray", "serving tray"),
    "plate": ("plate", "dish"),
    "exit": ("exit", "way out"),
    "toaster": ("toaster",),
}
STATION_WORK: Mapping[str, tuple[str, ...]] = {
    "lathe": ("turn", "turned", "turning", "turns"),
    "exit": (),
    "tray": ("serve", "served", "serving", "serves"),
    "washer": ("wash", "washed", "washing", "washes", "clean", "cleaned", "cleaning", "rinse", "rinsed", "rinsing"),
    "plate": (),
}


STORES = (
    "buffer",
    "plate",
    "tray",
    "rack",
    "store",
    "storage",
    "table",
    "exit",
    "entry",
    "dock",
    "pallet",
)  # nothing is done there


def _plurals(names: Iterable[str]) -> list[str]:
    return [form for name in names for form in (name, f"{name}s")]


def work_words(station: str) -> list[str]:
    """The verbs of the work in a station: "toast", "toasting", "toasted", "toasts" for the toaster."""
    if station in STATION_WORK:
        return list(STATION_WORK[station])
    words = station.split()
    if words[-1] in STORES:
        return []
    stem = words[0] if len(words) > 1 else station.removesuffix("er") if station.endswith("er") else station
    stem = stem.rstrip("e")
    return [f"{stem}{ending}" for ending in ("ing", "ed", "es", "s", "e", "")]


def _station_forms(station: str) -> list[str]:
    """What a station may be called, its own name first."""
    words = station.split()
    if len(words) > 1:
        first, last = words[0], words[-1]
        return [
            station,
            last,
            f"{first}er",
            f"{first} station",
            f"{first} machine",
            f"{first}ing station",
            f"{first}ing machine",
        ]
    ing = [f"{station.removesuffix('er')}ing station"] if station.endswith("er") else []
    return [station, *STATION_WORDS.get(station, ()), *ing]


def _own(forms: Sequence[str], station: str, all_forms: Mapping[str, Sequence[str]]) -> list[str]:
    """The forms that no other station has, and the station's own name."""
    others = {form for other, listed in all_forms.items() if other != station for form in listed}
    return [form for form in forms if form == station or (form not in others and form not in all_forms)]


Named = Mapping[tuple[str, ...], tuple[str, Any]]  # words -> their kind, and what they stand for


def names_of(scene: Scene) -> Named:
    """The words that name something in the scene, with what they stand for.

    NAME: ids of objects. PART: a part. KIND: parts of one kind. STATION: a station. ACT: the station of a work. ACTKIND: a noun
    that is also the verb of a work, as "toast": (station, parts).
    """
    named: dict[tuple[str, ...], tuple[str, Any]] = {}

    def add(kind: str, meaning: Any, forms: Iterable[str]) -> None:
        for form in forms:
            named.setdefault(as_read(form.lower()), (kind, meaning))

    if isinstance(scene, GridScene):
        for name, ids in _objects(scene).items():
            add("NAME", tuple(ids), (name, f"{name}s") if len(ids) > 1 else (name,))
        return named
    kinds: dict[str, list[str]] = {}
    for part in scene.parts:
        match = re.fullmatch(r"(.+) (\d+)", part)
        if match is None:
            add("PART", part, SYNONYMS.get(part, (part,)))
            continue
        kinds.setdefault(match[1], []).append(part)
        number = int(match[2])
        ordinals = [word for word, n in ORDINALS.items() if n == number]
        forms = [part]
        for kind in dict.fromkeys((match[1], *SYNONYMS.get(match[1], ()))):
            forms += [f"{kind} {number}", f"{kind} number {number}", f"{kind} no {number}", f"{kind} nr {number}"]
            forms += [f"{ordinal} {kind}" for ordinal in ordinals] + [f"number {number} {kind}"]
        add("PART", part, forms)
    nouns = {form: tuple(parts) for kind, parts in kinds.items() for form in (kind, *SYNONYMS.get(kind, ()))}
    for form, parts in nouns.items():
        if form != "toast":
            add("KIND", parts, (form, f"{form}s"))
    forms_of = {station: _station_forms(station) for station in scene.stations}
    for station, listed in forms_of.items():
        add("STATION", station, _own(listed, station, forms_of))
    works = {station: work_words(station) for station in scene.stations}
    for station, words in works.items():
        for word in _own(words, station, works):
            kind = "ACTKIND" if word in nouns else "ACT"
            add(kind, (station, nouns[word]) if word in nouns else station, (word,))
    return named


def _objects(scene: GridScene) -> dict[str, list[str]]:
    """The ids of the objects by each name that they have."""
    by_name: dict[str, list[str]] = {}
    for thing in scene.objects:
        for name in thing.names:
            by_name.setdefault(name, []).append(thing.id)
    given = set(by_name)
    for name, ids in list(by_name.items()):
        for synonym in SYNONYMS.get(name, ()):
            if synonym not in given:
                by_name.setdefault(synonym, []).extend(n for n in ids if n not in by_name[synonym])
    for thing in scene.objects:
        by_name.setdefault(thing.id.replace("-", " "), [thing.id])
    obstacles = [thing.id for thing in scene.objects if not thing.is_goal]
    for name in OBSTACLES:
        if obstacles:
            by_name.setdefault(name, obstacles)
    return by_name
