"""The rules of AdviceBench: gates with their settings, and the advisor's own rules of when to answer."""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from lab.files import read_limited
from lab.learning.settings import RANGES, GateSettings, Range, Span
from lab.learning.simulated_advice import SPEAKS_ALWAYS, SPEAKS_AS_EXPECTED, SPEAKS_TO_CORRECT

NOBODY, OURS = "nobody", "earned-trust"
BUDGETS = {"100": 100, "any": GateSettings.budget}  # answers of a session
TUNED = "tuned.toml"  # the settings of each rule at each budget, as the study "advicebench-tuning" wrote them
SHARE = "share"
SHARES = Span(0.05, 1.0)  # where the share of the states in which an advisor speaks is looked for


class Rule(NamedTuple):
    """A rule of when to ask: the gate with its settings, and when the advisor itself gives no answer.

    share: of the states, those where most is at stake, in which the advisor speaks; speaks: as in `Advice`.
    """

    gate: GateSettings
    share: float = 1.0
    speaks: int = SPEAKS_ALWAYS

    @property
    def holds_back(self) -> bool:
        """Whether the advisor ever gives no answer."""
        return self.share < 1.0 or self.speaks != SPEAKS_ALWAYS


class Tunable(NamedTuple):
    """A rule before it is tuned: its gate, the settings that are the same in all trials, and the names of those that are tuned.

    speaks: None if the advisor does not choose when to speak; if it does, its share of the states is tuned, too.
    """

    gate: str
    tuned: tuple[str, ...] = ()
    given: Mapping[str, Any] = {}
    speaks: int | None = None

    def ranges(self) -> dict[str, Range]:
        """Where each tuned setting is looked for."""
        return {name: RANGES[name] for name in self.tuned} | ({} if self.speaks is None else {SHARE: SHARES})

    def rule(self, budget: str, settings: Mapping[str, Any]) -> Rule:
        """The rule at a budget with these settings, the others at their defaults; a share at 0.5.

        Gates that compare two windows of K episodes ask from episode 2K at the earliest.
        """
        given = dict(settings)
        share = given.pop(SHARE, 0.5) if self.speaks is not None else 1.0
        if "window" in given:
            given["first_episode"] = max(given["first_episode"], 2 * given["window"])
        gate = GateSettings(self.gate, **{"spare_best": True, "budget": BUDGETS[budget], **self.given, **given})
        return Rule(gate, share, self.speaks or SPEAKS_ALWAYS)


FIRST: Mapping[str, Any] = {"first_episode": 1}
WINDOWS = ("lambda_threshold", "omega", "first_episode", "window")
RULES: Mapping[str, Tunable] = {
    "always": Tunable("always"),
    "random": Tunable("random", ("rate",), FIRST),
    "introspection": Tunable("ia", ("psi",), FIRST),
    "importance (learner's)": Tunable("importance", ("psi",), FIRST),
    "uncertainty": Tunable("uncertainty", ("spread", "ensemble"), FIRST),
    "ccrl": Tunable("ccrl", WINDOWS),
    "ccrl with memory": Tunable("ccrl", WINDOWS, {"memory": True}),
    "combined": Tunable("combined", (*WINDOWS, "psi")),
    "cq": Tunable("cq", ("first_episode", "enough_steps")),
    "novelty": Tunable("novelty"),
    "fading": Tunable("fading", ("fading",)),
    "shaping": Tunable("shaping", ("consistency",)),
    "reliability": Tunable("reliability", ("exploring", "trust")),
    "two levels": Tunable("two-levels", ("wandering",)),
    "advice reuse": Tunable("advice-reuse", ("reuse",)),
    "advice imitation": Tunable("advice-imitation", ("reuse",)),
    "policy reuse": Tunable("policy-reuse", ("reuse", "warming")),
    "value reuse": Tunable("value-reuse", ("reuse", "bonus")),
    "importance (teacher's)": Tunable("always", speaks=SPEAKS_ALWAYS),
    "correcting": Tunable("always", speaks=SPEAKS_TO_CORRECT),
    "predictive": Tunable("always", speaks=SPEAKS_AS_EXPECTED),
    OURS: Tunable(OURS, ("retry", "strikes", "agreement", "margin")),
}


def rules_of(name: str) -> dict[str, Rule]:
    """The rule of the bench with that name by budget, as it was tuned; any other gate of the family, with its defaults."""
    tuned = tuned_settings().get(name, {})
    return {budget: RULES.get(name, Tunable(name)).rule(budget, tuned.get(budget, {})) for budget in BUDGETS}


@cache
def tuned_settings() -> dict[str, dict[str, dict[str, Any]]]:
    """The tuned settings by rule and budget."""
    return tomllib.loads(read_limited(Path(__file__).with_name(TUNED)).decode())
