"""A class in teams: the pupils of a team advise one learner, which judges each of them. All of it runs in the event loop."""

from dataclasses import replace

from lab.advice.entries import FILE, is_unbegun
from lab.classroom.desk import Desk
from lab.classroom.desk_process import DeskOrder
from lab.classroom.room import Json, Room
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import tile_of
from lab.errors import BadInput
from lab.files import is_file


class TeamRoom(Room):
    """A desk for each team. Its first lesson begins when the teacher says so, with the pupils who have joined by then.

    Who joins later watches, and is one of the team from the next lesson on.
    """

    def __init__(self, roster: Roster) -> None:
        super().__init__(roster)
        self._teams: dict[int, Desk] = {}

    # ---- desks

    def seat(self, pupil: Pupil) -> None:
        """Give a pupil a place at the team's desk, which is opened if the team's lesson has begun."""
        if pupil.team not in self._teams:
            journal = self.order(self._learner(pupil.team)).folder / FILE
            self._open(pupil.team, begins=is_file(journal) and not is_unbegun(journal))
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

    def _open(self, team: int, begins: bool = True) -> None:
        """Open the desk of a team at its lesson, for all of its pupils; begins: whether it gets a process."""
        order, pupils = self.order(self._learner(team)), self.roster.members(team)
        self._teams[team] = self._share(order, pupils, self._teams.get(team), begins)

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
            self._open(team)

    def go_on(self, number: int | None, lesson: int | None = None) -> None:
        """The next lesson, or the lesson with a number from 0, of a pupil's team, or of all teams if `number` is None.

        It begins at once, with all pupils of the team. Raises BadInput for a pupil or lesson that there is not.
        """
        teams = [*self._teams] if number is None else [self._pupil(number).team]
        wanted = {team: self._to_lesson(self._learner(team), number is None, lesson) for team in teams}
        moved = {team: to for team, to in wanted.items() if to is not None}
        self._move({pupil.number: to for team, to in moved.items() for pupil in self.roster.members(team)})
        for team in moved:
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

    # ---- what the teacher sees

    def teams(self) -> list[Json]:
        """Of each team: what a tile has, its pupils, and how far its learner trusts each of them."""
        return [self._team(learner) for learner in self.roster.learners]

    def _team(self, learner: Pupil) -> Json:
        desk = self._teams[learner.number]
        pupils = [pupil.name for pupil in self.roster.members(learner.number)]
        board = desk.parts.get("members") or []
        return tile_of(learner, desk, None, False, None) | {"pupils": pupils, "board": board}
