"""Tables of small problems, redone by hand."""

import pickle
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

import lab.mdp as mdp_module
from lab.errors import BadInput, WorkFailed
from lab.mdp import (
    NoPath,
    Rewards,
    TabularMDP,
    coverage,
    greedy_path,
    grid,
    optimal_values,
    shortest_path,
    shortest_steps,
)

OPEN_2X2 = np.zeros((2, 2), bool)


def walled(shape: tuple[int, ...], *cells: tuple[int, ...]) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    blocked = np.zeros(shape, bool)
    for cell in cells:
        blocked[cell] = True
    return blocked


def test_grid_moves_by_hand() -> None:
    mdp = grid((2, 2), OPEN_2X2, (0, 0), (1, 1), action_labels=("up", "down", "left", "right"))
    # cells 0 1 / 2 3; the goal, 3, is terminal and keeps to itself
    assert mdp.successor.tolist() == [[0, 2, 0, 1], [1, 3, 0, 1], [0, 2, 2, 3], [3, 3, 3, 3]]
    assert mdp.reward.tolist() == [[-0.1] * 4, [-0.1, 1.5, -0.1, -0.1], [-0.1, -0.1, -0.1, 1.5], [0.0] * 4]
    assert mdp.terminal.tolist() == mdp.goal.tolist() == [False, False, False, True]
    assert (mdp.start, mdp.shape, mdp.n_states, mdp.n_actions) == (0, (2, 2), 4, 4)
    assert (mdp.successor.dtype.name, mdp.reward.dtype.name) == ("int32", "float64")


def test_obstacle_ends_the_episode_with_the_collision_reward() -> None:
    mdp = grid((2, 2), walled((2, 2), (0, 1)), (0, 0), (1, 1), Rewards(goal=2.0, collision=-3.0, step=-0.5))
    assert mdp.action_labels == ("-axis0", "+axis0", "-axis1", "+axis1")
    assert mdp.terminal.tolist() == [False, True, False, True]
    assert mdp.goal.tolist() == [False, False, False, True]
    assert mdp.reward[0].tolist() == [-0.5, -0.5, -0.5, -3.0]
    assert mdp.reward[2].tolist() == [-0.5, -0.5, -0.5, 2.0]


def test_four_axes_move_one_coordinate_each() -> None:
    shape = (2, 3, 2, 4)
    mdp = grid(shape, np.zeros(shape, bool), (0, 0, 0, 0), (1, 2, 1, 3))
    here = int(np.ravel_multi_index((1, 1, 0, 2), shape))
    reached = [mdp.state_cell(int(s)) for s in mdp.successor[here]]
    assert reached == [
        (0, 1, 0, 2),
        (1, 1, 0, 2),  # +axis0 leaves the grid
        (1, 0, 0, 2),
        (1, 2, 0, 2),
        (1, 1, 0, 2),  # -axis2 leaves the grid
        (1, 1, 1, 2),
        (1, 1, 0, 1),
        (1, 1, 0, 3),
    ]


@pytest.mark.parametrize(
    ("shape", "blocked", "start", "goal", "said"),
    [
        ((2, 2), OPEN_2X2, (0, 2), (1, 1), "start (0, 2) is outside the grid: allowed 0..1 x 0..1"),
        ((2, 2), OPEN_2X2, (0, 0), (1, -1), "goal (1, -1) is outside"),
        ((2, 2), OPEN_2X2, (0, 0, 0), (1, 1), "start (0, 0, 0) is outside"),
        ((2, 2), walled((2, 2), (0, 0)), (0, 0), (1, 1), "start (0, 0) is blocked"),
        ((2, 2), walled((2, 2), (1, 1)), (0, 0), (1, 1), "goal (1, 1) is blocked"),
        ((2, 2), OPEN_2X2, (1, 1), (1, 1), "same cell"),
        ((2, 3), OPEN_2X2, (0, 0), (1, 1), "blocked cells have shape (2, 2)"),
        ((2, 0), np.zeros((2, 0), bool), (0, 0), (1, 1), "at least one cell"),
        ((), np.zeros((), bool), (), (), "at least one cell"),
    ],
)
def test_bad_grids(shape: tuple[int, ...], blocked: object, start: tuple[int], goal: tuple[int], said: str) -> None:
    with pytest.raises(BadInput) as caught:
        grid(shape, np.asarray(blocked), start, goal)
    assert said in str(caught.value)


