"""Whether a policy fits another problem: on boards of 3 rows and 4 columns that can be redone by hand."""

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray, NoPath, TabularMDP, greedy_path, grid, optimal_values, shortest_steps
from lab.toolbox.fitness import MOST_JUDGED, best_fit, comparable, followed, judged, reference, warm_start
from lab.toolbox.policy import Origin, Policy
from lab.toolbox.policy_file import encode

Cell = tuple[int, int]
SHAPE = (3, 4)
START, GOAL = (0, 0), (0, 3)
UP, DOWN, LEFT, RIGHT = range(4)


def state(cell: Cell) -> int:
    return cell[0] * SHAPE[1] + cell[1]


def board(*blocked: Cell, start: Cell = START, goal: Cell = GOAL, starts: Sequence[Cell] = ()) -> TabularMDP:
    """S . . G above two more rows, with obstacles."""
    walls = np.zeros(SHAPE, bool)
    for cell in blocked:
        walls[cell] = True
    return replace(grid(SHAPE, walls, start, goal), starts=tuple(state(cell) for cell in starts))


def learned(mdp: TabularMDP, q: FloatArray | None = None, name: str = "way") -> Policy:
    """A policy that has made every move of a problem, and takes a shortest way unless a table says otherwise."""
    learner, gate = LearnerSettings(episodes=1, max_steps=1), GateSettings("never")
    result = Session(mdp, learner, gate, None, np.random.default_rng(0)).run()
    made = Policy.of(result, mdp, learner, gate, Origin(name, "insert", "toast", "none", 0))
    visits = np.where(mdp.terminal[:, None], 0, np.ones_like(made.visits))
    return replace(made, q=optimal_values(mdp, 0.99) if q is None else q, visits=visits)


def only(mdp: TabularMDP, *moves: tuple[Cell, int]) -> Policy:
    """A policy that has made only these moves, each the best in its cell."""
    q, visits = np.zeros((12, 4)), np.zeros((12, 4), np.int64)
    for cell, action in moves:
        q[state(cell), action], visits[state(cell), action] = 1.0, 1
    return replace(learned(mdp, q), visits=visits)


# ---- used as it is -------------------------------------------------------------------------------------------------


def test_a_change_beside_the_way_does_not_matter() -> None:
    fitness = judged(learned(board()), board((2, 2)))
    assert (fitness.verdict, fitness.reason) == ("use", "its path is free and shortest")
    assert (fitness.coverage, fitness.reached, fitness.worst, fitness.mean, fitness.changed) == (1.0, 1.0, 0, 0.0, 1)
    assert fitness.value == pytest.approx(-0.1 + 0.99 * (-0.1 + 0.99 * 1.5))  # two steps, then the goal


def test_the_values_scale_and_the_learner_do_not_matter() -> None:
    one = learned(board())
    other = replace(one, q=1000.0 * one.q - 7.0, learner={"learner": "afterstate"}, signature="0" * 16)
    assert judged(other, board((2, 2))).verdict == "use"


def test_another_start_on_its_way_is_no_new_problem() -> None:
    along = only(board(), ((0, 0), RIGHT), ((0, 1), RIGHT), ((0, 2), RIGHT))
    assert judged(along, board(start=(0, 1))).verdict == "use"


def test_several_starts_may_be_a_little_above_the_shortest_in_the_mean() -> None:
    starts = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2)]
    mdp = board(starts=starts)
    q = optimal_values(mdp, 0.99)
    q[state((1, 2))], q[state((2, 2))] = [0, 1, 0, 0], [0, 0, 0, 1]  # down, right, up, up where up, right are enough
    fitness = judged(learned(mdp, q), board((2, 0), starts=[cell for cell in starts if cell != (2, 0)]))
    assert (fitness.verdict, fitness.worst) == ("adapt", 2)  # 2 / 7 of a move in the mean
    fitness = judged(learned(mdp, q), mdp)
    assert (fitness.verdict, fitness.worst, fitness.mean) == ("use", 2, 0.25)
    assert fitness.reason == "its paths from all 8 starts are free, in the mean 0.25 moves above the shortest"


