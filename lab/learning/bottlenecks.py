"""Bottlenecks of a problem, such as doorways, found in the moves that a learner has made: no map and no reward is needed.

A method (`METHODS`) proposes states; a common rule then keeps those that part their surroundings in two (`_parts`). Sources:
betweenness: Şimşek and Barto, Skill characterization based on betweenness, NIPS 2008; spectral: Şimşek, Wolfe and Barto,
Identifying useful subgoals by local graph partitioning, ICML 2005, with the Fiedler vector (Shi and Malik 2000) for the cut;
paths: McGovern and Barto, Automatic discovery of subgoals using diverse density, ICML 2001, as the share of successful paths.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np

from lab.errors import unknown
from lab.lazy import networkx, scipy
from lab.learning.environment import Step, TableEnvironment
from lab.learning.selection import Draw
from lab.mdp import BoolArray, IntArray, TabularMDP

RADIUS = 6  # moves around a state within which another way around it counts
LEAST_SIDE = 3  # states on each side of a bottleneck
CLOSE = 2  # moves between states of one bottleneck
MOST_CUTS = 40  # of the spectral method
DENSE = 400  # states, above which the sparse solver finds the Fiedler vector

Bottleneck = tuple[int, ...]  # its states, in rising order
Neighbours = Mapping[int, set[int]]


class Experience:
    """The moves that a learner has made in a deterministic problem of S states and A actions.

    entered: (S, A) int32, the state that each move led to, -1 if it was never made; counts: (S, A) int64, how often it was.
    lost: (S,) bool, the entered states that ended an episode without reaching the goal; paths: the states of each episode that
    reached the goal, in order.
    """

    def __init__(self, n_states: int, n_actions: int) -> None:
        self.entered: IntArray = np.full((n_states, n_actions), -1, np.int32)
        self.counts = np.zeros((n_states, n_actions), np.int64)
        self.lost: BoolArray = np.zeros(n_states, np.bool_)
        self.paths: list[list[int]] = []
        self._now: list[int] = []

    @property
    def moves(self) -> int:
        """The number of all moves."""
        return int(self.counts.sum())

    def begins(self, state: int) -> None:
        """Record the first state of an episode."""
        self._now = [state]

    def moved(self, state: int, action: int, step: Step) -> None:
        """Record a move, and keep the path if it reached the goal."""
        self.entered[state, action] = step.state
        self.counts[state, action] += 1
        self._now.append(step.state)
        if step.reached:
            self.paths.append(self._now)
        elif step.terminated:
            self.lost[step.state] = True

    def neighbours(self) -> dict[int, set[int]]:
        """The states that are one made move apart, in either direction; states that ended an episode in failure are left out."""
        near: dict[int, set[int]] = {}
        made = np.argwhere(self.entered >= 0)
        for state, action in made.tolist():
            other = int(self.entered[state, action])
            if not self.lost[other]:
                near.setdefault(state, set())
                near.setdefault(other, set())
                if state != other:
                    near[state].add(other)
                    near[other].add(state)
        return near


class RecordedTable(TableEnvironment):
    """The environment of a table, which records each move in an `Experience`.

    walled: (S, A) bool, the moves that the table only stands in for, which are not recorded; None: none.
    """

    def __init__(self, mdp: TabularMDP, experience: Experience, walled: BoolArray | None = None) -> None:
        super().__init__(mdp)
        self.experience, self.walled = experience, walled

    def reset(self, episode: int, draw: Draw) -> int:
        """The state in which the episode begins."""
        state = super().reset(episode, draw)
        self.experience.begins(state)
        return state

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome that the table holds."""
        step = super().step(state, action, draw)
        if self.walled is None or not self.walled[state, action]:
            self.experience.moved(state, action, step)
        return step


