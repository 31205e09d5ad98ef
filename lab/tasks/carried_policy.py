"""Files of policies that carry over: what the features of a decision are worth, as JSON."""

import json
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from lab.errors import BadInput
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.tasks.record import Record, read_text, write_whole

FORMAT: Literal["carried-policy-1"] = "carried-policy-1"


class _Held(Record):
    """What such a file holds."""

    format: Literal["carried-policy-1"]
    weights: dict[str, float]
    objective: str = MAKESPAN
    learned_on: str = ""


def write_policy(path: Path, policy: CarriedPolicy) -> None:
    """Writes a policy whole or not at all: the same one always gives the same bytes. BadInput when it cannot be written."""
    held = _Held(format=FORMAT, weights=dict(policy.weights), objective=policy.objective, learned_on=policy.learned_on)
    write_whole(path, json.dumps(held.model_dump(), indent=1) + "\n")


def read_policy(path: Path, where: str = "--policy") -> CarriedPolicy:
    """The policy of a file; BadInput, in one line that names it, for one that cannot be read or is damaged."""
    text = read_text(path)
    try:
        held = _Held.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        at = ".".join(str(part) for part in first["loc"])[:60]
        raise BadInput(
            f"policy {path} ({where}): {f'{at}: ' if at else ''}{first['msg']}; wanted what lab study run carried-over writes"
        ) from None
    try:
        return CarriedPolicy(held.weights, held.objective, held.learned_on)
    except BadInput as error:
        raise BadInput(f"policy {path} ({where}): {error}") from None
