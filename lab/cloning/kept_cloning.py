"""The folder of a cloning session: demonstrations, and a folder for each finished round, from which it goes on."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from lab.cloning.rounds import Cloning, CloningOptions, Measured, cloned
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.errors import BadInput, WorkFailed
from lab.files import check_out, draft, write_whole
from lab.mentor.judge import Judge
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import write
from lab.tasks.record import read_json

SESSION, MEASURED = "session.json", "measured.json"
DEMONSTRATIONS, CORRECTIONS = "demonstrations", "corrections"
STUDENT, MENTOR = "student.safetensors", "mentor.safetensors"
_WANTED = "a session of `lab clone`"


@dataclass(frozen=True)
class KeptOptions:
    """What a session was begun with."""

    problem: SkillProblem
    options: CloningOptions


def check_new(folder: Path) -> None:
    """Raises BadInput unless a session can begin in a folder: it is not there, or empty."""
    check_out(folder)
    if folder.is_dir() and any(not path.name.startswith(".") for path in folder.iterdir()):
        raise BadInput(
            f"output folder '{folder}' (--out): it holds files: give another one, or go on with --resume {folder}"
        )


def options_of(folder: Path) -> KeptOptions:
    """What the session in a folder was begun with. Raises BadInput if it holds none."""
    return read_json(folder / SESSION, KeptOptions, f"session '{folder}' (--resume)", _WANTED)


def rounds_of(kept: KeptOptions, folder: Path | None) -> Iterator[Cloning]:
    """The session after its last round in a folder, if that holds one, and after each further round, which is kept in the folder.

    folder: None keeps nothing. Raises BadInput for a damaged folder, WorkFailed if it cannot be written.
    """
    if folder is None:
        yield from cloned(kept.problem, kept.problem.demonstrated(kept.options), kept.options)
        return
    if not (folder / SESSION).exists():
        _write(folder / SESSION, json.dumps(asdict(kept), indent=1))
    if not (folder / DEMONSTRATIONS).is_dir():
        write(kept.problem.demonstrated(kept.options), folder / DEMONSTRATIONS)
    demonstrations = read(folder / DEMONSTRATIONS)
    session = loaded(folder, demonstrations)
    known = 0
    if session is not None:
        known = len(session.corrections)
        yield session
    for after in cloned(kept.problem, demonstrations, kept.options, session):
        _keep(folder, kept.problem, after, known)
        known = len(after.corrections)
        yield after


def loaded(folder: Path, demonstrations: Recording) -> Cloning | None:
    """The session after the last round that a folder holds; None before the first. Raises BadInput for a damaged folder."""
    measured, corrections = list[Measured](), list[Episode]()
    while (of_round := _of_round(folder, len(measured))).is_dir():
        measured.append(read_json(of_round / MEASURED, Measured, f"round '{of_round}'", _WANTED))
        if (of_round / CORRECTIONS).is_dir():
            corrections += read(of_round / CORRECTIONS).episodes
    if not measured:
        return None
    last = _of_round(folder, len(measured) - 1)
    mentor = Mentor.load(last / MENTOR)
    mentor.judge = Judge(measured[-1].helped, measured[-1].judged, measured[-1].rejected)
    return Cloning(demonstrations, Student.load(last / STUDENT), mentor, corrections, measured, measured[-1].questions)


def _keep(folder: Path, problem: SkillProblem, session: Cloning, known: int) -> None:
    """Writes the last round: beside, and renamed; its corrections are those from number `known` on."""
    measured = session.measured[-1]
    try:
        with draft(folder) as made:
            room = made / "round"
            room.mkdir()
            session.student.save(room / STUDENT)
            session.mentor.save(room / MENTOR)
            (room / MEASURED).write_text(json.dumps(asdict(measured)), encoding="utf-8")
            if session.corrections[known:]:
                write(problem.recorded(session.corrections[known:]), room / CORRECTIONS)
            room.rename(_of_round(folder, measured.round))
    except OSError as error:
        raise WorkFailed(f"session '{folder}' cannot be written: {error.strerror or error}") from error


def _of_round(folder: Path, number: int) -> Path:
    return folder / f"round-{number}"


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
    except OSError as error:
        raise WorkFailed(f"session '{path.parent}' cannot be written: {error.strerror or error}") from error
