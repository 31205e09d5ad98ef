"""The entry of commands while another thread simulates: for an operated scene, or for a run that carries itself out."""

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

LEFT_FIRST = "the operator left before its turn"
AT_WORK = "the robot is at work: pause first"
LISTEN_S = 0.2  # longest single wait, so that Ctrl-C is noticed
WORDS = tuple(word for word, command in COMMANDS.items() if command.how == "at once")


class Desk:
    """The desk of an operated scene: `say` may be called in any thread, `serve` in the one that simulates.

    attended: whether somebody is there who releases a protective stop; otherwise a stopped command has failed.
    busy: the current command, or "". The operation's `on_done` is called with the results of commands.
    """

    def __init__(
        self,
        operation: Operation,
        *,
        attended: bool = True,
        known: Sequence[Entry] = (),
        words: Sequence[str] = tuple(COMMANDS),
    ) -> None:
        """known: the entries of a journal, which are repeated first. words: of the commands that pages offer."""
        self.operation, self._known, self.words = operation, known, words
        self.busy, self.closed = "lays the scene out", False
        self._changed = Condition()
        operation.controls.attended = attended

    @property
    def controls(self) -> Controls:
        """The stops and the pace of the run."""
        return self.operation.controls

    @property
    def names(self) -> Mapping[str, Sequence[str]]:
        """The possible arguments of some commands, by command."""
        return self.operation.scene.names()

    @property
    def done(self) -> Sequence[Done]:
        """The results of all commands."""
        return self.operation.done

    def now(self) -> RunStatus:
        """Where the run stands."""
        return self.operation.now()

    def say(self, line: str, by: str = OPERATOR) -> Done | None:
        """Accepts a command; returns its result if it is known at once, else None."""
        try:
            said = spoken(line)
            if said.word == "run" and self.busy == "run" and self._rests:
                said = spoken("go")
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
        except Left:  # entered while another operator left
            return None
        return done

    @property
    def _rests(self) -> bool:
        """Whether the current command waits for the operator, or will after the current move."""
        return StopKind.PAUSE in self.operation.controls.stops and not self.operation.controls.holds_arm

    def _begin(self, by: str) -> None:
        """Begins the run on a single step if no command is in progress."""
        if not self.busy and self.operation.scene.plan is not None:
            self.operation.waiting.append((spoken("run"), by))

    def leave(self) -> None:
        """Aborts the current command, and ends."""
        self.closed = self.operation.scene.leaving = True
        self._wake()

    def stay(self) -> None:
        """Waits until somebody leaves; to be called in another thread than `serve`."""
        with self._changed:
            while not self.closed:
                self._changed.wait(LISTEN_S)

    def watched(self, pages: int) -> None:
        """Ignores the number of open pages, on which the attendance of this session does not depend."""

    def hear(self, event: Event) -> None:
        """Does nothing: the scene hears events itself."""

    def settle(self) -> None:
        """Waits until all commands are done, or wait in a pause; to be called in another thread than `serve`."""
        with self._changed:
            while not (self.closed or self.still):
                self._changed.wait(0.05)

    @property
    def still(self) -> bool:
        """Whether nothing moves before the next command."""
        operation = self.operation
        waiting = next(iter(operation.waiting.copy()), None)  # first, because a command taken from there causes motion
        paused = bool(self.busy) and operation.scene.resting and operation.controls.waits
        if waiting is not None:
            return paused and waiting[0].how == "in turn"  # its turn comes when the operator goes on
        return paused or not self.busy

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def serve(self) -> None:
        """Lays the scene out, and carries out commands until somebody leaves. Raises LabError."""
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
            self.closed, operation.scene.leaving = True, False  # nothing is left to abort
            while operation.waiting:
                said, by = operation.waiting.popleft()
                operation.refuse(said.words, LEFT_FIRST, by)
            self.busy = ""
            self._wake()

    def _following(self) -> tuple[Spoken, str] | None:
        """The next command and its origin, or None if there is none for a while."""
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
    """The desk of a run: `say` and `now` may be called in any thread; `hear`, with every event, in the run's own.

    busy and names: as at the desk of an operated scene; done: the results of all commands.
    """

    busy = ""
    words = WORDS
    names: Mapping[str, Sequence[str]] = {}

    def __init__(self, task: Task, order: Order, controls: Controls, journal: RunJournal, tell: Tell) -> None:
        """tell: gets the events of commands before there is a floor."""
        self.controls, self._journal, self._tell = controls, journal, tell
        self.done: list[Done] = []
        self._floor: Floor | None = None
        self._lock, self._status = RLock(), RunStatus.of(task, order)
        self._unwritten = deque[Commanded]()

    def steering(self, conditions: Conditions) -> Conditions:
        """The conditions of a run that is steered from this desk."""
        return replace(
            conditions, on_floor=self._on_floor, before_step=lambda floor: self._write(), meanwhile=self._write
        )

    def _on_floor(self, floor: Floor) -> None:
        """Notes the floor on which the run is carried out."""
        self._floor, self._tell = floor, floor.tell

    def _write(self) -> bool:
        """Writes the commands to the journal; returns False, because the scene does not change."""
        while self._unwritten:
            self._journal.write(self._unwritten.popleft())
        return False

    def hear(self, event: Event) -> None:
        """Takes an event over."""
        with self._lock:
            self._status.hear(event)

    def now(self) -> RunStatus:
        """The status of the run; a stop shows as soon as it is pressed."""
        with self._lock:
            return self._status.copied().under(self.controls)

    def say(self, line: str, by: str = OPERATOR) -> Done:
        """Accepts a command and returns its result."""
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
        """Notes the number of open pages: with at least one the run is attended."""
        self.controls.attended = pages > 0
