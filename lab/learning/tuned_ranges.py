"""Where each setting of learner and gate is looked for when it is tuned: narrower than what it may be (`SETTINGS`)."""

from typing import Any, NamedTuple


class Span(NamedTuple):
    """Both ends belong to it, of whole numbers where both are; log: the same share of trials to each factor of ten."""

    low: float
    high: float
    log: bool = False


Range = Span | tuple[Any, ...]  # a span, or the values that are tried; none: all members of its family
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
USUAL = ("alpha", "trace", "exploration", "beta", "lambda_threshold", "omega")  # what is tuned when nobody says
