"""Layouts: a matrix and rows say the same; what is damaged is refused with its line."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.tasks.instances.layout import read_layout

MATRIX = ",LU,M1,M2\nLU,0,6,8\nM1,12,0,6\nM2,10,,0\n"
ROWS = "layout,from,to,time\n1,LU,M1,6\n1,LU,M2,8\n2,LU,M1,1\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "layout.csv"
    path.write_text(text)
    return path


def test_a_matrix(tmp_path: Path) -> None:
    layout = read_layout(written(tmp_path, MATRIX))
    assert (layout.start, layout.end, layout.machines) == ("LU", None, ("M1", "M2"))
    assert layout.travel["M1"] == {"LU": 12.0, "M1": 0.0, "M2": 6.0}
    assert "M1" not in layout.travel["M2"]  # an empty place is no move


def test_one_of_several(tmp_path: Path) -> None:
    path = written(tmp_path, ROWS)
    assert read_layout(path, "1").travel == {"LU": {"M1": 6.0, "M2": 8.0}}
    assert read_layout(path, "2").travel == {"LU": {"M1": 1.0}}
    with pytest.raises(BadInput, match="the file has 1, 2: there is no layout '3'"):
        read_layout(path, "3")
    with pytest.raises(BadInput, match="say which with --case"):
        read_layout(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (MATRIX.replace("12", "far"), "line 3: wanted the time from 'M1' to 'LU', a number from 0 to 1e+06, not 'far'"),
        (MATRIX.replace("M2,10,,0\n", ""), "line 3: wanted a row of times from 'M2': the file ends before it"),
        (MATRIX.replace("M1,12,0,6", "M1,12,0"), "line 3: wanted 3 times after 'M1', not '2 of them'"),
        ("from,to,time\nLU,M1,6\nLU,M1,7\n", "line 3: wanted one time from 'LU' to 'M1': this is the second"),
        ("from,to,time\nLU,M1\n", "line 2: wanted 3 values (from,to,time), not 'LU,M1'"),
        ("from,to,time\n", "wanted travel times: there is none"),
        ("", "line 1: wanted from,to,time or layout,from,to,time"),
        ('from,to,time\n"LU,M1,6\n', "line 2: wanted CSV"),
    ],
)
def test_a_damaged_one_is_refused_with_its_line(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(BadInput) as caught:
        read_layout(written(tmp_path, text))
    assert str(caught.value).partition("layout.csv: ")[2].startswith(expected)
