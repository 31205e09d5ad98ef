"""What every rival of the speed benchmark owes: the same learning, whatever it is written in. Nothing here is timed."""

from dataclasses import replace
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP, coverage, grid
from lab.tasks.grid_world import GridWorld
from lab.tasks.task_file import load_world
from lab_studies.comparisons import learning_speed_rivals
from lab_studies.comparisons.learning_speed_rivals import C_LANES, RIVALS
from lab_studies.comparisons.learning_speed_session import Measured, Missing

SESSIONS = 60


@pytest.fixture(scope="module")
def world() -> GridWorld:
    return load_world("world-1")


def run(name: str, mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int = 0) -> Measured:
    """What the rival measures; the test is skipped where it cannot run."""
    try:
        return RIVALS[name](mdp, settings, sessions, seed)
    except Missing as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", RIVALS)
def test_a_rival_learns_world_1(name: str, world: GridWorld) -> None:
    """Of many sessions 62 % succeed, and one takes 5860 moves; the means of 60 spread by 6 points and 60 moves."""
    measured = run(name, world.mdp(), world.learner, SESSIONS)
    assert 40 <= measured.success_percent <= 85
    assert 5500 <= measured.moves / SESSIONS <= 6200
    assert measured.seconds > 0
    assert type(measured.moves) is int
    assert type(measured.success_percent) is float


@pytest.mark.parametrize("name", RIVALS)
def test_the_seed_decides(name: str, world: GridWorld) -> None:
    mdp, settings = world.mdp(), replace(world.learner, episodes=20)
    first, again, other = (run(name, mdp, settings, 3, seed) for seed in (1, 1, 2))
    assert first.moves == again.moves != other.moves


@pytest.mark.parametrize("name", RIVALS)
@pytest.mark.parametrize("count_start", [False, True])
def test_an_episode_is_broken_off(name: str, world: GridWorld, count_start: bool) -> None:
    """No obstacle is within 3 moves of the start: every episode takes all moves that it may."""
    settings = replace(world.learner, episodes=5, max_steps=3, count_start=count_start)
    measured = run(name, world.mdp(), settings, 7)
    assert (measured.moves, measured.success_percent) == (7 * 5 * (3 - count_start), 0.0)


@pytest.mark.parametrize("name", RIVALS)
def test_only_the_goal_is_a_success(name: str, world: GridWorld) -> None:
    """Between an obstacle and the goal four of six moves stay: the first move reaches the goal in a sixth of the sessions."""
    corridor = grid((1, 1, 3), [[[True, False, False]]], (0, 0, 1), (0, 0, 2))
    at_once = run(name, corridor, replace(world.learner, episodes=1), 600)
    assert 10 <= at_once.success_percent <= 24
    assert run(name, corridor, replace(world.learner, episodes=40), 20).success_percent == 100


@pytest.mark.parametrize("name", RIVALS)
def test_what_no_rival_learns_is_refused(name: str, world: GridWorld) -> None:
    with pytest.raises(BadInput, match="4 actions"):
        RIVALS[name](coverage((2, 2)), world.learner, 1, 0)
    with pytest.raises(BadInput, match="sessions = 0"):
        RIVALS[name](world.mdp(), world.learner, 0, 0)


@pytest.mark.parametrize("sessions", [1, 31, 33])
def test_lanes_without_a_session_count_for_nothing(world: GridWorld, sessions: int) -> None:
    """Fewer sessions than lanes, or one more: every episode takes its 3 moves."""
    settings = replace(world.learner, episodes=5, max_steps=3, count_start=False)
    assert run(C_LANES, world.mdp(), settings, sessions).moves == sessions * 5 * 3


@pytest.mark.parametrize(("flag", "says"), [("-mno-avx512f", None), ("-mno-avx2", "needs a processor with AVX2")])
def test_other_processors(flag: str, says: str | None, world: GridWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight lanes do as sixteen; what has neither is told."""
    run(C_LANES, world.mdp(), world.learner, 1)  # skipped where this processor has no lanes at all
    monkeypatch.setattr(learning_speed_rivals, "C_FLAGS", (*learning_speed_rivals.C_FLAGS, flag))
    if says is None:
        return test_a_rival_learns_world_1(C_LANES, world)
    with pytest.raises(Missing, match=says):
        RIVALS[C_LANES](world.mdp(), world.learner, 1, 0)
    return None


@pytest.mark.parametrize("name", ["c scalar", C_LANES])
def test_without_a_compiler_c_is_missing(
    name: str, world: GridWorld, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(Missing, match="no C compiler"):
        RIVALS[name](world.mdp(), world.learner, 1, 0)
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'no such processor' >&2\nexit 1\n", encoding="utf-8")
    compiler.chmod(0o755)
    with pytest.raises(Missing, match="no such processor"):
        RIVALS[name](world.mdp(), world.learner, 1, 0)
    compiler.write_text("#!/bin/nothing\n", encoding="utf-8")
    with pytest.raises(Missing, match="cannot be run"):
        RIVALS[name](world.mdp(), world.learner, 1, 0)


def test_without_jax_its_rival_is_missing(world: GridWorld, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "jax.py").write_text("raise ImportError('none here')\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(Missing, match="none here"):
        RIVALS["jax lock step"](world.mdp(), world.learner, 1, 0)
