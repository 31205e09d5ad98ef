"""The rows of a class or of a study with people: one a lesson of a participant, and one an answer, from the class's folder.

A participant's lesson counts as far as it came: also where the time was up, or where the class has ended meanwhile.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path
from statistics import mean, median
from typing import Any

from lab.advice.answer_times import AnswerTime, read_times
from lab.advice.entries import FILE as JOURNAL
from lab.advice.entries import Answer, Closed, Entry, Praise, Read, Undone, is_unbegun, read_journal, undoable
from lab.classroom.participant import Participant, Step
from lab.classroom.roster import Roster
from lab.classroom.study import PROTOCOL
from lab.errors import BadInput
from lab.files import is_file, json_of, read_limited
from lab.learning.session_events import AdviceGiven, AdviceRejected, EpisodeEnded

Row = dict[str, Any]
RECEIPT = "receipt.json"
MOST_BYTES = 1 << 24
TLX = "tlx"  # in the name of a questionnaire whose mean is the raw task load


@dataclass(frozen=True)
class ClassRows:
    """The rows of a class.

    lessons: one a lesson of a participant; answers: one an answer; asked: the columns of `lessons` that hold answers of
    questionnaires, as (questionnaire, item); withdrawn: participants who have withdrawn; protocol: the text of the study's
    protocol, "" for a class that is no study.
    """

    lessons: list[Row]
    answers: list[Row]
    asked: dict[str, tuple[str, str]]
    participants: int
    withdrawn: int
    protocol: str

    @property
    def protocol_sha256(self) -> str | None:
        """The SHA-256 of the protocol, None for a class that is no study."""
        return sha256(self.protocol.encode()).hexdigest() if self.protocol else None


def rows_of(folder: Path, where: str = "DIR") -> ClassRows:
    """The rows of the class in a folder. Raises BadInput if there is none, or if a file of it is damaged."""
    roster = Roster.read(folder, where)
    protocol = _text(folder / PROTOCOL) if roster.study is not None else ""
    lessons, answers, asked = list[Row](), list[Row](), dict[str, tuple[str, str]]()
    for learner in roster.learners:
        place = folder / learner.folder
        person = None if roster.study is None else Participant.read(place, learner.number, learner.name)
        one = {"participant": learner.name, "number": learner.number}
        for head, step in _lessons_of(place, person):
            own, given = _lesson(place, one | head, step)
            lessons.append(own | _questionnaires(person, head, asked))
            answers += given
    present = len(roster.present)
    return ClassRows(lessons, answers, asked, present, len(roster.pupils) - present, protocol)


def _text(path: Path) -> str:
    try:
        return read_limited(path, MOST_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror or error}") from None


def _lessons_of(place: Path, person: Participant | None) -> Iterator[tuple[Row, Step | None]]:
    """(arm, position and number, step) of each lesson that has begun; one without a number for who has come to none."""
    if person is None:
        names = (path.parent.name.removeprefix("lesson-") for path in place.glob(f"lesson-*/{JOURNAL}"))
        found = sorted(int(name) for name in names if name.isdecimal())
        yield from (({"arm": None, "position": None, "lesson": number}, None) for number in found)
        return
    steps = [step for step in person.steps if step.kind == "lesson"]
    for step in steps:
        position = person.order.index(step.arm) + 1 if step.arm in person.order else None
        yield {"arm": step.arm, "position": position, "lesson": step.lesson}, step
    if not steps:
        yield {"arm": None, "position": None, "lesson": None}, None


# ---- one lesson ----------------------------------------------------------------------------------------------------------


def _lesson(place: Path, head: Row, step: Step | None) -> tuple[Row, list[Row]]:
    """The row of a participant's lesson, and those of its answers."""
    folder = place / f"lesson-{head['lesson']}"
    row = head | {"skill": None, "state": "not begun"}
    if step is not None:
        row |= {"began": step.began, "ended": step.ended, "seconds": _seconds(step.began, step.ended)}
        row["timed_out"] = step.timed_out
    if head["lesson"] is None or not is_file(folder / JOURNAL) or is_unbegun(folder / JOURNAL):
        return row, []
    read, times = read_journal(folder, "DIR"), read_times(folder)
    answers = [head | answer for answer in _answers(read, times)]
    row |= _measures(read, _receipt(folder), answers)
    if step is None and times:
        row |= _spanned([*times.values()])
    if step is not None and step.timed_out:
        row |= {"state": "timed out", "solved": bool(row["solved"])}
    return row, answers


