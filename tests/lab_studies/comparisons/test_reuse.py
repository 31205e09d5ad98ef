"""The curriculum: its orders, two small tasks from end to end, and how few skills become rows, by hand."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations
from typing import Any

import pytest

from lab.errors import BadInput
from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.findings import Row, those
from lab.studies.runner import Job
from lab.tasks.task import Order, Task
from lab_studies.comparisons import reuse as study
from lab_studies.comparisons.reuse import Outcome, in_short, orders_of, ordinal, reuse, rows_of, rows_of_lives
from lab_studies.comparisons.reuse_figures import by_place, by_task

# by hand: two tasks of two skills; after "a", b's grasp is taken and its way is adapted in 29 episodes instead of 200
GRASP = Outcome("a", "grasp", "learned", "", 600, 100, 5000, 3.0, 2.5)
WAY = Outcome("a", "transfer", "learned", "", 200, 50, 3000, 1.0, 0.5)
A, B = (GRASP, WAY), (replace(GRASP, task="b"), replace(WAY, task="b"))
TAKEN = Outcome("b", "grasp", "reused", "a", 0, 0, 0, 0.5, 0.5)
ADAPTED = Outcome("b", "transfer", "adapted", "a", 29, 0, 500, 0.5, 0.25)
OWN = Outcome("a", "transfer", "adapted", "a", 100, 50, 1500, 0.5, 0.5)
ANEW = {"a": A, "b": B}
LIVES = [(A, (TAKEN, ADAPTED)), (B, (replace(TAKEN, task="a", from_task="b"), OWN))]


def value(rows: list[Row], measure: str, **named: Any) -> float:
    """The one value of these settings."""
    (found,) = [
        one["value"]
        for one in those(rows, measure=measure, **({"task": None, "subtask": None, "source": None} | named))
    ]
    return float(found)


def test_orders_begin_with_the_shipped_one_and_are_drawn_without_repeats() -> None:
    every = orders_of("abc", 6, seed=3)
    assert every[0] == ("a", "b", "c")
    assert {*every} == {*permutations("abc")}
    assert every[:4] == orders_of("abc", 4, seed=3)
    assert len({tuple(orders_of("abc", 6, seed)) for seed in range(5)}) > 1
    with pytest.raises(BadInput, match=r"^7 orders \(--sessions\) of 3 tasks: allowed are 1 to 6$"):
        orders_of("abc", 7, seed=3)


def test_what_becomes_of_a_skill() -> None:
    assert [one.fate for one in (GRASP, TAKEN, ADAPTED, OWN)] == ["learned", "taken", "adapted", "own"]


def test_rows_by_hand() -> None:
    """The first order saves 771 of 800 episodes at its second place, the other one 700."""
    rows = rows_of(LIVES, ANEW)
    assert value(rows, "saved_episodes_percent", place=2) == pytest.approx((100 * 771 / 800 + 100 * 700 / 800) / 2)
    assert value(rows, "saved_wall_s_percent", place="later") == 75.0
    fates = {fate: value(rows, f"{fate}_percent", place="later") for fate in study.FATES}
    assert fates == {"taken": 50.0, "adapted": 25.0, "own": 25.0, "learned": 0.0}
    assert value(rows, "taken_percent", place="later", subtask="grasp") == 100.0
    assert value(rows, "saved_episodes_percent", place="later", task="b") == 96.375
    assert value(rows, "taken_failing_percent", place="later") == 0.0
    assert those(rows, measure="more_saved_a_place_percent") == []  # neither task comes at two later places
    says = in_short(rows, 2)
    assert (
        says["answer"]
        == "yes: later tasks of an order save 92 % (36 to 148) of the episodes that they take from scratch"
    )
    assert says["episodes saved by place"] == "2nd 92 % (36 to 148)"
    assert (says["carry over"], says["do not carry over"]) == ("grasp 100 %, transfer 50 %", "none")
    assert in_short(rows_of(LIVES[:1], ANEW), 1)["answer"].startswith("yes: later tasks of an order save 96 % of the ")


def test_a_task_that_saves_more_the_later_it_comes() -> None:
    """Task b saves nothing at the second place and all at the third, c nothing at either: 50 % more in the mean."""
    nothing, everything = B, (TAKEN, replace(ADAPTED, episodes=0))
    other = (replace(GRASP, task="c"),)
    lives = [(A, nothing, other), (A, other, everything)]
    rows = rows_of(lives, ANEW | {"c": other})
    assert value(rows, "more_saved_a_place_percent", place="later") == pytest.approx(50.0)
    assert str(in_short(rows, 2)["answer"]).endswith(", and 50.0 points more for each place that a task comes later")


def test_rows_of_each_task_of_an_order_by_hand() -> None:
    rows = rows_of_lives(LIVES[:1], ANEW)
    columns = (
        "order",
        "place",
        "task",
        "source",
        "value",
        "from_earlier",
        "episodes",
        "helped_steps",
        "moves",
        "wall_s",
    )
    assert [tuple(one[name] for name in (*columns, "saved_percent")) for one in rows] == [
        (1, 1, "a", "all", 2.0, 0, 800, 150, 8000, 4.0, 0.0),
        (1, 1, "a", "learned", 2.0, 0, 800, 150, 8000, 4.0, 0.0),
        (1, 2, "b", "all", 2.0, 2, 29, 0, 500, 1.0, 96.375),
        (1, 2, "b", "reused", 1.0, 1, 0, 0, 0, 0.5, 100.0),
        (1, 2, "b", "adapted", 1.0, 1, 29, 0, 500, 0.5, 85.5),
    ]


def test_pictures_say_what_they_show() -> None:
    rows = [*rows_of(LIVES, ANEW), *rows_of_lives(LIVES, ANEW)]
    places, tasks = by_place(rows).decode(), by_task(rows).decode()
    assert "<title>order 1: a, b</title>" in places
    assert "<title>order 1: b 96 %</title>" in places
    assert all(name in tasks for name in ("taken from an earlier task", "learned from scratch", ">a<", ">b<"))


@pytest.mark.parametrize(("number", "said"), [(1, "1st"), (2, "2nd"), (3, "3rd"), (4, "4th"), (11, "11th")])
def test_ordinals(number: int, said: str) -> None:
    assert ordinal(number) == said


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two tasks with two or three of their skills each, and another arm with one, so that they are learned in seconds."""
    wanted = {
        "toast": ("place at toaster_buffer", "butter at butter_applier"),
        "two-toasters": ("place at toaster_buffer", "butter at butter_applier", "insert at toaster-1"),
        "toast-panda": ("butter at butter_applier",),
    }

    def some(task: Task, order: Order, seed: int) -> Prepared:
        first, *others = [prepare(task, order, seed, name) for name in wanted[task.name]]
        for one in others:
            first.problems |= one.problems
            first.skillset.skills |= {name: one.skillset.skills[name] for name in one.problems}
        return first

    def forget() -> None:
        study._life.cache_clear()
        study._prepared.cache_clear()

    monkeypatch.setattr(study, "prepare", some)
    monkeypatch.setattr(study, "TASKS", ("toast", "two-toasters"))
    forget()
    yield
    forget()


