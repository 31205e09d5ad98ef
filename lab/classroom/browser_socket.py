"""What a class's server does with a browser's websocket: send to it, and close it, also when the browser has left."""

from collections.abc import Awaitable, Callable
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from lab.classroom.room import OVER


def sender(browser: WebSocket) -> Callable[[str | bytes], Awaitable[None]]:
    """A function that sends text to a browser, and does nothing once that has left."""

    async def send(text: str | bytes) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            await browser.send_text(text if isinstance(text, str) else text.decode())

    return send


def closer(browser: WebSocket) -> Callable[[int], Awaitable[None]]:
    """A function that closes a browser's connection with a code."""

    async def close(code: int) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            if browser.application_state is WebSocketState.CONNECTED:
                await browser.close(code, "the class has ended" if code == OVER else None)

    return close
