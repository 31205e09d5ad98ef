"""CMA-ES, an evolution strategy: a normal distribution of weights that moves, turns and stretches to where they cost less."""

from math import exp, sqrt

import numpy as np

from lab.sequencing.simulate.cell_arrays import Floats

LONGEST = 10.0  # the mean is scaled to this length, as weights of which only the direction matters would grow for ever


class Evolution:
    """A search over N weights whose length does not matter. mean (N,): the mean of its distribution.

    Candidates are drawn with the symmetric root of the covariance, which is unique; eigenvectors are not, as each library of
    linear algebra has its own signs. So a seed learns the same on every machine, as far as costs can be told apart.
    Source: Hansen 2016, The CMA evolution strategy: a tutorial, with its default settings.
    """

    def __init__(self, start: Floats, step: float, population: int, rng: np.random.Generator) -> None:
        n, parents = len(start), population // 2
        self.mean, self._step, self._size, self._rng = start.copy(), step, population, rng
        shares = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
        self._shares = shares / shares.sum()
        mass = float(1.0 / (self._shares**2).sum())
        self._mass = mass
        self._path_rate = (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n)
        self._step_rate = (mass + 2.0) / (n + mass + 5.0)
        self._one_rate = 2.0 / ((n + 1.3) ** 2 + mass)
        self._many_rate = min(1.0 - self._one_rate, 2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0) ** 2 + mass))
        self._damping = 1.0 + 2.0 * max(0.0, sqrt((mass - 1.0) / (n + 1.0)) - 1.0) + self._step_rate
        self._usual = sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
        self._spread, self._path, self._step_path = np.eye(n), np.zeros(n), np.zeros(n)
        self._root, self._inverse = np.eye(n), np.eye(n)  # the symmetric root of the covariance, and its inverse
        self._moves, self._generation = np.zeros((population, n)), 0

    def ask(self) -> Floats:
        """New candidates (population, N)."""
        lengths, axes = np.linalg.eigh(self._spread)
        lengths = np.sqrt(np.maximum(lengths, 1e-20))
        self._root, self._inverse = (axes * lengths) @ axes.T, (axes / lengths) @ axes.T
        self._moves = self._rng.standard_normal((self._size, len(self.mean))) @ self._root
        return np.asarray(self.mean + self._step * self._moves)

    def tell(self, costs: Floats) -> None:
        """Move the distribution by the costs (population,) of the last candidates."""
        best = np.argsort(costs, kind="stable")[: len(self._shares)]
        move = self._shares @ self._moves[best]
        self._generation += 1
        self.mean = self.mean + self._step * move
        keep = 1.0 - self._step_rate
        self._step_path = (
            keep * self._step_path + sqrt(self._step_rate * (2.0 - self._step_rate) * self._mass) * self._inverse @ move
        )
        length = float(np.linalg.norm(self._step_path))
        usual = self._usual * sqrt(1.0 - keep ** (2 * self._generation))
        steady = length / usual < 1.4 + 2.0 / (len(self.mean) + 1.0)
        rate = self._path_rate
        self._path = (1.0 - rate) * self._path + (sqrt(rate * (2.0 - rate) * self._mass) * move if steady else 0.0)
        self._spread = (
            (1.0 - self._one_rate - self._many_rate) * self._spread
            + self._one_rate * np.outer(self._path, self._path)
            + self._many_rate * (self._moves[best].T * self._shares) @ self._moves[best]
        )
        self._step *= exp(min(1.0, self._step_rate / self._damping * (length / self._usual - 1.0)))
        norm = float(np.linalg.norm(self.mean))
        if norm > LONGEST:
            self.mean, self._step = self.mean * (LONGEST / norm), self._step * (LONGEST / norm)
