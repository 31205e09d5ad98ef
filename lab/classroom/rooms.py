"""The room in which a class is held, and what the teacher's page may do in it.

A class is held for each pupil alone, in teams, at one run in turns, or as a study.
"""

from lab.classroom.class_lesson import is_operation
from lab.classroom.room import Room
from lab.classroom.roster import Roster
from lab.classroom.study import Study
from lab.classroom.study_room import StudyRoom
from lab.classroom.team_room import TeamRoom
from lab.classroom.turn_room import TurnRoom
from lab.errors import BadInput


def room_of(roster: Roster, study: Study | None) -> Room:
    """The room of a class; study: that of a class which is one."""
    if study is not None:
        return StudyRoom(study)
    if is_operation(roster.lessons):
        return TurnRoom(roster)
    return TeamRoom(roster) if roster.teams else Room(roster)


def obey(room: Room, said: object) -> None:
    """Carry out what the teacher's page wants of the room. Raises BadInput for anything else, and as the room's methods do."""
    match said:
        case {"do": "pause", "on": bool(paused)}:
            room.pause(paused)
        case {"do": "hint", "pupil": int(number), "text": str(text)}:
            room.hint(number, text)
        case {"do": "help", "pupil": int(number), "on": bool(begins)}:
            room.help(number, begins)
        case {"do": "next", "pupil": int() | None as number}:
            room.go_on(number)
        case {"do": "lesson", "pupil": int() | None as number, "lesson": int(lesson)}:
            room.go_on(number, lesson - 1)
        case {"do": "begin"}:
            room.begin_lessons()
        case {"do": "open", "pupil": int(number)}:
            room.open_again(number)
        case {"do": "remove", "pupil": int(number)}:
            room.remove(number)
        case {"do": "turn", "pupil": int(number)} if isinstance(room, TurnRoom):
            room.give_turn(number)
        case {"do": "finish"} if isinstance(room, TurnRoom):
            room.finish()
        case _:
            raise BadInput("that was no message of this page")
