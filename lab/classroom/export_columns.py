"""The columns of an exported class: what each is, in which unit, and which values it takes; the dictionary of an export."""

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

from lab.advice.answer_times import MEANS

LESSONS, ANSWERS = "participants", "answers"  # the tables
Type = Literal["text", "integer", "number", "boolean", "time", "list"]
Json = dict[str, Any]
TLX_ITEMS = ("mental", "physical", "temporal", "performance", "effort", "frustration")


@dataclass(frozen=True)
class Column:
    """One column: its table, its name, its type, its unit ("" for none), what it means, and the allowed values in words.

    A list is written as JSON, a time as ISO 8601 in UTC. An empty cell says that the value is not known.
    """

    table: str
    name: str
    type: Type
    unit: str
    meaning: str
    allowed: str = ""


# name, type, unit, meaning, allowed
_SHARED: tuple[tuple[str, Type, str, str, str], ...] = (
    ("participant", "text", "", "The participant's pseudonym or id.", ""),
    ("number", "integer", "", "The participant's number, in the order of joining.", "from 1"),
    ("arm", "text", "", "The arm of the study; empty in a class.", ""),
    ("position", "integer", "", "The place of the arm in this participant's order.", "from 1"),
    ("lesson", "integer", "", "The number of the lesson among those of class.json.", "from 1"),
)
_LESSONS: tuple[tuple[str, Type, str, str, str], ...] = (
    ("skill", "text", "", "What was taught.", ""),
    ("state", "text", "", "How far the lesson came.", "not begun, not over, timed out, over"),
    ("began", "time", "", "When the lesson began; in a class the first question that was shown.", ""),
    ("ended", "time", "", "When the lesson ended; in a class the last answer.", ""),
    ("seconds", "number", "s", "The time from began to ended.", "at least 0"),
    ("timed_out", "boolean", "", "Whether the time limit ended the lesson.", "true, false"),
    (
        "solved",
        "boolean",
        "",
        "Whether the learned policy leads to the goal; false where the time was up.",
        "true, false",
    ),
    ("episodes", "integer", "episodes", "Episodes that the learner has finished.", "at least 0"),
    ("episodes_to_goal", "integer", "episodes", "The first episode that reached the goal.", "from 1"),
    (
        "moves_to_goal",
        "number",
        "steps",
        "Steps of all episodes up to that one (for an order: their cost).",
        "at least 0",
    ),
    (
        "mean_steps",
        "number",
        "steps",
        "Mean steps of all episodes; a failed one counts the step limit and one.",
        "at least 0",
    ),
    ("final_steps", "number", "steps", "Steps of the learned policy; empty if it misses the goal.", "at least 0"),
    ("optimal_steps", "number", "steps", "Fewest possible steps.", "at least 0"),
    (
        "answers",
        "integer",
        "answers",
        "Moves and judgements that the participant gave and did not take back.",
        "at least 0",
    ),
    ("skipped", "integer", "answers", "Questions that were left to the learner.", "at least 0"),
    ("undone", "integer", "answers", "Answers that do not count because one was taken back.", "at least 0"),
    (
        "helped_answers",
        "integer",
        "answers",
        "Those that the teacher gave for the participant, where times are kept.",
        "at least 0",
    ),
    ("own_choice_too", "integer", "answers", "Advised moves that were also the learner's own choice.", "at least 0"),
    (
        "not_best",
        "integer",
        "answers",
        "Advised moves that were not the best; known once the lesson is over.",
        "at least 0",
    ),
    ("helped_steps", "integer", "steps", "Steps that followed advice.", "at least 0"),
    ("guided_episodes", "integer", "episodes", "Episodes with an advised step.", "at least 0"),
    ("believed", "boolean", "", "Whether the learner did not reject the advisor.", "true, false"),
    ("tau", "number", "", "The estimated skill of the answers (0 is random); known once the lesson is over.", ""),
    ("latency_mean_s", "number", "s", "Mean time from a shown question to its answer.", "at least 0"),
    ("latency_median_s", "number", "s", "Median of the same.", "at least 0"),
)
_ANSWERS: tuple[tuple[str, Type, str, str, str], ...] = (
    ("entry", "integer", "", "The line of the answer in the lesson's journal.", "from 2"),
    ("by", "text", "", "The advisor's name.", ""),
    ("episode", "integer", "", "The learner's episode.", "from 1"),
    ("step", "integer", "", "The step of the episode.", "from 1"),
    ("state", "text", "", "The number of the learner's state.", ""),
    ("label", "text", "", "That state's name.", ""),
    ("action", "integer", "", "The number of the advised move; empty for none.", "at least 0"),
    ("praise", "integer", "", "A judgement instead of a move: above 0 praise, below 0 blame.", ""),
    ("moves", "integer", "moves", "The number of moves that were judged.", "at least 0"),
    ("undone", "boolean", "", "Whether it was taken back, or belongs to what was.", "true, false"),
    ("helped", "boolean", "", "Whether the teacher gave it for the participant.", "true, false"),
    ("means", "text", "", "How it was given.", ", ".join(MEANS)),
    ("shown", "time", "", "When the question was shown; empty if it was not.", ""),
    ("latency_s", "number", "s", "From then to the answer.", "at least 0"),
    ("said", "text", "", "The sentences that were said at this question, one a line.", ""),
    ("own", "integer", "", "The learner's own choice, as shown.", "at least 0"),
    ("allowed", "list", "", "The moves that could be advised, as shown.", ""),
    ("values", "list", "", "The learner's values of all moves in that state, as shown.", ""),
    ("reason", "text", "", "Why the learner asked, as shown.", ""),
    ("improvement", "number", "", "The learner's rate of improvement, as shown.", ""),
    ("helped_steps", "integer", "steps", "Steps that had followed advice by then, as shown.", "at least 0"),
    ("misleads", "integer", "episodes", "Advised episodes that had not helped by then, as shown.", "at least 0"),
    ("episodes_shown", "integer", "episodes", "The length of the learning curve on the page.", "at least 0"),
    (
        "page_sha256",
        "text",
        "",
        "A hash of what else the page showed: curve, standing, notices, advisors, receipt.",
        "",
    ),
)


