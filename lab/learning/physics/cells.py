"""The cells of a continuous world as the states of a table, which knows no transitions."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

import numpy as np

from lab.learning.physics import PHYSICS, Physics
from lab.mdp import TabularMDP


@dataclass(frozen=True, eq=False)
class CellTable(TabularMDP):
    """The cells of a continuous world as a table; its transitions are placeholders, because only the world can make steps."""

    world: str = ""

    @classmethod
    def of(cls, physics: Physics) -> "CellTable":
        """The table of a world: no move changes the state, no state is terminal; the start is the centre of all starts."""
        states, actions = int(np.prod(physics.bounds.shape)), len(physics.actions)
        stays = np.repeat(np.arange(states, dtype=np.int32)[:, None], actions, axis=1)
        no, middle = np.zeros(states, bool), [0.5] * len(physics.axes)
        physics.begin(middle)
        start = physics.bounds.number(middle)
        return cls(stays, np.zeros(stays.shape), no, no, start, physics.actions, world=physics.name)

    @property
    def physics(self) -> Physics:
        """The world."""
        return PHYSICS[self.world]

    @property
    def cells(self) -> tuple[int, ...]:
        """The shape of the grid of cells."""
        return self.physics.bounds.shape

    @cached_property
    def signature(self) -> str:
        """The signature of the problem (see `TabularMDP.signature`), which includes the world and its cells."""
        return sha256(f"{self.world} {self.physics.bounds} {super().signature}".encode()).hexdigest()[:16]

    def state_label(self, state: int) -> str:
        """The centre of a cell as text, such as "position -0.51, speed +0.003"."""
        named = zip(self.physics.axes, self.physics.bounds.centre(state), strict=True)
        return ", ".join(f"{axis} {value:+.3f}" for axis, value in named)
