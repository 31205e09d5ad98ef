"""The order of a job: as it is given, or refused with the reason; as people advise it; and as a method finds it alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.advice.advisors import AdvisorName
from lab.advice.journal import Undo
from lab.errors import BadInput
from lab.production.order import OrderAdvice, Ordered, checked, checked_order, moves_from, ordered, person_of
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunBegan, RunJournal
from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run
from lab.tasks.sequencing import Sequencing, search_for
from lab.tasks.task_file import load_cell
from lab.teaching.events import ORDER, Event, OrderChosen, SequenceFound
from lab.teaching.lesson_options import LessonOptions
from lab.toolbox.registry import Toolbox

TWO = load_cell("toast-case-1").cell(2)  # plate > toaster (buffer) > applier (buffer) > finished plate, one place each


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("1 1 1 1", "move 4 '1': toast 1 is already at 'finished_plate'; allowed here: 2 (toast 2)"),
        ("1,2,2", "move 3 '2': toast 2 at 'toaster_buffer' cannot move on: 'toaster' full; allowed here: 1 (toast 1)"),
        ("3", "move 1 '3': there is no part 3, only 1 to 2; allowed here: 1 (toast 1), 2 (toast 2)"),
        ("1 two", "move 2 'two' is no part's number, 1 to 2"),
        ("1 -2", "move 2 '-2' is no part's number, 1 to 2"),
        ("1 ²", "move 2 '²' is no part's number, 1 to 2"),
        (" , ", "no moves; wanted part numbers such as 1 2 1"),
        (
            "1 2 1",
            "it ends after 3 moves, but toast 1 is still at 'butter_applier'; allowed here: 1 (toast 1), 2 (toast 2)",
        ),
    ],
)
def test_an_order_is_refused_with_the_first_move_that_may_not_be_made(words: str, reason: str) -> None:
    with pytest.raises(BadInput) as refused:
        checked_order(TWO, words)
    assert str(refused.value) == f"--order '{words}': {reason}"


def test_an_order_may_go_on_from_the_middle() -> None:
    run = Run(TWO)
    for decision in (1, 2, 1):
        run.move(decision)
    assert [move.part for move in moves_from(run, (1, 2, 2, 2), "order")] == [1, 2, 2, 2]
    assert run.locations != Run(TWO).locations  # it stays where it is
    with pytest.raises(BadInput, match=r"^order: it ends after 1 move, but toast 2 is still at"):
        moves_from(run, (1,), "order")


@given(st.data(), st.sampled_from([" ", ",", ", "]))
def test_every_way_through_a_cell_is_an_order(data: st.DataObject, comma: str) -> None:
    cell: Cell = load_cell("toast-case-1").cell(data.draw(st.integers(1, 4)))
    run, made = Run(cell), list[int]()
    while not run.done:
        made.append(data.draw(st.sampled_from(run.allowed())))
        run.move(made[-1])
    assert checked_order(cell, comma.join(map(str, made))) == tuple(made)


# ---- found, given, advised ------------------------------------------------------------------------------------------

THREE = load_cell("toast-case-1").cell(3)
SRL = Sequencing(method="srl", episodes=60)


def by(name: str) -> OrderAdvice:
    return OrderAdvice(advisor=AdvisorName.of(name))


def test_without_advice_it_is_the_methods_order() -> None:
    heard = list[Event]()
    found = ordered(THREE, SRL, OrderAdvice(), 4, heard.append)
    assert found.found == find_sequence(THREE, "srl", search_for(SRL), 4)
    assert (found.used, found.receipt) == ("srl", None)
    assert not any(isinstance(event, OrderChosen) for event in heard)


def test_a_given_order_is_used_though_others_are_better() -> None:
    words = "1 1 1 2 2 2 3 3 3"
    found = ordered(THREE, SRL, OrderAdvice(words), 0)
    sequence = tuple(map(int, words.split()))
    assert found.found.sequence == sequence
    assert found.found.cost == simulate(THREE, sequence).makespan_s == found.costs["given"]
    assert found.used == "given"
    assert found.costs["exact"] == found.proven.cost < found.costs["given"]
    assert found.receipt is not None
    assert found.receipt["used"] == "given"


@pytest.mark.parametrize("advisor", ["expert", "wrong"])
@pytest.mark.parametrize("seed", range(3))
def test_the_cheapest_order_is_used_and_each_is_told(advisor: str, seed: int) -> None:
    heard = list[Event]()
    found = ordered(THREE, SRL, by(advisor), seed, heard.append)
    own = {name: cost for name, cost in found.costs.items() if name != "exact"}  # that one only stands beside them
    assert set(own) in ({"advised", "srl"}, {"srl", "unadvised"})
    assert found.found.cost == min(own.values()) == simulate(THREE, found.found.sequence).makespan_s
    assert found.costs[found.used] == pytest.approx(found.found.cost, abs=1e-6)
    (told,) = (event for event in heard if isinstance(event, OrderChosen))
    assert (told.used, told.costs) == (found.used, found.costs)
    assert found.receipt is not None
    assert found.receipt["requests"] > 0
    assert found.receipt["guided_best"] >= own.get("advised", own.get("unadvised", 0.0))
    expert_is_better = ordered(THREE, SRL, by("expert"), seed).receipt["guided_best"]  # type: ignore[index]
    assert expert_is_better <= found.receipt["guided_best"]


def test_an_order_that_no_move_was_advised_to_is_no_advised_one() -> None:
    """Somebody was asked, and said nothing: what SRL found is called so, and the method's own order comes before it."""
    heard, silent = list[Event](), OrderAdvice(advisor=AdvisorName.of("terminal"), people={"terminal": lambda _: None})
    one = load_cell("toast-case-1").cell(1)
    found = ordered(one, SRL, silent, 0, heard.append)
    assert found.receipt is not None
    assert (list(found.costs), found.used) == (["srl", "unadvised", "exact"], "srl")
    assert (found.receipt["used"], found.receipt["guided_best"]) == ("srl", None)
    (told,) = (event for event in heard if isinstance(event, SequenceFound))
    assert told.method == "srl"


