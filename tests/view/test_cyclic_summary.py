"""A cycle in words, and what a run of it measured."""

from io import StringIO
from typing import Any

import pytest
from rich.console import Console

from lab.view.cyclic_summary import cyclic_summary, period_in_words

FOUND: dict[str, Any] = {
    "mix": ["slice", "slice", "cup"],
    "parts_a_cycle": 3,
    "period_s": 90.0,
    "per_part_s": 30.0,
    "parts_per_hour": 120.0,
    "bound_s": 85.5,
    "bound_per_part_s": 28.5,
    "least_per_part_s": 28.5,
    "proven": False,
    "proven_of": "cycles of 2 slices, 1 cup",
    "why_no_more": None,
    "tried": [{"parts_a_cycle": 3, "period_s": 90.0, "bound_s": 85.5, "proven": False}],
    "most_in_work": 2,
    "seed": 7,
    "moves": [
        {
            "part": 1,
            "product": "slice",
            "origin": "in",
            "target": "oven",
            "carries": "part",
            "pick_s": 0.0,
            "periods": 0,
        },
        {"part": 3, "product": "cup", "origin": "a", "target": "b", "carries": "pallet", "pick_s": 12.5, "periods": 1},
    ],
    "finite": {
        "parts": 6,
        "cyclic_makespan_s": 210.0,
        "waits_on_purpose": True,
        "best_s": 205.0,
        "best_per_part_s": 34.1666,
        "best_proven": True,
        "why_not": None,
    },
    "files": {},
}


def lines(found: dict[str, Any]) -> list[str]:
    shown = Console(file=StringIO(), width=200)
    with shown.capture() as text:
        shown.print(cyclic_summary(found))
    return [line.rstrip() for line in text.get().splitlines()]


def test_a_cycle_in_words() -> None:
    assert lines(FOUND) == [
        "every 90.00 s: 2 slices, 1 cup, 30.00 s a part, 120.0 parts an hour (seed 7)",
        "2 parts in work at once at the most",
        "proven: of cycles of 2 slices, 1 cup none needs less than 28.50 s a part",
        "       0.00 s  slice 1: in > oven",
        "      12.50 s  cup 3's pallet: a > b  (entered 1 period before)",
        "carried out for 6 parts: 210.00 s, with waits on purpose",
        "the best order of as many: 205.00 s, 34.17 s a part",
    ]


def test_what_other_numbers_of_parts_came_to() -> None:
    periods = [(3, 90.0, True), (6, None, True), (9, None, False)]
    tried = [dict(zip(("parts_a_cycle", "period_s", "proven"), one, strict=True)) for one in periods]
    changed = {"proven": True, "bound_per_part_s": 30.0, "proven_of": "cycles of up to 9 parts", "tried": tried}
    assert lines(FOUND | changed | {"why_no_more": "the 60 s were over"})[2:5] == [
        "proven: of cycles of up to 9 parts none needs less a part; of all cycles none less than 28.50 s",
        "parts a cycle: 3, 30.00 s a part; 6, none is better; 9, none better was found",
        "more parts a cycle were not tried: the 60 s were over",
    ]


def test_what_was_not_found_is_told() -> None:
    nothing = dict.fromkeys(FOUND["finite"]) | {"parts": 6, "why_not": "no order was found"}
    assert lines(FOUND | {"finite": nothing})[-1] == "of 6 parts: no order was found"


@pytest.mark.parametrize(
    ("measured_s", "deviation", "words"),
    [
        (83.74, 0.0017, "83.60 s planned, 83.74 s measured (+0.17%)"),
        (None, None, "83.60 s planned; too few parts were delivered to measure it"),
    ],
)
def test_the_period_of_a_run(measured_s: float | None, deviation: float | None, words: str) -> None:
    told = {"period_s": 83.6, "measured_period_s": measured_s, "period_deviation": deviation}
    assert period_in_words(told) == words
