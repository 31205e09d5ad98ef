"""A class at one run by hand, which the pupils operate in turns. All of it runs in the server's event loop."""

import asyncio
import json
import time
from contextlib import suppress

from lab.classroom.desk import Desk
from lab.classroom.desk_process import DeskOrder
from lab.classroom.door import Often
from lab.classroom.room import Json, PupilPage, Room
from lab.classroom.roster import Pupil, Roster
from lab.classroom.turn_record import RUN, counted_commands, keep_command, rows_of_run
from lab.errors import BadInput
from lab.production.run_journal import is_run
from lab.seat.page.page_console import STOP
from lab.seat.page.page_messages import LayerChoice, Message, PageCommand, Refused, Wish, understood
from lab.view.summary import delivered_in_words

# commands of a pupil that are passed on in so many seconds: a journal holds all of them
MOST_COMMANDS, COMMANDS_S = 100, 10.0
STOP_EVERY_S = 0.25  # least time between two emergency stops of a pupil who gives too many commands
AWAY_S = 20.0  # after which the turn of a pupil whose page is closed passes on
HAND_OVER = '{"class":"hand over"}'  # as it comes from the class's own part of a pupil's page


class TurnRoom(Room):
    """One desk, whose page every pupil sees; only the pupil whose turn it is gives commands, and anybody the emergency stop.

    The run begins when the teacher says so. A turn goes to the next pupil who is here: when its pupil hands over, after the
    class's `turn_s`, and once its pupil's page has been closed for AWAY_S; the teacher gives it to anybody.
    """

    def __init__(self, roster: Roster) -> None:
        super().__init__(roster)
        self._desk: Desk | None = None
        self._turn: int | None = None  # the pupil who operates
        self._ends_s = 0.0  # when the turn passes on, in the event loop's time
        # that pass the turn on: when its "time" is up, its pupil is "away"
        self._alarms: dict[str, asyncio.TimerHandle] = {}
        self._often: dict[int, Often] = {}  # how often a pupil has given commands lately
        self._stopped_s: dict[int, float] = {}  # when such a pupil's last emergency stop was passed on
        self._folder = roster.folder / RUN
        self._commands = counted_commands(self._folder)

    async def end(self) -> None:
        """Close the desk: the run can be resumed."""
        self.ended.set()
        self._disarm()
        if self._desk is not None:
            await self._desk.close()
        await super().end()

    # ---- the desk

    def seat(self, pupil: Pupil) -> None:
        """Give a pupil a place at the run; the first one's opens the desk, whose process begins if the run has begun before."""
        if self._desk is None:
            self._open(is_run(self._folder))
        assert self._desk is not None
        self.desks[pupil.number] = self._desk
        self._show_all()

    def order(self, learner: Pupil) -> DeskOrder:
        """The class's run by hand."""
        return DeskOrder(self.roster.lessons[0], self._folder, self.roster.folder / "toolbox")

    def name_at(self, number: int) -> str:
        """The name of a pupil's page, which is none of the desk's: so it gets the seat with the turn alone, not by itself."""
        return self.roster.pupils[number - 1].name

    def _open(self, begins: bool) -> None:
        """Open the desk, for all pupils; begins: whether it gets a process."""
        pupils = self.roster.present
        self._desk = self._share(self.order(pupils[0]), pupils, self._desk, begins)

    def _stirred(self, desk: Desk) -> None:
        super()._stirred(desk)
        if desk is not self._desk:
            return
        if desk.state == "over" and self._turn is not None:
            self._disarm()
            self._turn = None
            self._show_all()
        self._first_turn()

    @property
    def _is_open(self) -> bool:
        return self._desk is not None and self._desk.state == "open"

    # ---- turns

    def _row(self) -> list[int]:
        """The pupils who are here, in the order of their turns: first the one whose turn it is, if here."""
        here = sorted(self.pages)
        after = [number for number in here if number >= (self._turn or 0)]
        return after + here[: len(here) - len(after)]

    def give_turn(self, number: int) -> None:
        """Let a pupil operate. Raises BadInput for a pupil that is not there, and while the run is not under way."""
        self._pupil(number)
        if not self._is_open:
            raise BadInput("the run is not under way: nobody operates")
        self._pass_to(number)

    def _pass_to(self, number: int) -> None:
        """The seat goes to a pupil's page: at once, or as soon as that page sees that it is free."""
        before, after = self.pages.get(self._turn or 0), self.pages.get(number)
        self._turn = number
        if before is not None and before is not after:
            self._start(before.say({"seat": "give"}))
        if after is not None and after.sees_free:
            self._start(after.say({"seat": "take"}))
        self._arm()
        self._show_all()

    def _pass_on(self) -> bool:
        """The turn goes to the next pupil who is here; returns whether there is another one."""
        following = next((number for number in self._row() if number != self._turn), None)
        if following is not None:
            self._pass_to(following)
        return following is not None

    def _first_turn(self) -> None:
        """If nobody has the turn of a run that is under way, the first one who is here gets it."""
        if self._is_open and self._turn is None and self.pages:
            self._pass_to(min(self.pages))

    def _disarm(self) -> None:
        for what in [*self._alarms]:
            self._alarms.pop(what).cancel()

    def _await_back(self) -> None:
        """Begin the time in which the pupil whose turn it is has to come back."""
        self._alarms["away"] = asyncio.get_running_loop().call_later(AWAY_S, self._look_away)

    def _arm(self) -> None:
        """Begin the time of a turn."""
        self._disarm()
        loop = asyncio.get_running_loop()
        if self.roster.turn_s:
            self._ends_s = loop.time() + self.roster.turn_s
            self._alarms["time"] = loop.call_later(self.roster.turn_s, self._time_up)
        if self._turn not in self.pages:
            self._await_back()

    def _time_up(self) -> None:
        """The time of a turn is up: it passes on, unless the class is paused or nobody else is here."""
        if self.paused or not self._pass_on():
            self._arm()
            self._show_all()

    def _look_away(self) -> None:
        """The turn of a pupil who has not come back passes on, now or to the first one who comes."""
        if self._turn not in self.pages and not self._pass_on():
            self._turn = None
            self._disarm()

    # ---- pupils' pages

    def arrived(self, page: PupilPage) -> None:
        """A pupil's page is open."""
        super().arrived(page)
        if page.number == self._turn and "away" in self._alarms:
            self._alarms.pop("away").cancel()
        self._first_turn()
        self._show_all()

    def left(self, page: PupilPage) -> None:
        """A pupil's page was closed; whose turn it is has a while to come back."""
        super().left(page)
        if page.number == self._turn and page.number not in self.pages and not self.ended.is_set():
            self._await_back()
        self._show_all()

    def refusal(self, number: int) -> str:
        """Why a pupil's messages do not count now; "" if they do."""
        if not self._is_open:
            return "The run is not under way."
        if number != self._turn:
            name = "" if self._turn is None else self.roster.pupils[self._turn - 1].name
            return f"It is {name}'s turn: here only the emergency stop works." if name else "It is nobody's turn yet."
        return super().refusal(number)

    async def passes(self, page: PupilPage, message: str) -> bool:
        """Whether a message goes to the desk: an emergency stop always does; handing over is done here."""
        meant: Message | None = None
        with suppress(Refused):
            meant = understood(message)
        is_stop = isinstance(meant, PageCommand) and meant.words.split()[0].lower() == STOP
        passes = is_stop or isinstance(meant, LayerChoice)
        if page in self.shoulders:
            if not passes:
                await page.send(json.dumps({"refusal": "The pupils operate: here only the emergency stop works."}))
            return passes
        if not passes and not await super().passes(page, message):
            return False
        if message == HAND_OVER or meant == Wish("give"):
            if not self._pass_on():
                await page.send(json.dumps({"refusal": "Nobody else is here: you go on."}))
            return False
        if isinstance(meant, PageCommand) and self._is_open:
            often, now_s = self._often.setdefault(page.number, Often(MOST_COMMANDS, COMMANDS_S)), time.monotonic()
            if often.is_full(now_s) and is_stop:  # it always works; what comes within its time is the same stop
                is_new = now_s - self._stopped_s.get(page.number, -STOP_EVERY_S) >= STOP_EVERY_S
                self._stopped_s[page.number] = now_s if is_new else self._stopped_s[page.number]
                return is_new
            if often.is_full(now_s):
                await page.send(json.dumps({"refusal": "Too many commands within seconds: wait a moment."}))
                return False
            often.happened(now_s)
            self._commands[page.number] += 1
            keep_command(self._folder, page.number, meant.words)
            self.on_news()
        return True

    def takes_free_seat(self, number: int) -> bool:
        """Whether a pupil's page takes the seat when it is free: if it is the pupil's turn."""
        return number == self._turn

    def told_more(self, number: int) -> Json:
        """Whose turn it is, how many come before this pupil, who is next, how long [s] it lasts still; or how the run ended."""
        over = self._desk.result if self._desk is not None else None
        if over is not None:
            made = delivered_in_words(over["delivered"], over["parts"])
            return {"turn": {"over": f"The run is over: {made}."}}
        if not self._is_open or self._turn is None:
            return {"turn": None}
        row = self._row()
        following = next((other for other in row if other != self._turn), None)
        left_s = max(0.0, self._ends_s - asyncio.get_running_loop().time()) if self.roster.turn_s else None
        turn = {
            "name": self.roster.pupils[self._turn - 1].name,
            "yours": number == self._turn,
            "before": max(0, row.index(number) - (self._turn in row)) if number in row else len(row),
            "next": "" if following is None else self.roster.pupils[following - 1].name,
            "left_s": left_s,
        }
        return {"turn": turn}

    def closed_text(self, number: int) -> str:
        """What a pupil's page says before the run, and of a run that was interrupted."""
        if self.desks[number].state == "idle":
            return "The run begins when your teacher says so."
        return super().closed_text(number)

    # ---- what the teacher does

    def begin_lessons(self) -> None:
        """Begin the run. Raises BadInput if nobody has joined, or it has begun."""
        if self._desk is None or not self.desks:
            raise BadInput("nobody has joined yet")
        if self._desk.state != "idle":
            raise BadInput("the run has begun already")
        self._open(begins=True)

    def finish(self) -> None:
        """Finish the run. Raises BadInput if it is not under way."""
        if self._desk is None or not self._is_open:
            raise BadInput("the run is not under way: there is nothing to finish")
        self._desk.finish()

    def open_again(self, number: int) -> None:
        """Go on with a run whose process has ended or failed. Raises BadInput if it has not."""
        self._pupil(number)
        self._check_closed(number)
        self._open(begins=True)

    def help(self, number: int, begins: bool) -> None:
        """Raises BadInput: nobody is asked anything here."""
        raise BadInput("nobody is asked at a run by hand: give somebody the turn")

    def go_on(self, number: int | None, lesson: int | None = None) -> None:
        """Raises BadInput: there is no other lesson."""
        raise BadInput("a run by hand is the only lesson of its class")

    def _leave(self, number: int) -> None:
        """A pupil was removed: the run goes on without."""
        del self.desks[number]
        if number == self._turn and not self._pass_on():
            self._turn = None
            self._disarm()
        self._show_all()

    # ---- what the teacher sees

    def tiles(self) -> dict[int, Json]:
        """The tile of each pupil, by number."""
        tiles = super().tiles()
        for number, tile in tiles.items():
            tile |= {"turn": self._is_open and number == self._turn, "commands": self._commands[number]}
        return tiles

    def turns(self) -> Json:
        """What the teacher sees of the run: its state, and the name of the pupil who operates, "" for nobody."""
        name = self.roster.pupils[self._turn - 1].name if self._turn is not None and self._is_open else ""
        return {"state": "idle" if self._desk is None else self._desk.state, "name": name}

    def rows(self) -> list[Json]:
        """A row for each pupil, once the run is over."""
        over = self._desk.result if self._desk is not None else None
        return [] if over is None else rows_of_run(self.roster.present, over, self._commands)
