"""The class that brings a mentor into LeRobot's rollout, without LeRobot: `devtools.lerobot_rollout_check` tries it there."""

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.mentor.mentor import Mentor
from lab.recordings.episode import Recording
from tests.mentor.conftest import Run

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = (ROOT / "examples" / "lerobot_asking_rollout.py").read_text(encoding="utf-8")


def text_of(name: str) -> str:
    """The source of a class or function of the example."""
    (node,) = (node for node in ast.parse(EXAMPLE).body if getattr(node, "name", None) == name)
    return ast.get_source_segment(EXAMPLE, node) or ""


class Engine:
    """An engine that drives the cart on by a tenth, and has no action where it sees nothing."""

    resets, ready = 0, True

    def reset(self) -> None:
        self.resets += 1

    def get_action(self, obs_frame: dict[str, Any] | None) -> Any:
        return None if obs_frame is None else np.array([0.1], np.float32)


@pytest.fixture
def mentor(recording: Recording, run: Run) -> Mentor:
    """It asks where the cart is off the line from 0 to 1."""
    beside = run([0.1 * step + 0.001 for step in range(11)])
    return Mentor.learn(recording, "distance").calibrate([beside] * 9, false_alarms=0.1)


@pytest.fixture
def asked() -> list[str]:
    return []


@pytest.fixture
def engine(mentor: Mentor, asked: list[str]) -> Any:
    names: dict[str, Any] = {}
    exec(text_of("AskingEngine"), names)
    return names["AskingEngine"](Engine(), mentor, asked.append)


def at(place: float) -> dict[str, Any]:
    return {"observation.state": np.array([place], np.float32)}


def test_the_page_shows_the_class_of_the_example() -> None:
    page = (ROOT / "docs" / "mentor.md").read_text(encoding="utf-8")
    assert f"```python\n{text_of('AskingEngine')}\n```" in page
    assert f"```python\n{text_of('ask_in')}\n```" in page


def test_actions_and_all_else_are_those_of_the_engine(engine: Any, asked: list[str]) -> None:
    engine.reset()
    assert engine.get_action(None) is None
    assert engine.get_action(at(0.5)).tolist() == pytest.approx([0.1])
    assert (engine.engine.resets, engine.ready, asked) == (1, True, [])


def test_it_asks_once_until_the_doubt_has_passed(engine: Any, asked: list[str]) -> None:
    """A person who resumes without a correction has waved the policy on."""
    engine.get_action(at(9.0))
    engine.reset()
    engine.get_action(at(9.1))
    assert len(asked) == 1
    engine.get_action(at(0.9))
    engine.get_action(at(9.2))
    assert [words.partition(":")[0] for words in asked] == ["distance"] * 2


def test_after_a_takeover_that_did_not_help_enough_it_asks_again(engine: Any, asked: list[str]) -> None:
    engine.get_action(at(9.0))
    engine.teach({"x": 9.0}, {"dx": -1.0})
    engine.reset()
    engine.get_action(at(8.0))
    assert len(asked) == 2


@pytest.mark.parametrize(("led", "helped"), [([0.2, 0.5, 0.8], 1), ([0.8, 0.5, 0.2], 0)])
def test_the_judge_sees_where_a_takeover_led(engine: Any, mentor: Mentor, led: list[float], helped: int) -> None:
    """The policy had stood still; where the cart stands after the pause is another episode's affair."""
    for place in [0.2] * 4:
        engine.get_action(at(place))
    for place in led:
        engine.teach({"x": place}, {"dx": 0.3})
    engine.reset()
    engine.get_action(at(0.0))
    assert (mentor.judge.judged, mentor.judge.helped) == (1, helped)
    engine.reset()
    engine.get_action(at(0.1))
    assert mentor.judge.judged == 1
