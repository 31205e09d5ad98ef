"""Lines of TOML text: every value is found on the line where it stands."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.toml_text import Loc, TomlText, explain, lines_of

TEXT = '''\
# a comment with a "quote and [a bracket
name = "x"          # line 2
"odd key".b.'c d' = 1
list = [
  1, 2,

  { a = 1, b = [ "]", 3 ] },  # line 7
]

[table]
long = """
[not.a.table] # nor a comment
quoted \\""" = 1 """""
inner = { x = { y = 2 } }
raw = \'\'\'
key = 'no'\'\'\'

[[many]]
a = 1
[many.sub]
b = 2
[[many.of]]
[[many]]
[[many.of]]
c = [[1], [
2]]
'''
LINES: dict[Loc, int] = {
    ("name",): 2,
    ("odd key",): 3,
    ("odd key", "b"): 3,
    ("odd key", "b", "c d"): 3,
    ("list",): 4,
    ("list", 0): 5,
    ("list", 1): 5,
    ("list", 2): 7,
    ("list", 2, "a"): 7,
    ("list", 2, "b"): 7,
    ("list", 2, "b", 0): 7,
    ("list", 2, "b", 1): 7,
    ("table",): 10,
    ("table", "long"): 11,
    ("table", "inner"): 14,
    ("table", "inner", "x"): 14,
    ("table", "inner", "x", "y"): 14,
    ("table", "raw"): 15,
    ("many",): 18,
    ("many", 0): 18,
    ("many", 0, "a"): 19,
    ("many", 0, "sub"): 20,
    ("many", 0, "sub", "b"): 21,
    ("many", 0, "of"): 22,
    ("many", 0, "of", 0): 22,
    ("many", 1): 23,
    ("many", 1, "of"): 24,
    ("many", 1, "of", 0): 24,
    ("many", 1, "of", 0, "c"): 25,
    ("many", 1, "of", 0, "c", 0): 25,
    ("many", 1, "of", 0, "c", 0, 0): 25,
    ("many", 1, "of", 0, "c", 1): 25,
    ("many", 1, "of", 0, "c", 1, 0): 26,
}


def toml(text: str) -> TomlText:
    return TomlText.parsed(Path("mine.toml"), text)


def ways(value: Any, loc: Loc = ()) -> set[Loc]:
    """The way to every table, key and element of a document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return {loc, *(way for key, one in inner for way in ways(one, (*loc, key)))}


def test_every_value_stands_on_its_line() -> None:
    assert lines_of(TEXT) == LINES
    assert {(), *LINES} == ways(toml(TEXT).raw)


@pytest.mark.parametrize("path", sorted(tasks_folder().glob("*.toml")), ids=lambda path: path.stem)
def test_all_of_every_file_that_ships_is_found(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    found = lines_of(text)
    assert {(), *found} == ways(toml(text).raw)
    rows = text.split("\n")
    for loc, line in found.items():
        if isinstance(loc[-1], str):
            assert loc[-1] in rows[line - 1]


WORDS = st.sampled_from(["a", "b", '"q]"', "'l='"])
SCALARS = st.sampled_from(["1", "-2.5e3", "true", '"}"', "'#'", '""', '"""\n"a"\n"""', "1979-05-27 07:32:00", "nan"])


@st.composite
def values(draw: st.DrawFn, depth: int = 2) -> str:
    """The text of a value."""
    kind = draw(st.sampled_from(["scalar", "array", "table"])) if depth else "scalar"
    if kind == "scalar":
        return draw(SCALARS)
    inner = draw(st.lists(values(depth - 1), max_size=3))
    if kind == "array":
        return "[" + draw(st.sampled_from([", ", ",\n", " # ]\n,"])).join(inner) + "\n]"
    keys = draw(st.lists(WORDS, min_size=len(inner), max_size=len(inner), unique=True))
    return "{" + ", ".join(f"{key} = {value}" for key, value in zip(keys, inner, strict=True)) + "}"


@given(st.lists(st.tuples(st.sampled_from(["", "[{}]\n", "[[{}]]\n"]), st.lists(values(), max_size=3)), max_size=4))
def test_all_of_any_document_is_found(parts: list[tuple[str, list[str]]]) -> None:
    text = ""
    for number, (header, inner) in enumerate(parts):
        text += header.format("many" if "[[" in header else f"t{number}.u")
        text += "".join(f"k{number}.x{place} = {value}\r\n" for place, value in enumerate(inner))
    document = toml(text)
    assert {(), *lines_of(text)} == ways(document.raw)


def test_what_is_not_in_the_file_stands_where_it_should_be() -> None:
    document = toml(TEXT)
    assert document.line(("many", 1, "of", 0, "missing", "x")) == 24
    assert document.line(("many", 5)) == 18
    assert document.line(("missing", 1)) is None
    assert document.line(()) is None
    assert str(document.refusal(("list", 2, "a"), "no")) == "mine.toml: line 7: no"
    assert str(document.refusal(("missing",), "no")) == "mine.toml: no"


@given(st.text(alphabet="a=[]{}\"'.,#\\\n 1", max_size=30))
def test_any_text_has_lines_or_is_bad_input(text: str) -> None:
    found, message = lines_of(text), ""  # never raises, and ends
    try:
        assert {(), *found} == ways(toml(text).raw)
    except BadInput as error:
        message = str(error)
    assert message.startswith("mine.toml: not valid TOML: ") or not message


def test_a_nest_beyond_all_bounds_has_some_lines() -> None:
    assert lines_of("a = 1\nb = " + "[" * 100_000)[("a",)] == 1


@pytest.mark.parametrize("part", ["a", "'a b'", '"a.b"', "a "])
def test_a_key_of_too_many_parts_is_refused_before_it_is_read(part: str) -> None:
    long = f"x = 1\n{'.'.join([part] * 20_000)} = 1\n"
    with pytest.raises(BadInput, match=r"^some\.toml: line 2: a key of more than 100 parts$"):
        TomlText.parsed(Path("some.toml"), long)
    assert TomlText.parsed(Path("some.toml"), f"{'.'.join([part] * 100)} = 1\n# {'.' * 200}\nn = [0.1, 0.2]\n").raw


def test_a_long_bad_value_is_cut() -> None:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(dict[str, int]).validate_python({"a": "x" * 1000})
    assert explain(caught.value).startswith("a: Input should be a valid integer")
    assert explain(caught.value).endswith("xxx ...)")
    assert len(explain(caught.value)) < 250


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\n" * 200_000, "200000 keys and tables, 0 commas: allowed are 100000 and 2500000"),
        ("[a]\n" * 200_000, "200000 keys and tables"),
        ("a = [" + "1," * 2_600_000 + "]", "1 keys and tables, 2600000 commas"),
        (f"x = 1\na = {2**63}\n", "line 2: a: a whole number beyond 64 bits"),
        (f"a = [1, {{ b = -{'9' * 400} }}]\n", "line 1: a.1.b: a whole number beyond 64 bits"),
        ("a = 0xffff_ffff_ffff_ffff\n", "line 1: a: a whole number beyond 64 bits"),
    ],
)
def test_what_takes_seconds_or_is_no_number_of_toml_is_refused(text: str, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        TomlText.parsed(Path("mine.toml"), text)
    assert str(caught.value).startswith(f"mine.toml: {said}")


def test_large_numbers_and_long_texts_are_taken() -> None:
    text = f'a = {2**63 - 1}\nb = 1.2345678901234567890123\nc = "{"9" * 40}"\nd = 1e300\n'
    assert TomlText.parsed(Path("mine.toml"), text).raw["a"] == 2**63 - 1
