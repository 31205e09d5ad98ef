"""Ways composed of shorter ones: a table for a new problem, from the moves that policies of other problems made.

Where nothing has changed, a move has the same outcome whatever start and goal it was made for. So the moves of several policies
make one graph, and the shortest path through it changes from one policy's way to another's in states that both have been in, such
as doorways. Source: Sutton, Precup and Singh, Between MDPs and semi-MDPs, Artificial Intelligence 1999 (planning over options).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from lab.errors import counted
from lab.learning.session_result import CountArray
from lab.learning.values import known_values
from lab.mdp import BoolArray, FloatArray, TabularMDP, greedy_path
from lab.toolbox.fitness import DISCOUNT, MOST_JUDGED, comparable, measure_of
from lab.toolbox.policy import OUT, Policy


@dataclass(frozen=True, eq=False)
class Composition:
    """What the moves of several policies make for a problem.

    q: (S, A) float64, their action values; visits: (S, A) int64, how often each move was made.
    parts: (policy, moves) of the path from the start to the goal, () if they do not lead there.
    """

    q: FloatArray
    visits: CountArray
    parts: tuple[tuple[Policy, int], ...]

    @property
    def reason(self) -> str:
        """The parts in words."""
        if not self.parts:
            return "the moves of others, which do not lead to the goal yet"
        return "a path by " + ", then ".join(f"'{part.name}' ({counted(moves, 'move')})" for part, moves in self.parts)


def composed(policies: Iterable[Policy], mdp: TabularMDP, discount: float = DISCOUNT) -> Composition | None:
    """The composition of the first MOST_JUDGED policies for a problem with one start; None if none of their moves counts there.

    A move counts if the states that it connects are as free, or as blocked, as where it was made. All others have the value of
    moving for ever, so that the path keeps to moves that were made.
    """
    fitting = [policy for policy in islice(policies, MOST_JUDGED) if comparable(policy, mdp)]
    made = [(policy, moves) for policy in fitting if (moves := _made(policy, mdp)).any()]
    if mdp.starts or not made:
        return None
    visits = np.sum([np.where(moves, policy.visits, 0) for policy, moves in made], axis=0)
    known = (visits > 0) | mdp.terminal[:, None]
    for_ever = float(mdp.reward.min()) / (1.0 - discount)
    q = known_values(mdp, known, np.full(mdp.successor.shape, for_ever), discount)
    states, actions, reached = greedy_path(q, mdp, mdp.n_states)
    is_known = reached and bool(known[states[:-1], actions].all())
    parts = _parts(states, actions, made) if is_known else ()
    return Composition(q, visits, parts)


def _made(policy: Policy, mdp: TabularMDP) -> BoolArray:
    """The moves (S, A) of a policy that count in this problem."""
    same = (policy.ends == OUT) == (measure_of(mdp).kinds == OUT)
    made: BoolArray = (policy.visits > 0) & same[:, None] & same[mdp.successor] & ~mdp.terminal[:, None]
    return made


def _parts(
    states: list[int], actions: list[int], made: list[tuple[Policy, BoolArray]]
) -> tuple[tuple[Policy, int], ...]:
    """A path in as few parts as can be, each of which one policy has made."""
    parts: list[tuple[Policy, int]] = []
    at = 0
    while at < len(actions):
        tried = [moves[states[at:-1], actions[at:]] for _, moves in made]
        runs = [len(own) if own.all() else int(own.argmin()) for own in tried]
        longest = int(np.argmax(runs))
        parts.append((made[longest][0], runs[longest]))
        at += runs[longest]
    return tuple(parts)