# ---- adapted -------------------------------------------------------------------------------------------------------


def test_what_stands_in_its_way_is_named_and_gone_around() -> None:
    old, mdp = learned(board()), board((0, 1))
    fitness = judged(old, mdp)
    assert fitness.verdict == "adapt"
    assert fitness.reason == "its path meets what is in the way at (0, 1); 1 of 12 states changed"
    assert (fitness.reached, fitness.worst, fitness.mean, fitness.warm) == (0.0, None, None, 1.0)
    assert (fitness.moves, fitness.fewest) == (None, 5)
    states, _, reached = greedy_path(warm_start(old, mdp), mdp, 12)
    assert reached
    assert states == [state(cell) for cell in ((0, 0), (1, 0), (1, 1), (1, 2), (0, 2), (0, 3))]


def test_a_shorter_way_that_was_blocked_is_to_be_found() -> None:
    old = only(board((0, 1)), *(((0, 0), DOWN), ((1, 0), RIGHT), ((1, 1), RIGHT), ((1, 2), UP), ((0, 2), RIGHT)))
    fitness = judged(old, board())
    assert fitness.reason == "its path is free, but 2 moves longer than the shortest; 1 of 12 states changed"
    assert (fitness.verdict, fitness.worst, fitness.moves, fitness.fewest) == ("adapt", 2, 5, 3)
    assert warm_start(old, board())[state((0, 0)), RIGHT] == 0.0  # it knows nothing of that, and may try it


def test_a_way_in_circles_is_told() -> None:
    round_and_round = only(board(), ((0, 0), RIGHT), ((0, 1), LEFT))
    fitness = judged(round_and_round, board((2, 2)))
    assert fitness.reason.startswith("its path goes round in circles at (0, ")
    assert fitness.verdict == "adapt"  # same start, same goal


def test_a_warm_start_keeps_what_did_not_change() -> None:
    old = learned(board())
    np.testing.assert_allclose(warm_start(old, board()), old.q)
    q = warm_start(old, board((1, 1)))
    np.testing.assert_allclose(q, optimal_values(board((1, 1)), 0.99))  # every move was made, one cell is in the way
    assert q[state((0, 1)), DOWN] == -1.0  # the survey has seen it: nobody need meet it
    part = warm_start(only(board(), ((0, 2), RIGHT)), board())
    assert np.argwhere(part).tolist() == [[state((0, 2)), RIGHT]]
    assert part[state((0, 2)), RIGHT] == 1.5  # in the rewards of this problem


# ---- refused -------------------------------------------------------------------------------------------------------


def test_who_knows_no_way_to_another_goal_is_refused() -> None:
    along = only(board(), ((0, 0), RIGHT), ((0, 1), RIGHT), ((0, 2), RIGHT))
    fitness = judged(along, board((0, 2), goal=(2, 3)))
    assert fitness.verdict == "refuse"
    assert fitness.reason == (
        "its path meets what is in the way at (0, 2); 3 of 12 states changed; "
        "the goal is not where it was, and it knows no path from here to there"
    )
    assert judged(learned(board()), board(goal=(2, 3))).verdict == "adapt"  # it has been everywhere
    fitness = judged(along, board((1, 0), start=(2, 0)))
    assert fitness.verdict == "refuse"
    assert "the start is not where it was" in fitness.reason


def test_another_table_is_no_candidate() -> None:
    one, taller = learned(board()), grid((4, 3), np.zeros((4, 3), bool), (0, 0), (3, 2))
    assert judged(one, taller).reason == "its table has other states or moves"
    named = replace(board(), action_labels=("n", "s", "w", "e"))
    assert [comparable(one, mdp) for mdp in (board((2, 2)), taller, named)] == [True, False, False]


# ---- one of several ------------------------------------------------------------------------------------------------


