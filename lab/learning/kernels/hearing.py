"""The compiled forms of the gates that weigh advice, and of the advisor that answers or holds back."""

from functools import partial
from typing import Any

import numpy as np

from lab.learning import selection
from lab.learning.compiled import inlined, inner, linked, without_refcounts
from lab.learning.gates import earned_trust, heard, reuse
from lab.learning.gates import gate as rules
from lab.learning.kernels.learners import best_action, draw, fill, leads, prefer, replay_step
from lab.learning.simulated_advice import SPEAKS_ALWAYS, SPEAKS_TO_CORRECT
from lab.learning.updates import update

_Heard: Any = heard.Heard
_clear: Any = inner(heard.clear)
_hear: Any = inlined(heard.hear)
_reused: Any = inlined(reuse.reused)
_begins_reuse: Any = inlined(reuse.begins_reuse)
_advised_chance: Any = inner(reuse.advised_chance)
_gained: Any = inlined(reuse.gained)
_with_bonus: Any = inner(linked(reuse.with_bonus, exp_of=inlined(selection.exp_of)))
_chose: Any = inlined(heard.chose)
_made_move: Any = inlined(heard.made_move)
_answers: Any = inlined(heard.answers)
_best_of: Any = inlined(heard.best_of)
_shaped: Any = inner(linked(heard.shaped, exp_of=inlined(selection.exp_of)))
_explores: Any = inlined(heard.explores)
_reliable: Any = inlined(heard.reliable)
_borne_out: Any = inlined(linked(heard.borne_out, best_of=_best_of))
_asks_by_worth: Any = inlined(heard.asks_by_worth)
_learn_worth: Any = inlined(linked(heard.learn_worth, towards=inlined(update.towards)))
_on_table: Any = {"best_action": best_action, "leads": leads, "prefer": prefer, "replay": replay_step}
_favourite: Any = inlined(earned_trust.favourite)
_planned: Any = inner(linked(earned_trust.planned, **_on_table))
_handed: Any = {
    "hand_over_path": inner(linked(earned_trust.hand_over_path, planned=_planned, **_on_table)),
    "hand_over_answers": inner(linked(earned_trust.hand_over_answers, favourite=_favourite, **_on_table)),
}
_knows: Any = inner(linked(earned_trust.knows, leads=leads))
_starts: Any = inner(linked(earned_trust.starts, planned=_planned))
_wants: Any = inlined(linked(earned_trust.wants, answers=_answers))
_takes: Any = inlined(linked(earned_trust.takes, favourite=_favourite))
_saw: Any = inlined(earned_trust.saw)
_ended: Any = inner(linked(earned_trust.ended, knows=_knows, judges=inner(earned_trust.judges), **_handed))


# Inlined as source, because a compiled function may not return arrays that are not its arguments.
@partial(without_refcounts, inline="always")
def _of_lane(h: Any, j: int) -> Any:
    """The record of advice of one lane."""
    kept = h.said[j], h.times[j], h.blamed[j], h.led[j]
    return _Heard(*kept, h.left[j], h.walk[j], h.fewest[j], h.way[j], h.paid[j], h.worth[j], h.now[j])


@inlined
def hears_nothing_yet(work: Any, hearing: Any, j: int) -> None:
    """Resets the record of advice of lane j for another session."""
    hearing.before[j] = heard.NOTHING
    for state in range(hearing.chose.shape[1]):
        hearing.chose[j, state] = heard.NOTHING
    if work.asking.gate.weighs != rules.WEIGHS_NOTHING:
        _clear(_of_lane(hearing.heard, j), hearing.several)


@inlined
def begins(work: Any, hearing: Any, j: int) -> None:
    """`Gate.begins` of lane j's episode."""
    how, episode = work.asking.gate.weighs, work.lanes.lane[j].episode
    if how == rules.WEIGHS_IMITATION:
        _begins_reuse(_of_lane(hearing.heard, j), work.asking.settings.reuse ** (episode - 1), draw(work.lanes.rng, j))
    elif how == rules.WEIGHS_POLICY:
        told = _of_lane(hearing.heard, j)
        _begins_reuse(told, _advised_chance(told, episode, work.asking.settings.warming), draw(work.lanes.rng, j))
    elif how == rules.WEIGHS_TRUST:
        start, retry = np.int64(work.lanes.states[j]), work.asking.settings.retry
        _starts(_of_lane(hearing.heard, j), (work, j), start, retry, draw(work.lanes.rng, j))


