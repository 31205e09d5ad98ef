"""Taillard's text: the same shop as in JSPLIB's, in two blocks, with and without words between them."""

from collections.abc import Callable

import pytest

from lab.tasks.cell_file import CellFile

WORDED = "Nb of jobs, Nb of Machines\n2 2\nTimes\n3 2\n4 1\nMachines\n1 2\n2 1\n"


@pytest.mark.parametrize("text", [WORDED, "2 2\n3 2\n4 1\n1 2\n2 1\n"])
def test_it_is_the_shop_that_jsplib_has(read: Callable[..., CellFile], text: str) -> None:
    assert read(text, "two.txt") == read("2 2\n0 3 1 2\n1 4 0 1\n", "two.txt")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("2 1\n", "2 3\n", "line 8: wanted the machine of operation 2 of job 2, a whole number from 1 to 2, not '3'"),
        ("2 1\n", "", "line 7: wanted 2 rows of times and 2 rows of machines, not '3 rows'"),
        ("1 2\n", "1\n", "line 7: wanted 2 machines of job 1, as many as it has times, not '1 numbers'"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    refused: Callable[..., str], old: str, new: str, expected: str
) -> None:
    head, _, tail = WORDED.rpartition(old)
    assert refused(head + new + tail, "two.txt") == f"two.txt: {expected}"
