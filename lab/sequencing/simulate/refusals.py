"""Why a decision may not be taken in a run, in words."""

from collections.abc import Sequence
from typing import Protocol

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, choice_of, part_of
from lab.sequencing.simulate.rooms import Rooms


class Decided(Protocol):
    """What is asked of a run: see `Run`."""

    cell: Cell
    locations: list[int]
    ready_s: list[float]
    held: list[int]
    rooms: Rooms
    fetched: int

    def full(self) -> Sequence[bool]: ...
    def inside(self, station: int) -> Sequence[int]: ...
    def in_turn(self, part: int) -> bool: ...
    def spoils(self, decision: int) -> bool: ...
    def too_late(self, part: int, option: Option) -> bool: ...
    def waits_for(self, part: int, option: Option) -> str: ...
    def pick_s(self, part: int, option: Option) -> float: ...


def refusal(run: Decided, decision: int) -> str:
    """Why a decision, which is not, may not be taken now, in words."""
    cell, part = run.cell, part_of(decision, run.cell.parts)
    if decision < 1 or choice_of(decision, cell.parts) >= cell.most_choices:
        return f"there is no part {decision}, only 1 to {cell.parts}"
    if run.spoils(decision):
        return _burns(run, part)
    place = cell.positions[run.locations[part - 1]]
    name, where = cell.part_name(part), cell.names[place.station]
    if not place.options:
        return f"{name} {'is already' if not place.holds else 'stays'} at '{where}'"
    if not run.in_turn(part):
        return f"{name} has not come yet: {cell.part_name(cell.coming[run.fetched])} is before it"
    full = run.full()
    choice = choice_of(decision, cell.parts)
    if all(option.choice != choice for option in place.options):
        for option in cell.laid_out[run.locations[part - 1]].options:
            if option.choice == choice:
                return f"{name} at '{where}': the way by '{cell.names[option.target]}' is closed"
    waits = next((why for o in place.options if o.possible(full) and (why := run.waits_for(part, o))), "")
    if waits:
        return f"{name} at '{where}' may not {waits}"
    for robot, held in enumerate(run.held):
        if held and (held == part or any(o.choice == choice and o.robot == robot for o in place.options)):
            where = " and ".join(repr(cell.names[station]) for station in run.rooms.awaited(robot))
            return f"'{cell.robots[robot].name}' holds {cell.part_name(held)} until there is room in {where}"
    taken = dict.fromkeys(repr(cell.names[s]) for option in place.options for s in option.needs if full[s])
    if not taken:
        return f"{name} at '{where}' has no choice {choice_of(decision, cell.parts) + 1}"
    emptied = [s for option in place.options for s in option.needs if full[s] and s in cell.batches]
    if any(len(run.inside(station)) < cell.capacities[station] for station in emptied):
        return f"{name} at '{where}' cannot move on: the batch in {' and '.join(taken)} has begun"
    return f"{name} at '{where}' cannot move on: {' and '.join(taken)} full"


def _burns(run: Decided, part: int) -> str:
    """That a part would be picked too late, in words."""
    cell, place = run.cell, run.cell.positions[run.locations[part - 1]]
    option = next(option for option in place.options if run.too_late(part, option))
    times_s = f"done at {run.ready_s[part - 1]:g} s, fetched at {run.pick_s(part, option):g} s"
    where = f"{cell.part_name(part)} in '{cell.names[place.station]}'"
    return f"{where} would burn: {times_s}, allowed {place.at_most_s:g} s"
