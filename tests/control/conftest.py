"""Environments that the tests of this room share: each skill is surveyed once."""

from collections.abc import Iterator

import pytest

from lab.control import ControlEnv


@pytest.fixture(scope="package")
def grasp() -> Iterator[ControlEnv]:
    env = ControlEnv(skill="grasp at plate")
    yield env
    env.close()
