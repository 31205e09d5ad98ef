"""The compiled forms of opening, judging and asking, by the rules of the gates (`gates.gate.CompiledGate`)."""

from typing import Any

import numpy as np

from lab.learning import advice_memory as memory
from lab.learning.compiled import inlined, inner
from lab.learning.gates import gate as rules
from lab.learning.gates.heard import NOTHING
from lab.learning.gates.rule_gate import GateNow
from lab.learning.kernels.hearing import answered, takes, wants
from lab.learning.kernels.learners import draw, gauge

_Now: Any = GateNow
_window_mean: Any = inner(rules.window_mean)
_too_slow: Any = inner(rules.too_slow)
_misled: Any = inner(rules.misled)
_evidence: Any = inner(rules.evidence)
_unsure: Any = inlined(rules.unsure)


@inner
def _opens(asking: Any, lane: Any, steps: Any, max_steps: int, rejected: bool) -> bool:
    """`Gate.opens` of a shipped gate; steps (E,) are those of the lane's session."""
    rule, episode, window = asking.gate.opens, lane.episode, asking.settings.window
    if rule not in (rules.OPENS_FROM_X, rules.OPENS_WHILE_LONG, rules.OPENS_WHILE_SLOW):
        return bool(rule == rules.OPENS_ALWAYS)
    if episode < asking.settings.first_episode:
        return False
    if rule == rules.OPENS_WHILE_LONG:
        return bool(episode > window and _window_mean(steps, episode - 1, window) > asking.settings.enough_steps)
    if rule == rules.OPENS_FROM_X or rejected or episode <= 2 * window:
        return bool(rule == rules.OPENS_FROM_X)
    result = steps[episode - 2]
    if result == lane.last_result and result < max_steps:
        lane.equal_results += 1
        if lane.equal_results > 2 * window:
            lane.converged = 1
    else:
        lane.last_result, lane.equal_results = result, 0
    current = _window_mean(steps, episode - 1, window)
    previous = _window_mean(steps, episode - 1 - window, window)
    slow = _too_slow(current, previous, asking.settings.lambda_threshold)
    return bool(slow and lane.converged == 0 and episode < len(steps))


@inlined
def _now(work: Any, own_gate: Any, j: int) -> Any:
    """What the rules of lane j's gate read."""
    lane = work.lanes.lane[j]
    helped_steps = work.asking.settings.budget - lane.left + lane.helped
    return _Now(lane.episode, len(work.sessions.warm), work.asking.max_steps, helped_steps, draw(work.lanes.rng, j))


@inlined
def opens(work: Any, own_gate: Any, j: int) -> bool:
    """`Gate.opens`: whether the episode that begins in lane j may ask."""
    lane, sessions = work.lanes.lane[j], work.sessions
    if own_gate is None:
        rejected = sessions.counts[lane.session].rejected_at_episode > 0
        return bool(_opens(work.asking, lane, sessions.steps[lane.session], work.learning.max_steps, rejected))
    steps = own_gate.steps[lane.session, : lane.episode - 1]
    return bool(own_gate.opens(lane.episode, steps, _now(work, own_gate, j), work.asking.settings))


@inner
def judge(asking: Any, lane: Any, told: Any, count: Any, moves: int) -> None:
    """`Ccrl.judges` if all episodes begin in the same state; told: steps (E,) and guided (E,) of the lane's session."""
    episode, window = lane.episode, asking.settings.window
    if not _judged(asking, lane, count):
        return
    steps, guided = told
    result = steps[episode - 1]
    if asking.settings.by_evidence:
        own, reached, found, i = 0.0, 0, 0, episode - 2
        while i >= 0 and found < window:
            if not guided[i]:
                own, found = own + steps[i], found + 1
                reached += steps[i] <= asking.max_steps
            i -= 1
        _weighs(asking, lane, count, result, own, reached, moves)
        return
    if _misled(result, _window_mean(steps, episode - 1, window)):
        # With one start the fewest known steps are those of the best episode.
        best = bool(asking.settings.spare_best and result <= asking.max_steps)
        if best:
            for i in range(episode - 1):
                best = best and result <= steps[i]
        if not best:
            _misleads(asking, episode, count)


@inner
def knows(lane: Any, steps: Any, walked: int, fewest: Any, walk: Any, max_steps: int) -> None:
    """`Ccrl._knows`: updates the distances to the goal of the states of the last episode."""
    result = steps[lane.episode - 1]
    left = float(result - walked) if result <= max_steps else np.inf
    for i in range(walked - 1, -1, -1):
        left = min(left + 1.0, fewest[walk[i]])
        fewest[walk[i]] = left


