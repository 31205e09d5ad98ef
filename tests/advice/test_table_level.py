"""Answers kept as a file: an advisor as any other, by the names of states and actions or their numbers."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.advice.advisors import AdvisorName
from lab.advice.table_level import TableLevel, answers_of
from lab.errors import BadInput
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid

MDP = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2), action_labels=("up", "down", "left", "right"))


def kept(folder: Path, said: object) -> Path:
    path = folder / "answers.json"
    path.write_text(said if isinstance(said, str) else json.dumps(said))
    return path


def test_names_and_numbers_say_the_same(tmp_path: Path) -> None:
    assert answers_of(kept(tmp_path, {"(0, 0)": "right", "(0, 1)": "down"}), MDP) == {0: 3, 1: 1}
    assert answers_of(kept(tmp_path, {"0": 3, "1": "1"}), MDP) == {0: 3, 1: 1}


def test_they_advise_a_session_and_are_silent_elsewhere(tmp_path: Path) -> None:
    way = {"(0, 0)": "right", "(0, 1)": "right", "(0, 2)": "down"}
    name = AdvisorName.of(f"answers:{kept(tmp_path, way)}")
    advisor = TableLevel(MDP, 0.99, np.random.default_rng(0)).advisor(name)
    learner = LearnerSettings("q", episodes=1, max_steps=9)
    one = Session(MDP, learner, GateSettings("always"), advisor, np.random.default_rng(0)).run()
    assert (one.steps.tolist(), one.helped_steps) == ([3], 3)


@pytest.mark.parametrize(
    ("said", "wrong"),
    [
        ("{", "is no JSON"),
        ([1], "wanted an object"),
        ({}, "wanted an object"),
        ({"(9, 9)": "up"}, r"unknown state '\(9, 9\)'"),
        ({"6": "up"}, "unknown state '6'"),
        ({"(0, 0)": "rigth"}, "unknown action 'rigth'.*right"),
        ({"0": 4}, "unknown action '4'"),
        ({"0": None}, "unknown action 'None'"),
        ({"0": [1]}, "unknown action 'a list'"),
        ({"9" * 5000: "up"}, "unknown state '999"),
    ],
)
def test_what_is_no_answer_is_refused_in_a_line(tmp_path: Path, said: object, wrong: str) -> None:
    name = AdvisorName.of(f"answers:{kept(tmp_path, said)}")
    with pytest.raises(BadInput, match=wrong) as refused:
        TableLevel(MDP, 0.99, np.random.default_rng(0)).advisor(name)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot be read: No such file"):
        answers_of(tmp_path / "none.json", MDP)
    with pytest.raises(BadInput, match="names no file: wanted answers:FILE"):
        AdvisorName.of("answers:")


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.text(), lambda e: st.dictionaries(st.text(), e)))
def test_any_json_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, said: object) -> None:
    path = kept(tmp_path_factory.getbasetemp(), json.dumps(said))
    try:
        found = answers_of(path, MDP)
    except BadInput:
        return
    assert all(0 <= state < 6 and 0 <= action < 4 for state, action in found.items())