def bottlenecks(experience: Experience, method: str = "betweenness") -> list[Bottleneck]:
    """The bottlenecks in the moves made, those with the highest score of the method first; the same moves give the same list.

    Raises BadInput for an unknown method.
    """
    if method not in METHODS:
        raise unknown("method", method, METHODS, "--method")
    near = experience.neighbours()
    scores, proposed = METHODS[method](experience, near)
    kept: list[tuple[float, Bottleneck]] = []
    taken: set[int] = set()
    for group in sorted(proposed, key=lambda states: (-max(scores[s] for s in states), states)):
        narrowest = _narrowest(group, near, scores)
        if narrowest is not None and not taken.intersection(narrowest):
            kept.append((max(scores[state] for state in narrowest), narrowest))
            taken.update(_within(near, narrowest, CLOSE - 1))
    return [group for _, group in sorted(kept, key=lambda one: (-one[0], one[1]))]


# ---- the methods: the score of each state, and the groups of states that they propose -------------------------------------

Proposed = tuple[Mapping[int, float], list[Bottleneck]]


def betweenness(experience: Experience, near: Neighbours) -> Proposed:
    """States through which more shortest paths lead than through each of their neighbours."""
    scores = _betweenness(near)
    return scores, _proposed(scores, near)


def spectral(experience: Experience, near: Neighbours) -> Proposed:
    """The ends of the cheapest normalized cuts of the graph and, cut by cut, of its parts."""
    scores, groups = _betweenness(near), []
    parts = [sorted(part) for part in networkx.connected_components(_graph(near))]
    for _ in range(MOST_CUTS):
        parts = sorted((part for part in parts if len(part) > 2 * LEAST_SIDE), key=lambda part: (len(part), part))
        if not parts:
            break
        part = parts.pop()
        inside = set(part)
        low = _cheaper_side(part, near)
        ends = [(a, b) for a in sorted(low) for b in sorted(near[a] & (inside - low))]
        # of both ends of each cut move, the one with fewer neighbours: a doorway has two
        cut = {min(pair, key=lambda state: (len(near[state]), -scores[state], state)) for pair in ends}
        group = tuple(sorted(cut))
        if _narrowest(group, near, scores) is not None:
            groups.append(group)
            parts += [sorted(low), sorted(inside - low)]
        elif len(part) > 4 * LEAST_SIDE:  # the cut leads through open floor, but a part may have a bottleneck
            parts += [sorted(low), sorted(inside - low)]
    return scores, groups


def paths(experience: Experience, near: Neighbours) -> Proposed:
    """States on more of the successful paths, without their loops, than each of their neighbours."""
    scores = dict.fromkeys(near, 0.0)
    for path in experience.paths:
        for state in _without_loops(path)[1:-1]:
            scores[state] += 1.0 / len(experience.paths)
    return scores, _proposed(scores, near)


METHODS: dict[str, Callable[[Experience, Neighbours], Proposed]] = {
    "betweenness": betweenness,
    "spectral": spectral,
    "paths": paths,
}


def _graph(near: Neighbours) -> "networkx.Graph":
    graph = networkx.Graph()
    graph.add_nodes_from(sorted(near))
    graph.add_edges_from((a, b) for a in sorted(near) for b in sorted(near[a]) if a < b)
    return graph


def _betweenness(near: Neighbours) -> dict[int, float]:
    scores: dict[int, float] = networkx.betweenness_centrality(_graph(near))
    return {state: round(score, 12) for state, score in scores.items()}


def _proposed(scores: Mapping[int, float], near: Neighbours) -> list[Bottleneck]:
    """The peaks of the scores: those among all states, in groups, and those among the states that part their surroundings.

    The latter are needed because the floor between two doorways may have a higher score than either.
    """
    parting = {state for state in sorted(near) if scores[state] > 0 and _parts((state,), near)}
    return [*_joined(_peaks(scores, near, set(near)), near), *((state,) for state in _peaks(scores, near, parting))]


def _peaks(scores: Mapping[int, float], near: Neighbours, among: set[int]) -> list[int]:
    """The states among these whose score is above 0 and at least that of each of their neighbours among these."""
    return [s for s in sorted(among) if scores[s] > 0 and all(scores[s] >= scores[other] for other in near[s] & among)]