@inner
def judge_moved(asking: Any, lane: Any, told: Any, count: Any, moves: int, fewest: Any, begun: Any) -> None:
    """`Ccrl.judges` if episodes begin in different states: earlier step counts are corrected by their starts."""
    episode, window = lane.episode, asking.settings.window
    if not _judged(asking, lane, count):
        return
    steps, guided = told
    result, now = steps[episode - 1], begun[episode - 1]
    here, total = fewest[now], 0.0
    if asking.settings.by_evidence:
        reached, found, i = 0, 0, episode - 2
        while i >= 0 and found < window:
            if not guided[i]:
                value = float(steps[i])
                if begun[i] != now and here < np.inf and steps[i] <= asking.max_steps:
                    value = value - fewest[begun[i]] + here
                total, found = total + value, found + 1
                reached += steps[i] <= asking.max_steps
            i -= 1
        _weighs(asking, lane, count, result, total, reached, moves)
        return
    for i in range(episode - 1 - window, episode - 1):
        value = float(steps[i])
        if begun[i] != now and here < np.inf and steps[i] <= asking.max_steps:
            value += here - fewest[begun[i]]
        total += value
    best = asking.settings.spare_best and result <= min(here, asking.max_steps)
    if result >= total / window and not best:
        _misleads(asking, episode, count)


@inlined
def _judged(asking: Any, lane: Any, count: Any) -> bool:
    """Whether the last episode is compared with those before it."""
    may = asking.judges_unhelped or lane.helped > 0
    return bool(may and count.rejected_at_episode == 0 and lane.episode > asking.settings.window)


@inlined
def _weighs(asking: Any, lane: Any, count: Any, result: Any, own: float, reached: int, moves: int) -> None:
    """`Ccrl._weighs` of an advised episode; own, reached: see `gates.gate.evidence`."""
    before, failed = lane.evidence, result > asking.max_steps
    lane.evidence = _evidence(before, result, own, reached, failed, lane.helped >= moves)
    count.misleads += lane.evidence > before
    if lane.evidence > rules.ENOUGH_EVIDENCE:
        count.rejected_at_episode = lane.episode


@inlined
def _misleads(asking: Any, episode: int, count: Any) -> None:
    """Counts a mislead, and rejects the advisor after more than Omega."""
    count.misleads += 1
    if count.misleads > asking.settings.omega:
        count.rejected_at_episode = episode


@inlined
def _deviation(work: Any, j: int, state: Any) -> float:
    """`gates.deviation` of the values of lane j's ensemble in a state."""
    actions, tables = len(work.learning.actions), work.lanes.others[j]
    count = len(tables)
    total = 0.0
    for a in range(actions):
        summed = 0.0
        for k in range(count):
            summed += gauge(work, tables[k], state, a)
        mean, squares = summed / count, 0.0
        for k in range(count):
            off = gauge(work, tables[k], state, a) - mean
            squares += off * off
        total += squares / count
    return float((total / actions) ** 0.5)


@inlined
def asks(work: Any, own_gate: Any, j: int, state: Any) -> bool:
    """`Gate.asks` in a state of lane j's open episode, whose values `own_gate` shows."""
    asking, lanes = work.asking, work.lanes
    if own_gate is not None:
        now = _now(work, own_gate, j)
        return bool(own_gate.asks(np.int64(state), own_gate.shown[j], now, work.asking.settings))
    rule = asking.gate.asks
    if rule == rules.ASKS_WHERE_ALIKE:
        return bool(_unsure(lanes.widths[j], asking.settings.psi))
    if rule == rules.ASKS_WHERE_APART:
        return bool(lanes.widths[j] >= asking.settings.psi)
    if rule == rules.ASKS_BY_CHANCE:
        return bool(draw(lanes.rng, j) < asking.settings.rate)
    if rule == rules.ASKS_WHERE_TABLES_DIFFER:
        return bool(_deviation(work, j, state) >= asking.settings.spread)
    return True


@inlined
def advised(work: Any, j: int, state: Any) -> Any:
    """The action that the advisor draws for lane j (`TableAdvisor.advise`)."""
    thresholds, last = work.thresholds, len(work.learning.actions) - 1
    row = min(work.lanes.lane[j].episode, thresholds.shape[0]) - 1
    mark, action = draw(work.lanes.rng, j) * thresholds[row, state, last], np.uint64(0)
    for a in range(last):
        action += np.uint64(thresholds[row, state, a] <= mark)
    return action


@inlined
def decided(work: Any, memories: Any, hearing: Any, own_gate: Any, j: int) -> Any:
    """The action of lane j's next step and its source: its own choice, practice of the known path, or advice."""
    lanes, state = work.lanes, work.lanes.states[j]
    action, source = np.uint64(lanes.chosen[j]), np.int64(memory.OWN)
    if memories is not None:
        now = memories.now[j]
        if now.practices > 0 and memories.path[j, state] != memory.NOTHING:
            action, source = np.uint64(memories.path[j, state]), np.int64(memory.PRACTISED)
    if lanes.is_open[j]:
        lane = lanes.lane[j]
        if hearing is None:
            if lane.helped < lane.left and asks(work, own_gate, j, state):
                lane.asked = 1
                if work.region[state]:
                    lane.helped += 1
                    action, source = advised(work, j, state), np.int64(memory.ASKED)
        else:
            weighs, said = work.asking.gate.weighs != rules.WEIGHS_NOTHING, NOTHING
            may = lane.helped < lane.left
            wanted = wants(work, hearing, j, state) if weighs else may and asks(work, own_gate, j, state)
            if wanted and may:
                lane.asked = 1
                said = answered(work, hearing, j, state, action)
                if said != NOTHING:
                    lane.helped += 1
                    source = np.int64(memory.ASKED)
            if weighs:
                action = takes(work, hearing, j, state, action, said)
            elif said != NOTHING:
                action = np.uint64(said)
    return action, source