def test_the_first_person_of_a_run_is_asked_about_the_order() -> None:
    assert str(person_of(("expert", "web", "terminal"))) == "web"
    assert str(person_of(("llm:http://h", "expert", "terminal"))) == "terminal"
    assert str(person_of(("expert", "llm:http://h"))) == "llm:http://h"
    assert person_of(("expert", "none")).row == "none"


# ---- people, and runs that are gone on with --------------------------------------------------------------------------


def last_allowed(request: SequenceRequest) -> int:
    return request.allowed[-1]


def advised(folder: Path, ask: Callable[[Any], int | None], journal: RunJournal) -> tuple[Ordered, dict[str, Any]]:
    """The order of a run that a person at the terminal advises."""
    options = LessonOptions(task="toast", advisors=("terminal",), seed=2)
    advice = RunAdvice(Toolbox(folder / "toolbox"), options, journal)
    found = ordered(THREE, SRL, advice.order({"terminal": ask}, {"empty_s": {}}), 2)
    return found, advice.receipts(found)


def begun(folder: Path) -> RunJournal:
    return RunJournal.begin(folder / "run", RunBegan({}, "toast", "0"))


def test_an_answer_taken_back_is_as_if_it_had_not_been_given(tmp_path: Path) -> None:
    asked = list[SequenceRequest]()

    def hesitant(request: SequenceRequest) -> int:
        asked.append(request)
        if len(asked) == 2:
            raise Undo
        return request.allowed[0] if len(asked) == 1 else request.allowed[-1]

    plain, worth = advised(tmp_path / "plain", last_allowed, begun(tmp_path / "plain"))
    undone, same = advised(tmp_path / "undone", hesitant, begun(tmp_path / "undone"))
    assert undone == plain
    assert asked[0].made == asked[2].made == ()
    assert {**worth["order"], "session": ""} == {**same["order"], "session": ""}


