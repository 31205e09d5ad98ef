"""The questionnaires of a study: their items, which answers these take, and the ones that ship with the lab."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from lab.errors import BadInput, shortened
from lab.tasks.record import Name, Record, as_tuple

MOST_TEXT = 20_000  # characters of a text that participants read
Answer = int | str
Text = Annotated[str, Field(min_length=1, max_length=MOST_TEXT, pattern=r"\S")]
Label = Annotated[str, Field(min_length=1, max_length=200)]
Labels = Annotated[tuple[Label, ...], BeforeValidator(as_tuple), Field(max_length=50)]
Place = Literal["before", "after-lesson", "after-arm", "end"]

TAKES: dict[str, tuple[str, ...]] = {  # the keys of each kind of item, besides those of all
    "likert": ("points", "labels"),
    "scale": ("lowest", "highest", "step", "labels"),
    "choice": ("options",),
    "text": ("most",),
}
OF_ALL = ("name", "kind", "text", "required")
POINTS, MOST_CHARACTERS = 5, 500  # of an item that does not say


class QuestionItem(Record):
    """One item of a questionnaire. Each kind has keys of its own; the others are refused."""

    name: Name
    """The item's name, which is its column when the study is exported, such as `"mental"`."""
    kind: Literal["likert", "scale", "choice", "text"]
    """Agreement in points, a number on a scale, one of several options, or a text of the participant's own."""
    text: Text
    """What is asked, such as `"How mentally demanding was the task?"`."""
    required: bool = True
    """Whether it must be answered."""
    points: Annotated[int, Field(ge=2, le=11)] | None = None
    """Likert: the number of points; left out: 5."""
    labels: Labels = ()
    """Likert, scale: the words at both ends; likert also: the words at all points."""
    lowest: Annotated[int, Field(ge=-1_000_000, le=1_000_000)] | None = None
    """Scale: the lowest value; left out: 0."""
    highest: Annotated[int, Field(ge=-1_000_000, le=1_000_000)] | None = None
    """Scale: the highest value; left out: 100."""
    step: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Scale: the distance between values; left out: 1."""
    options: Labels = ()
    """Choice: the options, such as `["left", "right"]`."""
    most: Annotated[int, Field(ge=1, le=5000)] | None = None
    """Text: the most characters; left out: 500."""

    @model_validator(mode="after")
    def _keys_fit_the_kind(self) -> Self:
        for key in sorted(self.model_fields_set - {*OF_ALL, *TAKES[self.kind]}):
            raise ValueError(
                f"{key} in item '{self.name}': a {self.kind} item takes {', '.join(TAKES[self.kind])} besides {', '.join(OF_ALL)}"
            )
        if self.kind == "choice" and (len(self.options) < 2 or len({*self.options}) < len(self.options)):
            raise ValueError(f"options of item '{self.name}': wanted two or more, each of them once")
        if self.kind == "likert" and len(self.labels) not in (0, 2, self.point_count):
            raise ValueError(
                f"labels of item '{self.name}': {len(self.labels)}: wanted 2, for the ends, or {self.point_count}, one a point"
            )
        if self.kind == "scale":
            low, high, step = self.range_
            if len(self.labels) not in (0, 2):
                raise ValueError(f"labels of item '{self.name}': {len(self.labels)}: wanted 2, for the ends")
            if high <= low:
                raise ValueError(f"highest {high} of item '{self.name}': wanted above lowest {low}")
            if (high - low) % step:
                raise ValueError(f"highest {high} of item '{self.name}': wanted {low} plus a multiple of step {step}")
        return self

    @property
    def point_count(self) -> int:
        """The number of points of a likert item."""
        return self.points or POINTS

    @property
    def range_(self) -> tuple[int, int, int]:
        """(lowest, highest, step) of a scale."""
        given = (self.lowest, self.highest, self.step)
        low, high, step = (
            default if value is None else value for value, default in zip(given, (0, 100, 1), strict=True)
        )
        return low, high, step

    def shown(self) -> dict[str, Any]:
        """What the page of the item needs, without the keys of other kinds."""
        low, high, step = self.range_
        own: dict[str, dict[str, Any]] = {
            "likert": {"points": self.point_count, "labels": self.labels},
            "scale": {"lowest": low, "highest": high, "step": step, "labels": self.labels},
            "choice": {"options": self.options},
            "text": {"most": self.most or MOST_CHARACTERS},
        }
        return {"name": self.name, "kind": self.kind, "text": self.text, "required": self.required} | own[self.kind]

    def checked(self, value: object) -> Answer:
        """The answer, if the item allows it. Raises BadInput, for the participant to read."""
        whole = isinstance(value, int) and not isinstance(value, bool)
        match self.kind, value:
            case "likert", int(point) if whole and 1 <= point <= self.point_count:
                return point
            case "scale", int(number) if whole and number in range(self.range_[0], self.range_[1] + 1, self.range_[2]):
                return number
            case "choice", str(chosen) if chosen in self.options:
                return chosen
            case "text", str(written) if len(written) <= (self.most or MOST_CHARACTERS):
                return written.encode("utf-8", "replace").decode()  # a lone surrogate could not be read again
        raise BadInput(f"'{shortened(self.text)}': {shortened(repr(value))}: allowed is {self.allowed()}.")

    def allowed(self) -> str:
        """The answers that the item takes, in words."""
        low, high, step = self.range_
        return {
            "likert": f"a point from 1 to {self.point_count}",
            "scale": f"a number from {low} to {high} in steps of {step}",
            "choice": f"one of: {', '.join(self.options)}",
            "text": f"a text of at most {self.most or MOST_CHARACTERS} characters",
        }[self.kind]


def checked_answers(items: Sequence[QuestionItem], given: Mapping[str, object]) -> dict[str, Answer]:
    """The answers by item, in the items' order; items that may be left out and were are not in it.

    Raises BadInput for an answer that its item does not allow, one that is missing, and one to no item.
    """
    if others := [name for name in given if name not in {item.name for item in items}]:
        raise BadInput(f"there is no item '{shortened(others[0])}' here")
    answers: dict[str, Answer] = {}
    for item in items:
        value = given.get(item.name)
        if value is None or (isinstance(value, str) and not value.strip()):
            if item.required:
                raise BadInput(f"'{shortened(item.text)}' is not answered yet.")
            continue
        answers[item.name] = item.checked(value)
    return answers


# ---- those that ship with the lab


def _tlx(name: str, text: str, low: str = "very low", high: str = "very high") -> QuestionItem:
    return QuestionItem(name=name, kind="scale", text=text, step=5, labels=(low, high))


SHIPPED: dict[str, tuple[QuestionItem, ...]] = {
    # NASA Task Load Index (Hart and Staveland 1988), raw: six scales, without the weights of pairwise comparisons
    "nasa-tlx": (
        _tlx("mental", "Mental demand: how mentally demanding was the task?"),
        _tlx("physical", "Physical demand: how physically demanding was the task?"),
        _tlx("temporal", "Temporal demand: how hurried or rushed was the pace of the task?"),
        _tlx(
            *("performance", "Performance: how successful were you in accomplishing what you were asked to do?"),
            *("perfect", "failure"),
        ),
        _tlx("effort", "Effort: how hard did you have to work to accomplish your level of performance?"),
        _tlx("frustration", "Frustration: how insecure, discouraged, irritated, stressed, and annoyed were you?"),
    ),
}
