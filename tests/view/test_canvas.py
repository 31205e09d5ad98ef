"""The canvas: PNG and SVG files, the same bytes for the same data, words that can be searched and pointed at."""

from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import pytest

from lab.errors import BadInput
from lab.view.canvas import check_picture, check_png, picture_bytes, picture_file, seconds, tip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SVG = "{http://www.w3.org/2000/svg}"


def draw(figure: "Figure") -> None:
    axes = figure.add_subplot()
    (bar,) = axes.bar([0], [1], hatch="//", label="a < b")
    tip(bar, 'toast 1: "a" < b & c')
    figure.legend()


@pytest.mark.parametrize("form", ["png", "svg"])
def test_same_data_same_bytes_in_a_file_or_not(tmp_path: Path, form: str) -> None:
    paths = [tmp_path / f"plot.{form.upper()}", tmp_path / f"again.{form}"]
    for path in paths:
        with picture_file(path, 3, 2) as figure:
            draw(figure)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert form == "png" or paths[0].read_bytes() == picture_bytes(draw, 3, 2)


def test_svg_keeps_words_and_has_no_date() -> None:
    picture = picture_bytes(draw, 3, 2)
    root = ElementTree.fromstring(picture)
    assert root.tag == f"{SVG}svg"
    assert "a < b" in {"".join(text.itertext()) for text in root.iter(f"{SVG}text")}
    assert not [element for element in root.iter() if element.tag.endswith("date")]


def test_a_tip_is_the_title_of_its_group_and_no_id() -> None:
    root = ElementTree.fromstring(picture_bytes(draw, 3, 2))
    (group,) = [group for group in root.iter(f"{SVG}g") if group.find(f"{SVG}title") is not None]
    assert group.findtext(f"{SVG}title") == "toast 1: 'a' < b & c"
    assert "id" not in group.attrib
    assert group.find(f"{SVG}path") is not None


def test_nothing_is_written_when_the_drawing_fails(tmp_path: Path) -> None:
    with pytest.raises(KeyError), picture_file(tmp_path / "plot.svg", 3, 2):
        raise KeyError
    assert not list(tmp_path.iterdir())


def test_what_is_no_picture(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"x\.pdf': plots are written as \.png or \.svg$"):
        check_picture(Path("x.pdf"))
    with pytest.raises(BadInput, match=r"x\.svg': plots are written as \.png$"):
        check_png(Path("x.svg"))
    with pytest.raises(BadInput, match="there is no folder"):
        check_picture(tmp_path / "missing" / "x.svg")
    (tmp_path / "folder.svg").mkdir()
    with pytest.raises(BadInput, match="it is a folder"):
        check_picture(tmp_path / "folder.svg")


def test_the_global_style_is_left_alone() -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    picture_bytes(draw, 3, 2)
    assert dict(matplotlib.rcParams) == before


def test_seconds() -> None:
    assert [seconds(513), seconds(12.34), seconds(10.04)] == ["513 s", "12.3 s", "10 s"]


def test_a_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    """A folder that somebody else gave may hold one that leads out of it."""
    (tmp_path / "elsewhere").write_text("dear")
    (tmp_path / "plot.svg").symlink_to(tmp_path / "elsewhere")
    with picture_file(tmp_path / "plot.svg", 3, 2) as figure:
        draw(figure)
    assert (tmp_path / "elsewhere").read_text() == "dear"
    assert (tmp_path / "plot.svg").read_bytes() == picture_bytes(draw, 3, 2)
