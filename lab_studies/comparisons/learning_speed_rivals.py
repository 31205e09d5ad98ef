"""The rivals of the speed benchmark: the same session in other technologies, each written as fast as we can.

All learn alone as in the thesis's listing (App. VII): states have values, zero at first; a move is drawn at s by the softmax
over loss + gamma V(s') of the six neighbours with temperature n**-beta in episode n; then V(s) += alpha (loss + gamma V(s')
- V(s)), and a terminal state gets its own value when it is entered. Each runs on one core; compiling is not counted.
"""

import ctypes
import subprocess
from functools import cache
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab_studies.comparisons.learning_speed_jax import jax_lock_step
from lab_studies.comparisons.learning_speed_numpy import numpy_lock_step
from lab_studies.comparisons.learning_speed_session import MOVES, Measured, Missing, Rival, Session, session_of

if TYPE_CHECKING:
    from gymnasium import Env

SCALAR_SOURCE, LANES_SOURCE = "learning_speed_rival.c", "learning_speed_lanes.c"
C_FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")
C_LANES, MOST_LANES = "c lanes", 32  # its sessions side by side: two vectors of sixteen


def gymnasium_loop(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The measurement of the tutorials' loop: a Gymnasium environment without wrappers, a numpy table, a session at a time."""
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
        """The problem as an environment whose observations are its states."""

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


def c_scalar(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The measurement of one session after another in C (learning_speed_rival.c), compiled for this processor."""
    job, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    learn = _compiled(SCALAR_SOURCE, np.uint16, np.float64, np.uint64)
    near = np.pad(job.successor, ((0, 0), (0, 2)), "edge").astype(np.uint16)
    ends = np.where(job.goal, 1, np.where(job.terminal, 2, 0)).astype(np.uint8)
    stream, table = rng.integers(0, 2**64, 4, np.uint64), np.empty(job.states)
    rules = (job.start, job.loss, job.discount, job.alpha, job.episodes, job.sharpness, job.max_moves, job.optimal)
    won = ctypes.c_int64()
    began = perf_counter()
    moves = learn(job.states, near, job.arrival, ends, *rules, sessions, stream, table, ctypes.byref(won))
    seconds = perf_counter() - began
    return Measured(moves, seconds, 100.0 * won.value / sessions)


def c_lanes(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The measurement of a session in each SIMD lane in C (learning_speed_lanes.c), compiled for this processor."""
    job, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    learn = _compiled(LANES_SOURCE, np.int32, np.float32, np.uint32)
    order = np.argsort(job.terminal, kind="stable")  # states that end an episode come last
    number = np.argsort(order)
    near = number[job.successor[order]].T.astype(np.uint32)  # (MOVES, S)
    pairs = (near[::2] | near[1::2] << 16).view(np.int32)
    start, live, goal = int(number[job.start]), int((~job.terminal).sum()), job.goal[order].astype(np.uint8)
    arrival, sharpness = job.arrival[order].astype(np.float32), (job.sharpness / np.log(2)).astype(np.float32)
    rules = (start, job.loss, job.discount, job.alpha, job.episodes, sharpness, job.max_moves, job.optimal)
    stream = rng.integers(0, 2**32, 4 * MOST_LANES, np.uint32)
    table = np.empty(MOST_LANES * job.states, np.float32)
    won = ctypes.c_int64()
    began = perf_counter()
    moves = learn(
        job.states, np.ascontiguousarray(pairs), live, arrival, goal, *rules, sessions, stream, table, ctypes.byref(won)
    )
    seconds = perf_counter() - began
    return Measured(moves, seconds, 100.0 * won.value / sessions)


def _compiled(source: str, near: type, real: type, seed: type) -> Any:
    """The function `learn` of a C file in this folder. near, real, seed: the types of its neighbours, reals and seeds."""
    compiler = which("cc")
    if compiler is None:
        raise Missing("no C compiler: `cc` is not on the path")
    learn = _library(source, compiler, C_FLAGS).learn
    array: Any = np.ctypeslib.ndpointer
    whole_type, real_type = ctypes.c_int64, ctypes.c_float if real is np.float32 else ctypes.c_double
    live = [whole_type] if source == LANES_SOURCE else []
    rules = (whole_type, real_type, real_type, real_type, whole_type, array(real), whole_type, whole_type)
    learned = (whole_type, array(seed), array(real), ctypes.POINTER(whole_type))
    learn.argtypes = (whole_type, array(near), *live, array(real), array(np.uint8), *rules, *learned)
    learn.restype = whole_type
    return learn


@cache
def _library(source: str, compiler: str, flags: tuple[str, ...]) -> ctypes.CDLL:
    """The library of a C file, compiled once in a process. Raises Missing if it cannot be compiled or loaded."""
    with TemporaryDirectory() as folder:
        library = Path(folder, "rival.so")
        command = [compiler, *flags, str(Path(__file__).with_name(source)), "-o", str(library)]
        try:
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            if result.returncode:
                raise Missing(f"cc does not compile {source}: {_reason(result.stderr)}")
            return ctypes.CDLL(str(library))
        except OSError as error:
            raise Missing(f"cc or what it made cannot be run: {error}") from None


def _reason(stderr: str) -> str:
    """The first line of a compiler's output with an error, else its first line."""
    lines = stderr.strip().splitlines() or ["no reason"]
    return next((line for line in lines if "error" in line), lines[0])


RIVALS: dict[str, Rival] = {
    "gymnasium tutorial loop": gymnasium_loop,
    "numpy lock step": numpy_lock_step,
    "jax lock step": jax_lock_step,
    "c scalar": c_scalar,
    C_LANES: c_lanes,
}
