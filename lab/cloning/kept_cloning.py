"""The folder of a cloning session: demonstrations, and a folder for each finished round, from which it goes on."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from shutil import rmtree

from lab.cloning.person import PersonRollouts
from lab.cloning.rounds import Cloning, CloningOptions, Corrected, Hears, Measured, cloned
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.errors import BadInput, WorkFailed, unknown
from lab.files import check_out, draft, write_whole
from lab.mentor.judge import Judge
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import write
from lab.tasks.record import hash_of, read_json
from lab.tasks.task_file import load, whole_path

SESSION, MEASURED = "session.json", "measured.json"
DEMONSTRATIONS, CORRECTIONS, BEGUN = "demonstrations", "corrections", "begun-"
STUDENT, MENTOR = "student.safetensors", "mentor.safetensors"
DEMONSTRATORS = ("scripted", "person", "dataset")
_EPISODE = re.compile(r"(\d{1,6})-(\d{1,6})")  # place and questions of an episode of what was interrupted
_WANTED = "wanted a session of `lab clone`"


@dataclass(frozen=True)
class KeptOptions:
    """What a session was begun with. demonstrator: who gives the demonstrations, one of DEMONSTRATORS.

    task_hash: of its task when it was begun, which a folder keeps; "" for none.
    """

    problem: SkillProblem
    options: CloningOptions
    demonstrator: str = "scripted"
    task_hash: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if self.demonstrator not in DEMONSTRATORS:
            raise unknown("demonstrator", self.demonstrator, DEMONSTRATORS, "clone")


def check_new(folder: Path) -> None:
    """Raises BadInput unless a session can begin in a folder: it is not there, or empty."""
    check_out(folder)
    if folder.is_dir() and any(not path.name.startswith(".") for path in folder.iterdir()):
        raise BadInput(
            f"output folder '{folder}' (--out): it holds files: give another one, or go on with --resume {folder}"
        )


def options_of(folder: Path) -> KeptOptions:
    """What the session in a folder was begun with. Raises BadInput if it holds none, or its task has changed since."""
    which = f"session '{folder}' (--resume)"
    kept = read_json(folder / SESSION, KeptOptions, which, _WANTED)
    try:
        now = hash_of(load(kept.problem.task))
        kept.problem.env  # noqa: B018  # its skill and noise are checked
    except BadInput as error:
        raise BadInput(f"{which}: {error}") from None
    if kept.task_hash not in ("", now):
        raise BadInput(f"{which}: its task '{kept.problem.task}' has changed since it was begun")
    return kept


def rounds_of(
    kept: KeptOptions,
    folder: Path | None,
    person: PersonRollouts | None = None,
    demonstrations: Recording | None = None,
) -> Iterator[Cloning]:
    """The session after its last round in a folder, if that holds one, and after each further round, which is kept in the folder.

    folder: None keeps nothing; person: who takes over in place of the scripted teacher, and of whom each episode is kept at once;
    demonstrations: what a new session begins with, in place of the scripted teacher's.
    Raises BadInput for a damaged folder, and where nobody is there who has to demonstrate; WorkFailed if it cannot be written.
    """
    problem, options = kept.problem, kept.options
    roll_out = problem if person is None else person
    question = Hears().question if person is None else person.hear
    if folder is None:
        shown = demonstrations or _demonstrated(kept, None, person)
        yield from cloned(roll_out, shown, options, hears=Hears(question))
        return
    if not (folder / SESSION).exists():
        written = asdict(replace(kept, task_hash=hash_of(load(problem.task))))
        written["problem"]["task"] = whole_path(problem.task)
        _write(folder / SESSION, json.dumps(written, indent=1))
    if not (folder / DEMONSTRATIONS).is_dir():
        write(demonstrations or _demonstrated(kept, folder, person), folder / DEMONSTRATIONS)
    rmtree(folder / f"{BEGUN}{DEMONSTRATIONS}", ignore_errors=True)
    shown = problem.taken(read(folder / DEMONSTRATIONS), f"'{folder / DEMONSTRATIONS}'")
    session = loaded(folder, shown)
    known = 0
    if session is not None:
        known = len(session.corrections)
        yield session

    number = 0 if session is None else len(session.measured)

    def keep_episode(corrected: Corrected) -> None:
        if person is not None:
            _keep_episode(folder / f"{BEGUN}{number}", problem, corrected)

    for after in cloned(roll_out, shown, options, session, hears=Hears(question, keep_episode)):
        _keep(folder, problem, after, known)
        rmtree(folder / f"{BEGUN}{number}", ignore_errors=True)
        known, number = len(after.corrections), len(after.measured)
        yield after


def _demonstrated(kept: KeptOptions, folder: Path | None, person: PersonRollouts | None) -> Recording:
    """The demonstrations that a session begins with; a person's are kept in its folder one by one."""
    if kept.demonstrator == "scripted":
        return kept.problem.demonstrated(kept.options)
    if kept.demonstrator == "dataset":
        raise BadInput("the demonstrations of this session came from a dataset, and are missing: begin another session")
    begun = None if folder is None else folder / f"{BEGUN}{DEMONSTRATIONS}"
    shown = [] if begun is None else _begun(begun, kept.problem.recorded([]))
    if len(shown) < kept.options.demonstrations:
        if person is None:
            raise BadInput(
                "the demonstrations of this session are a person's: wanted --teacher page or --teacher terminal"
            )
        for one in person.demonstrations(kept.options, tuple(shown)):
            if begun is not None:
                _keep_episode(begun, kept.problem, one)
            shown.append(one)
    return kept.problem.recorded([one.episode for one in shown])


