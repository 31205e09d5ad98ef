"""Which rules of a cell a timed plan breaks, in words: the plan alone is looked at, whoever made it."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from oracle.cell import Carried, Cell, Objective, Plan, Worked
from oracle.model import places
from oracle.ways import Step, Way, stretches, ways_of

EPS = 1e-5


class _Stay(NamedTuple):
    """A part, or its pallet, at a station: since when, until when; who brings it and who takes it, by their place in a plan.

    coming_s: since when it is on its way there."""

    part: int
    station: str
    since_s: float
    until_s: float
    by: int
    to: int
    coming_s: float


def violations(cell: Cell, plan: Plan) -> list[str]:
    """What is against the rules, a line each; none: the plan can be carried out as it stands."""
    found, stays = list[str](), list[_Stay]()
    first_s = list[float]()
    for part, name in enumerate(cell.order, 1):
        happens = _of_part(plan, part)
        tried = [_followed(cell, way, part, happens, plan) for way in ways_of(cell, name)]
        wrong, own = min(tried, key=lambda one: (one[1] == [], len(one[0])))
        found += [f"part {part}: {one}" for one in wrong]
        stays += own
        first_s.append(_begin_s(happens[0]) if happens else 0.0)
    found += _releases(cell, first_s)
    found += [line for robot in cell.robots for line in _tour(cell, robot.name, plan)]
    found += _crowds(cell, stays, plan) + _servers(cell, plan) + _track(cell, plan)
    return found + _buffers(cell, stays, plan)


def value_of(cell: Cell, plan: Plan, objective: Objective) -> float:
    """What a plan comes to."""
    ends = [max((_end_s(one) for one in _of_part(plan, part)), default=0.0) for part in range(1, len(cell.order) + 1)]
    due = cell.due_s or (0.0,) * len(ends)
    late = [max(0.0, end_s - due_s) for end_s, due_s in zip(ends, due, strict=True)]
    if objective == "makespan":
        return max(ends)
    if objective == "mean-tardiness":
        return sum(late) / len(late)
    if objective == "tardy-parts":
        return float(sum(one > EPS for one in late))
    if objective == "machine-idle":
        return places(cell) * max(ends) - sum(_work_s(cell, plan, part) for part in range(1, len(ends) + 1))
    waits = 0.0
    for robot in cell.robots:
        at, own = robot.start, [one for one in plan.carried if one.robot == robot.name]
        waits += max([one.drop_s for one in own], default=0.0)
        for one in sorted(own, key=lambda one: (one.drop_s, one.pick_s)):
            drives = 0.0 if at == one.origin else cell.empty_s[at, one.origin]
            waits -= one.service_s + (drives + _loaded_s(cell, one)) / robot.speed
            at = one.target
    return waits


def _work_s(cell: Cell, plan: Plan, part: int) -> float:
    """How long machines work on a part, on the way that it takes."""
    happens = _of_part(plan, part)
    tried = [(way, *_followed(cell, way, part, happens, plan)) for way in ways_of(cell, cell.order[part - 1])]
    way, *_ = min(tried, key=lambda one: (one[2] == [], len(one[1])))
    return sum(step.processing_s for step in way.steps)


def _loaded_s(cell: Cell, one: Carried) -> float:
    return 0.0 if one.origin == one.target else cell.loaded_s.get((one.origin, one.target), float("inf"))


def _of_part(plan: Plan, part: int) -> list[Carried | Worked]:
    happens: list[Carried | Worked] = [one for one in plan.carried if one.part == part]
    happens += [one for one in plan.worked if one.part == part]
    return sorted(happens, key=lambda one: (_begin_s(one), _end_s(one)))


def _begin_s(one: Carried | Worked) -> float:
    return one.pick_s if isinstance(one, Carried) else one.begin_s


def _end_s(one: Carried | Worked) -> float:
    return one.drop_s if isinstance(one, Carried) else one.end_s


def _fits(step: Step, one: Carried | Worked) -> bool:
    if isinstance(one, Worked):
        return step.kind == "work" and step.target == one.station
    return step.kind == "carry" and (step.origin, step.target, step.pallet) == (
        one.origin,
        one.target,
        one.what == "pallet",
    )


def _followed(
    cell: Cell, way: Way, part: int, happens: Sequence[Carried | Worked], plan: Plan
) -> tuple[list[str], list[_Stay]]:
    """What of a part's plan is not as on a way, and where it stands meanwhile."""
    if len(happens) != len(way.steps) or not all(map(_fits, way.steps, happens)):
        said = " > ".join(one.target if isinstance(one, Carried) else f"({one.station})" for one in happens)
        return ["not on a route: " + said], []
    wrong = list[str]()
    release_s = cell.release_s[part - 1] if cell.release_s is not None else 0.0
    for step, one, before in zip(way.steps, happens, [None, *happens[:-1]], strict=True):
        begin_s, what = _begin_s(one), f"{step.kind} {step.origin} > {step.target}"
        if before is not None and begin_s < _end_s(before) - EPS:
            wrong.append(f"{what} at {begin_s:g}, before the step before ends at {_end_s(before):g}")
        if isinstance(one, Worked) and abs(one.end_s - one.begin_s - step.processing_s) > EPS:
            wrong.append(f"{what}: worked on for {one.end_s - one.begin_s:g} s, not {step.processing_s:g} s")
        if isinstance(one, Carried) and abs(one.service_s - step.service_s) > EPS:
            wrong.append(f"{what}: served for {one.service_s:g} s, not {step.service_s:g} s")
        if step.ready is None:
            continue
        if step.ready < 0:
            done_s = release_s
        else:
            brought = happens[step.ready]
            work_s = way.steps[step.ready].processing_s if isinstance(brought, Carried) else 0.0
            done_s = _end_s(brought) + work_s
        if begin_s < done_s + step.service_s - EPS:
            wrong.append(f"{what} at {begin_s:g}, but ready at {done_s:g} and served for {step.service_s:g} s")
        if step.at_most_s is not None and step.ready >= 0 and begin_s > done_s + step.at_most_s + EPS:
            wrong.append(f"{what} at {begin_s:g}, later than {done_s + step.at_most_s:g}")
    order = {id(one): n for n, one in enumerate((*plan.carried, *plan.worked))}
    stays = [
        _Stay(
            part, room.station, _end_s(happens[room.since]),
            _end_s(happens[room.until]) if room.at_end else _begin_s(happens[room.until]),
            order[id(happens[room.since])], -1 if room.at_end else order[id(happens[room.until])],
            _begin_s(happens[room.since]),
        )
        for room in way.rooms
    ]  # fmt: skip
    return wrong, stays


