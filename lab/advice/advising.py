"""Who advises in a session: one advisor or several, simulated, recorded, learned or people, and how they are brought together."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lab.advice.advisors import PEOPLE, AdvisorName, RecordedAdvisor, make_advisor
from lab.advice.entries import Read, read_journal
from lab.advice.journal import Journal
from lab.advice.panel import Panel, PanelSettings, members_of
from lab.advice.policy_advisor import PolicyAdvisor
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.environment import Environment
from lab.learning.requests import Advisor, Ask
from lab.learning.selection import uniforms
from lab.learning.session_events import Event
from lab.learning.settings import LearnerSettings
from lab.mdp import BoolArray, TabularMDP
from lab.toolbox.registry import Toolbox

EXPERT = AdvisorName.of("expert")


@dataclass(frozen=True)
class Advising:
    """Who is asked in a session, and the people behind such names as "terminal".

    panel: how several are asked, and whom to follow; region (S,): where anybody is heard;
    toolbox: where policies that advise are, None: the user's own.
    """

    names: tuple[AdvisorName, ...] = (EXPERT,)
    people: Mapping[str, Ask] = field(default_factory=dict)
    panel: PanelSettings = field(default_factory=PanelSettings)
    region: BoolArray | None = None
    toolbox: Toolbox | None = None

    @classmethod
    def of(
        cls,
        names: "Sequence[str | Advisor | Ask]",
        people: Mapping[str, Ask] | None = None,
        asked: str = PanelSettings.asked,
        decide: str = PanelSettings.decide,
    ) -> "Advising":
        """From names as they are typed, or advisors that were made in Python (see `AdvisorName.made`).

        BadInput for a name that no advisor has, and for an unknown way of asking or deciding.
        """
        found = tuple(
            AdvisorName.of(name, "--advisor") if isinstance(name, str) else AdvisorName.made(name) for name in names
        )
        if "none" in names and len(names) > 1:
            raise BadInput(f"advisor 'none' (--advisor) beside {len(names) - 1} more: it is nobody or somebody")
        for name in PEOPLE:
            if names.count(name) > 1:
                raise BadInput(f"advisor '{name}' (--advisor) is named {names.count(name)} times: once is enough")
        return cls(found, people or {}, PanelSettings(asked, decide))

    def __str__(self) -> str:
        several = f" ({self.panel.asked}, {self.panel.decide})" if len(self.names) > 1 else ""
        return " + ".join(map(str, self.names)) + several

    @property
    def records(self) -> bool:
        """Whether anybody speaks only where a record or a policy has something: such silence is not held against the advice."""
        return any(
            name.folder or name.policy or name.answers or isinstance(name.itself, RecordedAdvisor)
            for name in self.names
        )

    def cut_records(self) -> list[Read]:
        """The journals among the advisors whose last line was cut off. Raises BadInput for what is no journal."""
        folders = [name.folder for name in self.names if name.folder is not None]
        return [read for read in (read_journal(folder, "--advisor") for folder in folders) if read.cut]

    def check_records(self, mdp: TabularMDP) -> list[PolicyAdvisor]:
        """The policies that advise; BadInput for a record or a policy that is not about this problem."""
        level = TableLevel(mdp, 1.0, np.random.default_rng(0), toolbox=self.toolbox)
        known = [make_advisor(name, level) for name in self.names if name.folder or name.policy or name.answers]
        return [one for one in known if isinstance(one, PolicyAdvisor)]

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
        mdp, people = environment.mdp, through(journal, self.people)
        streams = [rng] if len(self.names) == 1 else rng.spawn(len(self.names) + 1)
        made = [
            TableLevel(
                mdp, learner.discount, stream, people, self.region, learner.episodes, environment.values, self.toolbox
            ).advisor(name)
            for name, stream in zip(self.names, streams, strict=False)
        ]
        if len(made) == 1:
            return made[0]
        members = members_of(map(str, self.names), made)
        return Panel(members, mdp.n_states, self.panel, draw=uniforms(streams[-1]), tell=tell)


def through(journal: Journal | None, people: Mapping[str, Ask]) -> dict[str, Ask]:
    """The same people, asked through a journal, which keeps what they say, or says it again."""

    def asked(by: str, ask: Ask) -> Ask:
        return ask if journal is None else lambda request: journal.answer(by, request, ask)

    return {name: asked(name, ask) for name, ask in people.items()}
