"""Sessions of added learners and gates by their compiled rules, and the notice that a member runs uncompiled."""

import warnings
from collections import Counter
from collections.abc import Callable
from functools import cache
from multiprocessing import current_process
from typing import Any

import numpy as np

from lab.errors import BadInput, Notice
from lab.learning.compiled import compiled_rule, not_kept, types_of
from lab.learning.gates import GATES
from lab.learning.gates.gate import OPENS_BY_RULE
from lab.learning.gates.rule_gate import GateNow, plain_rules
from lab.learning.kernels import records
from lab.learning.kernels.records import LANES
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES
from lab.learning.updates.update import OWN_RULE, plain_rule
from lab.mdp import TabularMDP

TIMES_SLOWER = 250  # the session beside the kernel: 275 times with q, 222 with q-lambda, 160 with dyna-q
WORTH_COMPILING = 20_000  # episodes of one kind with a rule of other code: fewer take less time than compiling
_compiled_rules: dict[Any, Any] = {}  # None: numba cannot compile it
_episodes: Counter[Any] = Counter()  # that have been asked for, by the types for which the kernel is to be compiled
_told: set[tuple[str, str]] = set()


def runs_compiled(
    kernel: Callable[..., None],
    work: records.Work,
    others: tuple[Any, ...],
    mdp: TabularMDP,
    learner: LearnerSettings,
    gate: GateSettings,
) -> bool:
    """Runs the sessions by a kernel, with the rules of an added learner and gate; returns False if they have to run one by one.

    kernel: `run` of `session_loop` or `linear_loop`; others: its arguments after `work`, except the rules. Sessions run one by
    one if there are too few for what compiling takes, if a rule cannot be compiled, which a notice says, or if it fails: then
    the session shows in which line. Raises BadInput for values that are not finite.
    """
    on_table, make, decides = learner.tilings == 1, UPDATES[learner.learner], GATES[gate.gate]
    rules: dict[str, Any] = {}
    if on_table and make.compiled == OWN_RULE:
        rules["rule"] = plain_rule(make.make)  # type: ignore[arg-type]
    if work.asking.gate.opens == OPENS_BY_RULE:
        rules |= plain_rules(decides.make)  # type: ignore[arg-type]
    if not rules:
        kernel(work, *others, *((None, None) if on_table else (None,)))
        return True
    kind = kernel, *rules.items(), *types_of((work, *others))
    _episodes[kind] += work.sessions.steps.size
    if _episodes[kind] < WORTH_COMPILING:
        return False
    try:
        own = _own_rule(rules["rule"], work, mdp, learner) if "rule" in rules else None
        own_gate = _own_gate(rules, work, mdp, learner, gate) if "opens_rule" in rules else None
        _for_process(kernel)(work, *others, *((own, own_gate) if on_table else (own_gate,)))
    except Exception:  # whatever a rule raises
        return False
    if own is not None and own.wrong[0]:
        raise BadInput(f"learner '{learner.learner}': {own.wrong[0]} of its action values are not finite")
    return True


_for_process = cache(not_kept)


def _own_rule(rule: Any, work: records.Work, mdp: TabularMDP, learner: LearnerSettings) -> records.OwnRule:
    shape, others = mdp.successor.shape, work.lanes.others
    q = work.lanes.tables.reshape(LANES, *shape)
    settings = records.NumberSettings(**{field: getattr(learner, field) for field in records.NumberSettings._fields})
    return records.OwnRule(
        rule=_compiled("learner", learner.learner, rule, (q[0], settings, 0, 0, 0.0, 0.0, 0, 0)),
        settings=settings,
        q=q,
        others=others.reshape(LANES, -1, *shape) if others.size else np.zeros((LANES, 0, *shape)),
        wrong=np.zeros(1, np.int64),
    )


def _own_gate(
    rules: dict[str, Any], work: records.Work, mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings
) -> records.OwnGate:
    settings = records.GateNumbers(**{field: getattr(gate, field) for field in records.GateNumbers._fields})
    now = GateNow(1, learner.episodes, learner.max_steps, 0, 0.0)
    steps, values = work.sessions.steps.view(), np.zeros((LANES, mdp.n_actions))
    shown = values.view()
    steps.flags.writeable = shown.flags.writeable = False
    return records.OwnGate(
        opens=_compiled("gate", gate.gate, rules["opens_rule"], (1, steps.reshape(-1), now, settings), answers=True),
        asks=_compiled("gate", gate.gate, rules["asks_rule"], (0, shown[0], now, settings), answers=True),
        settings=settings,
        episodes=learner.episodes,
        max_steps=learner.max_steps,
        steps=steps,
        values=values,
        shown=shown,
    )


def _compiled(kind: str, name: str, rule: Any, arguments: tuple[Any, ...], answers: bool = False) -> Any:
    """A rule compiled for such arguments; answers: whether it has to return a bool. Raises TypeError if that cannot be."""
    if rule not in _compiled_rules:
        try:
            made, returns_bool = compiled_rule(rule, arguments)
            _compiled_rules[rule] = made if returns_bool or not answers else None
        except Exception:  # numba raises many kinds
            _compiled_rules[rule] = None
    if _compiled_rules[rule] is None:
        _tell(kind, name, ": numba cannot compile its rule")
        raise TypeError(name)
    return _compiled_rules[rule]


class Uncompiled(Notice):
    """The notice that an added member runs in the session only."""


def tell_uncompiled(learner: str, gate: str) -> None:
    """Tells once for each added learner and gate without a compiled form that its sessions are slow; not in worker processes."""
    if UPDATES.is_added(learner) and UPDATES[learner].compiled is None:
        _tell("learner", learner)
    if GATES.is_added(gate) and GATES[gate].compiled is None:
        _tell("gate", gate)


def _tell(kind: str, name: str, why: str = "") -> None:
    if (kind, name) not in _told and current_process().name == "MainProcess":
        _told.add((kind, name))
        text = f"{kind} '{name}' runs uncompiled, about {TIMES_SLOWER} times slower than shipped ones{why}"
        warnings.warn(text, Uncompiled, stacklevel=3)