def test_wrong_number_of_labels() -> None:
    with pytest.raises(BadInput, match="3 action labels for 4 actions"):
        grid((2, 2), OPEN_2X2, (0, 0), (1, 1), action_labels=("a", "b", "c"))


def test_enclosed_goal_names_its_walls() -> None:
    # the obstacle at (0, 3) stands free and is not to blame
    blocked = walled((4, 4), (3, 2), (2, 3), (2, 2), (0, 3))
    with pytest.raises(
        NoPath, match=r"no path from \(0, 0\) to \(3, 3\): the goal is enclosed by \(2, 3\), \(3, 2\)"
    ) as e:
        grid((4, 4), blocked, (0, 0), (3, 3))
    assert (e.value.enclosing, e.value.around) == (((2, 3), (3, 2)), "goal")
    again = pickle.loads(pickle.dumps(e.value))  # as from a worker process
    assert (str(again), vars(again)) == (str(e.value), vars(e.value))


def test_enclosed_start_names_its_walls() -> None:
    with pytest.raises(NoPath) as caught:
        grid((4, 4), walled((4, 4), (0, 1), (1, 0), (3, 0)), (0, 0), (3, 3))
    assert (caught.value.enclosing, caught.value.around) == (((0, 1), (1, 0)), "start")


def test_many_walls_are_shortened_in_words_only() -> None:
    blocked = np.zeros((3, 12), bool)
    blocked[1] = True
    with pytest.raises(NoPath, match="and 4 more") as caught:
        grid((3, 12), blocked, (0, 0), (2, 0))
    assert len(caught.value.enclosing) == 12


def test_coverage_of_2x2_by_hand() -> None:
    mdp = coverage((2, 2))
    assert (mdp.n_states, mdp.n_actions, mdp.shape, mdp.coverage_shape) == (64, 4, (), (2, 2))
    assert mdp.start == 0b0001
    right = int(mdp.successor[mdp.start, 3])
    assert right == (1 << 4) | 0b0011
    assert mdp.state_cell(right) == (0, 1)
    assert mdp.covered(right).tolist() == [[True, True], [False, False]]
    assert mdp.state_label(right) == "(0, 1) covered 2 of 4"
    assert mdp.successor[mdp.start, 0] == mdp.start  # up leaves the board
    states, actions, reached = greedy_path(optimal_values(mdp, 0.99), mdp, 10)
    assert (len(actions), reached, states[-1] & 0b1111) == (3, True, 0b1111)
    assert int(mdp.goal.sum()) == 4


def test_coverage_of_3x3_takes_eight_moves() -> None:
    mdp = coverage((3, 3), start=(1, 1))
    assert (mdp.n_states, shortest_steps(mdp), shortest_steps(coverage((3, 3)))) == (4608, 8, 8)


@pytest.mark.parametrize("shape", [(1, 1), (4, 4), (3,), (0, 3)])
def test_bad_coverage_board(shape: tuple[int, ...]) -> None:
    with pytest.raises(BadInput, match="coverage board"):
        coverage(shape)


def test_coverage_start_outside() -> None:
    with pytest.raises(BadInput, match="outside"):
        coverage((2, 2), start=(2, 0))


def test_optimal_values_of_a_corridor_by_hand() -> None:
    mdp = grid((3,), np.zeros(3, bool), (0,), (2,))
    first = -0.1 + 0.9 * 1.5  # V of cell 0, as V of cell 1 is 1.5
    expected = [[-0.1 + 0.9 * first, first], [-0.1 + 0.9 * first, 1.5], [0.0, 0.0]]
    np.testing.assert_allclose(optimal_values(mdp, 0.9), expected, rtol=0, atol=1e-12)


def test_values_that_never_settle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mdp_module, "MAX_SWEEPS", 50)
    loop = TabularMDP(
        np.array([[0], [1], [2]]), np.array([[-1.0], [-1.0], [0.0]]), np.arange(3) == 2, np.arange(3) == 2, 0, ("go",)
    )
    with pytest.raises(WorkFailed, match="discount 1"):
        optimal_values(loop, 1.0)
    with pytest.raises(NoPath):
        shortest_steps(loop)


def test_shortest_way_goes_round_the_obstacle() -> None:
    mdp = grid((2, 3), walled((2, 3), (0, 1)), (0, 0), (0, 2))
    assert shortest_steps(mdp) == 4
    assert shortest_path(mdp) == [0, 3, 4, 5, 2]


