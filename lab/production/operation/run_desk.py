"""Where a run that carries itself out is steered: it is stopped, goes on and gets its pace in the operator's words."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from threading import RLock

from lab.errors import BadInput
from lab.production.conditions import Conditions
from lab.production.controls import Controls
from lab.production.floor import Floor
from lab.production.operation.at_once import OPERATOR, Done, press
from lab.production.operation.commands import COMMANDS, spoken
from lab.production.run_journal import Commanded, RunJournal
from lab.production.run_status import RunStatus
from lab.tasks.task import Order, Task
from lab.teaching.events import Event, OperatorActed, Tell

WORDS = tuple(word for word, command in COMMANDS.items() if command.how == "at once")


class RunDesk:
    """`say` and `now` may be called in any thread; `hear`, with all that the run tells, in the run's own.

    busy and names are those of a desk where more can be said; `done`: what came of all that was said.
    """

    busy = ""
    words = WORDS
    names: Mapping[str, Sequence[str]] = {}

    def __init__(self, task: Task, order: Order, controls: Controls, journal: RunJournal, tell: Tell) -> None:
        """tell: who is told of a command before there is a floor."""
        self.controls, self._journal, self._tell = controls, journal, tell
        self.done: list[Done] = []
        self._floor: Floor | None = None
        self._lock, self._status = RLock(), RunStatus.of(task, order)
        self._unwritten = deque[Commanded]()

    def steering(self, conditions: Conditions) -> Conditions:
        """These conditions, of a run that is steered from here."""
        return replace(
            conditions, on_floor=self._on_floor, before_step=lambda floor: self._write(), meanwhile=self._write
        )

    def _on_floor(self, floor: Floor) -> None:
        """The run is carried out on this floor."""
        self._floor, self._tell = floor, floor.tell

    def _write(self) -> bool:
        """Write down what was said; nothing in the scene is changed by that."""
        while self._unwritten:
            self._journal.write(self._unwritten.popleft())
        return False

    def hear(self, event: Event) -> None:
        """Take over what happened."""
        with self._lock:
            self._status.hear(event)

    def now(self) -> RunStatus:
        """Where the run stands; a stop shows as soon as it is pressed."""
        with self._lock:
            return self._status.copied().under(self.controls)

    def say(self, line: str, by: str = OPERATOR) -> Done:
        """Take a command; what came of it."""
        words = line
        try:
            said = spoken(line)
            words = said.words
            if said.word not in self.words:
                raise BadInput(f"{said.word}: this run carries itself out and takes {', '.join(self.words)}")
            done = Done(words, refused=press(self.controls, said, by))
        except BadInput as error:
            done = Done(words, refused=str(error))
        steps, now_s = (0, 0.0) if self._floor is None else (self._floor.steps, self._floor.now_s)
        self.done.append(done)
        self._unwritten.append(Commanded(steps, done.words, by, done.refused))
        self._tell(OperatorActed(done.words, by, now_s, done.refused))
        return done

    def watched(self, pages: int) -> None:
        """So many pages are open: somebody is there who goes on after a protective stop, or nobody is."""
        self.controls.attended = pages > 0
