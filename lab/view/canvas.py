"""What all plots share: a palette, a style, and a figure that becomes a PNG file.

matplotlib is imported where it is used: it takes half a second. The same data gives the same bytes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito's palette, which colour-blind people can tell apart, and tints of it.
BLUE, SKY, ORANGE, RED, YELLOW = "#0072B2", "#8FCBEF", "#E69F00", "#D55E00", "#F0E442"
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


def check_png(path: Path) -> None:
    """Raise BadInput unless `path` ends in .png, its folder is there, and it is no folder itself."""
    if path.suffix.lower() != ".png":
        raise BadInput(f"picture '{path}': plots are written as .png")
    if not path.parent.is_dir():
        raise BadInput(f"picture '{path}': there is no folder '{path.parent}'")
    if path.is_dir():
        raise BadInput(f"picture '{path}': it is a folder, a file is wanted")


@contextmanager
def picture_file(path: Path, width_inch: float, height_inch: float) -> Iterator["Figure"]:
    """A figure in the lab's style, written to `path` when the block ends well.

    Raises BadInput as `check_png` does, and when the path cannot be written.
    """
    import matplotlib.style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    check_png(path)
    with matplotlib.style.context(STYLE, after_reset=True):
        figure = Figure(figsize=(width_inch, height_inch), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        drawn = BytesIO()
        figure.savefig(drawn, format="png", metadata={"Software": None})
    try:
        path.write_bytes(drawn.getvalue())
    except OSError as error:
        raise BadInput(f"picture '{path}' cannot be written: {error.strerror}") from error


def seconds(value: float) -> str:
    """Seconds for reading: "12.3 s", "12 s"."""
    return f"{value:.1f} s".replace(".0 s", " s")