def _keep_episode(folder: Path, problem: SkillProblem, one: Corrected) -> None:
    write(problem.recorded([one.episode]), folder / f"{one.place}-{one.questions}")


def loaded(folder: Path, demonstrations: Recording) -> Cloning | None:
    """The session after the last round that a folder holds; None before the first. Raises BadInput for a damaged folder."""
    measured, corrections = list[Measured](), list[Episode]()
    while (of_round := _of_round(folder, len(measured))).is_dir():
        measured.append(read_json(of_round / MEASURED, Measured, f"round '{of_round}'", _WANTED))
        if measured[-1].round != len(measured) - 1:
            raise BadInput(f"round '{of_round}': it holds round {measured[-1].round}: {_WANTED}")
        if (of_round / CORRECTIONS).is_dir():
            corrections += _episodes(of_round / CORRECTIONS, demonstrations)
    later = [
        path.name for path in folder.glob("round-*") if path.name[6:].isdigit() and int(path.name[6:]) >= len(measured)
    ]
    if later:
        raise BadInput(
            f"session '{folder}' (--resume): it holds '{later[0]}', but no 'round-{len(measured)}' before it"
        )
    if not measured:
        return None
    last = _of_round(folder, len(measured) - 1)
    mentor, student = Mentor.load(last / MENTOR), Student.load(last / STUDENT)
    wanted = len(demonstrations.state_names), len(demonstrations.action_names)
    for file, widths in ((MENTOR, (len(mentor.state_names), len(mentor.action_names))), (STUDENT, student.widths)):
        if widths != wanted:
            raise BadInput(
                f"'{last / file}': of {widths[0]} states and {widths[1]} actions: wanted {wanted[0]} and {wanted[1]}, as "
                "demonstrated"
            )
    mentor.judge = Judge(measured[-1].helped, measured[-1].judged, measured[-1].rejected)
    begun = _begun(folder / f"{BEGUN}{len(measured)}", demonstrations)
    return Cloning(demonstrations, student, mentor, corrections, measured, measured[-1].questions, begun)


def _episodes(folder: Path, demonstrations: Recording) -> Sequence[Episode]:
    """The episodes in a dataset of the session. Raises BadInput if they have not the demonstrations' states and actions."""
    kept = read(folder)
    for name in ("state_names", "action_names"):
        if getattr(kept, name) != getattr(demonstrations, name):
            raise BadInput(f"'{folder}': of other {name} than '{DEMONSTRATIONS}': {_WANTED}")
    return kept.episodes


def _begun(folder: Path, demonstrations: Recording) -> list[Corrected]:
    """The kept episodes of a round, or of demonstrations, that were interrupted, in their order."""
    if not folder.is_dir():
        return []
    found = [_EPISODE.fullmatch(path.name) for path in folder.iterdir()]
    kept = sorted((int(name[1]), int(name[2]), name[0]) for name in found if name)
    return [Corrected(place, questions, _episodes(folder / name, demonstrations)[0]) for place, questions, name in kept]


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
