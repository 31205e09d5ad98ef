"""The teaching page inside a notebook's cell: in Jupyter, VS Code and Colab, while the cell runs."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import Any
from urllib.parse import urlsplit

from lab.errors import BadInput, LabError
from lab.optional import optional
from lab.seat.lesson_seat import LessonSeat
from lab.seat.page.teaching_page import SeatPage
from lab.seat.run_progress import RunProgress
from lab.view.framing import Framing
from lab.view.progress import EscapingConsole

WHERE = "advisor 'web' (lab.teach)"
HEIGHT = 640  # pixels of the page in a cell
LOOPBACK = ("http://127.0.0.1:*", "http://localhost:*", "https://127.0.0.1:*", "https://localhost:*")
VS_CODE = ("vscode-webview:", "vscode-file:")
COLAB = Framing(
    ("https://colab.research.google.com", "https://*.googleusercontent.com", "https://*.colab.dev"),
    ("*.googleusercontent.com", "*.colab.dev"),
    polls=True,  # Colab's proxy passes no websockets
)
WANTED = 'wanted an address with {port} in its path, such as "https://hub.example.org/user/me/proxy/{port}/"'
ADDRESS = re.compile(r"https?://[\w.:-]+/([\w.~%@+/-]*/)?\{port\}(/[\w.~%@+/-]*)?")
OVER = "The lesson was taught here: its page is closed, and its address is no longer valid."


@dataclass(frozen=True)
class NotebookPlace:
    """Where a notebook's browser finds a page of the kernel's computer.

    address: with the place {port}; "" for Colab, which gives the address of each port.
    """

    framing: Framing
    address: str = "http://127.0.0.1:{port}/"

    def url(self, port: int, token: str) -> str:
        """The address of a page with its token."""
        if self.address:
            return f"{self.address.replace('{port}', str(port))}?token={token}"
        with optional(WHERE):
            from google.colab.output import eval_js

        return f"{str(eval_js(f'google.colab.kernel.proxyPort({port})')).rstrip('/')}/?token={token}"


def notebook_place(page: str | None) -> NotebookPlace:
    """The place of pages for the notebook that this code runs in; page: their address, None if it is to be found out.

    Raises BadInput outside a notebook, for an address without {port}, and on a JupyterHub without an address.
    """
    if not in_notebook():
        raise BadInput(
            f"{WHERE}: its page is shown in the cell of a notebook, and this is none: use the command "
            "lab teach ... --advisor web"
        )
    if page is not None:
        return _proxied(page)
    if "google.colab" in sys.modules:
        return NotebookPlace(COLAB, "")
    if prefix := os.environ.get("JUPYTERHUB_SERVICE_PREFIX"):
        raise BadInput(
            "page None (lab.teach): this kernel runs on a JupyterHub, whose address a notebook does not know: with "
            f'jupyter-server-proxy installed there, wanted page="https://YOUR-HUB{prefix}proxy/{{port}}/"'
        )
    return NotebookPlace(Framing((*LOOPBACK, *VS_CODE)))


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def _proxied(page: str) -> NotebookPlace:
    """The place behind a proxy with this address. Raises BadInput."""
    where = f"page {page!r} (lab.teach)"
    try:
        parts = urlsplit(page)
        host, number = parts.hostname, parts.port
    except (ValueError, AttributeError):
        raise BadInput(f"{where}: {WANTED}") from None
    if not (parts.scheme in ("http", "https") and host and ADDRESS.fullmatch(page)):
        raise BadInput(f"{where}: {WANTED}")
    origin = f"{parts.scheme}://{host}" if number is None else f"{parts.scheme}://{host}:{number}"
    framing = Framing((origin, *LOOPBACK, *VS_CODE), (host,), origin)
    return NotebookPlace(framing, f"{page.rstrip('/')}/")


@contextmanager
def cell_seat(page: str | None) -> Iterator[LessonSeat]:
    """The seat of a lesson whose page is shown in the cell that runs; page: see `notebook_place`.

    When the lesson is over, a line takes the place of the page, so that a saved notebook holds no address with a token.
    """
    place = notebook_place(page)
    with SeatPage(framing=place.framing) as shown:
        cell = _show(place.url(shown.port, shown.token))
        seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), None, shown)
        try:
            yield seat
        except LabError as error:
            shown.finished(str(error))
            raise
        finally:
            seat.clear_scene()
            cell.update({"text/html": f"<p>{OVER}</p>", "text/plain": OVER}, raw=True)


def _show(url: str) -> Any:
    """Show the page at an address in the cell's output; returns IPython's handle, whose `update` replaces it."""
    with optional(WHERE):
        from IPython.display import display

    frame = (
        f'<iframe src="{escape(url)}" width="100%" height="{HEIGHT}" style="border:0" title="Teaching lab"></iframe>'
    )
    link = (
        f'<p><a href="{escape(url)}" target="_blank" rel="noopener noreferrer">The page in a window of its own</a></p>'
    )
    return display({"text/html": frame + link, "text/plain": f"page: {url}"}, raw=True, display_id=True)
