"""Continuous worlds as environments of the lab's learners, whose states are cells; drawings of them; settings that suit them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import atan2, cos, sin
from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.environment import Judged, Step
from lab.learning.physics import Physics, cart_pole, mountain_car
from lab.learning.physics.cells import CellTable
from lab.learning.selection import Draw
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray

WIDTH, HEIGHT = 61, 9


def drawn(name: str, point: Sequence[float]) -> str:
    """The world of that name at a point as text; "" if it has no drawing."""
    return _mountain_car(*point) if name == "MountainCar-v0" else ""


def _mountain_car(position: float, speed: float) -> str:
    """The hill with car and flag, and the car's direction and speed."""
    span = mountain_car.HIGH - mountain_car.LOW
    lines = [[" "] * WIDTH for _ in range(HEIGHT)]
    for column in range(WIDTH):
        lines[_row(mountain_car.LOW + span * column / (WIDTH - 1))][column] = "."
    for mark, place in (("F", mountain_car.FLAG), ("O", position)):
        lines[max(_row(place) - 1, 0)][round((place - mountain_car.LOW) / span * (WIDTH - 1))] = mark
    motion = "stands" if speed == 0.0 else f"rolls {'right' if speed > 0.0 else 'left'}, {abs(speed):.3f} a step"
    caption = f"O car at {position:+.2f}, {motion}; F flag at {mountain_car.FLAG:+.2f}"
    return "\n".join([*("".join(line).rstrip() for line in lines), caption])


def _row(position: float) -> int:
    """The line of the ground, counted from above."""
    return round((1.0 - sin(3 * position)) / 2.0 * (HEIGHT - 2)) + 1


# ---- drawings as shapes ---------------------------------------------------------------------------------------------

# The points [[x, y], ...] of a line or area, or x, y and r of a disc, and its kind; 100 wide, 50 high, y points down.
Shape = dict[str, Any]


def shapes(name: str, point: Sequence[float]) -> list[Shape]:
    """The world of that name at a point: lines, areas and discs of the kinds ground, goal, body and motion."""
    draw: dict[str, Callable[..., list[Shape]]] = {
        "MountainCar-v0": _car_shapes,
        "CartPole-v1": _pole_shapes,
        "Acrobot-v1": _acrobot_shapes,
    }
    return draw[name](*point)


def _line(kind: str, *points: tuple[float, float]) -> Shape:
    return {"line": [[round(x, 2), round(y, 2)] for x, y in points], "kind": kind}


def _area(kind: str, *points: tuple[float, float]) -> Shape:
    return {"area": _line(kind, *points)["line"], "kind": kind}


def _disc(kind: str, x: float, y: float, r: float) -> Shape:
    return {"disc": [round(x, 2), round(y, 2), r], "kind": kind}


def _on_hill(position: float) -> tuple[float, float]:
    across = (position - mountain_car.LOW) / (mountain_car.HIGH - mountain_car.LOW)
    return 2.0 + 96.0 * across, 28.0 - 18.0 * sin(3 * position)


def _car_shapes(position: float, speed: float) -> list[Shape]:
    """The hill, the flag, the car, and an arrow whose length shows its speed."""
    ends = mountain_car.LOW, mountain_car.HIGH
    hill = [_on_hill(ends[0] + (ends[1] - ends[0]) * n / 60) for n in range(61)]
    x, y = _on_hill(position)
    flag_x, flag_y = _on_hill(mountain_car.FLAG)
    angle = atan2(_on_hill(position - 0.01)[1] - _on_hill(position + 0.01)[1], 0.02 * 96.0 / (ends[1] - ends[0]))
    along, up = (cos(angle), -sin(angle)), (-sin(angle), -cos(angle))

    def at(far: float, high: float) -> tuple[float, float]:
        return x + far * along[0] + high * up[0], y + far * along[1] + high * up[1]

    arrow = [] if speed == 0.0 else [_line("motion", at(0.0, 6.0), at(speed / mountain_car.FASTEST * 14.0, 6.0))]
    pole = flag_x, flag_y - 8.0
    return [
        _line("ground", *hill),
        _line("goal", (flag_x, flag_y), pole),
        _area("goal", pole, (flag_x - 4.0, flag_y - 6.5), (flag_x, flag_y - 5.0)),
        _area("body", at(-3.0, 1.0), at(-3.0, 3.5), at(-1.5, 4.5), at(1.5, 4.5), at(3.0, 3.5), at(3.0, 1.0)),
        *(_disc("body", *at(far, 0.9), 0.9) for far in (-1.8, 1.8)),
        *arrow,
    ]


def _pole_shapes(place: float, speed: float, angle: float, turning: float) -> list[Shape]:
    """The rail, the cart, the pole, and an arrow whose length shows the cart's speed."""
    x, y = 50.0 + 46.0 * place / cart_pole.FARTHEST, 40.0
    top = x + 30.0 * sin(angle), y - 30.0 * cos(angle)
    return [
        _line("ground", (4.0, y + 3.0), (96.0, y + 3.0)),
        _area("body", (x - 5.0, y), (x + 5.0, y), (x + 5.0, y + 3.0), (x - 5.0, y + 3.0)),
        _line("goal", (x, y), top),
        _line("motion", (x, y + 6.0), (x + 5.0 * speed, y + 6.0)),
    ]


