"""Points in time as a table and as a document: by hand, any there and back, and what is said of a wrong line."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.export.timed import Point, TimedPoints
from lab.export.trajectory_csv import read_table, text_of
from lab.export.trajectory_json import read_document
from lab.export.trajectory_json import text_of as document_of

JOINTS = ("turn", "lift")
TEXT = """\
t_s,turn,lift,x_m,y_m,z_m,yaw_rad,gripper_closed,waits_for,job
0.000000,0.500000,-0.250000,0.400000,0.100000,0.300000,0.000000,0,,1
1.500000,0.750000,-0.250000,0.400000,0.200000,0.300000,0.100000,1,"oven, left",2
"""
POINTS = (
    Point(0.0, (0.5, -0.25), (0.4, 0.1, 0.3, 0.0), False, "", 1),
    Point(1.5, (0.75, -0.25), (0.4, 0.2, 0.3, 0.1), True, "oven, left", 2),
)


def test_a_table_by_hand() -> None:
    assert text_of(TimedPoints(JOINTS, POINTS)) == TEXT
    assert read_table(TEXT, JOINTS, "trajectory.csv") == TimedPoints(JOINTS, POINTS)


numbers = st.integers(-9_000_000, 9_000_000).map(lambda n: n / 1_000_000 + 0.0)
stations = st.from_regex(r"([A-Za-z0-9][A-Za-z0-9 _-]{0,9})?", fullmatch=True)


@st.composite
def trajectories(draw: st.DrawFn) -> TimedPoints:
    times = sorted(draw(st.lists(numbers.map(abs), max_size=5)))
    own = st.tuples(st.tuples(numbers, numbers), st.tuples(*[numbers] * 4), st.booleans(), stations, st.integers(1, 99))
    return TimedPoints(JOINTS, tuple(Point(t_s, *draw(own)) for t_s in times))


@given(trajectories())
def test_any_points_come_back(points: TimedPoints) -> None:
    assert read_table(text_of(points), JOINTS, "t") == points
    assert read_document(document_of(points, "toast", "up6", 0.0), JOINTS, "t") == points


WRONG = [
    ("turn,lift", "lift,turn", "trajectory.csv, line 1: the columns are t_s, lift, turn,"),
    (",0,,1\n", ",0,1\n", "trajectory.csv, line 2: 9 columns, wanted 10"),
    ("0.750000", "nan", "trajectory.csv, line 3: 'nan' is no number"),
    ("0.750000", "far", "trajectory.csv, line 3: 'far' is no number"),
    (',1,"oven', ',yes,"oven', "trajectory.csv, line 3: gripper_closed = 'yes', wanted 0 or 1"),
    ('left",2', 'left",second', "trajectory.csv, line 3: job = 'second', wanted a whole number"),
    ("1.500000", "-1.500000", "trajectory.csv, line 3: t_s = -1.5 lies before 0.0, of the row above"),
    ('left",2', "left,2", "trajectory.csv, line 3: unexpected end of data"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_line_is_named(right: str, wrong: str, said: str) -> None:
    assert right in TEXT
    with pytest.raises(BadInput, match=re.escape(said)):
        read_table(TEXT.replace(right, wrong, 1), JOINTS, "trajectory.csv")
