"""What every member of a family is held to, ours and yours: a function for each family, an AssertionError that says why."""

from lab.testing.contracts import (
    check_advisor,
    check_doubt,
    check_gate,
    check_learner,
    check_sequencer,
    check_skill,
    check_study,
)

__all__ = [
    "check_advisor",
    "check_doubt",
    "check_gate",
    "check_learner",
    "check_sequencer",
    "check_skill",
    "check_study",
]
