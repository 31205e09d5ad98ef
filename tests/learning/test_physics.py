"""Worlds of physics make Gymnasium's own steps, and are drawn, named and judged by hand."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest

from lab.learning.physics import PHYSICS, Physics
from lab.learning.physics.cells import CellTable
from lab.learning.physics.environment import PhysicsEnvironment, fitting
from lab.learning.physics.mountain_car import energy_rule


@pytest.mark.parametrize("physics", PHYSICS.values(), ids=PHYSICS)
def test_steps_are_gymnasiums(physics: Physics) -> None:
    rng, theirs = np.random.default_rng(0), gymnasium.make(physics.name)
    inside: Any = theirs.unwrapped
    ends = 0
    for _ in range(12):
        theirs.reset(seed=int(rng.integers(1000)))
        point = np.array(inside.state, np.float64).tolist()
        push = int(rng.integers(len(physics.actions)))
        for _ in range(physics.limit):
            # pushes with the swing, or now and then any: both get to ends, and to the bounds
            push = _lively(physics, point) if rng.random() < 0.8 else int(rng.integers(len(physics.actions)))
            inside.state = np.array(point) if physics.name == "MountainCar-v0" else inside.state
            _, reward, over, late, _ = theirs.step(push)
            assert physics.step(point, push) is bool(over)
            np.testing.assert_allclose(point, np.array(inside.state, np.float64), rtol=0.0, atol=1e-12)
            point = np.array(inside.state, np.float64).tolist()
            assert reward == (physics.last_reward if over else physics.reward)
            ends += over
            if over or late:
                break
    assert ends > 0


def _lively(physics: Physics, point: list[float]) -> int:
    match physics.name:
        case "MountainCar-v0":
            return energy_rule(point)
        case "Acrobot-v1":
            return 2 if point[3] > 0.0 else 0
    return int(point[2] + 0.3 * point[3] > 0.0)


@pytest.mark.parametrize("physics", PHYSICS.values(), ids=PHYSICS)
def test_episodes_begin_where_gymnasiums_do(physics: Physics) -> None:
    env = gymnasium.make(physics.name)
    begun = []
    for seed in range(300):
        env.reset(seed=seed)
        begun.append(np.array(env.unwrapped.state, np.float64))  # type: ignore[attr-defined]
    place, rng = PhysicsEnvironment(physics), np.random.default_rng(0)
    ours = []
    for _ in range(300):
        assert place.reset(1, rng.random) == physics.bounds.number(place.point)
        ours.append(place.point)
    np.testing.assert_allclose(np.min(ours, axis=0), np.min(begun, axis=0), atol=0.005)
    np.testing.assert_allclose(np.max(ours, axis=0), np.max(begun, axis=0), atol=0.005)


def test_limits_and_thresholds_are_gymnasiums() -> None:
    for physics in PHYSICS.values():
        spec = gymnasium.spec(physics.name)
        assert (physics.limit, physics.threshold) == (spec.max_episode_steps, spec.reward_threshold)


def test_a_cell_is_called_by_what_it_means_and_two_worlds_are_two_problems() -> None:
    car = CellTable.of(PHYSICS["MountainCar-v0"])
    assert car.state_label(car.start) == "position -0.511, speed +0.001"
    assert len({CellTable.of(physics).signature for physics in PHYSICS.values()}) == 3
    assert car.cells == (64, 64)
    assert car.shape == ()


def test_the_car_is_drawn_on_its_hill() -> None:
    place = PhysicsEnvironment(PHYSICS["MountainCar-v0"])
    place.point = [-math.pi / 6, -0.01]  # the bottom of the valley
    lines = place.picture(place.physics.bounds.number(place.point)).splitlines()
    assert lines[-1] == "O car at -0.52, rolls left, 0.010 a step; F flag at +0.50"
    assert [n for n, line in enumerate(lines[:-1]) if "O" in line] == [7]
    assert [n for n, line in enumerate(lines[:-1]) if "F" in line] == [0]
    elsewhere = place.picture(place.physics.bounds.number((0.45, 0.05)))
    assert "rolls right" in elsewhere.splitlines()[-1]


def test_the_energy_rule_gets_the_car_out() -> None:
    place = PhysicsEnvironment(PHYSICS["MountainCar-v0"])
    q = np.zeros(place.mdp.successor.shape)
    for state in range(len(q)):
        q[state, energy_rule(place.physics.bounds.centre(state))] = 1.0
    moves = place.played(q, 200)
    assert (moves > 0).all()
    assert 100 < moves.mean() < 130
    judged = place.judge(q, fitting(place.physics))
    assert judged.final_steps == round(moves.mean())
    assert judged.optimal_steps is None
    nothing = place.judge(np.zeros_like(q), fitting(place.physics))
    assert (nothing.final_steps, nothing.solved) == (None, False)


def test_shapes_stand_where_the_world_stands() -> None:
    car = PhysicsEnvironment(PHYSICS["MountainCar-v0"])
    car.point = [-math.pi / 6, 0.0]
    lying = car.shapes(car.physics.bounds.number(car.point))
    assert not [shape for shape in lying if shape["kind"] == "motion"]  # it stands: no arrow
    wheels = [shape["disc"] for shape in lying if "disc" in shape]
    assert wheels[0][1] == pytest.approx(wheels[1][1], abs=0.01)  # level at the bottom of the valley
    pole = PhysicsEnvironment(PHYSICS["CartPole-v1"])
    pole.point = [0.0, 0.0, 0.0, 0.0]
    (line,) = [
        shape["line"] for shape in pole.shapes(pole.physics.bounds.number(pole.point)) if shape["kind"] == "goal"
    ]
    assert line == [[50.0, 40.0], [50.0, 10.0]]
    links = PhysicsEnvironment(PHYSICS["Acrobot-v1"])
    links.point = [0.0, 0.0, 0.0, 0.0]
    shapes = links.shapes(links.physics.bounds.number(links.point))
    assert [shape["line"] for shape in shapes if shape["kind"] == "body" and "line" in shape] == [
        [[50.0, 25.0], [50.0, 36.0]],
        [[50.0, 36.0], [50.0, 47.0]],
    ]
