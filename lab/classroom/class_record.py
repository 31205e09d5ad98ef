"""What the folder of a class tells of its lessons: learning curves, results and receipts, for its report."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from lab.advice.advisors import shown_name
from lab.advice.entries import FILE, Entry, read_journal
from lab.advice.receipt import receipt
from lab.classroom.class_lesson import title_of
from lab.classroom.curve_chart import Curve, Middle, middle_of
from lab.classroom.kept_lesson import kept_lesson
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import Number, Row, best_first, is_order, row_of
from lab.errors import BadInput
from lab.files import is_file, read_limited
from lab.learning.session_events import AdviceRejected, AdvisorDropped, AdvisorReadmitted, EpisodeEnded
from lab.sequencing.cell.objectives import MAKESPAN
from lab.statistics import proportion_interval
from lab.tasks.record import first_fault

MAP = "*value-map.png"  # beside the journal of a lesson whose problem is a grid with two axes
MOST_MAP = 1 << 22  # bytes
MOST_MOVES = 200  # of an order that are read


@dataclass(frozen=True)
class Worth:
    """What a receipt says of the advice, see `lab.advice.receipt.Receipt`; lines: the receipt in words."""

    taken: int
    guided: int
    better: int
    best: int
    mean_before: float | None
    mean_after: float | None
    against_best: int | None
    lines: list[str]
    score: str = "steps"


@dataclass(frozen=True)
class _Finished:
    """What is read of a finished lesson's document."""

    row: Row
    receipt: Worth
    moves: list[str]


@dataclass(frozen=True)
class TaughtLesson:
    """A lesson of one pupil that has begun.

    row: None if it is not over. curve: of each episode the steps (or the cost of its order), and whether it was advised.
    worth: None if its journal cannot be read; trouble says why. dropped_at: the episode in which the learner rejected the advice,
    None if it did not; dropped: of a team, the pupils whom it believes no more. moves: of its best order, in words.
    """

    pupil: Pupil
    folder: Path
    row: Row | None
    curve: tuple[tuple[float, bool], ...] = ()
    worth: Worth | None = None
    dropped_at: int | None = None
    dropped: tuple[str, ...] = ()
    moves: tuple[str, ...] = ()
    trouble: str = ""

    @cached_property
    def value_map(self) -> bytes | None:
        """The picture (PNG) of the learned values with the learned path, None if there is none."""
        for path in sorted(self.folder.glob(MAP)):
            with suppress(OSError, BadInput):
                return read_limited(path, MOST_MAP)
        return None

    @property
    def best_so_far(self) -> tuple[tuple[float, bool], ...]:
        """The curve of the least value up to each episode."""
        least = accumulate((value for value, _ in self.curve), min)
        return tuple((value, advised) for value, (_, advised) in zip(least, self.curve, strict=True))

    @property
    def good(self) -> tuple[int, int] | None:
        """(good, all): of the answers, those that were best; of an order's guided episodes, those judged better or best."""
        if self.worth is None:
            return None
        if self.worth.against_best is not None:
            good = self.worth.taken - self.worth.against_best, self.worth.taken
        else:
            good = self.worth.better + self.worth.best, self.worth.guided
        return good if 0 <= good[0] <= good[1] and good[1] else None


@dataclass(frozen=True)
class LessonRecord:
    """A lesson of the class (from 0): its title, whether it is on an order, and all pupils' who have begun it, best first."""

    number: int
    title: str
    about_order: bool
    taught: list[TaughtLesson] = field(default_factory=list)

    @property
    def finished(self) -> list[Row]:
        """The rows of those who have finished it, best teacher first."""
        return [one.row for one in self.taught if one.row is not None]

    @property
    def optimum(self) -> Number:
        """The fewest possible steps, or the proven cost of the best order; None if unknown."""
        known = (row.optimal_cost if self.about_order else row.optimal_steps for row in self.finished)
        return next((value for value in known if value is not None), None)

    @property
    def is_timed(self) -> bool:
        """Whether the cost of an order is its makespan [s]; False while nobody has finished the lesson."""
        return any(row.objective == MAKESPAN for row in self.finished)

    @property
    def unit(self) -> str:
        """What a curve shows, for its axis."""
        if self.about_order:
            return f"best order so far{' [s]' if self.is_timed else ''}"
        return next((one.worth.score for one in self.taught if one.worth is not None), "steps")

    @cached_property
    def middle(self) -> Middle | None:
        """The median of all pupils' curves."""
        return middle_of([self.curve(one) for one in self.taught])

    def curve(self, one: TaughtLesson) -> Curve:
        """What is drawn of a pupil's lesson: the steps of the episodes, or the cost of the best order so far."""
        return one.best_so_far if self.about_order else one.curve

    @cached_property
    def best_teachers(self) -> list[TaughtLesson]:
        """Whose advice was good most surely, by the receipts, of the finished lessons whose learner believed it to the end.

        The measure is the lower end of the 95 % interval of the share of good advice (see `TaughtLesson.good`); all who are equal
        in it, and nobody with 0.
        """
        surest = {
            one.pupil.number: proportion_interval(*one.good)[1]
            for one in self.taught
            if one.row is not None and one.dropped_at is None and one.good is not None
        }
        best = max(surest.values(), default=0.0)
        return [one for one in self.taught if best > 0.0 and surest.get(one.pupil.number) == best]


