"""AdviceBench's problems by name: each can be taught, with the learner that the bench gives it."""

import tomllib
from pathlib import Path

import pytest

import lab
from lab.errors import BadInput
from lab.teaching.named_problems import PROBLEMS as NAMED
from lab.teaching.named_problems import problem_named
from lab_studies.comparisons.advice_bench.common_learner import COMMON
from lab_studies.comparisons.advice_bench.problems import HELD_OUT, problem, to_teach
from lab_studies.problems import PROBLEMS

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def _added() -> None:
    """The problems, also where the lab was installed before they had an entry point."""
    for name, member in PROBLEMS.items():
        if name not in NAMED:
            NAMED.adopted(name, member, "test")


def test_the_entry_point_names_the_table() -> None:
    entries = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    assert entries["teaching_lab.problems"] == {"lab-studies": "lab_studies.problems:PROBLEMS"}


@pytest.mark.parametrize("name", PROBLEMS)
def test_each_is_the_benchs_problem_with_its_learner(name: str) -> None:
    member = PROBLEMS[name]
    assert member.numbered == (name in HELD_OUT)
    made, learner = problem_named(f"{name}:2" if member.numbered else name)
    benched = problem(name, 2 if member.numbered else 0)
    assert isinstance(made, lab.Problem)
    assert made.mdp.signature == benched.mdp.signature
    assert learner == benched.learner


def test_a_problem_is_taught_by_name() -> None:
    door, wind = lab.teach("door-key", seed=1), lab.teach("windy-grids:3", episodes=5)
    assert door.solved
    assert door.session.final_steps == 11
    assert wind.problem.name == "windy-grids:3"
    assert wind.problem.environment is not None
    best = wind.problem.environment.judge(wind.problem.environment.values(0.99), COMMON)
    assert best.solved
    assert best.final_steps == best.optimal_steps
    rows = lab.compare("hanoi:3", sessions=2, episodes=[20]).rows
    assert {row["measure"] for row in rows} >= {"mean_steps"}
    assert to_teach("hanoi", 3).mdp.signature == problem("hanoi", 3).mdp.signature


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("door-kei", "did you mean 'door-key'"),
        ("hanoi", "wanted the number of an instance"),
        ("hanoi:-1", "wanted the number of an instance"),
        ("door-key:1", "'door-key' has no instances"),
    ],
)
def test_a_name_that_is_none_is_refused_in_one_line(name: str, why: str) -> None:
    with pytest.raises(BadInput, match=why) as refused:
        lab.teach(name)
    assert "\n" not in str(refused.value)
    with pytest.raises(BadInput, match="only a world has one"):
        lab.teach("door-key", sight="limited")
