"""A class at work: its desks, who is there, and what the teacher does. All of it runs in the server's event loop."""

import asyncio
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.classroom.desk import Desk, processes
from lab.classroom.desk_process import DeskOrder
from lab.classroom.kept_lesson import KEPT, kept_lesson
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import best_first, row_of, tile_of
from lab.errors import BadInput
from lab.files import is_file, write_whole
from lab.seat.page.page_state import LESSON_OVER

Json = dict[str, Any]
MOST_HINT = 200  # characters
# codes with which a page is closed: the class has ended; load again; another page of the pupil is open; the seat is taken away
OVER, RELOAD, REPLACED, REMOVED = 1001, 4001, 4002, 4003
MOST_LOST = 3  # times that a killed process of one lesson is started again by itself
AT_ONCE = 2  # desks that are started at the same time


async def unheard(message: Json) -> None:
    """Does nothing: the page is not connected to its desk yet."""


@dataclass(eq=False)
class PupilPage:
    """An open page of a pupil: functions that send it text, close it, and give its desk a message as if it had sent it.

    sees_free: whether the seat was free when its desk last told the page of it.
    """

    number: int
    send: Callable[[str], Any]
    close: Callable[[int], Any]
    say: Callable[[Json], Any] = unheard
    sees_free: bool = False


