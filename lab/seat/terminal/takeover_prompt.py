"""The questions of `lab clone --teacher terminal`: where the tool has to go, typed in words."""

from rich.console import Console
from rich.text import Text

from lab.cloning.person import Ask, Situation
from lab.cloning.takeover_command import HELP, TakeoverCommand, command_of
from lab.errors import BadInput, WorkFailed
from lab.seat.terminal.line_reader import ReadLine


def takeover_prompt(read: ReadLine, console: Console) -> Ask:
    """The function that asks a person for one command; it tells the words once, and asks again after a wrong line.

    It raises WorkFailed at the end of the input.
    """
    told = False

    def ask(situation: Situation) -> TakeoverCommand:
        nonlocal told
        if not told:
            console.print(Text(HELP))
            told = True
        console.print(Text("\n".join(filter(None, (situation.demonstration, situation.why, str(situation))))))
        while True:
            try:
                return command_of(read("what should the tool do? "))
            except BadInput as error:
                console.print(Text(str(error)))
            except EOFError:
                raise WorkFailed("the teacher has left: --resume DIR goes on with what is kept of a session") from None

    return ask