def _releases(cell: Cell, first_s: Sequence[float]) -> list[str]:
    if cell.interval_s is None:
        return []
    found, came_s = list[str](), 0.0
    for n, (at_s, interval_s) in enumerate(zip(first_s, cell.interval_s, strict=True)):
        came_s = interval_s + (came_s if cell.after == "clock" or not n else first_s[n - 1])
        if at_s < came_s - EPS:
            found.append(f"part {n + 1}: taken at {at_s:g}, it comes at {came_s:g}")
        if n and at_s < first_s[n - 1] - EPS:
            found.append(f"part {n + 1}: taken at {at_s:g}, before part {n} at {first_s[n - 1]:g}")
    return found


def _tour(cell: Cell, name: str, plan: Plan) -> list[str]:
    """A robot in two places at once, too fast, or where it does not serve."""
    robot = next(one for one in cell.robots if one.name == name)
    own = sorted((one for one in plan.carried if one.robot == name), key=lambda one: (one.drop_s, one.pick_s))
    found, at, free_s = list[str](), robot.start, 0.0
    for one in own:
        what = f"{name} with part {one.part} {one.origin} > {one.target} at {one.pick_s:g}"
        empty_s = 0.0 if at == one.origin else cell.empty_s.get((at, one.origin), float("inf")) / robot.speed
        if one.leave_s < free_s - EPS:
            found.append(f"{what}: leaves at {one.leave_s:g}, but is free at {free_s:g}")
        if one.pick_s < one.leave_s + empty_s + one.service_s - EPS:
            found.append(f"{what}: leaves {at} at {one.leave_s:g}, needs {empty_s:g} and {one.service_s:g} s before it")
        if one.out_s < one.pick_s - EPS or one.drop_s < one.out_s + _loaded_s(cell, one) / robot.speed - EPS:
            found.append(f"{what}: drops at {one.drop_s:g}, too fast")
        if robot.serves is not None and not {one.origin, one.target} <= robot.serves:
            found.append(f"{what}: it does not serve there")
        at, free_s = one.target, one.drop_s
    return found


