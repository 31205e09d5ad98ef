"""Pictures and pages as a notebook shows them, and as files."""

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from lab.errors import BadInput
from lab.files import write_whole

PAGE_HEIGHT = 480  # pixels of a page in a notebook


@dataclass(frozen=True)
class Picture:
    """A picture, PNG or SVG: shown in a notebook by itself, written by `save`."""

    data: bytes

    @classmethod
    def drawn(cls, draw: Callable[[Path], object], form: str = "svg") -> "Picture":
        """What a function draws into the file that it is given; form: "svg" or "png"."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"picture.{form}"
            draw(path)
            return cls(path.read_bytes())

    @property
    def form(self) -> str:
        """What it is: "png" or "svg"."""
        return "png" if self.data.startswith(b"\x89PNG") else "svg"

    def save(self, path: Path | str) -> Path:
        """Write it; BadInput for a name that does not end in .png or .svg, whichever it is."""
        return _written(Path(path), f".{self.form}", self.data)

    def _repr_png_(self) -> bytes | None:
        return self.data if self.form == "png" else None

    def _repr_svg_(self) -> str | None:
        return self.data.decode() if self.form == "svg" else None


@dataclass(frozen=True)
class Page:
    """A whole page (HTML) that needs no server and no network: shown in a notebook, Colab too, written by `save`."""

    html: str

    def save(self, path: Path | str) -> Path:
        """Write it, for any browser; BadInput for a name that does not end in .html."""
        return _written(Path(path), ".html", self.html.encode())

    def _repr_html_(self) -> str:
        frame = f'width="100%" height="{PAGE_HEIGHT}" style="border:0"'
        return f'<iframe srcdoc="{escape(self.html)}" {frame}></iframe>'


def _written(path: Path, suffix: str, data: bytes) -> Path:
    if path.suffix != suffix:
        raise BadInput(f"file '{path}': its name must end in {suffix}")
    try:
        write_whole(path, data)
    except OSError as error:
        raise BadInput(f"file '{path}' cannot be written: {error.strerror or error}") from error
    return path
