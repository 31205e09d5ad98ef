"""Which room a class is held in: each pupil alone, in teams, at one run in turns, or as participants of a study."""

from lab.classroom.class_lesson import is_operation
from lab.classroom.room import Room
from lab.classroom.roster import Roster
from lab.classroom.study import Study
from lab.classroom.study_room import StudyRoom
from lab.classroom.team_room import TeamRoom
from lab.classroom.turn_room import TurnRoom


def room_of(roster: Roster, study: Study | None) -> Room:
    """The room of a class; study: that of a class which is one."""
    if study is not None:
        return StudyRoom(study)
    if is_operation(roster.lessons):
        return TurnRoom(roster)
    return TeamRoom(roster) if roster.teams else Room(roster)
