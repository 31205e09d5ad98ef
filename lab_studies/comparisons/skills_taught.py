"""The skills of a scene reused, fine-tuned or learned one after another, as in a run, but without durations and an order."""

import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from lab.learning.problem import Problem
from lab.mdp import greedy_path
from lab.skills.prepared_scene import Prepared
from lab.skills.trial import trial_of, try_out
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

Key = tuple[str, str]  # sub-task, signature
Known = Mapping[Key, Policy]


class TaughtSkill(NamedTuple):
    """A lesson, its time by the clock, and its time on the processor [s]."""

    lesson: Lesson
    wall_s: float
    cpu_s: float


def policy_key(problem: Problem) -> Key:
    """The key of a policy for this problem."""
    return problem.subtask, problem.mdp.signature


def distinct_problems(prepared: Prepared) -> list[Problem]:
    """The different problems of a scene, each under the name of the skill that has it first."""
    return [*reversed({policy_key(problem): problem for problem in reversed(prepared.problems.values())}.values())]


def taught_skills(prepared: Prepared, known: Known, problems: Iterable[Problem], seed: int = 0) -> list[TaughtSkill]:
    """A lesson for each problem, as in a run; later lessons know the policies of earlier ones."""
    lessons, so_far = [], KnownPolicies.of(known.values())
    with TemporaryDirectory() as folder:
        teacher = Teacher(Toolbox(Path(folder)), seed=seed, trial=trial_of(prepared))
        for problem in problems:
            wall, cpu, how = time.perf_counter(), time.process_time(), prepared.task.subtask(problem.subtask)
            lesson = teacher.find_or_teach(LessonPlan(problem, how.learner, how.gate, prepared.task.name), so_far)
            so_far[lesson.policy.subtask, lesson.policy.signature] = lesson.policy
            lessons.append(TaughtSkill(lesson, time.perf_counter() - wall, time.process_time() - cpu))
    return lessons


def lesson_cost(lesson: Lesson) -> tuple[int, int]:
    """The episodes and helped steps of a lesson; (0, 0) if the policy was reused."""
    return (0, 0) if lesson.result is None else (len(lesson.result.steps), lesson.result.helped_steps)


def reaches_goals(problem: Problem, policy: Policy) -> bool:
    """Whether the greedy path leads to the goal from each start."""
    mdp = problem.mdp
    if policy.q.shape != mdp.successor.shape:
        return False
    return all(greedy_path(policy.q, mdp, mdp.n_states, start)[2] for start in mdp.starts or (mdp.start,))


def is_failing(prepared: Prepared, problem: Problem, policy: Policy) -> bool:
    """Whether a policy's greedy path misses the goal, or its skill fails in physics."""
    skill = prepared.skillset.skills[problem.name]
    return not reaches_goals(problem, policy) or try_out(prepared, skill, policy) is not None
