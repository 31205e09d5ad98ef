"""Sessions of added learners and gates by their compiled rules, and the notice that a member runs uncompiled."""

import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
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
from lab.learning.kernels.arrays import numbers_of
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
    on_table = learner.tilings == 1
    learns = _learner_rule(learner.learner) if on_table else None
    decides = _gate_rules(gate.gate) if work.asking.gate.opens == OPENS_BY_RULE else ()
    if learns is None and not decides:
        kernel(work, *others, *((None, None) if on_table else (None,)))
        return True
    kind = kernel, learns, decides, types_of((work, *others))
    _episodes[kind] += work.sessions.steps.size
    if _episodes[kind] < WORTH_COMPILING:
        return False
    try:
        own = None if learns is None else _own_rule(work, mdp, learner)
        own_gate = _own_gate(work, mdp, gate) if decides else None
        _for_process(kernel)(work, *others, *((own, own_gate) if on_table else (own_gate,)))
    except Exception:  # whatever a rule raises
        return False
    if own is not None and own.wrong[0]:
        raise BadInput(f"learner '{learner.learner}': {own.wrong[0]} of its action values are not finite")
    return True


_for_process = cache(not_kept)


def _own_rule(work: records.Work, mdp: TabularMDP, learner: LearnerSettings) -> records.OwnRule:
    shape, others = mdp.successor.shape, work.lanes.others
    return records.OwnRule(
        rule=_compiled_learner(learner.learner),
        settings=numbers_of(records.NumberSettings, learner),
        q=work.lanes.tables.reshape(LANES, *shape),
        others=others.reshape(LANES, -1, *shape) if others.size else np.zeros((LANES, 0, *shape)),
        wrong=np.zeros(1, np.int64),
    )


def _own_gate(work: records.Work, mdp: TabularMDP, gate: GateSettings) -> records.OwnGate:
    opens, asks = _compiled_gate(gate.gate)
    values = np.zeros((LANES, mdp.n_actions))
    return records.OwnGate(
        opens=opens,
        asks=asks,
        steps=_to_read(work.sessions.steps),
        values=values,
        shown=_to_read(values),
    )


def _to_read(array: Any) -> Any:
    """The same memory as an array that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


# ---- the rules of members, plain and compiled -------------------------------------------------------------------------


def _learner_rule(name: str) -> Any:
    """The plain rule of a learner; None if it has a form of its own."""
    row = UPDATES[name]
    return plain_rule(row.make) if row.compiled == OWN_RULE else None  # type: ignore[arg-type]


def _gate_rules(name: str) -> tuple[Any, ...]:
    """The plain rules of a gate, which say whether it opens and whether it asks; none if it has a form of its own."""
    form: Any = GATES[name].compiled
    by_rule = form is not None and form.opens == OPENS_BY_RULE
    return tuple(plain_rules(GATES[name].make).values()) if by_rule else ()  # type: ignore[arg-type]


def _compiled_learner(name: str) -> Any:
    """The compiled rule of a learner that is one. Raises TypeError if numba cannot compile it."""
    settings = numbers_of(records.NumberSettings, LearnerSettings())
    return _compiled("learner", name, _learner_rule(name), (np.zeros((1, 1)), settings, 0, 0, 0.0, 0.0, 0, 0))


def _compiled_gate(name: str) -> tuple[Any, Any]:
    """The compiled rules of a gate that has them. Raises TypeError if numba cannot compile them, or they return no bool."""
    opens, asks = _gate_rules(name)
    others = GateNow(1, 1, 1, 0, 0.0), numbers_of(records.GateNumbers, GateSettings())
    steps, values = _to_read(np.zeros(1, np.int32)), _to_read(np.zeros(1))
    return (
        _compiled("gate", name, opens, (1, steps, *others), answers=True),
        _compiled("gate", name, asks, (0, values, *others), answers=True),
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


# ---- the notice -------------------------------------------------------------------------------------------------------


class Uncompiled(Notice):
    """The notice that an added member runs in the session only."""


def tell_uncompiled(learner: str, gate: str, episodes: int = 0) -> None:
    """Tells once for each added learner and gate without a compiled form that its sessions are slow; not in worker processes.

    episodes: how many worker processes are to run, which do not tell: if they are worth it, rules are compiled to see whether
    that can be done.
    """
    for kind, family, name in (("learner", UPDATES, learner), ("gate", GATES, gate)):
        if not family.is_added(name):
            continue
        if family[name].compiled is None:
            _tell(kind, name)
        elif episodes >= WORTH_COMPILING:
            with suppress(TypeError):
                _by_rule[kind](name)


_by_rule: dict[str, Callable[[str], Any]] = {"learner": _compiled_learner, "gate": _compiled_gate}


def _tell(kind: str, name: str, why: str = "") -> None:
    if (kind, name) not in _told and current_process().name == "MainProcess":
        _told.add((kind, name))
        text = f"{kind} '{name}' runs uncompiled, about {TIMES_SLOWER} times slower than shipped ones{why}"
        warnings.warn(text, Uncompiled, stacklevel=3)
