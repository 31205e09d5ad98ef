"""The harness's part `mutations`: a few damaged files of each kind that needs no run, and what its judge notices."""

from collections.abc import Callable
from pathlib import Path
from random import Random
from zipfile import ZipFile

import pytest

from devtools.mutate import FITTING, MUTATIONS, mutated
from devtools.mutations import faults_in_words
from devtools.read_damaged import batch, verdict
from devtools.read_files import KINDS, Kind
from lab.errors import BadInput

QUICK = (
    "task",
    "cell",
    "world",
    "text grid",
    "instance",
    "jobs and layout",
    "answers",
    "carried policy",
    "body of a station",
)
TEXT = b'name = "mine"\n[cell]\nshape = [1, 2.5, -3e4]\n'


@pytest.mark.parametrize("name", QUICK)
def test_damaged_files_are_read_or_refused_in_a_line(name: str, tmp_path: Path) -> None:
    numbers: list[int] = []
    told = batch(tmp_path, name, 7, range(40), numbers.append, tmp_path / "files")
    assert told.broke == []
    assert (told.tries, told.read + told.refused, numbers) == (40, 40, [*range(40)])
    assert told.refused > 10


@pytest.mark.parametrize("name", MUTATIONS)
@pytest.mark.parametrize("content", [b"", TEXT, b'{"a": [1, {"b": "c"}]}\n{"kind": 1}\n', bytes(range(256))])
def test_a_mutation_is_alike_for_the_same_seed_whatever_the_file_holds(name: str, content: bytes) -> None:
    made = [MUTATIONS[name](content, Random(seed)) for seed in (*range(30), *range(30))]
    assert made[:30] == made[30:]


def test_most_mutations_change_the_file() -> None:
    for kind in FITTING:
        changed = [mutated(TEXT, kind, Random(seed))[0] != TEXT for seed in range(100)]
        assert sum(changed) > 80, kind


def test_an_archive_is_packed_again(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with ZipFile(path, "w") as archive:
        archive.writestr("one.json", "{}")
        archive.writestr("two.json", "{}")
    made = {MUTATIONS["members"](path.read_bytes(), Random(seed)) for seed in range(40)}
    assert len(made) > 10
    assert any(b"/etc/passwd" in one for one in made)


def _raises(error: BaseException) -> Callable[[Path], object]:
    def read(path: Path) -> object:
        raise error

    return read


@pytest.mark.parametrize(
    ("read", "result", "said"),
    [
        (lambda path: 1, "read", ""),
        (_raises(BadInput("why")), "refused", "lab: why"),
        (_raises(ValueError("no")), "", "ValueError: no (outside the lab)"),
        (_raises(KeyboardInterrupt()), "", "KeyboardInterrupt"),
        (_raises(RecursionError("deep")), "", "RecursionError: deep"),
    ],
)
def test_how_a_file_was_taken(read: Callable[[Path], object], result: str, said: str) -> None:
    kind = Kind("text", lambda folder, sound: None, "*", read)
    found = verdict(kind, Path("x"))
    assert found[0] == result
    assert found[1].startswith(said)


def test_faults_of_a_sort_are_told_once() -> None:
    broke = [{"case": f"world {n}", "why": f"KeyError: '{n}' (tasks/record.py:7)"} for n in range(3)]
    broke.append({"case": "world 9", "why": "ValueError: x (tasks/record.py:8)"})
    told = faults_in_words(broke, 100)
    assert told.startswith("4 of 100: 3 x world 0: KeyError: '0'")
    assert "1 x world 9: ValueError" in told
    assert faults_in_words([], 100) == ""


def test_there_is_a_kind_for_every_sort_of_file_that_a_command_is_given() -> None:
    from devtools.mutated_commands import READ_BY

    assert {command.kind for command in READ_BY} <= KINDS.keys()
    assert all(kind.content in FITTING for kind in KINDS.values())
