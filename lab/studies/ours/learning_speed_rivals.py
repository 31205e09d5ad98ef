"""The rivals of the speed benchmark: one kind of session in other technologies, each as fast as we can write it there.

All learn as the thesis's listing does (App. VII), alone: a value for each state, zero at first; at s the softmax over
loss + gamma V(s') of the six neighbours, temperature n**-beta in episode n; then V(s) += alpha (loss + gamma V(s') -
V(s)), and a terminal state gets its own value when it is entered. Each runs on one core; compiling is timed apart.
"""

import ctypes
import os
import subprocess
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.errors import BadInput, LabError
from lab.learning.selection import temperature
from lab.learning.settings import LearnerSettings
from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP, shortest_steps

if TYPE_CHECKING:
    from gymnasium import Env

MOVES = 6
MOST_STATES = 2**16
NUMPY_LANES = 2000  # sessions side by side: more of them share the price of a call
NUMPY_BLOCK = 64  # moves after which sessions that are over leave
JAX_LANES = 500  # the tables of more do not stay in the cache
JAX_FEWEST_LANES = 64  # fewer are not worth a program of their own
C_SOURCE = Path(__file__).with_name("learning_speed_rival.c")
C_FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")


class Missing(LabError):
    """The rival cannot run on this computer; the message says why."""


@dataclass(frozen=True)
class Measured:
    """All moves of the sessions, the seconds that learning them took, and the sessions that ended on a shortest way."""

    moves: int
    seconds: float
    success_percent: float
    compile_seconds: float = 0.0


Rival = Callable[[TabularMDP, LearnerSettings, int, int], Measured]  # (problem, settings, sessions, seed)


@dataclass(frozen=True, eq=False)
class _Job:
    """Problem and settings as plain arrays and numbers; sharpness (episodes,): gamma / tau."""

    successor: IntArray
    terminal: BoolArray
    goal: BoolArray
    arrival: FloatArray
    start: int
    optimal: int
    loss: float
    alpha: float
    discount: float
    max_moves: int
    sharpness: FloatArray

    @property
    def states(self) -> int:
        return len(self.successor)

    @property
    def episodes(self) -> int:
        return len(self.sharpness)


def _job(mdp: TabularMDP, settings: LearnerSettings, sessions: int) -> _Job:
    if mdp.n_actions != MOVES or mdp.n_states > MOST_STATES or mdp.starts:
        raise BadInput(
            f"a problem of {mdp.n_states} states, {mdp.n_actions} actions and {len(mdp.starts) or 1} starts: rivals learn "
            f"one with {MOVES} actions, one start and at most {MOST_STATES} states"
        )
    if sessions < 1:
        raise BadInput(f"sessions = {sessions}: allowed are whole numbers from 1")
    taus = [temperature(n, settings.beta, settings.exploration) for n in range(1, settings.episodes + 1)]
    return _Job(
        mdp.successor,
        mdp.terminal,
        mdp.goal,
        mdp.arrival,
        mdp.start,
        shortest_steps(mdp),
        mdp.step_reward,
        settings.alpha,
        settings.discount,
        settings.max_steps - settings.count_start,
        settings.discount / np.array(taus),
    )


