"""Sessions of added learners by their compiled rule, and the notice that a member runs uncompiled."""

import warnings
from collections.abc import Callable
from functools import cache
from multiprocessing import current_process
from typing import Any

import numpy as np

from lab.errors import BadInput, Notice
from lab.learning.compiled import NotCompilable, inner, not_kept
from lab.learning.gates import GATES
from lab.learning.kernels import records
from lab.learning.kernels.records import LANES
from lab.learning.kernels.session_loop import run
from lab.learning.settings import LearnerSettings
from lab.learning.updates import UPDATES
from lab.learning.updates.update import plain_rule
from lab.mdp import TabularMDP

TIMES_SLOWER = 250  # the session beside the kernel: 275 times with q, 222 with q-lambda, 160 with dyna-q
WORTH_COMPILING = 20_000  # episodes of a learner with a rule of its own: fewer take less time one by one than compiling
_compiled_rules: dict[Any, Any] = {}  # None: numba cannot compile it
_told: set[tuple[str, str]] = set()


def runs_by_rule(work: records.Work, optional: tuple[Any, ...], mdp: TabularMDP, learner: LearnerSettings) -> bool:
    """Runs the sessions of an added learner by its compiled rule; returns False if they have to run one by one.

    That is so if there are too few for what compiling takes, if the rule cannot be compiled, which a notice says, or if it fails:
    then the session shows in which line. Raises BadInput for values that are not finite.
    """
    name, make = learner.learner, UPDATES[learner.learner].make
    rule, episodes = plain_rule(make), work.sessions.steps.size  # type: ignore[arg-type]
    if rule not in _compiled_rules and episodes < WORTH_COMPILING:
        return False
    if rule not in _compiled_rules:
        _compiled_rules[rule] = inner(rule, boundscheck=True)
    if _compiled_rules[rule] is None:
        return False
    shape, tables = mdp.successor.shape, work.lanes.tables
    own = records.OwnRule(
        rule=_compiled_rules[rule],
        settings=records.NumberSettings(**{field: getattr(learner, field) for field in records.NumberSettings._fields}),
        q=tables.reshape(LANES, *shape),
        others=work.lanes.others.reshape(LANES, -1, *shape) if work.lanes.others.size else np.zeros((LANES, 0, *shape)),
        wrong=np.zeros(1, np.int64),
    )
    try:
        _run_by_rule()(work, *optional, own)
    except NotCompilable:
        _compiled_rules[rule] = None
        tell_uncompiled(name, "never", ": numba cannot compile its rule")
        return False
    except Exception:  # whatever the rule raises
        return False
    if own.wrong[0]:
        raise BadInput(f"learner '{name}': {own.wrong[0]} of its action values are not finite")
    return True


@cache
def _run_by_rule() -> Callable[..., None]:
    return not_kept(run)


class Uncompiled(Notice):
    """The notice that an added member runs in the session only."""


def tell_uncompiled(learner: str, gate: str, why: str = "") -> None:
    """Tells once for each added learner and gate without a compiled form that its sessions are slow; not in worker processes."""
    for kind, family, name in (("learner", UPDATES, learner), ("gate", GATES, gate)):
        slow = family.is_added(name) and (why or family[name].compiled is None)
        if slow and (kind, name) not in _told and current_process().name == "MainProcess":
            _told.add((kind, name))
            text = f"{kind} '{name}' runs uncompiled, about {TIMES_SLOWER} times slower than shipped ones{why}"
            warnings.warn(text, Uncompiled, stacklevel=3)
