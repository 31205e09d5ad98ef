"""A language model as an advisor: it gets the question that a person gets, in words, and its reply is read and nothing else.

The server is asked in the chat-completions form. Nothing that it sends is run, stored or shown, except an allowed answer and, in
the reason why it advises no more, at most SHOWN characters of its last reply, with escapes.
"""

import json
import os
import socket
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from threading import Thread
from typing import Any

from lab.advice.advisors import AdvisorName
from lab.advice.model_address import KEY, UNENCRYPTED, ModelAddress
from lab.errors import BadInput, Notice, counted, shortened
from lab.files import json_of
from lab.learning.requests import AdviceRequest, AdvisorLeft, Request
from lab.seat import order_text, request_text
from lab.seat.grid_text import StateWords, skill_of
from lab.sequencing.search import SequenceRequest
from lab.teaching.events import LessonBegan, ScenePrepared

MOST_BYTES = 1_000_000  # of a reply
MOST_IN_A_ROW = 5  # calls without an allowed answer, after which it is asked no more
SHOWN = 60
SKIP = "skip"
TASK = (
    "You advise a learner that controls a robot. Each message is one question of it. It does what you say, and learns from it as "
    "if the decision were its own; when episodes with your advice are no better than those before, it asks no more. Reply with "
    f"one of the allowed answers, alone on the first line. Reply {SKIP} if you do not know."
)
_FENCE = "```"
_MARKS = " \t\r\n\"'`*.!"  # around an answer they count for nothing


# ---- the question, and the reply to it --------------------------------------------------------------------------------


def question(request: Request, known: StateWords | None = None) -> str:
    """The question in plain sentences, one per line, and the allowed answers; known: describes states in words."""
    if isinstance(request, SequenceRequest):
        moves = [order_text.move_of(request, decision) for decision in request.allowed]
        own = ", the learner's own choice"
        lines = [f"{order_text.title(request)}.", order_text.progress(request)]
        lines += [f"{move}{own * (move.decision == request.own)}." for move in moves]
        allowed = ", ".join(map(str, request.allowed))
    else:
        assert isinstance(request, AdviceRequest)
        lines = request_text.sentences(request, known)
        allowed = ", ".join(f"{action} or {request.mdp.action_labels[action]}" for action in request.allowed)
    return "\n".join([*lines, f"Allowed answers, by number or name: {allowed}; or {SKIP}."])


def names_of(request: Request) -> dict[str, int]:
    """The allowed answers by each of their names; a label comes before a number."""
    numbers = {str(action): action for action in request.allowed}
    if isinstance(request, AdviceRequest):
        return numbers | {request.mdp.action_labels[action]: action for action in request.allowed}
    return numbers | {f"move {action}": action for action in request.allowed}


def understood(reply: str, names: Mapping[str, int]) -> int | str | None:
    """The answer in a reply: an allowed one, SKIP, or None for anything else.

    The first line has to be the name or number of an answer and nothing more but _MARKS around it; capitals do not count. It may
    stand in a code fence, and the reply may be JSON such as {"action": "left"}.
    """
    text = reply.strip()
    if text.startswith(_FENCE) and text.endswith(_FENCE):
        text = text.partition("\n")[2].removesuffix(_FENCE).strip()
    if text.startswith("{"):
        record: Any = None
        with suppress(ValueError):
            record = json_of(text)
        action = record.get("action") if isinstance(record, dict) else None
        text = str(action) if isinstance(action, str | int) and not isinstance(action, bool) else ""
    word = text.split("\n", 1)[0].strip(_MARKS)
    if word in names:
        return names[word]
    meant = {action for name, action in names.items() if name.lower() == word.lower()}
    if len(meant) == 1:
        return meant.pop()
    return SKIP if word.lower() == SKIP else None


# ---- one call ---------------------------------------------------------------------------------------------------------


class _Exchange(Thread):
    """One request and its reply, in a thread of its own, so that no server delays the learner beyond the time limit.

    Afterwards `content` is the reply, or `fault` says why there is none; connected: whether there was a server. Redirects are
    not followed, and proxies are not used.
    """

    def __init__(self, address: ModelAddress, body: bytes, headers: Mapping[str, str]) -> None:
        super().__init__(daemon=True)
        kind = HTTPSConnection if address.scheme == "https" else HTTPConnection
        # no thread is left behind for long; how long the learner waits is decided by who joins this one
        self._connection = kind(address.host, address.port, timeout=2.0 * address.timeout_s)
        self._socket: socket.socket | None = None
        self._path, self._body, self._headers = address.path, body, dict(headers)
        self.content, self.fault, self.connected = b"", "", False

    def run(self) -> None:
        """Ask and read; never raises."""
        try:
            self._connection.connect()
            self._socket, self.connected = self._connection.sock, True
            self._connection.request("POST", self._path, self._body, self._headers)
            response = self._connection.getresponse()
            if response.status != 200:
                redirected = ": redirects are not followed" if 300 <= response.status < 400 else ""
                self.fault = f"the server answered with status {response.status}{redirected}"
                return
            self.content = response.read(MOST_BYTES + 1)
            if len(self.content) > MOST_BYTES:
                self.fault = f"its reply is longer than {MOST_BYTES} bytes"
        except OSError as error:
            self.fault = f"connection failed: {error.strerror or type(error).__name__}"
        except (HTTPException, ValueError) as error:
            self.fault = f"no reply in HTTP: {type(error).__name__}"
        finally:
            self._connection.close()

    def stop(self) -> None:
        """End it, wherever it waits."""
        if (at := self._socket or self._connection.sock) is not None:
            with suppress(OSError):
                at.shutdown(socket.SHUT_RDWR)


