"""A skill of a task as a problem to clone: its environment in physics, its scripted teacher, and their episodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from lab.cloning.rounds import DEMONSTRATING, Asks, CloningOptions, Policy, seeds_for
from lab.control import ControlEnv, ScriptedTeacher, recording, roll_out
from lab.control.control_env import CONTROL_S
from lab.recordings.episode import Episode, Recording


@dataclass(frozen=True)
class SkillProblem:
    """A skill and the conditions of its episodes; `SkillProblem("toast", "grasp")(policy, seed)` is an episode.

    noise: the standard deviation of the disturbance of each action, as a share of the commanded velocity; seconds: until an
    episode is cut; None: as the skill takes. Raises BadInput when first used.
    """

    task: str = "toast"
    skill: str = "grasp"
    noise: float = 0.1
    seconds: float | None = None

    @cached_property
    def env(self) -> ControlEnv:
        """The environment, with states as observations."""
        return ControlEnv(self.task, self.skill, noise=self.noise, seconds=self.seconds)

    @property
    def fps(self) -> int:
        """Steps a second."""
        return round(1 / CONTROL_S)

    @cached_property
    def teacher(self) -> Policy:
        """The scripted teacher."""
        return ScriptedTeacher(self.env)

    def __call__(self, policy: Policy, seed: int, *, asks: Asks | None = None) -> Episode:
        """The episode of a policy; `asks` says before each step whether the teacher takes it over."""
        return roll_out(self.env, policy, seed, teacher=self.teacher if asks is not None else None, asks=asks)

    def demonstrated(self, options: CloningOptions) -> Recording:
        """The teacher's episodes that a session begins with."""
        seeds = seeds_for(options, DEMONSTRATING, options.demonstrations)
        return self.recorded([roll_out(self.env, self.teacher, seed) for seed in seeds])

    def recorded(self, episodes: Sequence[Episode]) -> Recording:
        """Episodes with the names of the states and actions."""
        return recording(self.env, episodes)

    def close(self) -> None:
        """Frees the physics."""
        if "env" in vars(self):
            self.env.close()
