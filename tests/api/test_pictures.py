"""Pictures and pages: as a notebook asks for them, and as files."""

from pathlib import Path

import pytest

from lab.api.pictures import Page, Picture
from lab.errors import BadInput

PNG = b"\x89PNG\r\n\x1a\n..."


def test_a_notebook_gets_the_one_or_the_other() -> None:
    assert (Picture(PNG)._repr_png_(), Picture(PNG)._repr_svg_()) == (PNG, None)
    assert (Picture(b"<svg/>")._repr_png_(), Picture(b"<svg/>")._repr_svg_()) == (None, "<svg/>")


def test_what_a_page_says_cannot_end_its_frame(tmp_path: Path) -> None:
    page = Page('<p title="x">1 < 2</p></iframe>')
    shown = page._repr_html_()
    assert shown.count("</iframe>") == 1
    assert 'srcdoc="&lt;p title=&quot;x&quot;&gt;1 &lt; 2&lt;/p&gt;&lt;/iframe&gt;"' in shown
    assert page.save(tmp_path / "page.html").read_text(encoding="utf-8") == page.html


@pytest.mark.parametrize(
    ("name", "fault"),
    [("picture.svg", "its name must end in .png"), ("no-such-folder/picture.png", "cannot be written")],
)
def test_a_file_that_cannot_be(name: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=fault):
        Picture(PNG).save(tmp_path / name)
