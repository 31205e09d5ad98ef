"""The problems of AdviceBench with their learners and the results of their best policies; and problems of the user."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.errors import BadInput, WorkFailed
from lab.learning.batch import run_sessions
from lab.learning.chance_table import ChanceTable
from lab.learning.environment import Environment, TableEnvironment, check_solvable, highest_reward
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.mdp import FloatArray, TabularMDP, optimal_values
from lab.teaching.subjects import GYM, Teachable, subject_from
from lab_studies.comparisons.advice_bench import families, layouts
from lab_studies.comparisons.advice_bench.common_learner import COMMON

if TYPE_CHECKING:
    from lab.gym.transition_model import TransitionModel

FIRST = {"random-worlds": 0, "other-worlds": 1000}  # the number of the first of the random worlds
WALKS = 480  # walks of the best policy, of which `par` is the mean


@dataclass(frozen=True, eq=False)
class Benched:
    """A problem: its table, the random moves if there are any, the learner, and the optimal values (S, A)."""

    name: str
    mdp: TabularMDP
    learner: LearnerSettings
    values: FloatArray
    chances: Environment | None = None
    modules: tuple[str, ...] = ()  # of the environment's code, see `lab.files.code_key`

    @property
    def place(self) -> TabularMDP | Environment:
        """The table, or the environment with random moves, in which sessions run."""
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


def _named(name: Teachable, task: str | None = None, **changes: Any) -> Benched:
    """The problem that `lab teach` has by a name, or one made in Python.

    Raises BadInput for an environment of Gymnasium without a model, and for one whose optimal values are unknown.
    """
    subject = subject_from(name, task)
    problem = subject.prepare(0)
    learner = replace(COMMON, max_steps=subject.settings.learner.max_steps, **changes)
    if problem.environment is None:
        return Benched(problem.name, problem.mdp, learner, optimal_values(problem.mdp, learner.discount))
    if highest_reward(problem.environment) is not None:
        raise BadInput(f"problem '{problem.name}' (--problem): AdviceBench counts steps to a goal, and it has none")
    modules = _modules(problem.environment)
    if isinstance(name, str) and name.startswith(GYM):
        model = getattr(problem.environment, "model", None)
        if model is None:
            raise BadInput(f"problem '{name}' (--problem): AdviceBench needs a table or a model, and it brings neither")
        return replace(_of_model(name, model, problem.mdp, learner), modules=modules)
    if problem.mdp.cells != problem.mdp.shape:
        raise BadInput(f"problem '{problem.name}' (--problem): AdviceBench needs a table, and it has continuous states")
    try:
        values = problem.environment.values(learner.discount)
    except WorkFailed as error:
        raise BadInput(f"problem '{problem.name}' (--problem): its optimal values are unknown: {error}") from None
    return Benched(problem.name, problem.mdp, learner, values, problem.environment, modules)


def _modules(environment: Environment) -> tuple[str, ...]:
    """The modules of an environment's code, see `lab.files.code_key`; none for the lab's own."""
    module = type(environment).__module__
    own = () if module.partition(".")[0] in ("lab", "lab_studies") else (module,)
    return tuple(getattr(environment, "modules", own))


def _of_model(name: str, model: "TransitionModel", mdp: TabularMDP, learner: LearnerSettings) -> Benched:
    from lab.gym.environment_name import make, parse_name

    best = model.optimal(learner.discount)
    if model.certain:
        return Benched("", mdp, learner, best)
    inside: Any = make(parse_name(name, "--problem"), "--problem").unwrapped
    outcomes = inside.P
    moves = [
        [(chance, entered, reward) for chance, entered, reward, _ in outcomes[state][action]]
        for state in range(mdp.n_states)
        for action in range(mdp.n_actions)
    ]
    return Benched("", mdp, learner, best, ChanceTable(mdp, moves, best))


def own_problem(given: Teachable) -> Benched:
    """The problem of a world's file, of gym:ID with a model, or of an object made in Python.

    Raises BadInput for one that is no table, and for one whose best policy needs more steps than an episode has; NoPath if
    no path leads to its goal.
    """
    made = _named(str(given) if isinstance(given, Path) else given)
    made = replace(made, name=str(given) if isinstance(given, str | Path) else made.name)
    check_solvable(TableEnvironment(made.place) if isinstance(made.place, TabularMDP) else made.place)
    if made.par > made.learner.max_steps:
        raise BadInput(
            f"problem '{made.name}' (--problem): its best policy needs more than an episode's {made.learner.max_steps} steps"
        )
    return made


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
    # these six were held out until their figures had been published: nothing was chosen on them, but they have been seen
    "other-worlds": lambda: _named(f"random:10x10x10:0.06:{FIRST['other-worlds']}", learner="afterstate"),
    "place": lambda: _named("place", "toast"),
    "butter": lambda: _named("butter", "toast"),
    "far-door": lambda: _table(layouts.minigrid(layouts.FAR_DOOR_ROWS)),
    "four-rooms": lambda: _table(layouts.minigrid(layouts.FOUR_ROOMS_ROWS)),
    "crossing": lambda: _table(layouts.minigrid(layouts.CROSSING_ROWS)),
}
HELD_OUT = tuple(families.FAMILIES)  # nothing was chosen on these; their learner is COMMON as it is
# of those with several instances, how many there are; the sessions are shared out among them
INSTANCES = {**dict.fromkeys(FIRST, 100), **dict.fromkeys(HELD_OUT, 20)}


@lru_cache(maxsize=256)
def problem(name: str, world: int = 0, families_seed: int = families.SEED) -> Benched:
    """The problem of a name, or one of the user's own. Raises BadInput for an unknown name.

    world: the number of a random world, or of an instance of a family; families_seed: of the instances.
    """
    if name in families.FAMILIES:
        made = _instance(name, world, families_seed)
    elif name in FIRST:
        made = _named(f"random:10x10x10:0.06:{FIRST[name] + world}", learner="afterstate")
    else:
        made = PROBLEMS[name]() if name in PROBLEMS else _named(name)
    return replace(made, name=name)


def _instance(family: str, number: int, seed: int) -> Benched:
    drawn = families.drawn(family, number, COMMON, seed)
    return Benched(family, drawn.mdp, COMMON, drawn.values, drawn.chances)


def to_teach(name: str, number: int | None = None) -> Problem:
    """The problem of that name as `lab teach` takes it; number: of an instance of a family, drawn from the default seed."""
    benched = problem(name, number or 0)
    full = name if number is None else f"{name}:{number}"
    return Problem(full, "table", benched.mdp, benched.chances)
