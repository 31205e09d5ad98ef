"""The advisors of a session, combined into one `Advisor`: simulated, recorded or learned ones, people, language models."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lab.advice.advisors import ADVISORS, AdvisorName, RecordedAdvisor, is_external, make_advisor
from lab.advice.entries import Read, read_journal
from lab.advice.journal import Journal
from lab.advice.panel import Panel, PanelSettings, members_of
from lab.advice.table_level import PolicyAdvisor, TableLevel
from lab.errors import BadInput
from lab.learning.environment import Environment
from lab.learning.requests import Advisor, Ask, Reply, Request
from lab.learning.selection import uniforms
from lab.learning.session_events import Event
from lab.learning.settings import LearnerSettings
from lab.mdp import BoolArray, TabularMDP
from lab.toolbox.registry import Toolbox

EXPERT = AdvisorName.of("expert")


@dataclass(frozen=True)
class Advising:
    """The advisors of a session.

    names: the advisors; people: the functions that ask people and language models, by name; panel: how several advisors are
    asked and combined; region: (S,) bool, the states in which advice counts, None for all; toolbox: holds the policies that
    advise, None for the user's own.
    """

    names: tuple[AdvisorName, ...] = (EXPERT,)
    people: Mapping[str, Ask] = field(default_factory=dict)
    panel: PanelSettings = field(default_factory=PanelSettings)
    region: BoolArray | None = None
    toolbox: Toolbox | None = None

    @classmethod
    def of(
        cls,
        names: "Sequence[str | Advisor | Ask | type[Advisor]]",
        people: Mapping[str, Ask] | None = None,
        asked: str = PanelSettings.asked,
        decide: str = PanelSettings.decide,
    ) -> "Advising":
        """The advisors with these names, or made in Python (see `AdvisorName.made`).

        Raises BadInput for an unknown name, or an unknown order of asking or rule of deciding.
        """
        advisors = tuple(
            AdvisorName.of(name, "--advisor") if isinstance(name, str) else AdvisorName.made(name) for name in names
        )
        for one in advisors:
            if one.judging is not None and len(names) > 1:
                others = f"beside {len(names) - 1} more"
                raise BadInput(
                    f"advisor '{one}' (--advisor) {others}: it judges moves that others choose: name it alone"
                )
        if "none" in names and len(names) > 1:
            raise BadInput(f"advisor 'none' (--advisor) beside {len(names) - 1} more: it is nobody or somebody")
        for name in dict.fromkeys(name for name in names if isinstance(name, str) and is_external(name)):
            if names.count(name) > 1:
                raise BadInput(f"advisor '{name}' (--advisor) is named {names.count(name)} times: once is enough")
        return cls(advisors, people or {}, PanelSettings(asked, decide))

    def __str__(self) -> str:
        several = f" ({self.panel.asked}, {self.panel.decide})" if len(self.names) > 1 else ""
        return " + ".join(map(str, self.names)) + several

    @property
    def records(self) -> bool:
        """Whether any advisor can answer only in states that a record or a policy knows; its silence is then no mislead."""
        return any(
            name.folder or name.policy or name.answers or isinstance(name.itself, RecordedAdvisor)
            for name in self.names
        )

    def cut_records(self) -> list[Read]:
        """The journals of recorded advisors whose last line is incomplete. Raises BadInput if one is no journal."""
        folders = [name.folder for name in self.names if name.folder is not None]
        return [read for read in (read_journal(folder, "--advisor") for folder in folders) if read.cut]

    def check_records(self, mdp: TabularMDP) -> list[PolicyAdvisor]:
        """The policies that advise. Raises BadInput for a record or a policy of another problem."""
        level = TableLevel(mdp, 1.0, np.random.default_rng(0), toolbox=self.toolbox)
        advisors = [make_advisor(name, level) for name in self.names if name.folder or name.policy or name.answers]
        return [advisor for advisor in advisors if isinstance(advisor, PolicyAdvisor)]

    def for_session(self) -> "Advising":
        """The same advisors for one of several sessions, which share no state: see `AdvisorName.for_session`."""
        return replace(self, names=tuple(name.for_session() for name in self.names))

    def modules(self) -> list[str]:
        """The modules of added advisors' code, see `Family.modules_of`."""
        return [module for name in self.names for module in ADVISORS.modules_of((name.inner or name).row)]

    def gather(
        self,
        environment: Environment,
        learner: LearnerSettings,
        rng: np.random.Generator,
        *,
        journal: Journal | None = None,
        tell: Callable[[Event], None] = lambda event: None,
    ) -> Advisor | None:
        """The advisors combined into one, None if there are none; people's answers are recorded in the journal.

        Several advisors draw from independent streams. Raises BadInput as `make_advisor` does.
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
    """Functions that ask the same people through a journal, which records their answers, or answers for them in a replay.

    An `ask` with a method `remember` is told what the journal answered for it.
    """

    def asked(by: str, ask: Ask) -> Ask:
        if journal is None:
            return ask
        remember = getattr(ask, "remember", None)

        def answered(request: Request) -> Reply:
            is_known = journal.folding
            action = journal.answer(by, request, ask)
            if is_known and remember is not None:
                remember(request, action)
            return action

        return answered

    return {name: asked(name, ask) for name, ask in people.items()}
