"""Mentors as safetensors files: arrays, and what is known of them as JSON; a damaged or foreign file is never read."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from lab.errors import BadInput, shortened
from lab.files import json_of
from lab.mentor.conformal import Promise
from lab.mentor.demonstrated import Array, Demonstrated
from lab.mentor.doubts import DOUBTS, Doubt
from lab.toolbox.policy_file import header_of, ordered

FORMAT = "teaching-lab mentor 1"
_LOOKED_UP = ("middle", "scale", "states", "actions", "left", "action_scale")
_OWN = "rule/"  # precedes the names of the rule's own arrays


@dataclass(frozen=True)
class Kept:
    """What a file says of a mentor, beside its arrays; a threshold may be infinite."""

    rule: str
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    threshold: float
    promise: Promise | None


def encode(kept: Kept, demonstrated: Demonstrated, arrays: Mapping[str, Array]) -> bytes:
    """The bytes of a mentor's file; the same mentor always gives the same bytes."""
    tensors = {name: getattr(demonstrated, name) for name in _LOOKED_UP}
    tensors |= {f"{_OWN}{name}": array for name, array in arrays.items()}
    promise = None if kept.promise is None else _as_text(asdict(kept.promise))
    said = {
        "rule": kept.rule,
        "state_names": kept.state_names,
        "action_names": kept.action_names,
        "threshold": float(kept.threshold).hex(),
        "promise": promise,
    }
    contiguous = {name: np.ascontiguousarray(array, np.float64) for name, array in tensors.items()}
    return ordered(save(contiguous, {"format": FORMAT, "mentor": json.dumps(said, allow_nan=False)}))


def decode(content: bytes, where: str, own: type[Doubt] | None = None) -> tuple[Kept, Demonstrated, dict[str, Array]]:
    """What a file holds, completely checked; own: its rule, if that is not known yet.

    Raises BadInput, which names the file `where`, if anything is wrong.
    """
    try:
        kept, looked_up, arrays = _read(content)
    except (SafetensorError, ValueError, TypeError, KeyError, RecursionError, MemoryError, BadInput) as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise BadInput(f"mentor file {where}: {why}: wanted one that `Mentor.save` wrote") from error
    if own is not None and kept.rule not in DOUBTS:
        DOUBTS.use(kept.rule, own)
    if kept.rule not in DOUBTS:
        raise BadInput(
            f"mentor file {where}: its rule '{shortened(kept.rule)}' is not known here: give its class, "
            "Mentor.load(path, MyRule), or name its file, --rule ./mine.py:MyRule"
        )
    return kept, looked_up, arrays


def _read(content: bytes) -> tuple[Kept, Demonstrated, dict[str, Array]]:
    tensors = load(content)
    metadata = header_of(content).get("__metadata__") or {}
    if metadata.get("format") != FORMAT:
        raise ValueError(f"format {metadata.get('format')!r}")
    said: dict[str, Any] = json_of(metadata["mentor"])
    for name, array in tensors.items():
        if array.dtype != np.float64 or not np.isfinite(array).all():
            raise ValueError(f"{name} holds other than finite numbers of 64 bits")
    looked_up = Demonstrated(*(tensors[name] for name in _LOOKED_UP))
    arrays = {name.removeprefix(_OWN): array for name, array in tensors.items() if name.startswith(_OWN)}
    rule, states, actions = said["rule"], _names(said["state_names"]), _names(said["action_names"])
    if not isinstance(rule, str):
        raise ValueError(f"rule {rule!r}")
    _check_shapes(looked_up, len(states), len(actions))
    promise = None if said["promise"] is None else Promise(**_from_text(said["promise"]))
    return Kept(rule, states, actions, float.fromhex(said["threshold"]), promise), looked_up, arrays


def _check_shapes(looked_up: Demonstrated, states: int, actions: int) -> None:
    n = len(looked_up.left)
    wanted = ((states,), (states,), (n, states), (n, actions), (n,), (actions,))
    for name, shape in zip(_LOOKED_UP, wanted, strict=True):
        if getattr(looked_up, name).shape != shape or not n:
            raise ValueError(f"{name} has the shape {getattr(looked_up, name).shape}, not {shape}")
    if looked_up.scale.min() <= 0.0 or looked_up.action_scale.min() <= 0.0:
        raise ValueError("a scale is not above 0")


def _names(given: Any) -> tuple[str, ...]:
    if not (isinstance(given, list) and given and all(isinstance(name, str) for name in given)):
        raise ValueError(f"names {given!r}")
    return tuple(given)


def _as_text(promise: dict[str, Any]) -> dict[str, Any]:
    return {name: value.hex() if isinstance(value, float) else value for name, value in promise.items()}


def _from_text(promise: dict[str, Any]) -> dict[str, Any]:
    reals = ("share", "threshold", "expected", "in_95")
    return {name: float.fromhex(value) if name in reals else value for name, value in promise.items()}
