"""A study at work: participants go step by step through their arms; all of it runs in the server's event loop."""

import asyncio
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

from lab.classroom.desk import Desk
from lab.classroom.desk_process import is_over
from lab.classroom.participant import Participant, Step, seconds_since, timestamp
from lab.classroom.questionnaire import checked_answers
from lab.classroom.room import RELOAD, Json, PupilPage, Room
from lab.classroom.roster import Pupil, hash_of
from lab.classroom.study import Study
from lab.classroom.study_protocol import TeacherAct
from lab.errors import BadInput

MOST_UNDECIDED = 200  # who have joined and not agreed yet; the first of them has to join again
HERE_S = 15.0  # for which a page that asks for its step every few seconds counts as open
STUCK = ("failed", "lost")  # states of a desk whose lesson does not go on by itself


class StudyRoom(Room):
    """The participants of a study. Nothing about them is kept before they have agreed, and nothing after they withdraw."""

    def __init__(self, study: Study) -> None:
        super().__init__(study.roster)
        self.study = study
        self._undecided: dict[str, None] = {}  # hashes of the keys of those who have not agreed yet, oldest first
        self._limits: dict[int, tuple[int, asyncio.TimerHandle]] = {}  # number -> the limited step, and its alarm
        self._seen_s: dict[int, float] = {}  # number -> when a page last asked for the step
        self._fresh: set[int] = set()  # whose lesson has not been shown yet: its time begins then
        self._former: dict[int, list[Desk]] = {}  # desks of earlier lessons, which may still draw
        self._begun = False

    def begin(self) -> None:
        """Take up the participants, whose desks open when they come back; lessons whose time has passed meanwhile end."""
        super().begin()
        self._begun = True
        for number, person in [*self.study.people.items()]:
            step = person.step
            if step is not None and step.kind == "lesson" and step.ended is None:
                self._limit(number, person)

    async def end(self) -> None:
        """Close all desks: lessons that are not over can be resumed."""
        for _, alarm in self._limits.values():
            alarm.cancel()
        await super().end()

    # ---- desks

    def toolbox(self, pupil: Pupil) -> Path:
        """A toolbox for each lesson alone: what was learned in one arm would otherwise be found again in another."""
        return self.roster.folder / pupil.folder / f"toolbox-{pupil.lesson + 1}"

    def opens(self, pupil: Pupil) -> bool:
        """Whether the participant is at a lesson, since the server has begun."""
        step = self._step(pupil.number)
        return self._begun and step is not None and step.kind == "lesson" and step.ended is None

    def _step(self, number: int) -> Step | None:
        person = self.study.people.get(number)
        return None if person is None else person.step

    def arrived(self, page: PupilPage) -> None:
        """A participant's teaching page is open: the desk of the lesson opens, unless it has."""
        pupil = self._pupil(page.number)
        if self.desks[page.number].state == "idle" and self.opens(pupil):
            self.seat(pupil)
        super().arrived(page)
        self._lesson_seen(page.number, self.desks[page.number])

    def seat(self, pupil: Pupil) -> None:
        """Open the desk of a participant who is at a lesson; else it has no process."""
        if (before := self.desks.get(pupil.number)) is not None:
            self._former.setdefault(pupil.number, []).append(before)
        super().seat(pupil)
        self._lesson_seen(pupil.number, self.desks[pupil.number])

    def _stirred(self, desk: Desk) -> None:
        super()._stirred(desk)
        for number in self.at_desk(desk):
            self._lesson_seen(number, desk)

    def _lesson_seen(self, number: int, desk: Desk) -> None:
        """End the lesson's step when its last episode has ended, or who teaches it has; start its clock when its page is there.

        The document and the pictures of the lesson, which come later, are no time of the participant's.
        """
        step = self._step(number)
        if self.desks.get(number) is not desk or step is None or step.kind != "lesson" or step.ended is not None:
            return
        has_quit = desk.state == "stopped" and not desk.is_closed
        if has_quit or _is_taught(desk) or (desk.state == "over" and (desk.parts.get("ended") or not desk.is_there)):
            self._end_lesson(number, timed_out=False)
        elif desk.state == "open" and number in self._fresh and number in self.pages:
            self._fresh.discard(number)
            person = self.study.people[number].with_step(replace(step, began=timestamp()))
            self._keep(person)
            self._limit(number, person)
            self._show(number)
        elif desk.state in STUCK:
            self._show(number)

    def open_again(self, number: int) -> None:
        """Open a desk again whose process has ended or failed. Raises BadInput if it has not, and after the lesson's step."""
        if not self.opens(self._pupil(number)):
            raise BadInput(f"participant {number} is at no lesson that could go on")
        super().open_again(number)

    # ---- time limits

    def _limit(self, number: int, person: Participant) -> None:
        """Set the alarm of the current lesson, for as long as is left of its time."""
        step = person.steps[-1]
        limit_s = self.study.protocol.arm(step.arm or "").time_limit_s
        if limit_s is None:
            return
        left_s = max(0.0, limit_s - seconds_since(step.began))
        if number in self._limits:
            self._limits[number][1].cancel()
        alarm = asyncio.get_running_loop().call_later(left_s, self._time_up, number, len(person.steps))
        self._limits[number] = (len(person.steps), alarm)

    def _time_up(self, number: int, at: int) -> None:
        person = self.study.people.get(number)
        if person is None or len(person.steps) != at or person.steps[-1].ended is not None:
            return
        self._end_lesson(
            number, timed_out=not (_is_taught(self.desks[number]) or is_over(self.desks[number].order.folder))
        )

    def _end_lesson(self, number: int, timed_out: bool) -> None:
        """The lesson's step has ended: its page offers to go on, and after its time the desk is closed."""
        if number in self._limits:
            self._limits.pop(number)[1].cancel()
        self._keep(self.study.people[number].with_end(timed_out))
        if timed_out:
            self._start(self.desks[number].close())
        self._show_all(number)

    def _keep(self, person: Participant) -> None:
        """Keep a record that no request waits for; if it cannot be written, the next step's writes it."""
        self.study.people[person.number] = person
        with suppress(OSError):
            self.study.keep(person)

    def refusal(self, number: int) -> str:
        """Why a participant's messages do not count now; "" if they do."""
        step = self._step(number)
        if step is not None and step.timed_out:
            return "Your time for this lesson is up."
        return super().refusal(number)

    # ---- participants

    def join(self, code: str, name: str) -> Json | None:
        """The address of the consent, of which nothing is kept on disk; None for a wrong code. Raises Full."""
        if not self.roster.is_code(code):
            return None
        self.roster.check_room()
        key = token_urlsafe(16)
        self._undecided[hash_of(key)] = None
        if len(self._undecided) > MOST_UNDECIDED:
            del self._undecided[next(iter(self._undecided))]
        return {"name": "", "page": f"/step/?token={key}"}

    def _person(self, key: str) -> Participant | None:
        pupil = self.roster.of_key(key)
        return None if pupil is None else self.study.people.get(pupil.number)

    def state(self, key: str) -> Json | None:
        """What the page of a key shows: the consent, or the current step; None for a key of nobody."""
        protocol = self.study.protocol
        if hash_of(key) in self._undecided:
            return {
                "kind": "consent",
                "title": protocol.title,
                "text": protocol.texts.welcome,
                "consent": protocol.texts.consent,
            }
        person = self._person(key)
        if person is None:
            return None
        self._seen_s[person.number] = time.monotonic()
        step = person.step
        shown: Json = {
            "title": protocol.title,
            "participant": person.participant,
            "step": len(person.steps),
            "steps": len(self.study.planned(person)),
        }
        if step is None:
            return shown | {"kind": "thanks", "text": protocol.texts.thanks}
        shown |= {"kind": step.kind}
        if step.kind == "text":
            return shown | {"text": protocol.arm(step.arm or "").text}
        if step.kind == "lesson":
            return shown | {"over": self._may_go_on(step, person.number), "timed_out": step.timed_out}
        asked = protocol.questionnaire(step.name)
        return shown | {"heading": asked.title, "text": asked.text, "items": [item.shown() for item in asked.asked]}

    async def do(self, key: str, wish: Json) -> Json:
        """Carry out what a participant's page wants; what it shows from now on.

        Wishes: {"do": "agree"}, {"do": "decline"}, {"do": "go on", "step": 3}, with "answers" by item of a questionnaire, and
        {"do": "withdraw"}. Raises BadInput, for the participant to read, Full, and OSError.
        """
        match wish:
            case {"do": "agree"} if hash_of(key) in self._undecided:
                self._agreed(key)
            case {"do": "decline"} if hash_of(key) in self._undecided:
                del self._undecided[hash_of(key)]
                return {"kind": "declined"}
            case {"do": "go on", "step": int(at)} if type(at) is int and (person := self._person(key)) is not None:
                self._go_on(person, at, wish.get("answers", {}))
            case {"do": "withdraw"} if (person := self._person(key)) is not None:
                await self._withdraw(person.number)
                return {"kind": "withdrawn"}
            case _:
                raise BadInput("that was no message of this page")
        shown = self.state(key)
        assert shown is not None
        return shown

    def _is_stuck(self, number: int) -> bool:
        """Whether a lesson has failed, so that the participant may go on without it."""
        return number in self.desks and self.desks[number].state in STUCK

    def _may_go_on(self, step: Step, number: int) -> bool:
        """Whether the participant at a lesson's step may go on."""
        return step.ended is not None or self._is_stuck(number)

    def _agreed(self, key: str) -> None:
        pupil = self.study.admit(key)
        del self._undecided[hash_of(key)]
        self._enter(pupil.number)

    def _go_on(self, person: Participant, at: int, given: Any) -> None:
        """End the current step, if it may end, and begin the next one."""
        step = person.step
        if step is None or at != len(person.steps):
            raise BadInput(f"You are at step {len(person.steps)}, not {at}.")
        if step.kind == "lesson" and not self._may_go_on(step, person.number):
            raise BadInput("This lesson is not over yet.")
        answers = {}
        if step.kind == "questionnaire":
            if not isinstance(given, dict):
                raise BadInput("that was no message of this page")
            answers = checked_answers(self.study.protocol.questionnaire(step.name).asked, given)
        self._advance(person.with_end(answers=answers))

    def _advance(self, person: Participant) -> None:
        """Begin the step after the one that has ended."""
        self.study.keep(person.at_next(self.study.planned(person)))
        if person.number in self._limits:
            self._limits.pop(person.number)[1].cancel()
        self._enter(person.number)

    def _enter(self, number: int) -> None:
        """The current step has just begun: open its desk, or close the one before."""
        step = self._step(number)
        if step is not None and step.lesson is not None and step.kind == "lesson":
            self._fresh.add(number)
            with suppress(OSError):  # the record says where the participant is
                self.roster.move({number: step.lesson - 1})
            self.seat(self._pupil(number))
        elif number in self.desks:
            self._start(self.desks[number].close())
        else:
            self.seat(self._pupil(number))
        if page := self.pages.get(number):
            self._start(page.close(RELOAD))
        self.on_news()

    async def _withdraw(self, number: int) -> None:
        """Close the participant's desk, then delete everything but the number. Raises OSError."""
        pupil, person = self._pupil(number), self.study.people.pop(number)
        if number in self._limits:
            self._limits.pop(number)[1].cancel()
        desks = [self.desks[number], *self._former.pop(number, [])]
        await asyncio.gather(*(desk.close() for desk in desks))
        try:
            await asyncio.to_thread(self.study.erase, pupil)
            self.roster.retire(number)
        except OSError:
            self.study.people[number] = person  # who may try again
            self.seat(pupil)
            if person.step is not None and person.step.kind == "lesson" and person.step.ended is None:
                self._limit(number, person)
            raise
        del self.desks[number]
        self._close_pages(number, RELOAD)
        for known in (self._hints, self._asked, self._seen_s):
            known.pop(number, None)
        self._fresh.discard(number)
        self._finished = {lesson: document for lesson, document in self._finished.items() if lesson[0] != number}
        self.on_news()

    def told_more(self, number: int) -> Json:
        """What the teaching page is told of the step; not which lesson of the study it is, which would tell the arm."""
        person = self.study.people.get(number)
        if person is None:
            return {}
        step, limit_s = person.step, None
        if step is not None and step.kind == "lesson" and step.ended is None:
            limit_s = self.study.protocol.arm(step.arm or "").time_limit_s
        return {
            "lesson": 1,
            "lessons": 1,
            "study": {
                "step": len(person.steps),
                "steps": len(self.study.planned(person)),
                "here": step is not None and step.kind == "lesson",
                "over": step is not None and self._may_go_on(step, number),
                "stuck": step is not None and step.ended is None and self._is_stuck(number),
                "timed_out": step is not None and step.timed_out,
                "left_s": None if limit_s is None or step is None else max(0.0, limit_s - seconds_since(step.began)),
            },
        }

    def closed_text(self, number: int) -> str:
        """What a participant's page says of a lesson that is not over and has no process."""
        step = self._step(number)
        if step is None or step.kind != "lesson":
            return "No lesson is open now."
        if step.ended is None:
            return "This lesson has stopped: tell whoever leads the study."
        return "Your time for this lesson is up." if step.timed_out else "You have ended this lesson."

    # ---- who leads the study

    def _allow(self, act: TeacherAct) -> None:
        if act not in self.study.protocol.teacher_may:
            raise BadInput(f'a study goes by its protocol, whose teacher_may does not have "{act}"')

    def pause(self, paused: bool) -> None:
        """Pause all participants, or let them go on; time limits go on. Raises BadInput unless the protocol allows it."""
        self._allow("pause")
        super().pause(paused)

    def hint(self, number: int, text: str) -> None:
        """Show a participant a hint. Raises BadInput unless the protocol allows it."""
        self._allow("hint")
        super().hint(number, text)

    def help(self, number: int, begins: bool) -> None:
        """Answer for a participant. Raises BadInput unless the protocol allows it."""
        self._allow("help")
        super().help(number, begins)

    def go_on(self, number: int | None, lesson: int | None = None) -> None:
        """End the step of a participant, whatever it is. Raises BadInput unless the protocol allows it, and OSError."""
        self._allow("next")
        if number is None or lesson is not None:
            raise BadInput("a study goes by its protocol: a participant goes on step by step")
        person = self.study.people.get(self._pupil(number).number)
        if person is None:
            raise BadInput(f"participant {number} is just withdrawing")
        if person.step is None:
            raise BadInput(f"{person.participant} has finished")
        self._advance(person.with_end())

    def remove(self, number: int) -> None:
        """Raises BadInput: a participant's data goes with the participant's own withdrawal, and stays without."""
        raise BadInput("nobody is removed from a study: participants withdraw themselves")

    def tiles(self) -> dict[int, Json]:
        """The tile of each participant, by number, with the step and the arm."""
        tiles, now_s = super().tiles(), time.monotonic()
        for number, tile in tiles.items():
            person = self.study.people.get(number)
            if person is None:  # who is just withdrawing
                continue
            step = person.step
            if step is None or step.kind != "lesson" or step.ended is not None:
                tile |= {"state": "idle", "text": _doing(step), "asks": ""}
            tile["here"] |= now_s - self._seen_s.get(number, -HERE_S) < HERE_S
            tile["study"] = {
                "step": len(person.steps),
                "steps": len(self.study.planned(person)),
                "arm": "" if step is None else step.arm or "",
                "order": person.order,
                "doing": _doing(step),
            }
        return tiles


def _is_taught(desk: Desk) -> bool:
    """Whether the last episode of a desk's lesson has ended."""
    lesson, curve = desk.parts.get("lesson") or {}, desk.parts.get("curve") or {}
    return bool(0 < lesson.get("episodes", 0) <= curve.get("count", 0))


def _doing(step: Step | None) -> str:
    """What a participant is at, in words for whoever leads the study."""
    if step is None:
        return "finished"
    if step.kind == "lesson" and step.ended is not None:
        return "time is up" if step.timed_out else "lesson over"
    return {"text": "reads", "questionnaire": f"questionnaire {step.name}", "lesson": f"lesson {step.name}"}[step.kind]
