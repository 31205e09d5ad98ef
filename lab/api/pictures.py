"""Pictures and pages, which notebooks display and `save` writes to files."""

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from lab.errors import BadInput, check_value
from lab.files import write_whole

PAGE_HEIGHT = 480  # pixels of a page in a notebook


@dataclass(frozen=True)
class Picture:
    """A picture; notebooks display it, and `save` writes it.

    data: the bytes of a PNG or SVG file.

        >>> import lab
        >>> picture = lab.sequence("toast-case-1", toasts=1).gantt
        >>> picture.form, picture.data[:5]
        ('svg', b'<?xml')
    """

    data: bytes

    @classmethod
    def drawn(cls, draw: Callable[[Path], object], form: str = "svg") -> "Picture":
        """The picture that a function draws into the file at the path that it is called with; form: "svg" or "png"."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"picture.{form}"
            draw(path)
            return cls(path.read_bytes())

    @property
    def form(self) -> str:
        """The format: "png" or "svg"."""
        return "png" if self.data.startswith(b"\x89PNG") else "svg"

    def save(self, path: Path | str) -> Path:
        """Writes the picture and returns the path. Raises BadInput unless the name ends in .png or .svg, as `form` says."""
        return _written(path, f".{self.form}", self.data)

    def _repr_png_(self) -> bytes | None:
        return self.data if self.form == "png" else None

    def _repr_svg_(self) -> str | None:
        return self.data.decode() if self.form == "svg" else None


@dataclass(frozen=True)
class Page:
    """An HTML page that needs neither server nor network; notebooks (Colab too) display it, and `save` writes it.

    html: its text.

        >>> import lab
        >>> lab.show(lab.world("S..G")).html[:15]
        '<!DOCTYPE html>'
    """

    html: str

    def save(self, path: Path | str) -> Path:
        """Writes the page and returns the path. Raises BadInput unless the name ends in .html."""
        return _written(path, ".html", self.html.encode())

    def _repr_html_(self) -> str:
        frame = f'width="100%" height="{PAGE_HEIGHT}" style="border:0"'
        return f'<iframe srcdoc="{escape(self.html)}" {frame}></iframe>'


def _written(where: Path | str, suffix: str, data: bytes) -> Path:
    check_value("file", where, Path, "save")
    path = Path(where)
    if path.suffix != suffix:
        raise BadInput(f"file '{path}': its name must end in {suffix}")
    try:
        write_whole(path, data)
    except OSError as error:
        raise BadInput(f"file '{path}' cannot be written: {error.strerror or error}") from error
    return path