@pytest.mark.parametrize("after", [0, 1, 7])
def test_a_run_that_is_gone_on_with_asks_on_where_it_was_broken_off(tmp_path: Path, after: int) -> None:
    whole, worth = advised(tmp_path / "whole", last_allowed, begun(tmp_path / "whole"))
    asked = list[SequenceRequest]()

    def leaves(request: SequenceRequest) -> int:
        if len(asked) == after:
            raise KeyboardInterrupt
        asked.append(request)
        return last_allowed(request)

    def goes_on(request: SequenceRequest) -> int:
        asked.append(request)
        return last_allowed(request)

    broken = begun(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        advised(tmp_path, leaves, broken)
    broken.close()
    again = RunJournal.resume(tmp_path / "run")
    assert len(again.sessions(ORDER)) == 1
    found, same = advised(tmp_path, goes_on, again)
    assert found == whole
    assert len(asked) == worth["order"]["questions"]
    assert {**worth["order"], "session": ""} == {**same["order"], "session": ""}
    again.close()
    over = RunJournal.resume(tmp_path / "run")  # broken off again, after the order was found: nobody is asked twice
    assert advised(tmp_path, lambda request: pytest.fail("asked again"), over)[0] == whole
    over.close()


def test_a_bad_order_is_refused_before_anything_is_made(lab: Callable[..., Any], tmp_path: Path) -> None:
    ran = lab("run", "toast", "--toasts", "1", "--order", "1,1", "--out", str(tmp_path / "run"), "--json")
    assert ran.code == 2
    assert "--order '1,1': it ends after 2 moves, but slice 1 is still at 'butter_applier'" in ran.err
    assert not (tmp_path / "run").exists()


@pytest.fixture
def state() -> Run:
    """2 s into the oven, 10 s in it, 2 s out; the robot comes back in 1 s: 14 s for one, 29 s for two."""
    stations = (Station("in", "storage", 9), Station("hot", "machine", 1, 10.0), Station("out", "storage", 9))
    step = np.ones((3, 3)) - np.eye(3)
    route = (Stage("in"), Stage("hot"), Stage("out"))
    return Run(Cell(stations, (Product("toast", (route,)),), ("toast", "toast"), step, 2 * step, one_robot("in")))


def test_an_order_that_may_be_taken_is_held_against_the_optimum(state: Run) -> None:
    order = checked(state, (2, 2, 1, 1))
    assert (order.sequence, order.schedule.makespan_s, order.gap, order.proven) == ((2, 2, 1, 1), 29.0, 0.0, True)
    assert order.words == "4 moves, 29.0 s: as short as the proven optimum"
    assert state.locations == Run(state.cell).locations  # it was only tried


@pytest.mark.parametrize(
    ("sequence", "why"),
    [
        ((3,), "order: move 1 '3': there is no part 3, only 1 to 2; allowed here: 1 (toast 1), 2 (toast 2)"),
        (
            (1, 2),
            "order: move 2 '2': toast 2 at 'in' cannot move on: 'hot' full; allowed here: 1 (toast 1)",
        ),
        (
            (1, 1, 1),
            "order: move 3 '1': toast 1 is already at 'out'; allowed here: 2 (toast 2)",
        ),
        ((1, 1, 2), "order: it ends after 3 moves, but toast 2 is still at 'hot'; allowed here: 2 (toast 2)"),
    ],
)
def test_the_first_entry_that_may_not_be_taken_is_named(state: Run, sequence: tuple[int, ...], why: str) -> None:
    with pytest.raises(BadInput) as error:
        checked(state, sequence)
    assert str(error.value) == why


def test_it_goes_on_from_where_the_run_is(state: Run) -> None:
    state.move(1)
    assert checked(state, (1, 2, 2)).schedule.makespan_s == 29.0
    with pytest.raises(BadInput, match="order: move 1 '2'"):
        checked(state, (2, 1, 2))
