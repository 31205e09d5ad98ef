"""The door of a class: who has the code gets a seat; wrong codes are limited, and the teacher may close it."""

import asyncio
import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse

from lab.classroom.roster import Full

MOST_BODY = 2048  # bytes of a request to join
BODY_S = 10.0  # time within which it must have arrived
WRONG_S = 60.0
# wrong codes in WRONG_S: from one address, behind which a whole school may be, and from all, of which somebody may have many
WRONG, ALL_WRONG = 60, 300


@dataclass
class Often:
    """A limit: something may happen at most `most` times in `seconds`."""

    most: int
    seconds: float
    times: deque[float] = field(default_factory=deque)

    def is_full(self, now_s: float) -> bool:
        """Whether it may not happen now."""
        while self.times and self.times[0] <= now_s - self.seconds:
            self.times.popleft()
        return len(self.times) >= self.most

    def happened(self, now_s: float) -> None:
        """Count it."""
        self.times.append(now_s)


class Door:
    """Where pupils come in.

    joined: what is said to a new pupil with a code and a name, None for a wrong code; it raises Full, and OSError. clock: the
    time [s], for the limits.

    is_open: whether anybody may join. tried: whether so many wrong codes came that some or all addresses have to wait.
    """

    def __init__(
        self, joined: Callable[[str, str], dict[str, Any] | None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.is_open = True
        self._joined, self._clock = joined, clock
        self._all = Often(ALL_WRONG, WRONG_S)
        self._wrong: dict[str, Often] = {}  # by address

    @property
    def tried(self) -> bool:
        """Whether somebody has to wait."""
        now_s = self._clock()
        return self._all.is_full(now_s) or any(wrong.is_full(now_s) for wrong in self._wrong.values())

    async def join(self, request: Request) -> JSONResponse:
        """A new pupil's address, for the right code."""
        address = request.client.host if request.client else ""
        if (refusal := self._refusal(address)) is not None:
            return refusal
        try:
            body = await asyncio.wait_for(_body(request), BODY_S)
        except (TimeoutError, ClientDisconnect):
            return JSONResponse({"error": "The request to join took too long."}, 408)
        if len(body) > MOST_BODY:
            return JSONResponse({"error": "That is no request to join."}, 413)
        try:
            said = json.loads(body)
            code, name = str(said["code"]), str(said.get("name", ""))
        except (ValueError, RecursionError, TypeError, KeyError, AttributeError):
            return JSONResponse({"error": "That is no request to join."}, 400)
        return self._refusal(address) or self._answer(address, code, name)  # much may have come while the body did

    def _answer(self, address: str, code: str, name: str) -> JSONResponse:
        try:
            joined = self._joined(code, name)
        except Full as reason:
            return JSONResponse({"error": str(reason)}, 409)
        except OSError as error:
            return JSONResponse({"error": f"The class cannot be written: {error.strerror}"}, 500)
        if joined is None:
            now_s = self._clock()
            self._all.happened(now_s)
            self._wrong.setdefault(address, Often(WRONG, WRONG_S)).happened(now_s)
            return JSONResponse({"error": "There is no class with this code: look at the board again."}, 403)
        return JSONResponse(joined)

    def _refusal(self, address: str) -> JSONResponse | None:
        """Why nobody from an address may try a code now; addresses that have tried none lately are forgotten."""
        if not self.is_open:
            return JSONResponse({"error": "The door of this class is closed: ask your teacher."}, 403)
        now_s = self._clock()
        if len(self._wrong) > ALL_WRONG:  # some of them are old: no more than ALL_WRONG codes are young
            self._wrong = {one: wrong for one, wrong in self._wrong.items() if wrong.is_full(now_s) or wrong.times}
        if self._all.is_full(now_s) or (address in self._wrong and self._wrong[address].is_full(now_s)):
            return JSONResponse({"error": "Too many wrong codes: wait a minute."}, 429)
        return None


async def _body(request: Request) -> bytes:
    """The body of a request, or the beginning of one that is too long."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MOST_BODY:
            break
    return body
