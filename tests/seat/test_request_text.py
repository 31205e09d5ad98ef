"""What a learner shows in words: its preference, its progress, how advice stands, where things lie."""

from dataclasses import replace

import numpy as np
import pytest

from lab.learning.environment import TableEnvironment
from lab.learning.requests import AdviceRequest, Standing, TooSlow, ValuesAlike
from lab.learning.session_events import EpisodeEnded, Improvement, Verdict
from lab.mdp import TabularMDP, coverage, grid
from lab.seat import request_text as facts
from lab.seat.grid_text import Marks, picture_of

MARKS = Marks()
WHY = TooSlow(0.012, 0.05)


def board() -> TabularMDP:
    """R . . .
    . # . .
    . . . G"""
    blocked = np.zeros((3, 4), bool)
    blocked[1, 1] = True
    return grid((3, 4), blocked, (0, 0), (2, 3), action_labels=("up", "down", "left", "right"))


def request(
    mdp: TabularMDP | None = None, action: int = 3, state: int | None = None, q: tuple[float, ...] | None = None
) -> AdviceRequest:
    mdp = mdp or board()
    table = [list(q or (0.0,) * mdp.n_actions)] * mdp.n_states
    state = mdp.start if state is None else state
    now = Standing(12, 150, 3, 7, 0.05)
    return AdviceRequest(
        mdp=mdp,
        q=table,
        state=state,
        episode=31,
        step=2,
        own=action,
        reason=WHY,
        temperature=1.0,
        selection="greedy",
        standing=now,
        improvement=Improvement(0.0125, 39.5, 40.0),
        allowed=range(mdp.n_actions),
    )


@pytest.mark.parametrize(
    ("share", "text"), [(0.0, "0%"), (0.001, "<1%"), (0.126, "13%"), (0.996, ">99%"), (0.994, "99%"), (1.0, "100%")]
)
def test_percents(share: float, text: str) -> None:
    assert facts.percent(share) == text


def test_the_own_choice_and_what_is_preferred() -> None:
    assert facts.choice(request(), MARKS) == (
        "Alone the learner would now go → right, drawn at random: all moves are alike to it here (25% each)."
    )
    assert facts.choice(request(q=(0, 0, 0, 1)), MARKS) == (
        "Alone the learner would now go → right, the move it rates best (100%)."
    )
    assert facts.choice(request(q=(0, 1, 0, 0)), MARKS) == (
        "Alone the learner would now go → right, drawn at random (0%); the move it rates best is ↓ down (100%)."
    )


def test_where_the_own_choice_leads() -> None:
    assert "go ↓ down, the move it rates best (100%); that leads into an obstacle." in facts.choice(
        request(None, 1, 1, (0, 1, 0, 0)), MARKS
    )
    assert "go → right, the move it rates best (100%); that leads to the goal." in facts.choice(
        request(None, 3, 10, (0, 0, 0, 1)), MARKS
    )
    assert "go ↑ up, the move it rates best (100%); that leads nowhere." in facts.choice(
        request(None, 0, 0, (1, 0, 0, 0)), MARKS
    )
    assert facts.choice(request(None, 1, 1), MARKS, brief=True) == "↓ down leads into an obstacle."
    assert facts.choice(request(None, 0), MARKS, brief=True) == "↑ up leads nowhere."
    assert facts.choice(request(), MARKS, brief=True) == ""


def test_each_move_with_its_chance() -> None:
    asked = request(q=(0, 1, 0, 1))
    assert [move.plain for move in facts.moves(asked, MARKS)] == ["↑ up 0%", "↓ down 50%", "← left 0%", "[→ right 50%]"]
    assert [line.plain for line in facts.bars(asked, MARKS)] == [
        "  ↑ up                  0%",
        "  ↓ down   █████       50%",
        "  ← left                0%",
        "▸ → right  █████       50%",
    ]
    epsilon = replace(asked, selection="epsilon-greedy", temperature=0.04)
    assert facts.bars(epsilon, MARKS)[0].plain == "  ↑ up     ▏            1%"  # what is above nothing can be seen


def test_the_averages_and_the_threshold() -> None:
    assert facts.progress(request()) == [
        "It asks because its improvement is +1.2%, below 5%: lately 39.5 steps per episode, before that 40.0."
    ]
    assert facts.progress(request(), brief=True) == ["Steps 40.0, now 39.5: +1.2% < 5%"]
    other = replace(request(), reason=ValuesAlike(0.2, 1.0))
    assert facts.progress(other) == [
        "It asks because the values here span 0.20, at most 1.",
        "Steps per episode: lately 39.5, before that 40.0; improvement +1.2%, threshold 5%.",
    ]
    assert facts.progress(replace(other, reason=None))[0].startswith("Steps per episode")
    early = replace(request(), improvement=None, reason=None)
    assert facts.progress(early) == ["Too few episodes so far for moving averages."]
    assert facts.progress(early, brief=True) == ["Too few episodes for averages."]


