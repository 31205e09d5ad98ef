"""The websocket of a browser: its next message, and functions that send to it and close it, also when it has left."""

from collections.abc import Awaitable, Callable
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from lab.classroom.room import OVER, REMOVED

REASONS = {OVER: "the class has ended", REMOVED: "your teacher has closed this seat"}


def sender(browser: WebSocket) -> Callable[[str | bytes], Awaitable[None]]:
    """A function that sends text to a browser, and does nothing once that has left."""

    async def send(text: str | bytes) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            await browser.send_text(text if isinstance(text, str) else text.decode())

    return send


async def text_of(browser: WebSocket) -> str:
    """The next message of a browser; "" for one that is no text. Raises WebSocketDisconnect."""
    message = await browser.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005))
    return str(message.get("text") or "")


def closer(browser: WebSocket) -> Callable[[int], Awaitable[None]]:
    """A function that closes a browser's connection with a code."""

    async def close(code: int) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            if browser.application_state is WebSocketState.CONNECTED:
                await browser.close(OVER if code in REASONS else code, REASONS.get(code))

    return close
