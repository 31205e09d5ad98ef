"""The operator's run: commands that are carried out one after the other in one scene, each journalled before it takes effect.

A command takes effect at a physics step, and between two commands no simulated time goes by: the scene stands still as
long as nobody says anything, machines under way with it. So the commands with their steps, the stops with theirs, task,
options and seed give the same scene again, bit for bit. The steps are counted from when the scene was laid out last.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeGuard

from lab.errors import LabError, WorkFailed
from lab.production.composer import Conditions
from lab.production.controls import StopsChanged
from lab.production.operation.commands import OPERATOR, Done, Spoken, press, spoken
from lab.production.operation.operated_scene import OperatedScene, SceneCalls
from lab.production.report import Report
from lab.production.run_journal import Commanded, Entry, Stopped, stops_of
from lab.production.run_status import RunStatus
from lab.tasks.task import Order, Task
from lab.teaching.events import OperatorActed
from lab.teaching.teacher import Teacher


class Operation:
    """The operator's commands in one scene; except `at_once` and `now` it belongs to the thread that simulates.

    waiting: commands from other threads, with their origin (see `Desk`). done: the results of all commands; on_done: called
    with each result, in the thread of the command.
    """

    def __init__(self, task: Task, order: Order, seed: int, teacher: Teacher, conditions: Conditions) -> None:
        """Prepares a scene that `open` lays out; the teacher's listener gets its events."""
        calls = SceneCalls(on_laid_out=self._laid_out, before_step=self.write, meanwhile=self._meanwhile)
        self.scene = OperatedScene(task, order, seed, teacher, conditions, calls)
        self.controls, self._journal = conditions.controls, conditions.journal
        self.waiting: deque[tuple[Spoken, str]] = deque()
        self.done: list[Done] = []
        self.on_done: list[Callable[[Done], None]] = []
        self._began = time.perf_counter()
        self._unwritten = deque[Commanded]()
        self._script = deque[Stopped | Commanded]()  # the entries of a journal that are still to be repeated
        self._inside = False  # a pause, carrying a command out

    def open(self) -> None:
        """Lays the scene out. Raises BadInput for an impossible one."""
        self.scene.open()

    def close(self) -> None:
        """Closes the scene; safe to call again."""
        self.write()
        self.scene.close()

    def now(self) -> RunStatus:
        """The status of the run, for any thread; a stop shows as soon as it is pressed."""
        return self.scene.now().under(self.controls)

    def do(self, line: str | Spoken, by: str = OPERATOR) -> Done:
        """The result of a command, which is carried out in the thread that simulates; the result contains its error."""
        words = line if isinstance(line, str) else line.words
        try:
            said = spoken(line) if isinstance(line, str) else line
            words = said.words
            if said.how == "at once":
                return self.at_once(said, by)
            deed = self.scene.checked(said)
        except LabError as error:
            return self._noted(Done(words, refused=str(error)), by)
        self._noted(Done(words), by)
        try:
            told = deed()
        except LabError as error:
            self.scene.trouble(str(error))
            return self._kept(Done(words, failed=str(error)))
        return self._kept(Done(words, said=told))

    def at_once(self, said: Spoken, by: str = OPERATOR) -> Done:
        """The result of an immediate command (a stop, its release, or the pace), in any thread."""
        return self._aside(Done(said.words, refused=press(self.controls, said, by)), by)

    def _noted(self, done: Done, by: str) -> Done:
        """Writes a command to the journal before it takes effect, and passes its result on."""
        floor = self.scene.floor
        self.write()
        if not self.scene.again:
            self._journal.write(Commanded(floor.steps, done.words, by, done.refused))
        self.scene.tell(OperatorActed(done.words, by, floor.now_s, done.refused))
        return self._kept(done) if done.refused else done

    def refuse(self, words: str, why: str, by: str = OPERATOR) -> Done:
        """The result of a refused command, from any thread."""
        return self._aside(Done(words, refused=why), by)

    def _aside(self, done: Done, by: str) -> Done:
        """Passes on the result of a command in another thread; the thread that simulates writes it to the journal later."""
        if not self.scene.again:
            self._unwritten.append(Commanded(self.scene.steps, done.words, by, done.refused))
        self.scene.tell(OperatorActed(done.words, by, self.scene.now().now_s, done.refused))
        return self._kept(done)

    def write(self) -> None:
        """Writes commands of other threads to the journal, in the thread that simulates."""
        while self._unwritten:
            self._journal.write(self._unwritten.popleft())

    def _kept(self, done: Done) -> Done:
        with self.scene.lock:
            self.done.append(done)
        for told in self.on_done:
            told(done)
        return done

    def _meanwhile(self) -> bool:
        """Carries out, in a pause of the run, one command by hand; returns whether there was one."""
        self.scene.check_leaving()
        if self._inside:
            return False
        if self.waiting:
            self.scene.resting = False  # before it is taken: see `Desk.still`
        following = self._following() if self.scene.again else self._said_by_hand()
        if following is None:
            self.scene.resting = self.controls.waits
            return False
        self._inside = True
        try:
            self.do(*following)
            self.scene.held_first()
        except LabError as error:
            self.scene.trouble(str(error))
        finally:
            self._inside = False
        return True

    def _said_by_hand(self) -> tuple[Spoken, str] | None:
        return self.waiting.popleft() if self.waiting and self.waiting[0][0].how == "by hand" else None

    # ---- once more ---------------------------------------------------------------------------------------------------

    def repeat(self, entries: Sequence[Entry]) -> None:
        """Repeats the commands of a journal. Raises WorkFailed if one does not come at its physics step."""
        self._script = deque(entry for entry in entries if isinstance(entry, Stopped) or _is_deed(entry))
        self.scene.again = True
        self.open()
        while self._script:
            entry = self._script.popleft()
            if isinstance(entry, Stopped):
                continue
            if entry.step != self.scene.floor.steps:
                raise WorkFailed(
                    f"'{entry.words}' came at step {entry.step}, and this run is at {self.scene.floor.steps}"
                )
            self.do(entry.words, entry.by)
        self.scene.again = False

    def _laid_out(self) -> None:
        """Gives the floor the stops of a repeated journal up to the next layout of the scene."""
        if not self.scene.again:
            return
        stops, last = list[StopsChanged](), 0
        for entry in self._script:
            if isinstance(entry, Commanded) and entry.words.split()[0] == "parts":
                break
            if isinstance(entry, Stopped):
                stops.append(stops_of(entry))
            if isinstance(entry, Stopped | Commanded):
                last = max(last, entry.step)
        self.scene.floor.stops.again(stops, last)

    def _following(self) -> tuple[Spoken, str] | None:
        """The next command of the journal if it was given in this pause, else None."""
        while self._script and isinstance(self._script[0], Stopped) and self._script[0].step <= self.scene.floor.steps:
            self._script.popleft()
        entry = self._script[0] if self._script else None
        if not isinstance(entry, Commanded) or entry.step != self.scene.floor.steps:
            return None
        said = spoken(entry.words)
        if said.how != "by hand":
            return None
        self._script.popleft()
        return said, entry.by

    # ---- what came of it ---------------------------------------------------------------------------------------------

    def report(self) -> Report | None:
        """The report of the run, as that of `lab run`; None if no plan was made."""
        scene = self.scene
        plan = scene.plan
        if plan is None:
            return None
        left, moves, cell = bool(plan.state.sequence), plan.state.moves, plan.state.cell
        why = scene.failure or ("the operator left before its end" if left else None)
        outcome = replace(
            plan.production.outcome(why, left),
            happened=tuple(scene.injector.happened),
            heard=tuple(scene.heard),
            program=scene.motions.program(scene.task, scene.seed, moves, cell.part_name),
        )
        scene.recorder.take()
        result = plan.found, plan.method, plan.proven
        return Report(
            scene.prepared, plan.taught, *result, outcome, scene.recorder.recording, self._began, learning=plan.learning
        )


def _is_deed(entry: Entry) -> TypeGuard[Commanded]:
    """Whether a line is a command "in turn" or "by hand"; stops and the pace have their own lines."""
    return isinstance(entry, Commanded) and not entry.refused and spoken(entry.words).how in ("in turn", "by hand")
