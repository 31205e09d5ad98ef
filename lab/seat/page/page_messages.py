"""The messages that pages may send, and which page has the seat. Whatever a page sends becomes a message or is refused."""

import json
from dataclasses import dataclass, field
from typing import Any, Literal

from lab.seat.replay_pace import WORDS as REPLAY_WORDS

MAX_CHARS = 4096
MOST_MOVES = 1000  # of one path
MOST_SAID = 1000  # characters of a sentence
WORDS = ("skip", "auto", "undo", "quit", "+", "-")


class Refused(Exception):
    """Raised for a page's message that is ignored; the text says why."""


@dataclass(frozen=True)
class PageAnswer:
    """An answer to a question, by its number: an action, one of WORDS, the actions of a whole path, or a sentence.

    agree: whether the sentence before was understood as it was meant; None for all other answers.
    """

    question: int
    action: int | None = None
    word: str = ""
    path: tuple[int, ...] = ()
    say: str = ""
    agree: bool | None = None

    @property
    def is_spoken(self) -> bool:
        """Whether it is a sentence, or agrees to one."""
        return bool(self.say) or self.agree is not None


@dataclass(frozen=True)
class Wish:
    """The page requests the seat, or gives it up."""

    wish: Literal["take", "give"]


@dataclass(frozen=True)
class LayerChoice:
    """The page requests a layer of the grid; None: the robot's."""

    layer: int | None


@dataclass(frozen=True)
class Pace:
    """The page changes the pace of a replay (pause, continue and so on): a word of `replay_pace.WORDS`."""

    word: str


@dataclass(frozen=True)
class PageCommand:
    """The page gives the run a command, in the language of `lab.production.operation.commands`."""

    words: str


Message = PageAnswer | Wish | LayerChoice | Pace | PageCommand


def understood(message: str | bytes) -> Message:
    """The message in a page's data. Raises Refused for anything else."""
    if isinstance(message, bytes) or len(message) > MAX_CHARS:
        raise Refused(f"That was no message of this page: text of at most {MAX_CHARS} characters is wanted.")
    try:
        said = json.loads(message)
    except (ValueError, RecursionError):
        said = None
    match said:
        case {"answer": {"question": int(number), "action": int(action), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and not isinstance(action, bool):
                return PageAnswer(number, action)
        case {"answer": {"question": int(number), "word": str(word), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and word in WORDS:
                return PageAnswer(number, None, word)
        case {"answer": {"question": int(number), "path": list(path), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and 0 < len(path) <= MOST_MOVES and all(type(move) is int for move in path):
                return PageAnswer(number, path[0], path=tuple(path))
        case {"answer": {"question": int(number), "say": str(text), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and text.strip() and len(text) <= MOST_SAID and text.isprintable():
                return PageAnswer(number, say=text.strip())
        case {"answer": {"question": int(number), "agree": bool(agree), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool):
                return PageAnswer(number, agree=agree)
        case {"seat": "take" | "give" as wish, **more} if not more:
            return Wish(wish)
        case {"replay": str(word), **more} if not more and word in REPLAY_WORDS:
            return Pace(word)
        case {"command": str(words), **more} if not more and words.strip() and words.isprintable():
            return PageCommand(words)
        case {"layer": int() | None as layer, **more} if not more and not isinstance(layer, bool):
            return LayerChoice(layer)
    raise Refused("That was no message of this page: it is ignored.")


@dataclass
class Chair:
    """The one seat for many pages: the first page has it; a free seat goes to the next page that joins or requests it."""

    pages: list[int] = field(default_factory=list)
    holder: int | None = None

    def joined(self, page: int) -> None:
        """A page has been opened."""
        self.pages.append(page)
        if self.holder is None:
            self.holder = page

    def left(self, page: int) -> None:
        """A page has been closed; the seat is free if the page had it."""
        if page in self.pages:
            self.pages.remove(page)
        if self.holder == page:
            self.holder = None

    def wish(self, page: int, wanted: Wish) -> None:
        """Give the seat up, or take it. Raises Refused when the page does not have it, or it is not free."""
        if wanted.wish == "give":
            if self.holder != page:
                raise Refused("This page does not answer: there is nothing to hand over.")
            self.holder = None
        elif self.holder not in (None, page):
            raise Refused("Another page answers: it has to hand over first.")
        else:
            self.holder = page

    def view(self, page: int) -> dict[str, Any]:
        """The state of the seat, for this page."""
        return {"seat": self.holder == page, "free": self.holder is None, "pages": len(self.pages)}
