"""The sequencing experiments of chapter 7 as in the listings of App. VI, compiled, for any number of toasts.

They differ from fig. 5.1, which explains the printed values. Values are kept per next state, and a next state is
chosen, but only its toast counts: it may be a state to which that toast cannot go now (a phantom). A toast in a
buffer may be chosen while the machine ahead is busy, and stays (a null move). `Reading` changes these one by one.
The compiled functions are in `chapter_7_listing_kernels`.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import Cell
from lab_studies.thesis import chapter_7_listing_kernels as kernels
from lab_studies.thesis.chapter_7_listing_kernels import (
    APPLIER,
    BUTTER_BUFFER,
    DONE,
    METHODS,
    PLATE,
    RANDOM,
    STATIONS,
    TOASTER,
    TOASTER_BUFFER,
    Floats,
    ListingRules,
    Toasts,
    Workspace,
)

KINDS = ("storage", "buffer", "machine", "buffer", "machine", "storage")
MOST_TOASTS = 6
# a [s] and b of eq. 5.3: the listing's for three toasts; for more, the values that come nearest to table IV.2
FACTOR_A, FACTOR_A_MORE = (5.0, 0.8), (10.0, 0.95)
BANNED_TOO = {3: ((APPLIER, PLATE, PLATE), (BUTTER_BUFFER, APPLIER, BUTTER_BUFFER))}  # in addition to those of rules
LONGEST = 5  # moves of one toast through all buffers and machines


@dataclass(frozen=True)
class Reading:
    """What the listings do and the text does not say; the other value of each field is what a reader would expect.

    phantoms: the next states of a toast are one and two stations ahead, wherever it can go; else the one where it goes.
    null_moves: a toast before a busy machine may be chosen. last_of_ties: the last of equal best values is taken, else a
    random one. averages: Monte Carlo averages over the session; the listing keeps the value of the last episode.
    frees_by_place: any arrival at the butter buffer or the applier frees the toaster; else only that of its own toast.
    bans_too: the states of BANNED_TOO, after which no second toast is loaded, are banned.
    """

    phantoms: bool = True
    null_moves: bool = True
    last_of_ties: bool = True
    averages: bool = False
    frees_by_place: bool = True
    bans_too: bool = True


LISTING = Reading()


@dataclass(frozen=True, eq=False)
class ListingInput:
    """The input of a session: the toast cell and the method as the listing has them."""

    toasts: Toasts
    rules: ListingRules
    count: int  # of toasts

    @classmethod
    def of(
        cls, cell: Cell, method: str, factor: str | None = None, reading: Reading = LISTING, spread: float = 0.0
    ) -> "ListingInput":
        """The input for a method in the toast cell of ch. 7 with 2 to MOST_TOASTS toasts; factor: SRL's, "A" or "B".

        spread: the standard deviation of processing times as a share of their mean. Raises BadInput for other cells,
        and for an unknown method or factor.
        """
        if tuple(station.kind for station in cell.stations) != KINDS:
            raise BadInput(
                f"cell with the stations {', '.join(cell.names)}: the listing is for the six stations of a toast cell"
            )
        if not 2 <= cell.parts <= MOST_TOASTS:
            raise BadInput(f"{cell.parts} toasts as listed: allowed are 2 to {MOST_TOASTS}")
        if method not in METHODS:
            raise unknown("method", method, METHODS, "listing")
        if method == "srl" and factor not in ("A", "B"):
            raise unknown("reward factor", factor, ("A", "B"), "listing")
        processing_s = np.array([station.processing_s for station in cell.stations])
        toasts = Toasts(np.nan_to_num(cell.loaded_s), processing_s, spread, banned_states(cell.parts, reading))
        a, b = FACTOR_A if cell.parts <= 3 else FACTOR_A_MORE
        changed = {name: getattr(reading, name) for name in ListingRules._fields if hasattr(reading, name)}
        return cls(toasts, ListingRules(METHODS.index(method), factor == "A", a, b, **changed), cell.parts)


def banned_states(toasts: int, reading: Reading = LISTING) -> NDArray[np.bool_]:
    """Whether each state is one of the listing's "impossible" ones, (6 ** toasts,) bool, 75 for three toasts.

    The rules hold for any number: two toasts in one machine; one in the butter buffer with none at the applier or done; one
    in the toaster's buffer with none in the toaster, at the applier or done; and two more states for three toasts. None is
    printed for four.
    """
    banned = np.zeros((STATIONS,) * toasts, dtype=np.bool_)
    for places in product(range(STATIONS), repeat=toasts):
        here = {*places}
        twice = places.count(TOASTER) > 1 or places.count(APPLIER) > 1
        waits_for_applier = BUTTER_BUFFER in here and not here & {APPLIER, DONE}
        waits_for_toaster = TOASTER_BUFFER in here and not here & {TOASTER, APPLIER, DONE}
        named = reading.bans_too and places in BANNED_TOO.get(toasts, ())
        banned[places[::-1]] = twice or waits_for_applier or waits_for_toaster or named
    return banned.ravel()


def run_sessions(
    listed: ListingInput, epsilons: Floats, seeds: NDArray[np.uint64], *, keep_times: bool = False
) -> kernels.ListingOutcomes:
    """The results of a session for each seed (N,) with the exploration epsilons (E,); random search always explores.

    Raises BadInput without episodes.
    """
    if not len(epsilons):
        raise BadInput("episodes = 0: allowed are whole numbers from 1")
    sessions, episodes = len(seeds), len(epsilons)
    tried = np.ones(episodes) if listed.rules.method == RANDOM else np.asarray(epsilons, np.float64)
    outcomes = kernels.ListingOutcomes(
        times_s=np.zeros((sessions if keep_times else 1, episodes)),
        best_s=np.zeros(sessions),
        last_s=np.zeros(sessions),
        converged=np.ones(sessions, np.int64),
        sequences=np.zeros((sessions, LONGEST * listed.count), np.int64),
    )
    work = new_workspace(listed.count)
    kernels.run_sessions(listed.toasts, listed.rules, work, tried, np.asarray(seeds, np.uint64), outcomes)
    return outcomes if keep_times else outcomes._replace(times_s=outcomes.times_s[:0])


def new_workspace(toasts: int) -> Workspace:
    """The workspace at the begin of a session with so many toasts."""
    states = STATIONS**toasts
    return Workspace(
        values=np.ones(states),
        counts=np.zeros(states, np.int64),
        visits=np.zeros(states, np.int64),
        seen=np.zeros(states, np.int64),
        place=np.zeros(toasts, np.int64),
        ready_s=np.zeros(toasts),
        busy=np.zeros(STATIONS, np.bool_),
        toast=np.zeros(2 * toasts, np.int64),
        following=np.zeros(2 * toasts, np.int64),
        clock=np.zeros(1),
        whole=np.zeros(4, np.int64),
        stream=np.zeros(1, np.uint64),
        moved=np.zeros(LONGEST * toasts, np.int64),
    )
