"""The cost of a mentor at each step of a rollout, by rule: `python -m devtools.mentor_cost`.

A mentor learns from as many steps as it looks up at most, of drawn numbers that change as those of a robot do: smoothly, few of
them independent. It is then called as in a rollout, at each step of other episodes, and of the same ones after each number was
pushed off its way by three standard deviations on average. Time is that of the process: what others on this computer take is
left out, but for the caches that they clear. Set OPENBLAS_NUM_THREADS=1, as threads would be counted together.
"""

import time
from dataclasses import replace
from typing import Annotated

import numpy as np
import typer

from lab.mentor.demonstrated import MOST_STEPS
from lab.mentor.doubts import DOUBTS
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording

LENGTH, WAYS, CHUNK = 400, 6, 16  # steps an episode; numbers that are independent; actions a plan
KINDS = ((14, 7), (50, 7))  # states and actions


def drawn(rng: np.random.Generator, episodes: int, widths: tuple[int, int]) -> list[Episode]:
    """Episodes whose states and actions are sums of a few smooth curves, and a little noise; every second fails."""
    mixing = rng.normal(size=(WAYS, sum(widths)))
    times, made = np.linspace(0.0, 1.0, LENGTH)[:, None], []
    for number in range(episodes):
        frequency, phase = rng.uniform(0.5, 3.0, WAYS), rng.uniform(0.0, 2.0 * np.pi, WAYS)
        curves = np.sin(2.0 * np.pi * times * frequency + phase) @ mixing
        rows = (curves + rng.normal(0.0, 0.05, curves.shape)).astype(np.float32)
        chunks = {"chunk": np.repeat(rows[:, None, widths[0] :], CHUNK, axis=1)}
        states, actions = rows[:, : widths[0]], rows[:, widths[0] :]
        made.append(Episode("move", states, actions, np.zeros(LENGTH, bool), number % 2 > 0, extra=chunks))
    return made


def cost(mentor: Mentor, episodes: list[Episode]) -> str:
    """The microseconds that a call takes, in words."""
    spent = []
    for episode in episodes:
        mentor.begin()
        for state, action, chunk in zip(episode.states, episode.actions, episode.extra["chunk"], strict=True):
            began = time.process_time_ns()
            mentor(state, action, chunk=chunk)
            spent.append((time.process_time_ns() - began) / 1000.0)
    return f"median {np.median(spent):5.0f}, p99 {np.quantile(spent, 0.99):5.0f}"


def pushed(rng: np.random.Generator, episode: Episode) -> Episode:
    """The episode with states off the way."""
    far = 3.0 * rng.normal(size=episode.states.shape[1]) * episode.states.std(axis=0)
    states = (episode.states + far).astype(np.float32)
    return Episode(episode.task, states, episode.actions, episode.corrected, False, extra=episode.extra)


def main(
    episodes: Annotated[int, typer.Option(min=2, help="how many episodes are measured")] = 5,
    seed: Annotated[int, typer.Option(help="of all draws")] = 0,
) -> None:
    """Print the cost of a mentor at each step of a rollout, by rule."""
    rng = np.random.default_rng(seed)
    for widths in KINDS:
        made = drawn(rng, MOST_STEPS // LENGTH + 2 * episodes, widths)
        tried, held, shown = made[:episodes], made[episodes : 2 * episodes], made[2 * episodes :]
        state_names, action_names = (tuple(map(str, range(width))) for width in widths)
        shown = [replace(episode, success=True) for episode in shown]
        recording = Recording(30, "drawn", state_names, action_names, shown)
        off = [pushed(rng, episode) for episode in held]
        typer.echo(f"{widths[0]} states, {widths[1]} actions, {sum(map(len, shown))} steps learned from; us a call:")
        for rule in DOUBTS:
            mentor = Mentor.learn(recording, rule, rollouts=tried, seed=seed)
            typer.echo(f"  {rule:12} on the way {cost(mentor, held)}; off it {cost(mentor, off)}")


if __name__ == "__main__":
    typer.run(main)
