"""The harness's part `ctrl-c`: what its judge notices."""

import json
from typing import Any

import pytest

from devtools.commands import Ended
from devtools.ctrl_c import fault_of

GOOD = {
    "stopped_by": "Ctrl-C",
    "interrupted": True,
    "objective": "makespan",
    "best_sequence": [1, 1],
    "best_moves": ["toast: in > hot", "toast: hot > out"],
    "best_cost": 14.0,
    "bound_cost": 14.0,
    "optimum_proven": True,
}


def ended(code: int = 130, **change: Any) -> Ended:
    return Ended(code, json.dumps(GOOD | change) + "\n", "lab: stopped by Ctrl-C\n", 1.0, 0)


def test_an_order_with_its_bound_is_well() -> None:
    assert fault_of(ended()) == ""


@pytest.mark.parametrize(
    ("told", "why"),
    [
        (ended(0), "exit 0, allowed 130"),
        (ended(best_sequence=[], best_moves=[]), "the order is empty"),
        (ended(bound_cost=0.0, optimum_proven=False), "bound 0.0, best 14.0"),
        (ended(bound_cost=12.0), "proven: True, bound 12.0, best 14.0"),
        (ended(error="stopped by Ctrl-C"), "no order: stopped by Ctrl-C"),
        (ended(stopped_by="seconds", interrupted=False), "stopped by seconds"),
        (Ended(130, "", "", 1.0, 0), "0 lines instead of one document"),
        (Ended(130, "{}\n", "Traceback (most recent call last)\nKeyError: 1\n", 1.0, 0), "traceback: KeyError: 1"),
    ],
)
def test_what_is_missing_is_said(told: Ended, why: str) -> None:
    assert fault_of(told).startswith(why)
