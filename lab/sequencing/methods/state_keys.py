"""The keys of values: a state and a decision as tuples, and both as one number for the compiled sessions."""

from typing import NamedTuple

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Position, entry, part_of
from lab.sequencing.search import SrlSettings
from lab.sequencing.simulate.cell_arrays import Ints
from lab.sequencing.simulate.run import Run

State = tuple[int, ...]
Key = tuple[State, int]
MAX_KEY = 2**63 - 1


class Keys(NamedTuple):
    """The encoding of a state, or of a state and a decision, as one number from 0 to `size` - 1.

    A state is a mixed-radix number, the lowest digit first, digit i from 0 to radix[i] - 1. weight (K, P): what each part adds to
    the number in each position; done (P,): what it adds once its machine has finished. pairs: whether values are kept by state
    and decision, with `labels` different decisions; else by next state. merged: whether identical parts are merged.
    """

    radix: Ints
    weight: Ints
    done: Ints
    labels: int
    pairs: bool
    merged: bool
    size: int


def key_of(run: Run, decision: int, settings: SrlSettings) -> Key:
    """The key of an allowed decision's value: a state and a decision, by the settings `values` and `state`.

    values "pairs": the state and the decision; where identical parts are merged, the decision is the entry of its part's position
    (from 1) instead of its part's number. values "states": the state that the decision leads to, as far as known now, and 0.
    state "parts": the position of each part. state "stations": how many parts stand at each position that takes room, then, for
    each position where a machine works, how many of them it has finished.
    """
    part = part_of(decision, run.cell.parts)
    option, here = run.option(decision), run.locations[part - 1]
    assert option is not None
    if settings.values == "states":
        after = [option.to if other == part - 1 else place for other, place in enumerate(run.locations)]
        begins = run.cell.positions[option.to].processing_s is not None
        return _state(run, after, part if begins else 0, settings), 0
    state = _state(run, run.locations, 0, settings)
    if settings.state == "parts":
        return state, decision
    return state, entry(here + 1, option.choice, len(run.cell.positions))


def keys_of(cell: Cell, values: str, state: str) -> Keys | None:
    """The keys for `SrlSettings.values` and `SrlSettings.state`; None when they do not fit in 63 bits."""
    size, merged = len(cell.positions), state == "stations"
    radix = _station_digits(cell) if merged else [size] * cell.parts
    scale = [1]
    for digits in radix:
        scale.append(scale[-1] * digits)
    labels = 1 if values == "states" else (size if merged else cell.parts) * cell.most_choices
    if scale[-1] * labels > MAX_KEY:
        return None
    done = [0] * size
    if merged:
        held = [index for index, place in enumerate(cell.positions) if place.holds]
        timed = timed_positions(cell)
        by_place = dict(zip(held, scale, strict=False))
        weight = [[by_place.get(place, 0) for place in range(size)]] * cell.parts
        for place, added in zip(timed, scale[len(held) :], strict=False):
            done[place] = added
    else:
        weight = [[scale[part] * place for place in range(size)] for part in range(cell.parts)]
    ints = [np.array(given, np.int64) for given in (radix, weight, done)]
    return Keys(ints[0], ints[1], ints[2], labels, values == "pairs", merged, scale[-1] * labels)


def no_keys(cell: Cell) -> Keys:
    """The keys for a search that keeps no values."""
    size = len(cell.positions)
    return Keys(
        np.zeros(0, np.int64), np.zeros((cell.parts, size), np.int64), np.zeros(size, np.int64), 1, False, False, 1
    )


def decoded(keys: Keys, key: int) -> tuple[tuple[int, ...], int]:
    """The digits of the state and the decision's label (from 0) that a key encodes."""
    number, label = divmod(key, keys.labels)
    digits = []
    for radix in keys.radix.tolist():
        number, digit = divmod(number, radix)
        digits.append(digit)
    return tuple(digits), label


def timed_positions(cell: Cell) -> tuple[int, ...]:
    """The positions where a machine may be at work on the part."""
    return tuple(index for index, place in enumerate(cell.positions) if _is_timed(place))


def _station_digits(cell: Cell) -> list[int]:
    """The radices of the digits: parts in each position that takes room, then parts that its machine has finished."""
    most = [1 + min([cell.capacities[station] for station in place.holds] + [cell.parts]) for place in cell.positions]
    held = [most[index] for index, place in enumerate(cell.positions) if place.holds]
    return held + [most[index] for index in timed_positions(cell)]


def _is_timed(place: Position) -> bool:
    return place.processing_s is None or place.processing_s > 0


def _state(run: Run, locations: list[int], begun: int, settings: SrlSettings) -> State:
    """The state with parts at these locations; `begun`: the part whose processing begins with it, 0: none."""
    if settings.state == "parts":
        return tuple(locations)
    places, timed = run.cell.positions, timed_positions(run.cell)
    standing, finished = [0] * len(places), [0] * len(places)
    for part, place in enumerate(locations, 1):
        standing[place] += 1
        finished[place] += part != begun and run.ready_s[part - 1] <= run.now_s
    return (*(standing[p] for p, place in enumerate(places) if place.holds), *(finished[p] for p in timed))