def _receipt(folder: Path) -> Row:
    """The receipt of a finished lesson; {} if there is none."""
    if not is_file(folder / RECEIPT):
        return {}
    try:
        receipt = json_of(_text(folder / RECEIPT))
    except ValueError as error:
        raise BadInput(f"'{folder / RECEIPT}': {error}: a file of lab class is wanted") from None
    return receipt if isinstance(receipt, dict) else {}


def _measures(read: Read, receipt: Row, answers: Sequence[Row]) -> Row:
    """What came of a lesson: see `lab.classroom.export_columns`."""
    entries = read.effective()
    episodes = [entry for entry in entries if isinstance(entry, EpisodeEnded)]
    reached = next((n for n, episode in enumerate(episodes, start=1) if episode.reached), None)
    closed = next((entry for entry in entries if isinstance(entry, Closed)), None)
    own = [entry for entry in entries if isinstance(entry, AdviceGiven) and entry.action is not None]
    counted = [answer for answer in answers if not answer["undone"]]
    latencies = [answer["latency_s"] for answer in counted if answer["latency_s"] is not None]
    skill = receipt.get("skill")
    return {
        "skill": read.session.problem,
        "state": "not over" if closed is None else "over",
        "solved": None if closed is None else closed.solved,
        "episodes": len(episodes),
        "episodes_to_goal": reached,
        "moves_to_goal": None if reached is None else sum(episode.steps for episode in episodes[:reached]),
        "mean_steps": mean(episode.steps for episode in episodes) if episodes else None,
        "final_steps": None if closed is None else closed.final_steps,
        "optimal_steps": None if closed is None else closed.optimal_steps,
        "answers": sum(answer["action"] is not None or answer["praise"] is not None for answer in counted),
        "skipped": sum(answer["means"] == "skip" for answer in counted),
        "undone": len(answers) - len(counted),
        "helped_answers": sum(answer["helped"] is True for answer in counted),
        "own_choice_too": sum(entry.action == entry.own for entry in own),
        "not_best": receipt.get("against_best"),
        "helped_steps": sum(episode.helped_steps for episode in episodes),
        "guided_episodes": sum(episode.guided for episode in episodes),
        "believed": not any(isinstance(entry, AdviceRejected) for entry in entries),
        "tau": skill.get("tau") if isinstance(skill, dict) else None,
        "latency_mean_s": round(mean(latencies), 3) if latencies else None,
        "latency_median_s": round(median(latencies), 3) if latencies else None,
    }


