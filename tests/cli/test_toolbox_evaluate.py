"""`lab toolbox evaluate`: a policy in drawn scenes, counted and told."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.cli.toolbox import evaluation_summary
from lab.mdp import optimal_values
from lab.production.evaluation import Evaluation, SceneResult
from lab.skills.prepared_scene import prepare
from lab.tasks.task_file import load
from lab.toolbox.policy import GOAL, ON, OUT, Policy
from lab.toolbox.registry import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
PLACE = "place at toaster_buffer"


@pytest.fixture
def place(folder: Path, policy: Callable[..., Policy]) -> Policy:
    """A policy in the toolbox that sets a slice down by a shortest way."""
    mdp = prepare(load("toast"), ("slice",) * 3, 0, PLACE).problems[PLACE].mdp
    q = optimal_values(mdp, 0.99)
    ends = np.where(mdp.goal, GOAL, np.where(mdp.terminal, OUT, ON)).astype(np.uint8)
    grid: dict[str, Any] = {"shape": mdp.shape, "start": mdp.start, "action_labels": mdp.action_labels, "ends": ends}
    made = replace(policy(f"{PLACE} 12345678"), subtask="place", q=q, visits=np.zeros(q.shape, np.int64), **grid)
    Toolbox(folder / "toolbox").save(made)
    return made


def test_it_counts(lab: Lab, place: Policy) -> None:
    found = lab("toolbox", "evaluate", place.name, "--scenes", "2", "--seed", "3", "--json").json
    assert found.items() >= {
        "policy": place.name, "skill": PLACE, "task": "toast", "seed": 3, "scenes": 2, "successes": 2,
        "success_percent": 100.0, "unsolvable": 0, "interrupted": False,
    }.items()  # fmt: skip
    assert [row["seed"] for row in found["rows"]] == [3, 4]
    assert found["ci95"] == pytest.approx([34.24, 100.0], abs=0.01)
    noted = lab("toolbox", "log", place.name, "--json").json["events"][-1]
    assert (noted["what"], noted["successes"], noted["success_percent"]) == ("evaluated", 2, 100.0)
    lab("toolbox", "publish", place.name, "--out", "hub")
    text = Path("hub/README.md").read_text()
    assert "2 drawn scenes of toast from seed 3: 2 succeeded, 100 % (95 % interval 34 to 100)" in text
    assert "      value: 1.0000\n      name: share of 2 scenes that succeed" in text


def test_it_says_what_is_wrong(lab: Lab, place: Policy, toml: str) -> None:
    ran = lab("toolbox", "evaluate", place.name, "--skill", "place at toster_buffer")
    assert ran.code == 2
    assert (
        "unknown skill 'place at toster_buffer' (--skill, task 'toast'): did you mean 'place at toaster_buffer'?"
        in ran.err
    )
    assert lab("toolbox", "evaluate", place.name, "--task", "toas").code == 2
    assert lab("toolbox", "evaluate", place.name, "--scenes", "0").code == 2
    blocked = toml.replace(
        "position_m = [0.68, 0.45]\ncubes = 7\narea = [0.04, 0.04]", "position_m = [0.42, 0.56]\ncubes = 7"
    )
    assert blocked != toml
    Path("blocked.toml").write_text(blocked)
    ran = lab("toolbox", "evaluate", place.name, "--task", "blocked.toml", "--scenes", "2")
    assert (ran.code, ran.err) == (1, f"lab: in none of 2 drawn scenes can '{PLACE}' reach its goal\n")
    assert "not counted: 2 scenes in which nobody could reach the goal\nseed 0: blocked.toml: line" in ran.out
    assert "obstacle 'tower left' stands on" in ran.out


def test_ctrl_c_shows_what_was_done(lab: Lab, place: Policy, monkeypatch: pytest.MonkeyPatch) -> None:
    from lab.production import evaluation

    whole = evaluation.in_scene

    def stop(policy: Policy, task: Any, name: str, seed: int) -> SceneResult:
        if seed == 1:
            raise KeyboardInterrupt
        return whole(policy, task, name, seed)

    monkeypatch.setattr(evaluation, "in_scene", stop)
    ran = lab("toolbox", "evaluate", place.name, "--scenes", "9", "--json")
    assert (ran.code, ran.err) == (130, "lab: stopped by Ctrl-C after 1 scene of 9\n")
    assert (ran.json["successes"], ran.json["interrupted"]) == (1, True)


def test_a_line_for_each_scene_that_failed() -> None:
    scenes = [
        SceneResult(0, None, None, 2.0),
        SceneResult(1, "physics", "it fell", 1.0),
        SceneResult(2, "table", "it goes round", 0.0),
    ]
    document = Evaluation("mine", "grasp at plate", "toast", 0, 3, scenes, 1.5).to_json()
    lines = [str(line) for line in evaluation_summary(document).renderables]  # type: ignore[union-attr]
    assert lines == [
        "'mine' as 'grasp at plate': 1 of 3 drawn scenes of toast from seed 0 succeeded",
        "success 33.3 % (95 % interval 6.1 to 79.2)",
        "a success takes 2.0 s on average",
        "seed 1: it fell",
        "seed 2: it goes round",
    ]
