"""A study of one's own: `lab study run ./own_study.py:hints` writes its report, its rows and its picture."""

from collections.abc import Mapping
from typing import Any

from lab.studies.compared import Compared, compared
from lab.studies.findings import Findings
from lab.studies.runner import Job


def hints(job: Job, reading: Mapping[str, Any]) -> Findings:
    """How many hints does a beginner need? The budget of an expert's hints, in world I."""
    return compared(Compared("world-1", ("expert",), {"gate": ["ccrl"], "budget": [0, 10, 30, 100, 300]}), job)
