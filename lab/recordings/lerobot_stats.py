"""The statistics that LeRobot's training reads: least, most, mean, deviation and quantiles of each number of a feature."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.recordings.episode import Image

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
LEVELS, LONGEST = 256, 300  # of a colour; the longer edge [pixels] from which on a picture's pixels are thinned

Statistics = dict[str, Any]  # lists of numbers by "min", "max", "mean", "std", "count" and the names of QUANTILES


def number_statistics(values: NDArray[Any]) -> Statistics:
    """The statistics of values (n, ...) over the n steps; a feature of one number has lists of one."""
    rows = np.asarray(values, np.float64).reshape(len(values), *(values.shape[1:] or (1,)))
    quantiles = np.quantile(rows, list(QUANTILES.values()), axis=0)
    return {
        "min": rows.min(axis=0).tolist(),
        "max": rows.max(axis=0).tolist(),
        "mean": rows.mean(axis=0).tolist(),
        "std": rows.std(axis=0).tolist(),
        "count": [len(rows)],
        **dict(zip(QUANTILES, quantiles.tolist(), strict=True)),
    }


class PictureStatistics:
    """The statistics of pictures, by colour and from 0 to 1: of every picture, from counts of the 256 levels."""

    def __init__(self) -> None:
        """No picture yet."""
        self.pictures, self.counts = 0, np.zeros((3, LEVELS), np.int64)

    def add(self, picture: Image) -> None:
        """Counts the pixels of a picture (height, width, 3); of a large one each second, third and so on."""
        every = max(1, 2 * max(picture.shape[:2]) // LONGEST)
        for colour in range(3):
            self.counts[colour] += np.bincount(picture[::every, ::every, colour].ravel(), minlength=LEVELS)
        self.pictures += 1

    def merge(self, other: "PictureStatistics") -> None:
        """Adds the counts of other pictures."""
        self.pictures += other.pictures
        self.counts += other.counts

    def statistics(self) -> Statistics:
        """Their statistics, each of shape (3, 1, 1); count: the number of pictures."""
        levels, shares = np.arange(LEVELS) / (LEVELS - 1), self.counts / self.counts.sum(axis=1, keepdims=True)
        means, reached = shares @ levels, np.cumsum(shares, axis=1)
        there = self.counts > 0
        rows = {
            "min": levels[there.argmax(axis=1)],
            "max": levels[LEVELS - 1 - there[:, ::-1].argmax(axis=1)],
            "mean": means,
            "std": np.sqrt(np.maximum(shares @ levels**2 - means**2, 0.0)),
            **{name: levels[(reached >= q - 1e-12).argmax(axis=1)] for name, q in QUANTILES.items()},
        }
        return {name: row[:, None, None].tolist() for name, row in rows.items()} | {"count": [self.pictures]}
