"""What `lab teach gym:...` teaches: the problem that a Gymnasium environment sets, and how it is learned by default."""

from dataclasses import dataclass, replace
from typing import Self

from pydantic import PrivateAttr

from lab.errors import BadInput
from lab.gym.environment_name import GymName, parse_name
from lab.gym.gym_environment import ALONE, MOST_STEPS, ON_TILES, GymEnvironment
from lab.gym.numbered_environment import NumberedEnvironment
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import PhysicsEnvironment
from lab.learning.physics.environment import fitting as fitting_alone
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.tasks.record import Learned
from lab.teaching.lesson import Subject
from lab.teaching.lesson_options import LessonOptions

CERTAIN_EPISODES = (1000, 5000)  # eight for each entry of the table, but at least and at most so many
CHANCE_EPISODES = (5000, 20_000)  # twenty for each entry
CONTINUOUS = GateSettings(window=5, first_episode=10, omega=30, spare_best=True)


class GymWorld(Learned):
    """A Gymnasium environment, by its id and keywords, and how it is learned; made by `gym_world`."""

    name: str
    _environment: GymEnvironment | PhysicsEnvironment = PrivateAttr()

    @classmethod
    def of(cls, environment: GymEnvironment | PhysicsEnvironment, name: GymName) -> Self:
        """The environment with the settings that fit it."""
        learner, gate = fitting(environment)
        made = cls(name=str(name), learner=learner, gate=gate)
        made._environment = environment
        return made

    def problem(self) -> Problem:
        """What it sets to learn."""
        return Problem(self.name, "gym", self._environment.mdp, self._environment)

    def check_members(self, where: str = "") -> None:
        """As `Learned.check_members`; BadInput also for a learner that needs to know where each action leads."""
        super().check_members(where)
        model = self._environment.model if isinstance(self._environment, GymEnvironment) else None
        if self.learner.learner == "afterstate" and not (model is not None and model.certain):
            why = f"where the steps of '{self.name}' lead is not certain, and it looks at the states after them"
            raise BadInput(f"learner 'afterstate' ({where}learner): {why}: wanted another one, such as q")


def gym_world(word: str, where: str = "SUBTASK") -> GymWorld:
    """The environment that "gym:ID?KEYWORD=VALUE&..." means. Raises BadInput in one line for whatever it cannot be."""
    name = parse_name(word, where)
    return GymWorld.of(_own_physics(name) or GymEnvironment(NumberedEnvironment(name, where)), name)


def _own_physics(name: GymName) -> PhysicsEnvironment | None:
    """The lab's own form of an environment, which makes the same steps, and is compiled; None where it has none."""
    most = name.options.get("max_episode_steps")
    own = PHYSICS.get(name.id) if set(name.options) <= {"max_episode_steps"} else None
    if own is None or (most is not None and not (isinstance(most, int) and 1 <= most <= MOST_STEPS)):
        return None
    return PhysicsEnvironment(own if most is None else replace(own, limit=most))


def fitting(environment: GymEnvironment | PhysicsEnvironment) -> tuple[LearnerSettings, GateSettings]:
    """A learner that mostly finds the best policy alone, and a gate; the numbers come from sessions in the toy texts.

    With several starts every state matters, not only those on the way from one: it explores for longer. Where chance has
    a hand in steps, what an episode takes says little about the advice in it: step counts are averaged over more
    episodes, and more misleads tolerated.
    """
    if isinstance(environment, PhysicsEnvironment):
        return fitting_alone(environment.physics), CONTINUOUS
    mdp, model = environment.mdp, environment.model
    if mdp.cells and not mdp.shape:
        return replace(ON_TILES, max_steps=environment.max_steps), CONTINUOUS
    entries, most = mdp.n_states * mdp.n_actions, environment.max_steps
    if model is None or not model.certain:
        gate = GateSettings(window=20, first_episode=40, omega=30, spare_best=True)
        return replace(ALONE, episodes=_within(20 * entries, CHANCE_EPISODES), max_steps=most), gate
    beta = 0.2 if mdp.starts else 0.7
    learner = replace(ALONE, alpha=1.0, beta=beta, episodes=_within(8 * entries, CERTAIN_EPISODES), max_steps=most)
    return learner, GateSettings(spare_best=True)


def _within(number: int, limits: tuple[int, int]) -> int:
    return min(max(number, limits[0]), limits[1])


@dataclass
class GymSubject(Subject):
    """An environment with discrete states and actions; nothing of it is shown beside its table."""

    world: GymWorld

    def __post_init__(self) -> None:
        self.name, self.settings = self.world.name, self.world

    @classmethod
    def of(cls, options: LessonOptions) -> "GymSubject":
        """The environment that the options name."""
        for option, value in (("--task", options.task), ("--sight", options.view)):
            if value is not None:
                raise BadInput(
                    f"{option} {value}: a Gymnasium environment, '{options.subtask}', has none: leave it away"
                )
        return cls(options.changed(gym_world(options.subtask)))

    def prepare(self, seed: int) -> Problem:
        """What the environment sets to learn."""
        return self.world.problem()