def gymnasium_loop(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The loop of the tutorials: a Gymnasium environment without wrappers, a numpy table, one session after another."""
    job, rng = _job(mdp, settings, sessions), np.random.default_rng(seed)
    env = _gymnasium_world(job)
    began = perf_counter()
    ended = [_tutorial_session(env, job, rng) for _ in range(sessions)]
    seconds = perf_counter() - began
    return Measured(sum(moves for moves, _ in ended), seconds, 100.0 * sum(won for _, won in ended) / sessions)


def _gymnasium_world(job: _Job) -> "Env[int, int]":
    from gymnasium import Env
    from gymnasium.spaces import Discrete

    successor: list[list[int]] = job.successor.tolist()
    terminal: list[bool] = job.terminal.tolist()
    arrival: list[float] = job.arrival.tolist()

    class World(Env[int, int]):
        """The problem, a state being an observation."""

        observation_space: Any = Discrete(job.states)
        action_space: Any = Discrete(MOVES)

        def reset(
            self, *, seed: int | None = None, options: dict[str, Any] | None = None
        ) -> tuple[int, dict[str, Any]]:
            super().reset(seed=seed)
            self.state, self.moves = job.start, 0
            return self.state, {}

        def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
            self.state = state = successor[self.state][action]
            self.moves += 1
            terminated = terminal[state]
            reward = arrival[state] if terminated else job.loss
            return state, reward, terminated, self.moves >= job.max_moves, {}

    return World()


def _tutorial_session(env: "Env[int, int]", job: _Job, rng: np.random.Generator) -> tuple[int, bool]:
    values = np.zeros(job.states)
    moves = 0
    for sharpness in job.sharpness.tolist():
        state, _ = env.reset()
        first, over, terminated = moves, False, False
        while not over:
            near = values[job.successor[state]]
            sums = np.exp((near - near.max()) * sharpness).cumsum()
            action = int(sums[:-1].searchsorted(rng.random() * sums[-1], side="right"))
            entered, reward, terminated, truncated, _ = env.step(action)
            values[state] += job.alpha * (job.loss + job.discount * values[entered] - values[state])
            if terminated:
                values[entered] = reward
            state, over = entered, terminated or truncated
            moves += 1
    return moves, bool(job.goal[state]) and moves - first == job.optimal


def numpy_lock_step(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """All sessions side by side in numpy arrays, one move of each at a time; a session is reset as its episode ends."""
    job, rng = _job(mdp, settings, sessions), np.random.default_rng(seed)
    began = perf_counter()
    batches = [_numpy_batch(job, lanes, rng) for lanes in _batches(sessions, NUMPY_LANES)]
    seconds = perf_counter() - began
    return Measured(sum(moves for moves, _ in batches), seconds, 100.0 * sum(won for _, won in batches) / sessions)


def _batches(sessions: int, most: int) -> list[int]:
    return [min(most, sessions - first) for first in range(0, sessions, most)]


def _numpy_batch(job: _Job, n: int, rng: np.random.Generator) -> tuple[int, int]:
    """The moves and the won sessions of n lanes. A session that is over walks on unseen until the end of the block."""
    neighbours = np.ascontiguousarray(job.successor.T, np.intp)  # (6, S)
    sharpness_in = np.pad(job.sharpness, (0, NUMPY_BLOCK), "edge")
    table, base = np.zeros(n * job.states), np.arange(n) * job.states
    state, episode, begun = np.full(n, job.start), np.zeros(n, np.intp), np.zeros(n, np.intp)
    sharpness = np.full(n, job.sharpness[0])
    now = oldest = moves = won = 0  # oldest: no episode under way began before
    while n:
        near, lane = np.empty((MOVES, n), np.intp), np.arange(n)
        value, weight = np.empty((MOVES, n)), np.empty((MOVES, n))
        top, old, new = np.empty((3, n))
        here, entered, picked = np.empty((3, n), np.intp)
        beyond, action = np.empty((MOVES - 1, n), np.bool_), np.empty(n, np.int8)
        beyond_bytes, sums, total = beyond.view(np.int8), weight[:-1], weight[-1]
        steps_of_sum = list(pairwise(weight))
        for mark in rng.random((NUMPY_BLOCK, n)):
            np.take(neighbours, state, axis=1, out=near, mode="clip")
            np.add(near, base, out=near)
            np.take(table, near, out=value, mode="clip")
            np.maximum.reduce(value, axis=0, out=top)
            np.subtract(value, top, out=weight)
            np.multiply(weight, sharpness, out=weight)
            np.maximum(weight, -700.0, out=weight)  # exp is slow where it underflows
            np.exp(weight, out=weight)
            for below, above in steps_of_sum:  # much faster than cumsum along this axis
                np.add(below, above, out=above)
            np.multiply(mark, total, out=mark)
            np.less_equal(sums, mark, out=beyond)
            np.add.reduce(beyond_bytes, axis=0, dtype=np.int8, out=action)
            np.multiply(action, n, out=picked, dtype=np.intp)
            np.add(picked, lane, out=picked)
            near.take(picked, out=entered, mode="clip")
            value.take(picked, out=new, mode="clip")
            np.add(state, base, out=here)
            table.take(here, out=old, mode="clip")
            np.multiply(new, job.alpha * job.discount, out=new)
            np.add(new, job.alpha * job.loss, out=new)
            np.multiply(old, 1.0 - job.alpha, out=old)
            np.add(new, old, out=new)
            table[here] = new
            np.subtract(entered, base, out=state)
            now += 1
            over = job.terminal.take(state).nonzero()[0]
            table[entered.take(over)] = job.arrival.take(state.take(over))
            if now == oldest + job.max_moves:
                over = np.union1d(over, (begun == oldest).nonzero()[0])
            following = episode.take(over) + 1
            ended = following == job.episodes
            if np.count_nonzero(ended):
                last = over[ended]
                moves += now * len(last)  # a lane never pauses
                won += int(np.count_nonzero(job.goal[state[last]] & (now - begun[last] == job.optimal)))
            episode[over], sharpness[over] = following, sharpness_in.take(following)
            state[over], begun[over] = job.start, now
            if now == oldest + job.max_moves:
                oldest = int(begun.min())
        going = episode < job.episodes
        if not going.all():
            state, base, episode, begun, sharpness = (x[going] for x in (state, base, episode, begun, sharpness))
            n = len(state)
    return moves, won


def jax_lock_step(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """All sessions side by side in one compiled jax program, in a process of its own, so that it has one thread."""
    job = _job(mdp, settings, sessions)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        try:
            return pool.submit(_measure_jax, job, sessions, seed).result()
        except BrokenProcessPool:
            raise Missing("jax: its process ended early") from None


def _measure_jax(job: _Job, sessions: int, seed: int) -> Measured:
    os.environ |= {"NPROC": "1", "JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}  # one thread; read as jax starts
    try:
        import jax  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise Missing(f"jax cannot be imported: {error}") from None
    rng = np.random.default_rng(seed)
    streams = [rng.integers(0, 2**64, lanes, np.uint64) for lanes in _batches(sessions, JAX_LANES)]
    began = perf_counter()
    sizes = {len(stream): stream for stream in streams}
    programs = {lanes: jax.jit(_jax_program(job, lanes)).lower(stream).compile() for lanes, stream in sizes.items()}
    compiled = perf_counter()
    ended = [[int(number) for number in programs[len(stream)](stream)] for stream in streams]
    seconds = perf_counter() - compiled
    won = sum(won for _, won in ended)
    return Measured(sum(moves for moves, _ in ended), seconds, 100.0 * won / sessions, compiled - began)


def _jax_program(job: _Job, lanes: int) -> Callable[[Any], tuple[Any, Any]]:
    """(streams of random numbers) -> (moves, won sessions); half of the lanes are dropped when half are over."""
    import jax.numpy as jnp  # type: ignore[import-not-found, unused-ignore]
    from jax import lax  # type: ignore[import-not-found, unused-ignore]

    step = _jax_step(job)

    def program(stream: Any) -> tuple[Any, Any]:
        zeros, n, moves, won = jnp.zeros(lanes, jnp.int32), lanes, 0, 0
        table, base = jnp.zeros(lanes * job.states), jnp.arange(lanes, dtype=jnp.int32) * job.states
        lane: tuple[Any, ...] = (base, zeros + job.start, zeros, zeros, zeros, zeros > 0, stream)
        while n:
            rest = n // 2 if n >= JAX_FEWEST_LANES else 0
            table, lane = lax.while_loop(lambda c: (c[1][2] < job.episodes).sum() > rest, step, (table, lane))  # noqa: B023
            order = jnp.argsort(lane[2] >= job.episodes)
            moves, won = moves + lane[4][order[rest:]].sum(), won + lane[5][order[rest:]].sum()
            lane, n = tuple(x[order[:rest]] for x in lane), rest
        return moves, won

    return program


def _jax_step(job: _Job) -> Callable[[Any], Any]:
    """One move of each lane; where an episode is over, its end instead: then one scatter does for both."""
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
    """The scrambling of splitmix64; z uint64."""
    z = (z ^ (z >> 30)) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> 27)) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> 31)


def c_scalar(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """One session after another in C (rival.c), compiled for this very processor."""
    job, rng = _job(mdp, settings, sessions), np.random.default_rng(seed)
    began = perf_counter()
    learn = _compiled_c()
    compiled = perf_counter()
    near = np.pad(job.successor, ((0, 0), (0, 2)), "edge").astype(np.uint16)
    ends = np.where(job.goal, 1, np.where(job.terminal, 2, 0)).astype(np.uint8)
    stream, table = rng.integers(0, 2**64, 4, np.uint64), np.empty(job.states)
    rules = (job.start, job.loss, job.discount, job.alpha, job.episodes, job.sharpness, job.max_moves, job.optimal)
    won = ctypes.c_int64()
    ready = perf_counter()
    moves = learn(job.states, near, job.arrival, ends, *rules, sessions, stream, table, ctypes.byref(won))
    seconds = perf_counter() - ready
    return Measured(moves, seconds, 100.0 * won.value / sessions, compiled - began)


def _compiled_c() -> Any:
    """The function `learn` of rival.c."""
    compiler = which("cc")
    if compiler is None:
        raise Missing("no C compiler: `cc` is not on the path")
    with TemporaryDirectory() as folder:
        library = Path(folder, "rival.so")
        command = [compiler, *C_FLAGS, str(C_SOURCE), "-o", str(library)]
        try:
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            if result.returncode:
                raise Missing(f"cc does not compile rival.c: {(result.stderr.strip() or 'no reason').splitlines()[0]}")
            learn = ctypes.CDLL(str(library)).learn
        except OSError as error:
            raise Missing(f"cc or what it made cannot be run: {error}") from None
    whole, real, reals = ctypes.c_int64, ctypes.c_double, np.ctypeslib.ndpointer(np.float64)
    problem = (whole, np.ctypeslib.ndpointer(np.uint16), reals, np.ctypeslib.ndpointer(np.uint8))
    rules = (whole, real, real, real, whole, reals, whole, whole)
    learn.argtypes = (*problem, *rules, whole, np.ctypeslib.ndpointer(np.uint64), reals, ctypes.POINTER(whole))
    learn.restype = whole
    return learn


RIVALS: dict[str, Rival] = {
    "gymnasium tutorial loop": gymnasium_loop,
    "numpy lock step": numpy_lock_step,
    "jax lock step": jax_lock_step,
    "c scalar": c_scalar,
}
