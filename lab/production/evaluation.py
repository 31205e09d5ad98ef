"""The success rate of a policy: its skill is carried out in physics, in one drawn scene after another."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from lab.errors import BadInput, LabError, counted, unknown
from lab.mdp import TabularMDP, greedy_path
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.skill import NOT_OFF
from lab.skills.skillset import SkillSet
from lab.skills.trial import carry_out
from lab.statistics import proportion_interval
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.toolbox.policy import Policy

PARTS = 3  # of the first kind for which the scene has room, or as many as it holds
Told = Callable[[int, int], None]  # called with the number of finished scenes, and of all
Why = Literal["scene", "table", "physics"]


class SceneResult(NamedTuple):
    """The result of a skill in one scene.

    failed_in: None for success; "scene": the goal cannot be reached; "table": the greedy policy does not lead to it;
    "physics": the skill was carried out, and failed. sim_s: the simulated duration [s].
    """

    seed: int
    failed_in: Why | None
    reason: str | None
    sim_s: float


@dataclass(frozen=True)
class Evaluation:
    """The results of scenes in the order of their seeds, from `seed` on; fewer than `wanted` if it was stopped."""

    policy: str
    skill: str
    task: str
    seed: int
    wanted: int
    scenes: Sequence[SceneResult] = field(default_factory=list)
    wall_s: float = 0.0

    @property
    def interrupted(self) -> bool:
        """Whether the evaluation was stopped before all scenes were done."""
        return len(self.scenes) < self.wanted

    def facts(self) -> dict[str, Any]:
        """The entry for the log: the numbers of solvable and of solved scenes, and Wilson's 95 % interval."""

        counting = [scene for scene in self.scenes if scene.failed_in != "scene"]
        good = [scene for scene in counting if scene.failed_in is None]
        percent, low, high = proportion_interval(len(good), len(counting)) if counting else (None, None, None)
        return {
            "skill": self.skill,
            "task": self.task,
            "seed": self.seed,
            "scenes": len(counting),
            "successes": len(good),
            "success_percent": percent,
            "ci95": None if percent is None else [low, high],
            "mean_sim_s": sum(scene.sim_s for scene in good) / len(good) if good else None,
        }

    def to_json(self) -> dict[str, Any]:
        """The document of `lab toolbox evaluate --json`."""
        rows = [{**scene._asdict(), "success": scene.failed_in is None} for scene in self.scenes]
        ended = {
            "unsolvable": sum(scene.failed_in == "scene" for scene in self.scenes),
            "interrupted": self.interrupted,
        }
        return {"policy": self.policy, **self.facts(), **ended, "wall_s": self.wall_s, "rows": rows}


def evaluate(policy: Policy, task: Task, skill: str, scenes: int, seed: int, told: Told) -> Evaluation:
    """The evaluation of a policy: its skill is carried out in `scenes` scenes of a task, drawn with consecutive seeds.

    After Ctrl-C the scenes until then are returned. Raises KeyboardInterrupt if there are none, and BadInput if the policy's
    table has not the skill's size and actions.
    """
    began, done = time.perf_counter(), list[SceneResult]()
    try:
        for number in range(scenes):
            told(number, scenes)
            done.append(in_scene(policy, task, skill, seed + number))
        told(scenes, scenes)
    except KeyboardInterrupt:
        if not done:
            raise KeyboardInterrupt("stopped by Ctrl-C before a scene was done") from None
    return Evaluation(policy.name, skill, task.name, seed, scenes, done, time.perf_counter() - began)


def in_scene(policy: Policy, task: Task, name: str, seed: int) -> SceneResult:
    """The result in the scene of one seed; at its first station a part stands off its spot as drawn."""
    try:
        prepared = prepare(task, task.fitting(PARTS), seed, name)
    except BadInput as error:
        return SceneResult(seed, "scene", str(error), 0.0)
    skill, mdp = prepared.skillset.skills[name], prepared.problems[name].mdp
    check_table(policy, name, mdp)
    lost = _starts_without_a_way(policy, mdp)
    if lost and lost == _starts(mdp):
        return SceneResult(seed, "table", _astray(policy, mdp, lost[0]), 0.0)
    try:
        failure, sim_s = carry_out(prepared, skill, policy, _off(prepared, skill))
    except LabError as error:
        failure, sim_s = str(error), 0.0
    if failure is None:
        return SceneResult(seed, None, None, sim_s)
    return SceneResult(seed, "table" if lost else "physics", failure, sim_s)


def check_table(policy: Policy, skill: str, mdp: TabularMDP) -> None:
    """Raises BadInput unless a policy's table has the states and actions of a skill's problem."""
    if policy.q.shape != (mdp.n_states, mdp.n_actions) or policy.action_labels != mdp.action_labels:
        raise BadInput(
            f"policy '{policy.name}' is for {len(policy.q)} states and the actions {', '.join(policy.action_labels)}; "
            f"'{skill}' has {mdp.n_states} states and the actions {', '.join(mdp.action_labels)}"
        )


def _starts(mdp: TabularMDP) -> list[int]:
    return list(mdp.starts) or [mdp.start]


def _starts_without_a_way(policy: Policy, mdp: TabularMDP) -> list[int]:
    """The starts from which the greedy policy does not reach the goal."""
    return [start for start in _starts(mdp) if not greedy_path(policy.q, mdp, mdp.n_states, start)[2]]


def _astray(policy: Policy, mdp: TabularMDP, start: int) -> str:
    """The place to which the greedy policy leads instead of the goal, in words."""
    last = greedy_path(policy.q, mdp, mdp.n_states, start)[0][-1]
    where = "run into something at" if mdp.terminal[last] else "go round and round at"
    return f"its best moves from {mdp.state_label(start)} {where} {mdp.state_label(last)}"


def _off(prepared: Prepared, skill: Skill) -> tuple[float, float, float]:
    """The offset x, y [m] and yaw [rad] of the skill's part from its spot.

    It is the drawn one at a part's first station, and 0 elsewhere, because the robot has set the part down.
    """
    stand = zip(prepared.order, prepared.layout.parts, strict=True)
    first = (off for kind, off in stand if prepared.task.starts(kind) == skill.station)
    return NOT_OFF if skill.carries else next(first, NOT_OFF)


def task_of(policy: Policy, file: str | None) -> Task:
    """The task of the given name, or the one in which the policy was learned. Raises BadInput."""
    if file is not None:
        return load(file)
    try:
        return load(policy.task)
    except BadInput as error:
        raise BadInput(
            f"policy '{policy.name}' was learned in '{policy.task}', which is no task here: name one (--task): {error}"
        ) from error


def skill_of(policy: Policy, task: Task, name: str | None) -> str:
    """The full name of the skill that a policy is for in a task.

    It is the named skill, or the longest name that begins the policy's name, or the only skill of its sub-task. BadInput
    lists the known ones.
    """
    skills = SkillSet.of(task, task.fitting(PARTS)).skills
    own = [known for known, skill in skills.items() if skill.subtask == policy.subtask]
    if name is not None:
        if name not in skills:
            raise unknown("skill", name, own or skills, f"--skill, task '{task.name}'")
        return name
    called = [known for known in own if f"{policy.name} ".startswith(f"{known} ")]
    if called or len(own) == 1:
        return max(called or own, key=len)
    if not own:
        raise BadInput(f"policy '{policy.name}': task '{task.name}' has no skill for the sub-task '{policy.subtask}'")
    raise BadInput(
        f"policy '{policy.name}': which of {counted(len(own), 'skill')} for '{policy.subtask}' it is for does not follow "
        f"from its name: give --skill: {', '.join(sorted(own))}"
    )
