"""Gymnasium environments as problems: names, spaces, exact models by hand, seeds, judgements, and every slip in one line."""

import itertools
import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

import lab
from lab.advice.advisors import AdvisorName
from lab.advice.table_level import TableLevel
from lab.errors import BadInput, LabError, WorkFailed
from lab.gym.environment_name import names_environment, parse_name
from lab.gym.gym_environment import ALONE, GymEnvironment
from lab.gym.numbered_environment import CellNumbering, Numbering, Unsupported
from lab.gym.transition_model import TransitionModel, Worth
from lab.learning.environment import Judged
from lab.learning.physics.environment import PhysicsEnvironment
from lab.learning.physics.mountain_car import energy_rule
from lab.learning.selection import Draw, uniforms
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import advice_chances
from lab.tasks.task_file import load_world
from lab.teaching.gym_subject import GymWorld, gym_world


class Corridor(gymnasium.Env[Any, Any]):
    """Cells 10 to 14 with nothing but their numbers: 2 goes right, 1 left; 14 ends it with +1, 10 with -1."""

    def __init__(self, first: int = 12, fails: str = "", cells: int = 5) -> None:
        self.observation_space, self.action_space = spaces.Discrete(cells, start=10), spaces.Discrete(2, start=1)
        self._first, self._fails = first, fails
        self._cell = first

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        if self._fails == "reset":
            raise RuntimeError("no power\nat all")
        self._cell = self._first
        return self._cell, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        assert action in self.action_space
        if self._fails == "step":
            raise RuntimeError("a gear broke")
        self._cell += -1 if action == 1 else 1
        reward = float("nan") if self._fails == "reward" else {14: 1.0, 10: -1.0}.get(self._cell, 0.0)
        seen = 99 if self._fails == "state" else self._cell
        return seen, reward, self._cell in (10, 14), False, {}


