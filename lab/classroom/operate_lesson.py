"""A class's run by hand: that of `lab operate`, which the pupils operate on one page in turns, kept in the run's folder."""

from pathlib import Path
from threading import Event, Thread
from typing import Any

from lab.advice.advising import Advising
from lab.classroom.class_lesson import check_own
from lab.errors import counted
from lab.production.operation.commands import COMMANDS
from lab.production.operation.desk import LISTEN_S, Desk
from lab.production.operation.operated_run import kept_operation, operating_desk
from lab.production.run_journal import RunJournal, is_run
from lab.production.run_options import RunOptions, begun, kept_task
from lab.seat.lesson_seat import LessonSeat
from lab.seat.page.teaching_page import SeatPage
from lab.tasks.task_file import load
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.summary import delivered_in_words

SPEED = 4.0  # simulated seconds per second at the beginning, as lab operate --page has it
WORDS = tuple(word for word, command in COMMANDS.items() if command.how != "console")  # nobody leaves for all


def operated_lesson(
    options: RunOptions, folder: Path, toolbox: Toolbox, seat: LessonSeat, page: SeatPage, finish: Event
) -> dict[str, Any]:
    """The document of `lab operate --json`, after the run in `folder` was finished; one that is there already goes on.

    finish: set when the teacher finishes the run. Raises KeyboardInterrupt when the desk is closed before, BadInput for a
    journal of another run, and what the simulation raises.
    """
    if is_run(folder):
        kept, task = kept_task(folder, "lab class --resume")
        check_own(kept, options, folder)
        journal = RunJournal.resume(folder)
    else:
        task = load(options.task)
        journal = begun(options, task, folder, "operate")
    try:
        teacher = Teacher(toolbox, Advising.of(options.advisors), options.seed, seat.hear)
        desk = operating_desk(options, task, teacher, journal, page, speed=SPEED, words=WORDS)
        desk.operation.on_done.append(lambda done: page.ran())
        page.asks_nobody()
        page.steer(desk)
        try:
            _simulate(desk, finish)
            document = kept_operation(desk.operation, folder)
        finally:
            desk.operation.close()
    finally:
        journal.close()
    made = delivered_in_words(document["delivered"], document["parts"])
    page.finished(f"The run is over: {made}, {counted(len(document['commands']), 'command')}.")
    return document


def _simulate(desk: Desk, finish: Event) -> None:
    """Carry the commands out until the run is finished. Raises what the simulation raises."""
    raised: list[Exception] = []

    def serve() -> None:
        try:
            desk.serve()
        except Exception as error:  # it is raised again in the thread that waits
            raised.append(error)

    worker = Thread(target=serve, name="simulation", daemon=True)
    worker.start()
    try:
        while worker.is_alive() and not finish.wait(LISTEN_S):
            pass
    finally:
        desk.leave()
        worker.join()
    for error in raised:
        raise error
