"""FJSPLIB's text: an operation that either of two machines can do is a choice between two routes."""

from collections.abc import Callable

import pytest

from lab.tasks.cell_file import CellFile

TEXT = "1 3 1.5\n2  2 1 3 2 5  1 3 4\n"


def test_machines_that_can_do_it_are_routes(read: Callable[..., CellFile]) -> None:
    routes = read(TEXT, "flexible.fjs").cell().products[0].routes
    assert [[(stage.station, stage.processing_s) for stage in route[1:]] for route in routes] == [
        [("M1", 3.0), ("M3", 4.0)],
        [("M2", 5.0), ("M3", 4.0)],
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "1 2 1\n2 2 1 3 2 5\n",
            "line 2: wanted how many machines can do operation 2 of job 1: the row ends before it",
        ),
        ("1 2 1\n1 1 1 3 9\n", "line 2: wanted the end of the row after 1 operations, not '9'"),
        (
            "1 2 1\n6 " + "2 1 3 2 5 " * 6 + "\n",
            "line 2: wanted up to 50 ways through the machines for a job, not '64'",
        ),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(refused: Callable[..., str], text: str, expected: str) -> None:
    assert refused(text, "flexible.fjs") == f"flexible.fjs: {expected}"
