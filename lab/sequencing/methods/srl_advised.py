"""SRL with advice: when the makespan stops improving, it asks which part to move next, and rejects misleading advisors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lab.errors import BadInput, unknown
from lab.learning.gates import GATES, Gate, improvement
from lab.learning.praise import Judgement
from lab.learning.requests import Advisor, AdvisorLeft, Standing
from lab.learning.session_events import AdviceEnded, AdviceGiven, AdviceRejected, AdviceRequested, EpisodeEnded, Event
from lab.learning.settings import GateSettings
from lab.plugins.family import checked_action
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.session_readable import Guide, learn_readably
from lab.sequencing.methods.srl import Srl
from lab.sequencing.search import LearnedSequence, Search, SequenceRequest, state_of
from lab.sequencing.simulate.run import Run

NEVER_REACHED = 10**12  # the gate's step limit, a cost that no episode has: every episode counts as finished
FITTING = ("ccrl", "always", "never")  # gates that judge whole episodes; the others compare values of a table of states


@dataclass(frozen=True)
class AdvisedResult(LearnedSequence):
    """A sequencer's result and its advice: the episodes that asked, the decisions taken from the advisor, and the misleads.

    first_helped: the first episode with a decision by the advisor; None: there was none.
    """

    requests: int
    helped_steps: int
    misleads: int
    rejected_at_episode: int | None
    first_helped: int | None

    @property
    def advised(self) -> bool:
        """Whether the sequence may owe something to advice: a move was advised in its episode or in an earlier one."""
        return self.first_helped is not None and self.episode_costs.index(self.cost) + 1 >= self.first_helped


def check_gate(gate: str) -> None:
    """Raises BadInput for a gate that does not judge whole episodes."""
    if gate not in FITTING and gate in GATES:
        allowed = f"it needs a table of states, which sequencing does not have; allowed here: {', '.join(FITTING)}"
        raise BadInput(f"gate '{gate}' (--gate): {allowed}")
    if gate not in FITTING:
        raise unknown("gate", gate, FITTING, "--gate, for sequencing")


def advised_srl(
    cell: Cell,
    search: Search,
    rng: np.random.Generator,
    gate: GateSettings,
    advisor: Advisor | None,
    tell: Callable[[Event], None] = lambda event: None,
) -> AdvisedResult:
    """The result of SRL as printed when it asks for advice as the gate says; advised decisions are learned like its own.

    The gates are those of the low level; where they compare step counts, and where events report them, costs stand here
    (makespans [s]). Raises BadInput for a gate that does not judge whole episodes, and as `srl` does. Source: thesis 10.2.1 iii
    with fig. 6.2.
    """
    check_gate(gate.gate)
    session = _Advised(GATES[gate.gate].make(gate, search.episodes, NEVER_REACHED, None), gate, advisor, tell)
    learned = learn_readably(cell, search, drawn_seed(rng), Srl, session)
    return AdvisedResult(
        *learned.log.found(cell),
        learned.final_cost,
        session.requests,
        session.helped_steps,
        session.gate.misleads,
        session.rejected_at,
        session.first_helped,
    )


class _Advised(Guide):
    """The guide of an advised session: it asks the advisor before a decision, and judges each episode by its cost."""

    def __init__(
        self, gate: Gate, settings: GateSettings, advisor: Advisor | None, tell: Callable[[Event], None]
    ) -> None:
        self.gate, self._settings, self._advisor, self._tell = gate, settings, advisor, tell
        self.requests = self.helped_steps = 0
        self.rejected_at: int | None = None
        self.first_helped: int | None = None
        self._costs: list[float] = []
        self._open = self._asked = False
        self._helped = 0
        self._made: list[int] = []  # the decisions of this episode

    def begins(self, episode: int) -> None:
        """Decides by the gate whether the episode may ask."""
        self._open = self._advisor is not None and self.gate.opens(episode, self._costs)
        self._asked, self._helped, self._made = False, 0, []

    def decide(self, run: Run, allowed: tuple[int, ...], own: int) -> int:
        """The advisor's decision where the episode may ask and there is a choice, else the learner's own."""
        said = self._asks(run, allowed, own)
        self._helped += said is not None
        self._made.append(own if said is None else said)
        return self._made[-1]

    def _asks(self, run: Run, allowed: tuple[int, ...], own: int) -> int | None:
        """The advisor's decision; None when nobody is asked or no advice is given."""
        if not self._open or self._advisor is None or len(allowed) == 1:
            return None
        known, number = improvement(self._costs, self._settings.window), len(self._costs) + 1
        if not self._asked:
            self._asked = True
            self.requests += 1
            self._tell(AdviceRequested.of(number, known))
        request = SequenceRequest(
            episode=number,
            step=len(self._made) + 1,
            state=state_of(run),
            own=own,
            allowed=allowed,
            improvement=known,
            reason=self.gate.why,
            standing=self._standing(),
            run=run,
            made=tuple(self._made),
        )
        try:
            said = self._advisor.advise(request)
        except AdvisorLeft:
            self._advisor = None
            self._tell(AdviceEnded(number, "advisor left"))
            return None
        assert not isinstance(said, Judgement)  # no request about an order allows one
        self._tell(AdviceGiven(number, request.step, request.state, said, own))
        return None if said is None else checked_action(said, allowed, "the advisor")

    def _standing(self) -> Standing:
        helped, settings = self.helped_steps + self._helped, self._settings
        return Standing(helped, settings.budget, self.gate.misleads, settings.omega, settings.lambda_threshold)

    def ends(self, cost: float) -> None:
        """Judges the advice of the episode by whether its cost improved."""
        self._costs.append(cost)
        self.helped_steps += self._helped
        number, helped, window = len(self._costs), self._helped, self._settings.window
        self.first_helped = number if helped and self.first_helped is None else self.first_helped
        self.gate.judges(self._costs, self._open and helped > 0)
        known, before = improvement(self._costs, window), self._costs[-1 - window : -1]
        rate = None if known is None else known.rate
        self._tell(EpisodeEnded(number, cost, helped > 0, helped, rate, True, self.gate.verdict))
        if self.gate.rejected and self.rejected_at is None:
            self.rejected_at = number
            mean_before = sum(before) / len(before) if before else cost
            self._tell(AdviceRejected(number, self.gate.misleads, self._settings.omega, cost, mean_before))
