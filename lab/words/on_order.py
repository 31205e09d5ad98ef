"""What groups of words mean on the order of transfers: moves, and rules about parts and stations."""

from collections.abc import Iterator, Sequence

from lab.words.clauses import NO_COMMAND, SEPARATORS, Clause, Group, Said, common
from lab.words.slots import Part
from lab.words.vocabulary import clause_kinds

IT = Part()  # the part that was named last
THERE = "there"  # the station that was named last
SEPARATING = ("THEN", "COMMA", "AND", "DOT", "BUT")


def meanings(group: Group) -> Iterator[tuple[float, Clause]]:
    """What a group means on the order, each with a cost."""
    yield from common(group)
    never = _never(group)
    if never is not None:
        yield 0.0, never
    elif (before := _before(group)) is not None:
        yield 0.0, before
    elif (in_turn := _in_turn(group)) is not None:
        border = SEPARATORS["THEN"] + 1.0 if group.has("FIRST", "PRIORITY") else SEPARATORS["THEN"] / 2
        yield (-border if group.has("THEN") else 0.0), in_turn  # its "then" is no border
    if (finish := _finish(group)) is not None:
        yield 0.0, finish
    elif not group.has("BEFORE", "AFTER"):
        if (number := _number(group)) is not None:
            yield 0.0, number
        elif (move := _move(group)) is not None:
            yield (4.0 if move.values[1] and not move.values[2] else 0.0), move
    if _is_left_out(group):
        yield 1.0, NO_COMMAND
    if _is_reason(group):
        yield 1.0, Said("reason", tuple(group.all("part")[:1]))


def _places(group: Group) -> list[str]:
    """The stations that a group names, "there" among them."""
    there = [THERE] * any(slot.kind in ("IT", "WAIT") and "there" in str(slot.value) for slot in group.slots)
    return group.all("station") or there


def _parts(group: Group) -> list[Part]:
    """The parts that a group names; without "the next one" if there is another."""
    parts = group.all("part")
    return [part for part in parts if not part.is_next] or parts[:1]


def _number(group: Group) -> Said | None:
    named = group.all("numbered")
    listed = clause_kinds("number")
    if len(named) != 1 or not group.only(*listed) or any(not part.is_next for part in group.all("part")):
        return None
    at = group.at("numbered")
    before = group.slots[at - 1] if at else None
    points = before is not None and (before.kind == "part" or str(before.value).endswith((" that", " this")))
    if points and named[0] == 1.0:
        return None  # "pick that one", "another one"
    return Said("number", (named[0],))


def _move(group: Group) -> Said | None:
    listed = clause_kinds("move")
    if (
        not group.only(*listed)
        or (group.has("NO") and group.at("NO") > 0)
        or (group.has("WAIT") and not group.has("station"))
    ):
        return None
    parts, stations, works = _parts(group), _places(group), group.all("work")
    if len(parts) > 1 or len(stations) > 2 or len(works) > 1 or (parts and (parts[0].is_none or parts[0].is_any)):
        return None
    if group.has("IS") and not any(part.is_next for part in group.all("part")):
        return None
    if any(str(text).split()[0] not in ("let", "have", "make", "i", "want", "see") for text in group.all("LET")):
        return None  # "leave slice 2 in the toaster"
    if works and works[0][1].endswith("ed") and group.has("IS", "WAS", "DONE"):
        return None  # "slice 1 is buttered"
    if group.has("WAIT"):
        return None
    if not parts and not group.has("IT") and (len(stations) != 2 or group.has(*SEPARATORS)):
        return None
    part = parts[0] if parts else IT if group.has("IT") else Part(is_any=True)
    if not (stations or works or group.has("PUT", "CHOOSE") or any(part.is_next for part in group.all("part"))):
        return None
    origin, target = _ends_of(group, stations)
    if works:
        if target not in (None, works[0][0]):
            return None
        target = works[0][0]
    return Said("move", (part, origin, target))


