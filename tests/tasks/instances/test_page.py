"""docs/instances.md: its files are of the formats that it says, and its commands read them."""

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.tasks.instances import INSTANCES, format_of
from lab.tasks.instances.layout import read_layout
from lab.tasks.instances.source import Source

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "instances.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL))
BLOCK = re.compile(r"<!-- (file|layout): (\S+) -->\n```\w+\n(.*?)```", re.DOTALL)
FILES = {name: text for _, name, text in BLOCK.findall(PAGE)}
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", INSTANCES)
def test_a_format_has_a_file_of_its_own_kind_and_a_command(name: str) -> None:
    (file,) = [(path, text) for kind, path, text in BLOCK.findall(SECTIONS[name]) if kind == "file"]
    assert format_of(Source(Path(file[0]), file[1])) == name
    assert f" {file[0]}" in SECTIONS[name].partition("```sh")[2]


def test_no_section_is_of_a_format_that_there_is_not() -> None:
    assert {*SECTIONS} == {*INSTANCES, "Layouts"}


def test_layouts_of_both_forms_are_the_same(written: Path) -> None:
    matrix, rows = read_layout(Path("travel.csv")), read_layout(Path("layouts.csv"), "1")
    assert (matrix.start, matrix.machines) == (rows.start, rows.machines) == ("LU", ("M1", "M2"))
    for origin, row in rows.travel.items():
        assert {target: time for target, time in matrix.travel[origin].items() if target != origin} == row
    with pytest.raises(BadInput, match=r"layouts.csv: .*there is no layout '2'"):
        read_layout(Path("layouts.csv"), "2")


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_of_the_page_reads_its_file(written: Path, lab: Callable[..., Any], line: str) -> None:
    ran = lab(*shlex.split(line)[1:], "--json")
    assert ran.code == 0, ran.err
