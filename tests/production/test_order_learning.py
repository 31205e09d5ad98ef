"""What a run says of how its order was learned: figures that a reader can work out, and what the bound alone reaches."""

from pathlib import Path

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.production.order_learning import BOUND_ALONE, UNBOUNDED, Beside, OrderLearning, bound_shares
from lab.sequencing.methods.srl_time import srl_time
from lab.sequencing.search import Reference, Search, SequenceResult
from lab.tasks.task_file import load_cell

COSTS = (40.0, 30.0, 25.0, 30.0, 25.0)  # of five episodes: the least, 25, was found in the third


def learning(known: Reference, *beside: Beside, by: str = "srl", costs: tuple[float, ...] = COSTS) -> OrderLearning:
    return OrderLearning(by, "makespan", SequenceResult((1, 2), min(costs), costs), known, beside)


def test_what_was_found_and_when_beside_the_proven_optimum() -> None:
    document = learning(Reference(20.0, True, "A*")).to_json()
    lines = document.pop("lines")
    assert document == {
        "by": "srl",
        "objective": "makespan",
        "cost": 25.0,
        "bound": 20.0,
        "optimum_proven": True,
        "gap": pytest.approx(0.25),
        "episodes": 5,
        "found_at_episode": 3,
        "first_cost": 40.0,
        "beside": [],
    }
    assert len(lines) == 2
    assert all(fact in lines[0] for fact in ("srl: 25.0 s", "episode 3 of 5", "proven optimum 20.0 s", "25.0%"))
    assert all(fact in lines[1] for fact in ("first", "40.0 s", "100.0%"))


def test_a_bound_that_nothing_reaches_is_no_optimum() -> None:
    assert "proven bound 20.0 s" in learning(Reference(20.0, False, "A*")).lines()[0]


def test_one_episode_has_no_first_one_beside_it() -> None:
    lines = learning(Reference(25.0, True, "A*"), costs=(25.0,)).lines()
    assert len(lines) == 1
    assert "at once" in lines[0]


def test_a_bound_of_nothing_leaves_no_gap_to_tell() -> None:
    learned = learning(Reference(0.0, False, "A*"))
    assert learned.to_json()["gap"] is None
    assert "gap" not in learned.lines()[0]


def test_an_order_that_no_method_found_is_told_by_what_it_is() -> None:
    assert learning(Reference(20.0, True, "A*"), by="given").lines()[0].startswith("the given order: 25.0 s")


def test_parts_of_a_method_stand_beside_it() -> None:
    learned = learning(
        Reference(20.0, True, "A*"), Beside(BOUND_ALONE, 30.0, None), Beside(UNBOUNDED, None, None), by="srl-time"
    )
    alone, without = learned.lines()[2:]
    assert all(fact in alone for fact in (BOUND_ALONE, "30.0 s", "nothing learned", "50.0%"))
    assert all(fact in without for fact in (UNBOUNDED, "no order", "5 episodes"))
    gaps = [one["gap"] for one in learned.to_json()["beside"]]
    assert gaps == [pytest.approx(0.5), None]


def test_the_picture_is_written(folder: Path) -> None:
    learned = learning(Reference(20.0, True, "A*"), Beside(UNBOUNDED, 30.0, 2))
    learned.drawn(load_cell("oven.toml").cell())(folder / "order.svg")
    assert (folder / "order.svg").read_text(encoding="utf-8").count("<svg") == 1


def test_only_srl_time_has_a_bound_to_leave_out(folder: Path) -> None:
    cell = load_cell("oven.toml").cell()
    assert bound_shares(cell, "srl", Search(5), 0) == ()
    alone, without = bound_shares(cell, "srl-time", Search(5), 0)
    assert (alone.by, without.by) == (BOUND_ALONE, UNBOUNDED)
    assert alone.cost is not None
    assert without.cost is not None
    assert min(alone.cost, without.cost) >= 29.0  # the optimum, see `test_sequencing_job.py`
    assert without.episode in range(1, 6)


def test_a_session_that_finds_no_order_without_its_bound_says_so(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object, **__: object) -> SequenceResult:
        raise WorkFailed("no order")

    monkeypatch.setattr("lab.production.order_learning.srl_time", nothing)
    _, without = bound_shares(load_cell("oven.toml").cell(), "srl-time", Search(5), 0)
    assert without == Beside(UNBOUNDED, None, None)


def test_both_draw_what_session_0_of_the_seed_draws(folder: Path) -> None:
    cell = load_cell("oven.toml").cell()
    found = srl_time(cell, Search(5), np.random.default_rng([7, 2, 0]), bounded=False)
    assert bound_shares(cell, "srl-time", Search(5), 7)[1].cost == found.cost
