"""The rivals of the speed benchmark: one kind of session in other technologies, each as fast as we can write it there.

All learn as the thesis's listing does (App. VII), alone: a value for each state, zero at first; at s the softmax over
loss + gamma V(s') of the six neighbours, temperature n**-beta in episode n; then V(s) += alpha (loss + gamma V(s') -
V(s)), and a terminal state gets its own value when it is entered. Each runs on one core; compiling is not counted.
"""

import ctypes
import subprocess
from itertools import pairwise
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab.studies.ours.learning_speed_jax import jax_lock_step
from lab.studies.ours.learning_speed_session import (
    MOVES,
    Measured,
    Missing,
    Rival,
    Session,
    session_of,
    shared_out,
)

if TYPE_CHECKING:
    from gymnasium import Env

NUMPY_LANES = 2000  # sessions side by side: more of them share the price of a call
NUMPY_BLOCK = 64  # moves after which sessions that are over leave
C_SOURCE = Path(__file__).with_name("learning_speed_rival.c")
C_FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")


def gymnasium_loop(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The loop of the tutorials: a Gymnasium environment without wrappers, a numpy table, one session after another."""
    job, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    env = _gymnasium_world(job)
    began = perf_counter()
    ended = [_tutorial_session(env, job, rng) for _ in range(sessions)]
    seconds = perf_counter() - began
    return Measured(sum(moves for moves, _ in ended), seconds, 100.0 * sum(won for _, won in ended) / sessions)


def _gymnasium_world(job: Session) -> "Env[int, int]":
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


def _tutorial_session(env: "Env[int, int]", job: Session, rng: np.random.Generator) -> tuple[int, bool]:
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
    job, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    began = perf_counter()
    batches = [_numpy_batch(job, lanes, rng) for lanes in shared_out(sessions, NUMPY_LANES)]
    seconds = perf_counter() - began
    return Measured(sum(moves for moves, _ in batches), seconds, 100.0 * sum(won for _, won in batches) / sessions)


def _numpy_batch(job: Session, n: int, rng: np.random.Generator) -> tuple[int, int]:
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


def c_scalar(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """One session after another in C (learning_speed_rival.c), compiled for this very processor."""
    job, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    learn = _compiled_c()
    near = np.pad(job.successor, ((0, 0), (0, 2)), "edge").astype(np.uint16)
    ends = np.where(job.goal, 1, np.where(job.terminal, 2, 0)).astype(np.uint8)
    stream, table = rng.integers(0, 2**64, 4, np.uint64), np.empty(job.states)
    rules = (job.start, job.loss, job.discount, job.alpha, job.episodes, job.sharpness, job.max_moves, job.optimal)
    won = ctypes.c_int64()
    began = perf_counter()
    moves = learn(job.states, near, job.arrival, ends, *rules, sessions, stream, table, ctypes.byref(won))
    seconds = perf_counter() - began
    return Measured(moves, seconds, 100.0 * won.value / sessions)


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
