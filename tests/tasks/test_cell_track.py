"""A track in a cell file: its times are those of its ways, it comes back from TOML, and what cannot be is said with its line."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.tasks.cell_file import toml_of
from lab.tasks.task_file import load_cell

TRACK = '[track]\nstretches = [["in", "saw", 3], ["saw", "out", 4.5]]\n'
FILE = """name = "line"
kind = "cell"
parts = 2
stations = [
  { name = "in", kind = "storage", capacity = 2 },
  { name = "saw", kind = "machine", capacity = 1, processing_s = 5 },
  { name = "out", kind = "storage", capacity = 2 },
]

[[robots]]
name = "left"
start = "in"

[[robots]]
name = "right"
start = "out"

[[products]]
name = "bar"
routes = [["in", "saw", "out"]]

"""


def written(text: str) -> str:
    Path("line.toml").write_text(text)
    return "line.toml"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_times_are_those_of_the_ways() -> None:
    file = load_cell(written(FILE + TRACK))
    assert file.times["in"] == {"in": 0.0, "saw": 3.0, "out": 7.5}
    assert file.cell().loaded_s[1, 2] == 4.5
    assert load_cell(written(toml_of(file))) == file


def test_the_one_that_ships_is_slower_than_without_hindrance() -> None:
    cell = load_cell("two-on-a-track").cell()
    assert [stretch.seconds for stretch in cell.track] == [10.0, 8.0, 8.0, 10.0]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            FILE + TRACK + "[travel]\nin = { saw = 3 }\n",
            r"track and travel: with a track",
        ),
        (FILE.replace('[[robots]]\nname = "right"\nstart = "out"\n', "") + TRACK, "it is for several robots"),
        (FILE + TRACK.replace('"out", 4.5', '"exit", 4.5'), "unknown station 'exit'"),
        (FILE + TRACK.replace("4.5", "0"), "more than 0 s"),
        (FILE + TRACK.replace("4.5", '"far"'), "stretches"),
        (FILE + '[track]\nstretches = [["in", "saw", 3]]\n', "travel time 'out' -> 'in' is missing"),
        (FILE + "[track]\nstretches = []\n", "stretches"),
    ],
)
def test_what_cannot_be_is_said_with_its_line(text: str, fault: str) -> None:
    with pytest.raises(BadInput, match=rf"^line\.toml: line \d+.*{fault}"):
        load_cell(written(text))


def test_robots_that_break_down_are_refused_with_their_line() -> None:
    """Beside a track, and where there are none."""
    with pytest.raises(BadInput, match=r"line\.toml: line \d+: robot_breaks_every_s = 50 and a track: "):
        load_cell(written(FILE + TRACK + "[stochastic]\nrobot_breaks_every_s = 50\n"))
