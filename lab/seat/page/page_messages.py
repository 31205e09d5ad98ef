"""What pages may say, and who of those that watch has the seat. Whatever a page sends ends as a message or a refusal."""

import json
from dataclasses import dataclass, field
from typing import Any, Literal

from lab.seat.replay_pace import WORDS as REPLAY_WORDS

MAX_CHARS = 4096
MOST_MOVES = 1000  # of one path
WORDS = ("skip", "auto", "undo", "quit")


class Refused(Exception):
    """What a page said is ignored; the text says why."""


@dataclass(frozen=True)
class Answer:
    """An answer to a question, by its number: an action, one of WORDS, or the actions of a whole path."""

    question: int
    action: int | None = None
    word: str = ""
    path: tuple[int, ...] = ()


@dataclass(frozen=True)
class Wish:
    """The page wants the seat, or gives it away."""

    wish: Literal["take", "give"]


@dataclass(frozen=True)
class Layer:
    """The page wants to see a layer of the grid; None: the robot's."""

    layer: int | None


@dataclass(frozen=True)
class Pace:
    """The page wants a session that is shown again to pause, to go on and so on: a word of `replay_pace.WORDS`."""

    word: str


@dataclass(frozen=True)
class Command:
    """The page gives the run a command, in words of `lab.production.operation.commands`."""

    words: str


Message = Answer | Wish | Layer | Pace | Command


def understood(message: str | bytes) -> Message:
    """What a page says. Raises Refused for anything else."""
    if isinstance(message, bytes) or len(message) > MAX_CHARS:
        raise Refused(f"That was no message of this page: text of at most {MAX_CHARS} characters is wanted.")
    try:
        said = json.loads(message)
    except (ValueError, RecursionError):
        said = None
    match said:
        case {"answer": {"question": int(number), "action": int(action), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and not isinstance(action, bool):
                return Answer(number, action)
        case {"answer": {"question": int(number), "word": str(word), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and word in WORDS:
                return Answer(number, None, word)
        case {"answer": {"question": int(number), "path": list(path), **rest}, **more} if not (rest or more):
            if not isinstance(number, bool) and 0 < len(path) <= MOST_MOVES and all(type(move) is int for move in path):
                return Answer(number, path[0], path=tuple(path))
        case {"seat": "take" | "give" as wish, **more} if not more:
            return Wish(wish)
        case {"replay": str(word), **more} if not more and word in REPLAY_WORDS:
            return Pace(word)
        case {"command": str(words), **more} if not more and words.strip() and words.isprintable():
            return Command(words)
        case {"layer": int() | None as layer, **more} if not more and not isinstance(layer, bool):
            return Layer(layer)
    raise Refused("That was no message of this page: it is ignored.")


@dataclass
class Chair:
    """One seat for many pages: the first to come has it; once it is free, whoever comes, or takes it."""

    pages: list[int] = field(default_factory=list)
    holder: int | None = None

    def joined(self, page: int) -> None:
        """A page has come."""
        self.pages.append(page)
        if self.holder is None:
            self.holder = page

    def left(self, page: int) -> None:
        """A page has gone, and the seat is free if it was its own."""
        if page in self.pages:
            self.pages.remove(page)
        if self.holder == page:
            self.holder = None

    def wish(self, page: int, wanted: Wish) -> None:
        """Give the seat away, or take it. Raises Refused when it is not free, or not the page's own."""
        if wanted.wish == "give":
            if self.holder != page:
                raise Refused("This page does not answer: there is nothing to hand over.")
            self.holder = None
        elif self.holder not in (None, page):
            raise Refused("Another page answers: it has to hand over first.")
        else:
            self.holder = page

    def view(self, page: int) -> dict[str, Any]:
        """What a page is told of the seat."""
        return {"seat": self.holder == page, "free": self.holder is None, "pages": len(self.pages)}
