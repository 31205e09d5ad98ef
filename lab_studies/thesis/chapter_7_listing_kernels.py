"""Sessions of `chapter_7_listing`, compiled with numba; stations and toasts are numbered from 0 here."""

from math import cos, inf, log, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import splitmix
from lab.learning.compiled import without_refcounts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
PLATE, TOASTER_BUFFER, TOASTER, BUTTER_BUFFER, APPLIER, DONE = range(6)
STATIONS = 6
METHODS = ("srl", "mc", "random")
SRL, MONTE_CARLO, RANDOM = range(3)  # in METHODS
ALPHA, DISCOUNT, GOAL_REWARD = 0.05, 0.9, 1.5
LATEST_S = 20_000.0  # the time at which the listing gives up an episode
MOST_MOVES = 10_000_000  # ends an episode of null moves, which take no time; never reached
_following, _mixed, _fraction = (
    without_refcounts(splitmix.following),
    without_refcounts(splitmix.mixed),
    without_refcounts(splitmix.fraction),
)
ROBOT, STATE, SEEN, MOVED = range(4)  # in `whole`: its station, the state's number, states visited, toasts moved


class Toasts(NamedTuple):
    """The cell with K toasts. travel_s (6, 6) [s], 0 where the cell has no time; processing_s (6,): mean times [s].

    spread: the standard deviation of normal processing times as a share of the mean. banned (6 ** K,): states that are never
    chosen. A state is a number of K digits to base 6, of which toast 0's station is the lowest.
    """

    travel_s: Floats
    processing_s: Floats
    spread: float
    banned: NDArray[np.bool_]


class ListingRules(NamedTuple):
    """How a session learns: the method's index, the reward factor's type with a and b, and the fields of `Reading`."""

    method: int
    type_a: bool
    a: float
    b: float
    phantoms: bool
    null_moves: bool
    last_of_ties: bool
    averages: bool
    frees_by_place: bool


class Workspace(NamedTuple):
    """The arrays of a session.

    values, counts (of all visits), visits (of the episode's) and seen (the states of the episode) (6 ** K,); place and
    ready_s (K,) of the toasts, busy (6,) of the stations; toast and following (2 K,) of the options; clock (1,) [s];
    whole (4,); stream (1,) of random numbers; moved (5 K,): the toasts moved in the episode, from 1, then zeros.
    """

    values: Floats
    counts: Ints
    visits: Ints
    seen: Ints
    place: Ints
    ready_s: Floats
    busy: NDArray[np.bool_]
    toast: Ints
    following: Ints
    clock: Floats
    whole: Ints
    stream: NDArray[np.uint64]
    moved: Ints


class ListingOutcomes(NamedTuple):
    """The results of N sessions of E episodes.

    times_s (N, E) [s], of one session unless all are kept; best_s and last_s (N,): the best time and that of the last
    episode [s]; converged (N,): the first episode from which the time stays the same; sequences (N, 5 K): the toasts
    moved in the best episode, from 1, then zeros.
    """

    times_s: Floats
    best_s: Floats
    last_s: Floats
    converged: Ints
    sequences: Ints


@without_refcounts
def _uniform(work: Any) -> float:
    """The next number in [0, 1) of the stream (`splitmix.stream`)."""
    work.stream[0] = _following(work.stream[0])
    return float(_fraction(_mixed(work.stream[0])))


@without_refcounts
def processing_s(toasts: Any, work: Any, machine: int) -> float:
    """A random processing time [s], which may be negative, as in the listing. Source: Box and Muller 1958."""
    mean_s = toasts.processing_s[machine]
    if toasts.spread == 0.0:
        return float(mean_s)
    u, v = _uniform(work), _uniform(work)
    return float(mean_s * (1.0 + toasts.spread * sqrt(-2.0 * log(1.0 - u)) * cos(2.0 * pi * v)))


@without_refcounts
def _target(work: Any, origin: int) -> int:
    """The station to which a toast goes from another one: the machine ahead if it is free, else its buffer."""
    if origin == APPLIER:
        return DONE
    machine = TOASTER if origin < TOASTER else APPLIER
    return machine - 1 if work.busy[machine] else machine


@without_refcounts
def reset(work: Any) -> None:
    """Prepare the workspace for an episode."""
    for toast in range(len(work.place)):
        work.place[toast], work.ready_s[toast] = PLATE, 0.0
    for n in range(work.whole[SEEN]):
        work.visits[work.seen[n]] = 0
    work.busy[:], work.moved[:], work.clock[0] = False, 0, 0.0
    work.whole[ROBOT], work.whole[STATE], work.whole[SEEN], work.whole[MOVED] = TOASTER_BUFFER, 0, 0, 0