def _crowds(cell: Cell, stays: Sequence[_Stay], plan: Plan) -> list[str]:
    """More parts in a station than it can hold.

    What happens in one instant may happen in the order that needs the least room, but a robot that puts a part down and
    takes another one does it in this order.
    """
    found = list[str]()
    for station in cell.stations:
        here = [one for one in stays if one.station == station.name]
        for at_s in sorted({one.since_s for one in here}) if station.capacity is not None else ():
            come = [one for one in here if abs(one.since_s - at_s) <= EPS]
            stood = [one for one in here if one.since_s < at_s - EPS and one.until_s > at_s - EPS]
            by = {plan.carried[one.by].robot for one in come}
            swapped = [
                one for one in stood if one.until_s <= at_s + EPS and one.to >= 0 and plan.carried[one.to].robot in by
            ]
            still = sum(one.until_s > at_s + EPS for one in stood) + len(swapped)
            stays_on = sum(one.until_s > at_s + EPS for one in come) - len(swapped)
            most = still + max(1, stays_on)
            if station.capacity is not None and most > station.capacity:
                found.append(f"'{station.name}' holds {most} at {at_s:g}, it has room for {station.capacity}")
    return found


def _servers(cell: Cell, plan: Plan) -> list[str]:
    """Whether the works of a machine can be given to its servers, setups between them counted."""
    found = list[str]()
    for station in cell.stations:
        works = sorted(
            (one for one in plan.worked if one.station == station.name), key=lambda one: (one.begin_s, one.end_s)
        )
        if works and not _assignable(cell, station.name, works, ()):
            found.append(f"'{station.name}': its {station.servers} servers cannot do all that at its times")
    return found


def _assignable(cell: Cell, name: str, works: Sequence[Worked], last: tuple[Worked, ...]) -> bool:
    """Whether the rest of the works can be given to servers that have done these last."""
    if not works:
        return True
    station, one = cell.station(name), works[0]
    assert station.servers is not None

    def follows(before: Worked) -> bool:
        pair = cell.order[before.part - 1], cell.order[one.part - 1]
        return before.end_s + station.setup_s.get(pair, 0.0) <= one.begin_s + EPS

    tried = [n for n, before in enumerate(last) if follows(before)]
    if any(_assignable(cell, name, works[1:], (*last[:n], *last[n + 1 :], one)) for n in tried):
        return True
    return len(last) < station.servers and _assignable(cell, name, works[1:], (*last, one))


def _track(cell: Cell, plan: Plan) -> list[str]:
    """Two robots on one stretch of the track."""
    if not cell.track:
        return []
    held = list[tuple[int, float, float, str]]()
    for robot in cell.robots:
        at = robot.start
        for one in sorted((o for o in plan.carried if o.robot == robot.name), key=lambda one: (one.drop_s, one.pick_s)):
            for a, b, leave_s in ((at, one.origin, one.leave_s), (one.origin, one.target, one.out_s)):
                for number, from_s, until_s in stretches(cell, a, b):
                    held.append((number, leave_s + from_s / robot.speed, leave_s + until_s / robot.speed, robot.name))
            at = one.target
    held.sort()
    return [
        f"{one[3]} and {then[3]} on stretch {one[0]} of the track at {then[1]:g}"
        for one, then in pairwise(held)
        if one[0] == then[0] and then[1] < one[2] - EPS and one[3] != then[3]
    ]


def _buffers(cell: Cell, stays: Sequence[_Stay], plan: Plan) -> list[str]:
    """A buffer that was used though there was room behind it all the while."""
    if not cell.only_when_full:
        return []
    found = list[str]()
    for one in plan.carried:
        if one.what == "pallet":
            continue
        behind = {
            stage.station
            for way in cell.routes[cell.order[one.part - 1]]
            for stage in way
            if stage.buffer == one.target
        }
        room = [cell.station(name).capacity or float("inf") for name in behind]
        crowd = [
            max(
                sum(
                    s.station == name and s.part != one.part and s.coming_s <= at_s + EPS and s.until_s >= at_s - EPS
                    for s in stays
                )
                for at_s in (one.pick_s, one.drop_s)
            )
            for name in behind
        ]
        if behind and all(most < least for most, least in zip(crowd, room, strict=True)):
            found.append(f"part {one.part} put into '{one.target}' at {one.drop_s:g} while '{min(behind)}' had room")
    return found