def _ends_of(group: Group, stations: Sequence[str]) -> tuple[str | None, str | None]:
    """The stations that a move leaves and reaches, None for those that are not said."""
    if not stations:
        return None, None
    leaves = [
        station
        for station in stations
        if any(
            a.kind == "FROM" and b.kind == "station" and b.value == station
            for a, b in zip(group.slots, group.slots[1:], strict=False)
        )
    ]
    if len(stations) == 2:
        second_left = leaves == [stations[1]]
        return (stations[1], stations[0]) if second_left else (stations[0], stations[1])
    return (stations[0], None) if leaves else (None, stations[0])


def _never(group: Group) -> Said | None:
    listed = clause_kinds("never")
    keeps_empty = group.has("EMPTY") and group.has("LET") and group.only("EMPTY", "LET", "station", "EACHTIME")
    if keeps_empty and len(group.all("station")) == 1:
        return Said("never", (Part(is_any=True), group.all("station")[0]))
    keeps_from = (
        group.has("FROM") and group.has("WAIT") and any(str(text).startswith("keep") for text in group.all("LET"))
    )
    if group.has("FROM") and not keeps_from:
        return None
    none = keeps_from or any(part.is_none for part in group.all("part"))
    if not group.only(*listed) or not (group.negated or group.has("STOP") or none):
        return None
    stations = _places(group)
    forgets = any(str(text).startswith("forget") for text in group.all("CANCEL"))
    if not (forgets or group.has("WAIT", "LET")) or len(stations) != 1 or len(_parts(group)) > 1:
        return None
    parts = _parts(group)
    part = (
        parts[0]
        if parts
        else IT
        if (group.has("IT") and not group.has("WAIT")) or _it_is_a_part(group)
        else Part(is_any=True)
    )
    return Said("never", (part, stations[0]))


def _it_is_a_part(group: Group) -> bool:
    return any(slot.kind == "IT" and "there" not in str(slot.value) for slot in group.slots)


# ---- one work before another -----------------------------------------------------------------------------------------------


def _before(group: Group) -> Said | None:
    """One work before another, with the words "before" or "after"; or a part before all others."""
    at = group.at("BEFORE", "AFTER")
    if at < 0 or sum(slot.kind in ("BEFORE", "AFTER") for slot in group.slots) > 1:
        return None
    first, second = group.slots[:at], group.slots[at + 1 :]
    is_fronted = not any(slot.kind in ("part", "station", "work", "IT") for slot in first)
    if is_fronted:
        cut = next((n for n, slot in enumerate(second) if slot.kind in SEPARATING), 0)
        named = next((n for n, slot in enumerate(second) if slot.kind in ("part", "station", "work")), len(second))
        cut = cut or next((n for n, slot in enumerate(second) if slot.kind == "PUT" and n > named), 0)
        parts = [n for n, slot in enumerate(second) if slot.kind == "part"]
        cut = cut or (parts[1] if len(parts) > 1 else 0)
        if not cut:
            return None
        first, second = (*first, *second[cut:]), second[:cut]
    left, right = _work(Group(first)), _work(Group(second))
    if left is None or right is None:
        return None
    if left.values[2] and right.values[1] is None and right.values[0].parts:
        right = Said("work", (right.values[0], left.values[1], True))  # "washed before the gear"
    marker = group.slots[at]
    text = str(marker.value)
    negated = Group(first).negated or any(part.is_none for part in Group(first).all("part"))
    holds = Group(first).has("HOLD", "WAIT")
    if marker.kind == "BEFORE":
        swaps = negated or (is_fronted and False)
        if holds and not negated:
            return None
    else:
        strict = "until" in text or "till" in text or "til" in text or "unless" in text or "not" in text
        if (negated or holds) and not strict:
            return None
        if strict and text in ("until", "till", "til") and not (negated or holds):
            return None
        swaps = True
    if Group(second).negated:
        return None
    pair = (right, left) if swaps else (left, right)
    return Said("before", pair)


