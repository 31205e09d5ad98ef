"""A class in teams: the pupils of a team advise one learner, which judges each of them. All of it runs in the event loop."""

from dataclasses import replace

from lab.advice.entries import FILE, is_unbegun
from lab.classroom.desk import Desk
from lab.classroom.desk_process import DeskOrder
from lab.classroom.room import RELOAD, Json, Room
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import thinned
from lab.errors import BadInput
from lab.files import is_file


class TeamRoom(Room):
    """A desk for each team. Its first lesson begins when the teacher says so, with the pupils who have joined by then.

    Who joins later watches, and is one of the team from the next lesson on.
    """

    def __init__(self, roster: Roster) -> None:
        super().__init__(roster)
        self._teams: dict[int, Desk] = {}
        self._begun: set[int] = set()  # teams

    # ---- desks

    def seat(self, pupil: Pupil) -> None:
        """Give a pupil a place at the team's desk, which is opened if the team's lesson has begun."""
        if pupil.team not in self._teams:
            self._open(pupil.team)
            return
        desk = self._teams[pupil.team]
        if desk.state == "idle":  # its lesson has not begun: the pupil will be one of those with whom it does
            desk.order = self.order(self._learner(pupil.team))
        self.desks[pupil.number] = desk
        for fellow in self.roster.members(pupil.team):
            self._show(fellow.number)
        self.on_news()

    def order(self, learner: Pupil) -> DeskOrder:
        """What is taught at a team's desk."""
        people = tuple(pupil.name for pupil in self.roster.members(learner.number))
        return replace(super().order(learner), people=people)

    def desk_of(self, learner: Pupil) -> Desk:
        """The desk of a team."""
        return self._teams[learner.number]

    def name_at(self, number: int) -> str:
        """The name of a pupil's page at the team's desk."""
        return self.roster.pupils[number - 1].name

    def _learner(self, team: int) -> Pupil:
        return next(learner for learner in self.roster.learners if learner.number == team)

    def _open(self, team: int) -> None:
        """Open the desk of a team at its lesson, for all of its pupils."""
        pupils, before = self.roster.members(team), self._teams.get(team)
        desk = self._teams[team] = Desk(self.order(self._learner(team)))
        self.desks |= dict.fromkeys([pupil.number for pupil in pupils], desk)
        desk.on_news = lambda: self._stirred(pupils[0].number, desk)
        journal = desk.order.folder / FILE
        if is_file(journal) and not is_unbegun(journal):
            self._begun.add(team)
        self._place(desk, before, team in self._begun)
        for pupil in pupils if before is not None else ():
            self._asked.pop(pupil.number, None)
            if page := self.pages.get(pupil.number):
                self._start(page.close(RELOAD))

    def _pose(self, number: int, desk: Desk) -> None:
        for pupil in self.roster.members(self.roster.pupils[number - 1].team):
            super()._pose(pupil.number, desk)

    # ---- pupils' pages

    def refusal(self, number: int) -> str:
        """Why a pupil's messages do not count now; "" if they do."""
        return super().refusal(number) or (
            "Your team has begun without you: you watch." if self._is_late(number) else ""
        )

    def takes_free_seat(self, number: int) -> bool:
        """Whether a pupil's page takes its seat when it is free: unless the teacher answers, or the pupil came late."""
        return super().takes_free_seat(number) and not self._is_late(number)

    def _is_late(self, number: int) -> bool:
        """Whether a pupil came after the team's lesson had begun."""
        desk = self.desks[number]
        return desk.state != "idle" and bool(desk.people) and self.name_at(number) not in desk.people

    def told_more(self, number: int) -> Json:
        """The pupil's team, and who else is in it."""
        pupil = self.roster.pupils[number - 1]
        fellows = [other.name for other in self.roster.members(pupil.team) if other.number != number]
        return {"team": f"team {pupil.team}", "fellows": fellows, "late": self._is_late(number)}

    def closed_text(self, number: int) -> str:
        """What a pupil's page says before the lesson, and of a lesson that was interrupted."""
        if self.desks[number].state == "idle":
            return "Your lesson begins when your teacher says so."
        return super().closed_text(number)

    # ---- what the teacher does

    def begin_lessons(self) -> None:
        """Begin the lesson of each team that waits. Raises BadInput if none does."""
        waiting = [team for team, desk in self._teams.items() if desk.state == "idle"]
        if not waiting:
            raise BadInput("no team waits" if self._teams else "nobody has joined yet")
        for team in waiting:
            self._begun.add(team)
            self._open(team)

    def go_on(self, number: int | None, lesson: int | None = None) -> None:
        """The next lesson, or the lesson with a number from 0, of a pupil's team, or of all teams if `number` is None.

        It begins at once, with all pupils of the team. Raises BadInput for a pupil or lesson that there is not.
        """
        teams = [*self._teams] if number is None else [self._pupil(number).team]
        for team in teams:
            learner = self._learner(team)
            wanted = learner.lesson + 1 if lesson is None else lesson
            if wanted == learner.lesson or (number is None and wanted >= len(self.roster.lessons)):
                continue
            self._finished.pop((team, learner.lesson), None)
            for pupil in self.roster.members(team):
                self.roster.move(pupil.number, wanted)
                self._hints.pop(pupil.number, None)
                self._helped.discard(pupil.number)
            self._begun.add(team)
            self._open(team)

    def open_again(self, number: int) -> None:
        """Open a team's desk again whose process has ended or failed. Raises BadInput if it has not."""
        pupil = self._pupil(number)
        self._check_closed(number)
        self._open(pupil.team)

    def _leave(self, number: int) -> None:
        """A pupil was removed: the team goes on without, and its desk closes with the last of its pupils."""
        del self.desks[number]
        team = self.roster.pupils[number - 1].team
        if not self.roster.members(team):
            self._start(self._teams.pop(team).close())
            self._begun.discard(team)

    # ---- what the teacher sees

    def tiles(self) -> dict[int, Json]:
        """The tile of each pupil, by number."""
        tiles = super().tiles()
        for number, tile in tiles.items():
            tile |= {"team": self.roster.pupils[number - 1].team, "late": self._is_late(number)}
        return tiles

    def teams(self) -> list[Json]:
        """Of each team: its lesson, curve and result, and how far its learner trusts each pupil."""
        return [self._team(learner) for learner in self.roster.learners]

    def standing(self) -> dict[int, Json]:
        """Lesson, state and text of each team, by number."""
        return {team["team"]: team | {"text": self._teams[team["team"]].text} for team in self.teams()}

    def _team(self, learner: Pupil) -> Json:
        desk = self._teams[learner.number]
        lesson, curve = desk.parts.get("lesson") or {}, desk.parts.get("curve") or {}
        standing = desk.parts.get("standing") or {}
        return {
            "team": learner.number,
            "name": learner.name,
            "pupils": [pupil.name for pupil in self.roster.members(learner.number)],
            "lesson": learner.lesson + 1,
            "title": lesson.get("title", ""),
            "state": desk.state,
            "episode": curve.get("count", 0),
            "episodes": lesson.get("episodes", 0),
            "optimal": lesson.get("optimal"),
            "curve": thinned(curve.get("means", [])),
            "best": curve.get("best"),
            "taken": standing.get("taken", 0),
            "verdict": standing.get("verdict", ""),
            "solved": None if desk.result is None else bool(desk.result["solved"]),
            "board": desk.parts.get("members") or [],
        }
