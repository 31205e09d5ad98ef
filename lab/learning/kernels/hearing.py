"""The compiled forms of the gates that weigh what they are told, and of advisors that are late or hold back."""

from functools import partial
from typing import Any

import numpy as np

from lab.learning import selection
from lab.learning.compiled import inlined, inner, linked, without_refcounts
from lab.learning.gates import earned_trust, heard
from lab.learning.gates import gate_rules as rules
from lab.learning.kernels.learners import draw, gauge
from lab.learning.simulated_advice import SPEAKS_ALWAYS, SPEAKS_TO_CORRECT
from lab.learning.updates import update

_Heard: Any = heard.Heard
_clear: Any = inner(heard.clear)
_hear: Any = inlined(heard.hear)
_answers: Any = inlined(heard.answers)
_best_of: Any = inlined(heard.best_of)
_shaped: Any = inner(linked(heard.shaped, exp_of=inlined(selection.exp_of)))
_explores: Any = inlined(heard.explores)
_reliable: Any = inlined(heard.reliable)
_borne_out: Any = inlined(linked(heard.borne_out, best_of=_best_of))
_asks_by_worth: Any = inlined(heard.asks_by_worth)
_learn_worth: Any = inlined(linked(heard.learn_worth, towards=inlined(update.towards)))
_starts: Any = inner(linked(earned_trust.starts, rehearsed=inner(earned_trust.rehearsed)))
_wants: Any = inlined(linked(earned_trust.wants, answers=_answers))
_takes: Any = inlined(linked(earned_trust.takes, favourite=inlined(earned_trust.favourite)))
_saw: Any = inlined(linked(earned_trust.saw, best_of=_best_of))
_ended: Any = inner(earned_trust.ended)


@partial(
    without_refcounts, inline="always"
)  # as source: a compiled function may not return arrays that it was not handed
def _of_lane(h: Any, j: int) -> Any:
    """What one lane was told."""
    return _Heard(h.said[j], h.times[j], h.blamed[j], h.led[j], h.greedy[j], h.left[j], h.worth[j], h.now[j])


@inlined
def hears_nothing_yet(work: Any, hearing: Any, j: int) -> None:
    """Another session begins in lane j."""
    hearing.before[j] = heard.NOTHING
    for state in range(hearing.chose.shape[1]):
        hearing.chose[j, state] = heard.NOTHING
    if work.asking.gate.weighs != rules.WEIGHS_NOTHING:
        _clear(_of_lane(hearing.heard, j), hearing.several)


@inlined
def begins(work: Any, hearing: Any, j: int) -> None:
    """`Gate.begins` of lane j's episode."""
    if work.asking.gate.weighs == rules.WEIGHS_TRUST:
        _starts(_of_lane(hearing.heard, j), np.int64(work.lanes.states[j]), draw(work.lanes.rng, j))


@inlined
def wants(work: Any, hearing: Any, j: int, state: Any) -> bool:
    """`Gate.asks` of a gate that weighs."""
    how, told, lanes = work.asking.gate.weighs, _of_lane(hearing.heard, j), work.lanes
    if how == rules.WEIGHS_TRUST:
        return bool(_wants(told, np.int64(state)))
    hearing.u[j] = draw(lanes.rng, j)
    u, episode = hearing.u[j], lanes.lane[j].episode
    if how == rules.WEIGHS_NOVELTY:
        return bool(_answers(told, np.int64(state)) == 0)
    if how == rules.WEIGHS_FADING:
        return bool(u < work.asking.fading ** (episode - 1))
    if how == rules.WEIGHS_RELIABILITY:
        return bool(_explores(episode, len(work.sessions.per_tau), u) and told.said[state] == heard.NOTHING)
    if how == rules.WEIGHS_WORTH:
        return bool(_asks_by_worth(told, np.int64(state), u))
    return True


@inlined
def takes(work: Any, hearing: Any, j: int, state: Any, own: Any, said: int) -> Any:
    """`Gate.takes` of a gate that weighs; said: NOTHING where nothing was."""
    how, told, lanes = work.asking.gate.weighs, _of_lane(hearing.heard, j), work.lanes
    at, actions = np.int64(state), len(work.learning.actions)
    if said != heard.NOTHING:
        _hear(told, at, said)
    told.now.followed = 0.0 if said == heard.NOTHING else 1.0
    action = np.int64(own) if said == heard.NOTHING else np.int64(said)
    if how == rules.WEIGHS_TRUST:
        action = np.int64(_takes(told, at, np.int64(own)))
    elif how == rules.WEIGHS_SHAPING:
        odds = work.asking.consistency / (1.0 - work.asking.consistency)
        _fill(work, hearing, j, state)
        action = np.int64(_shaped(told, at, hearing.values[j], lanes.per_tau[j], odds, hearing.u[j]))
    elif how == rules.WEIGHS_RELIABILITY:
        explores = _explores(lanes.lane[j].episode, len(work.sessions.per_tau), hearing.u[j])
        kept = explores and told.said[at] != heard.NOTHING and _reliable(told, actions)
        action = np.int64(told.said[at]) if kept else np.int64(own)
    return np.uint64(action)


@inlined
def _fill(work: Any, hearing: Any, j: int, state: Any) -> None:
    """`Update.gauge` of a state in lane j."""
    for a in range(len(work.learning.actions)):
        hearing.values[j, a] = gauge(work, work.lanes.tables[j], state, a)


@inlined
def saw(work: Any, hearing: Any, j: int, state: Any, number: Any, entered: Any, reward: float, over: bool) -> None:
    """`Gate.saw` of a gate that weighs, once a step of lane j was learned from."""
    how = work.asking.gate.weighs
    if how == rules.WEIGHS_NOTHING:
        return
    told = _of_lane(hearing.heard, j)
    if how == rules.WEIGHS_TRUST:
        _fill(work, hearing, j, state)
        _saw(told, np.int64(number), np.int64(entered), over, hearing.values[j])
    elif how == rules.WEIGHS_RELIABILITY:
        _fill(work, hearing, j, state)
        _borne_out(told, np.int64(state), hearing.values[j])
    elif how == rules.WEIGHS_WORTH:
        discount = 0.0 if over else work.learning.discount
        _learn_worth(told, np.int64(state), reward, discount, np.int64(entered), work.learning.alpha)
    told.now.followed = 0.0


@inlined
def ended(work: Any, hearing: Any, j: int, steps: int, won: bool, over: bool) -> None:
    """`Gate.judges` of lane j's episode."""
    if work.asking.gate.weighs == rules.WEIGHS_TRUST:
        _ended(_of_lane(hearing.heard, j), float(steps), won, over)


@inlined
def answered(work: Any, hearing: Any, j: int, state: Any, own: Any) -> int:
    """`TableAdvisor.advise`: what it says to lane j, NOTHING where it holds its tongue."""
    thresholds, last = work.thresholds, len(work.learning.actions) - 1
    known = np.int64(state)
    if hearing.late:
        known, hearing.before[j] = hearing.before[j], known
    if known == heard.NOTHING or not work.region[known]:
        return int(heard.NOTHING)
    row = min(work.lanes.lane[j].episode, thresholds.shape[0]) - 1
    mark, action = draw(work.lanes.rng, j) * thresholds[row, known, last], 0
    for a in range(last):
        action += int(thresholds[row, known, a] <= mark)
    if hearing.speaks == SPEAKS_ALWAYS:
        return action
    expected = np.int64(own)
    if hearing.speaks != SPEAKS_TO_CORRECT:
        expected = np.int64(hearing.chose[j, state])
        hearing.chose[j, state] = own
    return int(heard.NOTHING) if action == expected else action
