"""The settings of a learner and of its gate, with the ranges that each may take."""

from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import Annotated, Any, NamedTuple, get_type_hints

from annotated_types import DocInfo, Ge, Gt, Le, Lt, doc

from lab.errors import LIMITS, BadInput
from lab.lazy import pydantic

COMPARE_WINDOWS = ("ccrl", "combined")


@cache
def _checked(kind: type) -> Any:
    """A strict pydantic model with the fields of a settings class."""
    fields: dict[str, Any] = {name: (hint, ...) for name, hint in get_type_hints(kind, include_extras=True).items()}
    return pydantic.create_model(kind.__name__, __config__=pydantic.ConfigDict(strict=True), **fields)


def _require_allowed(settings: Any) -> None:
    """Raises BadInput for the first field of a wrong type or outside its range; converts numpy numbers to plain ones."""
    kind: Any = type(settings)
    model = _checked(kind)
    try:
        vars(settings).update(vars(model.model_validate(vars(settings))))
    except pydantic.ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = model.model_fields[first["loc"][0]]
        limits = _limits(field.metadata)
        is_type = first["type"].endswith("_type")
        allowed = f"it must be {field.annotation.__name__}" if is_type else f"allowed {' and '.join(limits)}"
        raise BadInput(f"{model.__name__}.{first['loc'][0]} = {first['input']!r}: {allowed}") from None


def _limits(metadata: "list[Any] | tuple[Any, ...]") -> list[str]:
    """The limits of a field in words, such as "at least 0"."""
    limits = (limit for limit in metadata if not isinstance(limit, DocInfo))
    return [f"{LIMITS[name]} {value}" for limit in limits for name, value in asdict(limit).items()]


@dataclass(frozen=True)
class LearnerSettings:
    """The settings of a learner; the defaults are those of the thesis (sections 8.3 and 9.8).

    In episode n the temperature (or epsilon) is exploration * n**-beta, which is constant for beta 0.
    Raises BadInput for a value outside its range.
    """

    learner: Annotated[str, doc("the update rule, by name")] = "q-lambda"
    alpha: Annotated[float, Gt(0), Le(1), doc("learning rate")] = 0.95
    discount: Annotated[float, Gt(0), Le(1), doc("gamma: the weight of the next step, compared with this one")] = 0.99
    trace: Annotated[float, Ge(0), Le(1), doc("lambda: the decay of traces, for learners that have them")] = 0.5
    replacing: Annotated[bool, doc("a trace is set to 1 on each visit instead of growing by 1")] = False
    tilings: Annotated[
        int,
        Ge(1),
        Le(64),
        doc("tile coding: the number of shifted grids of tiles, and the width of a tile in cells; 1: a table"),
    ] = 1
    start_value: Annotated[
        float,
        Ge(-1_000_000),
        Le(1_000_000),
        doc("initial value of every action: optimistic values, above the true ones, explore; pessimistic ones exploit"),
    ] = 0.0
    planning: Annotated[int, Ge(0), Le(1000), doc("number of earlier moves that dyna-q replays after each move")] = 5
    selection: Annotated[str, doc("the rule by which actions are chosen, by name")] = "softmax"
    exploration: Annotated[float, Gt(0), Le(1_000_000), doc("temperature, or epsilon, of the first episode")] = 1.0
    beta: Annotated[float, Ge(0), Le(100), doc("decay: in episode n it explores by exploration * n**-beta")] = 1.3
    episodes: Annotated[int, Ge(1), Le(1_000_000), doc("session length N")] = 200
    max_steps: Annotated[int, Ge(1), Le(1_000_000), doc("steps after which an episode is truncated")] = 200
    count_start: Annotated[
        bool, doc("the start counts as a step, as in the thesis's listing: a path of 12 moves has 13 steps")
    ] = False

    def __post_init__(self) -> None:
        _require_allowed(self)


