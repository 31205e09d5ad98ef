"""Where a class is found, and the files that it serves: the same to everybody, with nothing of the class itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lab.seat.page.page_panel import SeatPanel
from lab.view.meshcat import SERVED, page_files
from lab.view.server import File

HERE = Path(__file__).parent
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self' {sockets}; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@dataclass(frozen=True)
class Place:
    """Where a class is found: the address that is bound, and the host names in pupils' addresses.

    secured: whether over TLS, with `certificate` and `key` (PEM files), or with ones that are made for the class.
    """

    address: str = "127.0.0.1"
    hosts: tuple[str, ...] = ("127.0.0.1", "localhost")
    secured: bool = False
    certificate: Path | None = None
    key: Path | None = None

    @property
    def scheme(self) -> str:
        """Of the class's addresses."""
        return "https" if self.secured else "http"


def files_of(hosts: Sequence[str], port: int, of_study: bool = False) -> dict[str, dict[str, File]]:
    """The files by the first part of their address and the rest of it; hosts, port: to which pages may open websockets.

    of_study: with the page of a study's steps, and a page to join on which nobody types a name.
    """
    sockets = " ".join(f"{scheme}://{host}:{port}" for host in hosts for scheme in ("ws", "wss"))
    policy = POLICY.format(sockets=sockets)

    def file(name: str) -> File:
        return File((HERE / name).read_bytes(), KINDS[Path(name).suffix], policy)

    shared = {
        name: file(name) for name in ("class.css", "join.js", "teacher.js", "teacher_tile.js", "teacher_teams.js")
    }
    desk = page_files("Teaching lab", [*SeatPanel.files, *(HERE / f"class_bar{kind}" for kind in KINDS)])
    desk[""] = File(desk[""].content, desk[""].kind, SERVED.replace("ws://127.0.0.1:* ws://localhost:*", sockets))
    steps = {name: file(name) for name in ("class.css", "step.css", "step_items.js", "step.js")} | {
        "": file("step.html")
    }
    join = file("join_study.html" if of_study else "join.html")
    rooms = {"": shared | {"": join}, "teacher": shared | {"": file("teacher.html")}, "desk": desk}
    return rooms | ({"step": steps} if of_study else {})
