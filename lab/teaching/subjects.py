"""The subjects of lessons, by name or object: worlds, skills, Gymnasium environments, tables, added problems; `lab.world`."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from pydantic import ValidationError

from lab.errors import BadInput, check_value
from lab.learning.problem import Problem
from lab.mdp import TabularMDP
from lab.skills import SKILLS
from lab.tasks.grid_world import GridWorld, from_rows
from lab.tasks.record import NAME_PATTERN, Learned
from lab.tasks.task_file import names_file
from lab.teaching.lesson import Subject
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.named_problems import is_named, problem_named
from lab.teaching.skill_subject import SkillSubject
from lab.teaching.world_subject import WorldSubject
from lab.toolbox.policy import Policy
from lab.view.plots import grid_values

if TYPE_CHECKING:
    from lab.teaching.kept_session import KeptSession

GYM = "gym:"  # the prefix of `lab.gym`, which is slow to import and therefore imported for such names only
Teachable = str | Path | GridWorld | TabularMDP | Problem
KINDS = "a name, a GridWorld, a TabularMDP or a Problem"


@dataclass
class TableSubject(Subject):
    """A problem that was made in Python, or that has a name which another package or a file adds."""

    problem: Problem

    def __post_init__(self) -> None:
        given = {"learner": self.problem.learner, "gate": self.problem.gate}
        self.name = self.problem.name
        self.settings = Learned.model_validate({name: value for name, value in given.items() if value is not None})

    def prepare(self, seed: int) -> Problem:
        """The problem. Raises BadInput for the learner "afterstate" where steps are stochastic."""
        if self.settings.learner.learner == "afterstate" and not getattr(self.problem.environment, "certain", True):
            why = f"where the steps of '{self.name}' lead is not certain, and it looks at the states after them"
            raise BadInput(f"learner 'afterstate': {why}: wanted another one, such as q")
        return self.problem

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """Draws the values of a grid with two axes."""
        mdp, path = self.problem.mdp, out / "value-map.png"
        if len(mdp.shape) != 2 or mdp.coverage_shape:
            return {}
        grid_values(policy.q, mdp, path)
        return {"value_map": str(path)}


def world(rows: str, name: str = "world", *, deadly: bool = False) -> GridWorld:
    """A grid world from its rows of cells: '.' free, '#' obstacle, one 'S' (start), one 'G' (goal).

    deadly: whether an obstacle ends the episode, as the line "deadly = true" above the rows says, too; default: it blocks, the
    robot stays where it is, and the move costs a step.
    name: 1 to 40 letters, digits, spaces, - and _.
    Raises BadInput for other characters or rows of different lengths, and NoPath if no path joins start and goal.

        >>> import lab
        >>> maze = lab.world("S.#\\n..G", name="maze")
        >>> maze.shape, maze.start, maze.goal, maze.obstacles, maze.mdp().n_states
        ((2, 3), (0, 0), (1, 2), ((0, 2),), 6)
    """
    check_value("rows", rows, str, "lab.world")
    if not isinstance(name, str) or not re.match(NAME_PATTERN, name):
        raise BadInput(f"name {name!r} (lab.world): wanted 1 to 40 letters, digits, spaces, - and _")
    check_value("deadly", deadly, bool, "lab.world")
    lines = [line.strip() for line in rows.strip().splitlines()]
    return from_rows("\n".join(lines), name, f"world '{name}'", deadly)


def subject_from(problem: Teachable, task: str | None = None, sight: str | None = None) -> Subject:
    """The subject for a name as in `lab teach`, or for a world or problem itself. Raises BadInput for anything else."""
    if isinstance(problem, str | Path):
        return subject_of(LessonOptions(str(problem), task, sight).complete())
    if task is not None:
        raise BadInput(f"task '{task}' beside {type(problem).__name__}: only a sub-task's name belongs to one")
    if isinstance(problem, GridWorld):
        return WorldSubject(problem, sight or "full")
    if sight is not None:
        raise BadInput(f"sight '{sight}' beside {type(problem).__name__}: only a world has one")
    if isinstance(problem, TabularMDP):
        problem = Problem("problem", "table", problem)
    if isinstance(problem, Problem):
        if not isinstance(problem.mdp, TabularMDP):
            raise BadInput(f"mdp {problem.mdp!r} of the problem '{problem.name}': wanted a TabularMDP")
        return TableSubject(problem)
    raise BadInput(f"problem {problem!r} ({type(problem).__name__}): wanted {KINDS}")


def subject_of(options: LessonOptions, kept: "KeptSession | None" = None) -> Subject:
    """The subject that the options name: an environment, a world, an added problem or a skill. Raises BadInput for bad options.

    If the options come from a stored session (`kept`), a module that they name is imported only if the user trusts it.
    """
    if options.subtask.startswith(GYM):
        from lab.gym import parse_name

        module = "" if kept is None else parse_name(options.subtask, kept.where).module
        if kept is not None and module and module not in kept.trusted:
            raise BadInput(
                f"journal '{kept.read.path}' ({kept.where}): it names the module '{module}', whose code would run: if you "
                f"trust whoever made it, say --trust-module {quote(module)}"
            )
        from lab.teaching.gym_subject import GymSubject

        return GymSubject.of(options)
    if names_file(options.subtask):
        return WorldSubject.of(options)
    if kept is not None and kept.table is not None:
        return _kept_subject(options, kept, kept.table)
    if options.task is None and options.subtask not in SKILLS and is_named(options.subtask):
        return _named_subject(options)
    return SkillSubject.of(options)


def _kept_subject(options: LessonOptions, kept: "KeptSession", problem: Problem) -> Subject:
    """A problem whose code is not here, as the session's folder holds it, with the settings in its journal."""
    head = kept.read.session
    subject = TableSubject(replace(problem, name=head.problem))
    try:
        settings = Learned.model_validate({"learner": head.learner, "gate": head.gate})
    except ValidationError:
        raise BadInput(
            f"journal '{kept.read.path}' ({kept.where}): its learner and gate are none of this lab"
        ) from None
    subject.settings = options.changed(settings)
    return subject


def _named_subject(options: LessonOptions) -> Subject:
    made, learner = problem_named(options.subtask)
    if isinstance(made, GridWorld):
        return WorldSubject(options.changed(made), options.view or "full")
    if options.view is not None:
        raise BadInput(f"sight '{options.view}' (--sight): only a world has one, '{options.subtask}' is none")
    subject = TableSubject(made)
    if learner is not None:
        subject.settings = Learned(learner=learner)
    subject.settings = options.changed(subject.settings)
    return subject