def class_record(roster: Roster) -> list[LessonRecord]:
    """The lessons of a class with what its folder holds of each pupil's."""
    pupils = roster.learners
    records = []
    for number, lesson in enumerate(roster.lessons):
        about_order = lesson.command == "sequence"
        begun = [*_begun(roster, pupils, number)]
        ranked = best_first([asdict(one.row) for one in begun if one.row is not None])
        place = {row["pupil"]: place for place, row in enumerate(ranked)}
        begun.sort(key=lambda one: (place.get(one.pupil.number, len(place)), one.pupil.number))
        records.append(LessonRecord(number, title_of(lesson), about_order, begun))
    return records


def _begun(roster: Roster, pupils: list[Pupil], lesson: int) -> Iterator[TaughtLesson]:
    for pupil in pupils:
        folder = roster.lesson_folder(pupil, lesson)
        if is_file(folder / FILE) or kept_lesson(folder) is not None:
            yield _taught(pupil, folder, lesson)


def _taught(pupil: Pupil, folder: Path, lesson: int) -> TaughtLesson:
    """The lesson in a folder; what cannot be read of it is left out, and `trouble` says why."""
    finished, trouble = _finished(pupil, folder, lesson)
    row, worth, moves = (None, None, []) if finished is None else (finished.row, finished.receipt, finished.moves)
    entries: list[Entry] = []
    try:
        entries = read_journal(folder, "report").effective()
    except BadInput as error:
        trouble = trouble or str(error)
    else:
        if worth is None:
            so_far = receipt(entries, None, None, certain=False)
            worth = TypeAdapter(Worth).validate_python(so_far.to_json() | {"lines": so_far.lines()})
    return TaughtLesson(
        pupil,
        folder,
        row,
        tuple((float(one.steps), one.guided) for one in entries if isinstance(one, EpisodeEnded)),
        worth,
        next((one.episode for one in entries if isinstance(one, AdviceRejected)), None),
        tuple(_dropped(entries)),
        tuple(moves[:MOST_MOVES]),
        trouble,
    )


def _dropped(entries: Sequence[Entry]) -> dict[str, None]:
    """The names of the pupils of a team whom its learner believes no more, in the order in which it dropped them."""
    dropped: dict[str, None] = {}
    for entry in entries:
        if isinstance(entry, AdvisorDropped):
            dropped[shown_name(entry.advisor)] = None
        elif isinstance(entry, AdvisorReadmitted):
            dropped.pop(shown_name(entry.advisor), None)
    return dropped


def _finished(pupil: Pupil, folder: Path, lesson: int) -> tuple[_Finished | None, str]:
    """What is kept of a finished lesson, and why that cannot be read."""
    kept = kept_lesson(folder)
    if kept is None:
        return None, ""
    document: dict[str, Any] = kept["document"]
    try:
        moves = document["moves"] if is_order(document) else []
        said = {"row": row_of(pupil, lesson, document), "receipt": document["receipt"], "moves": moves}
        return TypeAdapter(_Finished).validate_python(said), ""
    except (KeyError, TypeError, AttributeError, IndexError):
        return None, f"'{folder}': what is kept of its end is no document of a lesson"
    except ValidationError as error:
        return None, f"'{folder}': what is kept of its end: {first_fault(error)}"