def content_of(document: bytes) -> str | None:
    """The text of the first choice in a chat completion, None if there is none."""
    try:
        text = json_of(document)["choices"][0]["message"]["content"]
    except (ValueError, LookupError, TypeError):
        return None
    return text if isinstance(text, str) else None


# ---- the advisor ------------------------------------------------------------------------------------------------------


class LanguageModel:
    """A function that asks a language model (it is an `Ask`): its answer to a request, None for "skip" and a failed call.

    An answer is asked for once in a state, and repeated there; a call that failed is made again.

    name: with a `model`; key: for the server, "" for none.
    asked, repeated, unusable: counts of calls, of repeated answers, and of calls without an allowed answer.
    Raises AdvisorLeft if there is no server at the first call, after MOST_IN_A_ROW calls in a row without an allowed answer, and
    when all allowed calls were made; BadInput if the key would be sent unencrypted.
    """

    def __init__(self, name: AdvisorName, key: str = "") -> None:
        assert name.model is not None
        self.name, self._address, self._key = name, name.model, key.strip()
        if not (self._key.isascii() and self._key.isprintable()):
            raise BadInput(f"{KEY} (environment): it holds characters that no key has")
        at = self._address
        if self._key and at.scheme == "http" and not (at.is_local or at.unencrypted):
            raise BadInput(
                f"advisor '{name}': {KEY} would be sent unencrypted to {at.server}: use https, unset it, or allow it with the "
                f"word {UNENCRYPTED} after the model's name (#MODEL,{UNENCRYPTED})"
            )
        self.asked = self.repeated = self.unusable = self._in_a_row = 0
        self._left = ""  # why it advises no more
        self._subject: object = None  # what `_known` is about: a table or a cell
        self._known: dict[tuple[int, tuple[int, ...]], int | None] = {}  # answers by state and allowed ones
        self._place: Any = None
        self._words: StateWords | None = None

    def hear(self, event: Any) -> None:
        """Takes over what the next questions are about, from the events of lessons."""
        match event:
            case ScenePrepared():
                self._place = event.scene
            case LessonBegan():
                self._words = skill_of(self._place, event.plan.problem.name)

    def __call__(self, request: Request) -> int | None:
        """The model's answer."""
        if self._left:
            raise AdvisorLeft(self._left)
        state = self._state(request)
        if state in self._known:
            self.repeated += 1
            return self._known[state]
        if self.asked >= self._address.most_calls:
            self._leave(f"{counted(self.asked, 'call')} were made, which is the limit (calls={self.asked})")
        reply, fault = self._reply(question(request, self._words))
        answer = understood(reply, names_of(request)) if not fault else None
        if answer is None:
            self._failed(fault or f"'{self._shown(reply)}' is none of the allowed answers")
            return None
        self._in_a_row = 0
        self._known[state] = None if isinstance(answer, str) else answer
        return self._known[state]

    def remember(self, request: Request, action: int | None) -> None:
        """Takes over an answer that it gave before, as a journal has it; None may also have been a failed call."""
        if action is not None:
            self._known[self._state(request)] = action

    def _state(self, request: Request) -> tuple[int, tuple[int, ...]]:
        subject = request.run.cell if isinstance(request, SequenceRequest) else getattr(request, "mdp", None)
        if subject is not self._subject:
            self._subject, self._known = subject, {}
        return request.state, tuple(request.allowed)

    def _reply(self, text: str) -> tuple[str, str]:
        """The model's reply to a message, and "" or why there is none."""
        at, self.asked = self._address, self.asked + 1
        messages = [{"role": "system", "content": TASK}, {"role": "user", "content": text}]
        record = {"messages": messages, "temperature": 0, "stream": False} | ({"model": at.model} if at.model else {})
        headers = {"Content-Type": "application/json", "Connection": "close"}
        if self._key:
            headers["Authorization"] = f"Bearer {self._key}"
        exchange = _Exchange(at, json.dumps(record).encode(), headers)
        exchange.start()
        try:
            exchange.join(at.timeout_s)
            in_time = not exchange.is_alive()
        finally:
            exchange.stop()
        fault = exchange.fault if in_time else f"no answer within {at.timeout_s:g} s"
        if not exchange.connected and self.asked == 1:
            self._leave(f"{at.server}: {fault}")
        reply = None if fault else content_of(exchange.content)
        return reply or "", fault or ("its reply is no chat completion" if reply is None else "")

    def _shown(self, reply: str) -> str:
        return shortened(reply.replace(self._key, "***") if self._key else reply, SHOWN)

    def _failed(self, why: str) -> None:
        """Counts a call without an allowed answer; leaves after MOST_IN_A_ROW of them."""
        self.unusable += 1
        self._in_a_row += 1
        if self._in_a_row >= MOST_IN_A_ROW:
            self._leave(f"{self._in_a_row} calls in a row gave no allowed answer; the last one: {why}")

    def _leave(self, why: str) -> None:
        """Raises AdvisorLeft, now and from now on; a notice says why."""
        self._left = why
        warnings.warn(Notice(f"advisor '{self.name}' advises no more: {why}"), stacklevel=2)
        raise AdvisorLeft(why)

    def __str__(self) -> str:
        counts = f"{counted(self.asked, 'call')}, {counted(self.repeated, 'repeated answer')}"
        return f"{self.name}: {counts}, {counted(self.unusable, 'call')} without an allowed answer"


def language_models(names: Sequence[str]) -> dict[str, LanguageModel]:
    """The language models of these names, with the key in the environment. Raises BadInput as they do."""
    return {name: LanguageModel(AdvisorName.of(name, "--advisor"), os.environ.get(KEY, "")) for name in names}
