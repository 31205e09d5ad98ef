"""The high level: in which order the robot serves the toasts."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, SequenceResult
from lab.sequencing.exact import optimum
from lab.sequencing.rivals import fifo, random_search
from lab.sequencing.srl import srl as learn
from lab.sequencing.srl_time import srl_time

OnEpisode = Callable[[EpisodeSequenced], None]
Sequencer = Callable[[Cell, int, np.random.Generator, OnEpisode | None], SequenceResult]


def _srl(cell: Cell, episodes: int, rng: np.random.Generator, on_episode: OnEpisode | None) -> SequenceResult:
    return learn(cell, episodes, rng, on_episode=on_episode)


def _fifo(cell: Cell, _episodes: int, _rng: np.random.Generator, on_episode: OnEpisode | None) -> SequenceResult:
    return _reported(fifo(cell), on_episode)


def _exact(cell: Cell, _episodes: int, _rng: np.random.Generator, on_episode: OnEpisode | None) -> SequenceResult:
    best = optimum(cell)
    return _reported(SequenceResult(best.sequence, best.makespan_s, (best.makespan_s,)), on_episode)


def _reported(result: SequenceResult, on_episode: OnEpisode | None) -> SequenceResult:
    """A result that took no learning, shown to the callback as one episode."""
    if on_episode is not None:
        on_episode(EpisodeSequenced(1, result.makespan_s, result.makespan_s))
    return result


# name -> function(cell, episodes, rng, on_episode); "fifo" and "exact" need neither episodes nor chance.
SEQUENCERS: Mapping[str, Sequencer] = MappingProxyType(
    {"srl": _srl, "srl-time": srl_time, "exact": _exact, "random": random_search, "fifo": _fifo}
)
