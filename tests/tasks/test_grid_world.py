"""Grid worlds: small ones by hand, drawn ones always with a way, text grids with every slip said by line and column."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning.environment import TableEnvironment
from lab.learning.requests import AdviceRequest
from lab.learning.selection import uniforms
from lab.learning.session import Session
from lab.learning.settings import LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.mdp import NoPath, Rewards, greedy_path, optimal_values, shortest_steps
from lab.seat.grid_text import Marks, picture_of
from lab.seat.terminal.typed_answer import understand
from lab.tasks.grid_world import (
    MAX_DENSITY,
    AdvisorView,
    GridWorld,
    from_rows,
    from_text,
    from_words,
    parse_shape,
    random_world,
)
from lab.tasks.record import walking
from lab.tasks.task_file import load_world

SMALL = GridWorld(
    name="small",
    shape=(2, 3),
    start=(0, 0),
    goal=(0, 2),
    obstacles=((0, 1),),
    view=AdvisorView(lower=(0, 1), upper=(1, 2)),
)


# ---- by hand ------------------------------------------------------------------------------------------------------


def test_rows_run_down_and_columns_to_the_right() -> None:
    mdp = SMALL.mdp()
    assert mdp.action_labels == ("up", "down", "left", "right")
    assert mdp.successor[0].tolist() == [0, 3, 0, 1]  # from (0, 0): the border, (1, 0), the border, (0, 1)
    assert mdp.reward[0].tolist() == [-0.1, -0.1, -0.1, -11.5]
    assert mdp.reward[5, 0] == 1.5  # from (1, 2) up
    assert (mdp.start, np.flatnonzero(mdp.goal).tolist(), shortest_steps(mdp)) == (0, [2], 4)


def test_three_axes_are_x_y_z() -> None:
    mdp = GridWorld(name="cube", shape=(3, 3, 3), start=(0, 0, 0), goal=(2, 2, 2)).mdp()
    moved = {label: mdp.state_cell(int(mdp.successor[13, n])) for n, label in enumerate(mdp.action_labels)}
    assert moved == {
        "left": (0, 1, 1),
        "right": (2, 1, 1),
        "backward": (1, 0, 1),
        "forward": (1, 2, 1),
        "down": (1, 1, 0),
        "up": (1, 1, 2),
    }


def test_blocked_cells_and_the_region_of_the_view() -> None:
    assert SMALL.blocked().tolist() == [[False, True, False], [False] * 3]
    assert SMALL.region().tolist() == [False, True, True, False, True, True]
    alone = GridWorld(name="alone", shape=(1, 2), start=(0, 0), goal=(0, 1))
    assert (alone.blocked().tolist(), alone.region().tolist()) == ([[False, False]], [True, True])


def test_obstacles_that_part_start_and_goal_are_named() -> None:
    with pytest.raises(
        NoPath, match=r"^world 'w': no path from \(0, 0\) to \(0, 2\): the goal is enclosed by \(0, 1\)$"
    ):
        GridWorld(name="w", shape=(1, 3), start=(0, 0), goal=(0, 2), obstacles=((0, 1),)).mdp()


def test_world_1_is_the_one_of_the_thesis() -> None:
    """Section 9.7 and App. VII: 13 steps with the start, and the limited view x > 5, 2 < y < 10, 2 < z < 9 from 1."""
    world = load_world("world-1")
    assert (world.blocked().sum(), shortest_steps(world.mdp()) + world.learner.count_start) == (59, 13)
    x, y, z = np.indices(world.shape) + 1
    assert (world.region().reshape(world.shape) == ((x > 5) & (y > 2) & (y < 10) & (z > 2) & (z < 9))).all()
    assert (world.learner.learner, world.learner.episodes, world.learner.max_steps) == ("afterstate", 200, 200)
    assert (world.gate.gate, world.gate.first_episode, world.gate.window) == ("ccrl", 30, 5)


@pytest.mark.parametrize(
    ("moves", "discount", "worth"), [(1, 0.5, 1.5), (3, 0.5, -0.1 - 0.05 + 0.375), (3, 1.0, -0.2 + 1.5)]
)
def test_the_worth_of_a_way(moves: int, discount: float, worth: float) -> None:
    world = SMALL.model_copy(update={"learner": LearnerSettings(discount=discount)})
    assert world.worth(moves, 1.5) == pytest.approx(worth)


def test_a_world_where_no_way_pays_is_refused() -> None:
    """A way of 79 moves costs more than running into the wall at once; what the values say, too."""
    dear = GridWorld(name="far", shape=(2, 80), start=(0, 0), goal=(0, 79), obstacles=((1, 0),))
    far = dear.model_copy(update={"rewards": Rewards(collision=-1.0)})
    reason = r"rewards.collision = -1.0: .* is worth -1.00 and the path of 79 moves only -4.75: wanted a lower one"
    with pytest.raises(BadInput, match=rf"^world 'far': {reason}"):
        far.check()
    assert not greedy_path(optimal_values(far.mdp(), 0.99), far.mdp(), 100)[2]
    assert greedy_path(optimal_values(dear.check(), 0.99), dear.mdp(), 100)[2]


def test_episodes_that_are_too_short_are_refused() -> None:
    short = SMALL.model_copy(update={"learner": LearnerSettings(max_steps=3)})
    with pytest.raises(BadInput, match=r"learner.max_steps = 3: the shortest path has 4 moves and needs 4 steps$"):
        short.check()


# ---- text grids ---------------------------------------------------------------------------------------------------


def grid_file(folder: Path, text: str, name: str = "grid.txt") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize("text", ["S#.\n..G\n", "S#.\r\n..G\r\n", "S#.\n..G", "S#.\n..G\n\n\n"])
def test_a_text_grid(tmp_path: Path, text: str) -> None:
    world = from_text(grid_file(tmp_path, text, "(1) my grid.txt"))
    grid = {"shape": (2, 3), "start": (0, 0), "goal": (1, 2), "obstacles": ((0, 1),)}
    assert world.model_dump(include={"name", *grid}) == {"name": "1- my grid", **grid}
    assert (world.learner.learner, world.learner.episodes) == ("afterstate", 500)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty: wanted rows of . # S G"),
        ("S.G\n..\n", "line 2: 2 cells, line 1 has 3: wanted the same number"),
        ("S.G\n\n...\n", "line 2: 0 cells, line 1 has 3: wanted the same number"),
        ("S.G\n.x.\n", "line 2, column 2: 'x': allowed are . # S G"),
        ("S.G\n. .\n", "line 2, column 2: ' ': allowed are . # S G"),
        ("S.G\n..\t\n", r"line 2, column 3: '\t': allowed are . # S G"),
        ("S.G\n.G.\n", "line 2, column 2: a second 'G', the first is in line 1, column 3"),
        ("S.G\n..S\n", "line 2, column 3: a second 'S', the first is in line 1, column 1"),
        ("..G\n...\n", "no 'S' (start) in 2 lines: exactly one is wanted"),
        ("S..\n", "no 'G' (goal) in 1 lines: exactly one is wanted"),
        ("SG" + "." * 1199, "shape 1x1201: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
        ("SG\n" + "..\n" * 1200, "shape 1201x2: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
    ],
)
def test_a_slip_in_a_text_grid_is_said_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    path = grid_file(tmp_path, text)
    with pytest.raises(BadInput) as caught:
        from_text(path)
    assert str(caught.value) == f"{path}: {said}"


def test_an_obstacle_of_a_text_grid_blocks() -> None:
    """Down from (0, 1) is the obstacle (1, 1): it stays, for the price of a step; down from (0, 0) is (1, 0)."""
    world = from_rows("S..\n.#.\n..G", "maze", "test")
    mdp = world.check()
    assert (mdp.successor[1, 1], mdp.reward[1, 1], mdp.successor[0, 1]) == (1, -0.1, 3)
    assert set(mdp.successor[~mdp.terminal].ravel()) == set(range(9)) - {4}
    assert tomllib.loads(world.to_toml())["deadly"] is False


def test_an_obstacle_ends_the_episode_where_the_file_says_so() -> None:
    text = "S..\n.#.\n..G"
    above, said = from_rows(f"deadly = true\n{text}", "maze", "test"), from_rows(text, "maze", "test", deadly=True)
    assert above == said
    mdp = above.check()
    assert (mdp.successor[1, 1], mdp.reward[1, 1], bool(mdp.terminal[4])) == (4, above.rewards.collision, True)
    assert "deadly" not in tomllib.loads(above.to_toml())
    assert not from_rows(f"deadly = false\n{text}", "maze", "test", deadly=True).deadly


def test_the_worlds_of_the_thesis_and_drawn_ones_are_deadly() -> None:
    """Their signatures are those from before text grids blocked."""
    assert [load_world(name).deadly for name in ("world-1", "world-2", "random:8x8:0.2:0")] == [True] * 3
    assert load_world("random:8x8:0.2:0").mdp().signature == "03a93b2db437396c"


def test_a_text_grid_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "grid.txt"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(BadInput, match=f"^{path}: cannot be read: 'utf-8'"):
        from_text(path)


def test_a_long_way_gets_long_episodes_and_dear_collisions(tmp_path: Path) -> None:
    """A corridor that winds through 21 x 21 cells: 11 rows and 10 turns, 240 moves."""
    rows = ["." * 21 if row % 2 == 0 else ("." * (row % 4 > 1)).ljust(1, "#") + "#" * 19 for row in range(21)]
    rows = [row if len(row) == 21 else row + ("#" if row[0] == "." else ".") for row in rows]
    rows[0], rows[20] = "S" + rows[0][1:], rows[20][:-1] + "G"
    world = from_text(grid_file(tmp_path, "\n".join(rows)))
    assert (shortest_steps(world.check()), world.learner.max_steps, world.rewards.collision) == (240, 960, -11.5)


# ---- drawn worlds -------------------------------------------------------------------------------------------------

SHAPES = st.lists(st.integers(1, 9), min_size=2, max_size=3).map(tuple)


@given(SHAPES, st.floats(0, MAX_DENSITY), st.integers(0, 10**9))
def test_a_drawn_world_always_has_a_way(shape: tuple[int, ...], density: float, seed: int) -> None:
    far = max(1, (sum(shape) - len(shape) + 1) // 2)
    free = int(np.prod(shape)) - round(density * int(np.prod(shape)))
    if free <= far:
        with pytest.raises(BadInput, match=f"leaves {free} cells? free, start and goal far apart need {far + 1}$"):
            random_world(shape, density, seed)
        return
    world = random_world(shape, density, seed)
    assert far <= np.abs(np.subtract(world.start, world.goal)).sum() <= shortest_steps(world.check())
    assert len(world.obstacles) == world.blocked().sum() == round(density * int(np.prod(shape)))
    assert world == random_world(shape, density, seed)
    assert GridWorld.model_validate(tomllib.loads(world.to_toml())) == world


def test_another_seed_draws_another_world() -> None:
    worlds = [random_world((10, 10, 10), 0.06, seed) for seed in range(5)]
    assert len({(world.start, world.goal, world.obstacles) for world in worlds}) == 5
    assert {len(world.obstacles) for world in worlds} == {60}


def test_a_crowded_plane_still_has_a_way() -> None:
    """At 60 % scattered obstacles practically never leave a way through a plane: one is kept free."""
    world = random_world((60, 60), 0.6, 3)
    assert world.blocked().sum() == 2160
    assert shortest_steps(world.check()) == np.abs(np.subtract(world.start, world.goal)).sum() >= 59


@pytest.mark.parametrize(
    ("shape", "density", "seed", "said"),
    [
        ((5,), 0.1, 0, "shape 5: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
        ((5, 5, 5, 5), 0.1, 0, "shape 5x5x5x5: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
        ((5, 1201), 0.1, 0, "shape 5x1201: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
        ((5, 0), 0.1, 0, "shape 5x0: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells"),
        ((5, 5), 0.61, 0, "density 0.61: allowed are 0 to 0.6"),
        ((5, 5), -0.1, 0, "density -0.1: allowed are 0 to 0.6"),
        ((5, 5), float("nan"), 0, "density nan: allowed are 0 to 0.6"),
        ((5, 5), 0.1, -1, "seed -1: allowed is 0 or more"),
        ((1, 1), 0.0, 0, "density 0.0 leaves 1 cell free, start and goal far apart need 2"),
        ((1, 100), 0.6, 0, "density 0.6 leaves 40 cells free, start and goal far apart need 51"),
    ],
)
def test_worlds_that_cannot_be_drawn(shape: tuple[int, ...], density: float, seed: int, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        random_world(shape, density, seed)
    assert str(caught.value) == f"random world {'x'.join(map(str, shape))}: {said}"


def test_a_world_in_words() -> None:
    assert from_words("random:4x5:0.2:7") == random_world((4, 5), 0.2, 7)
    assert parse_shape("4x5x6", "x") == (4, 5, 6)


@pytest.mark.parametrize(
    "word", ["random:", "random:4x5", "random:4x5:0.2", "random:4x5:0.2:-1", "random:4x5:e:1", "random:4x5:0.2:1:1"]
)
def test_words_that_mean_no_world(word: str) -> None:
    with pytest.raises(BadInput, match=f"^world '{word}': wanted random:SHAPE:DENSITY:SEED, such as"):
        from_words(word)


@pytest.mark.parametrize("text", ["", "x", "4x", "4,5", "4X5", "-4x5", "4x5x6x7", "0x5", "5000x1000", "٤x٤"])
def test_words_that_mean_no_shape(text: str) -> None:
    with pytest.raises(BadInput, match=f"^SHAPE: shape .{'*' if len(text) < 3 else '+'}"):
        parse_shape(text, "SHAPE")


# ---- at the terminal ----------------------------------------------------------------------------------------------


def request(world: GridWorld, cell: tuple[int, ...], action: int) -> AdviceRequest:
    mdp = world.mdp()
    state = int(np.ravel_multi_index(cell, world.shape))
    q = [[0.0] * mdp.n_actions for _ in range(mdp.n_states)]
    return AdviceRequest(mdp=mdp, q=q, state=state, episode=30, step=1, own=action, allowed=range(mdp.n_actions))


def test_a_person_sees_a_text_grid_as_it_stands() -> None:
    picture = picture_of(request(SMALL, (1, 0), 3), Marks(free="."), 80, 24)
    assert picture is not None
    assert [line.plain for line in picture.lines] == [" . # G", " R → ."]
    assert [understand(word, SMALL.mdp()) for word in ("up", "d", "←", "right")] == [0, 1, 2, 3]


def test_a_person_sees_a_cube_from_above() -> None:
    cube = GridWorld(name="cube", shape=(3, 2, 2), start=(0, 0, 0), goal=(2, 1, 1), obstacles=((1, 1, 0),))
    picture = picture_of(request(cube, (0, 0, 0), 3), Marks(free="."), 80, 24)
    assert picture is not None
    assert [line.plain[:6] for line in picture.lines[1:3]] == [" ↑ # g", " R . ."]
    assert [understand(word, cube.mdp()) for word in ("left", "back", "forward", "↑", "up")] == [0, 2, 3, 3, 5]


# ---- goals far away -----------------------------------------------------------------------------------------------


def test_a_goal_that_nobody_finds_by_chance_is_learned_from_being_shown() -> None:
    world = random_world((700, 2), 0.0, 3)
    mdp, learner = world.check(), world.learner
    assert shortest_steps(mdp) > 300
    assert learner.start_value == pytest.approx(walking(world.rewards.step, learner), abs=1e-6)
    place, draw = TableEnvironment(mdp), uniforms(np.random.default_rng(0))
    expert = TableAdvisor(Advice.of(advice_chances(place.values(learner.discount), 0.01)), draw)
    result = Session(mdp, replace(learner, episodes=30), world.gate, expert, draw).run()
    assert result.solved
    assert 0 < result.helped_steps <= 12 * shortest_steps(mdp)
    assert random_world((30, 30), 0.1, 3).learner.learner == "afterstate"  # a near one is found alone
