"""The problems of AdviceBench with their learners and the results of their best policies; and problems of the user."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.learning.batch import ChanceTable, run_sessions
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.mdp import FloatArray, TabularMDP, optimal_values
from lab.teaching.subjects import subject_from
from lab_studies.comparisons.advice_bench import layouts

RANDOM_WORLDS = 100
OTHERS = 1000  # the number of the first random world that is held out
WALKS = 480  # walks of the best policy, of which `par` is the mean
COMMON = LearnerSettings(learner="q", alpha=0.95, beta=1.0, episodes=200, max_steps=200)


@dataclass(frozen=True, eq=False)
class Benched:
    """A problem: its table, the random moves if there are any, the learner, and the optimal values (S, A)."""

    name: str
    mdp: TabularMDP
    learner: LearnerSettings
    values: FloatArray
    chances: ChanceTable | None = None

    @property
    def place(self) -> TabularMDP | ChanceTable:
        """The table, or table with chances, in which sessions run."""
        return self.mdp if self.chances is None else self.chances

    @cached_property
    def par(self) -> float:
        """The mean steps of the best policy; an unfinished episode counts as the step limit + 1."""
        best = Advice.of(advice_chances(self.values, 1e-6))
        learner = replace(self.learner, episodes=1)
        seeds = np.arange(WALKS, dtype=np.uint64)
        return float(run_sessions(self.place, learner, GateSettings("always"), best, seeds).steps.mean())


def _table(mdp: TabularMDP, **changes: Any) -> Benched:
    learner = replace(COMMON, **changes)
    return Benched("", mdp, learner, optimal_values(mdp, learner.discount))


def _named(name: str, task: str | None = None, **changes: Any) -> Benched:
    """The problem that `lab teach` has by a name. Raises BadInput for an environment of Gymnasium without a model."""
    subject = subject_from(name, task)
    problem = subject.prepare(0)
    learner = replace(COMMON, max_steps=subject.settings.learner.max_steps, **changes)
    if problem.environment is None:
        return Benched("", problem.mdp, learner, optimal_values(problem.mdp, learner.discount))
    return _of_model(name, problem.mdp, learner)


def _of_model(name: str, mdp: TabularMDP, learner: LearnerSettings) -> Benched:
    import gymnasium

    from lab.gym.transition_model import TransitionModel

    inside: Any = gymnasium.make(name.removeprefix("gym:")).unwrapped
    outcomes = getattr(inside, "P", None)
    if outcomes is None:
        raise BadInput(f"problem '{name}' (--problem): AdviceBench needs a table or a model, and it brings neither")
    starts = np.asarray(inside.initial_state_distrib, np.float64)
    model = TransitionModel(outcomes, starts, mdp.n_actions)
    best = model.optimal(learner.discount)
    if model.certain:
        return Benched("", mdp, learner, best)
    moves = [
        [(chance, entered, reward) for chance, entered, reward, _ in outcomes[state][action]]
        for state in range(mdp.n_states)
        for action in range(mdp.n_actions)
    ]
    return Benched("", mdp, learner, best, ChanceTable(mdp, moves, best))


PROBLEMS: Mapping[str, Callable[[], Benched]] = {
    "world-1": lambda: _named("world-1", learner="afterstate", beta=1.3),
    "world-2": lambda: _named("world-2", learner="afterstate", beta=0.7),
    "random-worlds": lambda: _named("random:10x10x10:0.06:0", learner="afterstate"),
    "insert": lambda: _named("insert", "toast"),
    "transfer": lambda: _named("transfer", "toast"),
    "lake": lambda: _named("gym:FrozenLake-v1", alpha=0.5, beta=0.7, episodes=2000),
    "taxi": lambda: _named("gym:Taxi-v4", episodes=400),
    "cliff": lambda: _named("gym:CliffWalking-v1"),
    "empty": lambda: _table(layouts.minigrid(layouts.EMPTY_ROWS)),
    "door-key": lambda: _table(layouts.minigrid(layouts.DOOR_KEY_ROWS)),
    "lava": lambda: _table(layouts.minigrid(layouts.LAVA_ROWS), beta=0.7),
    "toast-order": lambda: _table(layouts.toast_order(), max_steps=100),
}


# nothing was chosen on these, neither a constant of a rule nor a learner's setting
HELD_OUT: Mapping[str, Callable[[], Benched]] = {
    "other-worlds": lambda: _named(f"random:10x10x10:0.06:{OTHERS}", learner="afterstate"),
    "place": lambda: _named("place", "toast"),
    "butter": lambda: _named("butter", "toast"),
    "far-door": lambda: _table(layouts.minigrid(layouts.FAR_DOOR_ROWS)),
    "four-rooms": lambda: _table(layouts.minigrid(layouts.FOUR_ROOMS_ROWS)),
    "crossing": lambda: _table(layouts.minigrid(layouts.CROSSING_ROWS)),
}
SEVERAL = {"random-worlds": 0, "other-worlds": OTHERS}  # the number of the first world


@lru_cache(maxsize=256)
def problem(name: str, world: int = 0) -> Benched:
    """The problem of a name, or one of the user's own; world: the number of a random one. Raises BadInput for an unknown name."""
    if name in SEVERAL:
        made = _named(f"random:10x10x10:0.06:{SEVERAL[name] + world}", learner="afterstate")
    else:
        known = {**PROBLEMS, **HELD_OUT}
        made = known[name]() if name in known else _named(name)
    return replace(made, name=name)
