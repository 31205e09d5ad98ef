"""The registered environments: Gymnasium's own checker, seeds, text, and the numbers of worlds and cells by hand."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.gym import ENVIRONMENTS, CellEnv, FmsEnv, TableEnv, ToastCellEnv, WorldEnv, register
from lab.gym.gym_environment import GymEnvironment
from lab.mdp import coverage, grid
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, stuck_cost
from lab.sequencing.methods.exact import optimum
from lab.skills.prepared_scene import prepare
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import GridWorld
from lab.tasks.task_file import load, load_cell, load_world
from lab.tasks.toml_text import TomlText
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.subjects import subject_of

Trace = list[tuple[Any, ...]]

# A lathe and a mill with room for one part each: pins cross them one way, nuts the other.
CROSSING = """
kind = "cell"
name = "crossing"
order = ["pin", "nut"]
stations = [
  { name = "in", kind = "storage", capacity = 9 },
  { name = "lathe", kind = "machine", capacity = 1, processing_s = 1 },
  { name = "mill", kind = "machine", capacity = 1, processing_s = 1 },
  { name = "out", kind = "storage", capacity = 9 },
]
products = [
  { name = "pin", routes = [["in", "lathe", "mill", "out"]] },
  { name = "nut", routes = [["in", "mill", "lathe", "out"]] },
]
robot.start = "in"
[travel]
in = { lathe = 1, mill = 1, out = 1 }
lathe = { in = 1, mill = 1, out = 1 }
mill = { in = 1, lathe = 1, out = 1 }
out = { in = 1, lathe = 1, mill = 1 }
"""


def crossing() -> Cell:
    return CellFile.checked(TomlText.parsed(Path("crossing.toml"), CROSSING)).cell()


def small(limit: int | None = None) -> TableEnv:
    """Start in the upper left corner, goal in the upper right one, an obstacle between them."""
    world = GridWorld(name="small", shape=(2, 3), start=(0, 0), goal=(0, 2), obstacles=((0, 1),))
    return TableEnv(world.mdp(), limit, "ansi")


def played(name: str, seed: int, steps: int = 60, **keywords: object) -> Trace:
    """What random actions lead to, as Gymnasium makes the environment, its passive checker around it."""
    env = gymnasium.make(name, **keywords)  # type: ignore[arg-type]
    actions = np.random.default_rng(seed).integers(env.action_space.n, size=steps).tolist()  # type: ignore[attr-defined]
    first, _ = env.reset(seed=seed)
    trace: Trace = [(np.ravel(first).tolist(),)]
    for action in actions:
        state, reward, terminated, truncated, info = env.step(action)
        mask = np.ravel(info.get("action_mask", [])).tolist()
        trace.append((np.ravel(state).tolist(), reward, terminated, truncated, info["is_success"], mask))
        if terminated or truncated:
            trace.append((np.ravel(env.reset()[0]).tolist(),))
    return trace


# ---- every registered environment -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_gymnasiums_checker_finds_nothing(name: str) -> None:
    """Warnings are errors here."""
    check_env(gymnasium.make(name).unwrapped)


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_seed_says_all(name: str) -> None:
    assert played(name, 5) == played(name, 5)


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_it_draws_text_when_it_is_asked_to(name: str) -> None:
    drawn, plain = gymnasium.make(name, render_mode="ansi"), gymnasium.make(name)
    drawn.reset(seed=0)
    plain.reset(seed=0)
    text = drawn.render()
    assert isinstance(text, str)
    assert text.endswith("\n")
    assert "R" in text or "the robot is at" in text
    assert plain.render() is None


def test_one_can_be_made_by_its_module() -> None:
    assert gymnasium.make("lab.gym:TeachingLab/FMS-v0").action_space == FmsEnv().action_space


def test_to_register_again_changes_nothing() -> None:
    before = dict(gymnasium.registry)
    register()
    assert gymnasium.registry == before


# ---- tables ---------------------------------------------------------------------------------------------------------


def test_a_small_world_by_hand() -> None:
    env = small()
    assert env.reset(seed=1) == (0, {"is_success": False})
    assert env.action_labels == ("up", "down", "left", "right")
    assert env.render() == "R # G\n. . .\n"
    assert env.step(1) == (3, -0.1, False, False, {"is_success": False})
    assert [env.step(3)[0], env.step(3)[0]] == [4, 5]
    assert env.render() == ". # G\n. . R\n"
    assert env.step(0) == (2, 1.5, True, False, {"is_success": True})
    env.reset()
    assert env.step(3) == (1, -11.5, True, False, {"is_success": False})


def test_too_long_an_episode_is_truncated_not_terminated() -> None:
    env = small(limit=2)
    env.reset(seed=0)
    assert env.step(0)[2:4] == (False, False)
    assert env.step(0)[2:4] == (False, True)
    env.reset()
    env.step(0)
    assert env.step(3)[2:4] == (True, False)  # an end at the limit is an end
    assert env.reset()[0] == 0
    assert env.step(0)[2:4] == (False, False)


def test_the_whole_problem_stands_in_its_table() -> None:
    env = small()
    assert env.P[0] == {
        0: [(1.0, 0, -0.1, False)],
        1: [(1.0, 3, -0.1, False)],
        2: [(1.0, 0, -0.1, False)],
        3: [(1.0, 1, -11.5, True)],
    }
    assert env.P[2][0] == [(1.0, 2, 0.0, True)]
    assert env.initial_state_distrib.tolist() == [1.0, 0, 0, 0, 0, 0]


def test_several_starts_are_drawn_by_the_seed() -> None:
    plain = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))
    parts = (plain.successor, plain.reward, plain.terminal, plain.goal, 0, plain.action_labels, plain.shape)
    env = TableEnv(type(plain)(*parts, starts=(0, 2)))
    assert env.initial_state_distrib.tolist() == [0.5, 0.0, 0.5, 0.0]
    env.reset(seed=3)
    begun = [env.reset()[0] for _ in range(20)]
    env.reset(seed=3)
    assert begun == [env.reset()[0] for _ in range(20)]
    assert set(begun) == {0, 2}


def test_a_space_is_drawn_as_a_map_of_the_robots_level() -> None:
    env = gymnasium.make("TeachingLab/World1-v0", render_mode="ansi")
    env.reset(seed=0)
    *rows, level = str(env.render()).splitlines()
    assert level == "level 1 of 0..9"
    assert [row.split() for row in rows][9 - 7] == ["R", *["."] * 9]  # y = 7, y runs up
    assert [row.split()[2] for row in rows] == ["#", *["."] * 9]  # (2, 9, 1) is an obstacle


def test_what_is_no_grid_is_drawn_by_its_label() -> None:
    env = TableEnv(coverage((2, 2)), render_mode="ansi")
    env.reset(seed=0)
    assert env.render() == "state (0, 0) covered 1 of 4\n"


def test_any_world_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("S.\n#G\n", encoding="utf-8")
    env = gymnasium.make("TeachingLab/World-v0", world=str(tmp_path / "mine.txt"), render_mode="ansi")
    env.reset(seed=0)
    assert env.render() == "R .\n# G\n"
    with pytest.raises(BadInput, match="unknown task 'world-3'"):
        gymnasium.make("TeachingLab/World-v0", world="world-3")


def test_an_episode_in_a_world_has_as_many_moves_as_a_session_gives_it() -> None:
    world = load_world("world-1")
    env = gymnasium.make("TeachingLab/World1-v0").unwrapped
    assert isinstance(env, WorldEnv)
    assert world.learner.count_start
    assert env.max_episode_steps == world.learner.max_steps - 1
    assert env.mdp.signature == world.mdp().signature


def test_insert_is_the_lessons_problem() -> None:
    env = gymnasium.make("TeachingLab/Insert-v0", layout_seed=4).unwrapped
    assert isinstance(env, TableEnv)
    prepared = prepare(load("toast"), ("slice",) * 2, 4, "insert at toaster")
    assert env.mdp.signature == prepared.problems["insert at toaster"].mdp.signature


# ---- cells ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("env", "makespan_s"), [(ToastCellEnv(), 513.0), (FmsEnv(), 1375.0)])
def test_the_return_of_the_best_order_is_minus_its_makespan(env: CellEnv, makespan_s: float) -> None:
    best = optimum(env.cell)
    env.reset(seed=0)
    total = 0.0
    for number, decision in enumerate(best.sequence, 1):
        _, reward, terminated, truncated, info = env.step(decision - 1)
        total += reward
        assert (terminated, truncated) == (number == len(best.sequence), False)
        assert info["now_s"] == -total
    assert total == -best.cost == -makespan_s
    assert info["is_success"]


def test_a_cell_by_hand() -> None:
    env = CellEnv(crossing(), render_mode="ansi")
    state, info = env.reset(seed=0)
    assert env.action_labels == ("pin 1", "nut 2")
    assert (state.tolist(), info["action_mask"].tolist(), info["now_s"]) == ([0, 4, 0], [1, 1], 0.0)
    state, reward, terminated, _, info = env.step(0)  # 1 s to the lathe, where it stays for 1 s
    assert (state.tolist(), reward, terminated, info["ready_s"]) == ([1, 4, 1], -1.0, False, [2.0, 0.0])
    assert env.render() == "1 s: the robot is at 'lathe'\npin 1: 'lathe', ready in 1 s\nnut 2: 'in'\n"


def test_what_is_not_allowed_costs_more_than_the_slowest_move_and_changes_nothing() -> None:
    env = CellEnv(crossing())
    env.reset(seed=0)
    for action in (0, 0, 0):
        env.step(action)
    state, reward, terminated, truncated, info = env.step(0)  # the pin is finished
    assert (reward, terminated, truncated, info["is_success"]) == (-env.penalty_s, False, False, False)
    assert info["action_mask"].tolist() == [0, 1]
    assert info["now_s"] == 5.0  # in 1, machine 1, across 1, machine 1, out 1
    assert env.penalty_s == 3.0  # empty 1, loaded 1, machine 1
    assert state.tolist() == [3, 4, 3]


def test_a_deadlock_ends_the_episode_with_its_cost() -> None:
    env = CellEnv(crossing())
    env.reset(seed=0)
    _, first, *_ = env.step(0)
    _, second, terminated, truncated, info = env.step(1)  # the pin in the lathe, the nut in the mill
    assert (terminated, truncated, info["is_success"]) == (True, False, False)
    assert info["action_mask"].tolist() == [0, 0]
    assert first + second == -stuck_cost(env.cell, MAKESPAN)


def test_only_refused_decisions_end_in_truncation() -> None:
    env = CellEnv(crossing())
    env.reset(seed=0)
    for _ in range(3):
        env.step(0)
    ends = [env.step(0)[2:4] for _ in range(env.max_episode_steps - 3)]
    assert set(ends[:-1]) == {(False, False)}
    assert ends[-1] == (False, True)


@given(st.integers(0, 2**32), st.sampled_from(["RSR", "SR", "R", "SSRR"]))
@settings(max_examples=20)
def test_allowed_decisions_add_up_to_the_time_that_passed(seed: int, order: str) -> None:
    env = FmsEnv(order)
    env.reset(seed=seed)
    rng, total, terminated = np.random.default_rng(seed), 0.0, False
    while not terminated:
        action = int(rng.choice(np.flatnonzero(env.action_masks())))
        state, reward, terminated, truncated, info = env.step(action)
        assert state in env.observation_space
        assert not truncated
        stuck = terminated and not info["is_success"]
        assert -reward <= env.penalty_s or stuck
        total += reward
    assert total == -(info["now_s"] if info["is_success"] else stuck_cost(env.cell, MAKESPAN))


def test_drawn_times_come_from_the_seed() -> None:
    env = ToastCellEnv(toasts=1, stochastic=True)

    def makespan_s(seed: int | None) -> float:
        env.reset(seed=seed)
        return -sum(env.step(0)[1] for _ in range(3))

    assert makespan_s(1) == makespan_s(1)
    assert len({makespan_s(1), makespan_s(None), makespan_s(None), makespan_s(2)}) == 4


def test_a_second_way_has_a_name() -> None:
    env = FmsEnv("RS")
    assert env.action_labels == ("rook 1", "sign 2", "rook 1 by way 2", "sign 2 by way 2")
    env.reset(seed=0)
    assert env.action_masks().tolist() == [1, 0, 1, 0]  # the sign has one way, and has not come yet


@pytest.mark.parametrize(
    ("name", "keywords", "said"),
    [
        ("ToastCell", {"case": "IV"}, "unknown case 'IV'"),
        ("ToastCell", {"toasts": 0}, "an order of 0 parts"),
        ("FMS", {"order": "RX"}, "letter 2, 'X', means no product"),
    ],
)
def test_a_cell_that_is_none_is_said(name: str, keywords: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        gymnasium.make(f"TeachingLab/{name}-v0", **keywords)


def test_the_cells_are_those_that_ship() -> None:
    assert FmsEnv().cell.order == load_cell("fms").cell().order
    assert ToastCellEnv("III", 4).cell.parts == 4


def test_river_swim_is_scored_by_return() -> None:
    """Its model has no goal, so the document has returns; the best policy always swims right."""
    subject = subject_of(LessonOptions("gym:TeachingLab/RiverSwim-v0", episodes=60).complete())
    place = subject.prepare(0).environment
    assert isinstance(place, GymEnvironment)
    assert place.highest_reward == 1.0
    assert place.values(0.99).argmax(axis=1).tolist() == [1] * 6
    judged = place.judge(place.values(0.99), subject.settings.learner)
    assert (judged.final_steps, judged.solved) == (None, True)
    assert round(judged.final_return or 0.0, 4) == 3.3966
