"""Meanings as sentences: what was understood is shown in words that mean the same when they are said."""

from collections.abc import Sequence

from lab.words.meaning import (
    ALL,
    CLEAR,
    WALL,
    Again,
    Allow,
    Around,
    Avoid,
    Before,
    Finish,
    Go,
    Intent,
    Leg,
    Move,
    Never,
    Opposite,
    Own,
    Praise,
    Quiet,
    Stop,
    To,
    Undo,
    Why,
    Work,
)  # fmt: skip
from lab.words.scene import GridScene, OrderScene, Scene, SceneObject

EXAMPLES = (
    "two steps forward", "left until the wall, then forward 2", "go to the goal", "like last time", "the other way",
    "that was good", "take that back", "do what you think is best", "why do you ask?", "stop asking until you are stuck",
    "no questions for 5 steps",
)  # fmt: skip
ORDER_EXAMPLES = ("forget the rules", "that was good", "take that back", "do what you think is best", "why do you ask?")


def in_words(intents: Sequence[Intent], scene: Scene) -> str:
    """Intents as one sentence without its full stop."""
    return ", then ".join(_said(intent, scene) for intent in intents)


def called(scene: Scene, id_: str) -> str:
    """An object as it can be named: "the toaster", "the left cube"."""
    if not isinstance(scene, GridScene) or id_ not in {thing.id for thing in scene.objects}:
        return f"the {id_}"
    thing = scene.object(id_)
    alike = [other for other in scene.objects if thing.names[0] in other.names]
    if len(alike) == 1:
        return f"the {thing.names[0]}"
    for word, axis, sign in (("left", 1, 1), ("right", 1, -1), ("upper", 0, 1), ("lower", 0, -1)):
        least = min(sign * _middle(other, axis) for other in alike)
        if [other.id for other in alike if sign * _middle(other, axis) == least] == [id_]:
            return f"the {word} {thing.names[0]}"
    return f"the {id_.replace('-', ' ')}"


def _middle(thing: SceneObject, axis: int) -> float:
    return sum(cell[axis] for cell in thing.cells) / max(1, len(thing.cells))


def _said(intent: Intent, scene: Scene) -> str:
    match intent:
        case Go(legs):
            return ", then ".join(_leg(leg, scene) for leg in legs)
        case To(id_):
            return f"to {called(scene, id_)}"
        case Around(id_, side):
            return f"around {called(scene, id_)}" + (f" on the {_side(side)} side" if side else "")
        case Avoid(id_):
            return f"keep away from {called(scene, id_)}"
        case Allow(id_):
            return "forget all rules" if id_ == ALL else f"you may go near {called(scene, id_)} again"
        case Quiet(until):
            times = {
                "stuck": "stop asking until you are stuck",
                "episode": "no questions in this episode",
                "always": "never ask again",
            }
            return times[until] if isinstance(until, str) else f"no questions for {until} steps"
        case Praise(sign):
            return "that was good" if sign > 0 else "that was bad"
        case Move(number):
            return f"move {number}{_move(scene, number)}"
        case Finish(part):
            return f"finish {part} first"
        case Never(part, station):
            return f"never leave {part or 'any part'} in the {station}"
        case Before(first, second):
            return f"{_work(first)} before {_work(second)}"
    plain: dict[type, str] = {
        Opposite: "the other way", Again: "like last time", Undo: "take that back", Own: "as it would do itself",
        Why: "why do you ask", Stop: "end the session",
    }  # fmt: skip
    return plain[type(intent)]


def _side(side: str) -> str:
    return {"forward": "far", "backward": "near", "up": "upper", "down": "lower"}.get(side, side)


def _leg(leg: Leg, scene: Scene) -> str:
    if leg.steps is not None:
        return f"{leg.direction} {leg.steps}"
    if leg.until == WALL:
        return f"{leg.direction} until the wall"
    if leg.until == CLEAR:
        return f"{leg.direction} until " + (
            f"you are past {called(scene, leg.past)}"
            if leg.past
            else f"the way {leg.towards} is free".replace("  ", " ")
        )
    return f"{leg.direction} until {called(scene, leg.until)}"


def _move(scene: Scene, number: int) -> str:
    moves = {move.number: move for move in scene.moves} if isinstance(scene, OrderScene) else {}
    return f" ({moves[number].part}, {moves[number].origin} to {moves[number].target})" if number in moves else ""


def _work(work: Work) -> str:
    if work.station is None:
        return work.part or "any part"
    return f"{work.part or 'any part'} to the {work.station}"


def examples(scene: Scene) -> list[str]:
    """Sentences that mean something in the scene."""
    if isinstance(scene, GridScene):
        ids = [thing.id for thing in scene.objects if not thing.is_goal]
        known = [called(scene, id_) for id_ in ids[:3]]
        has_goal = len(ids) < len(scene.objects)
        own = [
            text
            for name in known
            for text in (f"keep away from {name}", f"go around {name}", f"you may go near {name} again")
        ]
        return [*(text for text in EXAMPLES if has_goal or "goal" not in text), *own]
    moves = [f"{move.part} to the {move.target}" for move in scene.moves[:3]]
    rules = (
        [f"finish {scene.parts[0]} first", f"never leave {scene.parts[0]} in the {scene.stations[0]}"]
        if scene.parts
        else []
    )
    return [*moves, *rules, *ORDER_EXAMPLES]
