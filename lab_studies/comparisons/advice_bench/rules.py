"""The rules of AdviceBench: gates with their settings, and the advisor's own rules of when to answer."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import SPEAKS_AS_EXPECTED, SPEAKS_TO_CORRECT

NOBODY, OURS = "nobody", "earned-trust"


class Rule(NamedTuple):
    """A rule of when to ask: the gate with its settings, and the states in which the advisor itself gives no answer."""

    gate: GateSettings
    important: bool = False  # the advisor speaks only where most is at stake
    speaks: int = 0


def _gate(gate: str, **settings: Any) -> GateSettings:
    return GateSettings(gate, spare_best=True, **settings)


EARLY: Any = {"first_episode": 1}
CCRL: Any = {"first_episode": 10, "lambda_threshold": 0.2, "omega": 3}
# each setting is, of a few values, the one with the highest mean gain over the problems not held out, with another seed
RULES: Mapping[str, Rule] = {
    "always": Rule(_gate("always")),
    "random": Rule(_gate("random", rate=0.02, **EARLY)),
    "introspection": Rule(_gate("ia", psi=0.03, **EARLY)),
    "importance (learner's)": Rule(_gate("importance", psi=0.03, **EARLY)),
    "uncertainty": Rule(_gate("uncertainty", spread=0.1, **EARLY)),
    "ccrl": Rule(_gate("ccrl", **CCRL)),
    "ccrl with memory": Rule(_gate("ccrl", memory=True, **CCRL)),
    "combined": Rule(_gate("combined", first_episode=10, psi=1.0)),
    "cq": Rule(_gate("cq", first_episode=5, enough_steps=100.0)),
    "novelty": Rule(_gate("novelty")),
    "fading": Rule(_gate("fading", fading=0.95)),
    "shaping": Rule(_gate("shaping", consistency=0.55)),
    "reliability": Rule(_gate("reliability")),
    "two levels": Rule(_gate("two-levels")),
    "advice reuse": Rule(_gate("advice-reuse")),
    "advice imitation": Rule(_gate("advice-imitation")),
    "policy reuse": Rule(_gate("policy-reuse")),
    "value reuse": Rule(_gate("value-reuse")),
    "importance (teacher's)": Rule(_gate("always"), important=True),
    "correcting": Rule(_gate("always"), important=True, speaks=SPEAKS_TO_CORRECT),
    "predictive": Rule(_gate("always"), important=True, speaks=SPEAKS_AS_EXPECTED),
    OURS: Rule(_gate(OURS)),
}


def rule_of(name: str) -> Rule:
    """The rule of the bench with that name; any other gate of the family, with its default settings."""
    return RULES[name] if name in RULES else Rule(_gate(name))
