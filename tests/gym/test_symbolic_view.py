"""MiniGrid by its symbolic view, and what is said about pictures."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from lab.errors import BadInput
from lab.gym.environment_name import GymName, make
from lab.gym.gym_environment import GymEnvironment
from lab.gym.numbered_environment import NumberedEnvironment
from lab.gym.symbolic_view import SymbolicEnv

DOORS = GymName("MiniGrid-DoorKey-5x5-v0", {"seed": 0})


def minigrid(name: GymName) -> SymbolicEnv:
    pytest.importorskip("minigrid")
    made = make(name, "test", "ansi")
    assert isinstance(made, SymbolicEnv)
    return made


def test_a_door_is_opened_with_its_key_in_the_fewest_steps() -> None:
    """Its table, walked by hand: to the key, up to the door, through it, and down to the goal; MiniGrid itself agrees."""
    env = minigrid(DOORS)
    place = GymEnvironment(NumberedEnvironment(DOORS, "test"))
    assert place.model is not None
    assert place.model.certain
    best, state, taken = place.values(0.99).argmax(axis=1), env.mdp.start, list[int]()
    while not env.mdp.terminal[state]:
        taken.append(int(best[state]))
        state = int(env.mdp.successor[state, taken[-1]])
    assert env.mdp.goal[state]
    own = gymnasium.make(DOORS.id)
    own.reset(seed=0)
    ends = [own.step(action)[2] for action in taken]
    assert ends == [False] * (len(taken) - 1) + [True]


def test_the_view_is_drawn_as_text() -> None:
    env = minigrid(DOORS)
    env.reset(seed=5)
    assert (env.render() or "").splitlines() == ["# # # # #", "# . + . #", "# K # . #", "# < # G #", "# # # # #"]


def test_another_seed_draws_another_layout() -> None:
    assert minigrid(DOORS).keys[0] != minigrid(GymName(DOORS.id, {"seed": 3})).keys[0]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (GymName("MiniGrid-Dynamic-Obstacles-5x5-v0", {}), "its steps are drawn at random"),
        (GymName(DOORS.id, {"seed": "x"}), "seed 'x': wanted a whole number"),
    ],
)
def test_what_has_no_symbolic_view_is_refused(name: GymName, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        minigrid(name)


@pytest.mark.parametrize("inside", [False, True])
def test_pictures_are_refused_with_advice(inside: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = spaces.Box(0, 255, (7, 7, 3), np.uint8)

    class Pictures(gymnasium.Env[object, object]):
        observation_space = spaces.Dict({"image": picture, "way": spaces.Discrete(4)}) if inside else picture
        action_space = spaces.Discrete(2)

    monkeypatch.setattr("lab.gym.numbered_environment.make", lambda *given: Pictures())
    with pytest.raises(BadInput, match="wanted a symbolic view") as refused:
        NumberedEnvironment(GymName("Pictures-v0", {}), "test")
    assert "\n" not in str(refused.value)
