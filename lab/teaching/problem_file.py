"""A problem as a safetensors file, from which a session can be replayed where the code that made it is not there."""

import json
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from lab.errors import BadInput
from lab.files import json_of
from lab.learning.problem import Problem
from lab.mdp import TabularMDP

FORMAT = "teaching-lab-problem-1"
MOST_BYTES = 32 << 20
MOST_NAME = 1000  # characters
_TABLES = {"successor": np.int32, "reward": np.float64, "terminal": np.uint8, "goal": np.uint8}
_WORDS = ("name", "subtask", "start", "starts", "action_labels", "shape", "coverage_shape")


def encode(problem: Problem) -> bytes | None:
    """The bytes of a problem's file; None for one whose steps are made by code, and for one that is larger than MOST_BYTES."""
    mdp = problem.mdp
    if problem.environment is not None or type(mdp) is not TabularMDP:
        return None
    if 13 * mdp.n_states * mdp.n_actions > MOST_BYTES:
        return None
    tables = {name: np.ascontiguousarray(getattr(mdp, name), kind) for name, kind in _TABLES.items()}
    words = {name: getattr(problem if name in ("name", "subtask") else mdp, name) for name in _WORDS}
    metadata = {name: json.dumps(value, default=int) for name, value in words.items()}
    return bytes(save(tables, {"format": FORMAT} | metadata))


def decode(content: bytes, where: str) -> Problem:
    """The problem in these bytes. Raises BadInput, which begins with `where`, if anything is wrong."""
    try:
        length = int.from_bytes(content[:8], "little")
        metadata = json_of(content[8 : 8 + length])["__metadata__"]
        if metadata["format"] != FORMAT:
            raise ValueError(f"format {metadata['format']!r}, allowed '{FORMAT}'")
        held: dict[str, Any] = {name: json_of(metadata[name]) for name in _WORDS}
        tables: dict[str, Any] = load(content)
        for name, table in tables.items():
            if name not in _TABLES or table.dtype != _TABLES[name]:
                raise ValueError(f"it holds '{name}' of type {table.dtype}")
        words = [held["name"], held["subtask"], *held["action_labels"]]
        if not all(isinstance(word, str) and word.isprintable() and len(word) <= MOST_NAME for word in words):
            raise ValueError(f"its names are no text of up to {MOST_NAME} printable characters")
        axes: dict[str, Any] = {
            name: tuple(held[name]) for name in ("starts", "action_labels", "shape", "coverage_shape")
        }
        return Problem(held["name"], held["subtask"], TabularMDP(**tables, start=held["start"], **axes))
    except (
        BadInput,
        SafetensorError,
        ValueError,
        TypeError,
        KeyError,
        AttributeError,
        OverflowError,
        MemoryError,
    ) as error:
        raise BadInput(f"{where}: {' '.join(str(error).split())[:160] or type(error).__name__}") from None
