"""What sentences lead to at a question, on a board of one row: R . . G."""

import numpy as np
import pytest

from lab.learning.praise import Judgeable, Judgement
from lab.learning.requests import AdviceRequest
from lab.mdp import grid
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.spoken_turns import ASKS, SpokenTurns
from lab.words.meaning import Intent, Refusal

BOARD = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3), action_labels=("up", "down", "left", "right"))
RIGHT = 3


def turns(told: list[str]) -> SpokenTurns:
    return SpokenTurns(SpokenAnswers(), lambda text, tone: told.append(text), lambda word, about: None)


def request(judgement: Judgeable) -> AdviceRequest:
    q = [[0.0] * 4] * 4
    return AdviceRequest(mdp=BOARD, q=q, state=0, episode=1, step=1, own=0, allowed=range(4), judgement=judgement)


def heard(text: str) -> list[Intent]:
    found = SpokenAnswers().heard(text, request("no"))
    assert not isinstance(found, Refusal)
    return found


def test_praise_is_a_judgement_and_what_follows_is_done_at_the_next_question() -> None:
    told: list[str] = []
    spoken = turns(told)
    assert spoken.carry_out(heard("that was bad, now two right"), request("also")) == Judgement(-1)
    assert spoken.before_asking(request("also")) == (RIGHT, RIGHT)
    assert told == []


def test_praise_where_nothing_was_done_yet_is_noted() -> None:
    told: list[str] = []
    assert turns(told).carry_out(heard("that was good"), request("no")) == ASKS
    assert len(told) == 1


@pytest.mark.parametrize("text", ["two right", "do what you think is best", "like last time"])
def test_a_question_about_a_move_takes_no_move(text: str) -> None:
    told: list[str] = []
    assert turns(told).carry_out(heard(text), request("only")) == ASKS
    assert len(told) == 1
    assert turns(told).carry_out(heard("well done"), request("only")) == Judgement(1)
