"""The base of pages that ask for one answer at a time: what they show, which page is told what, and the answer of one of them."""

import json
import threading
from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from lab.errors import BadInput

LISTEN_S = 0.2  # longest uninterrupted wait, so that Ctrl-C is noticed
NO_MESSAGE = "That was no message of this page: it is ignored."
Answer = TypeVar("Answer")
Json = dict[str, Any]


class AnswerPanel(Generic[Answer]):
    """What all pages know, and the answer that one of them sends while it is asked for; `lock` guards all of it.

    files: the page's HTML, style and script. most_chars: of a message; closed: the line that refuses an answer nobody asked for.
    """

    files: Sequence[Path]
    most_chars: ClassVar[int]
    closed: ClassVar[str]

    def __init__(self, known: Json) -> None:
        self.lock = threading.Condition()
        self._known = known
        self._pages: dict[int, str] = {}  # page -> refusal that is still to be sent
        self._due: set[int] = set()
        self._open = False  # whether an answer is asked for
        self._answer: Answer | None = None

    @abstractmethod
    def read(self, message: Any) -> Answer:
        """The answer in a message, a value of JSON. Raises BadInput for what is none."""

    def open(self) -> None:
        """Ask for an answer from now on."""
        with self.lock:
            self._open, self._answer = True, None

    def answer(self) -> Answer:
        """The answer, once a page has sent it."""
        with self.lock:
            while self._answer is None:
                self.lock.wait(LISTEN_S)
            return self._answer

    def tell(self, **news: Any) -> None:
        """Show what has become of these members, on all pages."""
        with self.lock:
            self._known |= news
            self._due |= {*self._pages}

    # ---- called by the server's thread

    def joined(self, page: int, watches: bool = False) -> None:
        """A browser has opened the page."""
        with self.lock:
            self._pages[page] = ""
            self._due.add(page)

    def left(self, page: int) -> None:
        """A browser has left; the answer is still waited for."""
        with self.lock:
            self._pages.pop(page, None)
            self._due.discard(page)

    def said(self, page: int, message: str | bytes) -> None:
        """Take the answer, or refuse it with a line on that page."""
        with self.lock:
            try:
                if not self._open:
                    raise BadInput(self.closed)
                self._answer = self.read(self._parsed(message))
                self._open = False
                self.lock.notify_all()
            except BadInput as reason:
                self._pages[page] = str(reason)

    def _parsed(self, message: str | bytes) -> Any:
        try:
            return json.loads(message) if len(message) <= self.most_chars else None
        except (ValueError, RecursionError):
            return None

    def stirred(self) -> bool:
        """Whether there is news for a page."""
        with self.lock:
            return bool(self._due or any(self._pages.values()))

    def news(self, page: int) -> str:
        """The JSON members that this page has not received yet; "" for none."""
        with self.lock:
            members = [f'"seat": {json.dumps(self._known)}'] * (page in self._due)
            if refusal := self._pages.get(page, ""):
                members.append(f'"refusal": {json.dumps(refusal)}')
                self._pages[page] = ""
            self._due.discard(page)
            return ", ".join(members)
