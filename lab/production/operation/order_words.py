"""An order that is typed in words: each move is understood among those that are allowed when it is its turn."""

import re
from collections.abc import Sequence

from lab.errors import BadInput
from lab.sequencing.cell.routes import part_of
from lab.sequencing.simulate.run import Run, branch
from lab.words.listen import listen
from lab.words.meaning import Move, Refusal
from lab.words.scene import AllowedMove, OrderScene

BREAKS = re.compile(r"\s*(?:[,;.]|\band then\b|\bthen\b|\bafter that\b|\band\b)\s*", re.IGNORECASE)


def order_in_words(text: str, state: Run) -> tuple[int, ...]:
    """The decisions of moves in words, such as "slice 1 to the toaster, then slice 2", from a state on; the state stays as it is.

    Raises BadInput, which names the move, if one is not understood or not allowed then.
    """
    run, made = branch(state), list[int]()
    for number, clause in enumerate(filter(None, BREAKS.split(text.strip())), start=1):
        scene = scene_of(run, run.allowed())
        heard = listen(clause, scene)
        if isinstance(heard, Refusal):  # a part alone
            named = listen(f"move {clause}", scene)
            heard = heard if isinstance(named, Refusal) else named
        if isinstance(heard, Refusal):
            raise BadInput(f"move {number}, '{clause[:60]}': {heard.reason}")
        for intent in heard:
            if not isinstance(intent, Move):
                raise BadInput(f"move {number}, '{clause[:60]}': wanted a move, such as {_first(scene)}")
            run.move(intent.number)
            made.append(intent.number)
    return tuple(made)


def scene_of(run: Run, allowed: Sequence[int]) -> OrderScene:
    """The parts, stations and allowed moves of a run as sentences refer to them, with spaces for underscores."""
    cell, moves = run.cell, list[AllowedMove]()
    for decision in allowed:
        option = run.option(decision)
        assert option is not None  # it is allowed
        part, names = cell.part_name(part_of(decision, cell.parts)), cell.names
        moves.append(AllowedMove(decision, _plain(part), _plain(names[option.origin]), _plain(names[option.target])))
    parts = tuple(_plain(cell.part_name(part)) for part in range(1, cell.parts + 1))
    return OrderScene(parts, tuple(dict.fromkeys(map(_plain, cell.names))), tuple(moves))


def _first(scene: OrderScene) -> str:
    return f"{scene.moves[0].part} to the {scene.moves[0].target}" if scene.moves else "none: all is done"


def _plain(name: str) -> str:
    return name.replace("_", " ").lower()
