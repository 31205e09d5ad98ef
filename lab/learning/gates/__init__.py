"""The gates: rules that decide when a learner asks for advice and when it stops. GATES is their table."""

from typing import Any

from lab.learning.gates import gate as rules
from lab.learning.gates.ccrl import Ccrl, Combined
from lab.learning.gates.earned_trust import EarnedTrust
from lab.learning.gates.gate import (
    CompiledGate,
    Gate,
    GateClass,
    Importance,
    Introspection,
    Never,
    Random,
    Steps,
    Surroundings,
    improvement,
)
from lab.learning.gates.other_gates import ConstantPerformance, Uncertainty, deviation
from lab.learning.gates.reuse import AdviceImitation, AdviceReuse, PolicyReuse, ValueReuse
from lab.learning.gates.rule_gate import RuleGate, compiled_form
from lab.learning.gates.weighing import Fading, Novelty, Reliability, Shaping, TwoLevels
from lab.learning.members import Member
from lab.plugins.family import Family, first_line, takes, wanted

__all__ = ["GATES", "Gate", "RuleGate", "Steps", "Surroundings", "deviation", "improvement"]

GATE_TAKES = ("settings", "episodes", "max_steps", "around")


def _adopted(name: str, thing: Any) -> Member[GateClass]:
    if not (isinstance(thing, type) and issubclass(thing, Gate) and takes(thing, *GATE_TAKES)):
        raise wanted(thing, f"a subclass of lab.Gate that is made with {', '.join(GATE_TAKES)}")
    return Member(thing, first_line(thing), compiled_form(thing))


def _weighing(how: int) -> CompiledGate:
    return CompiledGate(rules.OPENS_ALWAYS, rules.ASKS_ALWAYS, weighs=how)


_SHIPPED: dict[str, Member[GateClass]] = {
    "ccrl": Member(
        Ccrl,
        "asks for whole episodes while its improvement is below Lambda; rejects an advisor after more than Omega misleads "
        "(the thesis's rule)",
        CompiledGate(rules.OPENS_WHILE_SLOW, rules.ASKS_ALWAYS, judges=True),
    ),
    "ia": Member(
        Introspection,
        "introspection: asks wherever the values of the moves lie within psi of each other, because it is unsure there",
        CompiledGate(rules.OPENS_FROM_X, rules.ASKS_WHERE_ALIKE),
    ),
    "combined": Member(
        Combined,
        "asks only where both ccrl and ia would; rejects as ccrl does",
        CompiledGate(rules.OPENS_WHILE_SLOW, rules.ASKS_WHERE_ALIKE, judges=True),
    ),
    "cq": Member(
        ConstantPerformance,
        "asks for whole episodes while the last ones took more steps on average than a constant",
        CompiledGate(rules.OPENS_WHILE_LONG, rules.ASKS_ALWAYS),
    ),
    "always": Member(Gate, "asks about every step", CompiledGate(rules.OPENS_ALWAYS, rules.ASKS_ALWAYS)),
    "never": Member(Never, "asks about none", CompiledGate(rules.OPENS_NEVER, rules.ASKS_ALWAYS)),
    "random": Member(
        Random, "asks about a random share of the steps", CompiledGate(rules.OPENS_FROM_X, rules.ASKS_BY_CHANCE)
    ),
    "importance": Member(
        Importance,
        "asks wherever the values of the moves lie psi or more apart: there a wrong move costs most",
        CompiledGate(rules.OPENS_FROM_X, rules.ASKS_WHERE_APART),
    ),
    "uncertainty": Member(
        Uncertainty,
        "several tables learn side by side, and it asks where they disagree",
        CompiledGate(rules.OPENS_FROM_X, rules.ASKS_WHERE_TABLES_DIFFER),
    ),
    "novelty": Member(Novelty, "asks in every state until it has been answered there", _weighing(rules.WEIGHS_NOVELTY)),
    "fading": Member(
        Fading, "asks about a share of the steps that decays with the episodes", _weighing(rules.WEIGHS_FADING)
    ),
    "shaping": Member(
        Shaping,
        "policy shaping: asks about every step, and multiplies its own action probabilities by those of the advice",
        _weighing(rules.WEIGHS_SHAPING),
    ),
    "reliability": Member(
        Reliability,
        "asks once per state, while it explores, and follows an advisor whose answers its own values confirm (CLUE)",
        _weighing(rules.WEIGHS_RELIABILITY),
    ),
    "two-levels": Member(
        TwoLevels,
        "learns in every state whether asking or acting alone is worth more",
        _weighing(rules.WEIGHS_WORTH),
    ),
    "advice-reuse": Member(
        AdviceReuse,
        "asks once per state, and follows the answer again with a chance that shrinks with each use",
        _weighing(rules.WEIGHS_REUSE),
    ),
    "advice-imitation": Member(
        AdviceImitation,
        "asks once per state, and imitates the answers in a share of the episodes that decays",
        _weighing(rules.WEIGHS_IMITATION),
    ),
    "policy-reuse": Member(
        PolicyReuse,
        "chooses for each episode between the advisor and itself by their gains (PRQ-learning)",
        _weighing(rules.WEIGHS_POLICY),
    ),
    "value-reuse": Member(
        ValueReuse,
        "asks once per state, and adds a bonus to the value of the answer that decays with the episodes",
        _weighing(rules.WEIGHS_VALUES),
    ),
    "earned-trust": Member(
        EarnedTrust,
        "follows advice while episodes with advice do better than those without, and hands what it remembers over to the "
        "learner's table",
        _weighing(rules.WEIGHS_TRUST),
    ),
}
GATES = Family("gates", _SHIPPED, _adopted)
