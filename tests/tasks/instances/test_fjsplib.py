"""FJSPLIB's text: an operation that either of two machines can do is a stage with an alternative."""

from collections.abc import Callable

import pytest

from lab.sequencing.methods.cp_sat import cp_sat
from lab.tasks.cell_file import CellFile

TEXT = "1 3 1.5\n2  2 1 3 2 5  1 3 4\n"


def test_machines_that_can_do_it_are_alternatives(read: Callable[..., CellFile]) -> None:
    (route,) = read(TEXT, "flexible.fjs").cell().products[0].routes
    assert [[(way.station, way.processing_s) for way in stage.ways] for stage in route[1:]] == [
        [("M1", 3.0), ("M2", 5.0)],
        [("M3", 4.0)],
    ]


def test_kacems_four_jobs_on_five_machines(read: Callable[..., CellFile]) -> None:
    """Each machine can do each operation: 125 ways through the machines for a job, 11 s at best (Kacem et al. 2002)."""
    rows = [
        "4 5",
        "3 5 1 2 2 5 3 4 4 1 5 2 5 1 5 2 4 3 5 4 7 5 5 5 1 4 2 5 3 5 4 4 5 5",
        "3 5 1 2 2 5 3 4 4 7 5 8 5 1 5 2 6 3 9 4 8 5 5 5 1 4 2 5 3 4 4 54 5 5",
        "4 5 1 9 2 8 3 6 4 7 5 9 5 1 6 2 1 3 2 4 5 5 4 5 1 2 2 5 3 4 4 2 5 4 5 1 4 2 5 3 2 4 1 5 5",
        "2 5 1 1 2 5 3 2 4 4 5 12 5 1 5 2 1 3 2 4 1 5 2",
    ]
    found = cp_sat(read("\n".join(rows), "kacem.fjs").cell())
    assert (found.status, found.cost) == ("optimal", 11.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "1 2 1\n2 2 1 3 2 5\n",
            "line 2: wanted how many machines can do operation 2 of job 1: the row ends before it",
        ),
        ("1 2 1\n1 1 1 3 9\n", "line 2: wanted the end of the row after 1 operations, not '9'"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(refused: Callable[..., str], text: str, expected: str) -> None:
    assert refused(text, "flexible.fjs") == f"flexible.fjs: {expected}"
