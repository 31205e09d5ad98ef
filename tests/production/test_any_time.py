"""Whenever looking for an order is stopped, there is one, with its bound, and it is said by what it was stopped."""

from collections.abc import Callable
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import pytest

from lab.errors import BadInput
from lab.production.sequencing_job import SequencingOptions, sequence_cell
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.chance import NO_CHANCE
from lab.sequencing.cell.objectives import OBJECTIVES
from lab.sequencing.methods import portfolio, shared
from lab.sequencing.methods.rules import first_come
from lab.sequencing.methods.shared import Limits, Shared
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import simulate
from lab.tasks.sequencing import Sequencing
from lab.tasks.task_file import load_cell
from lab.teaching.events import Event, SequencingStands

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
NAMES = sorted(set(SEQUENCERS) - {"earliest-due"})
RULES = ("fifo", "carried", "nearest-ready", "shortest-move")


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is proven at first, annealing is short, and all news are told."""
    monkeypatch.setattr(portfolio, "FIRST_LOOK", 1)
    monkeypatch.setattr(portfolio, "MOVES", 20_000)
    monkeypatch.setattr(shared, "REPORT_S", -1.0)


def pressed_at(monkeypatch: pytest.MonkeyPatch, number: int) -> list[str]:
    """Ctrl-C is pressed once so many things were told; by whom, so far."""
    told, tell = list[str](), Shared.tell

    def pressed(self: Shared, by: str, *news: Any, **more: Any) -> None:
        tell(self, by, *news, **more)
        if current_thread() is main_thread():
            told.append(by)
            if len(told) == number:
                raise KeyboardInterrupt

    monkeypatch.setattr(Shared, "tell", pressed)
    return told


def found(
    cell_name: str, wanted: SequencingOptions, tell: Callable[[Event], None] = lambda event: None
) -> dict[str, Any]:
    """The document, whose order is carried out, and costs what it says."""
    cell = load_cell(cell_name).cell()
    document, _ = sequence_cell(cell, Sequencing(), wanted, NO_CHANCE, tell=tell)
    for name, cost in (("sequence", "cost"), ("best_sequence", "best_cost")):
        assert simulate(cell, document[name]).makespan_s == pytest.approx(document[cost])
    assert 0.0 <= document["bound_cost"] <= document["best_cost"] + SAME
    assert document["best_cost"] <= document["cost"] + SAME
    assert document["interrupted"] == (document["stopped_by"] == "Ctrl-C")
    assert len(document["episode_costs"]) >= document["found_at_episode"]
    return document


@pytest.mark.parametrize(
    ("method", "cell"),
    [*((name, "fms") for name in NAMES), *((name, "two-on-a-track") for name in NAMES if name != "srl-time")],
)
def test_ctrl_c_loses_nothing(monkeypatch: pytest.MonkeyPatch, method: str, cell: str) -> None:
    for number in (1, 2, 3, 5):
        with monkeypatch.context() as patch:
            told = pressed_at(patch, number)
            document = found(cell, SequencingOptions(method, 300))
        assert document["stopped_by"] == ("Ctrl-C" if len(told) >= number else None)


@pytest.mark.parametrize("method", NAMES)
def test_when_the_time_is_over_there_is_an_order(method: str) -> None:
    """It is over before anything was tried."""
    document = found("fms", SequencingOptions(method, 300, seconds=1e-9))
    assert document["stopped_by"] == "seconds"
    assert document["bound_s"] > 0.0


@pytest.mark.parametrize("method", NAMES)
def test_near_enough(method: str) -> None:
    """The first order that is complete is within a gap of 10,000 %; a deadlock is none."""
    document = found("fms", SequencingOptions(method, 300, gap=100.0))
    assert document["stopped_by"] == "gap"
    assert document["found_at_episode"] == document["episodes"]


def test_each_session_is_near_enough_alone() -> None:
    document = found("fms", SequencingOptions("random", 300, sessions=3, gap=100.0))
    assert (document["sessions"], document["stopped_by"]) == (3, "gap")


def test_a_gap_that_nothing_reaches_ends_nothing() -> None:
    """FIFO is the first order and the last; then it is proven that there are better ones."""
    document = found("toast-case-1", SequencingOptions("fifo", gap=0.0))
    assert (document["cost"], document["best_cost"], document["proven"]) == (544.0, 513.0, True)


@pytest.mark.parametrize("method", RULES)
def test_a_rule_waits_for_no_proof_unless_it_is_asked_for(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    proven = list[float]()
    monkeypatch.setattr("lab.production.any_time.look_on", lambda best, left_s: proven.append(left_s))
    assert not found("two-on-a-track", SequencingOptions(method))["optimum_proven"]
    assert proven == []
    found("two-on-a-track", SequencingOptions(method, seconds=50.0))
    found("two-on-a-track", SequencingOptions("random", 5))
    assert len(proven) == 2


def test_what_is_told_while_it_runs() -> None:
    """The best order never becomes worse, and the bound never lower; the last that is told is what is known in the end."""
    heard = list[Event]()
    document = found("fms", SequencingOptions("random", 200), heard.append)
    stands = [event for event in heard if isinstance(event, SequencingStands)]
    costs, bounds = [one.cost for one in stands], [one.reference.bound for one in stands]
    assert costs == sorted(costs, reverse=True)
    assert bounds == sorted(bounds)
    assert (costs[-1], bounds[-1]) == pytest.approx((document["best_cost"], document["bound_cost"]))


def test_stopped_before_anything_is_proven_there_is_a_bound_that_takes_no_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two toasts of 10 s in an oven for one: 20 s at least."""

    def pressed(best: Shared) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lab.production.any_time.look_first", pressed)
    document = found("oven.toml", SequencingOptions("srl"))
    assert (document["stopped_by"], document["best_by"]) == ("Ctrl-C", "first come, first served")
    assert (document["bound_cost"], document["bound_by"]) == (20.0, "each machine alone")


