"""The settings of a learner and of its gate, with the ranges that each may take."""

from dataclasses import asdict, dataclass
from functools import cache
from typing import Annotated, Any, get_type_hints

from annotated_types import Ge, Gt, Le

from lab.errors import BadInput

COMPARE_WINDOWS = ("ccrl", "combined")
WORDS = {"gt": "above", "ge": "at least", "le": "at most"}


@cache
def _checked(kind: type) -> Any:
    """The pydantic model with the fields of a class of settings."""
    from pydantic import ConfigDict, create_model

    fields: dict[str, Any] = {name: (hint, ...) for name, hint in get_type_hints(kind, include_extras=True).items()}
    return create_model(kind.__name__, __config__=ConfigDict(strict=True), **fields)


def _require_allowed(settings: Any) -> None:
    """Raises BadInput for the first field that has the wrong type or lies outside its annotated range; numbers become plain."""
    from pydantic import ValidationError

    kind: Any = type(settings)
    model = _checked(kind)
    try:
        vars(settings).update(vars(model.model_validate(vars(settings))))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = model.model_fields[first["loc"][0]]
        limits = [f"{WORDS[name]} {value}" for limit in field.metadata for name, value in asdict(limit).items()]
        is_type = first["type"].endswith("_type")
        allowed = f"it must be {field.annotation.__name__}" if is_type else f"allowed {' and '.join(limits)}"
        raise BadInput(f"{model.__name__}.{first['loc'][0]} = {first['input']!r}: {allowed}") from None


@dataclass(frozen=True)
class LearnerSettings:
    """How a learner learns; the defaults are those of the thesis (sections 8.3 and 9.8).

    learner: a name in UPDATES; alpha: learning rate; discount: gamma; trace: lambda of the learners with traces;
    replacing: a trace is set to 1 on each visit instead of growing by 1; planning: how many earlier moves "dyna-q" learns
    from again after each one; selection: a name in SELECTIONS; in episode n
    its temperature (or epsilon) is exploration * n**-beta, constant with beta 0; episodes: session length N;
    max_steps: steps after which an episode is broken off; count_start: the start counts as a step, as in the thesis's
    listing, so that a way of 12 moves has 13 steps.
    Raises BadInput for a value outside its range.
    """

    learner: str = "q-lambda"
    alpha: Annotated[float, Gt(0), Le(1)] = 0.95
    discount: Annotated[float, Gt(0), Le(1)] = 0.99
    trace: Annotated[float, Ge(0), Le(1)] = 0.5
    replacing: bool = False
    planning: Annotated[int, Ge(0), Le(1000)] = 5
    selection: str = "softmax"
    exploration: Annotated[float, Gt(0), Le(1_000_000)] = 1.0
    beta: Annotated[float, Ge(0), Le(100)] = 1.3
    episodes: Annotated[int, Ge(1), Le(1_000_000)] = 200
    max_steps: Annotated[int, Ge(1), Le(1_000_000)] = 200
    count_start: bool = False

    def __post_init__(self) -> None:
        _require_allowed(self)


@dataclass(frozen=True)
class GateSettings:
    """When a learner asks for advice and when it stops; the defaults are those of the thesis (chapter 6, section 9.3).

    gate: a name in GATES; lambda_threshold: Lambda, the improvement rate below which advice is requested; omega:
    Omega, the misleads that are tolerated; first_episode: X, the first episode that may ask; window: K, the
    episodes in a moving average; psi: Psi, a width of action values that "ia", "combined" and "importance" compare
    with; spread: the deviation of its tables that lets "uncertainty" ask; rate: the share of steps that "random" asks
    for; enough_steps: the mean step count that satisfies "cq"; ensemble: the tables of "uncertainty"; budget: the
    helped steps that any gate may use in a session; judge_unhelped: an episode that was open for advice and got none,
    as in a limited view, is judged too (the listing), or not (the text's words); spare_best: an episode that is as good
    as the best so far is no mislead, though it is not better than those before; the default is as printed, lessons and
    runs set it (see lab/tasks/record.py); memory: what was shown, or found alone, is remembered and practised without
    asking again (see lab/learning/advice_memory.py).
    Raises BadInput for a value outside its range, or for X < 2K with a gate that compares moving averages.
    """

    gate: str = "ccrl"
    lambda_threshold: Annotated[float, Ge(0), Le(1)] = 0.05
    omega: Annotated[int, Ge(0), Le(1_000_000)] = 7
    first_episode: Annotated[int, Ge(1), Le(1_000_000)] = 30
    window: Annotated[int, Ge(1), Le(100_000)] = 5
    psi: Annotated[float, Ge(0), Le(1_000_000)] = 1.0
    spread: Annotated[float, Ge(0), Le(1_000_000)] = 0.1
    rate: Annotated[float, Ge(0), Le(1)] = 0.1
    enough_steps: Annotated[float, Gt(0), Le(1_000_000)] = 50.0
    ensemble: Annotated[int, Ge(2), Le(100)] = 5
    budget: Annotated[int, Ge(0), Le(1_000_000_000)] = 1_000_000_000
    judge_unhelped: bool = True
    spare_best: bool = False
    memory: bool = False

    def __post_init__(self) -> None:
        _require_allowed(self)
        if self.gate in COMPARE_WINDOWS and self.first_episode < 2 * self.window:
            raise BadInput(
                f"GateSettings.first_episode = {self.first_episode}: the gate '{self.gate}' compares two windows of "
                f"{self.window} episodes: allowed at least {2 * self.window}"
            )
