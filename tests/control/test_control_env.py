"""The environments: Gymnasium's own checker, seeds, limits of what is asked, and how episodes end."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.control import ENVIRONMENTS, ControlEnv
from lab.control.control_env import STATE_NAMES
from lab.errors import BadInput

numbers = st.lists(st.floats(-1.0, 1.0, width=32), min_size=5, max_size=5)


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.filterwarnings("error")
def test_gymnasium_finds_no_fault(name: str) -> None:
    env = gymnasium.make(f"lab.control:{name}", render_mode="rgb_array", seconds=1.0)
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=0)
    assert np.asarray(env.render()).shape == (256, 256, 3)
    env.close()


@pytest.mark.parametrize("options", [{"actions": "joints"}, {"observations": "pictures"}])
@pytest.mark.filterwarnings("error")
def test_gymnasium_finds_no_fault_with_joints_and_pictures(options: dict[str, Any]) -> None:
    env = gymnasium.make("lab.control:TeachingLab/Grasp-control-v0", **options)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def played(env: ControlEnv, seed: int, steps: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    states = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        state, _, terminated, truncated, _ = env.step(rng.uniform(-1.0, 1.0, 5).astype(np.float32))
        states.append(state)
        if terminated or truncated:
            break
    return np.array(states)


def test_an_episode_is_the_same_in_a_new_world_and_after_others() -> None:
    """Bit for bit, also after an episode in which the part was dropped among the cubes."""
    used = ControlEnv(skill="insert at toaster", noise=0.1)
    for seed in (5, 6):
        played(used, seed, 12)
    new = ControlEnv(skill="insert at toaster", noise=0.1)
    assert np.array_equal(played(used, 3, 8), played(new, 3, 8))
    used.close()
    new.close()


def test_starts_and_goals_differ_from_seed_to_seed(grasp: ControlEnv) -> None:
    states = np.array([grasp.reset(seed=seed)[0] for seed in range(4)])
    goal = [STATE_NAMES.index(name) for name in ("goal ahead", "goal left", "goal up", "sin goal yaw")]
    assert (np.ptp(states[:, :4], axis=0) > 0.005).all()
    assert (np.ptp(states[:, goal], axis=0) > 0.005).all()


def test_the_state_says_where_the_part_is_in_the_tools_axes(grasp: ControlEnv) -> None:
    state = dict(zip(STATE_NAMES, grasp.reset(seed=2)[0].tolist(), strict=True))
    part = grasp.scene.part_pose(grasp.tool.yaw)
    turn = complex(state["cos tool yaw"], state["sin tool yaw"])
    world = complex(state["tool x"], state["tool y"]) + turn * complex(state["part ahead"], state["part left"])
    assert world == pytest.approx(complex(part.x, part.y), abs=1e-5)
    assert state["tool z"] + state["part up"] == pytest.approx(part.z, abs=1e-5)
    assert (state["opening"], state["closes"], state["left touches"]) == (pytest.approx(1.0, abs=1e-3), 0.0, 0.0)


def test_a_command_moves_the_tool_as_far_as_it_says(grasp: ControlEnv) -> None:
    grasp.reset(seed=0)
    x = grasp.tool.x
    for share in (1.0, 1.0, 1.0, 0.0, 0.0):
        grasp.step(np.array([share, 0.0, 0.0, 0.0, -1.0], np.float32))
    assert grasp.tool.x - x == pytest.approx(0.3 * 0.3, abs=0.005)  # 0.3 s at 0.3 m/s


@settings(max_examples=4, deadline=None)
@given(st.lists(numbers, min_size=1, max_size=10))
def test_whatever_is_commanded_the_state_stays_in_its_space(commands: list[list[float]]) -> None:
    env = ControlEnv(skill="grasp at plate")
    env.reset(seed=0)
    for command in commands:
        state, reward, terminated, truncated, info = env.step(np.array(command, np.float32))
        assert env.observation_space.contains(state)
        assert reward == float(info["is_success"])
        if terminated or truncated:
            break
    env.close()


def test_a_part_that_is_let_go_in_the_air_is_dropped() -> None:
    env = ControlEnv(skill="place at finished_plate")
    env.reset(seed=0)
    ended, steps = False, 0
    while not ended:
        _, reward, ended, _, info = env.step(np.array([0.0, 0.0, 0.0, 0.0, -1.0], np.float32))
        steps += 1
        assert steps < 20
    assert (reward, info["is_success"]) == (0.0, False)
    assert info["reason"] == "dropped part: slice 1 is neither held nor in its place"
    env.close()


def test_an_arm_that_is_driven_into_the_table_stops(grasp: ControlEnv) -> None:
    """With the part between closed fingers and the plate under it, the arm presses too hard."""
    grasp.reset(seed=0)
    info: dict[str, Any] = {"reason": ""}
    for _ in range(30):
        _, _, ended, _, info = grasp.step(np.array([0.0, 0.0, -1.0, 0.0, -1.0], np.float32))
        if ended:
            break
    assert info["reason"].startswith("collision: the arm presses on '")


def test_an_episode_is_cut_when_its_time_is_up() -> None:
    env = ControlEnv(skill="grasp at plate", seconds=0.2)
    env.reset(seed=0)
    still = np.array([0.0, 0.0, 0.0, 0.0, -1.0], np.float32)
    assert env.step(still)[2:4] == (False, False)
    assert env.step(still)[2:] == (False, True, {"is_success": False, "reason": "out of time"})
    env.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"skill": "grsp"}, "unknown skill 'grsp'"),
        ({"skill": "butter at butter_applier"}, "it has no pose to reach"),
        ({"actions": "tol"}, "unknown actions 'tol'"),
        ({"observations": "sounds"}, "unknown observations 'sounds'"),
        ({"noise": -0.1}, "wanted 0 to 1"),
        ({"seconds": float("nan")}, "wanted 0 to 600"),
    ],
)
def test_a_bad_argument_is_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        ControlEnv(**{"skill": "grasp at plate", **options})


@pytest.mark.parametrize("action", [np.zeros(4), np.full(5, np.nan)])
def test_a_bad_action_is_named(grasp: ControlEnv, action: np.ndarray) -> None:
    grasp.reset(seed=0)
    with pytest.raises(BadInput, match="wanted 5 finite numbers"):
        grasp.step(action)


def test_an_environment_is_reset_first() -> None:
    with pytest.raises(BadInput, match="wanted reset"):
        ControlEnv(skill="grasp at plate").step(np.zeros(5, np.float32))
