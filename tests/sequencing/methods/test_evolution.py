"""CMA-ES, where only the direction of the weights matters."""

import numpy as np
import pytest

from lab.sequencing.methods.evolution import LONGEST, Evolution
from lab.sequencing.simulate.cell_arrays import Floats

WANTED = np.array([3.0, -4.0, 0.0, 1.0]) / np.sqrt(26.0)


def searched(generations: int, seed: int, start: Floats) -> Evolution:
    evolution = Evolution(start, 0.3, 12, np.random.default_rng(seed))
    for _ in range(generations):
        candidates = evolution.ask()
        evolution.tell(-(candidates @ WANTED) / np.linalg.norm(candidates, axis=1))
    return evolution


@pytest.mark.parametrize("seed", range(5))
def test_it_turns_to_where_it_costs_least(seed: int) -> None:
    """It begins the opposite way."""
    mean = searched(150, seed, -WANTED).mean
    assert mean @ WANTED / np.linalg.norm(mean) > 0.999
    assert np.linalg.norm(mean) <= LONGEST + 1e-9


def test_a_valley_that_is_a_thousand_times_longer_than_wide() -> None:
    """The spread becomes as long as the valley: the plain mean of the best would need thousands of steps."""
    evolution = Evolution(np.array([5.0, 5.0, 1.0]), 1.0, 12, np.random.default_rng(0))
    for _ in range(200):
        x = evolution.ask()
        evolution.tell(x[:, 0] ** 2 + 1e6 * x[:, 1] ** 2 + (x[:, 2] - 1.0) ** 2)
    assert evolution.mean == pytest.approx([0.0, 0.0, 1.0], abs=1e-4)


def test_the_generator_decides() -> None:
    start = np.ones(4)
    assert searched(9, 1, start).mean.tolist() == searched(9, 1, start).mean.tolist()
    assert searched(9, 1, start).mean.tolist() != searched(9, 2, start).mean.tolist()
    assert start.tolist() == [1.0] * 4


def test_the_signs_of_eigenvectors_decide_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each linear algebra library has its own: with all turned round the search goes the same way."""
    start, eigh = np.ones(4), np.linalg.eigh
    mean = searched(40, 3, start).mean

    def turned(matrix: Floats) -> tuple[Floats, Floats]:
        values, vectors = eigh(matrix)
        return values, -vectors

    monkeypatch.setattr(np.linalg, "eigh", turned)
    np.testing.assert_allclose(searched(40, 3, start).mean, mean, rtol=1e-6)