def _answers(read: Read, times: Mapping[int, AnswerTime]) -> Iterator[Row]:
    """The answers of a journal in their order, those that were taken back among them."""
    undone = _undone(read.entries)
    for number, entry in enumerate(read.entries, start=2):  # the journal's head is line 1
        if not isinstance(entry, Answer | Praise):
            continue
        time = times.get(number)
        seen: Mapping[str, Any] = {} if time is None else time.seen
        at = (entry.episode, entry.step, entry.state)
        if time is None or (time.by, seen.get("episode"), seen.get("step"), seen.get("state")) != (entry.by, *at):
            time, seen = None, {}
        action = entry.action if isinstance(entry, Answer) else None
        left = isinstance(entry, Answer) and entry.left
        means = "praise" if isinstance(entry, Praise) else "auto" if left else "skip" if action is None else None
        page = seen.get("page")
        standing = seen.get("standing")
        yield {
            "entry": number,
            "by": entry.by,
            "episode": entry.episode,
            "step": entry.step,
            "state": str(entry.state),
            "label": seen.get("label"),
            "action": action,
            "praise": entry.value if isinstance(entry, Praise) else None,
            "moves": entry.moves if isinstance(entry, Praise) else None,
            "undone": number in undone,
            "helped": page.get("helped") if isinstance(page, dict) else None,
            "means": means if time is None else time.means,
            "shown": None if time is None else time.shown,
            "latency_s": None if time is None else time.latency_s,
            "said": None if time is None or not time.said else "\n".join(time.said),
            "own": seen.get("own"),
            "allowed": seen.get("allowed"),
            "values": seen.get("values"),
            "reason": seen.get("reason"),
            "improvement": seen.get("improvement"),
            "helped_steps": standing.get("helped_steps") if isinstance(standing, dict) else None,
            "misleads": standing.get("misleads") if isinstance(standing, dict) else None,
            "episodes_shown": page.get("episodes") if isinstance(page, dict) else None,
            "page_sha256": page.get("sha256") if isinstance(page, dict) else None,
        }


def _undone(entries: Sequence[Entry]) -> set[int]:
    """The lines of a journal that do not count, because an answer was taken back."""
    kept: list[tuple[int, Entry]] = []
    undone: set[int] = set()
    for number, entry in enumerate(entries, start=2):
        if isinstance(entry, Undone):
            last = undoable([other for _, other in kept], entry.by)
            at = len(kept) if last is None else last
            undone |= {line for line, _ in kept[at:]}
            del kept[at:]
        else:
            kept.append((number, entry))
    return undone


def _spanned(times: Sequence[AnswerTime]) -> Row:
    """When a lesson without steps of a study was taught: from its first question to its last answer."""
    shown = [(datetime.fromisoformat(time.shown), time.latency_s or 0.0) for time in times if time.shown is not None]
    if not shown:
        return {}
    began, ended = min(at for at, _ in shown), max(at + timedelta(seconds=later) for at, later in shown)
    texts = [at.isoformat(timespec="milliseconds").replace("+00:00", "Z") for at in (began, ended)]
    return {"began": texts[0], "ended": texts[1], "seconds": round((ended - began).total_seconds(), 3)}


def _seconds(began: str, ended: str | None) -> float | None:
    if ended is None:
        return None
    return round((datetime.fromisoformat(ended) - datetime.fromisoformat(began)).total_seconds(), 3)


# ---- questionnaires ------------------------------------------------------------------------------------------------------


def _questionnaires(person: Participant | None, head: Row, asked: dict[str, tuple[str, str]]) -> Row:
    """The answers that belong to a participant's lesson, by column; `asked` takes new columns over.

    Those of the lesson and of its arm stand under QUESTIONNAIRE_ITEM; those that belong to no arm under before_... or
    after_..., for whether the participant gave them before the first lesson or after it.
    """
    row: Row = {}
    met_lesson = False
    for step in () if person is None else person.steps:
        met_lesson = met_lesson or step.kind == "lesson"
        if step.kind != "questionnaire":
            continue
        if step.arm is not None and (step.arm != head["arm"] or step.lesson not in (None, head["lesson"])):
            continue
        place = "" if step.arm is not None else "after_" if met_lesson else "before_"
        name = _column(f"{place}{step.name}")
        for item, value in step.answers.items():
            column = f"{name}_{_column(item)}"
            row[column] = value
            asked.setdefault(column, (step.name, item))
        numbers = [value for value in step.answers.values() if isinstance(value, int | float)]
        if TLX in step.name.lower() and numbers and len(numbers) == len(step.answers):
            row[f"{name}_mean"] = mean(numbers)
            asked.setdefault(f"{name}_mean", (step.name, ""))
    return row


def _column(name: str) -> str:
    """A name as part of a column's: lower case, with _ for anything but letters and digits."""
    return "".join(char if char.isalnum() else "_" for char in name.lower())
