"""Whether a policy fits a problem that it was not learned in: judged from its table, before anything is run.

A policy has tried moves, and where they led holds as long as nothing changed there. A warm start goes through these moves
again in thought, so that the values of all cells know of a change before the first step is made.
Source: R. S. Sutton, Integrated architectures for learning, planning, and reacting (Dyna), ICML 1990.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lab.errors import counted
from lab.learning.values import fewest_moves, known_values
from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP
from lab.toolbox import deferred
from lab.toolbox.names import hash_of
from lab.toolbox.policy import GOAL, ON, OUT, Policy

Verdict = Literal["use", "adapt", "refuse"]
KindArray = NDArray[np.uint8]

TOLERATED = 0.25  # moves above the shortest, mean over several starts: what is learned from nothing has up to as many
MOST_JUDGED = 64  # policies that are looked at for one problem
MOST_WARMED = 8  # of these whose warm start is looked at
DISCOUNT = 0.99
_ORDER = ("use", "adapt", "refuse")


@dataclass(frozen=True)
class Fitness:
    """What a policy would come to in a problem, and why.

    coverage: of the states that go on and can be reached there, the share in which it has made a move; reached: the share of
    the starts from which its greedy steps reach the goal; worst, mean: how many moves above the shortest these ways take,
    None where none reaches it; value: its highest action value in the start, the feasibility score; changed: how many states
    go on or end otherwise than where it was learned, None for another table's size; warm: `reached` of its warm start,
    None where that was not looked at; moves: of its path from the problem's start, None where it misses the goal, fewest: of the
    shortest way.
    """

    verdict: Verdict
    reason: str
    coverage: float = 0.0
    reached: float = 0.0
    worst: int | None = None
    mean: float | None = None
    value: float = 0.0
    changed: int | None = None
    warm: float | None = None
    moves: int | None = None
    fewest: int | None = None

    @property
    def rank(self) -> tuple[float, ...]:
        """The smaller, the better it fits."""
        way = self.mean if self.verdict == "use" and self.mean is not None else 0.0
        return _ORDER.index(self.verdict), way, -(self.warm or 0.0), -self.reached, self.changed or 0


@dataclass(frozen=True, eq=False)
class Measure:
    """What any policy is held against in a problem.

    kinds (S,) uint8: as `Policy.ends`; moves (S,) int32: the fewest to a goal, -1 where no way leads there; met (S,) bool:
    the states that go on and can be reached from a start; starts (N,) int32.
    """

    kinds: KindArray
    moves: IntArray
    met: BoolArray
    starts: IntArray


@lru_cache(maxsize=64)
def measure_of(mdp: TabularMDP) -> Measure:
    """Found once for each problem."""
    starts = np.array(mdp.starts or (mdp.start,), np.int32)
    fewest = fewest_moves(mdp)
    met = np.zeros(mdp.n_states, np.bool_)
    entered = starts
    while entered.size:
        met[entered] = True
        entered = np.unique(mdp.successor[entered])
        entered = entered[~met[entered] & ~mdp.terminal[entered]]
    kinds = np.where(mdp.goal, GOAL, np.where(mdp.terminal, OUT, ON)).astype(np.uint8)
    return Measure(kinds, np.where(np.isfinite(fewest), fewest, -1).astype(np.int32), met, starts)


def followed(q: FloatArray, mdp: TabularMDP) -> tuple[IntArray, NDArray[np.int64]]:
    """Where greedy steps from each state end (S,), and after how many moves (S,): all states at once.

    As `greedy_path`: ties go to the lowest action. Who goes round in circles ends in a state that goes on.
    """
    here = np.arange(mdp.n_states)
    entered = np.where(mdp.terminal, here, mdp.successor[here, q.argmax(axis=1)])
    moves = (~mdp.terminal).astype(np.int64)
    span = 1
    while span < mdp.n_states:  # each time ways twice as long
        moves, entered, span = np.minimum(moves + moves[entered], mdp.n_states), entered[entered], 2 * span
    return entered.astype(np.int32), moves


def comparable(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy's table has a problem's states and moves: all that a candidate needs."""
    same_size = policy.q.shape == mdp.successor.shape and policy.shape == mdp.shape
    return same_size and policy.action_labels == mdp.action_labels


def judged(policy: Policy, mdp: TabularMDP, discount: float = DISCOUNT) -> Fitness:
    """Whether a policy is to be used in a problem as it is, to be learned on from, or refused; nothing is run.

    Used only where its paths from all starts are free and shortest (from several starts: within TOLERATED in the mean),
    so that learning from nothing would give nothing better. Refused where its table has other states or moves, or where it
    knows no way although start or goal are others than its own: its warm start is then no faster than none.
    """
    if not comparable(policy, mdp):
        return Fitness("refuse", "its table has other states or moves")
    fitness = behaviour(policy, mdp)
    if fitness.verdict == "use":
        return fitness
    known = measure_of(mdp)
    ahead, _ = followed(warm_start(policy, mdp, discount), mdp)
    warm = float((known.kinds[ahead[known.starts]] == GOAL).mean())
    same_goal = bool(((policy.ends == GOAL) == mdp.goal).all())
    if max(warm, fitness.reached) > 0.0 or (same_goal and _has_moved(policy)[known.starts].any()):
        return replace(fitness, warm=warm)
    other = "start" if same_goal else "goal"
    why = f"{fitness.reason}; the {other} is not where it was, and it knows no path from here to there"
    return replace(fitness, verdict="refuse", reason=why, warm=warm)


