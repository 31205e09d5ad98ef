"""Problems with names that other packages and files add."""

from typing import Any

import pytest

import lab
from lab.errors import BadInput
from lab.learning.environment import TableEnvironment
from lab.teaching.named_problems import PROBLEMS, NamedProblem, is_named, problem_named

CORRIDOR = lab.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2))


class Corridor(TableEnvironment):
    """A corridor."""

    def __init__(self) -> None:
        super().__init__(CORRIDOR)


def corridor() -> lab.TabularMDP:
    """A corridor."""
    return CORRIDOR


@pytest.mark.parametrize(
    "thing",
    [CORRIDOR, corridor, Corridor, Corridor(), lab.Problem("any", "push", CORRIDOR), NamedProblem("", corridor)],
)
def test_whatever_gives_a_table_is_a_member(thing: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROBLEMS, "my-corridor", PROBLEMS._adopt("my-corridor", thing))
    made, learner = problem_named("my-corridor")
    assert isinstance(made, lab.Problem)
    assert (made.name, made.mdp.signature, learner) == ("my-corridor", CORRIDOR.signature, None)
    assert lab.teach("my-corridor", episodes=20).session.final_steps == 2


def test_a_world_is_a_member_with_its_own_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    maze = lab.world("S..\n.#.\n..G", name="maze")
    monkeypatch.setitem(PROBLEMS, "my-maze", PROBLEMS._adopt("my-maze", maze))
    lesson = lab.teach("my-maze", episodes=60)
    assert (lesson.problem.name, lesson.session.optimal_steps) == ("maze", 4)


def test_instances_have_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    def made(number: int) -> lab.TabularMDP:
        return lab.grid((1, number + 2), [[0] * (number + 2)], (0, 0), (0, number + 1))

    monkeypatch.setitem(PROBLEMS, "halls", NamedProblem("Halls", made, numbered=True))
    hall, _ = problem_named("halls:7")
    assert isinstance(hall, lab.Problem)
    assert (hall.name, hall.mdp.n_states) == ("halls:7", 9)
    with pytest.raises(BadInput, match=r"wanted the number of an instance, 0 to 999999999: halls:3"):
        problem_named("halls:x")


@pytest.mark.parametrize(
    ("name", "thing", "why"),
    [
        ("world-1", CORRIDOR, "the name 'world-1' is taken"),
        ("insert", CORRIDOR, "the name 'insert' is taken"),
        ("a:1", CORRIDOR, "has no colon"),
        ("three", 3, "wanted a GridWorld, a TabularMDP"),
        ("asks", lambda number: CORRIDOR, "wanted a GridWorld, a TabularMDP"),
    ],
)
def test_what_is_no_member_is_refused(name: str, thing: Any, why: str) -> None:
    with pytest.raises(BadInput, match=why):
        PROBLEMS.adopted(name, thing, "test")


def test_what_gives_no_table_is_named_when_it_is_made() -> None:
    with pytest.raises(BadInput, match="problem 'four': it gives int: wanted a GridWorld"):
        NamedProblem("Four", lambda: 4).made("four")


def test_one_from_a_file_is_not_run_unasked() -> None:
    assert is_named("no_file.made")
    with pytest.raises(BadInput, match=r"whose code is not run unasked: name it again, such as \./no_file\.py:made "):
        lab.teach("no_file.made")
