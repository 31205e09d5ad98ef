"""The panel of the teaching page, shared by two threads: the session's, which asks, and the server's, which serves pages."""

import hashlib
import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from lab.learning.requests import AdviceRequest, Request
from lab.production.operation.commands import OPERATOR
from lab.seat.grid_text import ARROWS, direction_of
from lab.seat.page.page_console import ONLOOKER, STOP, held_of
from lab.seat.page.page_console import PARTS as RUN_PARTS
from lab.seat.page.page_messages import (
    Chair,
    LayerChoice,
    Message,
    Pace,
    PageAnswer,
    PageCommand,
    Refused,
    Wish,
    understood,
)
from lab.seat.page.page_state import PARTS, PageContent, Pending, layer_of
from lab.view.meshcat import GANTT_SCRIPT

SLICE_EVERY_S = 0.1  # least time between two messages with a layer's values
RUN_EVERY_S = 0.1  # least time between two messages with the status of a run
MOST_LAYERS = 64  # whose values are kept, whatever numbers pages ask for
SLICE_SHARE = 30  # computing a layer's values takes at most one part in so many of the time
SEEN = ("curve", "standing", "notices", "members", "receipt")  # parts beside the question, of which a hash is kept
CLOSED = PageAnswer(0, None, "closed")
LISTEN_S = 0.2  # longest uninterrupted wait, so that Ctrl-C is noticed


@dataclass
class _Seen:
    """What one page has received: versions of the parts, its seat, its layer; and a refusal that is still to be sent."""

    versions: dict[str, int] = field(default_factory=dict)
    you: str = ""
    layer: int | None = None
    layer_version: int = 0
    layer_due_s: float = 0.0
    refusal: str = ""
    held: str = ""
    run_due_s: float = 0.0
    watches: bool = False


