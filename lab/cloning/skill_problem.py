"""A skill of a task as a problem to clone: its environment in physics, its scripted teacher, and their episodes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

from lab.cloning.rounds import DEMONSTRATING, Asks, CloningOptions, Policy, seeds_for
from lab.control import ControlEnv, ScriptedTeacher, recording, roll_out
from lab.control.control_env import CONTROL_S
from lab.errors import BadInput, shortened
from lab.mentor.demonstrated import shows_what_to_do
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

    def taken(self, recording: Recording, source: str) -> Recording:
        """Somebody's episodes, without pictures and extra features, as demonstrations of this skill.

        source: what an error calls them. Raises BadInput unless they have this skill's states, actions and steps a second, are
        not those of another skill of the task, and one shows what to do.
        """
        if recording.fps != self.fps:
            raise BadInput(f"{source}: {recording.fps} steps a second: wanted {self.fps}")
        for what, found, wanted in (
            ("states", recording.state_names, self.env.state_names),
            ("actions", recording.action_names, self.env.action_names),
        ):
            for a, b in zip_longest(found, wanted, fillvalue="nothing more"):
                if a != b:
                    raise BadInput(
                        f"{source}: its {what} have '{shortened(a, 40)}': wanted '{b}' there, as in {self.skill}"
                    )
        episodes = [episode for episode in recording.episodes if len(episode)]
        for told in sorted({episode.task for episode in episodes}):
            if self.env.skill.is_of_other_kind(told):
                raise BadInput(f"{source}: it shows '{told}': wanted '{self.env.skill.skill.name}'")
        if not any(shows_what_to_do(episode).any() for episode in episodes):
            raise BadInput(f"{source}: it shows nothing: wanted an episode that did not fail, or corrected steps")
        return self.recorded([replace(episode, pictures={}, extra={}) for episode in episodes])

    def close(self) -> None:
        """Frees the physics."""
        if "env" in vars(self):
            self.env.close()