@inlined
def wants(work: Any, hearing: Any, j: int, state: Any) -> bool:
    """`Gate.asks` of a gate that weighs."""
    how, told, lanes = work.asking.gate.weighs, _of_lane(hearing.heard, j), work.lanes
    if how == rules.WEIGHS_TRUST:
        return bool(_wants(told, np.int64(state), work.asking.settings.agreement))
    hearing.u[j] = draw(lanes.rng, j)
    u, episode = hearing.u[j], lanes.lane[j].episode
    if how == rules.WEIGHS_NOVELTY:
        return bool(_answers(told, np.int64(state)) == 0)
    if how == rules.WEIGHS_FADING:
        return bool(u < work.asking.settings.fading ** (episode - 1))
    if how == rules.WEIGHS_RELIABILITY:
        return bool(
            _explores(episode, len(work.sessions.warm), work.asking.settings.exploring, u)
            and told.said[state] == heard.NOTHING
        )
    if how == rules.WEIGHS_WORTH:
        return bool(_asks_by_worth(told, np.int64(state), work.asking.settings.wandering, u))
    if how == rules.WEIGHS_POLICY:
        share = work.asking.settings.reuse**told.now.moves if told.now.advised > 0.0 else 0.0
        told.now.moves += 1.0
        return bool(u < share)
    if how in (rules.WEIGHS_REUSE, rules.WEIGHS_IMITATION, rules.WEIGHS_VALUES):
        return bool(told.said[state] == heard.NOTHING)
    return True


@inlined
def takes(work: Any, hearing: Any, j: int, state: Any, own: Any, said: int) -> Any:
    """`Gate.takes` of a gate that weighs; said: the answer, NOTHING if there is none."""
    how, told, lanes = work.asking.gate.weighs, _of_lane(hearing.heard, j), work.lanes
    at, actions = np.int64(state), len(work.learning.actions)
    if said != heard.NOTHING:
        _hear(told, at, said)
    _chose(told, said != heard.NOTHING)
    action = np.int64(own) if said == heard.NOTHING else np.int64(said)
    if how == rules.WEIGHS_TRUST:
        action = np.int64(_takes(told, at, np.int64(own)))
    elif how == rules.WEIGHS_SHAPING:
        odds = work.asking.settings.consistency / (1.0 - work.asking.settings.consistency)
        fill(work, hearing.values, j, state)
        action = np.int64(_shaped(told, at, hearing.values[j], lanes.per_tau[j], odds, hearing.u[j]))
    elif how == rules.WEIGHS_RELIABILITY:
        explores = _explores(
            lanes.lane[j].episode, len(work.sessions.warm), work.asking.settings.exploring, hearing.u[j]
        )
        kept = explores and told.said[at] != heard.NOTHING and _reliable(told, actions, work.asking.settings.trust)
        action = np.int64(told.said[at]) if kept else np.int64(own)
    elif how == rules.WEIGHS_REUSE and told.said[at] != heard.NOTHING:
        action = np.int64(own)
        if _reused(told.left, at, work.asking.settings.reuse, hearing.u[j]):
            told.left[at] += 1
            action = np.int64(told.said[at])
    elif how == rules.WEIGHS_IMITATION and told.said[at] != heard.NOTHING and told.now.advised > 0.0:
        action = np.int64(told.said[at])
    elif how == rules.WEIGHS_VALUES and told.said[at] != heard.NOTHING:
        bonus = work.asking.settings.bonus * work.asking.settings.reuse ** (lanes.lane[j].episode - 1)
        fill(work, hearing.values, j, state)
        action = np.int64(_with_bonus(hearing.values[j], told.said[at], bonus, lanes.per_tau[j], hearing.u[j]))
    return np.uint64(action)


@inlined
def saw(work: Any, hearing: Any, j: int, state: Any, number: Any, entered: Any, reward: float, over: bool) -> None:
    """`Gate.saw` of a gate that weighs, called after lane j has learned from a step."""
    how = work.asking.gate.weighs
    if how == rules.WEIGHS_NOTHING:
        return
    told = _of_lane(hearing.heard, j)
    _made_move(told)
    if how == rules.WEIGHS_TRUST:
        _saw(told, np.int64(number), np.int64(entered), over, reward, work.asking.settings.strikes)
    elif how == rules.WEIGHS_RELIABILITY:
        fill(work, hearing.values, j, state)
        _borne_out(told, np.int64(state), hearing.values[j])
    elif how == rules.WEIGHS_WORTH:
        discount = 0.0 if over else work.learning.discount
        _learn_worth(told, np.int64(state), reward, discount, np.int64(entered), work.learning.alpha)


@inlined
def ended(work: Any, hearing: Any, j: int, steps: int, won: bool, over: bool) -> None:
    """`Gate.judges` of lane j's episode."""
    if work.asking.gate.weighs == rules.WEIGHS_POLICY:
        _gained(_of_lane(hearing.heard, j), work.learning.discount**steps if won else 0.0)
    elif work.asking.gate.weighs == rules.WEIGHS_TRUST:
        margin = work.asking.settings.margin / work.lanes.per_tau[j]
        _ended(_of_lane(hearing.heard, j), (work, j), float(steps), won, over, margin)


@inlined
def answered(work: Any, hearing: Any, j: int, state: Any, own: Any) -> int:
    """`TableAdvisor.advise`: the answer to lane j, NOTHING if there is none."""
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