def test_greedy_path_ties_loops_and_limits() -> None:
    mdp = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))
    assert greedy_path(np.zeros((4, 4)), mdp, 9) == ([0, 0], [0], False)  # lowest index: up, which stays
    right = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    assert greedy_path(right, mdp, 9) == ([0, 1, 2, 3], [3, 3, 3], True)
    assert greedy_path(right, mdp, 2) == ([0, 1, 2], [3, 3], False)
    assert greedy_path(right, mdp, 9, start=2) == ([2, 3], [3], True)


def test_signature_tells_problems_apart() -> None:
    base = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))
    again = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))
    assert base.signature == again.signature
    assert len(base.signature) == 16
    assert set(base.signature) <= set("0123456789abcdef")
    others = [
        grid((2, 3), walled((2, 3), (0, 2)), (0, 0), (1, 2)),
        grid((2, 3), np.zeros((2, 3), bool), (0, 1), (1, 2)),
        grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 1)),
        grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2), Rewards(step=-0.2)),
        grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2), action_labels="abcd"),
        replace(base, shape=(6,)),
        replace(base, starts=(0, 1)),
    ]
    assert len({base.signature, *(other.signature for other in others)}) == len(others) + 1


def test_arrays_are_copied_and_read_only() -> None:
    reward = np.zeros((2, 1))
    mdp = TabularMDP(np.array([[1], [1]]), reward, np.array([False, True]), np.array([False, True]), 0, ("go",))
    reward[0, 0] = 9.0
    assert mdp.reward[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        mdp.reward[0, 0] = 1.0
    assert mdp.state_label(1) == "1"
    assert mdp.state_cell(1) == ()
    with pytest.raises(BadInput, match="state 2 is outside"):
        mdp.state_label(2)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"successor": np.array([[2], [1]])}, "outside 0..1"),
        ({"successor": np.zeros((0, 1), int)}, "none of them 0"),
        ({"reward": np.zeros((2, 2))}, "must have shapes"),
        ({"reward": np.array([[np.nan], [0.0]])}, "not finite"),
        ({"terminal": np.array([False, False])}, "not terminal"),
        ({"start": 1}, "terminal state"),
        ({"start": 2}, "outside 0..1"),
        ({"starts": (0, 1)}, "start 1"),
        ({"action_labels": ()}, "0 action labels"),
        ({"shape": (3,)}, "does not hold 2 states"),
    ],
)
def test_tables_that_do_not_fit(changed: dict[str, Any], said: str) -> None:
    end = np.array([False, True])
    sound = TabularMDP(np.array([[1], [1]]), np.zeros((2, 1)), end, end, 0, ("go",))
    with pytest.raises(BadInput, match=said):
        replace(sound, **changed)


@given(st.data())
def test_any_grid_is_solved_or_says_what_is_wrong(data: st.DataObject) -> None:
    shape = tuple(data.draw(st.lists(st.integers(1, 4), min_size=1, max_size=3), label="shape"))
    size = int(np.prod(shape))
    blocked = np.array(data.draw(st.lists(st.booleans(), min_size=size, max_size=size), label="blocked")).reshape(shape)
    cell = st.tuples(*(st.integers(-1, n) for n in shape))
    start, goal = data.draw(cell, label="start"), data.draw(cell, label="goal")
    try:
        mdp = grid(shape, blocked, start, goal, Rewards(collision=-100.0))
    except BadInput as error:
        inside = all(0 <= i < n for c in (start, goal) for i, n in zip(c, shape, strict=True))
        sensible = inside and start != goal and not (blocked[start] or blocked[goal])
        walls = error.enclosing if isinstance(error, NoPath) else ()
        event(type(error).__name__)
        assert sensible == isinstance(error, NoPath) == bool(walls)  # noqa: PT017 - raising depends on the draw
        assert all(blocked[cell] for cell in walls)
        return
    states, actions, reached = greedy_path(optimal_values(mdp, 0.99), mdp, size)
    assert reached
    assert len(actions) == shortest_steps(mdp)
    way = shortest_path(mdp)
    assert len(way) == len(states)
    assert way[0] == mdp.start
    assert mdp.goal[way[-1]]
    assert not mdp.terminal[way[:-1]].any()
    assert all(after in mdp.successor[before] for before, after in pairwise(way))
    assert states[-1] == np.ravel_multi_index(goal, shape)
