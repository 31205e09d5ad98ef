"""What the teacher sees of a pupil: a tile on the page, and a row of the table at the end."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from lab.classroom.desk import Desk
from lab.classroom.roster import Pupil

Json = dict[str, Any]
TABLE, REPORT, HAND_OUTS = "class.csv", "report.html", "hand-outs.html"  # the rows and the pages, in the class's folder
MOST_POINTS = 60  # of a tile's curve
Number = int | float | None


@dataclass(frozen=True)
class Row:
    """The row of a finished lesson; what is not known, or does not apply, is None.

    final_steps, optimal_steps: of a table; cost, optimal_cost, objective: of an order. believed: whether the learner did not
    reject the advice, None if nothing was advised.
    """

    pupil: int
    name: str
    lesson: int
    skill: str
    state: str
    episodes: int
    solved: bool
    final_steps: Number
    optimal_steps: Number
    answers: int | None
    own_choice_too: int | None
    not_best: int | None
    helped_steps: int | None
    guided_episodes: int | None
    misleads: int | None
    believed: bool | None
    tau: Number
    cost: Number
    optimal_cost: Number
    objective: str | None


COLUMNS = tuple(column.name for column in fields(Row))


def tile_of(pupil: Pupil, desk: Desk, question: Json | None, here: bool, asked_s: float | None) -> Json:
    """The tile of a pupil; best, best_at: the least cost of an episode, and the first one that has it.

    question: the one that waits for the pupil, asked_s: how long [s] it has waited, None for none; here: whether the pupil's page
    is open.
    """
    lesson, standing = desk.parts.get("lesson") or {}, desk.parts.get("standing") or {}
    curve = desk.parts.get("curve") or {}
    best, best_at = curve.get("best") or (None, None)
    return {
        "number": pupil.number,
        "name": pupil.name,
        "here": here,
        "lesson": pupil.lesson + 1,
        "title": lesson.get("title", ""),
        "state": desk.state,
        "text": desk.text,
        "episode": curve.get("count", 0),
        "episodes": lesson.get("episodes", 0),
        "kind": lesson.get("kind", "steps"),
        "optimal": lesson.get("optimal"),
        "proven": lesson.get("proven", True),
        "best": best,
        "best_at": best_at,
        "curve": thinned(curve.get("means", [])),
        "guided": thinned(curve.get("guided", [])),
        "asks": question["title"] if question else "",
        "asked_s": None if asked_s is None else round(asked_s),
        "taken": standing.get("taken", 0),
        "skipped": standing.get("skipped", 0),
        "misleads": standing.get("misleads", 0),
        "verdict": standing.get("verdict", ""),
        "solved": None if desk.result is None else is_solved(desk.result),
        "final_steps": None if desk.result is None else desk.result.get("final_steps"),
    }


def row_of(pupil: Pupil, lesson: int, result: Mapping[str, Any]) -> Json:
    """The row of a pupil's finished lesson (from 0), from its document; what is not known, or does not apply, is None."""
    receipt = result.get("receipt") or {}
    skill = receipt.get("skill") or {}
    advice = (result.get("advice") or [{}])[0] if is_order(result) else result
    known = {
        "pupil": pupil.number,
        "name": pupil.name,
        "lesson": lesson + 1,
        "skill": f"order of {result['task']}" if is_order(result) else result["skill"],
        "state": "over",
        "episodes": result["episodes"],
        "solved": is_solved(result),
        "answers": receipt.get("taken"),
        "own_choice_too": receipt.get("agreed"),
        "not_best": receipt.get("against_best"),
        "helped_steps": advice.get("helped_steps"),
        "guided_episodes": receipt.get("guided") if is_order(result) else len(result["guided_episodes"]),
        "misleads": advice.get("misleads"),
        "believed": advice.get("rejected_at_episode") is None if receipt.get("taken", 1) else None,
        "tau": skill.get("tau"),
    }
    own = ("cost", "optimal_cost", "objective") if is_order(result) else ("final_steps", "optimal_steps")
    return dict.fromkeys(COLUMNS) | known | {name: result[name] for name in own}


def is_order(result: Mapping[str, Any]) -> bool:
    """Whether a lesson's document is that of advice on an order, as `lab sequence --json` gives it."""
    return "best_sequence" in result


def is_solved(result: Mapping[str, Any]) -> bool:
    """Whether a lesson reached its goal: one on an order if its own order is proven optimal, a run by hand if it succeeded."""
    if is_order(result):
        return result["optimal_cost"] is not None and result["gap"] == 0.0
    return bool(result["success"] if "delivered" in result else result["solved"])


def best_first(rows: list[Json]) -> list[Json]:
    """The rows of one lesson, best teacher first: a solved lesson, the shortest way or order, then the fewest answers."""
    far = float("inf")
    return sorted(
        rows,
        key=lambda row: (
            not row["solved"],
            far if row["final_steps"] is None else row["final_steps"],
            far if row["cost"] is None else row["cost"],
            far if row["answers"] is None else row["answers"],
            row["pupil"],
        ),
    )


def thinned(values: list[float]) -> list[float]:
    """At most MOST_POINTS of the values, evenly spread, the last included."""
    if len(values) <= MOST_POINTS:
        return values
    return [values[round(k * (len(values) - 1) / (MOST_POINTS - 1))] for k in range(MOST_POINTS)]
