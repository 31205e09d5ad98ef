"""The speed of sessions on tiles in Mountain Car: compiled, readable, and through Gymnasium's own loop."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from lab.gym import parse_name
from lab.gym.gym_environment import GymEnvironment
from lab.gym.numbered_environment import NumberedEnvironment
from lab.learning.batch import run_sessions
from lab.learning.environment import Environment
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import PhysicsEnvironment, fitting
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.learning.splitmix import stream
from lab.studies.findings import Findings, Row, median_row
from lab.studies.runner import Job

NAME, EPISODES, READABLE_EPISODES, REPEATS = "MountainCar-v0", 500, 60, 5
NOBODY = GateSettings("never")
ABOUT = (
    "Steps of MountainCar-v0 per second, one process on one core, median of five runs; compile time is not counted. The learner "
    f"is SARSA(lambda) with replacing traces on eight tilings: {EPISODES} episodes in a session of the kernel, "
    f"{READABLE_EPISODES} in a readable one, on the lab's own physics and on Gymnasium's. 'gymnasium alone' learns nothing and "
    "moves at random."
)


def tiles_speed(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The speeds [thousand steps per second], median of five runs; the reading has no effect."""
    car = PhysicsEnvironment(PHYSICS[NAME])
    learner = replace(fitting(car.physics), episodes=EPISODES)
    short = replace(learner, episodes=READABLE_EPISODES)
    seeds = np.arange(job.seed, job.seed + job.sessions, dtype=np.uint64)

    def readable(place: Environment) -> tuple[int, float]:
        ended_s = list[float]()  # the end of each episode: the judgement after the last one is not counted
        session = Session(place, short, NOBODY, None, stream(job.seed))

        def timed() -> bool:
            ended_s.append(time.perf_counter())
            return False

        session.run(enough=timed)
        return sum(map(sum, session.visits)), ended_s[-1]

    def compiled() -> tuple[int, float]:
        return int(run_sessions(car, learner, NOBODY, None, seeds).moves.sum()), time.perf_counter()

    theirs = GymEnvironment(NumberedEnvironment(parse_name(f"gym:{NAME}", "study"), "study"))
    runs: dict[str, Callable[[], tuple[int, float]]] = {
        "kernel": compiled,
        "session": lambda: readable(car),
        "session through gymnasium": lambda: readable(theirs),
        "gymnasium alone": lambda: _random_steps(job.seed),
    }
    rows = job.in_turn([lambda name=name, run=run: _row(name, run) for name, run in runs.items()])  # type: ignore[misc]
    rates = {row["name"]: row["value"] for row in rows}
    summary: Row = {f"kernel to {name}": round(rates["kernel"] / rates[name], 1) for name in rates if name != "kernel"}
    return Findings(rows, summary, {}, (ABOUT,))


def _random_steps(seed: int) -> tuple[int, float]:
    """The number of steps of READABLE_EPISODES episodes with random moves in Gymnasium's environment, and their end [s]."""
    env, made, draw = gymnasium.make(NAME), 0, stream(seed)
    for episode in range(READABLE_EPISODES):
        env.reset(seed=seed + episode)
        for _ in range(PHYSICS[NAME].limit):
            *_, over, late, _ = env.step(int(draw() * 3))
            made += 1
            if over or late:
                break
    return made, time.perf_counter()


def _row(name: str, run: Callable[[], tuple[int, float]]) -> Row:
    run()  # compiles
    rates = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        moves, ended = run()
        rates.append(moves / (ended - began) / 1e3)
    return median_row({"name": name, "world": NAME}, "speed_thousand steps per s", rates)
