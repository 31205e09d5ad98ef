"""The fitness of a policy for a problem that it was not learned in, judged from its table, without running anything.

The moves that a policy has tried have the same outcomes wherever the problem has not changed. A warm start replays these moves
by value iteration, so that the values of all cells reflect a change before the first step is made.
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

TOLERATED = 0.25  # mean moves above the shortest over several starts: as many as after learning from nothing
MOST_JUDGED = 64  # the most policies that are judged for a problem
MOST_WARMED = 8  # the most of these whose warm starts are judged
DISCOUNT = 0.99
_ORDER = ("use", "adapt", "refuse")


@dataclass(frozen=True)
class Fitness:
    """The fitness of a policy for a problem.

    verdict: "use", "adapt" or "refuse"; reason: in words.
    coverage: the share of the reachable nonterminal states in which the policy has made a move.
    reached: the share of the starts from which its greedy path reaches the goal; worst, mean: how many moves these paths have
    above the shortest, None if there are none.
    value: its highest action value in the start.
    changed: the number of states that are terminal, goal or neither in another way than where it was learned, None for a table of
    another size.
    warm: `reached` of its warm start, None if that was not judged.
    moves, fewest: the length of its path from the problem's start, None if it misses the goal, and of the shortest path.
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
        """A sort key; the smaller it is, the better the policy fits."""
        extra_moves = self.mean if self.verdict == "use" and self.mean is not None else 0.0
        return _ORDER.index(self.verdict), extra_moves, -(self.warm or 0.0), -self.reached, self.changed or 0


@dataclass(frozen=True, eq=False)
class Measure:
    """The properties of a problem that policies are judged by.

    kinds: (S,) uint8, as `Policy.ends`; moves: (S,) int32, the fewest to a goal, -1 if there is no path; met: (S,) bool, the
    reachable nonterminal states; starts: (N,) int32.
    """

    kinds: KindArray
    moves: IntArray
    met: BoolArray
    starts: IntArray


@lru_cache(maxsize=64)
def measure_of(mdp: TabularMDP) -> Measure:
    """The measure of a problem, computed once."""
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
    """(ends, moves), (S,) each: the state in which the greedy path from each state ends, and its length.

    Ties go to the lowest action, as in `greedy_path`. The end of a path that loops is a nonterminal state.
    """
    here = np.arange(mdp.n_states)
    entered = np.where(mdp.terminal, here, mdp.successor[here, q.argmax(axis=1)])
    moves = (~mdp.terminal).astype(np.int64)
    span = 1
    while span < mdp.n_states:  # doubles the length of the paths
        moves, entered, span = np.minimum(moves + moves[entered], mdp.n_states), entered[entered], 2 * span
    return entered.astype(np.int32), moves


def comparable(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy's table has the states and actions of a problem, so that its fitness can be judged."""
    same_size = policy.q.shape == mdp.successor.shape and policy.shape == mdp.shape
    return same_size and policy.action_labels == mdp.action_labels


def judged(policy: Policy, mdp: TabularMDP, discount: float = DISCOUNT) -> Fitness:
    """The fitness of a policy for a problem: it is reused, fine-tuned ("adapt") or refused.

    It is reused if its paths from all starts are free and shortest (with several starts, within TOLERATED in the mean), so that
    learning from nothing would give nothing better. It is refused if its table has other states or actions, or if start or goal
    have moved and neither it nor its warm start reaches the goal, because a warm start is then no faster.
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
    """The fitness by the greedy paths alone: "use", otherwise "adapt", whether or not that is worthwhile."""
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
    """Why a path misses the goal, in words: where it ends."""
    path = "its path" if len(known.starts) == 1 else f"its path from {missing} of {len(known.starts)} starts"
    if known.kinds[end] == OUT:
        return f"{path} meets what is in the way at {mdp.state_label(end)}"
    return f"{path} goes round in circles at {mdp.state_label(end)}"


def warm_start(policy: Policy, mdp: TabularMDP, discount: float = DISCOUNT) -> FloatArray:
    """The start values (S, A) for fine-tuning, by value iteration over the policy's moves between unchanged states.

    A move into a state that is now terminal has the problem's reward as its value, because the survey has seen that state. All
    other moves have the value 0, as if they had never been made.
    """
    as_it_was = measure_of(mdp).kinds == policy.ends
    kept = (policy.visits > 0) & as_it_was[:, None] & as_it_was[mdp.successor] & ~mdp.terminal[:, None]
    seen = ~as_it_was[mdp.successor] & mdp.terminal[mdp.successor] & ~mdp.terminal[:, None]
    return known_values(mdp, kept, np.where(seen, mdp.reward, 0.0), discount)


def _has_moved(policy: Policy) -> BoolArray:
    """The states in which the policy has made a move, (S,) bool."""
    moved: BoolArray = policy.visits.max(axis=1) > 0
    return moved


def best_fit(policies: Iterable[Policy], mdp: TabularMDP, discount: float = DISCOUNT) -> tuple[Policy, Fitness] | None:
    """The comparable policy that fits best, with its fitness; None if there is none.

    policies: the most promising first. The search ends at the first one whose paths are all shortest; at most MOST_JUDGED are
    judged, and the warm starts of MOST_WARMED.
    """
    candidates: list[tuple[Policy, Fitness]] = []
    for policy in policies:
        if not comparable(policy, mdp):
            continue
        fitness = behaviour(policy, mdp)
        candidates.append((policy, fitness))
        if (fitness.verdict == "use" and not fitness.mean) or len(candidates) == MOST_JUDGED:
            break
    usable = [candidate for candidate in candidates if candidate[1].verdict == "use"]
    if not usable:
        nearest = sorted(candidates, key=lambda candidate: candidate[1].rank)[:MOST_WARMED]
        usable = [(policy, judged(policy, mdp, discount)) for policy, _ in nearest]
    return min(usable, key=lambda candidate: candidate[1].rank, default=None)


def reference(policy: Policy) -> str:
    """The reference to a policy in the `parent` of others: "name@hash"."""
    return f"{policy.name}@{hash_of(deferred.encode(policy))}"
