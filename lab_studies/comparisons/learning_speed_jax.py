"""The rival of the speed benchmark in jax: all sessions side by side in one compiled program."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from time import perf_counter
from typing import Any

import numpy as np

from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab_studies.comparisons.learning_speed_session import MOVES, Measured, Missing, Session, batch_sizes, session_of

LANES = 500  # sessions side by side; the tables of more do not stay in the cache
FEWEST_LANES = 64  # fewer lanes are not halved again


def jax_lock_step(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The measurement of sessions side by side in a compiled jax program, in a process of its own with one thread."""
    job = session_of(mdp, settings, sessions)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        try:
            return pool.submit(_measure_jax, job, sessions, seed).result()
        except BrokenProcessPool:
            raise Missing("jax: its process ended early") from None


def _measure_jax(job: Session, sessions: int, seed: int) -> Measured:
    os.environ |= {"NPROC": "1", "JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}  # one thread; read as jax starts
    try:
        import jax  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise Missing(f"jax cannot be imported: {error}") from None
    rng = np.random.default_rng(seed)
    streams = [rng.integers(0, 2**64, lanes, np.uint64) for lanes in batch_sizes(sessions, LANES)]
    sizes = {len(stream): stream for stream in streams}
    programs = {lanes: jax.jit(_jax_program(job, lanes)).lower(stream).compile() for lanes, stream in sizes.items()}
    began = perf_counter()
    ended = [[int(number) for number in programs[len(stream)](stream)] for stream in streams]
    seconds = perf_counter() - began
    won = sum(won for _, won in ended)
    return Measured(sum(moves for moves, _ in ended), seconds, 100.0 * won / sessions)


def _jax_program(job: Session, lanes: int) -> Callable[[Any], tuple[Any, Any]]:
    """The program (streams of random numbers) -> (moves, won sessions); lanes are halved when half of them are over."""
    import jax.numpy as jnp  # type: ignore[import-not-found, unused-ignore]
    from jax import lax  # type: ignore[import-not-found, unused-ignore]

    step = _jax_step(job)

    def program(stream: Any) -> tuple[Any, Any]:
        zeros, n, moves, won = jnp.zeros(lanes, jnp.int32), lanes, 0, 0
        table, base = jnp.zeros(lanes * job.states), jnp.arange(lanes, dtype=jnp.int32) * job.states
        lane: tuple[Any, ...] = (base, zeros + job.start, zeros, zeros, zeros, zeros > 0, stream)
        while n:
            rest = n // 2 if n >= FEWEST_LANES else 0
            table, lane = lax.while_loop(lambda c: (c[1][2] < job.episodes).sum() > rest, step, (table, lane))  # noqa: B023
            order = jnp.argsort(lane[2] >= job.episodes)
            moves, won = moves + lane[4][order[rest:]].sum(), won + lane[5][order[rest:]].sum()
            lane, n = tuple(x[order[:rest]] for x in lane), rest
        return moves, won

    return program


def _jax_step(job: Session) -> Callable[[Any], Any]:
    """The step of all lanes: a move, or the end of an episode that is over, so that one scatter serves both."""
    import jax.numpy as jnp  # type: ignore[import-not-found, unused-ignore]

    known: dict[str, Any] = {"mode": "promise_in_bounds"}
    neighbours, terminal, goal = jnp.asarray(job.successor), jnp.asarray(job.terminal), jnp.asarray(job.goal)
    arrival, sharpness = jnp.asarray(job.arrival), jnp.asarray(np.append(job.sharpness, job.sharpness[-1]))

    def step(carry: Any) -> Any:
        table, (base, state, episode, made, moves, won, stream) = carry
        near = neighbours.at[state].get(**known).T
        value = table.at[base + near].get(**known)
        weight = jnp.exp((value - value.max(0)) * sharpness.at[episode].get(**known))
        sums = [weight[0]]
        for action in range(1, MOVES):
            sums.append(sums[-1] + weight[action])
        stream = stream + jnp.uint64(0x9E3779B97F4A7C15)
        mark = (_mixed(stream) >> 11).astype(jnp.float64) * 2.0**-53 * sums[-1]
        entered, onward = near[-1], value[-1]
        for action in reversed(range(MOVES - 1)):
            entered = jnp.where(mark < sums[action], near[action], entered)
            onward = jnp.where(mark < sums[action], value[action], onward)
        here, ends = base + state, terminal.at[state].get(**known)
        old = table.at[here].get(**known)
        new = old + job.alpha * (job.loss + job.discount * onward - old)
        over, going = ends | (made == job.max_moves), episode < job.episodes
        new = jnp.where(ends, arrival.at[state].get(**known), jnp.where(over, old, new))
        table = table.at[here].set(new, unique_indices=True, **known)
        hit = goal.at[state].get(**known) & (made == job.optimal)
        won = jnp.where(over & (episode == job.episodes - 1), hit, won)
        moves, episode = moves + (going & ~over), episode + (going & over)
        state, made = jnp.where(over, job.start, entered), jnp.where(over, 0, made + 1)
        return table, (base, state, episode, made, moves, won, stream)

    return step


def _mixed(z: Any) -> Any:
    """The output function of splitmix64 of z, uint64."""
    z = (z ^ (z >> 30)) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> 27)) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> 31)
