"""What a file's settings ask of a sequencer, and the sequence that it finds."""

from collections.abc import Callable

import numpy as np

from lab.errors import unknown
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.search import EpisodeSequenced, Search, SequenceResult
from lab.tasks.cell_fields import Sequencing


def search_for(
    settings: Sequencing,
    *,
    episodes: int | None = None,
    objective: str | None = None,
    chance: Chance = NO_CHANCE,
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> Search:
    """What a file's settings ask of a sequencer, changed where something else is given."""
    return Search(
        episodes or settings.episodes, objective or settings.objective, chance, settings.settings(), on_episode
    )


def find_sequence(cell: Cell, method: str, search: Search, seed: int, session: int = 0) -> SequenceResult:
    """The best sequence that a method finds; BadInput for an unknown method."""
    check_method(method)
    return SEQUENCERS[method](cell, search, np.random.default_rng([seed, 2, session]))


def check_method(name: str) -> None:
    """BadInput for an unknown method."""
    if name not in SEQUENCERS:
        raise unknown("method", name, SEQUENCERS, "--method")