def test_the_best_of_several_is_found() -> None:
    mdp = board((0, 1))
    blocked, around = learned(board(), name="blocked"), learned(board((0, 1), (2, 3)), name="around")
    longer = only(board(), *(((r, 0), DOWN) for r in (0, 1)), *(((2, c), RIGHT) for c in (0, 1, 2)), ((2, 3), UP))
    longer = replace(longer, name="longer", q=longer.q + np.eye(4)[UP] * (np.arange(12) == state((1, 3)))[:, None])
    for order in ([blocked, longer, around], [around, longer, blocked]):
        found = best_fit(order, mdp)
        assert found is not None
        assert (found[0].name, found[1].verdict) == ("around", "use")
    assert best_fit([], mdp) is None
    assert best_fit([replace(blocked, action_labels=("n", "s", "w", "e"))], mdp) is None


def test_only_the_first_ones_are_looked_at() -> None:
    mdp = board((0, 1))
    hopeless = [learned(board(), np.zeros((12, 4)))] * MOST_JUDGED
    found = best_fit([*hopeless, learned(mdp)], mdp)
    assert found is not None
    assert found[1].verdict == "adapt"


def test_a_reference_names_the_table() -> None:
    one = learned(board(), name="way")
    assert reference(one) == f"way@{sha256(encode(one)).hexdigest()[:12]}"
    assert reference(replace(one, q=one.q + 1.0)) != reference(one)


# ---- whatever the boards -------------------------------------------------------------------------------------------

cells = st.sets(st.tuples(st.integers(0, 2), st.integers(0, 3)), max_size=5)


@st.composite
def boards(draw: st.DrawFn) -> TabularMDP:
    start, goal = draw(
        st.tuples(st.sampled_from([(r, 0) for r in range(3)]), st.sampled_from([(r, 3) for r in range(3)]))
    )
    starts = draw(st.lists(st.sampled_from([(r, 1) for r in range(3)]), max_size=3))
    blocked = draw(cells) - {start, goal, *starts}
    try:
        return board(*blocked, start=start, goal=goal, starts=starts)
    except NoPath:
        assume(False)
        raise


@given(boards(), boards(), st.integers(0, 99))
def test_a_verdict_holds_step_by_step(old: TabularMDP, new: TabularMDP, seed: int) -> None:
    rng = np.random.default_rng(seed)
    one = learned(old, optimal_values(old, 0.99) + rng.choice([0.0, 1.0]) * rng.normal(size=(12, 4)))
    one = replace(one, visits=one.visits * rng.integers(0, 2, (12, 4)))
    fitness, starts = judged(one, new), new.starts or (new.start,)
    ways = [greedy_path(one.q, new, 12, start) for start in starts]
    assert fitness.reached == pytest.approx(np.mean([reached for _, _, reached in ways]))
    above = [len(actions) - shortest_steps(replace(new, start=way[0], starts=())) for way, actions, ok in ways if ok]
    assert (fitness.worst, fitness.mean) == ((max(above), pytest.approx(np.mean(above))) if above else (None, None))
    if fitness.verdict == "use":
        assert len(above) == len(starts)
        assert max(above) == 0 or len(starts) > 1
    if fitness.verdict == "refuse":
        assert not above
    q = warm_start(one, new)
    assert not q[new.terminal].any()
    assert np.isfinite(q).all()


@given(boards(), st.integers(0, 99))
def test_all_ways_at_once_are_those_one_by_one(mdp: TabularMDP, seed: int) -> None:
    q = np.random.default_rng(seed).normal(size=(12, 4))
    end, moves = followed(q, mdp)
    for start in np.flatnonzero(~mdp.terminal).tolist():
        states, actions, reached = greedy_path(q, mdp, 12, start)
        assert bool(mdp.goal[end[start]]) == reached
        if mdp.terminal[states[-1]]:
            assert (end[start], moves[start]) == (states[-1], len(actions))
        else:
            assert not mdp.terminal[end[start]]