def columns_of(asked: Mapping[str, tuple[str, str]], protocol: str) -> list[Column]:
    """All columns in their order; asked: those with answers of questionnaires, see `lab.classroom.class_rows.ClassRows`."""
    items = _items(protocol)
    columns = [Column(LESSONS, *row) for row in (*_SHARED, *_LESSONS)]
    for name, (questionnaire, item) in asked.items():
        columns.append(_of_item(name, questionnaire, item, items.get((questionnaire, item))))
    return columns + [Column(ANSWERS, *row) for row in (*_SHARED, *_ANSWERS)]


def _of_item(name: str, questionnaire: str, item: str, known: Json | None) -> Column:
    """The column of an item of a questionnaire, or of the mean of all its items."""
    if not item:
        return Column(
            LESSONS, name, "number", "", f"Mean of the items of '{questionnaire}': the raw task load.", "0 to 100"
        )
    known = known or {}
    text, kind = str(known.get("text") or f"Item '{item}' of '{questionnaire}'."), known.get("kind")
    match kind:
        case "likert":
            allowed = f"whole numbers from 1 to {known.get('points') or max(5, len(known.get('labels', ())))}"
        case "scale":
            low, high, step = (
                known.get(key, default) for key, default in (("lowest", 0), ("highest", 100), ("step", 1))
            )
            allowed = f"{low} to {high} in steps of {step}"
        case "choice":
            allowed = "; ".join(map(str, known.get("options", ())))
        case _:
            return Column(LESSONS, name, "text", "", text)
    if kind == "choice":
        return Column(LESSONS, name, "text", "", text, allowed)
    labels = [str(label) for label in known.get("labels", ())]
    return Column(LESSONS, name, "number", "points", text, allowed + (f"; {', '.join(labels)}" if labels else ""))


def _items(protocol: str) -> dict[tuple[str, str], Json]:
    """The items of a protocol's questionnaires by (questionnaire, item); what is none of them is left out."""
    items: dict[tuple[str, str], Json] = {}
    with suppress(tomllib.TOMLDecodeError, RecursionError):
        for questionnaire in _tables(tomllib.loads(protocol), "questionnaires"):
            name = str(questionnaire.get("name"))
            for item in _tables(questionnaire, "items"):
                items[name, str(item.get("name"))] = item
            if questionnaire.get("use") == "nasa-tlx":
                for scale in TLX_ITEMS:
                    known = {"kind": "scale", "step": 5, "text": f"NASA Task Load Index: {scale}."}
                    items.setdefault((name, scale), known)
    return items


def _tables(table: Json, key: str) -> Iterator[Json]:
    inner = table.get(key)
    yield from (one for one in (inner if isinstance(inner, list) else ()) if isinstance(one, dict))
