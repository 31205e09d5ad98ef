"""The subject of `lab teach gym:...`: the problem of a Gymnasium environment, and default settings that suit it."""

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

CERTAIN_EPISODES = (1000, 5000)  # limits on 8 episodes per entry of the table, for deterministic steps
CHANCE_EPISODES = (5000, 20_000)  # limits on 20 episodes per entry, for stochastic steps
CONTINUOUS = GateSettings(window=5, first_episode=10, omega=30, spare_best=True)


class GymWorld(Learned):
    """A Gymnasium environment with its settings; `gym_world` makes it from an id and keywords."""

    name: str
    _environment: GymEnvironment | PhysicsEnvironment = PrivateAttr()

    @classmethod
    def of(cls, environment: GymEnvironment | PhysicsEnvironment, name: GymName) -> Self:
        """The environment with settings that suit it."""
        learner, gate = fitting(environment)
        made = cls(name=str(name), learner=learner, gate=gate)
        made._environment = environment
        return made

    def problem(self) -> Problem:
        """The problem that it poses."""
        return Problem(self.name, "gym", self._environment.mdp, self._environment)

    def check_members(self, where: str = "") -> None:
        """Raises BadInput as `Learned.check_members`, and for "afterstate" if the steps are not known to be deterministic."""
        super().check_members(where)
        model = self._environment.model if isinstance(self._environment, GymEnvironment) else None
        if self.learner.learner == "afterstate" and not (model is not None and model.certain):
            why = f"where the steps of '{self.name}' lead is not certain, and it looks at the states after them"
            raise BadInput(f"learner 'afterstate' ({where}learner): {why}: wanted another one, such as q")


def gym_world(word: str, where: str = "SUBTASK") -> GymWorld:
    """The environment that "gym:ID?KEYWORD=VALUE&..." names. Raises BadInput if it cannot be made or is not discrete."""
    name = parse_name(word, where)
    return GymWorld.of(_own_physics(name) or GymEnvironment(NumberedEnvironment(name, where)), name)


def _own_physics(name: GymName) -> PhysicsEnvironment | None:
    """The lab's own compiled form of an environment, which makes the same steps; None if there is none."""
    most = name.options.get("max_episode_steps")
    own = PHYSICS.get(name.id) if set(name.options) <= {"max_episode_steps"} else None
    if own is None or (most is not None and not (isinstance(most, int) and 1 <= most <= MOST_STEPS)):
        return None
    return PhysicsEnvironment(own if most is None else replace(own, limit=most))


def fitting(environment: GymEnvironment | PhysicsEnvironment) -> tuple[LearnerSettings, GateSettings]:
    """Settings of a gate, and of a learner that mostly finds the optimal policy without advice; found in toy-text environments.

    With several starts every state matters, so the learner explores for longer. If steps are stochastic, the steps of one episode
    say little about its advice, so the gate averages over more episodes and tolerates more misleads.
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
    """A Gymnasium environment as the subject of a lesson."""

    world: GymWorld

    def __post_init__(self) -> None:
        self.name, self.settings = self.world.name, self.world

    @classmethod
    def of(cls, options: LessonOptions) -> "GymSubject":
        """The environment that the options name."""
        for option, value in (("--task", options.task), ("--sight", options.view)):
            if value is not None:
                raise BadInput(
                    f"{option} {value}: a Gymnasium environment, '{options.subtask}', has none: remove {option}"
                )
        return cls(options.changed(gym_world(options.subtask)))

    def prepare(self, seed: int) -> Problem:
        """The problem that the environment poses."""
        return self.world.problem()
