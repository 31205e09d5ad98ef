"""What the tests of commands stand on: an empty folder with a toolbox of its own, and a small policy."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid
from lab.toolbox.policy import Origin, Policy


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to run in, with a toolbox of its own that is not there yet."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


@pytest.fixture(scope="session")
def toml(root: Path) -> str:
    return (root / "tasks" / "toast.toml").read_text(encoding="utf-8")


@pytest.fixture
def tree() -> Callable[[Path], list[str]]:
    """All that a folder holds, by path."""

    return lambda folder: sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.fixture
def policy() -> Callable[..., Policy]:
    """Makes a policy of that name."""
    return made


def made(name: str = "insert at toaster 12345678") -> Policy:
    mdp = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))
    learner, gate = LearnerSettings(episodes=8, max_steps=20), GateSettings()
    result = Session(mdp, learner, gate, None, np.random.default_rng(0)).run()
    return Policy.of(result, mdp, learner, gate, Origin(name, "insert", "toast", "none", 0))
