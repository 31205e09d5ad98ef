"""The base of all plots: palette, style, and a figure that is written as a PNG or SVG file.

matplotlib is imported where it is used: it takes half a second. The same data gives the same bytes.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from lab.errors import BadInput
from lab.files import write_whole
from lab.lazy import matplotlib

FORMS = ("png", "svg")
# Okabe and Ito's palette, which colour-blind people can tell apart, and tints of it.
BLUE, SKY, ORANGE, RED, YELLOW = "#0072B2", "#8FCBEF", "#E69F00", "#D55E00", "#F0E442"
GREEN, PURPLE = "#009E73", "#CC79A7"
INK, GREY, PALE_GREY, PALE_GREEN = "#222222", "#8C8C8C", "#EDEDED", "#CDE9DF"

STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.7,
    "hatch.color": GREY,
    "legend.frameon": False,
    "savefig.dpi": 130,
    "figure.dpi": 130,
}
SVG_STYLE: dict[str, Any] = {"svg.hashsalt": "lab", "svg.fonttype": "none"}  # text stays text: it can be searched
_TIP = "tip: "  # prefix of the id of a group; the rest of the id is the tooltip's text


def check_png(path: Path) -> None:
    """Raise BadInput unless `path` ends in .png, its folder exists, and it is not a folder itself."""
    _check_file(path, ("png",))


def check_picture(path: Path) -> None:
    """Raise BadInput unless `path` ends in .png or .svg, its folder exists, and it is not a folder itself."""
    _check_file(path, FORMS)


@contextmanager
def picture_file(
    path: Path, width_inch: float, height_inch: float, *, solved: bool = True
) -> Iterator["matplotlib.figure.Figure"]:
    """A figure in the lab's style, written to `path` (PNG or SVG by its suffix) when the block ends without an error.

    solved: whether matplotlib's layout solver runs; figures with many plots set their own margins, in a tenth of the time.

    Raises BadInput as `check_picture` does, and when the path cannot be written.
    """
    check_picture(path)
    drawn = BytesIO()
    with _figure(drawn, path.suffix[1:].lower(), (width_inch, height_inch), solved) as figure:
        yield figure
    try:
        write_whole(path, drawn.getvalue())
    except OSError as error:
        raise BadInput(f"picture '{path}' cannot be written: {error.strerror}") from error


def picture_bytes(draw: Callable[["matplotlib.figure.Figure"], None], width_inch: float, height_inch: float) -> bytes:
    """The SVG bytes of a figure in the lab's style on which `draw` has drawn."""
    drawn = BytesIO()
    with _figure(drawn, "svg", (width_inch, height_inch)) as figure:
        draw(figure)
    return drawn.getvalue()


def tip(artist: "matplotlib.artist.Artist", text: str) -> None:
    """Give an artist a tooltip, which browsers show in SVG pictures; PNG pictures have none."""
    artist.set_gid(_TIP + text.replace('"', "'"))


def seconds(value: float) -> str:
    """A time for reading, such as "12.3 s" or "12 s"."""
    return f"{value:.1f} s".replace(".0 s", " s")


@contextmanager
def _figure(
    out: BytesIO, form: str, size_inch: tuple[float, float], solved: bool = True
) -> Iterator["matplotlib.figure.Figure"]:
    """A figure whose bytes are in `out` when the block ends without an error; reproducible, without dates or random ids."""
    with matplotlib.style.context(STYLE | SVG_STYLE, after_reset=True):
        figure = matplotlib.figure.Figure(figsize=size_inch, layout="constrained" if solved else None)
        matplotlib.backends.backend_agg.FigureCanvasAgg(figure)
        yield figure
        if form == "png":
            figure.savefig(out, format="png", metadata={"Software": None})
            return
        plain = BytesIO()
        figure.savefig(plain, format="svg", metadata={"Date": None, "Creator": None})
    out.write(_with_tips(plain.getvalue().decode()).encode())


def _with_tips(svg: str) -> str:
    """The SVG in which each group whose id is a tip has the tip as its title element, which browsers show."""
    return re.sub(f'<g id="{_TIP}([^"]*)">', r"<g><title>\1</title>", svg)


def _check_file(path: Path, forms: tuple[str, ...]) -> None:
    if path.suffix[1:].lower() not in forms:
        raise BadInput(f"picture '{path}': plots are written as {' or '.join(f'.{form}' for form in forms)}")
    if not path.parent.is_dir():
        raise BadInput(f"picture '{path}': there is no folder '{path.parent}'")
    if path.is_dir():
        raise BadInput(f"picture '{path}': it is a folder, a file is wanted")
