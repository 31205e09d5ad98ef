"""Lazy imports of the server of a live page: it loads starlette and uvicorn, which only a served page needs."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from lab.view.server import File, Server
    from lab.view.server_page import News, ScenePanel

TABLE = {"lab.view.server": ("File", "Server"), "lab.view.server_page": ("News", "ScenePanel")}

if not TYPE_CHECKING:  # so that mypy knows the names of the table alone
    __getattr__ = loader(__name__, TABLE)
