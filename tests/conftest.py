"""What every test stands on: its own toolbox folder, and hypothesis without a clock."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("lab", deadline=None, derandomize=bool(os.environ.get("CI")), max_examples=50)
settings.load_profile("lab")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session", autouse=True)
def _own_toolbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test reads or writes the user's own toolbox."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LAB_TOOLBOX", str(tmp_path_factory.mktemp("toolbox")))
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout's folder."""
    return ROOT
