"""Members from a file: only for words that are typed, said before, and with a clear line for whatever cannot be."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.plugins import code_file
from lab.plugins.code_file import from_file, is_file_word, take
from lab.plugins.family import Family


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def family() -> Family[object]:
    def adopted(name: str, thing: object) -> object:
        if thing is None:
            raise BadInput("it is nothing")
        return thing

    return Family("gates", {"own": 1}, adopted)


def test_an_object_of_a_file_is_a_member() -> None:
    Path("mine.py").write_text("NUMBER = 7\n")
    told, members = list[str](), family()
    assert take(members, "./mine.py:NUMBER", told.append) == "mine.NUMBER"
    assert members["mine.NUMBER"] == 7
    assert take(members, "mine.py:NUMBER", told.append) == "mine.NUMBER"  # again: nothing is run
    assert told == [f"runs the code of {Path('mine.py').resolve()}"]
    assert code_file.files_taken() == {"mine.NUMBER": ("gates", f"{Path('mine.py').resolve()}:NUMBER")}


@pytest.mark.parametrize("word", ["ccrl", "mine.py", "mine.txt:Gate", "mine.py:", "mine.py:a b", "recorded:mine"])
def test_other_words_are_left_alone(word: str) -> None:
    assert not is_file_word(word)
    assert take(family(), word) == word


@pytest.mark.parametrize(
    ("text", "word", "fault"),
    [
        (None, "mine.py:Gate", "there is no file 'mine.py'"),
        ("Gates = 1", "mine.py:Gate", "unknown object 'Gate' (mine.py): did you mean 'Gates'? known: Gates"),
        ("1 / 0", "mine.py:Gate", "its code fails: ZeroDivisionError: division by zero"),
        ("def", "mine.py:Gate", "its code fails: SyntaxError"),
        ("raise SystemExit(3)", "mine.py:Gate", "its code fails: SystemExit: 3"),
        ("Gate = None", "mine.py:Gate", "mine.py:Gate: it is nothing"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(text: str | None, word: str, fault: str) -> None:
    if text is not None:
        Path("mine.py").write_text(text)
    members = family()
    with pytest.raises(BadInput) as error:
        take(members, word)
    assert fault in str(error.value)
    assert [*members] == ["own"]


def test_a_name_from_a_file_is_never_loaded_unasked() -> None:
    Path("mine.py").write_text("raise AssertionError")
    assert str(from_file("gate", "mine.Gate", "--gate")) == (
        "gate 'mine.Gate' (--gate): it came from a file, whose code is not run unasked: "
        "name it again, such as --gate ./mine.py:Gate (lab replay: --own ./mine.py:Gate)"
    )
    assert from_file("gate", "ccrl", "--gate") is None


def test_of_several_families_it_is_the_first_that_it_fits() -> None:
    Path("mine.py").write_text("NUMBER = 7\nNOTHING = None\n")

    def numbers(name: str, thing: object) -> object:
        if not isinstance(thing, int):
            raise BadInput("it is no number")
        return thing

    first, second = family(), Family("learners", {}, numbers)
    assert take([second, first], "mine.py:NUMBER") == "mine.NUMBER"
    assert ("mine.NUMBER" in second, "mine.NUMBER" in first) == (True, False)
    with pytest.raises(BadInput, match=r"mine\.py:NOTHING: it is no number, or it is nothing"):
        take([second, first], "mine.py:NOTHING")
