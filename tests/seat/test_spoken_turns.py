"""What sentences lead to at a question, on a board of one row: R . . G."""

import numpy as np

from lab.learning.requests import AdviceRequest, Request
from lab.mdp import grid
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.spoken_turns import ASKS, SpokenTurns
from lab.words.meaning import Refusal

BOARD = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3), action_labels=("up", "down", "left", "right"))
RIGHT = 3


def test_praise_is_handed_on_with_its_question_and_what_follows_is_done() -> None:
    request = AdviceRequest(mdp=BOARD, q=[[0.0] * 4] * 4, state=0, episode=1, step=1, own=0, allowed=range(4))
    handed: list[tuple[int, Request]] = []
    told: list[str] = []

    def praised(sign: int, about: Request) -> str:
        handed.append((sign, about))
        return "thanks"

    spoken = SpokenAnswers()
    turns = SpokenTurns(spoken, lambda text, tone: told.append(text), lambda word, about: None, praised)
    assert turns.before_asking(request) == ASKS
    heard = spoken.heard("that was bad, now two right", request)
    assert not isinstance(heard, Refusal)
    assert turns.carry_out(heard, request) == (RIGHT, RIGHT)
    assert handed == [(-1, request)]
    assert told == ["thanks"]
