"""Attention: what is typed and how long it takes, by hand, and a small run of the study."""

from typing import Any

import numpy as np
import pytest

from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest
from lab.mdp import grid, optimal_values, shortest_steps
from lab_studies.comparisons.advice_bench.problems import problem
from lab_studies.comparisons.attention import (
    ACTIONS,
    CONTRARY_PRAISE,
    DEMONSTRATION,
    KEY_S,
    LATE_PRAISE,
    MENTAL_S,
    NOBODY,
    PRAISE,
    SENTENCES,
    SKILLS,
    WAYS,
    WITHIN,
    Setting,
    Typist,
    demonstrated,
    rows_of,
    seconds_of,
    sessions_of,
    way_line,
    way_sentence,
)

CELLS = grid((3, 4), np.zeros((3, 4), bool), (0, 0), (2, 3), action_labels=("left", "right", "backward", "forward"))


def test_seconds_of_a_line() -> None:
    """A letter and Enter; + needs Shift as well; three straight parts are thought of one after the other."""
    assert seconds_of("r") == pytest.approx(MENTAL_S + 2 * KEY_S)
    assert seconds_of("-") == pytest.approx(MENTAL_S + 2 * KEY_S)
    assert seconds_of("+") == pytest.approx(MENTAL_S + 3 * KEY_S)
    assert seconds_of("3rf2r", 3) == pytest.approx(3 * MENTAL_S + 6 * KEY_S)


def test_a_way_and_its_demonstration() -> None:
    moves = [1, 1, 3, 1]
    assert way_line(CELLS, moves) == ("2rfr", 3)
    assert way_sentence(CELLS, moves) == ("2 right, then 1 forward, then 1 right", 3)
    assert demonstrated(CELLS, "insert at toaster", moves) == [
        "lead insert at toaster",
        "jog +x 100",
        "jog +y 50",
        "jog +x 50",
        "lead end",
    ]


@pytest.mark.parametrize("name", SKILLS)
def test_sessions_that_are_helped_come_to_the_result(name: str) -> None:
    mdp = problem(name).mdp
    told = {
        kind: sessions_of(Setting(name, kind), 2, 0)
        for kind in (NOBODY, ACTIONS, WAYS, SENTENCES, PRAISE, DEMONSTRATION)
    }
    for kind in (ACTIONS, WAYS, SENTENCES, PRAISE, DEMONSTRATION):
        assert all(one.reached and one.final <= (1 + WITHIN) * shortest_steps(mdp) for one in told[kind])
    assert [one.helped for one in told[ACTIONS]] == [
        one.helped for one in told[WAYS]
    ]  # the same moves, typed otherwise
    seconds = {kind: sum(one.seconds for one in records) for kind, records in told.items()}
    assert seconds[NOBODY] == 0.0
    assert seconds[DEMONSTRATION] < seconds[WAYS] < seconds[ACTIONS] < seconds[PRAISE]
    letter = MENTAL_S + 2 * KEY_S
    assert [one.seconds for one in told[ACTIONS]] == pytest.approx([letter * one.helped for one in told[ACTIONS]])


def test_a_contrary_person_is_rejected_and_the_rows_say_so() -> None:
    told = {Setting("insert", kind): sessions_of(Setting("insert", kind), 2, 0) for kind in (NOBODY, CONTRARY_PRAISE)}
    setting = Setting("insert", CONTRARY_PRAISE)
    rows = rows_of(setting, told[setting], told)
    found = {one["measure"]: one["value"] for one in rows}
    assert found["rejected_percent"] == 100.0
    assert {"seconds", "helped_steps", "final_moves_over_nobody", "late_steps_over_nobody"} <= found.keys()
    assert not [
        one
        for one in rows_of(Setting("insert", NOBODY), told[Setting("insert", NOBODY)], told)
        if "over" in one["measure"]
    ]


def test_late_praise_is_of_one_of_the_last_moves() -> None:
    """Drawn: 0, 1 and 2 moves late, so that all three judgements are of the first move, which was good."""
    values, drawn = optimal_values(CELLS, 0.99), iter([0.0, 0.4, 0.9])
    person = Typist(LATE_PRAISE, CELLS, values, lambda: next(drawn))
    start: dict[str, Any] = {"mdp": CELLS, "q": [[0.0] * 4] * 12, "allowed": range(4), "episode": 1, "state": 0}
    said = [person.advise(AdviceRequest(**start, step=step, own=own)) for step, own in ((1, 1), (2, 0), (3, 0))]
    assert said == [Judgement(1)] * 3
    assert person.seconds == pytest.approx(3 * (MENTAL_S + 3 * KEY_S))
