"""The questions of `lab new`: each is repeated until its answer is valid; enter takes the default in brackets."""

from collections.abc import Callable

from rich.console import Console
from rich.text import Text

from lab.errors import BadInput, unknown
from lab.seat.terminal.line_reader import ReadLine
from lab.tasks.new_task import MACHINE, MACHINE_WORDS, PART, PART_WORDS, NewTask, arm_of_word, new_task
from lab.tasks.robot_fields import MODELS

YES, NO = "yes", "no"


def ask(name: str, read: ReadLine, console: Console) -> NewTask:
    """The description of a new task `name`, from a person's answers. BadInput when the input ends too early."""

    def answer(question: str, default: str, check: Callable[[str], object]) -> str:
        while True:
            try:
                word = read(f"{question} [{default}] ").strip() or default
                check(word)
            except EOFError:
                raise BadInput(
                    f"the input ended at '{question}': with --yes nothing is asked, see lab new --help"
                ) from None
            except BadInput as error:
                console.print(Text(str(error)))
            else:
                return word

    parts: list[str] = []
    machines: list[str] = []
    arm = answer(f"Which arm: {', '.join(MODELS)}?", MODELS[0], arm_of_word)

    def check_part(word: str) -> None:
        if not parts or word != NO:
            new_task(name, arm, [*parts, word], (), False)

    def check_machine(word: str) -> None:
        if word != NO:
            new_task(name, arm, parts, [*machines, word], False)

    console.print(Text(f"Parts are {PART_WORDS}."))
    word = answer("Which parts?", PART, check_part)
    while word != NO:
        parts.append(word)
        word = answer("Another kind of parts, too?", NO, check_part)
    console.print(Text(f"Machines are {MACHINE_WORDS}; or {NO}."))
    word = answer("Which machine do they go to?", MACHINE, check_machine)
    while word != NO:
        machines.append(word)
        word = answer("And then to which?", NO, check_machine)
    buffers = bool(machines) and answer("A buffer before each machine, yes or no?", NO, _check_yes_or_no) == YES
    return new_task(name, arm, parts, machines, buffers)


def _check_yes_or_no(word: str) -> None:
    if word not in (YES, NO):
        raise unknown("answer", word, (YES, NO), "a buffer before each machine")
