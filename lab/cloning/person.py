"""A person as the teacher of a clone: who demonstrates and takes over, asked once a second what the tool has to do."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import atan2, degrees
from typing import Any

import numpy as np

from lab.cloning.rounds import DEMONSTRATING, Action, Asks, CloningOptions, Corrected, Policy, seeds_for
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.takeover_command import TakeoverCommand
from lab.control import ControlEnv, ScriptedTeacher, roll_out
from lab.control.control_env import CONTROL_S
from lab.control.control_scene import LIFTED_M, REACHED_M, REACHED_RAD
from lab.control.controlled_skill import Aim
from lab.errors import WorkFailed
from lab.mentor.mentor import Question
from lab.recordings.episode import Episode

TRIES = 100  # a demonstration that is wanted: episodes in which a person may fail


class PersonRollouts:
    """Episodes of a problem in which a person takes over; `on_step` hears of each step of an episode with a teacher."""

    def __init__(
        self, problem: SkillProblem, steps: int, ask: "Ask", on_step: Callable[[ControlEnv], None] = lambda env: None
    ) -> None:
        self.problem, self.on_step = problem, on_step
        self.teacher = PersonTeacher(problem.env, steps, ask)

    def __call__(self, policy: Policy, seed: int, *, asks: Asks | None = None) -> Episode:
        """The episode of a policy."""
        if asks is None:
            return self.problem(policy, seed)
        self.teacher.begin()

        def heard(observation: Any, action: Action) -> bool:
            self.on_step(self.problem.env)
            return asks(observation, action)

        return roll_out(self.problem.env, policy, seed, teacher=self.teacher, asks=heard)

    def demonstrations(self, options: CloningOptions, begun: Sequence[Corrected] = ()) -> Iterator[Corrected]:
        """The person's demonstrations after those begun, until there are as many as wanted; one that fails is left out.

        Each comes with its number of commands and its place among the seeds. Raises WorkFailed if too few of TRIES times as many
        episodes end well.
        """
        good, seeds = len(begun), seeds_for(options, DEMONSTRATING, TRIES * options.demonstrations)
        failed = False
        for place in range(begun[-1].place + 1 if begun else 0, len(seeds)):
            if good >= options.demonstrations:
                return
            why = "The one before did not end well, and does not count." if failed else ""
            self.teacher.begin(f"Demonstration {good + 1} of {options.demonstrations}", why)
            episode = roll_out(self.problem.env, self._demonstrating, seeds[place])
            failed = not episode.success
            if not failed:
                good += 1
                yield Corrected(place, self.teacher.asked, episode)
        if good < options.demonstrations:
            raise WorkFailed(f"{good} of {options.demonstrations} demonstrations ended well in {len(seeds)} episodes")

    def _demonstrating(self, observation: Any) -> Action:
        self.on_step(self.problem.env)
        return self.teacher(observation)

    def hear(self, question: Question) -> None:
        """The mentor asks: the person will be told why."""
        self.teacher.why = question.why


@dataclass(frozen=True)
class Situation:
    """What a person is told: the mentor's reason, where the part or its place is from the tool, the fingers, and what is wanted.

    demonstration: which one the person gives; empty where the clone asks.
    """

    why: str
    where: str
    fingers: str
    wanted: str
    demonstration: str = ""

    def __str__(self) -> str:
        return f"{self.where} {self.fingers} {self.wanted}"


Ask = Callable[[Situation], TakeoverCommand]


class PersonTeacher:
    """A person who gives one command for each takeover of `steps` steps; `ask` returns it.

    why: the mentor's reason for its last question, as the session tells it; asked: commands in this episode.
    """

    def __init__(self, env: ControlEnv, steps: int, ask: Ask) -> None:
        self.env, self.steps, self.ask = env, steps, ask
        self._scripted = ScriptedTeacher(env)
        self.begin()

    def begin(self, demonstration: str = "", why: str = "") -> None:
        """An episode begins; `demonstration`: which one, if the person gives all of its actions."""
        self.demonstration, self.why = demonstration, why
        self.asked = self._left = 0
        self._command = TakeoverCommand()

    def __call__(self, observation: Any) -> np.ndarray[Any, Any]:
        """The action of the next step of a takeover; the person is asked in its first."""
        if self._left == 0:
            self._command, self._left = self.ask(situation(self.env, self.why, self.demonstration)), self.steps
            self.asked += 1
            self._velocity = self._command.velocity(self.env.tool.yaw, self.steps * CONTROL_S)
        self._left -= 1
        if self._command.by_teacher:
            return self._scripted(observation)
        close = self.env.closes if self._command.close is None else self._command.close
        return self.env.action(self._velocity, close)


def situation(env: ControlEnv, why: str, demonstration: str = "") -> Situation:
    """The situation of an environment now."""
    state = dict(zip(env.state_names, env.state().tolist(), strict=True))
    what = "part" if env.skill.aim is Aim.TAKE else "goal"
    ahead, left, up = (100.0 * state[f"{what} {axis}"] for axis in ("ahead", "left", "up"))
    turn = degrees(atan2(state[f"sin {what} yaw"], state[f"cos {what} yaw"]))
    parts = [
        _by(ahead, "cm ahead", "cm back"),
        _by(left, "cm to the left", "cm to the right"),
        _by(up, "cm above", "cm below"),
        _by(turn, "degrees turned to the left", "degrees turned to the right"),
    ]
    name = {Aim.TAKE: "The part", Aim.SET_DOWN: "The place of the part", Aim.REACH: "The goal"}[env.skill.aim]
    opening = "closed" if env.closes else "open"
    touching = state["left touches"] + state["right touches"]
    holds = {0.0: "nothing touches them", 1.0: "one of them touches the part", 2.0: "both touch the part"}[touching]
    wanted = {
        Aim.TAKE: f"the fingers closed on the part, and lifted by {100 * LIFTED_M:g} cm",
        Aim.SET_DOWN: f"the part in its place, then the open fingers {100 * LIFTED_M:g} cm above",
        Aim.REACH: f"the tool within {100 * REACHED_M:g} cm and {degrees(REACHED_RAD):.1f} degrees of the goal",
    }[env.skill.aim]
    if env.skill.aim is Aim.REACH and env.skill.skill.carries:
        wanted += ", the part between the fingers"
    fingers = f"The fingers are {opening}; {holds}."
    return Situation(why, f"{name} is {', '.join(parts)}.", fingers, f"Wanted: {wanted}.", demonstration)


def _by(value: float, positive: str, negative: str) -> str:
    return f"{abs(value):.1f} {positive if value >= 0.0 else negative}"
