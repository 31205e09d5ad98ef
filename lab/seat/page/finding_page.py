"""The page of `lab find`: the proposed sub-tasks on the map, each of which a person names, accepts or refuses."""

import json
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.errors import BadInput
from lab.learning.bottlenecks import Bottleneck
from lab.teaching.found_subtasks import Finding, check_names
from lab.view.meshcat import LiveView
from lab.view.subtask_summary import MARKS, map_of

TITLE = "Teaching lab: sub-tasks that were found"
MAX_CHARS = 1 << 16
LISTEN_S = 0.2  # longest uninterrupted wait, so that Ctrl-C is noticed
MOST_LABELS = 4  # states that are named of a proposal
Json = dict[str, Any]


class FindingPanel:
    """The content of the page, and the choice that one of the pages sends; `lock` guards all of it."""

    files: Sequence[Path] = tuple(Path(__file__).with_name(f"finding.{kind}") for kind in ("html", "css", "js"))

    def __init__(self, finding: Finding):
        mdp, proposals = finding.problem.mdp, finding.proposals
        marks = [*MARKS[: len(proposals)], *[""] * (len(proposals) - len(MARKS))]
        self.names = [proposal.name for proposal in proposals]
        self._known: Json = {
            "title": finding.problem.name,
            "map": map_of(mdp, finding.experience.neighbours(), [proposal.states for proposal in proposals]),
            "proposals": [
                {
                    "mark": mark,
                    "name": proposal.name,
                    "where": ", ".join(map(mdp.state_label, proposal.states[:MOST_LABELS])),
                    "more": max(0, len(proposal.states) - MOST_LABELS),
                }
                for mark, proposal in zip(marks, proposals, strict=True)
            ],
            "said": "",
        }
        self.lock = threading.Condition()
        self._pages: dict[int, str] = {}  # page -> refusal that is still to be sent
        self._due: set[int] = set()
        self._choice: list[str | None] | None = None

    def wait(self) -> list[str | None]:
        """The name of each proposal, None for a refused one, once a page has sent them."""
        with self.lock:
            while self._choice is None:
                self.lock.wait(LISTEN_S)
            return self._choice

    def tell(self, text: str) -> None:
        """Show what comes of the choice."""
        with self.lock:
            self._known["said"] = text
            self._due |= {*self._pages}

    # ---- called by the server's thread

    def joined(self, page: int, watches: bool = False) -> None:
        """A browser has opened the page."""
        with self.lock:
            self._pages[page] = ""
            self._due.add(page)

    def left(self, page: int) -> None:
        """A browser has left; the choice is still waited for."""
        with self.lock:
            self._pages.pop(page, None)
            self._due.discard(page)

    def said(self, page: int, message: str | bytes) -> None:
        """Take the choice, or refuse it with a line on that page."""
        with self.lock:
            try:
                if self._choice is not None:
                    raise BadInput("The sub-tasks have been chosen already.")
                self._choice = self._chosen(message)
                self.lock.notify_all()
            except BadInput as reason:
                self._pages[page] = str(reason)

    def _chosen(self, message: str | bytes) -> list[str | None]:
        try:
            names = json.loads(message)["names"] if len(message) <= MAX_CHARS else None
        except (ValueError, RecursionError, TypeError, KeyError):
            names = None
        if not isinstance(names, list) or len(names) != len(self.names):
            raise BadInput("That was no message of this page: it is ignored.")
        if not all(name is None or isinstance(name, str) for name in names):
            raise BadInput("That was no message of this page: it is ignored.")
        check_names([name for name in names if name is not None])
        return names

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


class FindingPage(LiveView):
    """The live page of a finding; a context manager. Entering raises BadInput for a port that is taken or not allowed."""

    def __init__(self, finding: Finding, port: int = 0) -> None:
        super().__init__(port, title=TITLE)
        self._panel: FindingPanel = FindingPanel(finding)
        self._finding = finding

    def accepted(self) -> dict[Bottleneck, str]:
        """The names of the accepted sub-tasks by their states; waits until a page has sent them."""
        names = self._panel.wait()
        proposals = self._finding.proposals
        return {proposal.states: name for proposal, name in zip(proposals, names, strict=True) if name is not None}

    def tell(self, text: str) -> None:
        """Show what comes of the choice, on all pages."""
        self._panel.tell(text)
        if self._server is not None:
            self._server.wake()
