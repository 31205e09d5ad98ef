"""The contract of skills: the problem is solvable from every start, is the same each time, and succeeds in physics."""

from dataclasses import replace

import numpy as np

from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import greedy_path, optimal_values, shortest_steps
from lab.skills import SKILLS, Skill
from lab.tasks.task_file import load
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.skill_subject import SkillSubject
from lab.testing.requirement import require
from lab.toolbox.policy import Origin, Policy


def check_skill(skill: str | type[Skill], task: str = "toast") -> None:
    """Tests a skill, given by sub-task or class, in a task that needs it: PyBullet carries it out with the optimal table."""
    subtask = skill if isinstance(skill, str) else skill.subtask
    if not isinstance(skill, str) and subtask not in SKILLS:
        SKILLS.adopted(subtask, skill, "check_skill")
        try:
            check_skill(subtask, task)
        finally:
            del SKILLS[subtask]
        return
    require(bool(SKILLS[subtask].help), f"skill '{subtask}': it has no `help`")
    subject, again = (SkillSubject.of(LessonOptions(subtask), load(task)) for _ in range(2))
    problem = subject.prepare(0)
    mdp, what = problem.mdp, f"skill '{problem.name}' of '{task}'"
    require(problem.subtask == subtask, f"{what}: its problem is of '{problem.subtask}'")
    require(again.prepare(0).mdp.signature == mdp.signature, f"{what}: the same scene gives another problem")
    require(shortest_steps(mdp) > 0, f"{what}: it begins at its goal")
    q = optimal_values(mdp, 0.99)
    for start in (mdp.start, *mdp.starts):
        require(
            greedy_path(q, mdp, mdp.n_states, start)[2],
            f"{what}: no path to the goal leads from {mdp.state_label(start)}",
        )
    learner, gate = LearnerSettings(episodes=1, max_steps=1), GateSettings("never")
    result = Session(problem.environment or mdp, learner, gate, None, np.random.default_rng(0)).run()
    policy = Policy.of(result, mdp, learner, gate, Origin("best", subtask, task, "none", 0))
    failure = subject.tried(problem, replace(policy, q=q, solved=True))
    require(failure is None, f"{what}: in physics: {failure}")
