"""Answers kept as a file: an advisor as any other, by the names of states and actions or their numbers."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lab
from lab.advice.advising import Advising
from lab.advice.advisors import PYTHON, AdvisorName, RecordedAdvisor, make_advisor
from lab.advice.order_level import OrderLevel
from lab.advice.table_level import LimitedView, PolicyAdvisor, TableLevel, advice_of, answers_of
from lab.errors import BadInput
from lab.learning.environment import TableEnvironment
from lab.learning.requests import AdviceRequest
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.tasks.task_file import load_cell
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

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


# ---- policy advisor ---------------------------------------------------------------------------------------------------


SMALL, WIDE = "S.\n.G", "S..\n...\n..G"


def board(rows: int, columns: int) -> TabularMDP:
    return grid((rows, columns), np.zeros((rows, columns), bool), (0, 0), (rows - 1, columns - 1))


def learned(rows: str = SMALL, name: str = "first") -> Policy:
    return replace(lab.teach(lab.world(rows, name), episodes=40, seed=1).policy, name=name)


def asked(mdp: TabularMDP, state: int) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(mdp=mdp, q=q, state=state, episode=1, step=1, own=0, allowed=range(mdp.n_actions))


def test_at_home_it_does_what_it_learned_and_is_silent_where_it_has_never_been() -> None:
    world = lab.world("S..\n...\n..G").mdp()
    q, visits = np.zeros((9, 4)), np.zeros((9, 4), np.int64)
    q[:, 1], visits[[0, 3]] = 1.0, 1
    policy = replace(learned(WIDE), q=q, visits=visits)
    advisor = PolicyAdvisor(policy, world)
    assert [advisor.advise(asked(world, state)) for state in range(9)] == [1, None, None, 1, *[None] * 5]
    assert (advisor.known, advisor.of, advisor.here) == (2, 8, True)
    assert str(advisor) == "'first' knows 2 of 8 states: it learned in this problem"


def test_in_another_world_cells_are_the_same_where_their_indices_are() -> None:
    """The four cells of 2 x 2, of which three go on, in the corner of 3 x 3: states 0, 1, 3 (and 4, where it was at the goal)."""
    policy, wide = learned(), lab.world(WIDE).mdp()
    assert (advice_of(policy, wide) >= 0).nonzero()[0].tolist() == [0, 1, 3]
    assert advice_of(policy, wide)[[0, 1, 3]].tolist() == policy.q.argmax(axis=1)[:3].tolist()
    assert "it learned in another problem" in str(PolicyAdvisor(policy, wide))


def test_actions_are_matched_by_their_labels() -> None:
    policy = learned()
    wide = lab.world(WIDE).mdp()
    turned = replace(wide, action_labels=wide.action_labels[::-1])
    assert (advice_of(policy, wide) + advice_of(policy, turned))[[0, 1, 3]].tolist() == [3, 3, 3]


@pytest.mark.parametrize(
    ("mdp", "why"),
    [
        (grid((2, 2, 2), np.zeros((2, 2, 2), bool), (0, 0, 0), (1, 1, 1)), "a grid with 2 axes, this one has 3"),
        (replace(board(3, 3), shape=()), "only the cells of grids can be matched"),
        (replace(board(3, 3), action_labels=("a", "b", "c", "d")), "none of this problem's actions"),
    ],
)
def test_where_nothing_matches_it_is_refused(mdp: TabularMDP, why: str) -> None:
    with pytest.raises(BadInput, match=why):
        advice_of(learned(), mdp)


def test_where_it_has_never_been_it_is_refused() -> None:
    policy = learned()
    with pytest.raises(BadInput, match="none of this problem's states"):
        advice_of(replace(policy, visits=np.zeros_like(policy.visits)), lab.world(WIDE).mdp())


def test_it_is_named_by_its_name_or_its_file(tmp_path: Path) -> None:
    box = Toolbox(tmp_path)
    file, mdp = box.save(learned()), lab.world(SMALL).mdp()
    level = TableLevel(mdp, 0.99, np.random.default_rng(0), toolbox=box)
    for name in ("first", str(file)):
        advisor = level.advisor(AdvisorName.of(f"policy:{name}"))
        assert isinstance(advisor, PolicyAdvisor)
        assert advisor.known == 3
    seen = replace(level, region=np.arange(4) == 0).advisor(AdvisorName.of("policy:first"))
    assert isinstance(seen, LimitedView)
    assert [seen.advise(asked(mdp, state)) is None for state in (0, 1)] == [False, True]
    with pytest.raises(BadInput, match=r"advisor 'policy:frst': unknown policy 'frst' .* did you mean 'first'\?"):
        level.advisor(AdvisorName.of("policy:frst"))
    with pytest.raises(BadInput, match="it names no policy: wanted policy:NAME"):
        AdvisorName.of("policy:")


def test_it_does_not_advise_on_the_order() -> None:
    level = OrderLevel(load_cell("toast-case-1").cell(3), np.random.default_rng(0))
    with pytest.raises(BadInput, match="advisor 'policy:first': a policy knows the steps of a sub-task, not the order"):
        make_advisor(AdvisorName.of("policy:first"), level)


def test_it_is_heard_in_a_panel(tmp_path: Path) -> None:
    Toolbox(tmp_path).save(learned())
    mdp = lab.world(WIDE).mdp()
    advising = replace(Advising.of(["policy:first", "expert"]), toolbox=Toolbox(tmp_path))
    panel = advising.gather(TableEnvironment(mdp), LearnerSettings(), np.random.default_rng(0))
    assert panel is not None
    assert panel.advise(asked(mdp, 0)) in range(4)
    assert advising.records
    assert [one.known for one in advising.check_records(mdp)] == [3]


def test_in_python_it_teaches_from_the_toolbox_that_is_given(tmp_path: Path) -> None:
    Toolbox(tmp_path).save(learned(WIDE))
    taught = lab.teach(lab.world(WIDE, "second"), advisor="policy:first", gate="always", episodes=20, toolbox=tmp_path)
    assert (taught.solved, taught.session.helped_steps > 0) == (True, True)
    with pytest.raises(BadInput, match="unknown policy 'none'"):
        lab.teach(lab.world(WIDE), advisor="policy:none", toolbox=tmp_path)


def test_a_record_made_in_python_is_one_whose_silence_is_not_held_against_it() -> None:
    assert Advising((AdvisorName("led by operator", PYTHON, itself=RecordedAdvisor({0: 1})),)).records
    assert not Advising.of(["expert"]).records
