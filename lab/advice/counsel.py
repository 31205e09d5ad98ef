"""Who advises in a session: one advisor or several, simulated, recorded or people, and how they are brought together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.advice.advisors import PEOPLE, make_advisor, parse_advisor
from lab.advice.entries import Read, read_journal
from lab.advice.journal import Journal
from lab.advice.panel import ASKED, DECISIONS, panel_of
from lab.errors import BadInput, unknown
from lab.learning.environment import Environment
from lab.learning.events import Event
from lab.learning.requests import Advisor, Ask
from lab.learning.selection import uniforms
from lab.learning.settings import LearnerSettings
from lab.mdp import BoolArray, TabularMDP


@dataclass(frozen=True)
class Counsel:
    """Who is asked in a session, by name, and the people behind such names as "terminal".

    asked: several are asked "together" or "in-turn"; decide: whom to follow, a name in `panel.DECISIONS`; region (S,):
    where anybody is heard.
    """

    names: tuple[str, ...] = ("expert",)
    people: Mapping[str, Ask] = field(default_factory=dict)
    asked: str = "together"
    decide: str = "trust-weighted"
    region: BoolArray | None = None

    def __str__(self) -> str:
        several = f" ({self.asked}, {self.decide})" if len(self.names) > 1 else ""
        return " + ".join(self.names) + several

    @property
    def records(self) -> bool:
        """Whether anybody speaks only where a record has something: such silence is not held against the advice."""
        return any(name.startswith("recorded:") for name in self.names)

    def check(self) -> None:
        """Raises BadInput for a name that no advisor has, and for an unknown way of asking or deciding."""
        for name in self.names:
            parse_advisor(name, "--advisor")
        if "none" in self.names and len(self.names) > 1:
            raise BadInput(f"advisor 'none' (--advisor) beside {len(self.names) - 1} more: it is nobody or somebody")
        for name in PEOPLE:
            if self.names.count(name) > 1:
                raise BadInput(f"advisor '{name}' (--advisor) is named {self.names.count(name)} times: once is enough")
        if self.asked not in ASKED:
            raise unknown("way of asking", self.asked, ASKED, "--ask")
        if self.decide not in DECISIONS:
            raise unknown("way of deciding", self.decide, DECISIONS, "--decide")

    def cut_records(self) -> list[Read]:
        """The journals among the advisors whose last line was cut off. Raises BadInput for what is no journal."""
        folders = [Path(name.removeprefix("recorded:")) for name in self.names if name.startswith("recorded:")]
        return [read for read in (read_journal(folder, "--advisor") for folder in folders) if read.cut]

    def check_records(self, mdp: TabularMDP) -> None:
        """Raises BadInput for a record that is not about this problem."""
        for name in self.names:
            if name.startswith("recorded:"):
                make_advisor(name, mdp, 1.0, np.random.default_rng(0))

    def gather(
        self,
        environment: Environment,
        learner: LearnerSettings,
        rng: np.random.Generator,
        *,
        journal: Journal | None = None,
        tell: Callable[[Event], None] = lambda event: None,
    ) -> Advisor | None:
        """The advisors of a session as one, None when there is nobody; people's answers go through the journal.

        Each of several draws from a stream of its own. Raises BadInput as `make_advisor` does.
        """
        people = {name: _through(journal, name, ask) for name, ask in self.people.items()}
        streams = [rng] if len(self.names) == 1 else rng.spawn(len(self.names) + 1)
        made = [
            make_advisor(
                name,
                environment.mdp,
                learner.discount,
                stream,
                people,
                region=self.region,
                episodes=learner.episodes,
                values=environment.values,
            )
            for name, stream in zip(self.names, streams, strict=False)
        ]
        if len(made) == 1:
            return made[0]
        states, draw = environment.mdp.n_states, uniforms(streams[-1])
        return panel_of(self.names, made, states, decide=self.decide, asked=self.asked, draw=draw, tell=tell)


def _through(journal: Journal | None, by: str, ask: Ask) -> Ask:
    return ask if journal is None else lambda request: journal.answer(by, request, ask)
