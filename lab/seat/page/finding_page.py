"""The page of `lab find`: the proposed sub-tasks on the map, each of which a person names, accepts or refuses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.errors import BadInput
from lab.learning.bottlenecks import Bottleneck
from lab.seat.page.answer_panel import NO_MESSAGE, AnswerPanel
from lab.teaching.found_subtasks import Finding, check_names
from lab.view.meshcat import LiveView
from lab.view.subtask_summary import MARKS, map_of

TITLE = "Teaching lab: sub-tasks that were found"
MOST_LABELS = 4  # states that are named of a proposal


class FindingPanel(AnswerPanel[list[str | None]]):
    """The proposals, and the choice that one of the pages sends."""

    files: Sequence[Path] = tuple(Path(__file__).with_name(f"finding.{kind}") for kind in ("html", "css", "js"))
    most_chars = 1 << 16
    closed = "The sub-tasks have been chosen already."

    def __init__(self, finding: Finding):
        mdp, proposals = finding.problem.mdp, finding.proposals
        marks = [*MARKS[: len(proposals)], *[""] * (len(proposals) - len(MARKS))]
        self.names = [proposal.name for proposal in proposals]
        super().__init__(
            {
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
        )
        self.open()

    def read(self, message: Any) -> list[str | None]:
        """The name of each proposal, None for a refused one. Raises BadInput."""
        names = message.get("names") if isinstance(message, dict) else None
        if not isinstance(names, list) or len(names) != len(self.names):
            raise BadInput(NO_MESSAGE)
        if not all(name is None or isinstance(name, str) for name in names):
            raise BadInput(NO_MESSAGE)
        check_names([name for name in names if name is not None])
        return names


class FindingPage(LiveView):
    """The live page of a finding; a context manager. Entering raises BadInput for a port that is taken or not allowed."""

    def __init__(self, finding: Finding, port: int = 0) -> None:
        super().__init__(port, title=TITLE)
        self._panel: FindingPanel = FindingPanel(finding)
        self._finding = finding

    def accepted(self) -> dict[Bottleneck, str]:
        """The names of the accepted sub-tasks by their states; waits until a page has sent them."""
        names = self._panel.answer()
        proposals = self._finding.proposals
        return {proposal.states: name for proposal, name in zip(proposals, names, strict=True) if name is not None}

    def tell(self, text: str) -> None:
        """Show what comes of the choice, on all pages."""
        self._panel.tell(said=text)
        if self._server is not None:
            self._server.wake()
