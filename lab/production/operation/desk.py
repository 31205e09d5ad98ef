"""Where commands are said while another thread simulates: to an operated scene, or to a run that carries itself out."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from threading import Condition, RLock

from lab.errors import BadInput, LabError
from lab.production.composer import Conditions
from lab.production.controls import RESET_FIRST, Controls, StopKind
from lab.production.floor import Floor
from lab.production.operation.commands import COMMANDS, OPERATOR, Done, Spoken, press, spoken
from lab.production.operation.operated_scene import Left
from lab.production.operation.operation import Operation
from lab.production.run_journal import Commanded, Entry, RunJournal
from lab.production.run_status import RunStatus
from lab.tasks.task import Order, Task
from lab.teaching.events import Event, OperatorActed, Tell

AT_WORK = "the robot is at work: pause first"
LISTEN_S = 0.2  # the longest stretch of waiting, so that Ctrl-C is heard
WORDS = tuple(word for word, command in COMMANDS.items() if command.how == "at once")


class Desk:
    """`say` may be called in any thread, `serve` in the one that simulates.

    attended: somebody is there who goes on after a protective stop; without, what it stops has failed.
    busy: the command under way, "" for none. What came of commands is told by the operation's `on_done`.
    """

    def __init__(self, operation: Operation, *, attended: bool = True, known: Sequence[Entry] = ()) -> None:
        """known: what a journal says was done, which is done again first."""
        self.operation, self._known = operation, known
        self.busy, self.closed = "lays the scene out", False
        self._changed = Condition()
        operation.controls.attended = attended

    @property
    def controls(self) -> Controls:
        """The stops and the pace."""
        return self.operation.controls

    @property
    def words(self) -> tuple[str, ...]:
        """The commands that are taken here."""
        return tuple(COMMANDS)

    @property
    def names(self) -> Mapping[str, Sequence[str]]:
        """What may follow some commands, by the command."""
        return self.operation.scene.names()

    @property
    def done(self) -> Sequence[Done]:
        """What came of all that was said."""
        return self.operation.done

    def now(self) -> RunStatus:
        """Where the run stands."""
        return self.operation.now()

    def say(self, line: str, by: str = OPERATOR) -> Done | None:
        """Take a command; what came of it, where that is known at once, else None."""
        try:
            said = spoken(line)
            if said.how == "at once":
                done = self.operation.at_once(said, by)
                if said.word == "step" and not done.refused:
                    self._begin(by)
                self._wake()
            elif said.how == "by hand" and self.busy and not self._rests:
                raise BadInput(RESET_FIRST if self.operation.controls.holds_arm else AT_WORK)
            elif said.how == "console":
                raise BadInput(f"{said.word}: it is said to a console, not to the run")
            else:
                self.operation.waiting.append((said, by))
                self._wake()
                return None
        except LabError as error:
            return self.operation.refuse(line, str(error), by)
        except Left:  # said while another left
            return None
        return done

    @property
    def _rests(self) -> bool:
        """Whether what is under way waits for the operator, or will after the move."""
        return StopKind.PAUSE in self.operation.controls.stops and not self.operation.controls.holds_arm

    def _begin(self, by: str) -> None:
        """A single step begins the run where nothing is under way."""
        if not self.busy and self.operation.scene.plan is not None:
            self.operation.waiting.append((spoken("run"), by))

    def leave(self) -> None:
        """Break off what is under way, and end."""
        self.closed = self.operation.scene.leaving = True
        self._wake()

    def stay(self) -> None:
        """Wait until somebody leaves. To be called in another thread than `serve`."""
        with self._changed:
            while not self.closed:
                self._changed.wait(LISTEN_S)

    def watched(self, pages: int) -> None:
        """So many pages are open: whether somebody attends the session does not depend on that."""

    def hear(self, event: Event) -> None:
        """The scene itself hears what happens."""

    def settle(self) -> None:
        """Wait until all that was said is done, or waits in a pause. To be called in another thread than `serve`."""
        with self._changed:
            while not (self.closed or self.still):
                self._changed.wait(0.05)

    @property
    def still(self) -> bool:
        """Whether nothing moves before somebody says something."""
        operation = self.operation
        if operation.waiting:  # looked at first: what is taken from there moves
            return False
        return not self.busy or (operation.scene.resting and operation.controls.waits)

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def serve(self) -> None:
        """Carry out what is said until somebody leaves; the scene is laid out first. Raises LabError."""
        operation = self.operation
        try:
            operation.repeat(self._known)
            while not self.closed:
                following = self._following()
                operation.write()
                if following is not None:
                    operation.do(*following)
        except Left:
            pass
        finally:
            self.busy, self.closed = "", True
            self._wake()

    def _following(self) -> tuple[Spoken, str] | None:
        """The next command; None when there is none for a while."""
        waiting = self.operation.waiting
        with self._changed:
            self.busy = ""
            if not waiting:
                self._changed.notify_all()
                self._changed.wait(0.1)
            if not waiting:
                return None
            self.busy = waiting[0][0].words
            return waiting.popleft()


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