def test_an_objective_without_a_rule_has_no_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBJECTIVES, "squared", lambda run: run.now_s**2)
    cell = load_cell("fms").cell()
    document, _ = sequence_cell(
        cell, Sequencing(), SequencingOptions("fifo", objective="squared", seconds=9.0), NO_CHANCE
    )
    assert (document["bound_cost"], document["stopped_by"], document["proven"]) == (0.0, None, False)


@pytest.mark.parametrize(
    ("limits", "line"),
    [
        ((0.0, None), r"seconds = 0.0 .--seconds.: allowed are finite times above 0"),
        ((float("nan"), None), "seconds = nan"),
        ((None, -0.1), r"gap = -0.1 .--gap.: allowed are fractions from 0, such as 0.05"),
    ],
)
def test_what_is_no_limit(limits: tuple[float | None, float | None], line: str) -> None:
    with pytest.raises(BadInput, match=line):
        Limits.of(*limits)


def test_the_command_writes_what_was_found(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pressed_at(monkeypatch, 2)
    ran = lab(
        *["sequence", "fms", "--method", "srl", "--gantt", "g.svg", "--plot", "p.svg", "--schedule", "s.csv", "--json"]
    )
    assert (ran.code, ran.json["stopped_by"]) == (130, "Ctrl-C")
    assert "stopped by Ctrl-C; the best order until then is above" in ran.err
    assert all((folder / name).is_file() for name in ("g.svg", "p.svg", "s.csv"))
    assert len(ran.json["schedule"]) > 0


@pytest.mark.parametrize(
    ("words", "code"), [("--seconds 1e-9", 0), ("--gap 100", 0), ("--gap -1", 2), ("--seconds 0", 2)]
)
def test_limits_on_the_command_line(lab: Lab, folder: Path, words: str, code: int) -> None:
    ran = lab("sequence", "fms", "--method", "random", *words.split())
    assert ran.code == code
    if code == 0:
        assert ran.out.splitlines()[0].endswith("the best order until then, which is not proven to be the best")


def test_a_session_with_advice_has_its_length(lab: Lab, folder: Path) -> None:
    ran = lab(*["sequence", "fms", "--method", "srl", "--advisor", "expert", "--seconds", "5"])
    line = "lab: --seconds or --gap beside --advisor expert: a session with advice is as long as its episodes: --episodes\n"
    assert (ran.code, ran.err) == (2, line)


def test_an_order_told_by_a_parent_is_not_taken_for_an_own_one() -> None:
    """Its bound is; what is told here is told there."""
    cell = load_cell("fms").cell()
    parent = Shared(cell, "makespan")
    order = first_come(cell)
    parent.tell("somebody", order, bound=100.0)
    own = Shared(cell, "makespan", parent=parent)
    assert (own.sequence, own.bound, own.bound_by) == ((), 100.0, "somebody")
    own.tell("me", order, bound=120.0)
    assert (parent.found_by, parent.bound, parent.bound_by) == ("somebody", 120.0, "me")
    assert own.found_by == "me"
    assert own.beats(own.cost + 1.0, "you")
    assert not own.beats(own.cost + 1.0, "me")
