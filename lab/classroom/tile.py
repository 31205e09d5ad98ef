"""What the teacher sees of a pupil: a tile on the page, and a row of the table at the end."""

from collections.abc import Mapping
from typing import Any

from lab.classroom.desk import Desk
from lab.classroom.roster import Pupil

Json = dict[str, Any]
MOST_POINTS = 60  # of a tile's curve
COLUMNS = (
    *("pupil", "name", "lesson", "skill", "state", "episodes", "solved", "final_steps", "optimal_steps"),
    *("answers", "own_choice_too", "not_best", "helped_steps", "guided_episodes", "misleads", "believed", "tau"),
)


def tile_of(pupil: Pupil, desk: Desk, here: bool, asked_s: float | None) -> Json:
    """The tile; here: whether the pupil's page is open; asked_s: how long [s] a question has waited, None: none does."""
    lesson, standing = desk.parts.get("lesson") or {}, desk.parts.get("standing") or {}
    curve, question = desk.parts.get("curve") or {}, desk.parts.get("question")
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
        "optimal": lesson.get("optimal"),
        "curve": _thinned(curve.get("means", [])),
        "guided": _thinned(curve.get("guided", [])),
        "asks": question["title"] if question else "",
        "asked_s": None if asked_s is None else round(asked_s),
        "taken": standing.get("taken", 0),
        "skipped": standing.get("skipped", 0),
        "misleads": standing.get("misleads", 0),
        "verdict": standing.get("verdict", ""),
        "solved": None if desk.result is None else bool(desk.result["solved"]),
        "final_steps": None if desk.result is None else desk.result["final_steps"],
    }


def row_of(pupil: Pupil, lesson: int, result: Mapping[str, Any]) -> Json:
    """The row of a pupil's finished lesson (from 0), from its document; what is not known is None."""
    receipt = result.get("receipt") or {}
    skill = receipt.get("skill") or {}
    return {
        "pupil": pupil.number,
        "name": pupil.name,
        "lesson": lesson + 1,
        "skill": result["skill"],
        "state": "over",
        "episodes": result["episodes"],
        "solved": result["solved"],
        "final_steps": result["final_steps"],
        "optimal_steps": result["optimal_steps"],
        "answers": receipt.get("taken"),
        "own_choice_too": receipt.get("agreed"),
        "not_best": receipt.get("against_best"),
        "helped_steps": result["helped_steps"],
        "guided_episodes": len(result["guided_episodes"]),
        "misleads": result["misleads"],
        "believed": result["rejected_at_episode"] is None,
        "tau": skill.get("tau"),
    }


def best_first(rows: list[Json]) -> list[Json]:
    """The rows of one lesson, best teacher first: a solved lesson, the shortest way, then the fewest answers."""
    far = float("inf")
    return sorted(
        rows,
        key=lambda row: (
            not row["solved"],
            far if row["final_steps"] is None else row["final_steps"],
            far if row["answers"] is None else row["answers"],
            row["pupil"],
        ),
    )


def _thinned(values: list[float]) -> list[float]:
    """At most MOST_POINTS of the values, evenly spread, the last included."""
    if len(values) <= MOST_POINTS:
        return values
    return [values[round(k * (len(values) - 1) / (MOST_POINTS - 1))] for k in range(MOST_POINTS)]