def test_how_advice_stands() -> None:
    assert facts.standing(request()) == "Advised so far: 12 of 150 moves; episodes misled: 3, tolerated: 7."
    assert facts.standing(request(), brief=True) == "Advised 12 of 150 moves; misled 3 of 7."
    endless = replace(request(), standing=Standing(1, omega=7))
    assert facts.standing(endless) == "Advised so far: 1 move; episodes misled: 0, tolerated: 7."


def beyond(asked: AdviceRequest, width: int = 80, height: int = 24) -> str:
    picture = picture_of(asked, MARKS, width, height)
    assert picture is not None
    return facts.beyond(asked, picture)


def test_what_is_beyond_the_picture() -> None:
    assert beyond(request()) == ""
    assert beyond(request(), 5, 2) == "Shown: rows 0..1 of 0..2, columns 0..1 of 0..3; the goal is 2 down and 3 right."
    assert beyond(request(None, 3, 10), 5, 2) == "Shown: rows 1..2 of 0..2, columns 1..2 of 0..3; the goal is 1 right."


def test_other_levels_and_axes_are_named() -> None:
    labels = ("left", "right", "backward", "forward", "down", "up", "turn left", "turn right")
    shape = (3, 3, 4, 3)
    mdp = grid(shape, np.zeros(shape, bool), (0, 2, 2, 1), (2, 0, 0, 1), action_labels=labels)
    assert beyond(request(mdp)) == ("Turn left / turn right: 1 of 0..2; the goal is 2 right, 2 backward and 2 down.")
    assert beyond(request(mdp), 20) == (
        "Shown: level 2 of 0..3; turn left / turn right: 1 of 0..2; the goal is 2 right, 2 backward and 2 down."
    )
    turned = int(np.ravel_multi_index((2, 0, 0, 0), shape))
    assert facts.way_to_goal(request(mdp, 0, turned)) == "1 turn right"


def test_sentences_say_all_without_a_picture() -> None:
    state = int(np.ravel_multi_index((2, 2), (3, 4)))
    assert facts.sentences(request(None, 3, state, (0, 1, 0, 0))) == [
        "Episode 31, step 2.",
        "The robot is at row 2, column 2.",
        "The goal lies 1 right.",
        "up: free.",
        "down: border.",
        "left: free.",
        "right: goal.",
        "Alone the learner would now go right, drawn at random (0%); that leads to the goal; the move it rates best is down "
        "(100%).",
        "Its chances: up 0%, down 100%, left 0%, right 0%.",
        "It asks because its improvement is +1.2%, below 5%: lately 39.5 steps per episode, before that 40.0.",
        "Advised so far: 12 of 150 moves; episodes misled: 3, tolerated: 7.",
    ]
    assert "down: obstacle." in facts.sentences(request(None, 3, 1))


def test_sentences_of_a_map_a_board_and_states_without_a_grid() -> None:
    labels = ("left", "right", "backward", "forward", "down", "up")
    cube = grid((2, 2, 2), np.zeros((2, 2, 2), bool), (0, 0, 1), (1, 1, 1), action_labels=labels)
    assert facts.sentences(request(cube))[1:3] == [
        "The robot is at x 0, y 0, level 1.",
        "The goal lies 1 right and 1 forward.",
    ]
    butter = coverage((2, 3))
    second = int(butter.successor[butter.start, 3])
    assert facts.sentences(request(butter, 3, second))[1:7] == [
        "The robot is at row 0, column 1.",
        "Covered: 2 of 6 cells.",
        "up: border.",
        "down: free, not covered.",
        "left: free, covered.",
        "right: free, not covered.",
    ]
    assert facts.sentences(request(falling(), 2))[1:6] == [
        "The learner is in state 0.",
        "wait: leads nowhere.",
        "go: leads to 1.",
        "fall: an end that is no goal.",
        "Alone the learner would now go fall, drawn at random: all moves are alike to it here (33% each); that leads to an "
        "end that is no goal.",
    ]


def falling() -> TabularMDP:
    """States without a grid: 1 is on the way, 2 an end, 3 the goal."""
    over, goal = np.array([False, False, True, True]), np.array([False, False, False, True])
    after = np.array([[0, 1, 2], [1, 3, 2], [2, 2, 2], [3, 3, 3]])
    return TabularMDP(after, np.zeros((4, 3)), over, goal, 0, ("wait", "go", "fall"))


