"""The compiled sessions with tile coding, on a table or in a continuous world.

Sessions run one after the other, so that the weights stay in the processor's cache; each equals `session.Session` with the same
uniform numbers. Gates and advisor are those of `asking`, which sees this session as lane 0.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import selection, tiles
from lab.learning.compiled import inlined, inner, without_refcounts
from lab.learning.kernels.asking import decided, judge, opens
from lab.learning.kernels.learners import draw, greedy
from lab.learning.physics import ACROBOT, MOUNTAIN_CAR, acrobot, cart_pole, mountain_car
from lab.learning.tiles import TileArray
from lab.learning.updates.linear import FAINT
from lab.mdp import FloatArray

TABLE = 0  # the number of a table; `physics` has those of the worlds

_exp_of: Any = inlined(selection.exp_of)
_cell_along: Any = inlined(tiles.cell_along)
_begins: Any = [inner(world.begin) for world in (mountain_car, acrobot, cart_pole)]
_steps: Any = [inner(world.step) for world in (mountain_car, acrobot, cart_pole)]
_begin_car, _begin_acrobot, _begin_pole = _begins
_step_car, _step_acrobot, _step_pole = _steps


class LinearWorld(NamedTuple):
    """The place of the steps: its number, the point x (D,), bounds and cells, rewards; longer_is_better: see `Physics`."""

    number: int
    x: FloatArray
    low: FloatArray
    high: FloatArray
    cells: NDArray[np.int64]
    reward: float
    last_reward: float
    longer_is_better: bool


class Linear(NamedTuple):
    """The learner with tile coding.

    active (S, T): the tiles of each cell; weights (tiles * A,).
    listed, strength (tiles * A,): the weights with a trace, and their eligibilities; place (tiles * A,): the index of each
    weight in `listed`, -1 if it has no trace; traces (1,): the number of traces.
    values (A,): working space for the values of a state; warm (E,): temperature or epsilon by episode; start: of each weight.
    """

    active: TileArray
    weights: FloatArray
    listed: NDArray[np.int64]
    strength: FloatArray
    place: NDArray[np.int64]
    traces: NDArray[np.int64]
    values: FloatArray
    warm: FloatArray
    start: float
    alpha: float
    decay: float
    growing: bool
    on_policy: bool
    lookahead: bool
    selection: int


@inlined
def _number(world: Any) -> int:
    """`Bounds.number` of the point."""
    number = 0
    for axis in range(len(world.cells)):
        cells = world.cells[axis]
        number = number * cells + _cell_along(world.x[axis], world.low[axis], world.high[axis], cells)
    return number


@inlined
def _start(work: Any, world: Any) -> int:
    """`Environment.reset`."""
    rng, starts = work.lanes.rng, work.problem.starts
    if world.number == TABLE:
        return int(starts[int(draw(rng, 0) * len(starts))] if len(starts) > 1 else starts[0])
    for i in range(len(world.x)):
        world.x[i] = draw(rng, 0)
    if world.number == MOUNTAIN_CAR:
        _begin_car(world.x)
    elif world.number == ACROBOT:
        _begin_acrobot(world.x)
    else:
        _begin_pole(world.x)
    return int(_number(world))


@inlined
def _moved(world: Any, action: int) -> bool:
    """`Physics.step`."""
    if world.number == MOUNTAIN_CAR:
        return bool(_step_car(world.x, action))
    if world.number == ACROBOT:
        return bool(_step_acrobot(world.x, action))
    return bool(_step_pole(world.x, action))


@inlined
def _value(linear: Any, state: int, action: int) -> float:
    actions, total = len(linear.values), 0.0
    for t in range(linear.active.shape[1]):
        total += linear.weights[linear.active[state, t] * actions + action]
    return total


@inlined
def _look(linear: Any, state: int) -> float:
    """Writes the values of a state to `linear.values`; returns the best of them."""
    best = -np.inf
    for action in range(len(linear.values)):
        linear.values[action] = _value(linear, state, action)
        best = max(best, linear.values[action])
    return best


@inlined
def _choose(work: Any, linear: Any, own_gate: Any, state: int) -> None:
    """Writes the learner's own choice in a state to lane 0, and shows its values to the gate's rules."""
    lanes, values, actions = work.lanes, linear.values, len(linear.values)
    warm = linear.warm[lanes.lane[0].episode - 1]
    best, low = _look(linear, state), np.inf
    if own_gate is not None:
        for action in range(actions):
            own_gate.values[0, action] = values[action]
    for action in range(actions):
        low = min(low, values[action])
    lanes.states[0], lanes.widths[0] = state, best - low
    u = draw(lanes.rng, 0)
    chosen = 0
    if linear.selection == selection.SOFTMAX:
        per_tau, total = 1.0 / max(selection.COLDEST, warm), 0.0
        for action in range(actions):
            total += _exp_of((values[action] - best) * per_tau)
            values[action] = total
        mark = u * total * selection.BELOW_ONE
        for action in range(actions - 1):
            chosen += values[action] <= mark
    else:
        chosen = greedy(values, 0, 1, actions, best, 0.0 if linear.selection == selection.GREEDY else warm, u)
    lanes.chosen[0] = chosen


@inlined
def _learn(linear: Any, state: int, action: int, reward: float, discount: float, entered: int, following: int) -> None:
    """`updates.linear.OnTiles.learn` of one step; discount: 0 if the episode has ended."""
    actions, follow = len(linear.values), discount > 0.0
    best = _look(linear, entered)
    after = linear.values[following] if linear.on_policy else best
    follow = follow and (linear.on_policy or linear.values[following] == best)
    error = reward + discount * after - _value(linear, state, action)
    count = linear.traces[0]
    for t in range(linear.active.shape[1]):
        weight = linear.active[state, t] * actions + action
        at = linear.place[weight]
        if at < 0:
            linear.place[weight], linear.listed[count], linear.strength[count] = count, weight, 1.0
            count += 1
        elif linear.growing:
            linear.strength[at] += 1.0
        else:
            linear.strength[at] = 1.0
    step, kept = linear.alpha * error, 0
    for i in range(count):
        weight, strength = linear.listed[i], linear.strength[i]
        linear.weights[weight] += step * strength
        strength *= linear.decay
        if follow and strength > FAINT:
            linear.listed[kept], linear.strength[kept], linear.place[weight] = weight, strength, kept
            kept += 1
        else:
            linear.place[weight] = -1
    linear.traces[0] = kept


@inlined
def _begin_session(work: Any, linear: Any, n: int) -> None:
    lanes = work.lanes
    lane = lanes.lane[0]
    lane.session, lane.episode, lanes.rng[0] = n, 0, work.sessions.seeds[n]
    lane.last_result, lane.equal_results, lane.converged = 0, 0, 0
    lane.evidence = 0.0
    for i in range(len(linear.weights)):
        linear.weights[i] = linear.start


@inlined
def _begin_episode(work: Any, linear: Any, own_gate: Any) -> None:
    """Begins the next episode: decides whether it may ask, and clears the traces."""
    lanes, lane = work.lanes, work.lanes.lane[0]
    lane.episode, lane.asked, lane.helped = lane.episode + 1, 0, 0
    lane.left = work.asking.settings.budget - work.sessions.counts[lane.session].helped_steps
    lane.is_open = opens(work, own_gate, 0)
    lanes.is_open[0] = lane.is_open
    for i in range(linear.traces[0]):
        linear.place[linear.listed[i]] = -1
    linear.traces[0] = 0


@inlined
def _episode(work: Any, linear: Any, world: Any, own_gate: Any) -> None:
    """`Session._walk`, and the bookkeeping of the episode."""
    lanes, learning, problem, sessions = work.lanes, work.learning, work.problem, work.sessions
    lane = lanes.lane[0]
    state: Any = _start(work, world)
    _choose(work, linear, own_gate, state)
    action: Any = np.int64(decided(work, None, None, own_gate, 0)[0])
    moves, over, won, returned = 0, False, False, 0.0
    entered: Any = 0
    following: Any = np.int64(0)
    while not over and moves < learning.max_moves:
        moves += 1
        if world.number == TABLE:
            at = state * len(linear.values) + action
            entered, reward = np.int64(problem.successor[at]), problem.reward[at]
            over, won = problem.ends[entered] != 0, problem.ends[entered] == 1
        else:
            over = _moved(world, action)
            entered, reward = _number(world), world.last_reward if over else world.reward
            won = over and not world.longer_is_better
        returned += reward
        last = moves == learning.max_moves
        if linear.lookahead and not over:
            _choose(work, linear, own_gate, entered)
            following = np.int64(lanes.chosen[0]) if last else np.int64(decided(work, None, None, own_gate, 0)[0])
        _learn(linear, state, action, reward, 0.0 if over else learning.discount, entered, following)
        if not linear.lookahead and not over and not last:
            _choose(work, linear, own_gate, entered)
            following = np.int64(decided(work, None, None, own_gate, 0)[0])
        state, action = entered, following
    n, count = lane.session, sessions.counts[lane.session]
    if world.longer_is_better:
        sessions.steps[n, lane.episode - 1] = (learning.max_moves - moves + 2 if over else 1) + learning.count_start
    else:
        sessions.steps[n, lane.episode - 1] = moves + learning.count_start if won else learning.max_steps + 1
    sessions.guided[n, lane.episode - 1] = lane.helped > 0
    if len(sessions.returns):
        sessions.returns[n, lane.episode - 1] = returned
    count.requests += lane.asked
    count.helped_steps += lane.helped
    count.moves += moves
    if lane.is_open and work.asking.gate.judges:
        judge(work.asking, lane, (sessions.steps[n], sessions.guided[n]), count, moves)


@without_refcounts
def run(work: Any, linear: Any, world: Any, own_gate: Any) -> None:
    """Runs all sessions, one after the other; own_gate: None for a shipped gate."""
    for n in range(len(work.sessions.seeds)):
        _begin_session(work, linear, n)
        for _ in range(len(linear.warm)):
            _begin_episode(work, linear, own_gate)
            _episode(work, linear, world, own_gate)
        if len(work.sessions.kept):
            for i in range(len(linear.weights)):
                work.sessions.kept[n, i] = linear.weights[i]


@without_refcounts
def play(world: Any, policy: Any, starts: Any, most: int, moves: Any) -> None:
    """Writes the number of moves (N,) of a policy (S,) from starts (N, D) to `moves`, negated if the episode did not end.

    most: the limit of moves.
    """
    for n in range(len(starts)):
        for i in range(len(world.x)):
            world.x[i] = starts[n, i]
        over, made = False, 0
        while not over and made < most:
            made += 1
            over = _moved(world, policy[_number(world)])
        moves[n] = made if over else -made
