"""Hoist lines as MiniZinc data: two tanks, in either of the two families of names, as one list or as a matrix."""

from collections.abc import Callable

import pytest

from lab.tasks.cell_file import CellFile

LINE = """% two tanks
Ninner = 2;
tmin = [150, 90];
tmax = [200, 9999]; /* the second
as long as you like */
f = [31, 22, 30];
e = [| 11, 0, 2
     | 14, 2, 0
     | 19, 3, 4 |];
"""
OTHER = """numTanks = 2; minTime = array1d(1..2, [150, 90]); maxTime = [200, INF];
full = [31, 22, 30]; empty = array2d(1..3, 0..2, [11, 0, 2, 14, 2, 0, 19, 3, 4]);"""


@pytest.mark.parametrize("text", [LINE, OTHER])
def test_a_line_of_tanks(read: Callable[..., CellFile], text: str) -> None:
    cell = read(text, "line.dzn").cell()
    assert [(tank.processing_s, tank.at_most_s) for tank in cell.stations[1:3]] == [(150.0, 50.0), (90.0, None)]
    load, one, two, unload = range(4)
    assert [cell.loaded_s[load, one], cell.loaded_s[one, two], cell.loaded_s[two, unload]] == [31.0, 22.0, 30.0]
    assert [cell.empty_s[one, load], cell.empty_s[two, one], cell.empty_s[unload, two]] == [11.0, 2.0, 4.0]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[150, 90]", "[150]", "line 3: wanted 2 times as 'tmin', not '1'"),
        ("[150, 90]", "[150, x]", "line 3: wanted a time in 'tmin', a number from 0 to 1e+06, not 'x'"),
        ("Ninner = 2;", "Ninner = 99999999;", "line 2: wanted 'Ninner', a whole number from 1 to 98, not '99999999'"),
        ("[150, 90];", "[150, 90]", "line 4: wanted ';' after the value of 'tmin', not '='"),
        ("[150, 90];", "[150, 90;", "line 3: wanted ']' at the end of 'tmin', not '90'"),
        ("f = [31, 22, 30];\n", "", "wanted a value of 'f or full': there is none"),
        ("200", "100", "line 4: wanted a most time of tank 1 of at least 150, not '100'"),
        ("14, 2, 0", "14, 2", "line 7: wanted 9 times as 'e', not '8'"),
        ("% two", "? two", "line 1: wanted MiniZinc data (name = value;), not '? two tank'"),
        ("Ninner = 2;", "Ninner = 2; Hoists = 2;", "line 2: wanted 'Hoists', a whole number from 1 to 1, not '2'"),
        ("Ninner = 2;", "Ninner = 2; Ninner = 2;", "line 2: wanted 'Ninner' once: this is the second, not 'Ninner'"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    refused: Callable[..., str], old: str, new: str, expected: str
) -> None:
    assert refused(LINE.replace(old, new), "line.dzn") == f"line.dzn: {expected}"
