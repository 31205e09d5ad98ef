"""The learners: update rules on action-value tables, one file a family."""

from collections.abc import Callable
from typing import Any

import numpy as np

from lab.learning.members import Member
from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.updates.linear import LINEAR
from lab.learning.updates.tabular import Afterstate, DynaQ, MonteCarlo, QLearning, Sarsa, SarsaLambda, WatkinsQLambda
from lab.learning.updates.update import ACTION_VALUES, STATE_VALUES, Row, Table, Update
from lab.mdp import FloatArray, TabularMDP
from lab.plugins.family import Family, first_line, takes, wanted

__all__ = ["LINEAR", "UPDATES", "Row", "Table", "Update", "scattered", "update_of"]

Learner = Callable[[list[Row], LearnerSettings, TabularMDP], Update]

LEARNER_TAKES = ("q", "settings", "mdp")


def _adopted(name: str, thing: Any) -> Member[Learner]:
    if not (isinstance(thing, type) and issubclass(thing, Update) and takes(thing, *LEARNER_TAKES)):
        raise wanted(thing, f"a subclass of lab.Update that is made with {', '.join(LEARNER_TAKES)}")
    return Member(thing, first_line(thing))


_SHIPPED: dict[str, Member[Learner]] = {
    "q": Member(QLearning, "Q-learning: what a move is worth is judged by the best move after it", ACTION_VALUES),
    "sarsa": Member(Sarsa, "as q, but judged by the move that is really made next"),
    "q-lambda": Member(WatkinsQLambda, "as q, with traces: each step corrects the moves before it, too"),
    "sarsa-lambda": Member(SarsaLambda, "as sarsa, with traces: each step corrects the moves before it, too"),
    "dyna-q": Member(
        DynaQ, "as q, and each step is followed by learning from earlier ones again, out of a model of them"
    ),
    "monte-carlo": Member(MonteCarlo, "moves are judged by the whole rest of the episode"),
    "afterstate": Member(
        Afterstate, "learns what the states are worth that moves lead to, not the moves", STATE_VALUES
    ),
}
UPDATES = Family("learners", _SHIPPED, _adopted)


def update_of(settings: LearnerSettings, mdp: TabularMDP, q: FloatArray) -> Update:
    """The learner that the settings name, on a table or on tiles; it begins with the values q (S, A)."""
    if settings.tilings > 1:
        return LINEAR[settings.learner](q, settings, mdp)
    return UPDATES[settings.learner].make(q.tolist(), settings, mdp)


def scattered(settings: LearnerSettings, mdp: TabularMDP, draw: Draw, tables: int) -> list[Update]:
    """So many learners as the settings name, whose start values are drawn within +-0.5."""
    made = [update_of(settings, mdp, np.zeros(mdp.successor.shape)) for _ in range(tables)]
    for one in made:
        one.scatter(draw)
    return made
