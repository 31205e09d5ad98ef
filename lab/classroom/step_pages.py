"""What the page of a study's steps asks of the server: the participant's current step, and to go on or withdraw."""

import json
from collections.abc import Callable

from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from lab.classroom.roster import Full
from lab.classroom.study_room import StudyRoom
from lab.errors import BadInput

MOST_BODY = 1 << 18  # bytes of a questionnaire's answers
NOBODY = {"error": "Nobody takes part with this address: join with the code of the study."}


class StepPages:
    """GET /step/state?token=KEY and POST /step/do?token=KEY, whose body is a wish of `StudyRoom.do`; both answer with JSON.

    from_here: whether a page of this server asks, or a program that is no browser.
    """

    def __init__(self, room: StudyRoom, from_here: Callable[[HTTPConnection], bool]) -> None:
        self._room, self._from_here = room, from_here

    def routes(self) -> list[Route]:
        """The routes of both."""
        return [Route("/step/state", self._state), Route("/step/do", self._do, methods=["POST"])]

    async def _state(self, request: Request) -> Response:
        shown = self._room.state(request.query_params.get("token", ""))
        return JSONResponse(NOBODY, 403) if shown is None else JSONResponse(shown)

    async def _do(self, request: Request) -> Response:
        if not self._from_here(request):
            return JSONResponse({"error": "Another site's page may not do this."}, 403)
        key = request.query_params.get("token", "")
        if self._room.state(key) is None:
            return JSONResponse(NOBODY, 403)
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > MOST_BODY:
                return JSONResponse({"error": "That is too much text."}, 413)
        try:
            wish = json.loads(body)
            if not isinstance(wish, dict):
                raise BadInput("that was no message of this page")
            return JSONResponse(await self._room.do(key, wish))
        except (ValueError, RecursionError):
            return JSONResponse({"error": "that was no message of this page"}, 400)
        except (BadInput, Full) as reason:
            return JSONResponse({"error": str(reason)}, 409)
        except OSError as error:
            return JSONResponse(
                {"error": f"The study cannot be written: {error.strerror}. Tell whoever leads it."}, 500
            )