def _joined(states: Iterable[int], near: Neighbours) -> list[Bottleneck]:
    """The states, those at most CLOSE moves apart in one group: a doorway that is crossed in several states is one."""
    left, groups = set(states), []
    while left:
        group, frontier = set[int](), {min(left)}
        while frontier:
            group |= frontier
            frontier = (_within(near, frontier, CLOSE) & left) - group
        left -= group
        groups.append(tuple(sorted(group)))
    return groups


def _cheaper_side(part: Sequence[int], near: Neighbours) -> set[int]:
    """One side of the cheapest normalized cut among those along the Fiedler vector of a connected part of the graph."""
    place = {state: n for n, state in enumerate(part)}
    links = np.array([(place[a], place[b]) for a in part for b in near[a] if b in place])
    size = len(part)
    weights = scipy.sparse.coo_array((np.ones(len(links)), links.T), shape=(size, size)).tocsr()
    laplacian, degree = scipy.sparse.csgraph.laplacian(weights, normed=True, return_diag=True)
    if size <= DENSE:
        vector = scipy.linalg.eigh(laplacian.toarray(), subset_by_index=[1, 1])[1][:, 0]
    else:
        first = np.sin(1.0 + np.arange(size))  # any vector that is none of the others
        vector = scipy.sparse.linalg.eigsh(laplacian, 2, sigma=-1e-3, v0=first)[1][:, 1]
    vector = np.round(vector / degree, 9)
    vector *= np.sign(vector[np.flatnonzero(vector)[0]]) if vector.any() else 1.0
    order = np.argsort(vector, kind="stable")
    low, best, cost, volume, cut = set[int](), set[int](), np.inf, 0, 0
    total = sum(len(near[state] & place.keys()) for state in part)
    for n, at in enumerate(order[:-1].tolist(), start=1):
        state = part[at]
        inside = near[state] & place.keys()
        cut += len(inside) - 2 * len(inside & low)
        volume += len(inside)
        low.add(state)
        now = cut / volume + cut / (total - volume)
        if now < cost and n >= LEAST_SIDE and size - n >= LEAST_SIDE:
            best, cost = set(low), now
    return best


def _without_loops(path: Sequence[int]) -> list[int]:
    seen: dict[int, int] = {}
    kept: list[int] = []
    for state in path:
        if state in seen:
            for dropped in kept[seen[state] + 1 :]:
                del seen[dropped]
            del kept[seen[state] + 1 :]
        else:
            seen[state] = len(kept)
            kept.append(state)
    return kept


# ---- the common rule ------------------------------------------------------------------------------------------------------


def _within(near: Neighbours, states: Collection[int], radius: int) -> set[int]:
    """The states at most `radius` moves from one of `states`, themselves included."""
    reached = frontier = set(states)
    for _ in range(radius):
        frontier = {other for state in frontier for other in near[state]} - reached
        reached = reached | frontier
    return reached


def _parts(group: Collection[int], near: Neighbours) -> bool:
    """Whether these states are narrow, and without them those within RADIUS moves fall apart.

    Two pieces need LEAST_SIDE states, and twice the square of the number of states in the group: a line across a square room has
    no more than half of that behind it. Where the only way around is longer than RADIUS, as by another doorway, the states are a
    bottleneck all the same.
    """
    left, sizes = _within(near, group, RADIUS) - set(group), [0, 0]
    while left:
        piece = frontier = {left.pop()}
        while frontier:
            frontier = ({other for state in frontier for other in near[state]} & left) - piece
            piece = piece | frontier
        left -= piece
        sizes.append(len(piece))
    return sorted(sizes)[-2] >= max(LEAST_SIDE, 2 * len(group) ** 2)


def _narrowest(group: Bottleneck, near: Neighbours, scores: Mapping[int, float]) -> Bottleneck | None:
    """The group, or beside it the single state with the fewest neighbours, whichever parts its surroundings; None if neither."""
    around = sorted(_within(near, group, 1))
    single = [state for state in around if _parts((state,), near)]
    if single:
        return (min(single, key=lambda state: (len(near[state]), -scores[state], state)),)
    return group if _parts(group, near) else None