class Draught(gymnasium.Env[Any, Any]):
    """A corridor of 4 cells, 3 the goal: right (1) gets there with chance 1/2, else it stays; it says its model."""

    metadata = {"render_modes": ["ansi"]}  # noqa: RUF012
    action_labels = ("left", "right")

    def __init__(self, render_mode: str | None = None, lies: bool = False) -> None:
        self.observation_space, self.action_space, self.render_mode = (
            spaces.Discrete(4),
            spaces.Discrete(2),
            render_mode,
        )
        self.s, self._chance = 0, 0.5
        said = 1.0 if lies else self._chance
        self.P = {s: {0: [(1.0, max(0, s - 1), -1.0, False)], 1: self._right(s, said)} for s in range(3)}
        self.P[3] = {a: [(1.0, 3, 0.0, True)] for a in range(2)}

    def _right(self, s: int, chance: float) -> list[tuple[float, int, float, bool]]:
        stays = [(1.0 - chance, s, -1.0, False)] if chance < 1.0 else []
        return [*stays, (chance, s + 1, 5.0 if s == 2 else -1.0, s == 2)]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.s = 0
        return self.s, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        moved = 1 if action == 1 and self.np_random.random() < self._chance else -1 if action == 0 else 0
        self.s = max(0, self.s + moved)
        return self.s, 5.0 if self.s == 3 else -1.0, self.s == 3, False, {}

    def render(self) -> str | None:
        return "".join("o" if cell == self.s else "." for cell in range(4))


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    """The two of this file, as own ones are registered."""
    gymnasium.register("Corridor-v0", Corridor, max_episode_steps=30)  # type: ignore[arg-type]
    gymnasium.register("Draught-v0", Draught)  # type: ignore[arg-type]
    yield
    for name in ("Corridor-v0", "Draught-v0"):
        del gymnasium.registry[name]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Little learning alone."""
    monkeypatch.setattr("lab.gym.gym_environment.ALONE", replace(ALONE, episodes=300))


def environment(word: str) -> GymEnvironment:
    found = gym_world(word).problem().environment
    assert isinstance(found, GymEnvironment)
    return found


def model(word: str) -> TransitionModel:
    found = environment(word).model
    assert found is not None
    return found


def learned(world: GymWorld, seed: int, advisor: str = "none", draw: Draw | None = None) -> SessionResult:
    problem, rng = world.problem(), np.random.default_rng(seed)
    assert problem.environment is not None
    asked = TableLevel(problem.mdp, world.learner.discount, rng, values=problem.environment.values).advisor(
        AdvisorName.of(advisor)
    )
    place = problem.environment
    return Session(place, world.learner, world.gate, asked, rng if draw is None else draw).run()


# ---- names ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "made", "options"),
    [
        ("gym:FrozenLake-v1", "FrozenLake-v1", {}),
        ("gym:Taxi?is_rainy=true", "Taxi", {"is_rainy": True}),
        ("gym:A-v0?a=False&b=8x8&c=1&d=0.5&e=None", "A-v0", {"a": False, "b": "8x8", "c": 1, "d": 0.5, "e": None}),
        ("gym:A?text=%22true%22&space=a%20b&list=[1,0,0]", "A", {"text": "true", "space": "a b", "list": [1, 0, 0]}),
        ("gym:my.module:Own/Thing-v3", "my.module:Own/Thing-v3", {}),
        ("gym:A?empty=&nan=NaN", "A", {"empty": "", "nan": "NaN"}),
        ("gym:A?", "A", {}),
    ],
)
def test_a_word_is_an_id_and_keywords(word: str, made: str, options: dict[str, object]) -> None:
    assert names_environment(word)
    found = parse_name(word, "SUBTASK")
    assert (found.id, found.options) == (made, options)


@pytest.mark.parametrize(
    "word",
    [
        *("gym:", "gym:?a=1", "world-1", "gym:A?a", "gym:A?=1", "gym:A?a=1&a=2", "gym:A?a b=1", "gym:A\n"),
        *("gym:A?render_mode=human", "gym:A?disable_env_checker=true"),
    ],
)
def test_a_word_that_is_none_is_said_with_what_is_wanted(word: str) -> None:
    with pytest.raises(BadInput, match=r"\(SUBTASK\): .*wanted gym:ID"):
        parse_name(word, "SUBTASK")


VALUES: SearchStrategy[object] = st.recursive(
    st.booleans() | st.none() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=5,
)


@given(st.dictionaries(st.from_regex(r"[a-z_]{1,8}", fullmatch=True), VALUES, max_size=4))
def test_what_is_written_as_json_is_read_back(options: dict[str, object]) -> None:
    query = "&".join(f"{key}={quote(json.dumps(value))}" for key, value in options.items())
    assert parse_name(f"gym:A-v0{'?' if query else ''}{query}", "here").options == options


@given(st.text())
def test_any_text_is_a_name_or_bad_input(text: str) -> None:
    with suppress(BadInput):
        assert str(parse_name(f"gym:{text}", "here")).startswith(text.partition("?")[0])


# ---- spaces ---------------------------------------------------------------------------------------------------------


def test_values_are_numbered_in_order_the_last_digit_fastest() -> None:
    cards = Numbering(spaces.Tuple((spaces.Discrete(3, start=4), spaces.MultiBinary(2))))
    assert (cards.count, cards.sizes) == (12, (3, 2, 2))
    assert cards.number((5, np.array([1, 0]))) == 4 + 2
    first, bits = cards.value(11)
    assert (first, bits.tolist()) == (6, [1, 1])
    named = Numbering(spaces.Dict({"b": spaces.Discrete(2), "a": spaces.MultiDiscrete([2, 5], start=[0, -2])}))
    assert named.sizes == (2, 5, 2)  # a Dict's keys in their order
    assert named.number({"b": 1, "a": np.array([1, -2])}) == 11
    with pytest.raises(ValueError, match="7 is not in Discrete"):
        Numbering(spaces.Discrete(3, start=4)).number(7)


SPACES: SearchStrategy[spaces.Space[Any]] = st.recursive(
    st.builds(spaces.Discrete, st.integers(1, 4), start=st.integers(-3, 3))
    | st.lists(st.integers(1, 3), min_size=1, max_size=3).map(spaces.MultiDiscrete)
    | st.integers(1, 3).map(spaces.MultiBinary),
    lambda inner: (
        st.lists(inner, min_size=1, max_size=2).map(spaces.Tuple)
        | st.dictionaries(st.sampled_from("ab"), inner, min_size=1).map(spaces.Dict)
    ),
    max_leaves=3,
)


@given(SPACES)
def test_each_number_is_one_value_of_the_space(space: spaces.Space[Any]) -> None:
    numbering = Numbering(space)
    for number in range(min(numbering.count, 50)):
        assert numbering.number(numbering.value(number)) == number
        assert numbering.value(number) in space


@pytest.mark.parametrize("space", [spaces.Box(0, 1), spaces.Tuple((spaces.Discrete(2), spaces.Text(3)))])
def test_what_is_not_discrete_has_no_numbers(space: spaces.Space[Any]) -> None:
    with pytest.raises(Unsupported):
        Numbering(space)


# ---- models ---------------------------------------------------------------------------------------------------------


def test_a_model_by_hand() -> None:
    """From each of three cells right succeeds with chance 1/2: 2 tries a cell, 6 in all, and the last one pays 5."""
    found = model("gym:Draught-v0")
    assert (found.certain, found.best) == (False, 5.0)
    assert np.flatnonzero(found.goal).tolist() == np.flatnonzero(found.terminal).tolist() == [3]
    q = found.optimal(1.0)  # each try costs 1, the last one brings 5 instead
    assert q[:3, 1] == pytest.approx([-6 + 6, -4 + 6, -2 + 6], abs=1e-9)
    assert q[:3, 0] == pytest.approx([-1 + 0, -1 + 0, -1 + 2])
    assert q[3].tolist() == [0.0, 0.0]
    always = np.ones(4, np.int64)
    assert [*found.worth(always, 10_000)] == pytest.approx([0.0, 1.0, 6.0], abs=1e-9)
    assert [*found.worth(always, 3)] == pytest.approx([-3 + 6 / 8, 1 / 8, 3.0])
    assert found.worth(0 * always, 50) == Worth(-50.0, 0.0, np.inf)
    assert found.likeliest().tolist() == [[0, 0], [0, 1], [1, 2], [3, 3]]  # of the two that are alike, the first


def test_where_an_agent_slips_the_likeliest_is_where_it_wants_to_go() -> None:
    slippery, sure = model("gym:FrozenLake"), model("gym:FrozenLake?is_slippery=false")
    assert (slippery.certain, sure.certain) == (False, True)
    free = slippery.live
    assert np.array_equal(slippery.likeliest()[free], sure.likeliest()[free])


def test_frozen_lake_is_known_exactly() -> None:
    found = model("gym:FrozenLake")
    policy = found.optimal(1.0).argmax(axis=1)
    assert found.worth(policy, 100).reaches == pytest.approx(0.7402, abs=5e-5)  # Gymnasium's registration: 0.74
    assert found.worth(policy, 100_000).reaches == pytest.approx(14 / 17)  # 0.8235
    assert found.optimal(1.0)[0].max() == pytest.approx(14 / 17)
    assert (np.flatnonzero(found.goal).tolist(), np.flatnonzero(found.terminal).tolist()) == ([15], [5, 7, 11, 12, 15])


@pytest.mark.parametrize(("word", "mean_return", "steps"), [("CliffWalking", -13.0, 13.0), ("Taxi", 7.93, 13.07)])
def test_cliff_and_taxi_are_known_exactly(word: str, mean_return: float, steps: float) -> None:
    found = model(f"gym:{word}")
    best = found.worth(found.optimal(0.99).argmax(axis=1), 200)
    assert found.certain
    assert [*best] == pytest.approx([mean_return, 1.0, steps])


@pytest.mark.parametrize(
    ("outcomes", "starts"),
    [
        ({0: {0: [(0.5, 0, 0.0, True)]}}, [1.0]),
        ({0: {0: [(1.0, 7, 0.0, True)]}}, [1.0]),
        ({0: {0: [(1.0, 0, np.inf, True)]}}, [1.0]),
        ({0: {0: [(1.0, 0, 0.0, True)]}}, [0.4]),
        ({0: {0: [(1.0, 0, 0.0)]}}, [1.0]),
        ({0: {0: [(1.0, 0, 0.0, True)]}}, [0.5, 0.5]),
    ],
)
def test_what_is_no_model_is_refused(outcomes: Any, starts: list[float]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        TransitionModel(outcomes, np.array(starts), 1)


def test_values_that_do_not_settle_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.gym.transition_model.MAX_SWEEPS", 1000)
    endless = TransitionModel({0: {0: [(1.0, 0, -1.0, False)]}}, np.ones(1), 1)
    assert endless.best == -np.inf
    with pytest.raises(WorkFailed, match=r"discount 1\.0 did not settle in 1000 sweeps"):
        endless.optimal(1.0)


@pytest.mark.parametrize("word", ["gym:Draught-v0?lies=true", "gym:Taxi?fickle_passenger=true"])
def test_a_model_that_the_steps_do_not_follow_is_not_believed(word: str) -> None:
    assert environment(word).model is None


# ---- the environment of a session -----------------------------------------------------------------------------------


@pytest.mark.parametrize("word", ["gym:FrozenLake", "gym:Taxi", "gym:Corridor-v0", "gym:Blackjack", "gym:Draught-v0"])
def test_the_same_draws_give_the_same_session_in_the_same_object_too(word: str, few: None) -> None:
    world = gym_world(word)
    short = world.model_copy(update={"learner": LearnerSettings(episodes=30, max_steps=40, selection="epsilon-greedy")})
    first, second = (learned(short, 3) for _ in range(2))
    other = learned(gym_world(word).model_copy(update={"learner": short.learner}), 3)
    for result in (second, other):
        assert np.array_equal(first.q, result.q)
        assert first.steps.tolist() == result.steps.tolist()
        assert (first.final_steps, first.solved) == (result.final_steps, result.solved)


@pytest.mark.parametrize("name", ["world-1", "world-2"])
def test_a_world_of_ours_is_learned_to_the_same_table(name: str) -> None:
    """The environment takes one draw more, for its seed."""
    world = load_world(name)
    place = gym_world(f"gym:TeachingLab/World{name[-1]}-v0").problem().environment
    assert place is not None
    ours = Session(world.mdp(), world.learner, GateSettings(gate="never"), None, np.random.default_rng(7)).run()
    draw = itertools.chain([0.5], iter(uniforms(np.random.default_rng(7)), None)).__next__
    theirs = Session(place, world.learner, GateSettings(gate="never"), None, draw).run()
    assert np.array_equal(ours.q, theirs.q)
    assert ours.steps.tolist() == theirs.steps.tolist()
    assert (ours.final_steps, ours.optimal_steps, ours.solved) == (
        theirs.final_steps,
        theirs.optimal_steps,
        theirs.solved,
    )


def test_a_hole_ends_an_episode_and_only_the_goal_is_reached() -> None:
    place, draw = environment("gym:FrozenLake?is_slippery=false"), uniforms(np.random.default_rng(0))
    assert place.reset(1, draw) == 0
    assert place.step(0, 1, draw) == (0.0, 4, False, False, False)
    assert place.step(4, 2, draw) == (0.0, 5, True, False, False)
    state = place.reset(2, draw)
    for action in (1, 1, 2, 2, 1):
        state = place.step(state, action, draw).state
    assert place.step(state, 2, draw) == (1.0, 15, True, True, False)
    with pytest.raises(ValueError, match="in state 15, not in 3"):
        place.step(3, 0, draw)


def test_a_step_limit_truncates() -> None:
    place, draw = environment("gym:CliffWalking?max_episode_steps=2"), uniforms(np.random.default_rng(0))
    state = place.reset(1, draw)
    state = place.step(state, 3, draw).state
    assert place.step(state, 3, draw) == (-1.0, 36, False, False, True)
    assert place.max_steps == 2


def test_a_table_shows_the_likeliest_steps_by_name() -> None:
    mdp = environment("gym:FrozenLake").mdp
    assert (mdp.action_labels, mdp.shape, mdp.start) == (("left", "down", "right", "up"), (4, 4), 0)
    assert mdp.state_label(6) == "(1, 2)"
    assert mdp.successor[14, 2] == 15
    assert mdp.reward[14, 2] == pytest.approx(1 / 3)
    cliff = environment("gym:CliffWalking").mdp
    assert (cliff.action_labels, cliff.shape, cliff.start) == (("up", "right", "down", "left"), (4, 12), 36)
    taxi = environment("gym:Taxi").mdp
    assert taxi.action_labels == ("south", "north", "east", "west", "pick-up", "drop-off")
    assert taxi.state_label(328) == "row 3, column 1, passenger 2, destination 0"
    assert (len(taxi.starts), taxi.shape) == (300, ())
    assert environment("gym:Blackjack").mdp.state_label(29) == "sum 1, dealer 3, ace 1"
    assert environment("gym:TeachingLab/ToastCell-v0").mdp.state_label(5) == "0, 0, 0, 5"


def test_two_environments_that_look_alike_are_two_problems() -> None:
    signatures = [environment(f"gym:Corridor-v0?first={first}").mdp.signature for first in (12, 13, 12)]
    assert signatures[0] == signatures[2] != signatures[1]
    lakes = [environment(f"gym:FrozenLake?{query}").mdp.signature for query in ("success_rate=0.5", "success_rate=0.6")]
    assert lakes[0] != lakes[1]


def test_pictures_are_the_environments_own_of_any_state() -> None:
    lake = environment("gym:FrozenLake")
    assert lake.picture(0) == "\x1b[41mS\x1b[0mFFF\nFHFH\nFFFH\nHFFG"
    assert lake.picture(6) == "SFFF\nFH\x1b[41mF\x1b[0mH\nFFFH\nHFFG"
    lake.reset(1, uniforms(np.random.default_rng(0)))
    lake.picture(6)
    assert lake.step(0, 0, uniforms(np.random.default_rng(0))).state in (0, 4)  # drawing has moved nothing
    assert "|Y| : |" in environment("gym:Taxi").picture(0)
    assert environment("gym:Draught-v0").picture(2) == "..o."
    assert environment("gym:Corridor-v0").picture(0) == ""


def test_what_cannot_be_put_anywhere_is_drawn_where_it_is() -> None:
    cell, draw = environment("gym:TeachingLab/ToastCell-v0"), uniforms(np.random.default_rng(0))
    start = cell.reset(1, draw)
    assert cell.picture(start).startswith("0 s: the robot is at 'toaster_buffer'\ntoast 1: 'plate'")
    assert cell.picture(start + 1) == ""
    entered = cell.step(start, 0, draw).state
    assert cell.picture(entered).startswith("57 s: the robot is at 'toaster'\ntoast 1: 'toaster', ready in 60 s")


# ---- judgements -----------------------------------------------------------------------------------------------------


def test_a_policy_is_judged_exactly_where_there_is_a_model() -> None:
    lake, learner = environment("gym:FrozenLake?map_name=4x4"), LearnerSettings(max_steps=100)
    best = lake.values(0.99)
    assert lake.judge(best, learner) == Judged(39, 39, True)
    with pytest.raises(ValueError, match="read-only"):
        best[0, 0] = 1.0
    assert lake.judge(-best, learner) == Judged(None, 39, False)
    cliff = environment("gym:CliffWalking")
    assert cliff.judge(cliff.values(0.99), LearnerSettings(count_start=True)) == Judged(14, 14, True)
    detour = cliff.values(0.99).copy()
    detour[36, 0], detour[24, 0] = 0.0, 0.0  # up, and up once more: two steps longer
    assert cliff.judge(detour, LearnerSettings()) == Judged(15, 13, False)


def test_the_threshold_of_the_registration_is_for_its_own_keywords() -> None:
    """A wrong move from (0, 1) makes 0.708 of 0.740: more than the threshold 0.70, less than the best but 1 %."""
    lake, learner = environment("gym:FrozenLake-v1"), LearnerSettings(max_steps=100)
    q = lake.values(0.99).copy()
    q[1, 0] = 1.0
    assert lake.judge(q, learner) == Judged(37, 39, True)
    assert environment("gym:FrozenLake-v1?is_slippery=true").judge(q, learner) == Judged(37, 39, False)


def test_without_a_model_it_is_played_and_the_best_is_learned_alone() -> None:
    place, learner = environment("gym:Corridor-v0"), LearnerSettings(max_steps=30)
    assert place.model is None
    right, left = np.tile([0.0, 1.0], (5, 1)), np.tile([1.0, 0.0], (5, 1))
    assert place.judge(right, learner) == Judged(2, None, True)
    assert place.judge(left, learner) == Judged(None, None, False)
    known = place.values(0.9)
    assert known[1:4].argmax(axis=1).tolist() == [1, 1, 1]
    assert known[2:4, 1] == pytest.approx([0.9, 1.0], abs=0.01)
    assert np.array_equal(known, environment("gym:Corridor-v0").values(0.9))


def test_it_is_said_when_nobody_knows_what_is_best(few: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Corridor, "step", lambda self, action: (self._cell, 0.0, False, False, {}))
    place = environment("gym:Corridor-v0?max_episode_steps=1")
    with pytest.raises(WorkFailed, match="nobody knows what is best in it: 300 episodes of learning alone"):
        place.values(0.9)
    assert place.judge(np.zeros((5, 2)), LearnerSettings()) == Judged(None, None, False)


# ---- what is taught -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "advisor", "steps"),
    [
        ("gym:FrozenLake?is_slippery=false", "none", 6),
        ("gym:CliffWalking", "expert", 13),
        ("gym:TeachingLab/World1-v0", "expert", 12),
    ],
)
def test_the_labs_own_session_learns_it(word: str, advisor: str, steps: int) -> None:
    result = learned(gym_world(word), 1, advisor)
    assert (result.solved, result.final_steps, result.optimal_steps) == (True, steps, steps)


def test_settings_fit_the_environment() -> None:
    sure, chance, unknown = (gym_world(f"gym:{word}") for word in ("CliffWalking", "FrozenLake", "Corridor-v0"))
    assert (sure.learner.alpha, chance.learner.alpha, unknown.learner.alpha) == (1.0, 0.1, 0.1)
    assert [world.learner.max_steps for world in (sure, chance, unknown)] == [200, 100, 30]
    assert gym_world("gym:TeachingLab/World1-v0").learner.max_steps == 199
    assert sure.gate == GateSettings(spare_best=True)


def test_the_options_of_a_command_change_the_settings() -> None:
    world = gym_world("gym:FrozenLake").changed(learner="sarsa", gate="always", episodes=7)
    assert (world.learner.learner, world.gate.gate, world.learner.episodes) == ("sarsa", "always", 7)
    assert (world.problem().name, world.problem().subtask) == ("FrozenLake", "gym")
    with pytest.raises(BadInput, match=r"learner 'afterstate' .* where the steps of 'FrozenLake' lead is not certain"):
        world.changed(learner="afterstate")
    assert gym_world("gym:TeachingLab/World1-v0").changed(learner="afterstate").learner.learner == "afterstate"


# ---- what can be wrong ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("gym:FrozenLak-v1", "(SUBTASK; one of your own is gym:MODULE:ID): did you mean 'FrozenLake-v1'? known: "),
        ("gym:Own/Thing-v0", "one of your own is gym:MODULE:ID"),
        ("gym:FrozenLake-v99", "did you mean 'FrozenLake-v1'?"),
        ("gym:nowhere:Thing-v0", "it needs what is not installed: ModuleNotFoundError: No module named 'nowhere'"),
        ("gym:Ant-v5", "it needs what is not installed: "),
        ("gym:Pendulum-v1", "its action space is Box("),
        ("gym:Pendulum-v1", "supported are Discrete, MultiDiscrete, MultiBinary, and Tuple or Dict of these"),
        ("gym:CartPole-v1?sutton_barto_reward=true", "its observation space is Box("),  # its speeds have no bounds
        ("gym:CartPole-v1?sutton_barto_reward=true", "wanted 1 to 4 axes with finite bounds"),
        ("gym:MountainCar-v0?max_episode_steps=0", "it cannot be made with max_episode_steps: "),
        ("gym:FrozenLake-v1?slippery=true", "unknown keyword 'slippery'"),
        ("gym:FrozenLake-v1?slippery=true", "did you mean 'is_slippery'? known: desc, is_slippery, map_name, max_ep"),
        ("gym:FrozenLake-v1?map_name=9x9", "it cannot be made with map_name: KeyError: '9x9'"),
        ("gym:CliffWalking-v1?max_episode_steps=0", "it cannot be made with max_episode_steps: "),
        ("gym:two words", "it cannot be made: Error: Malformed environment ID: two words"),
        ("gym:TeachingLab/World-v0?world=nowhere", "unknown task 'nowhere'"),
        ("gym:Corridor-v0?cells=600000", "600000 states x 2 actions: a table of at most 1000000 entries is allowed"),
        ("gym:Corridor-v0?fails=reset", "it cannot be reset: RuntimeError: no power at all"),
        ("gym:Corridor-v0?first=3", "it cannot be reset: ValueError: 3 is not in Discrete(5, start=10)"),
    ],
)
def test_what_cannot_be_learned_is_said_in_one_line(word: str, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        gym_world(word)
    assert said in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("fails", "said"),
    [
        ("step", "its step from 2 with action 0: RuntimeError: a gear broke"),
        ("reward", "its step from 2 with action 0: a reward of nan"),
        ("state", "its step from 2 with action 0: ValueError: 99 is not in"),
    ],
)
def test_an_environment_that_breaks_ends_the_session(fails: str, said: str) -> None:
    place, draw = environment(f"gym:Corridor-v0?fails={fails}"), uniforms(np.random.default_rng(0))
    with pytest.raises(WorkFailed) as caught:
        place.step(place.reset(1, draw), 0, draw)
    assert str(caught.value).startswith(f"environment 'Corridor-v0?fails=\"{fails}\"' (SUBTASK): {said}")


OWN = """
import warnings
import gymnasium
from gymnasium import spaces
warnings.warn("loaded")