@dataclass(frozen=True)
class GateSettings:
    """The settings of a gate: when a learner asks and when it stops; defaults: thesis, chapter 6 and section 9.3.

    spare_best is off as in the thesis; lessons and runs switch it on (lab/tasks/record.py). by_evidence:
    lab/learning/gates/gate.py, `evidence`; it is off as in the thesis, and on in the task files that ship. memory:
    lab/learning/advice_memory.py.
    Raises BadInput for a value outside its range, or for X < 2K with a gate that compares moving averages.
    """

    gate: Annotated[str, doc("the rule by which the learner asks, by name")] = "ccrl"
    lambda_threshold: Annotated[
        float, Ge(0), Le(1), doc("Lambda: the improvement below which ccrl and combined ask")
    ] = 0.05
    omega: Annotated[int, Ge(0), Le(1_000_000), doc("Omega: number of misleads that are tolerated")] = 7
    first_episode: Annotated[int, Ge(1), Le(1_000_000), doc("X: the first episode that may ask")] = 30
    window: Annotated[int, Ge(1), Le(100_000), doc("K: number of episodes in a moving average")] = 5
    psi: Annotated[
        float, Ge(0), Le(1_000_000), doc("Psi: distance of action values at which ia, combined and importance decide")
    ] = 1.0
    spread: Annotated[
        float, Ge(0), Le(1_000_000), doc("least deviation between its tables at which uncertainty asks")
    ] = 0.1
    rate: Annotated[float, Ge(0), Le(1), doc("share of the steps that random asks about")] = 0.1
    fading: Annotated[
        float,
        Ge(0),
        Le(1),
        doc("factor by which the share of the steps that fading asks about shrinks in each episode"),
    ] = 0.97
    reuse: Annotated[
        float,
        Ge(0),
        Le(1),
        doc(
            "factor by which the chance to follow an earlier answer shrinks with each use (advice-reuse), each episode "
            "(advice-imitation, value-reuse) or each step of an episode (policy-reuse)"
        ),
    ] = 0.95
    bonus: Annotated[
        float, Ge(0), Le(1_000_000), doc("what value-reuse adds to the value of an answer in the first episode")
    ] = 1.0
    consistency: Annotated[float, Gt(0.5), Lt(1), doc("shaping's probability that an answer is right")] = 0.9
    warming: Annotated[
        float,
        Ge(0),
        Le(1_000_000),
        doc("growth, per episode, of policy-reuse's inverse temperature between the policies"),
    ] = 0.05
    exploring: Annotated[
        float, Gt(0), Le(1), doc("share of the episodes in which reliability explores, ever less, and follows answers")
    ] = 0.8
    trust: Annotated[
        float, Ge(0), Le(1), doc("least probability that an answer is right with which reliability follows it")
    ] = 0.25
    wandering: Annotated[
        float,
        Ge(0),
        Le(1),
        doc("share of the steps in which two-levels tries the less valuable of asking and acting alone"),
    ] = 0.05
    retry: Annotated[
        float, Ge(0), Le(100), doc("power by which earned-trust's chance to follow an advisor without success falls")
    ] = 4.0
    strikes: Annotated[
        float,
        Gt(0),
        Le(1_000_000),
        doc("loops on advice after which earned-trust gives an advisor's first episodes up"),
    ] = 4.0
    agreement: Annotated[
        float,
        Ge(0),
        Le(100),
        doc("how clearly, in standard deviations, answers must agree before earned-trust asks no more"),
    ] = 1.0
    margin: Annotated[
        float, Ge(0), Le(100), doc("temperatures by which earned-trust values other actions below what it hands over")
    ] = 0.3
    enough_steps: Annotated[float, Gt(0), Le(1_000_000), doc("mean step count above which cq asks")] = 50.0
    ensemble: Annotated[int, Ge(2), Le(100), doc("number of tables of uncertainty")] = 5
    budget: Annotated[int, Ge(0), Le(1_000_000_000), doc("number of helped steps that a session may use")] = (
        1_000_000_000
    )
    judge_unhelped: Annotated[
        bool,
        doc("an episode that was open for advice and got none is judged, too (the thesis's listing, not its text)"),
    ] = True
    spare_best: Annotated[bool, doc("an episode as good as the best so far is no mislead")] = False
    by_evidence: Annotated[
        bool,
        doc("an advisor is rejected by a sequential test against the learner's own episodes, not after Omega misleads"),
    ] = False
    memory: Annotated[bool, doc("what was shown, or found alone, is remembered and practised without asking again")] = (
        False
    )

    def __post_init__(self) -> None:
        _require_allowed(self)
        if self.gate in COMPARE_WINDOWS and self.first_episode < 2 * self.window:
            raise BadInput(
                f"GateSettings.first_episode = {self.first_episode}: the gate '{self.gate}' compares two windows of "
                f"{self.window} episodes: allowed at least {2 * self.window}"
            )


class Setting(NamedTuple):
    """A setting of learner or gate: its meaning, its allowed values in words, its default."""

    meaning: str
    allowed: str
    default: Any


def _described() -> dict[str, Setting]:
    settings = {}
    for kind in (LearnerSettings, GateSettings):
        hints = get_type_hints(kind, include_extras=True)
        for field in fields(kind):
            metadata = hints[field.name].__metadata__
            meaning = next(item.documentation for item in metadata if isinstance(item, DocInfo))
            allowed = " and ".join(_limits(metadata)) or (
                "true or false" if field.default in (True, False) else "a name"
            )
            settings[field.name] = Setting(meaning, allowed, field.default)
    return settings


SETTINGS = _described()  # all settings of learner and gate, by name


# ---- where each is looked for when it is tuned: narrower than what it may be ------------------------------------------


class Span(NamedTuple):
    """A search range, both ends included: of integers if both ends are; log: sampled uniformly in the logarithm."""

    low: float
    high: float
    log: bool = False


Range = Span | tuple[Any, ...]  # a span, or the values to try; (): all members of the family
RANGES: dict[str, Range] = {
    "learner": (),
    "selection": (),
    "gate": (),
    "alpha": Span(0.05, 1.0),
    "discount": Span(0.8, 0.999),
    "trace": Span(0.0, 0.95),
    "replacing": (False, True),
    "planning": Span(0, 50),
    "exploration": Span(0.01, 10.0, log=True),
    "beta": Span(0.2, 3.0),
    "lambda_threshold": Span(0.0, 0.3),
    "omega": Span(0, 30),
    "first_episode": Span(2, 60),
    "window": Span(1, 15),
    "psi": Span(0.01, 10.0, log=True),
    "spread": Span(0.01, 1.0, log=True),
    "rate": Span(0.01, 1.0, log=True),
    "fading": Span(0.5, 0.999),
    "reuse": Span(0.5, 0.999),
    "bonus": Span(0.01, 10.0, log=True),
    "consistency": Span(0.55, 0.95),
    "warming": Span(0.01, 1.0, log=True),
    "exploring": Span(0.1, 1.0),
    "trust": Span(0.0, 0.75),
    "wandering": Span(0.005, 0.2, log=True),
    "retry": Span(1.0, 6.0),
    "strikes": Span(1.0, 10.0),
    "agreement": Span(0.0, 2.0),
    "margin": Span(0.03, 3.0, log=True),
    "enough_steps": Span(5.0, 200.0, log=True),
    "ensemble": Span(2, 10),
    "judge_unhelped": (False, True),
    "spare_best": (False, True),
    "by_evidence": (False, True),
    "memory": (False, True),
}
USUAL = ("alpha", "trace", "exploration", "beta", "lambda_threshold", "omega")  # the settings that are tuned by default
