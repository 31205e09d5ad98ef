"""SRL that asks which part to move next, and whom it believes."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.advice.advisors import AdvisorName, make_advisor
from lab.advice.order_level import OrderLevel
from lab.errors import BadInput
from lab.learning.requests import Advisor, AdvisorLeft, TooSlow
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.srl import srl
from lab.sequencing.methods.srl_advised import (
    AdvisedResult,
    advised_srl,
    check_gate,
)
from lab.sequencing.search import Search, SequenceRequest

CellMaker = Callable[..., Cell]
EPISODES = 80


def named(name: str, cell: Cell, seed: int = 0) -> Advisor | None:
    return make_advisor(AdvisorName.of(name), OrderLevel(cell, np.random.default_rng(seed), episodes=EPISODES))


def learned(cell: Cell, advisor: Advisor | str | None, seed: int = 0, gate: str = "ccrl") -> AdvisedResult:
    if isinstance(advisor, str):
        advisor = named(advisor, cell, seed)
    return advised_srl(cell, Search(EPISODES), np.random.default_rng(seed), GateSettings(gate), advisor)


def test_alone_it_is_srl_as_printed(toast_cell: CellMaker) -> None:
    """The compiled session, and the readable one that nobody advises, are the same."""
    cell = toast_cell("I", 3)
    alone = srl(cell, Search(EPISODES), np.random.default_rng(4))
    for result in (learned(cell, "none", 4), learned(cell, "expert", 4, "never")):
        assert (result.sequence, result.episode_costs) == (alone.sequence, alone.episode_costs)
        assert (result.requests, result.helped_steps, result.misleads) == (0, 0, 0)


def test_an_expert_brings_it_to_the_optimum(toast_cell: CellMaker) -> None:
    """With 4 toasts hardly a session gets there alone in 80 episodes; asked from episode 30 on, an expert says how."""
    cell = toast_cell("II", 4)
    best = optimum(cell).cost
    alone = sum(learned(cell, "none", seed).cost == best for seed in range(8))
    helped = [learned(cell, "expert", seed) for seed in range(8)]
    assert sum(result.cost == best for result in helped) == 8 > alone + 3
    assert all(result.requests > 0 and result.helped_steps > 0 for result in helped)


def test_who_takes_the_worst_for_the_best_is_rejected(toast_cell: CellMaker) -> None:
    results = [learned(toast_cell("II", 4), "wrong", seed) for seed in range(5)]
    for result in results:
        assert result.rejected_at_episode is not None
        assert result.misleads == GateSettings().omega + 1
        assert result.requests <= result.rejected_at_episode - GateSettings().first_episode + 1


def test_an_optimum_that_cannot_be_beaten_misleads_as_printed_but_not_where_the_best_is_spared(
    toast_cell: CellMaker,
) -> None:
    cell = toast_cell("I", 3)
    for spare_best in (False, True):
        gate, advisor = GateSettings(spare_best=spare_best), named("expert", cell)
        result = advised_srl(cell, Search(EPISODES), np.random.default_rng(0), gate, advisor)
        assert result.helped_steps > 0
        assert (result.misleads > 0) == (not spare_best)


class Person:
    """Says what it is told to, and writes down what it was shown."""

    def __init__(self, say: Callable[[SequenceRequest], int | None]) -> None:
        self.say, self.seen = say, list[SequenceRequest]()

    def advise(self, request: SequenceRequest) -> int | None:
        self.seen.append(request)
        return self.say(request)


def test_what_a_person_is_shown(toast_cell: CellMaker) -> None:
    person = Person(lambda request: max(request.allowed))
    result = learned(toast_cell("I", 3), person)
    assert person.seen[0].episode >= GateSettings().first_episode
    assert all(len(request.allowed) > 1 and request.own in request.allowed for request in person.seen)
    assert isinstance(person.seen[0].reason, TooSlow)
    assert person.seen[0].improvement is not None
    assert result.helped_steps == len(person.seen)


def test_a_person_may_say_nothing_or_leave(toast_cell: CellMaker) -> None:
    def leave(request: SequenceRequest) -> int | None:
        raise AdvisorLeft

    cell = toast_cell("I", 3)
    alone = learned(cell, "none")
    for say in (lambda request: None, leave):
        result = learned(cell, Person(say))
        assert result.episode_costs == alone.episode_costs
        assert result.helped_steps == 0


def test_what_cannot_be(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 2)
    with pytest.raises(BadInput, match="the advisor named action 7: allowed 1, 2"):
        learned(cell, Person(lambda request: 7), gate="always")
    with pytest.raises(BadInput, match=r"gate 'ia' .--gate.: .*table of states"):
        check_gate("ia")
    with pytest.raises(BadInput, match=r"unknown gate 'ccrrl'.*did you mean 'ccrl'"):
        learned(cell, "none", gate="ccrrl")
    with pytest.raises(BadInput, match="this command has no prompt"):
        named("terminal", cell)