def _in_turn(group: Group) -> Said | None:
    """One work first, and then another."""
    if not group.has("THEN", "FIRST") or group.negated:
        return None
    breaks = ("THEN",) if group.has("THEN") else ("COMMA", "AND")  # "mill first, wash later"
    cuts = [n for n, slot in enumerate(group.slots) if slot.kind in breaks]
    if len(cuts) != 1 or group.at("FIRST", "PRIORITY") > cuts[0]:
        return None
    left, right = _work(Group(group.slots[: cuts[0]])), _work(Group(group.slots[cuts[0] + 1 :]))
    if left is None or right is None:
        return None
    return Said("in turn", (left, right))


def _work(group: Group) -> Said | None:
    """The work that a part of a clause names: a part, a station, or both; its last value is whether a verb names it."""
    if (
        not group.only(*clause_kinds("work"))
        or len(_parts(group)) > 1
        or len(group.all("station")) > 1
        or len(group.all("work")) > 1
    ):
        return None
    parts, stations, works = _parts(group), _places(group), group.all("work")
    if group.has("FROM"):
        return None
    if works and stations and stations[0] not in (works[0][0], THERE):
        return None
    station = works[0][0] if works else stations[0] if stations else None
    part = parts[0] if parts else IT if _it_is_a_part(group) else Part(is_any=True)
    if part.is_any and station is None:
        return None
    return Said("work", (part, station, bool(works)))


# ---- one part first --------------------------------------------------------------------------------------------------------


def _finish(group: Group) -> Said | None:
    listed = clause_kinds("finish")
    if group.has("AFTER") and 0 <= group.at("REST") < group.at("AFTER") < group.at("part"):  # "all else can wait until"
        waits = group.only("REST", "AFTER", "part", "DONE", "WAIT", "FINISH", "LET")
        return Said("finish", (group.all("part")[-1],)) if waits else None
    if any(str(text).endswith("before") for text in group.all("REST")) and group.only("REST", "part", "DONE", "FINISH"):
        return Said("finish", (group.all("part")[0],)) if len(group.all("part")) == 1 else None
    parts = [part for part in group.all("part") if not part.is_any]
    others = [part for part in group.all("part") if part.is_any]
    if not group.only(*listed) or len(parts) > 1 or (not parts and not group.has("IT")):
        return None
    if group.has("BEFORE") and not (group.at("BEFORE") > group.at("part") and (group.has("REST") or others)):
        return None
    if others and not group.has("BEFORE", "PRIORITY"):
        return None
    if (group.has("numbered") and group.all("numbered") != [1.0]) or (group.has("WAIT") and not group.has("REST")):
        return None
    done = group.has("DONE") and group.has("PUT", "LET")
    before_all = group.has("BEFORE") and group.has("REST")
    if not (done or before_all or group.has("FINISH", "WORKON", "PRIORITY", "FIRST", "numbered")):
        return None
    return Said("finish", (parts[0] if parts else IT,))


def _is_reason(group: Group) -> bool:
    if (
        group.negated
        or group.has("PUT", "CHOOSE")
        or not group.has("DONE", "work", "WAIT", "LONG", "PRIORITY", "BECAUSE")
    ):
        return False
    works = group.all("work")
    if not group.has("part", "station", "DONE") or (works and not group.has("IS", "WAS")):
        return False
    if works and not all(text.endswith("ed") for _, text in works):
        return False
    return group.only("part", "station", "work", "DONE", "IN", "WAIT", "LONG", "BECAUSE", "WAS")


def _is_left_out(group: Group) -> bool:
    """Whether a group is like "no toasting", after a move that leaves that out."""
    return (
        group.has("NO", "SKIP")
        and group.has("work", "station")
        and group.only("NO", "SKIP", "work", "station", "PUT", "IN")
    )