def behaviour(policy: Policy, mdp: TabularMDP) -> Fitness:
    """What its greedy steps come to: "use", or else "adapt", whether or not that is worth it."""
    known = measure_of(mdp)
    end, moves = followed(policy.q, mdp)
    arrived = known.kinds[end[known.starts]] == GOAL
    above = (moves - known.moves)[known.starts][arrived]
    changed = int((policy.ends != known.kinds).sum())
    is_free = bool(arrived.all())
    fits = is_free and float(above.mean()) <= (TOLERATED if len(above) > 1 else 0.0)
    if fits:
        reason = _praise(above)
    elif is_free:
        reason = f"its path is free, but {counted(int(above.max()), 'move')} longer than the shortest"
    else:
        reason = _fault(int(end[known.starts][~arrived][0]), known, mdp, len(known.starts) - int(arrived.sum()))
    if not fits:
        reason += f"; {changed} of {counted(mdp.n_states, 'state')} changed"
    return Fitness(
        "use" if fits else "adapt",
        reason,
        coverage=float(_has_moved(policy)[known.met].mean()),
        reached=float(arrived.mean()),
        worst=int(above.max()) if len(above) else None,
        mean=float(above.mean()) if len(above) else None,
        value=float(policy.q[mdp.start].max()),
        changed=changed,
        moves=int(moves[mdp.start]) if known.kinds[end[mdp.start]] == GOAL else None,
        fewest=int(known.moves[mdp.start]),
    )


def _praise(above: NDArray[np.int64]) -> str:
    if len(above) == 1:
        return "its path is free and shortest"
    if not above.any():
        return f"its paths from all {len(above)} starts are free and shortest"
    return f"its paths from all {len(above)} starts are free, in the mean {above.mean():.2g} moves above the shortest"


def _fault(end: int, known: Measure, mdp: TabularMDP, missing: int) -> str:
    """Where the policy's path from a start ends that does not reach the goal."""
    path = "its path" if len(known.starts) == 1 else f"its path from {missing} of {len(known.starts)} starts"
    if known.kinds[end] == OUT:
        return f"{path} meets what is in the way at {mdp.state_label(end)}"
    return f"{path} goes round in circles at {mdp.state_label(end)}"


def warm_start(policy: Policy, mdp: TabularMDP, discount: float = DISCOUNT) -> FloatArray:
    """The table (S, A) to learn on from: what the policy has tried and what has not changed, gone through again.

    A move that it made between two states that are as they were leads where it led; all values along such moves are found
    anew, by value iteration over them. A move into a state that now ends an episode is worth what the problem says of it: the
    survey has seen it. Any other move counts as never made: 0, as at the beginning.
    """
    as_it_was = measure_of(mdp).kinds == policy.ends
    kept = (policy.visits > 0) & as_it_was[:, None] & as_it_was[mdp.successor] & ~mdp.terminal[:, None]
    seen = ~as_it_was[mdp.successor] & mdp.terminal[mdp.successor] & ~mdp.terminal[:, None]
    return known_values(mdp, kept, np.where(seen, mdp.reward, 0.0), discount)


def _has_moved(policy: Policy) -> BoolArray:
    """Whether the policy was learned with a move in each state, (S,)."""
    moved: BoolArray = policy.visits.max(axis=1) > 0
    return moved


def best_fit(policies: Iterable[Policy], mdp: TabularMDP, discount: float = DISCOUNT) -> tuple[Policy, Fitness] | None:
    """Of comparable policies, the most promising first, the one that fits best; None where there is none.

    The first whose ways are all shortest ones ends the search; MOST_JUDGED are looked at, and the warm start of MOST_WARMED.
    """
    found: list[tuple[Policy, Fitness]] = []
    for policy in policies:
        if not comparable(policy, mdp):
            continue
        fitness = behaviour(policy, mdp)
        found.append((policy, fitness))
        if (fitness.verdict == "use" and not fitness.mean) or len(found) == MOST_JUDGED:
            break
    usable = [one for one in found if one[1].verdict == "use"]
    if not usable:
        nearest = sorted(found, key=lambda one: one[1].rank)[:MOST_WARMED]
        usable = [(policy, judged(policy, mdp, discount)) for policy, _ in nearest]
    return min(usable, key=lambda one: one[1].rank, default=None)


def reference(policy: Policy) -> str:
    """What another policy's `parent` calls this one: name@hash."""
    return f"{policy.name}@{hash_of(deferred.encode(policy))}"
