"""The settings of sequencing in a file, the search that they describe, and files of carried-over policies."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from lab.errors import BadInput, unknown
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import MAKESPAN, OBJECTIVES, WITH_DUE_TIMES
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.search import Search, SrlSettings
from lab.tasks.record import Record, read_text, write_whole

FORMAT: Literal["carried-policy-1"] = "carried-policy-1"


class _Held(Record):
    """The content of a policy file."""

    format: Literal["carried-policy-1"]
    weights: dict[str, float]
    objective: str = MAKESPAN
    learned_on: str = ""


def policy_record(policy: CarriedPolicy) -> dict[str, Any]:
    """The JSON form of a policy."""
    held = _Held(format=FORMAT, weights=dict(policy.weights), objective=policy.objective, learned_on=policy.learned_on)
    return held.model_dump()


def write_policy(path: Path, policy: CarriedPolicy) -> None:
    """Writes a policy to a file, whole or not at all, equal policies with equal bytes; raises BadInput when it cannot."""
    write_whole(path, json.dumps(policy_record(policy), indent=1) + "\n")


def read_policy(path: Path, where: str = "--policy") -> CarriedPolicy:
    """The policy in a file; raises BadInput, in one line that names the file, when it cannot be read or is damaged."""
    return policy_of(read_text(path), f"policy {path} ({where})")


def policy_of(text: str, whose: str) -> CarriedPolicy:
    """The policy in a JSON text; raises BadInput, in one line that begins with `whose`, when it holds none."""
    try:
        held = _Held.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        at = ".".join(str(part) for part in first["loc"])[:60]
        wanted = "wanted what lab study run carried-over or --keep-policy writes"
        raise BadInput(f"{whose}: {f'{at}: ' if at else ''}{first['msg']}; {wanted}") from None
    try:
        return CarriedPolicy(held.weights, held.objective, held.learned_on)
    except BadInput as error:
        raise BadInput(f"{whose}: {error}") from None


# ---- The settings of sequencing ---------------------------------------------------------------------------------------


class Sequencing(Record):
    """The search for the order of the robot's transfers, and its objective."""

    method: str = "srl-time"
    """The method that finds the order: a name that `lab sequence --help` lists."""
    episodes: Annotated[int, Field(ge=1, le=1_000_000)] = 400
    """The number of sequences that are tried."""
    alpha: Annotated[float, Field(gt=0, le=1)] = 0.05
    """The learning rate of srl and mc [-]."""
    discount: Annotated[float, Field(gt=0, le=1)] = 0.9
    """The discount factor of srl: the weight of the next step, compared with this one [-]."""
    beta: Annotated[float, Field(ge=0, le=100)] = 1.0
    """The decay of srl's exploration, whose probability in episode n is n**-beta [-]."""
    reward_factor: Literal["A", "B"] = "B"
    """The thesis's reward factor, A or B, that srl uses."""
    objective: str = MAKESPAN
    """The objective that is minimised: a name that `lab sequence --help` lists."""
    values: Literal["pairs", "states"] = "pairs"
    """The arguments of srl's values: pairs of a state and an action (figure 5.1), or afterstates (the listings)."""
    state: Literal["parts", "stations"] = "parts"
    """The state of srl: the position of each part, or the parts at each station (thesis, appendix III)."""

    def settings(self) -> SrlSettings:
        """The parameters of SRL and Monte Carlo."""
        return SrlSettings(self.alpha, self.discount, self.beta, self.reward_factor, self.values, self.state)

    def faults(self, due: bool) -> Iterator[tuple[str, BadInput]]:
        """The fields with an unknown name, or with an objective that needs due times without `due`; each with its error."""
        if self.method not in SEQUENCERS:
            yield "method", unknown("method", self.method, SEQUENCERS, "sequencing.method")
        if self.objective not in OBJECTIVES:
            yield "objective", unknown("objective", self.objective, OBJECTIVES, "sequencing.objective")
        elif self.objective in WITH_DUE_TIMES and not due:
            yield "objective", BadInput(f"sequencing.objective '{self.objective}' needs due times, and there are none")


def search_for(
    settings: Sequencing, *, episodes: int | None = None, objective: str | None = None, chance: Chance = NO_CHANCE
) -> Search:
    """The search that a file's settings describe; arguments that are given override them."""
    return Search(episodes or settings.episodes, objective or settings.objective, chance, settings.settings())
