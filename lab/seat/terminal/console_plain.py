"""The operator's console without a screen: commands line by line from a pipe, what came of each in one line."""

from collections.abc import Callable, Iterable
from threading import Thread

from lab.production.operation.commands import Done, help_lines
from lab.production.operation.desk import Desk
from lab.seat.terminal.console_view import plain_lines

Write = Callable[[str], None]


def told(done: Done) -> str:
    """What came of a command, in one line."""
    if done.refused:
        return f"{done.words}: refused: {done.refused}"
    return f"{done.words}: {done.failed or done.said or 'done'}"


class PlainConsole:
    """Reads a line when the one before is done, or waits in a pause. It goes on after a refusal, and ends at the first failure.

    What failed has left the cell otherwise than the next line takes for granted. Beside a page, where more may be said, nothing
    ends it but `quit`.

    write: where the lines go that tell what came of it.
    """

    def __init__(self, desk: Desk, write: Write) -> None:
        self._desk, self._write = desk, write
        self._bad: Done | None = None
        self._stays = False
        self._error: Exception | None = None
        desk.operation.on_done.append(self._done)

    def run(self, lines: Iterable[str], *, stay: bool = False) -> Done | None:
        """The command that failed, else the first that was refused, None when all went well. Raises what the simulation raised.

        stay: until somebody leaves, whatever becomes of the lines.
        """
        self._stays = stay
        worker = Thread(target=self._simulate, name="simulation", daemon=True)
        worker.start()
        try:
            if stay:
                Thread(target=self._read, args=(lines,), name="commands", daemon=True).start()
                self._desk.stay()
            else:
                self._read(lines)
        finally:
            self._desk.leave()
            worker.join()
        if self._error is not None:
            raise self._error
        return self._bad

    def _read(self, lines: Iterable[str]) -> None:
        self._desk.settle()
        for line in lines:
            if self._error is not None or not self._said(line.strip()):
                self._desk.leave()
                break
            self._desk.settle()
            if self._bad is not None and self._bad.failed:
                break

    def _simulate(self) -> None:
        try:
            self._desk.serve()
        except Exception as error:  # it is raised again in the thread of the console
            self._error = error

    def _said(self, line: str) -> bool:
        """Take a line; whether there is more to come."""
        match line.split()[0].lower() if line else "":
            case "quit":
                return False
            case "":
                pass
            case "help":
                for text in help_lines():
                    self._write(text)
            case "status":
                for text in plain_lines(self._desk.now()):
                    self._write(text)
            case _:
                self._desk.say(line)
        return True

    def _done(self, done: Done) -> None:
        self._write(told(done))
        if not done.well and not self._stays and (self._bad is None or done.failed):
            self._bad = done
