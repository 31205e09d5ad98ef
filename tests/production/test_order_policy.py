"""Policies of sequencing: kept under a name or in a file, used in another cell, begun with, and what is refused."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lab as the_lab
from lab.production.order_policy import RECORDS
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.tasks.sequencing import policy_record, read_policy, write_policy
from lab.toolbox.registry import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
LEARN = "toast-case-1 --toasts 4 --method srl-linear --episodes 60"


def asked(lab: Lab, words: str) -> dict[str, Any]:
    ran = lab("sequence", *words.split(), "--json")
    assert ran.code == 0, ran.err
    document: dict[str, Any] = ran.json
    return document


@pytest.mark.slow
def test_a_policy_is_kept_by_name_and_decides_in_another_cell(lab: Lab, folder: Path) -> None:
    learned = asked(lab, f"{LEARN} --keep-policy toasts --toolbox box")
    assert Path(learned["policy_kept"]).is_relative_to(folder / "box") or learned["policy_kept"].startswith("box")
    assert Toolbox("box").record_keys(RECORDS) == ["toasts"]
    assert learned["policy"]["learned_on"] == "4 parts (toast); --method srl-linear --episodes 60 --seed 0"
    (folder / "same.json").write_text(json.dumps(learned["policy"]))
    by_name = asked(lab, "toast-case-1 --toasts 9 --method policy:toasts --toolbox box")
    by_file = asked(lab, "toast-case-1 --toasts 9 --method policy:same.json")
    carried = asked(lab, "toast-case-1 --toasts 9 --method carried --policy toasts --toolbox box")
    assert by_name["sequence"] == by_file["sequence"] == carried["sequence"]
    assert (by_name["method"], by_name["episodes"]) == ("carried", 1)
    assert by_name["cost"] >= by_name["bound_cost"]
    assert all(sound for _, sound, _ in Toolbox("box").verify())


@pytest.mark.slow
def test_learning_goes_on_from_a_policy(lab: Lab, folder: Path) -> None:
    """Its own run is the first episode; what is learned on is kept in place of it."""
    asked(lab, f"{LEARN} --keep-policy one.json")
    first = asked(lab, "toast-case-1 --toasts 9 --method policy:one.json")
    on = asked(
        lab, "toast-case-1 --toasts 9 --method srl-linear --episodes 60 --policy one.json --keep-policy one.json"
    )
    assert on["episode_costs"][0] == first["cost"]
    assert read_policy(folder / "one.json").learned_on.startswith("9 parts (toast)")


def test_practice_is_written_down(lab: Lab, folder: Path) -> None:
    found = asked(lab, f"{LEARN} --practice toast-case-2,toast-case-3")
    assert found["policy"]["learned_on"].startswith("4 parts (toast) and 2 practice cells; ")
    assert found["policy_kept"] is None
    assert not (folder / "box").exists()


def test_what_was_learned_reacts(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("REPLICATIONS", "FEWEST"):
        monkeypatch.setattr(f"lab.production.sequencing_job.{name}", 3)
    found = asked(lab, f"{LEARN} --stochastic")["stochastic"]
    assert (found["reacting"]["replans"], found["replications"]) == (None, 3)


def test_in_python(folder: Path) -> None:
    learned = the_lab.sequence(
        "toast-case-1", toasts=4, method="srl-linear", episodes=60, keep_policy="t", toolbox="box"
    )
    used = the_lab.sequence("toast-case-2", toasts=6, method="policy:t", toolbox="box")
    assert learned.document["policy"]["weights"]
    assert used.cost >= used.bound
    by_cell = the_lab.sequence(used.cell, method="policy:t", toolbox="box")
    assert by_cell.document["sequence"] == used.document["sequence"]


def test_a_search_that_is_stopped_keeps_nothing(lab: Lab, folder: Path) -> None:
    found = asked(lab, f"{LEARN} --gap 100 --keep-policy one.json")
    assert (found["stopped_by"], found["policy"], found["policy_kept"]) == ("gap", None, None)
    assert not (folder / "one.json").exists()
    ran = lab("sequence", *f"{LEARN} --gap 100".split())
    assert "the search was stopped before a policy was learned" in ran.out


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            "fms --method policy:toats",
            "unknown policy 'toats' (--method, toolbox box): did you mean 'toasts'? known: other, toasts",
        ),
        (
            "fms --method policy:toats --toolbox no",
            "unknown policy 'toats' (--method): toolbox no has no policy of sequencing",
        ),
        ("fms --method policy:", "--method policy:: no policy: wanted policy:NAME"),
        (
            "fms --method policy:toasts --policy one.json",
            "--policy one.json beside --method policy:toasts: the method names",
        ),
        (
            "fms --method policy:other",
            "policy 'other' (--method): unknown feature 'dely' (policy): did you mean 'delay'?",
        ),
        (
            "fms --method policy:other.json",
            "policy other.json (--method): unknown feature 'dely' (policy): did you mean",
        ),
        ("fms --method policy:no.json", "no.json: cannot be read: "),
        ("fms --method srl --keep-policy x", "--keep-policy x with --method srl: only srl-linear learns a policy"),
        ("fms --method srl --practice fms", "--practice fms with --method srl: only srl-linear learns a policy"),
        ("fms --method srl-linear --practice fsm", "unknown task 'fsm' (TASK): did you mean 'fms'? known: "),
        ("fms --method srl-linear --practice world-1", "world-1: wanted an instance file or a cell"),
        (
            "fms --method srl-linear --keep-policy no/x.json",
            "policy file 'no/x.json' (--keep-policy): there is no folder 'no'",
        ),
        ("fms --cyclic --keep-policy x", "--cyclic beside --keep-policy x: "),
    ],
)
def test_what_is_refused_at_once(lab: Lab, folder: Path, words: str, line: str) -> None:
    box, held = Toolbox("box"), policy_record(CarriedPolicy({"delay": -1.0}))
    box.save_record(RECORDS, "toasts", held)
    box.save_record(RECORDS, "other", held | {"weights": {"dely": 1.0}})
    write_policy(folder / "one.json", CarriedPolicy({"delay": -1.0}))
    (folder / "other.json").write_text(json.dumps(held | {"weights": {"dely": 1.0}}))
    ran = lab("sequence", *words.split(), *([] if "--toolbox" in words else ["--toolbox", "box"]))
    assert (ran.code, ran.gave_nothing) == (2, True)
    assert line in ran.err
    assert re.fullmatch(r"lab: .*\n", ran.err), "one line"
