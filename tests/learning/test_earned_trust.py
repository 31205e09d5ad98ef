"""The gate earned-trust: its rules on cases that can be redone by hand."""

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from lab.learning.gates import GATES, Surroundings, earned_trust
from lab.learning.gates.weighing import Weighing
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.learning.updates.update import OnTable
from lab.mdp import FloatArray, NoPath, TabularMDP, grid, optimal_values

LEFT, RIGHT, STAY = range(3)
EPISODES, LIMIT, STATES = 10, 20, 6

Move = tuple[int, int | None, int, int]  # state, answer, the learner's own choice, state entered


class Table(OnTable):
    """Q-learning with learning rate 1/2 and no discount, on a table of zeros."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Moves half of the way to the target."""
        self.q[s_tm1][a_tm1] += 0.5 * (r_t + discount_t * max(self.q[s_t]) - self.q[s_tm1][a_tm1])


def line() -> TabularMDP:
    """A problem of one row, whose table only the base class of learners asks for."""
    return grid((1, STATES), [[0] * STATES], (0, 0), (0, STATES - 1))


def gate(u: float = 0.5, several: bool = False) -> tuple[Weighing, list[list[float]]]:
    """A gate in a problem of 6 states and 3 actions, whose uniform numbers are all u, and its learner's table."""
    table = [[0.0] * 3 for _ in range(STATES)]
    settings = LearnerSettings(alpha=0.5, discount=1.0)
    learner = Table(table, settings, line())
    around = Surroundings(
        lambda: u, lambda count: [], several, lambda state: table[state], (STATES, 3), settings, update=learner
    )
    made = GATES["earned-trust"].make(GateSettings("earned-trust"), EPISODES, LIMIT, around)
    assert isinstance(made, Weighing)
    made.opens(1, [])
    return made, table


def walk(one: Weighing, moves: list[Move], reached: bool, over: bool = False) -> list[int]:
    """An episode of the moves, each with reward -1; the actions that were taken."""
    one.begins(moves[0][0])
    taken = []
    for number, (state, said, own, entered) in enumerate(moves, start=1):
        asked = one.asks(state, [])
        taken.append(one.takes(state, own, said if asked else None))
        ends = (reached or over) and number == len(moves)
        one.saw(state, taken[-1], -1.0, 0.0 if ends else 1.0, entered, 0)
    one.judges([len(moves) if reached else LIMIT + 1], True)
    return taken


SHOWN: list[Move] = [(0, RIGHT, LEFT, 1), (1, RIGHT, LEFT, 2), (2, RIGHT, LEFT, 3)]


def test_it_remembers_and_asks_no_more_where_it_is_sure() -> None:
    one, _ = gate()
    assert walk(one, SHOWN, True) == [RIGHT] * 3
    assert one.heard.now.rate == 1.0
    one.begins(0)
    assert one.asks(0, [])  # one answer alone leads by no more than the root of one
    one.takes(0, LEFT, RIGHT)
    assert not one.asks(0, [])  # two alike do
    assert one.takes(0, LEFT, None) == RIGHT  # and it is followed without asking


def test_it_drops_an_answer_that_led_into_a_loop() -> None:
    one, _ = gate()
    walk(one, SHOWN, True)
    one.begins(0)
    for state, said, entered in ((0, STAY, 4), (4, LEFT, 0)):
        one.takes(state, LEFT, said)
        one.saw(state, said, -1.0, 1.0, entered, 0)
    assert np.flatnonzero(one.heard.blamed).tolist() == [STAY]  # back in 0 by advised moves alone


def test_it_gives_an_episode_up_after_loops_without_success() -> None:
    one, _ = gate()
    one.begins(0)
    loops = int(GateSettings.strikes)
    for state in range(loops):
        assert one.heard.now.advised == 1.0
        one.takes(state, RIGHT, STAY)
        one.saw(state, STAY, -1.0, 1.0, state, 0)  # staying is a loop
    assert one.heard.now.advised == earned_trust.GIVEN_UP
    assert not one.asks(5, [])
    one.judges([LIMIT], True)  # it reached the goal by itself
    assert (one.heard.now.helped, one.heard.now.won) == (1.0, 0.0)


def test_a_success_with_few_advised_moves_is_the_learners_own() -> None:
    one, _ = gate()
    walk(one, [(0, RIGHT, LEFT, 1), *[(k, None, RIGHT, k + 1) for k in range(1, 5)]], True)  # a fifth is advised
    now = one.heard.now
    assert (now.helped, now.own, now.own_rate) == (0.0, 1.0, 1.0)


def test_what_was_said_in_vain_is_forgotten() -> None:
    one, _ = gate()
    walk(one, [(0, RIGHT, LEFT, 3)], False, over=True)
    assert not any(one.heard.blamed)
    assert not any(one.heard.times)
    proven, _ = gate()
    walk(proven, SHOWN, True)
    walk(proven, [(0, RIGHT, LEFT, 4)], False, over=True)
    assert np.flatnonzero(proven.heard.blamed).tolist() == [RIGHT]


@pytest.mark.parametrize(("u", "advised"), [(0.06, 1.0), (0.07, 0.0)])
def test_what_never_worked_is_tried_seldom(u: float, advised: float) -> None:
    one, _ = gate(u)
    walk(one, [(0, RIGHT, LEFT, 3)], False, over=True)
    one.begins(0)  # once in 2**4
    assert one.heard.now.advised == advised


