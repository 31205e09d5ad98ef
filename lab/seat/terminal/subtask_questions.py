"""The questions of `lab find`: each proposed sub-task is accepted, renamed or refused."""

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from lab.errors import BadInput
from lab.learning.bottlenecks import Bottleneck
from lab.seat.terminal.line_reader import ReadLine
from lab.teaching.found_subtasks import Proposal, check_names

REFUSE = "no"
EXPLAINED = f"Enter accepts a sub-task, '{REFUSE}' refuses it, any other word becomes its name."


def accepted_by(proposals: Sequence[Proposal], read: ReadLine, console: Console) -> dict[Bottleneck, str]:
    """The names of the accepted sub-tasks by their states; at the end of the input the others are accepted as they are."""
    console.print(Text(EXPLAINED))
    accepted: dict[Bottleneck, str] = {}
    ended = False
    for proposal in proposals:
        while True:
            try:
                word = "" if ended else read(f"{proposal.name}? ").strip()
            except EOFError:
                word, ended = "", True
            if word == REFUSE:
                break
            try:
                check_names([*accepted.values(), word or proposal.name])
            except BadInput as error:
                console.print(Text(str(error)))
                if ended:
                    break
            else:
                accepted[proposal.states] = word or proposal.name
                break
    return accepted
