"""Room at the stations of a constraint model: each place has one part after the other; buffers are for full stations."""

from collections.abc import Sequence
from typing import NamedTuple

from lab.sequencing.methods.cp_sat_tasks import Task, Tasks
from lab.sequencing.methods.ortools_cp_sat import cp_model

Nodes = Sequence[tuple[int, int, cp_model.LiteralT]]


class Visit(NamedTuple):
    """A part's room at a station: who brings it there (None: it begins there), and who may take it away."""

    part: int
    bring: Task | None
    takes: tuple[Task, ...]


def add_chains(model: cp_model.CpModel, nodes: Nodes, most: int, chains: int) -> None:
    """Nodes 1 to `most` stand in chains from 0 to 0, so many at the most; a node with an arc to itself may be left out."""
    if not most:
        return
    sure = model.new_constant(1)
    # A chain through nothing: all others may be empty then.
    nodes = [*nodes, (0, most + 1, sure), (most + 1, 0, sure)]
    model.add_multiple_circuit(nodes)
    model.add(sum(arc for left, _, arc in nodes if not left) <= chains + 1)


def add_rooms(tasks: Tasks) -> None:
    """No station ever holds more than it can, and buffers are used where they may be."""
    for station in tasks.blocking:
        _add_room(tasks, station, _visits(tasks, station))
    for task in tasks.all:
        if task.option.if_full is not None:
            _add_full(tasks, task, task.option.if_full)


def _visits(tasks: Tasks, station: int) -> list[Visit]:
    """Every visit of a part to a station, of which each has takes of its own: a route may lead to it more than once."""
    positions, found = tasks.cell.positions, list[Visit]()
    holds = [station in place.holds for place in positions]

    def visit(part: int, bring: Task | None, begin: int) -> Visit:
        there, ahead = {begin}, [begin]
        while ahead:
            more = {way.to for way in positions[ahead.pop()].options if holds[way.to]} - there
            there |= more
            ahead += more
        takes = tuple(t for t in tasks.of(part) if t.place in there and not holds[t.option.to])
        return Visit(part, bring, takes)

    for part, begin in enumerate(tasks.cell.begin_at):
        if holds[begin]:
            found.append(visit(part, None, begin))
        own = tasks.of(part)
        found += [visit(part, t, t.option.to) for t in own if holds[t.option.to] and not holds[t.place]]
    return found


def _add_room(tasks: Tasks, station: int, visits: Sequence[Visit]) -> None:
    """Each place has one part after the other: the next is dropped when the one before was taken out."""
    model, nodes = tasks.model, list[tuple[int, int, cp_model.LiteralT]]()
    for number, visit in enumerate(visits, 1):
        nodes += [(0, number, model.new_bool_var("first")), (number, 0, model.new_bool_var("last"))]
        if visit.bring is not None:
            nodes.append((number, number, ~visit.bring.done))
        for other, after in enumerate(visits, 1):
            if visit is after or after.bring is None or not visit.takes:
                continue
            arc = model.new_bool_var("room")
            nodes.append((number, other, arc))
            if visit.bring is not None:
                tasks.brings.append((visit.bring, after.bring, (arc,)))
            for take in visit.takes:
                model.add(after.bring.end >= take.left).only_enforce_if(arc, take.done)
                tasks.frees.append((take, after.bring, (arc, take.done)))
                if after.bring.put is not None and take.rank is not None:
                    model.add(after.bring.put >= take.rank + 1).only_enforce_if(arc, take.done)
    add_chains(model, nodes, len(visits), tasks.cell.capacities[station])


def _add_full(tasks: Tasks, task: Task, station: int) -> None:
    """A buffer is used only when the station ahead is full, or will be by what is on its way there, where the cell says so."""
    model, inside = tasks.model, list[cp_model.IntVar]()
    for visit in _visits(tasks, station):
        if visit.part == task.part:
            continue
        then = model.new_bool_var("inside")
        inside.append(then)
        if visit.bring is not None:
            model.add_implication(then, visit.bring.done)
            tasks.after(task, visit.bring, then, task.done, begun=True)
            model.add(visit.bring.left <= task.left).only_enforce_if(then, task.done)
        for take in visit.takes:
            tasks.after(take, task, then, take.done, task.done, begun=True)
            model.add(take.left >= task.left).only_enforce_if(then, take.done, task.done)
    model.add(sum(inside) >= tasks.cell.capacities[station]).only_enforce_if(task.done)