def test_the_known_path_becomes_the_greedy_one() -> None:
    one, table = gate()
    table[0][RIGHT] = table[1][RIGHT] = -1.0  # as if learned; the other actions look better
    table[2][RIGHT] = -0.5
    walk(one, SHOWN, True)
    assert [max(range(3), key=row.__getitem__) for row in table[:3]] == [RIGHT] * 3
    # learned again, the last one first: 1 leads to 2, whose best is -0.5; then 0 to 1, whose best is -1.25
    assert [table[k][RIGHT] for k in range(3)] == [-1.625, -1.25, -0.5]
    margin = GateSettings.margin  # the temperature of the first episode is 1
    assert table[0][LEFT] == table[0][STAY] == pytest.approx(-1.625 - margin)
    assert table[4] == [0.0] * 3


def test_a_greedy_path_that_is_as_short_is_left_alone() -> None:
    one, table = gate()
    for state in range(3):
        table[state] = [-5.0, -1.0, -9.0]
    walk(one, SHOWN, True)
    assert table[:3] == [[-5.0, -1.0, -9.0]] * 3


def test_a_shortcut_that_was_made_shortens_the_known_path() -> None:
    one, _ = gate()
    walk(one, SHOWN, True)
    assert one.heard.fewest[0] == 3
    one.opens(2, [3])
    one.begins(0)
    one.saw(0, STAY, -1.0, 1.0, 2, 0)
    one.saw(2, RIGHT, -1.0, 0.0, 3, 0)
    one.judges([3, 2], True)
    assert (one.heard.fewest[0], one.heard.way[0]) == (2, STAY)


def test_with_one_start_it_acts_alone_after_successes_that_show_nothing_new() -> None:
    one, _ = gate(u=0.0)
    asked = []
    for _ in range(int(earned_trust.STALE) + 2):
        walk(one, SHOWN, True)
        asked.append(one.heard.now.advised)
    assert asked == [1.0, 1.0, 1.0, 0.0]  # the first is new, and then STALE that are not


def test_with_several_starts_it_acts_alone_where_its_path_is_known() -> None:
    one, _ = gate(u=0.0, several=True)
    walk(one, SHOWN, True)
    one.begins(1)
    assert one.heard.now.advised == 0.0
    one.begins(4)
    assert one.heard.now.advised == 1.0


def test_where_moves_are_left_to_chance_the_answers_are_handed_over() -> None:
    one, table = gate()
    walk(one, [(5, None, RIGHT, 4), (4, None, RIGHT, 5), (5, None, RIGHT, 0), *SHOWN], True)
    assert one.heard.now.uncertain == 1.0  # right led from 5 to 4, and to 0
    for state in range(3):
        table[state] = [0.0, -1.0, 0.0]
    one.opens(2, [6])
    walk(one, SHOWN, True)
    assert [max(range(3), key=row.__getitem__) for row in table[:3]] == [RIGHT] * 3
    assert table[0][RIGHT] == -1.0  # nothing is learned again


def test_it_says_why_it_asks() -> None:
    one, _ = gate()
    walk(one, [(0, RIGHT, LEFT, 1), (1, RIGHT, LEFT, 3)], True)
    one.begins(0)
    one.asks(2, [])
    assert "100% of the recent advised episodes reached the goal" in str(one.why)


@pytest.mark.parametrize("learner", ["q", "q-lambda", "sarsa", "afterstate", "dyna-q", "monte-carlo"])
def test_every_learner_ends_with_the_experts_path(learner: str) -> None:
    maze = grid((6, 6), [[0] * 6] * 6, (0, 0), (5, 5))
    settings = LearnerSettings(learner=learner, episodes=60, max_steps=100)
    advice = Advice.of(advice_chances(optimal_values(maze, settings.discount), 0.01))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        result = Session(maze, settings, GateSettings("earned-trust"), TableAdvisor(advice, rng.random), rng).run()
        assert result.solved
        assert result.final_steps == 10


def walked(q: FloatArray, successor: list[list[int]], start: int, goal: int) -> int | None:
    """The moves of the greedy policy from start to goal, None if it does not get there; ties go to the lowest action."""
    state, moves = start, 0
    while state != goal and moves <= len(successor):
        state, moves = successor[state][int(q[state].argmax())], moves + 1
    return moves if state == goal else None


@settings(max_examples=30, deadline=None)
@given(
    st.sets(st.integers(1, 23), max_size=8),
    st.sampled_from([0.05, 0.5, 2.0]),
    st.integers(0, 1000),
    st.sampled_from(["q", "q-lambda", "sarsa", "sarsa-lambda", "dyna-q", "monte-carlo", "afterstate"]),
)
def test_the_greedy_policy_is_never_worse_than_what_was_shown(
    walls: set[int], tau: float, seed: int, learner: str
) -> None:
    """In a drawn maze of certain moves, after each episode, by a walk through its table that knows nothing of the gate."""
    blocked = np.isin(np.arange(25), list(walls)).reshape(5, 5)
    try:
        maze = grid((5, 5), blocked, (0, 0), (4, 4))
    except NoPath:
        reject()
    how = LearnerSettings(learner=learner, episodes=40, max_steps=60)
    advice = Advice.of(advice_chances(optimal_values(maze, how.discount), tau))
    rng = np.random.default_rng(seed)
    session = Session(maze, how, GateSettings("earned-trust"), TableAdvisor(advice, rng.random), rng)
    successor, shown = maze.successor.tolist(), []

    def checked() -> bool:
        assert isinstance(session.gate, Weighing)
        if session.gate.heard.now.won:  # an advised episode has reached the goal
            shown.append(min(session.steps))
            moves = walked(session.update.table(), successor, maze.start, int(np.flatnonzero(maze.goal)[0]))
            assert moves is not None
            assert moves <= shown[-1]
        return False

    session.run(enough=checked)
