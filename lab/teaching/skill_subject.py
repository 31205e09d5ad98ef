"""A skill of a task as the subject of a lesson: surveyed in its scene, and tried in physics once it is learned."""

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import BoolArray
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.skillset import SkillSet
from lab.skills.trial import trial_of
from lab.tasks.record import Learned
from lab.tasks.task import TAUGHT_WITH, Order, Task
from lab.tasks.task_file import load, names_of
from lab.teaching.lesson import Subject
from lab.teaching.lesson_options import DEFAULT_TASK, LessonOptions
from lab.teaching.named_problems import PROBLEMS
from lab.toolbox.policy import Policy
from lab.view.plots import values_seen


@dataclass
class SkillSubject(Subject):
    """A skill of a task as a subject; skill: its full name; order: the parts in the scene."""

    task: Task
    skill: str
    order: Order
    settings: Learned
    scene: Prepared | None = None

    def __post_init__(self) -> None:
        self.name = self.task.name

    @classmethod
    def of(cls, options: LessonOptions, task: Task | None = None) -> "SkillSubject":
        """The skill that the options name, by its full name or its sub-task; task: default the one that they name."""
        if options.view is not None:
            raise BadInput(f"sight '{options.view}' (--sight): only a world has one, '{options.subtask}' is none")
        task = task or load(options.task or DEFAULT_TASK)
        given = options.toasts is not None or options.parts is not None
        order = task.ordered(options.toasts, options.parts) if given else task.fitting(TAUGHT_WITH)
        wanted = find_skill(SkillSet.of(task, order).skills, options.subtask)
        return cls(task, wanted.name, order, options.changed(task.subtask(wanted.subtask)))

    def prepare(self, seed: int) -> Problem:
        """The skill's problem, surveyed in the scene that the seed lays out."""
        self.scene = prepare(self.task, self.order, seed, self.skill)
        return self.scene.problems[self.skill]

    def tried(self, problem: Problem, policy: Policy) -> str | None:
        """Why the skill failed in physics, None if it did not."""
        assert self.scene is not None
        return trial_of(self.scene)(problem, policy)

    def reach(self) -> BoolArray:
        """The states that the arm can reach."""
        assert self.scene is not None
        return self.scene.reach(self.skill)

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """Draws the values over the picture that the problem was read from, if there is one."""
        assert self.scene is not None
        skill = self.scene.skillset.skills[self.skill]
        photo, path = skill.photo(), out / f"{skill.subtask}-value-map.png"
        if photo is None:
            return {}
        values_seen(policy.q, skill.problem.mdp, photo.picture, photo.seen, path)
        return {"value_map": str(path)}


def find_skill(skills: "dict[str, Skill]", name: str) -> "Skill":
    """The skill of that full name, or the first of that sub-task or process. Raises BadInput, which lists the known ones."""
    if name in skills:
        return skills[name]
    for skill in skills.values():
        if name in (skill.subtask, skill.name.partition(" at ")[0]):
            return skill
    subtasks = sorted({skill.subtask for skill in skills.values()})
    worlds = names_of("world")
    near = get_close_matches(name, [*subtasks, *worlds, *PROBLEMS, *skills], n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    allowed = f"{', '.join(subtasks)}, or one skill's full name, such as '{next(iter(skills))}'"
    allowed += f", or a world: {', '.join(worlds)}"
    allowed += f", or a problem: {', '.join(PROBLEMS)}" if PROBLEMS else ""
    raise BadInput(f"unknown sub-task '{name}' (SUBTASK):{hint} known: {allowed}")
