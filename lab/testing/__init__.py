"""Contract tests for members of the families, shipped or your own: each function raises an AssertionError that says why."""

from lab.testing.learning import check_advisor, check_gate, check_learner
from lab.testing.sequencing import check_sequencer
from lab.testing.skills import check_skill
from lab.testing.studies import check_study

__all__ = ["check_advisor", "check_gate", "check_learner", "check_sequencer", "check_skill", "check_study"]
