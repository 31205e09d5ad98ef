"""Problems that other packages and files add by name, such as "door-key" or "hanoi:3". PROBLEMS is their table.

The lab ships none: its sub-tasks, worlds and Gymnasium's environments have names of their own, which none of these may take.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab.plugins.family import Family, first_line, takes, wanted
from lab.skills import SKILLS
from lab.tasks.grid_world import GridWorld
from lab.tasks.task_file import names_file

WANTED = "a GridWorld, a TabularMDP, a Problem, an environment, or a function or class without arguments that gives one"
MAX_NUMBER = 10**9
FROM_FILE = r"[^\W\d]\w*\.[^\W\d]\w*"  # "mine.made", as `lab.plugins.code_file.take` calls what a file has
Made = GridWorld | TabularMDP | Problem


@dataclass(frozen=True)
class NamedProblem:
    """A problem that has a name.

    help: in one line; make: a function that gives a GridWorld, a TabularMDP, a Problem or an environment (see
    `lab.learning.environment.Environment`).
    numbered: whether the name stands for many instances, such as "hanoi:3"; then `make` takes the instance's number.
    learner: its settings of the learner; None: the lab's.

        >>> import lab
        >>> from lab.teaching.named_problems import NamedProblem
        >>> NamedProblem("A corridor", lambda: lab.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2))).made("corridor").mdp.n_states
        3
    """

    help: str
    make: Callable[..., Any]
    numbered: bool = False
    learner: LearnerSettings | None = None

    def made(self, name: str, number: int | None = None) -> GridWorld | Problem:
        """The world or problem; a table is called `name`. Raises BadInput if `make` gives anything else."""
        thing = self.make() if number is None else self.make(number)
        if isinstance(thing, GridWorld):
            return thing
        full = name if number is None else f"{name}:{number}"
        if isinstance(thing, Problem) and isinstance(thing.mdp, TabularMDP):
            return replace(thing, name=full)
        if isinstance(thing, TabularMDP):
            return Problem(full, "table", thing)
        if _is_environment(thing):
            return Problem(full, "table", thing.mdp, thing)
        raise BadInput(f"problem '{full}': it gives {type(thing).__name__}: wanted {WANTED}")


def _is_environment(thing: Any) -> bool:
    methods = all(callable(getattr(thing, name, None)) for name in ("reset", "step", "picture", "values", "judge"))
    return methods and not isinstance(thing, type) and isinstance(getattr(thing, "mdp", None), TabularMDP)


def _adopted(name: str, thing: Any) -> NamedProblem:
    if ":" in name or names_file(name) or name in SKILLS:
        raise BadInput(f"the name '{name}' is taken" if ":" not in name else f"a name such as '{name}' has no colon")
    if isinstance(thing, NamedProblem):
        return thing
    if isinstance(thing, Made) or _is_environment(thing):
        return NamedProblem(type(thing).__name__, lambda: thing)
    if not (callable(thing) and takes(thing)):
        raise wanted(thing, WANTED)
    return NamedProblem(first_line(thing), thing)


PROBLEMS: Family[NamedProblem] = Family("problems", {}, _adopted)


def is_named(word: str) -> bool:
    """Whether a word is the name of an added problem or of an instance, or that of one whose file was not named."""
    return word.partition(":")[0] in PROBLEMS or bool(re.fullmatch(FROM_FILE, word))


def problem_named(word: str) -> tuple[GridWorld | Problem, LearnerSettings | None]:
    """The problem of a name such as "door-key" or "hanoi:3", and its settings of the learner.

    Raises BadInput for the name of one whose file was not named, a number beside a name that has no instances, and a missing or
    bad number.
    """
    name, colon, number = word.partition(":")
    if name not in PROBLEMS:
        again = f"./{word.replace('.', '.py:', 1)}"
        raise BadInput(
            f"problem '{word}' (SUBTASK): it came from a file, whose code is not run unasked: name it again, such as {again} "
            f"(lab replay: --own {again})"
        )
    member = PROBLEMS[name]
    if not member.numbered:
        if colon:
            raise BadInput(f"problem '{word}' (SUBTASK): '{name}' has no instances: wanted '{name}'")
        return member.made(name), member.learner
    if not re.fullmatch(r"[0-9]{1,9}", number):
        raise BadInput(f"problem '{word}' (SUBTASK): wanted the number of an instance, 0 to {MAX_NUMBER - 1}: {name}:3")
    return member.made(name, int(number)), member.learner