class SeatPanel:
    """The known state, the seat, the pending question and its answer; `lock` guards all of it.

    on_word: called in the server's thread with the answer, as a word of the terminal, to a question that somebody else
    waits for. on_pace: called with a word that changes the pace of a replay. on_quit: called when the run's console is to
    be left.
    """

    files: Sequence[Path] = (
        GANTT_SCRIPT,
        *(
            Path(__file__).with_name(name)
            for name in (
                *("teaching.html", "teaching.css", "console.css"),
                *("teaching_draw.js", "teaching_status.js", "teaching_map.js", "console.js", "teaching_question.js"),
            )
        ),
    )

    def __init__(self, title: str) -> None:
        self.guard = threading.RLock()
        self.lock = threading.Condition(self.guard)  # a condition on the same lock, for waiting
        self.known = PageContent(title)
        self.chair = Chair()
        self.on_word: Callable[[str], None] | None = None
        self.on_pace: Callable[[str], None] | None = None
        self.on_quit: Callable[[], None] | None = None
        self._answer: PageAnswer | None = None
        self._helped = False  # whether the last answer came from a page that only watches by itself
        self._ended = False
        self._pages: dict[int, _Seen] = {}
        self._texts: dict[str, tuple[int, str]] = {}  # part -> its version and its JSON
        self._layers: dict[int | None, tuple[int, str]] = {}  # the same of layers that pages have asked for
        self._stirred = 0
        self._late = False  # whether news were held back
        self._busy = ""  # the console's command under way, as pages have been told

    # ---- called by the session's thread

    def pose(self, pending: Pending) -> Pending:
        """The new question with its number; answers to the question before are refused from now on."""
        with self.lock:
            self.known.questions += 1
            self._answer = None
            self.known.pending = replace(pending, number=self.known.questions)
            self.known.changed("question", "robot", "standing", "notices", "slice")
            return self.known.pending

    def close(self) -> bool:
        """Withdraw the question; returns whether there was one."""
        with self.lock:
            waited = self.known.pending is not None
            if waited:
                self.known.pending = None
                self.known.changed("question")
            return waited

    @property
    def attended(self) -> bool:
        """Whether a browser has the seat."""
        with self.lock:
            return self.chair.holder is not None

    def skip(self) -> None:
        """Answer the question with "skip" for whoever has the seat."""
        with self.lock:
            if (pending := self.known.pending) is not None:
                self._answer, self.known.pending = PageAnswer(pending.number, None, "skip"), None
                self.known.changed("question")
                self.lock.notify_all()

    def hurry(self, until_s: float) -> None:
        """Show until when [s of the clock] the question waits."""
        with self.lock:
            if (pending := self.known.pending) is not None and pending.until_s is None:
                self.known.pending = replace(pending, until_s=until_s)
                self.known.changed("question")

    def wait(self, pending: Pending) -> PageAnswer | None:
        """The answer to a question, or CLOSED after the server has ended; None after the question's time."""
        with self.lock:
            while self._answer is None:
                if self._ended:
                    return CLOSED
                left_s = LISTEN_S if pending.until_s is None else pending.until_s - time.monotonic()
                if left_s <= 0:
                    return None
                self.lock.wait(min(left_s, LISTEN_S))
            return self._answer

    def end(self) -> None:
        """The server has ended: wake whoever waits for an answer."""
        with self.lock:
            self._ended = True
            self.lock.notify_all()

    def shown(self) -> dict[str, Any]:
        """What is shown beside the question: the length of the curve, the number of notices, and a hash of the parts SEEN.

        helped: whether the last answer came from a page that looks over the shoulder of the one that has the seat by itself.
        """
        with self.lock:
            now = {part: PARTS[part](self.known, 0.0) for part in SEEN}
        text = plain_json(now).encode()
        return {
            "episodes": now["curve"]["count"],
            "notices": len(now["notices"]),
            "helped": self._helped,
            "sha256": hashlib.sha256(text).hexdigest(),
        }

    # ---- called by the server's thread

    def joined(self, page: int, watches: bool = False) -> None:
        """A browser has opened the page; one that only watches neither counts nor gets the seat by itself."""
        with self.lock:
            self._pages[page] = _Seen(watches=watches)
            if not watches:
                self.chair.joined(page)
            self._count()

    def left(self, page: int) -> None:
        """A browser has left; a pending question remains pending."""
        with self.lock:
            self._pages.pop(page, None)
            self.chair.left(page)
            self._count()

    def _count(self) -> None:
        if self.known.console is not None:
            self.known.console.watched(len(self.chair.pages))

    def stirred(self) -> bool:
        """Whether there is news since the last call."""
        with self.lock:
            busy = "" if self.known.console is None else self.known.console.busy
            if busy != self._busy:
                self.known.changed("run")
            version = self.known.settle()
            new = version != self._stirred or self._late
            self._stirred, self._late = version, False
            return new

    def said(self, page: int, message: str | bytes) -> None:
        """Act on a page's message, or refuse it with a line on that page. An emergency stop is passed on without the lock."""
        word = ""
        try:
            meant = understood(message)
            if isinstance(meant, PageCommand):
                self._command(page, meant)
                return
            with self.lock:
                word = self._do(page, meant)
        except Refused as reason:
            with self.lock:
                self._pages[page].refusal = str(reason)
        if word and self.on_word is not None:
            self.on_word(word)

    def _command(self, page: int, meant: PageCommand) -> None:
        """Pass a command to the run, without the lock, which the receiver of the result takes as well."""
        console, first = self.known.console, meant.words.split()[0].lower()
        if console is None:
            raise Refused("Nothing is carried out here that takes commands.")
        has_seat = self.chair.holder == page  # only this thread changes the holder
        if first == STOP:
            console.say(STOP, OPERATOR if has_seat else ONLOOKER)
        elif not has_seat:
            free = self.chair.holder is None
            raise Refused(
                "Nobody operates yet: press 'Operate here' first."
                if free
                else "Another page operates: here only the emergency stop works."
            )
        elif first == "quit" and self.on_quit is not None:
            self.on_quit()
        else:
            console.say(meant.words, OPERATOR)

    def _do(self, page: int, meant: Message) -> str:
        """The terminal's word for the answer to a question that somebody else waits for; "" for all other messages."""
        if isinstance(meant, LayerChoice):
            self._pages[page].layer, self._pages[page].layer_version = meant.layer, 0
            return ""
        if isinstance(meant, Pace):
            if self.on_pace is None:
                raise Refused("Nothing is shown again here.")
            self.on_pace(meant.word)
            return ""
        if isinstance(meant, Wish):
            self.chair.wish(page, meant)
            return ""
        assert isinstance(meant, PageAnswer)
        pending = self._checked(page, meant)
        self._answer, self._helped = meant, self._pages[page].watches
        self.known.pending = None
        self.known.changed("question")
        self.lock.notify_all()
        return word_of(pending.request, meant) if pending.offered else ""

    def _checked(self, page: int, answer: PageAnswer) -> Pending:
        """The question that an answer belongs to. Raises Refused for a wrong answer, or a page that may not answer."""
        pending = self.known.pending
        if self.chair.holder != page:
            raise Refused(
                "No page answers yet: press 'Answer here' first."
                if self.chair.holder is None
                else "This page only watches."
            )
        if pending is None or answer.question != pending.number:
            raise Refused("This question waits no more: the answer came too late.")
        if pending.offered and self.on_word is None:
            raise Refused("This session is only shown: it takes no answers.")
        if answer.word == "undo" and "undo" not in pending.words:
            raise Refused("Nothing of this episode can be taken back.")
        if answer.word in ("+", "-") and answer.word not in pending.words:
            raise Refused("Nothing was done yet that could be good or bad.")
        if pending.request.judgement == "only" and not (answer.word or answer.is_spoken):
            raise Refused("This question is about the move that it makes: press + or -, or skip.")
        if len(answer.path) > 1 and not isinstance(pending.request, AdviceRequest):
            raise Refused("Which part moves next is said move by move.")
        if answer.agree is not None and (pending.heard is None or "text" not in pending.heard):
            raise Refused("Nothing was said that waits for agreement.")
        if not answer.is_spoken and not answer.word and not {answer.action, *answer.path} <= {*pending.moves}:
            raise Refused("There is no such move here.")
        return pending

    def news(self, page: int) -> str:
        """The JSON members that this page has not received yet, "seat" and "refusal" among them; "" for none."""
        with self.lock:
            seen, now_s = self._pages.get(page), time.monotonic()
            if seen is None:
                return ""
            version = self.known.settle()
            parts = {part: self._text(part, now_s) for part in self._due(seen, now_s)}
            seen.versions |= dict.fromkeys(parts, version)
            if self.known.console is not None and (held := json.dumps(held_of(self.known.console))) != seen.held:
                parts["held"] = seen.held = held
            you = json.dumps(self.chair.view(page))
            if you != seen.you:
                parts["you"] = seen.you = you
            if (layer := self._layer(seen, now_s)) is not None:
                parts["slice"] = layer
            refusal, seen.refusal = seen.refusal, ""
        members = [f'"seat": {{{", ".join(f"{json.dumps(name)}: {text}" for name, text in parts.items())}}}'] * bool(
            parts
        )
        return ", ".join(members + [f'"refusal": {json.dumps(refusal)}'] * bool(refusal))

    def _due(self, seen: _Seen, now_s: float) -> list[str]:
        """The parts that have changed; the status of a run is held back for RUN_EVERY_S after the last one."""
        new = self.known.since(seen.versions)
        if self.known.console is None or not {*new} & {*RUN_PARTS}:
            return new
        if now_s < seen.run_due_s:
            self._late = True
            return [part for part in new if part not in RUN_PARTS]
        seen.run_due_s = now_s + RUN_EVERY_S
        return new

    def _text(self, part: str, now_s: float) -> str:
        version, text = self._texts.get(part, (-1, ""))
        if version != self.known.versions.get(part, 1) or part == "question":  # the remaining time changes
            value = PARTS[part](self.known, now_s)
            if part == "run" and value is not None:
                self._busy = value["busy"]
            text = plain_json(value)
            self._texts[part] = (self.known.versions.get(part, 1), text)
        return text

    def _layer(self, seen: _Seen, now_s: float) -> str | None:
        """The JSON of the layer that a page shows, when it has changed and SLICE_EVERY_S has passed; else None."""
        version = self.known.versions.get("slice", 1)
        if seen.layer_version == version:
            return None
        if now_s < seen.layer_due_s:
            self._late = True
            return None
        if self._layers.get(seen.layer, (-1, ""))[0] != version:
            if len(self._layers) >= MOST_LAYERS:
                self._layers.clear()
            self._layers[seen.layer] = (version, plain_json(layer_of(self.known, seen.layer)))
        seen.layer_version = version
        text = self._layers[seen.layer][1]
        if text != "null":  # "no grid" is found out fast, and there may be a grid soon
            seen.layer_due_s = now_s + max(SLICE_EVERY_S, SLICE_SHARE * (time.monotonic() - now_s))
        return text


def plain_json(value: Any) -> str:
    """The JSON of a value for browsers, with null for numbers that are not finite."""
    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(value), allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def word_of(request: Request, answer: PageAnswer) -> str:
    """An answer as typed at a terminal: the label of an action, the number of a move, the word or sentence itself, or a path."""
    if answer.is_spoken:
        return answer.say or ("yes" if answer.agree else "no")
    if answer.word or answer.action is None:
        return answer.word
    if len(answer.path) > 1 and isinstance(request, AdviceRequest):
        pointing = [direction_of(request.mdp, action) for action in answer.path]
        return f"path {''.join(ARROWS[d] for d in pointing if d is not None)}"
    return request.mdp.action_labels[answer.action] if isinstance(request, AdviceRequest) else str(answer.action)
