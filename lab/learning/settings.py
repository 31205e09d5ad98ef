"""The settings of a learner and of its gate, with the ranges that each may take."""

from dataclasses import dataclass, fields
from typing import Annotated, Any, get_type_hints

from annotated_types import Ge, Gt, Le

from lab.errors import BadInput


def _require_allowed(settings: Any) -> None:
    """Raises BadInput for the first field that has the wrong type or lies outside its annotated range."""
    hints = get_type_hints(type(settings), include_extras=True)
    for name in (field.name for field in fields(settings)):
        hint, value = hints[name], getattr(settings, name)
        kind = getattr(hint, "__origin__", hint)
        allowed_types = (int, float) if kind is float else (kind,)
        if isinstance(value, bool) or not isinstance(value, allowed_types):
            raise BadInput(f"{type(settings).__name__}.{name} = {value!r}: it must be {kind.__name__}")
        limits = getattr(hint, "__metadata__", ())
        if not all(_within(value, limit) for limit in limits):
            raise BadInput(f"{type(settings).__name__}.{name} = {value!r}: allowed {' and '.join(map(_words, limits))}")


def _within(value: Any, limit: Gt | Ge | Le) -> bool:
    if isinstance(limit, Gt):
        return bool(value > limit.gt)
    return bool(value >= limit.ge if isinstance(limit, Ge) else value <= limit.le)


def _words(limit: Gt | Ge | Le) -> str:
    if isinstance(limit, Gt):
        return f"above {limit.gt}"
    return f"at least {limit.ge}" if isinstance(limit, Ge) else f"at most {limit.le}"


@dataclass(frozen=True)
class LearnerSettings:
    """How a learner learns; the defaults are those of the thesis (sections 8.3 and 9.8).

    learner: a name in UPDATES; alpha: learning rate; discount: gamma; trace: lambda of Q(lambda); beta: the softmax
    temperature in episode n is n**-beta; episodes: session length N; max_steps: moves after which an episode is
    broken off.
    Raises BadInput for a value outside its range.
    """

    learner: str = "q-lambda"
    alpha: Annotated[float, Gt(0), Le(1)] = 0.95
    discount: Annotated[float, Gt(0), Le(1)] = 0.99
    trace: Annotated[float, Ge(0), Le(1)] = 0.5
    beta: Annotated[float, Ge(0), Le(100)] = 1.3
    episodes: Annotated[int, Ge(1), Le(1_000_000)] = 200
    max_steps: Annotated[int, Ge(1), Le(1_000_000)] = 200

    def __post_init__(self) -> None:
        _require_allowed(self)


@dataclass(frozen=True)
class GateSettings:
    """When a learner asks for advice and when it stops; the defaults are those of the thesis (chapter 6, section 9.3).

    gate: a name in GATES; lambda_threshold: Lambda, the improvement rate below which advice is requested; omega:
    Omega, the misleads that are tolerated; first_episode: X, the first episode that may ask; window: K, the
    episodes in a moving average; psi: Psi, the width below which the action values of a state leave the learner
    unsure (introspection).
    Raises BadInput for a value outside its range.
    """

    gate: str = "ccrl"
    lambda_threshold: Annotated[float, Ge(0), Le(1)] = 0.05
    omega: Annotated[int, Ge(0), Le(1_000_000)] = 7
    first_episode: Annotated[int, Ge(1), Le(1_000_000)] = 30
    window: Annotated[int, Ge(1), Le(100_000)] = 5
    psi: Annotated[float, Ge(0), Le(1_000_000)] = 1.0

    def __post_init__(self) -> None:
        _require_allowed(self)
