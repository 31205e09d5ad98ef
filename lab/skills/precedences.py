"""Which transfers of a task have to wait for others: what stands on parts comes after them, and leaves before them."""

from collections.abc import Iterator

from lab.errors import BadInput, counted
from lab.sequencing.cell.precedence import Precedence, Step
from lab.sim.parts.kinds import Spot
from lab.sim.scene.places import Places
from lab.sim.scene.scene_check import places_of
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Station


def precedences(task: Task, order: Order) -> tuple[Precedence, ...]:
    """Those of an order, parts by their numbers: from places with a height, and from the file's [[after]].

    BadInput, with the file and the line, where parts would wait for more than there are.
    """
    with task.in_its_file():
        layered = [station for station in task.stations if station.is_layered]
        places = places_of(task) if layered else None
        derived = [
            one
            for station in layered
            if places
            for one in (*_put_on(places, station, order), *_taken_off(places, station, order))
        ]
        return (*derived, *_said(task, order))


def _put_on(places: Places, station: Station, order: Order) -> Iterator[Precedence]:
    """Where routes end: as many parts of a kind are there as it takes until a part of another kind stands on them.

    The places of a kind are filled from the first on, so the n-th part that comes stands on the n-th of them.
    """
    task, groups = places.task, dict[tuple[Spot, ...], list[str]]()
    for part in task.made:
        if station.name in part.ends and station.name != task.starts(part.name):
            groups.setdefault(tuple(places.spots(station, part.name)), []).append(part.name)
    for spots, kinds in groups.items():
        parts = _numbers(order, kinds)
        for others, below in groups.items():
            carry = [[others.index(on) + 1 for on in places.carriers(station, spot) if on in others] for spot in spots]
            most, needs = 0, list[int]()
            for own in carry[: len(parts)]:
                most = max([most, *own])
                needs.append(most)
            if others == spots or not most:
                continue
            of = _numbers(order, below)
            if most > len(of):
                raise BadInput(
                    f"station '{station.name}': {counted(len(parts), kinds[0])} would stand on {counted(most, below[0])} there, "
                    f"and the order has {len(of)}: wanted more of '{below[0]}', or fewer of '{kinds[0]}'"
                )
            for kind in (*kinds, *below):
                if other := next((r[-1].station for r in task.part(kind).routes if r[-1].station != station.name), ""):
                    raise BadInput(
                        f"part '{kind}': routes: they end at '{station.name}', where parts stand on parts, or at '{other}': "
                        "which of its parts will be there is not planned: wanted one end, or no layers there"
                    )
            yield Precedence(parts, Step(station.name), of, Step(station.name), tuple(needs))


def _taken_off(places: Places, station: Station, order: Order) -> Iterator[Precedence]:
    """Where routes begin: a layer is taken away, as far as parts carry it, before any part of the layer below it."""
    begins = enumerate(places.begins(order), 1)
    stand = {part: spot for part, spot in begins if places.task.starts(order[part - 1]) == station.name}
    below = {part: [under.z for _, under in places.below(station, spot)] for part, spot in stand.items()}
    for level in sorted({spot.z for spot in stand.values()}):
        of = tuple(part for part, own in below.items() if level in own)
        parts = tuple(part for part, spot in stand.items() if spot.z == level)
        if of:
            yield Precedence(parts, Step(station.name, leaves=True), of, Step(station.name, leaves=True))


def _said(task: Task, order: Order) -> Iterator[Precedence]:
    """What the file says; nothing of kinds that the order has none of."""
    for number, one in enumerate(task.after, 1):
        parts, of = _numbers(order, [one.part]), _numbers(order, [one.of])
        if not parts or (not of and one.count == "all"):
            continue
        if one.count == "each" and len(of) < len(parts):
            raise BadInput(
                f"after {number}: {counted(len(parts), one.part)} would wait for as many of '{one.of}', and the order has "
                f"{len(of)}: wanted count = 'all', more of '{one.of}', or fewer of '{one.part}'"
            )
        needs = tuple(range(1, len(parts) + 1)) if one.count == "each" else ()
        steps = Step(one.station, one.step == "leaves"), Step(one.of_station or one.station, one.of_step == "leaves")
        yield Precedence(parts, steps[0], of, steps[1], needs)


def _numbers(order: Order, kinds: list[str]) -> tuple[int, ...]:
    return tuple(number for number, kind in enumerate(order, 1) if kind in kinds)
