"""What one page has to be told: what is where in the scene, and what the panel has that is new; sent as it can take it."""

import asyncio
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect

PAUSE_S = 1 / 60  # between two messages to a page
ENDED = "the run has ended"


@dataclass
class News:
    """What a page has to be told: a whole new scene, or None, and after it what is where, in which colour, visible."""

    scene: Mapping[str, Any] | None = None
    time_s: float | None = None
    poses: dict[str, tuple[float, ...]] = field(default_factory=dict)
    colors: dict[str, tuple[float, ...]] = field(default_factory=dict)
    visible: dict[str, bool] = field(default_factory=dict)

    def merge(self, later: "News") -> None:
        """Take over what `later` says; its scene, if it has one, ends what was known."""
        if later.scene is not None:
            self.scene = later.scene
            self.poses, self.colors, self.visible = {}, {}, {}
        self.time_s = self.time_s if later.time_s is None else later.time_s
        self.poses.update(later.poses)
        self.colors.update(later.colors)
        self.visible.update(later.visible)

    def text(self) -> str:
        """The JSON members "scene", when there is one, and "frame" of a message of `page.js`."""
        frame = {"time_s": self.time_s, "poses": self.poses, "colors": self.colors, "visible": self.visible}
        scene = "" if self.scene is None else f'"scene": {json.dumps(self.scene)}, '
        return f'{scene}"frame": {json.dumps(frame)}'


class Panel(Protocol):
    """What pages show and say beside the scene; all of it is called in the server's thread.

    files: what a page loads for it: HTML that is put into the page, style sheets, and scripts in the order they are run.
    """

    files: Sequence[Path]

    def joined(self, page: int) -> None:
        """A browser has opened the page; each one has a number of its own."""

    def left(self, page: int) -> None:
        """A browser has left."""

    def said(self, page: int, message: str | bytes) -> None:
        """What a page sends, whatever that is."""

    def stirred(self) -> bool:
        """Whether there is something new since this was asked last."""

    def news(self, page: int) -> str:
        """The JSON members that this page does not know yet; "" when it knows all."""


class Page:
    """What waits for one page, and the task that sends it; `last`: then the connection is closed."""

    def __init__(self, number: int, socket: WebSocket, panel: Panel | None) -> None:
        self.number, self.socket, self._panel = number, socket, panel
        self.wake, self.last = asyncio.Event(), False
        self.sending: asyncio.Task[None]
        self._waiting: News | None = None

    def offer(self, news: News) -> None:
        """Send `news` as soon as the page can take it, together with what waits already."""
        self._waiting = self._waiting or News()
        self._waiting.merge(news)
        self.wake.set()

    async def send(self) -> None:
        """Send what waits whenever there is something, until the page has left, or was sent the last."""
        try:
            while True:
                self.wake.clear()
                if text := self._text():
                    await self.socket.send_text(text)
                    await asyncio.sleep(PAUSE_S)
                elif self.last:
                    break
                else:
                    await self.wake.wait()
            await self.socket.close(1001, ENDED)
        except (WebSocketDisconnect, RuntimeError):  # it has left
            return

    def _text(self) -> str:
        """The message to send now, "" for none."""
        members = [] if self._waiting is None else [self._waiting.text()]
        self._waiting = None
        if self._panel is not None and (news := self._panel.news(self.number)):
            members.append(news)
        return f"{{{', '.join(members)}}}" if members else ""