class Elsewhere:
    """A place that is not its table."""

    def picture(self, state: int) -> str:
        return ""


def test_a_place_left_to_chance_is_not_promised() -> None:
    asked = replace(request(falling(), 2), environment=Elsewhere())
    assert facts.leads(asked, 0) == "most likely leads nowhere"
    assert facts.sentences(asked)[2:5] == [
        "wait: most likely leads nowhere.",
        "go: most likely leads to 1.",
        "fall: an end that is no goal.",
    ]
    assert (
        facts.leads(replace(request(None, 1, 1), environment=Elsewhere()), 1)
        == "most likely leads to an end that is no goal"
    )
    assert (
        facts.leads(replace(request(None, 1, 1), environment=TableEnvironment(board())), 1) == "leads into an obstacle"
    )


def test_of_a_table_that_knows_nothing_nothing_is_said() -> None:
    no = np.zeros(2, bool)
    mdp = TabularMDP(np.array([[0, 0], [1, 1]]), np.zeros((2, 2)), no, no, 0, ("wait", "go"))
    asked = replace(request(mdp, 1), environment=Elsewhere())
    assert facts.choice(asked, MARKS) == (
        "Alone the learner would now go go, drawn at random: all moves are alike to it here (50% each)."
    )
    assert facts.sentences(asked)[2:4] == ["wait: nobody knows where it leads.", "go: nobody knows where it leads."]


def test_why_it_asks_with_all_its_numbers() -> None:
    asked = replace(request(q=(0.5, -1.0, 0.0, 0.25)), selection="softmax", temperature=0.1)
    assert facts.reasons(asked, MARKS, 4) == [
        "It asks because its improvement is +1.2%, below 5%.",
        "Its last episodes took 39.5 steps on average, those before them 40.0: an improvement of +1.2%; a good one is 5% "
        "or more.",
        "What it thinks each move is worth here: ↑ up +0.50, ↓ down -1.00, ← left +0.00, → right +0.25; they span 1.50.",
        "Left to itself it would most likely go ↑ up (92%): chosen by softmax, temperature 0.1.",
        "Advice so far: 12 moves of 150 that it may use. It did not help in 3 of 4 episodes; the learner tolerates 7, and "
        "then asks no more, or when what it may use is spent.",
    ]
    bare = replace(asked, reason=None, improvement=None, selection="greedy", standing=Standing(1, omega=7))
    lines = facts.reasons(replace(bare, q=[[0.0] * 4] * 12), MARKS, 0)
    assert lines[0] == "It asks about every step."
    assert lines[1] == "There are too few episodes so far for moving averages."
    assert lines[3:] == [
        "Left to itself it may go anywhere, 25% each: chosen by greedy.",
        "Advice so far: 1 move. It tolerates 7 episodes with advice that are no shorter than those before.",
    ]


@pytest.mark.parametrize(
    ("steps", "verdict", "mean", "expected"),
    [
        (12, "", 16.0, (True, "better than the 16.0 before")),  # no gate judges it
        (16, "", 16.0, (False, "no better than the 16.0 before")),
        (16, "", None, (None, "")),
        (12, "better", 16.0, (True, "better than the 16.0 before")),
        (16, "best", 16.0, (True, "as good as the best so far")),
        (17, "misled", 16.0, (False, "no better than the 16.0 before")),
        (19, "better", 16.0, (True, "better than before")),  # it began farther away than those before
        (12, "misled", 16.0, (False, "no better than before")),  # it began nearer
        (16, "misled", None, (False, "no better than before")),
    ],
)
def test_whether_an_episode_with_advice_was_good(
    steps: int, verdict: Verdict, mean: float | None, expected: tuple[bool | None, str]
) -> None:
    assert facts.verdict(EpisodeEnded(31, steps, True, 4, None, True, verdict), mean) == expected


def test_misled_episodes_of_how_many() -> None:
    assert facts.misled(3, 4) == "Your advice did not help in 3 of 4 episodes"
    assert facts.misled(3, 0) == "Your advice did not help in 3 episodes"  # a session that goes on: not all were seen


def test_where_evidence_decides_no_number_is_tolerated() -> None:
    by_evidence = replace(request(), standing=Standing(12, 150, 3, 7, 0.05, by_evidence=True))
    for told in (facts.standing(by_evidence), facts.standing(by_evidence, brief=True)):
        assert "3" in told
        assert "7" not in told
    assert "7" in facts.standing(request())
