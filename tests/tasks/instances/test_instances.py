"""How a format is told by the content; and that damage, of any kind, is one clear line and no traceback."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.tasks.cell_file import toml_of
from lab.tasks.instances import INSTANCES, InstanceRequest, format_of, is_instance, read_instance, takes_case
from lab.tasks.instances.source import Source
from lab.tasks.toml_text import TomlText

TEXTS = {  # one of each format
    "jsplib": "2 2\n0 3 1 2\n1 4 0 1\n",
    "taillard": "2 2\n3 2\n4 1\n1 2\n2 1\n",
    "fjsplib": "2 3 1.5\n2 2 1 3 2 5 1 3 4\n1 1 2 7\n",
    "bilge-ulusoy": "set,job,operation,machine,time\n7,1,1,M1,8\n7,1,2,M2,16\n",
    "phillips-unger": "tank,soak_min,soak_max,move_from_previous\n1,150,200,31\nunload,,,30\n",
    "hoist": "Ninner = 1;\ntmin = [150];\ntmax = [200];\nf = [31, 30];\ne = [| 11, 0 | 19, 3 |];\n",
    "jobshoplab": "instance_config:\n  instance:\n    specification: |\n      (m0,t)\n      j0|(0,3)\n"
    "  logistics:\n    specification: |\n      m-0|in-buf|out-buf\n      m-0|0 1 2\n      in-buf|1 0 3\n      out-buf|2 3 0\n",
    "pyjobshop": '{"jobs": [{"tasks": [0]}],\n "resources": [{"type": "machine"}],\n "tasks": [{"job": 0}],\n'
    ' "modes": [{"task": 0, "resources": [0], "duration": 3, "demands": [0]}]}\n',
}
LAYOUT = "from,to,time\nload,1,31\n1,load,11\n1,1,0\nunload,load,19\nunload,1,3\n"
SHOP_LAYOUT = "from,to,time\nLU,M1,6\nLU,M2,8\nM1,LU,12\nM1,M2,6\nM2,LU,10\nM2,M1,6\n"
MARKS = st.sampled_from([*"0123456789.,-|[](){}:;=*&!%#\"'\n \t\0é", "1e9", "99999999", "NaN", "\n\n", "[[", "x"])


def test_there_is_a_text_for_each_format() -> None:
    assert TEXTS.keys() == INSTANCES.keys()


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("ending", ["txt", "data"])
def test_a_format_is_told_by_its_content(tmp_path: Path, name: str, ending: str) -> None:
    path = tmp_path / f"mine.{ending}"
    path.write_text(TEXTS[name])
    assert format_of(Source(path, TEXTS[name])) == name
    assert takes_case(path, InstanceRequest()) == (name == "bilge-ulusoy")


@pytest.mark.parametrize("name", [name for name in TEXTS if name != "phillips-unger"])
def test_the_toml_of_an_instance_reads_as_the_same(tmp_path: Path, name: str) -> None:
    path = tmp_path / "mine"
    path.write_text(TEXTS[name])
    file = read_instance(path)
    again = type(file).checked(TomlText.parsed(Path("mine.toml"), toml_of(file)))
    assert again.model_dump() == file.model_dump()


def test_grids_and_the_labs_own_files_are_no_instances(tmp_path: Path) -> None:
    grid = tmp_path / "grid.txt"
    grid.write_text("S.#\n..G\n")
    assert not is_instance(grid)
    assert not is_instance(tmp_path / "cell.toml")
    grid.write_text("# la01\n10 5\n")
    assert is_instance(grid)


@pytest.mark.parametrize("text", ["", "\n\n", "what\nis this\n", "a,b,c\n1,2,3\n"])
def test_what_is_none_of_them_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(text)
    with pytest.raises(BadInput, match=r"mine\.csv: line 1: wanted an instance \(jsplib, "):
        read_instance(path)


def test_a_long_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "long.jsp"
    path.write_text("0 1 " * 300_000)
    with pytest.raises(BadInput, match="1200000 characters: an instance has up to 1000000"):
        read_instance(path)


@st.composite
def damaged(draw: st.DrawFn) -> str:
    """A text of some format with pieces left out, doubled, or put in; now and then cut off."""
    text = TEXTS[draw(st.sampled_from([*TEXTS]))]
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(text)))
        end = min(len(text), at + draw(st.integers(0, 12)))
        put = draw(st.one_of(st.just(""), MARKS, st.just(text[at:end] * 2), st.text(max_size=4)))
        text = text[:at] + put + text[end:]
    return text if draw(st.integers(0, 5)) < 5 else text[: draw(st.integers(0, len(text)))]


@settings(max_examples=60, deadline=None)
@given(text=damaged(), beside=st.sampled_from([(None, None), (None, None), (None, LAYOUT), (2, SHOP_LAYOUT)]))
def test_a_damaged_file_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, text: str, beside: tuple[int | None, str | None]
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    (robots, times), path = beside, folder / "mine"
    layout = None if times is None else folder / "layout.csv"
    path.write_bytes(text.encode(errors="replace"))
    if layout is not None and times is not None:
        layout.write_text(times)
    try:
        file = read_instance(path, InstanceRequest(layout, robots))
    except BadInput as error:
        refusal = str(error)
    else:
        again = type(file).checked(TomlText.parsed(folder / "mine.toml", toml_of(file)))
        assert again.model_dump() == file.model_dump()
        return
    assert str(folder) in refusal or "--robots" in refusal
    assert len(refusal.splitlines()) == 1