def _acrobot_shapes(angle: float, bend: float, speed: float, bending: float) -> list[Shape]:
    """The line that the tip has to reach, and both links."""
    elbow = 50.0 + 11.0 * sin(angle), 25.0 + 11.0 * cos(angle)
    tip = elbow[0] + 11.0 * sin(angle + bend), elbow[1] + 11.0 * cos(angle + bend)
    links = _line("body", (50.0, 25.0), elbow), _line("body", elbow, tip)
    return [
        _line("goal", (20.0, 14.0), (80.0, 14.0)),
        *links,
        _disc("ground", 50.0, 25.0, 1.2),
        _disc("body", *elbow, 1.2),
    ]


# ---- the environment ------------------------------------------------------------------------------------------------


JUDGED = 200  # starts from which a policy is judged
MASTERS = 8  # sessions without advice, with seeds 0, 1, ..., of which the best table is what advisors know
JUDGES_SEED = 0  # of the starts
SOBER = -50.0  # pessimistic start value in worlds with step costs, see `fitting`
GOOD_ENOUGH = 0.5  # a policy that reaches the goal from a smaller share of the starts counts as missing it


class PhysicsEnvironment:
    """The `Environment` of a continuous world: the learner sees the cell, and the world continues from the exact point."""

    def __init__(self, physics: Physics):
        self.physics, self.mdp = physics, CellTable.of(physics)
        self.point: list[float] = []  # the exact state of the current episode
        self._known: dict[float, FloatArray] = {}

    def reset(self, episode: int, draw: Draw) -> int:
        """The cell of a start that the world draws."""
        self.point = [draw() for _ in self.physics.axes]
        self.physics.begin(self.point)
        return self.physics.bounds.number(self.point)

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome of one step from the exact point."""
        over = self.physics.step(self.point, action)
        reward = self.physics.last_reward if over else self.physics.reward
        return Step(reward, self.physics.bounds.number(self.point), over, over and not self.physics.longer_is_better)

    def picture(self, state: int) -> str:
        """The world as text, at the exact point if the learner is in this cell, otherwise at the centre of the cell."""
        return drawn(self.physics.name, self._shown(state))

    def shapes(self, state: int) -> list[Shape]:
        """The same as lines, areas and discs: see the function `shapes`."""
        return shapes(self.physics.name, self._shown(state))

    def _shown(self, state: int) -> Sequence[float]:
        here = bool(self.point) and self.physics.bounds.number(self.point) == state
        return self.point if here else self.physics.bounds.centre(state)

    def values(self, discount: float) -> FloatArray:
        """The action values (S, A) of the best of MASTERS compiled sessions without advice."""
        if discount not in self._known:
            from lab.learning.batch import run_sessions

            learner = replace(fitting(self.physics), discount=discount)
            seeds = np.arange(MASTERS, dtype=np.uint64)
            batch = run_sessions(self, learner, GateSettings("never"), None, seeds, keep_tables=True)
            best = min(batch.q, key=lambda q: float(np.abs(self.played(q, self.physics.limit)).mean()) * self._better)
            best.flags.writeable = False
            self._known[discount] = best
        return self._known[discount]

    @property
    def _better(self) -> float:
        return -1.0 if self.physics.longer_is_better else 1.0

    def played(self, q: FloatArray, most: int) -> Any:
        """The number of moves (JUDGED,) of the greedy policy of a table from drawn starts, negated if the episode did not end."""
        from lab.learning.batch import play

        axes = len(self.physics.axes)
        drawn = np.array([splitmix.uniform(JUDGES_SEED, n) for n in range(JUDGED * axes)]).reshape(JUDGED, axes)
        return play(self.mdp, q.argmax(axis=1), drawn, most)

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """The mean steps from JUDGED drawn starts, and whether the mean return reaches the threshold; the fewest are unknown."""
        physics, counted = self.physics, learner.count_start
        most = min(physics.limit, learner.max_steps - counted)
        moves = self.played(q, most)
        over, made = moves > 0, np.abs(moves)
        returned = physics.reward * made + over * (physics.last_reward - physics.reward)
        solved = bool(returned.mean() >= physics.threshold)
        if physics.longer_is_better:
            return Judged(round(float(np.where(over, most - made + 2, 1).mean())) + counted, 1 + counted, solved)
        if over.mean() < GOOD_ENOUGH:
            return Judged(None, None, solved)
        return Judged(round(float(made[over].mean())) + counted, None, solved)


def fitting(physics: Physics) -> LearnerSettings:
    """Settings that suit a world: SARSA(lambda) on tiles with replacing traces; the values were found by sessions in the worlds.

    In worlds with step costs the start value is about half the cost of an early path to the goal: with start values of 0,
    which are optimistic there, untried moves would look better than demonstrated ones. Source: Sutton and Barto 2018, example
    10.1 and figure 12.10.
    """
    learner = LearnerSettings(
        "sarsa-lambda",
        alpha=0.3,
        discount=1.0,
        trace=0.9,
        replacing=True,
        tilings=physics.tilings,
        start_value=SOBER,
        selection="epsilon-greedy",
        exploration=0.1,
        beta=1.5,
        episodes=500,
        max_steps=physics.limit,
    )
    if physics.longer_is_better:
        return replace(learner, alpha=0.8, discount=0.99, trace=0.8, start_value=0.0, beta=0.5)
    return learner
