"""What a list of decisions, and a policy that reacts, come to where times are drawn."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.production.sequencing_job import (
    SequencingOptions,
    sequence_cell,
)
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.chance import Chance
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.simulate.several import replicate
from lab.tasks.sequencing import write_policy
from lab.tasks.task_file import load_cell

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def asked(lab: Lab, words: str, **more: Any) -> dict[str, Any]:
    """The document of a command that went well."""
    ran = lab("sequence", *words.split(), "--json", **more)
    assert ran.code == 0, ran.err
    document: dict[str, Any] = ran.json
    return document


REACTING = {
    "srl": "planned anew at every decision, by rollout",
    "srl-time": "it goes on learning before every decision",
    "fifo": "a queue of tasks as they become possible",
    "shortest-move": "the rule shortest-move, asked at every decision",
    "exact": "planned anew at every decision, by rollout",
    "carried": "the carried-over policy, asked at every decision",
}


def few(monkeypatch: pytest.MonkeyPatch, episodes: int) -> None:
    """Draw so many episodes, whatever the method and however many parts."""
    for name in ("REPLICATIONS", "FEWEST"):
        monkeypatch.setattr(f"lab.production.sequencing_job.{name}", episodes)


@pytest.mark.parametrize("method", REACTING)
def test_drawn_times(lab: Lab, monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    """The list as it is, and what reacts, in the same episodes: the document has the means of both, and of the difference."""
    few(monkeypatch, 5)
    words = f"toast-case-1 --toasts 3 --method {method} --episodes 40"
    plain, document = asked(lab, words), asked(lab, f"{words} --stochastic")
    assert list(document) == list(plain)
    drawn = document["stochastic"]
    assert list(drawn) == [
        *("processing", "arrivals", "spread", "robot_breaks_every_s", "robot_repair_s"),
        *("replications", "fixed", "reacting", "saved_by_reacting"),
    ]
    assert (drawn["processing"], drawn["arrivals"], drawn["spread"]) == ("normal", None, 0.1)
    assert (drawn["replications"], drawn["reacting"]["policy"]) == (5, REACTING[method])
    for name in ("fixed", "reacting", "saved_by_reacting"):
        low, high = drawn[name]["ci95"]
        assert low <= drawn[name]["mean"] <= high
    saved = drawn["fixed"]["mean"] - drawn["reacting"]["mean"]
    assert drawn["saved_by_reacting"]["mean"] == pytest.approx(saved)
    assert drawn["fixed"]["sequence"] == plain["sequence"]  # planned with the mean times, whatever was learned in
    cell = load_cell("toast-case-1").cell(3)
    costs = replicate(cell, plain["sequence"], Chance(), 5, 0)
    assert drawn["fixed"]["mean"] == pytest.approx(costs.mean())
    assert len(set(costs)) == 5
    assert plain["stochastic"] is None
    judged = {name: document[name] for name in ("gap", "success_percent")}
    if SEQUENCERS[method].drawn:  # it looked in drawn times, where the shortest is luck
        assert judged["success_percent"] is None
        assert document["gap"] == pytest.approx(document["cost"] / 513 - 1, abs=1e-9)
        assert document["cost"] >= 513 - 1e-6  # by the mean times
        assert document["luckiest_cost"] == min(document["episode_costs"])
        assert document["episode_costs"] != plain["episode_costs"]
    else:
        assert judged == {name: plain[name] for name in judged}
        assert document["episode_costs"] == plain["episode_costs"]


@pytest.mark.parametrize(
    ("method", "toasts", "episodes"),
    [("fifo", 5, 30), ("nearest-ready", 1, 30), ("exact", 1, 24), ("exact", 2, 6), ("exact", 5, 2)],
)
def test_who_plans_at_every_decision_is_given_fewer_episodes(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, method: str, toasts: int, episodes: int
) -> None:
    """Here 24 by parts squared, from 2 to 30."""
    for name, number in (("REPLICATIONS", 30), ("PLANNED", 24), ("FEWEST", 2)):
        monkeypatch.setattr(f"lab.production.sequencing_job.{name}", number)
    drawn = asked(lab, f"oven.toml --toasts {toasts} --method {method} --stochastic")["stochastic"]
    assert drawn["replications"] == episodes


def test_the_policy_of_a_file_plans_and_reacts(lab: Lab, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """What begins soonest first is nearest-ready; the policy that ships does better."""
    few(monkeypatch, 3)
    write_policy(folder / "soonest.json", CarriedPolicy({"delay": -1.0}))
    words = "toast --case I --toasts 4 --stochastic --method"
    own = asked(lab, f"{words} carried --policy soonest.json")
    rule, shipped = asked(lab, f"{words} nearest-ready"), asked(lab, f"{words} carried")
    assert own["sequence"] == rule["sequence"]
    assert own["stochastic"]["reacting"]["mean"] == rule["stochastic"]["reacting"]["mean"]
    assert shipped["makespan_s"] < own["makespan_s"]
    assert shipped["stochastic"]["reacting"]["mean"] < own["stochastic"]["reacting"]["mean"]


def test_the_best_list_is_the_one_that_is_carried_out(monkeypatch: pytest.MonkeyPatch) -> None:
    few(monkeypatch, 2)
    file = load_cell("toast-case-1")
    wanted = SequencingOptions("ga", 100, sessions=4, stochastic=True)
    document, found = sequence_cell(file.cell(3), file.sequencing, wanted, file.chance())
    best = min(found, key=lambda result: result.cost)
    assert best.cost < found[-1].cost
    assert document["stochastic"]["fixed"]["sequence"] == list(best.sequence)


def test_without_spread_chance_changes_nothing(lab: Lab, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    few(monkeypatch, 3)
    (folder / "sure.toml").write_text(
        (folder / "oven.toml").read_text() + '[stochastic]\nprocessing = "normal"\nspread = 0\n'
    )
    drawn = asked(lab, "sure.toml --method srl --episodes 5 --stochastic")["stochastic"]
    assert drawn["fixed"] == {"mean": 29.0, "ci95": [29.0, 29.0], "sequence": drawn["fixed"]["sequence"]}
    assert drawn["saved_by_reacting"] == {"mean": 0.0, "ci95": [0.0, 0.0]}


def test_the_file_says_what_is_drawn(lab: Lab, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    few(monkeypatch, 3)
    come = (
        '[arrivals]\ninterval_s = 30\n[stochastic]\nprocessing = "constant"\narrivals = "exponential"\nspread = 0.2\n'
    )
    (folder / "come.toml").write_text((folder / "oven.toml").read_text() + come)
    drawn = asked(lab, "come.toml --method fifo --stochastic")["stochastic"]
    assert (drawn["processing"], drawn["arrivals"], drawn["spread"]) == ("constant", "exponential", 0.2)
    ran = lab("sequence", "come.toml", "--method", "fifo", "--stochastic")
    assert ran.out.splitlines()[4].startswith("3 drawn episodes: the list as it is ")


@pytest.mark.usefixtures("measured")
def test_the_times_of_a_task_are_drawn_as_the_thesis_has_it(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """Normal, 10 % of the mean (section 7.6): with one machine and no buffer nothing can be saved by reacting."""
    few(monkeypatch, 6)
    drawn = asked(lab, "toast --toasts 2 --method exact --stochastic")["stochastic"]
    assert (drawn["processing"], drawn["arrivals"], drawn["spread"]) == ("normal", None, 0.1)
    assert drawn["saved_by_reacting"] == {"mean": 0.0, "ci95": [0.0, 0.0]}
    costs = replicate(load_cell("oven.toml").cell(2), drawn["fixed"]["sequence"], Chance(), 6, 0)  # of the same times
    assert drawn["fixed"]["mean"] == pytest.approx(costs.mean())


@pytest.mark.parametrize(("method", "replans"), [("exact", "rollout"), ("fifo", None), ("nearest-ready", None)])
def test_several_robots_that_break_down(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, method: str, replans: str | None
) -> None:
    """The document and the lines say which method replans, and the same seed gives the same."""
    few(monkeypatch, 4)
    words = f"two-carriers --toasts 3 --method {method} --stochastic"
    drawn = asked(lab, words)["stochastic"]
    assert drawn["reacting"]["replans"] == replans
    assert (drawn["robot_breaks_every_s"], drawn["robot_repair_s"]) == (100.0, 60.0)
    assert asked(lab, words)["stochastic"] == drawn
    ran = lab("sequence", *words.split())
    says = (
        "planned anew whenever something happens, by rollout" if replans else "asked" if "ready" in method else "queue"
    )
    assert says in ran.out
    assert "robots in order for 100 s on average, repaired for 60 s" in ran.out