class Room:
    """The class: opened in an event loop, with all pupils of the roster.

    on_news: called when anything that the teacher sees has changed.
    """

    def __init__(self, roster: Roster) -> None:
        self.roster = roster
        self.paused = False
        self.on_news: Callable[[], None] = lambda: None
        self.ended = asyncio.Event()
        self.desks: dict[int, Desk] = {}
        self.pages: dict[int, PupilPage] = {}
        self.shoulders: set[PupilPage] = set()  # the teacher's pages at pupils' desks
        self._hints: dict[int, str] = {}
        self._helped: set[int] = set()
        # (pupil or team, earlier lesson) -> its document, if it was finished
        self._finished: dict[tuple[int, int], Json | None] = {}
        self._keeping: set[Path] = set()  # folders of lessons that are just being kept
        self._lost: Counter[Path] = Counter()  # a lesson's folder -> how often its process was killed
        self._asked: dict[int, tuple[int, float]] = {}  # pupil -> the pending question's number, and when it came
        self._context = processes()
        self._starting = asyncio.Semaphore(AT_ONCE)
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self) -> None:
        """Open the desks of the roster's pupils."""
        for pupil in self.roster.present:
            self.seat(pupil)

    def join(self, code: str, name: str) -> Json | None:
        """What is said to a new pupil, `page` is the address; None for a wrong code. Raises Full, and OSError."""
        joined = self.roster.join(code, name)
        if joined is None:
            return None
        pupil, key = joined
        self.seat(pupil)
        return {"name": pupil.name, "page": f"/desk/?token={key}"}

    async def end(self) -> None:
        """Close all desks: lessons that are not over can be resumed."""
        self.ended.set()
        await asyncio.gather(*(desk.close() for desk in {*self.desks.values()}))
        while self._tasks:  # what a desk says at its end is kept by a task of its own
            await asyncio.gather(*self._tasks, return_exceptions=True)

    # ---- desks

    def folder(self, pupil: Pupil, lesson: int) -> Path:
        """The folder of a pupil's lesson (from 0)."""
        return self.roster.lesson_folder(pupil, lesson)

    def seat(self, pupil: Pupil) -> None:
        """Open the desk of a pupil at the pupil's lesson: the lesson begins, goes on, or is shown if it is over."""
        before = self.desks.get(pupil.number)
        desk = self.desks[pupil.number] = Desk(self.order(pupil))
        desk.on_news = lambda: self._stirred(desk)
        self._place(desk, before, self.opens(pupil))

    def _share(self, order: DeskOrder, pupils: list[Pupil], before: Desk | None, begins: bool) -> Desk:
        """A new desk for several pupils, in the place of another one; begins: whether a lesson that is not over begins."""
        desk = Desk(order)
        self.desks |= dict.fromkeys([pupil.number for pupil in pupils], desk)
        desk.on_news = lambda: self._stirred(desk)
        self._place(desk, before, begins)
        for pupil in pupils if before is not None else ():
            self._asked.pop(pupil.number, None)
            if page := self.pages.get(pupil.number):
                self._start(page.close(RELOAD))
        return desk

    def order(self, learner: Pupil) -> DeskOrder:
        """What is taught at the desk of one of the roster's `learners`."""
        folder, toolbox = self.folder(learner, learner.lesson), self.toolbox(learner)
        times = self.roster.times or self.roster.study is not None
        lesson = self.roster.lessons[learner.lesson]
        return DeskOrder(lesson, folder, toolbox, modules=self.roster.modules, times=times)

    def _place(self, desk: Desk, before: Desk | None, opens: bool) -> None:
        """Put a desk in the place of another one; opens: whether a lesson that is not over gets a process."""
        kept = kept_lesson(desk.order.folder)
        if kept is not None:
            desk.state, desk.result, desk.parts = "over", kept["document"], kept["page"]
            desk.ready.set()
        elif not opens:
            desk.state = "idle"
            desk.ready.set()
        else:
            self._start(self._opened(desk, before))
        if before is not None:
            self._start(before.close())
        self.on_news()

    def toolbox(self, pupil: Pupil) -> Path:
        """The folder of the toolbox of a pupil's lesson."""
        return self.roster.folder / pupil.folder / "toolbox"

    def opens(self, pupil: Pupil) -> bool:
        """Whether a desk that is not over gets a process: always in a class."""
        return True

    async def _opened(self, desk: Desk, before: Desk | None) -> None:
        """Open a desk after the one before it, whose journal it may go on with, has been closed."""
        if before is not None:
            await before.close()
        async with self._starting:
            await desk.open(self._context)
            await desk.ready.wait()

    def _start(self, work: Any) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def at_desk(self, desk: Desk) -> list[int]:
        """The numbers of the pupils at a desk; none if another one is in its place."""
        return [number for number, other in self.desks.items() if other is desk]

    def _stirred(self, desk: Desk) -> None:
        """Something of a desk has changed: keep a finished lesson, note when a question came."""
        self._keep_lesson(desk)
        pupils = self.at_desk(desk)
        for number in pupils:
            self._pose(number, desk)
        is_lost = desk.state == "lost" and not (self.ended.is_set() or desk.is_closed)
        if pupils and is_lost and self.opens(self._pupil(pupils[0])):
            self._lost[desk.order.folder] += 1
            if self._lost[desk.order.folder] <= MOST_LOST:
                self.open_again(pupils[0])
        if pupils:
            self.on_news()

    def _keep_lesson(self, desk: Desk) -> None:
        """Keep a lesson that is over, once its page has said so or the desk is being closed."""
        folder = desk.order.folder
        if desk.state != "over" or folder in self._keeping or is_file(folder / KEPT):
            return
        page = desk.parts
        if not page.get("ended"):
            if not desk.is_closed or desk.result is None:
                return
            page = page | {"question": None, "receipt": desk.result.get("receipt"), "ended": LESSON_OVER}
        self._keeping.add(folder)
        self._start(self._kept(folder, {"document": desk.result, "page": page}))

    async def _kept(self, folder: Path, lesson: Json) -> None:
        """Write what is kept of a finished lesson, without keeping the class waiting."""

        def written() -> None:
            with suppress(OSError):  # a full disk: the journal has been written, and the lesson is over anyway
                write_whole(folder / KEPT, json.dumps(lesson).encode())

        await asyncio.to_thread(written)
        self._keeping.discard(folder)
        self._finished = {at: document for at, document in self._finished.items() if document is not None}
        self.on_news()

    def _pose(self, number: int, desk: Desk) -> None:
        """Note when a question has come to a pupil."""
        question = desk.questions.get(self.name_at(number))
        if not question:
            self._asked.pop(number, None)
        elif self._asked.get(number, (0, 0.0))[0] != question["number"]:
            self._asked[number] = (question["number"], time.monotonic())

    # ---- pupils' pages

    def name_at(self, number: int) -> str:
        """The name of a pupil's page at the desk: "" unless several teach there."""
        return ""

    def arrived(self, page: PupilPage) -> None:
        """A pupil's page is open; an older one of the same pupil, perhaps behind a closed lid, is closed."""
        before = self.pages.pop(page.number, None)
        if before is not None:
            self._start(before.close(REPLACED))
        self.pages[page.number] = page
        self._show(page.number)
        self.on_news()

    def left(self, page: PupilPage) -> None:
        """A pupil's page was closed."""
        if self.pages.get(page.number) is page:
            del self.pages[page.number]
        self.on_news()

    def refusal(self, number: int) -> str:
        """Why a pupil's messages do not count now; "" if they do."""
        if self.paused:
            return "Your teacher has paused the class."
        return "Your teacher answers for you now." if number in self._helped else ""

    async def passes(self, page: PupilPage, message: str) -> bool:
        """Whether a message of a page goes to the desk, as all of the teacher's do; the page is told why one does not."""
        refusal = "" if page in self.shoulders else self.refusal(page.number)
        if refusal:
            await page.send(json.dumps({"refusal": refusal}))
        return not refusal

    def _show(self, number: int) -> None:
        """Tell a pupil's page what the class says: lesson, pause, hint, help."""
        page, pupil = self.pages.get(number), self.roster.pupils[number - 1]
        if page is None:
            return
        told = {
            "name": pupil.name,
            "lesson": pupil.lesson + 1,
            "lessons": len(self.roster.lessons),
            "paused": self.paused,
            "hint": self._hints.get(number, ""),
            "helped": number in self._helped,
        }
        self._start(page.send(json.dumps({"class": told | self.told_more(number)})))

    def told_more(self, number: int) -> Json:
        """What else a pupil's page is told: nothing in a class."""
        return {}

    def closed_text(self, number: int) -> str:
        """What a pupil's page says of a lesson that is not over and has no process."""
        desk = self.desks[number]
        return f"This desk is closed: {desk.text or desk.state}. Ask your teacher to open it again."

    # ---- what the teacher does

    def pause(self, paused: bool) -> None:
        """Pause all pupils, or let them go on; learners that ask nobody go on meanwhile."""
        self.paused = paused
        self._show_all()

    def hint(self, number: int, text: str) -> None:
        """Show a pupil a hint, "" for none. Raises BadInput for a pupil that is not there, and for too long a hint."""
        self._pupil(number)
        if len(text) > MOST_HINT:
            raise BadInput(f"hint of {len(text)} characters: at most {MOST_HINT} are shown")
        self._hints[number] = text
        self._show_all(number)

    def help(self, number: int, begins: bool) -> None:
        """Let the teacher's page answer for a pupil, or give the seat back. Raises BadInput for a pupil that is not there."""
        self._pupil(number)
        (self._helped.add if begins else self._helped.discard)(number)
        gives = [self.pages.get(number)] if begins else [page for page in self.shoulders if page.number == number]
        for page in gives:
            if page is not None:
                self._start(page.say({"seat": "give"}))
        page = self.pages.get(number)
        if not begins and page is not None and page.sees_free:  # the teacher's page was closed before
            self._start(page.say({"seat": "take"}))
        self._show_all(number)

    def takes_free_seat(self, number: int) -> bool:
        """Whether a pupil's page takes the seat when it is free: always, unless the teacher answers."""
        return number not in self._helped

    def go_on(self, number: int | None, lesson: int | None = None) -> None:
        """The next lesson, or the lesson with a number from 0, of a pupil, or of all if `number` is None.

        Who is at that lesson already stays there. Raises BadInput for a pupil or lesson that there is not, and OSError if the
        roster cannot be written; then nobody goes on.
        """
        pupils = self.roster.present if number is None else [self._pupil(number)]
        moved = {
            pupil.number: to for pupil in pupils if (to := self._to_lesson(pupil, number is None, lesson)) is not None
        }
        self._move(moved)
        for one in moved:
            self.seat(self._pupil(one))
            if page := self.pages.get(one):
                self._start(page.close(RELOAD))

    def _to_lesson(self, learner: Pupil, all_go: bool, lesson: int | None) -> int | None:
        """The lesson (from 0) to which a pupil or team goes; None if it stays, or if all go on and it is at the last one."""
        wanted = learner.lesson + 1 if lesson is None else lesson
        stays = wanted == learner.lesson or (all_go and wanted >= len(self.roster.lessons))
        return None if stays else wanted

    def _move(self, lessons: Mapping[int, int]) -> None:
        """Let pupils go on with lessons, by their numbers, and forget what was of the lesson before. Raises as `Roster.move`."""
        self.roster.move(lessons)
        for number in lessons:
            self._hints.pop(number, None)
            self._helped.discard(number)
            self._asked.pop(number, None)

    def begin_lessons(self) -> None:
        """Begin the lessons that wait for the teacher. Raises BadInput if none does."""
        raise BadInput("no lesson waits: each pupil's begins when the pupil has joined")

    def open_again(self, number: int) -> None:
        """Open a desk again whose process has ended or failed. Raises BadInput if it has not."""
        pupil = self._pupil(number)
        self._check_closed(number)
        self.seat(pupil)
        if page := self.pages.get(number):
            self._start(page.close(RELOAD))

    def _check_closed(self, number: int) -> None:
        """Raises BadInput unless a desk's process has ended before its lesson was over."""
        if (state := self.desks[number].state) in ("idle", "opening", "open", "over"):
            raise BadInput(f"desk {number} is {state}: nothing is to be mended")

    def remove(self, number: int) -> None:
        """Take a pupil's seat away; somebody else may join instead.

        Raises BadInput for a pupil that is not there, and OSError if the roster cannot be written; then the pupil stays.
        """
        self._pupil(number)
        self.roster.remove(number)
        self._close_pages(number, REMOVED)
        self.pages.pop(number, None)
        self._helped.discard(number)
        for known in (self._hints, self._asked):
            known.pop(number, None)
        self._leave(number)
        self.on_news()

    def _close_pages(self, number: int, code: int) -> None:
        """Close the pages at a pupil's desk: the pupil's own, and those that look over the shoulder."""
        for page in [self.pages.get(number), *(page for page in self.shoulders if page.number == number)]:
            if page is not None:
                self._start(page.close(code))

    def _leave(self, number: int) -> None:
        """Close the desk of a pupil who was removed."""
        self._start(self.desks.pop(number).close())

    def _pupil(self, number: int) -> Pupil:
        if not 1 <= number <= len(self.roster.pupils) or self.roster.pupils[number - 1].is_gone:
            raise BadInput(f"pupil {number}: nobody in the class has this number")
        return self.roster.pupils[number - 1]

    def _show_all(self, number: int | None = None) -> None:
        for one in self.pages if number is None else [number]:
            self._show(one)
        self.on_news()

    # ---- what the teacher sees

    def tiles(self) -> dict[int, Json]:
        """The tile of each pupil, by number."""
        now_s = time.monotonic()
        return {
            pupil.number: tile_of(
                pupil,
                self.desks[pupil.number],
                self.desks[pupil.number].questions.get(self.name_at(pupil.number)),
                pupil.number in self.pages,
                now_s - self._asked[pupil.number][1] if pupil.number in self._asked else None,
            )
            | {"hint": self._hints.get(pupil.number, ""), "helped": pupil.number in self._helped}
            for pupil in self.roster.present
        }

    def rows(self) -> list[Json]:
        """The rows of all finished lessons: lesson by lesson, best teacher first."""
        rows: list[Json] = []
        for lesson in range(len(self.roster.lessons)):
            finished = [(learner, self._document(learner, lesson)) for learner in self.roster.learners]
            rows += best_first([row_of(learner, lesson, document) for learner, document in finished if document])
        return rows

    def states(self) -> dict[int, Json]:
        """Of each pupil's desk: the pupil's name, the lesson's number, its state and why it failed."""
        return {pupil.number: self._state(pupil, self.desks[pupil.number]) for pupil in self.roster.present}

    def standing(self) -> dict[int, Json]:
        """The same of each of the roster's `learners`, by number."""
        return {learner.number: self._state(learner, self.desk_of(learner)) for learner in self.roster.learners}

    def _state(self, learner: Pupil, desk: Desk) -> Json:
        return {"name": learner.name, "lesson": learner.lesson + 1, "state": desk.state, "text": desk.text}

    def teams(self) -> list[Json]:
        """What the teacher sees of each team; none in a class without teams."""
        return []

    def turns(self) -> Json | None:
        """What the teacher sees of a run that pupils operate in turns; None in any other class."""
        return None

    def _document(self, learner: Pupil, lesson: int) -> Json | None:
        if lesson == learner.lesson:
            result = self.desk_of(learner).result
            return None if result is None else dict(result)
        if (learner.number, lesson) not in self._finished:
            kept = kept_lesson(self.folder(learner, lesson))
            self._finished[learner.number, lesson] = None if kept is None else dict(kept["document"])
        return self._finished[learner.number, lesson]

    def desk_of(self, learner: Pupil) -> Desk:
        """The desk of one of the roster's `learners`."""
        return self.desks[learner.number]