class Door(gymnasium.Env):
    observation_space, action_space = spaces.Discrete(2), spaces.Discrete(1)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        warnings.warn("reset")
        return 0, {}

    def step(self, action):
        return 1, 1.0, True, False, {}


gymnasium.register("Door-v0", Door)
"""


def test_an_own_one_lies_in_a_module_in_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lab_test_doors.py").write_text(OWN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    try:
        world = gym_world("gym:lab_test_doors:Door-v0")
        assert learned(world.changed(episodes=3), 0).final_steps == 1
        assert sys.path == before
        with pytest.raises(BadInput, match=r"unknown keyword 'width' .*'lab_test_doors:Door-v0\?width=3'"):
            gym_world("gym:lab_test_doors:Door-v0?width=3")
    finally:
        gymnasium.registry.pop("Door-v0", None)
        sys.modules.pop("lab_test_doors", None)


@pytest.mark.parametrize("text", ["raise RuntimeError('boom')", "def (:"])
def test_a_module_that_breaks_is_said(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lab_test_broken.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LabError, match=r"environment 'lab_test_broken:X-v0' \(SUBTASK\): it cannot be made: "):
        gym_world("gym:lab_test_broken:X-v0")


def test_an_expert_knows_the_lake_better_than_a_novice() -> None:
    """How often an advisor gets there who is always followed: a softmax over small differences is soon a coin's."""
    lake = environment("gym:FrozenLake")
    assert lake.model is not None
    starts, outcomes = lake.model.starts, lake.live.inside.P

    def reaches(tau: float) -> float:
        chances = advice_chances(lake.values(0.99), tau)
        mixed = {
            state: {0: [(c * chances[state, a], *rest) for a in range(4) for c, *rest in row[a]]}
            for state, row in outcomes.items()
        }
        return TransitionModel(mixed, starts, 1).worth(np.zeros(16, np.int64), 100).reaches

    expert, moderate, novice = reaches(0.01), reaches(0.1), reaches(1.0)
    assert expert > 0.6
    assert expert > moderate > novice
    assert novice < 0.1


