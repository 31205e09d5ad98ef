"""The search ranges of the settings of learner and gate in tuning; they are narrower than what is allowed (`SETTINGS`)."""

from typing import Any, NamedTuple


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
    "fading": Span(0.8, 0.999),
    "consistency": Span(0.55, 0.95),
    "enough_steps": Span(5.0, 200.0, log=True),
    "ensemble": Span(2, 10),
    "judge_unhelped": (False, True),
    "spare_best": (False, True),
    "memory": (False, True),
}
USUAL = ("alpha", "trace", "exploration", "beta", "lambda_threshold", "omega")  # the settings that are tuned by default