@without_refcounts
def carry(toasts: Any, rules: Any, work: Any, toast: int) -> None:
    """Let the robot go to a toast, wait for its processing, and carry it ahead, or leave it there in a null move."""
    origin = work.place[toast]
    target = _target(work, origin)
    reach_s = work.clock[0] + toasts.travel_s[work.whole[ROBOT], origin]
    work.clock[0] = max(reach_s, work.ready_s[toast]) + toasts.travel_s[origin, target]
    work.place[toast] = work.whole[ROBOT] = target
    if target in (TOASTER, APPLIER):
        work.busy[target] = True
        work.ready_s[toast] = work.clock[0] + processing_s(toasts, work, target)
    if target == DONE:
        work.busy[APPLIER] = False
    elif (rules.frees_by_place and target >= BUTTER_BUFFER) or origin == TOASTER:
        work.busy[TOASTER] = False
    if target != origin:
        work.moved[work.whole[MOVED]] = toast + 1
        work.whole[MOVED] += 1
        work.whole[STATE] += (target - origin) * STATIONS**toast


@without_refcounts
def _visit(work: Any) -> None:
    state = work.whole[STATE]
    if work.visits[state] == 0:
        work.seen[work.whole[SEEN]] = state
        work.whole[SEEN] += 1
    work.visits[state] += 1


@without_refcounts
def list_options(toasts: Any, rules: Any, work: Any) -> int:
    """The number of next states that may be chosen; they are listed by toast, the nearer station first."""
    count, state, weight = 0, work.whole[STATE], 1
    for toast in range(len(work.place)):
        digit, weight = weight, weight * STATIONS
        place = work.place[toast]
        first, last = place + 1, min(place + 2, DONE)
        stays = place < DONE and _target(work, place) == place
        if stays and not (rules.phantoms and rules.null_moves):
            continue
        if not rules.phantoms and place < DONE:
            first = last = _target(work, place)
        for station in range(first, last + 1):
            following = state + (station - place) * digit
            if not toasts.banned[following]:
                work.toast[count], work.following[count] = toast, following
                count += 1
    return count


@without_refcounts
def _choose(rules: Any, work: Any, count: int, epsilon: float) -> int:
    """The toast of the chosen option, random with probability epsilon."""
    if _uniform(work) <= epsilon:
        return int(work.toast[int(_uniform(work) * count)])
    best, ties, chosen = -inf, 0, 0
    for i in range(count):
        value = work.values[work.following[i]]
        if value > best:
            best, ties, chosen = value, 1, i
        elif value == best:
            ties, chosen = ties + 1, i
    if ties > 1 and not rules.last_of_ties:
        rank = int(_uniform(work) * ties)
        for i in range(count):
            if work.values[work.following[i]] == best:
                if rank == 0:
                    return int(work.toast[i])
                rank -= 1
    return int(work.toast[chosen])


@without_refcounts
def _episode(toasts: Any, rules: Any, work: Any, epsilon: float) -> float:
    """Carry out an episode with the step update of SRL; return its time [s], LATEST_S if it does not end."""
    reset(work)
    goal, toast = len(toasts.banned) - 1, 0  # the first move is always that of the first toast
    for _ in range(MOST_MOVES):
        before = work.whole[STATE]
        carry(toasts, rules, work, toast)
        state = work.whole[STATE]
        _visit(work)
        if rules.method == SRL:
            work.values[before] += ALPHA * (DISCOUNT * work.values[state] - work.values[before])
        if state == goal:
            if rules.method == SRL:
                work.values[goal] = GOAL_REWARD + DISCOUNT * work.values[goal]
            return float(work.clock[0])
        count = list_options(toasts, rules, work)
        if count == 0 or work.clock[0] >= LATEST_S:
            break
        toast = _choose(rules, work, count, epsilon)
    return LATEST_S


@without_refcounts
def learn(rules: Any, work: Any, time_s: float, best_s: float) -> None:
    """Update the values of the visited states, without the start, by the time of an episode, once for each visit."""
    gain = 1.0 / time_s
    factor = 1.0 / (time_s - best_s + rules.a) + rules.b if rules.type_a else gain
    for n in range(work.whole[SEEN]):
        state = work.seen[n]
        visits = work.visits[state]
        if rules.method == SRL:
            for _ in range(visits):
                work.values[state] *= factor
        elif rules.method == MONTE_CARLO and rules.averages:
            before = work.counts[state] * work.values[state]
            work.counts[state] += visits
            work.values[state] = (before + visits * gain) / work.counts[state]
        elif rules.method == MONTE_CARLO:
            work.values[state] = gain


@without_refcounts
def run_sessions(toasts: Any, rules: Any, work: Any, epsilons: Any, seeds: Any, outcomes: Any) -> None:
    """Run a session for each seed (N,) with exploration epsilons (E,), and write their results to `outcomes`."""
    for n in range(len(seeds)):
        row, best_s = n % len(outcomes.times_s), inf
        work.values[:], work.counts[:], work.stream[0] = 1.0, 0, seeds[n]
        for episode in range(len(epsilons)):
            time_s = _episode(toasts, rules, work, epsilons[episode])
            if time_s < best_s:
                best_s = time_s
                for m in range(len(work.moved)):
                    outcomes.sequences[n, m] = work.moved[m]
            if episode > 0 and time_s != outcomes.times_s[row, episode - 1]:
                outcomes.converged[n] = episode + 1
            outcomes.times_s[row, episode] = time_s
            learn(rules, work, time_s, best_s)
        outcomes.best_s[n], outcomes.last_s[n] = best_s, outcomes.times_s[row, len(epsilons) - 1]