# ---- continuous observations ----------------------------------------------------------------------------------------


def test_the_car_is_taught_by_the_labs_own_physics_unless_its_rules_are_others() -> None:
    own, longer = gym_world("gym:MountainCar-v0"), gym_world("gym:MountainCar-v0?max_episode_steps=500")
    theirs = gym_world("gym:MountainCar-v0?goal_velocity=0.01")
    assert [type(one.problem().environment).__name__ for one in (own, longer, theirs)] == [
        "PhysicsEnvironment",
        "PhysicsEnvironment",
        "GymEnvironment",
    ]
    assert (own.learner.tilings, own.learner.max_steps, longer.learner.max_steps) == (8, 200, 500)
    with pytest.raises(BadInput, match=r"with tilings = 8: allowed are q, sarsa, q-lambda, sarsa-lambda"):
        own.changed(learner="dyna-q")


def test_gymnasiums_car_is_learned_in_the_same_cells_as_the_labs_own() -> None:
    """The same table and settings, alone and through Gymnasium: the walk from a start is cell by cell the same."""
    own, theirs = (gym_world(f"gym:MountainCar-v0{query}") for query in ("", "?goal_velocity=0"))
    ours, others = own.problem().environment, theirs.problem().environment
    assert isinstance(ours, PhysicsEnvironment)
    assert isinstance(others, GymEnvironment)
    assert ours.mdp.cells == others.mdp.cells == (64, 64)
    state, draw = others.reset(1, uniforms(np.random.default_rng(3))), uniforms(np.random.default_rng(0))
    ours.point = list(others.live.inside.state)
    steps, terminated = 0, False
    while not terminated and steps < 200:
        action = 2 if ours.point[1] >= 0.0 else 0
        one, other = ours.step(state, action, draw), others.step(state, action, draw)
        assert one[:4] == other[:4]
        state, terminated, steps = other.state, other.terminated, steps + 1
    assert steps < 150
    short = replace(theirs.learner, episodes=2)
    found = Session(others, short, GateSettings("never"), None, np.random.default_rng(0)).run()
    assert found.steps.tolist() == [201, 201]


