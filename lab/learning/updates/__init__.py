"""The learners: update rules for action values, on a table or on tiles. UPDATES is their table, LINEAR that for tiles."""

from collections.abc import Callable
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.learning.members import Member
from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.updates.linear import LINEAR
from lab.learning.updates.tabular import Afterstate, DynaQ, MonteCarlo, QLearning, Sarsa, SarsaLambda, WatkinsQLambda
from lab.learning.updates.update import (
    AFTERSTATE,
    DYNA,
    OWN_RULE,
    Q_TRACES,
    SARSA,
    SARSA_TRACES,
    Q,
    Row,
    RuleUpdate,
    Table,
    Update,
    is_rule_only,
)
from lab.mdp import FloatArray, TabularMDP
from lab.plugins.family import Family, first_line, takes, takes_generator, wanted

__all__ = ["LINEAR", "UPDATES", "Row", "RuleUpdate", "Table", "Update", "scattered", "update_of"]

Learner = Callable[..., Update]  # made with (q, settings, mdp)

LEARNER_TAKES = ("q", "settings", "mdp")


def _adopted(name: str, thing: Any) -> Member[Learner]:
    is_learner = isinstance(thing, type) and issubclass(thing, Update)
    if not (is_learner and (takes(thing, *LEARNER_TAKES) or takes_generator(thing))):
        raise wanted(thing, f"a subclass of lab.Update that is made with {', '.join(LEARNER_TAKES)}, and perhaps rng")
    return Member(thing, first_line(thing), OWN_RULE if is_rule_only(thing) else None)


_SHIPPED: dict[str, Member[Learner]] = {
    "q": Member(QLearning, "Q-learning: the value of a move follows from the best move after it", Q),
    "sarsa": Member(Sarsa, "as q, but from the move that is actually made next", SARSA),
    "q-lambda": Member(WatkinsQLambda, "as q, with traces: each step corrects the moves before it, too", Q_TRACES),
    "sarsa-lambda": Member(
        SarsaLambda, "as sarsa, with traces: each step corrects the moves before it, too", SARSA_TRACES
    ),
    "dyna-q": Member(
        DynaQ, "as q, and each step is followed by learning from earlier ones again, out of a model of them", DYNA
    ),
    "monte-carlo": Member(MonteCarlo, "the value of a move follows from all rewards in the rest of the episode"),
    "afterstate": Member(
        Afterstate, "learns values of the states that moves lead to, instead of values of moves", AFTERSTATE
    ),
}
UPDATES = Family("learners", _SHIPPED, _adopted)


def update_of(settings: LearnerSettings, mdp: TabularMDP, q: FloatArray, draw: Draw) -> Update:
    """The learner that the settings name, on a table or on tiles, with the start values q (S, A).

    An added class that takes `rng` gets a generator, which is seeded by `draw`. Raises BadInput, which names the learner, if the
    `q` of an added class has another shape.
    """
    name = settings.learner
    if settings.tilings > 1:
        return LINEAR[name](q, settings, mdp)
    make, values = UPDATES[name].make, q.tolist()
    if not UPDATES.is_added(name):
        return make(values, settings, mdp)
    given = {"rng": np.random.default_rng(int(draw() * 2**53))} if takes_generator(make) else {}
    learner = make(values, settings, mdp, **given)
    table: Any = getattr(learner, "q", None)
    shape = np.shape(table)
    if shape != q.shape:
        raise BadInput(f"learner '{name}': its `q` has the shape {shape}: wanted {q.shape}, states by actions")
    return learner


def scattered(settings: LearnerSettings, mdp: TabularMDP, draw: Draw, tables: int) -> list[Update]:
    """`tables` independent learners of the kind that the settings name, with start values drawn within +-0.5."""
    learners = [update_of(settings, mdp, np.zeros(mdp.successor.shape), draw) for _ in range(tables)]
    for learner in learners:
        learner.scatter(draw)
    return learners
