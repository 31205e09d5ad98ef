"""`Student`: a small policy that is cloned from demonstrations and corrections (behaviour cloning, by scikit-learn)."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from lab.errors import BadInput
from lab.files import json_of, read_limited, write_whole
from lab.lazy import sklearn, threadpoolctl
from lab.mentor.demonstrated import shows_what_to_do
from lab.optional import require
from lab.recordings.episode import Episode, Recording
from lab.toolbox.policy_file import header_of, ordered

FORMAT = "teaching-lab student 1"
MOST_BYTES = 50_000_000  # of a student's file
NETWORKS = 3  # whose mean it is; one alone depends much on its seed
HIDDEN = (128, 128)  # units of their layers
CHUNK = 4  # actions that it plans at each step
EPOCHS, BATCH = 400, 256
_STILL = 1e-6  # standard deviation below which a number is the same in all steps

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Student:
    """The mean of m multilayer perceptrons (ReLU), from a state (d,) to a chunk of actions (h, k); a call returns the first (k,).

    middle, scale (d,): of the states; weights (m, i, o), biases (m, o): of each layer; chunk: h. Acting takes NumPy alone,
    learning scikit-learn.
    """

    middle: Array
    scale: Array
    weights: Sequence[Array]
    biases: Sequence[Array]
    chunk: int = CHUNK

    @classmethod
    def learn(
        cls,
        demonstrations: Recording,
        corrections: Iterable[Episode] = (),
        *,
        seed: int = 0,
        epochs: int = EPOCHS,
    ) -> Self:
        """A student of all steps of the demonstrations that did not fail, and of the corrected steps of other episodes.

        The same seed and data give the same student. Raises BadInput without scikit-learn, and if there is no step to learn from.
        """
        require("a student", sklearn, threadpoolctl)
        shown = [(episode, shows_what_to_do(episode)) for episode in demonstrations.episodes]
        states, chunks = _pairs([*shown, *((episode, episode.corrected) for episode in corrections)])
        if not len(states):
            raise BadInput("student: no step of a demonstration that did not fail: wanted one or more")
        middle, spread = states.mean(axis=0), states.std(axis=0)
        scale = np.where(spread > _STILL, spread, 1.0)
        inputs = ((states - middle) / scale).astype(np.float32)
        targets = chunks.reshape(len(chunks), -1).astype(np.float32)
        with threadpoolctl.threadpool_limits(1):  # the same sums on any number of cores
            networks = [_network(inputs, targets, [seed, number], epochs) for number in range(NETWORKS)]
        layers = [np.stack(layer) for layer in zip(*networks, strict=True)]
        return cls(middle, scale, layers[: len(HIDDEN) + 1], layers[len(HIDDEN) + 1 :])

    @property
    def widths(self) -> tuple[int, int]:
        """How many numbers a state has, and an action."""
        return len(self.middle), self.biases[-1].shape[1] // self.chunk

    def plan(self, states: Any) -> Array:
        """The actions (..., h, k) that it would take from states (..., d) on."""
        states = np.asarray(states, np.float64)
        values = (states.reshape(-1, len(self.middle)) - self.middle) / self.scale
        for layer, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = values @ weights + biases[:, None]  # (m, n, o)
            if layer < len(self.weights) - 1:
                values = np.maximum(values, 0.0)
        return np.asarray(values.mean(axis=0).reshape(*states.shape[:-1], self.chunk, -1))

    def __call__(self, state: Any) -> NDArray[np.float32]:
        """The action (k,) in a state (d,), each number from -1 to 1."""
        return np.asarray(np.clip(self.plan(state)[0], -1.0, 1.0), np.float32)

    def planned(self, episode: Episode) -> Episode:
        """The episode with what this student would have planned at each step, for a mentor, as its extra feature "chunk"."""
        return replace(episode, extra={**episode.extra, "chunk": self.plan(episode.states)})

    def save(self, path: Path | str) -> None:
        """Writes the student to a safetensors file, whole or not at all. Raises OSError."""
        tensors = {"middle": self.middle, "scale": self.scale}
        for number, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            tensors |= {f"weights {number}": weights, f"biases {number}": biases}
        said = json.dumps({"chunk": self.chunk, "layers": len(self.weights)})
        content = save(
            {name: np.ascontiguousarray(a) for name, a in tensors.items()}, {"format": FORMAT, "student": said}
        )
        write_whole(Path(path), ordered(content))

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """The student in a file. Raises BadInput, which names the file, if it cannot be read or holds anything else."""
        try:
            return cls._read(read_limited(Path(path), MOST_BYTES))
        except (OSError, SafetensorError, ValueError, TypeError, KeyError, RecursionError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise BadInput(f"student file '{path}': {why}: wanted one that `Student.save` wrote") from error

    @classmethod
    def _read(cls, content: bytes) -> Self:
        tensors = load(content)
        metadata = header_of(content).get("__metadata__") or {}
        if metadata.get("format") != FORMAT:
            raise ValueError(f"format {metadata.get('format')!r}")
        said = json_of(metadata["student"])
        layers, chunk = int(said["layers"]), int(said["chunk"])
        if not 1 <= layers <= len(tensors):
            raise ValueError(f"layers {layers}")
        for name, array in tensors.items():
            if array.dtype != np.float64 or not np.isfinite(array).all():
                raise ValueError(f"{name} holds other than finite numbers of 64 bits")
        student = cls(
            tensors["middle"],
            tensors["scale"],
            [tensors[f"weights {number}"] for number in range(layers)],
            [tensors[f"biases {number}"] for number in range(layers)],
            chunk,
        )
        if any(array.ndim != 3 for array in student.weights) or any(array.ndim != 2 for array in student.biases):
            raise ValueError("weights other than of three axes, or biases other than of two")
        student(np.zeros(len(student.middle)))  # shapes that do not fit raise ValueError
        return student


def _network(inputs: Any, targets: Any, seed: Sequence[int], epochs: int) -> list[Array]:
    """The weights of each layer of a network that learned, then the biases: their means over the last half of the epochs.

    Averaging evens out what the last steps of a constant rate leave to chance (Izmailov and others 2018, "Averaging Weights
    Leads to Wider Optima and Better Generalization").
    """
    rng = np.random.default_rng(seed)
    network = sklearn.neural_network.MLPRegressor(
        hidden_layer_sizes=HIDDEN, batch_size=min(BATCH, len(inputs)), random_state=int(rng.integers(2**31))
    )
    first = epochs // 2
    means: list[Array] = []
    for epoch in range(epochs):
        network.partial_fit(inputs, targets)
        if epoch >= first:
            now = [array.astype(np.float64) for array in (*network.coefs_, *network.intercepts_)]
            means = [mean + (array - mean) / (epoch - first + 1) for mean, array in zip(means or now, now, strict=True)]
    return means


def _pairs(shown: Iterable[tuple[Episode, NDArray[np.bool_]]]) -> tuple[Array, Array]:
    """The states (n, d) of the steps (n,) that are shown, and the CHUNK actions (n, h, k) from each on.

    A chunk that runs over the end of a stretch of such steps repeats its last action.
    """
    states, chunks = [np.empty((0, 0))], [np.empty((0, CHUNK, 0))]
    for episode, marked in shown:
        steps = np.flatnonzero(marked)
        if not len(steps):
            continue
        last = steps[np.append(np.flatnonzero(np.diff(steps) > 1), len(steps) - 1)]  # of each stretch
        end = last[np.searchsorted(last, steps)]
        planned = np.minimum(steps[:, None] + np.arange(CHUNK), end[:, None])
        states.append(episode.states[steps].astype(np.float64))
        chunks.append(episode.actions[planned].astype(np.float64))
    return np.concatenate(states[1:] or states), np.concatenate(chunks[1:] or chunks)
