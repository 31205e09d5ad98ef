"""`lab.teach`: the same as the command, with names, functions and classes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab.learning.requests import AdviceRequest
from lab.learning.settings import GateSettings, LearnerSettings

ROWS = """
    S..
    .#.
    ..G
"""


def right_then_down(request: AdviceRequest) -> int:
    _, column = request.mdp.state_cell(request.state)
    return request.mdp.action_labels.index("right" if column < 2 else "down")


def test_it_learns_what_the_command_learns(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    command_line = request.getfixturevalue("lab")
    told = command_line("teach", "world-1", "--advisor", "limited", "--seed", "3", "--toolbox", str(tmp_path), "--json")
    command = json.loads(told.out)
    lesson = lab.teach("world-1", advisor="limited", seed=3)
    assert {name: command[name] for name in lesson.document} == lesson.document
    assert lesson.session.steps.tolist() == command["steps_per_episode"]


def test_peers_learn_what_the_command_lets_them_learn(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    words = ("teach", "world-1", "--peers", "2", "--episodes", "12", "--toolbox", str(tmp_path), "--json")
    command = json.loads(request.getfixturevalue("lab")(*words).out)
    lesson = lab.teach("world-1", peers=2, episodes=12)
    assert lesson.document == {name: command[name] for name in lesson.document}
    assert [len(peer.session.steps) for peer in lesson.peers] == [12, 12]
    with pytest.raises(lab.BadInput, match="record beside peers"):
        lab.teach("world-1", peers=2, record=True)
    with pytest.raises(lab.BadInput, match="peers"):
        lab.teach("world-1", peers=1)
    with pytest.raises(lab.BadInput, match=r"peer_tasks 'toast-panda'.*: wanted a list"):
        lab.teach("insert", peer_tasks="toast-panda")


def test_two_arms_learn_a_sub_task_as_peers(tmp_path: Path) -> None:
    lesson = lab.teach("insert", peer_tasks=["toast-panda"], episodes=40, seed=1, toolbox=tmp_path)
    assert [peer.arm for peer in lesson.peers] == ["up6", "panda"]
    assert [len(peer.session.steps) for peer in lesson.peers] == [40, 40]
    assert lesson.policy.arm == "up6"
    assert {row["arm"] for row in lab.Toolbox(tmp_path).list()} == {"up6", "panda"}


def test_an_advisor_is_a_function() -> None:
    lesson = lab.teach(lab.world(ROWS), advisor=right_then_down, gate="always", episodes=5, seed=0)
    assert lesson.session.steps.tolist() == [4] * 5  # right, right, down, down
    assert lesson.document["advisor"] == "right_then_down"
    assert lesson.session.helped_steps == 20


def test_several_advisors_make_a_panel() -> None:
    lesson = lab.teach(lab.world(ROWS), advisor=[right_then_down, "wrong"], gate="always", episodes=30)
    assert lesson.document["advisor"] == "right_then_down + wrong (together, trust-weighted)"


def test_an_object_that_advises_hears_what_came_of_it() -> None:
    class Counting:
        walked = 0

        def advise(self, request: AdviceRequest) -> int:
            return right_then_down(request)

        def followed(self, walked: object) -> None:
            self.walked += 1

    advisor = Counting()
    lab.teach(lab.world(ROWS), advisor=advisor, gate="always", episodes=3)
    assert advisor.walked == 3


def test_a_gate_is_a_class() -> None:
    class Third(lab.Gate):
        """Asks in every third episode."""

        def opens(self, episode: int, steps: lab.Steps) -> bool:
            return episode % 3 == 0

    lesson = lab.teach(lab.world(ROWS), gate=Third, episodes=6, advisor=right_then_down)
    assert lesson.session.guided.tolist() == [False, False, True] * 2


def test_a_problem_may_be_a_table() -> None:
    corridor = lab.grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))
    lesson = lab.teach(corridor, advisor=None, episodes=60, seed=1)
    assert lesson.solved
    assert [int(corridor.successor[state, lesson.act(state)]) for state in range(3)] == [1, 2, 3]
    named = lab.teach(lab.Problem("corridor", "walk", corridor), advisor=None, episodes=60, seed=1)
    assert named.policy.name.startswith("corridor")


def test_nothing_is_kept_unless_a_toolbox_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "own"))
    lesson = lab.teach(lab.world(ROWS), advisor=None, episodes=100)
    assert not (tmp_path / "own").exists()
    path = lesson.keep(tmp_path / "box")
    assert lab.Toolbox(tmp_path / "box").load(path).signature == lesson.policy.signature


def test_it_shows_itself(tmp_path: Path) -> None:
    lesson = lab.teach(lab.world(ROWS), advisor=right_then_down, gate="always", episodes=5)
    assert lesson.rows()[0] == {"episode": 1, "steps": 4, "guided": True}
    assert lesson.to_dataframe().shape == (5, 3)
    assert "<svg" in lesson._repr_html_()
    assert lesson.curve.save(tmp_path / "curve.svg").read_bytes() == lesson.curve.data
    assert lesson.map.form == "png"
    with pytest.raises(lab.BadInput, match=r"'curve.png': its name must end in .svg"):
        lesson.curve.save("curve.png")


@pytest.mark.parametrize(
    ("problem", "said", "fault"),
    [
        ("world-1", {"psy": 1.0}, "unknown setting 'psy' .*did you mean 'psi'"),
        ("world-1", {"alpha": 2.0}, "LearnerSettings.alpha = 2.0: allowed above 0 and at most 1"),
        ("world-1", {"gate": "cccrl"}, "unknown gate 'cccrl'"),
        ("world-1", {"advisor": "exprt"}, "did you mean 'expert'"),
        ("world-1", {"advisor": 3}, "advisor 3: wanted a name, a function of a request"),
        ("world-1", {"advisor": "terminal"}, "no prompt to ask a person"),
        ("world-9", {}, "unknown"),
        (lab.grid((1, 2), np.zeros((1, 2), bool), (0, 0), (0, 1)), {"task": "toast"}, "task 'toast' beside TabularMDP"),
        (3.5, {}, "wanted a name, a GridWorld, a TabularMDP or a Problem"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(problem: Any, said: dict[str, Any], fault: str) -> None:
    with pytest.raises(lab.BadInput, match=fault):
        lab.teach(problem, **said)


def test_a_world_of_rows_says_what_is_wrong_with_them() -> None:
    with pytest.raises(lab.BadInput, match=r"world 'maze': line 1, column 2: 'x': allowed are . # S G"):
        lab.world("Sx.\n..G", "maze")


def test_the_settings_are_those_of_learner_and_gate() -> None:
    from lab.api.options import Settings

    assert [*Settings.__annotations__] == [*vars(LearnerSettings()), *vars(GateSettings())]


def test_a_kept_lesson_is_the_command_s(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    command_line = request.getfixturevalue("lab")
    words = ("world-1", "--advisor", "limited", "--gate", "always", "--episodes", "20", "--seed", "3")
    command_line("teach", *words, "--toolbox", str(tmp_path / "box"), "--out", str(tmp_path / "a"))
    lesson = lab.teach("world-1", advisor="limited", gate="always", episodes=20, seed=3, out=tmp_path / "b")
    assert (tmp_path / "b/events.jsonl").read_bytes() == (tmp_path / "a/events.jsonl").read_bytes()
    assert lesson.receipt == lesson.document["receipt"]["lines"]
    assert command_line("replay", str(tmp_path / "b"), "--json").json["receipt"] == lesson.document["receipt"]
    with pytest.raises(lab.BadInput, match="holds a session that is over"):
        lab.teach("world-1", advisor="limited", out=tmp_path / "b")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"advisor": right_then_down}, "out beside advisor"),
        ({"alpha": 0.5}, "out beside alpha .*: a stored session holds the settings learner, gate, memory, episodes"),
        ({"peers": 2, "advisor": None}, "out beside peers"),
    ],
)
def test_what_a_journal_cannot_hold_is_refused(tmp_path: Path, given: dict[str, Any], said: str) -> None:
    with pytest.raises(lab.BadInput, match=said):
        lab.teach("world-1", out=tmp_path, **given)
    with pytest.raises(lab.BadInput, match="out beside problem"):
        lab.teach(lab.world(ROWS), out=tmp_path)