def test_cells_of_a_box_are_numbered_by_its_bounds() -> None:
    cells = CellNumbering(spaces.Box(np.array([-1.0, 0.0]), np.array([1.0, 4.0]), dtype=np.float64))
    assert (cells.sizes, cells.number([-1.0, 0.0]), cells.number([1.0, 4.0])) == ((64, 64), 0, 64 * 64 - 1)
    assert cells.number(cells.value(1234)) == 1234
    for wrong in ([0.0], [0.0, float("nan")]):
        with pytest.raises(ValueError, match="no point with 2 finite numbers"):
            cells.number(wrong)
    for space in (spaces.Box(-1, 1, (5,)), spaces.Box(-np.inf, 1, (1,)), spaces.Discrete(3)):
        with pytest.raises(Unsupported):
            CellNumbering(space)


def test_a_function_teaches_the_car_and_the_policy_is_kept(tmp_path: Path) -> None:
    def by_energy(request: Any) -> int:
        return energy_rule(request.environment.point)

    taught = lab.teach("gym:MountainCar-v0", advisor=by_energy, episodes=4, gate="always", budget=400)
    assert taught.document["helped_steps"] == 400
    assert max(taught.session.steps[:3]) < 150
    path = taught.keep(tmp_path)
    assert path.is_file()
    assert taught.q.shape == (4096, 3)