def test_two_small_tasks_in_both_orders(few: None) -> None:
    told: list[tuple[int, int]] = []
    found = reuse(Job(2, progress=lambda done, total: told.append((done, total))), {})
    assert told[-1] == (6, 6)  # two orders, the second pair, three tasks alone
    at = {(one["order"], one["place"]): one for one in those(found.rows, source="all")}
    assert [(key, one["task"], one["value"]) for key, one in at.items()] == [
        ((1, 1), "toast", 2.0),
        ((1, 2), "two-toasters", 3.0),
        ((2, 1), "two-toasters", 3.0),
        ((2, 2), "toast", 2.0),
    ]
    assert [at[order, 1]["saved_percent"] for order in (1, 2)] == [0.0, 0.0]
    assert (at[1, 2]["from_earlier"], at[2, 2]["from_earlier"]) == (2, 2)
    assert (at[2, 2]["episodes"], at[2, 2]["saved_percent"]) == (0, 100.0)  # all there is to learn was learned before
    assert at[1, 2]["episodes"] == at[2, 1]["episodes"] - at[1, 1]["episodes"]  # what is left is to be inserted
    assert found.summary["carry over"] == "place 100 %, cover 100 %"
    assert found.summary["do not carry over"] == "insert 0 %"
    assert (found.summary["taken_failing_percent"], found.summary["unsolved_percent"]) == (0.0, 0.0)
    assert found.summary["episodes saved after toast"].endswith("toast-panda 100 %")
    study._life.cache_clear()
    again = reuse(Job(2), {})
    assert [_but_time(one) for one in again.rows] == [_but_time(one) for one in found.rows]


def _but_time(one: Row) -> Row:
    """A row without what the clock says."""
    names = ("wall_s", "cpu_s", "wall_s_anew", "cpu_s_anew")
    measured = ("value", "ci95") if one["measure"] in ("saved_wall_s_percent", "saved_cpu_s_percent") else ()
    return {name: value for name, value in one.items() if name not in (*names, *measured)}
