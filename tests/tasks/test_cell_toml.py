"""A cell file as TOML: reading it gives the same cell, for every cell that ships and for setups and odd names."""

from pathlib import Path

import pytest

from lab.tasks.cell_file import CellFile, toml_of
from lab.tasks.task_file import load_cell, names_of
from lab.tasks.toml_text import TomlText


def again(file: CellFile) -> CellFile:
    return CellFile.checked(TomlText.parsed(Path("mine.toml"), toml_of(file)))


@pytest.mark.parametrize("name", names_of("cell"))
def test_what_ships_reads_as_the_same(name: str) -> None:
    file = load_cell(name)
    assert again(file).model_dump() == file.model_dump()


def test_names_with_spaces_setups_and_no_robot() -> None:
    raw = {
        "name": "no robot",
        "title": 'a "title" \\ of one',
        "order": ["red part", "blue part"],
        "robots": [],
        "release_s": [0.5, 1e-7],
        "stations": [
            {"name": "in", "kind": "storage", "capacity": "unlimited"},
            {"name": "the saw", "kind": "machine", "capacity": "unlimited", "servers": 1, "processing_s": 3,
             "setup_s": {"red part": {"blue part": 2.25}}},
        ],
        "products": [{"name": name, "routes": [["in", "the saw"]]} for name in ("red part", "blue part")],
    }  # fmt: skip
    file = CellFile.model_validate(raw)
    assert again(file).model_dump() == file.model_dump()
    assert again(file).cell().setups[1] == {("red part", "blue part"): 2.25}
