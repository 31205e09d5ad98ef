"""The harness's part `proofs`: one drawn cell, and what is written of one that the oracle beats."""

from dataclasses import replace
from pathlib import Path

import pytest
from against_oracle.compared import Compared, compared
from against_oracle.drawn import Raw, drawn

from devtools import proofs
from devtools.parts import Outcome


def test_a_cell_of_which_all_holds(tmp_path: Path) -> None:
    assert (outcome := proofs.attempt(2, 1, tmp_path)).broke == ""
    assert outcome.group in ("agrees", "not proven by the oracle")
    assert [*tmp_path.iterdir()] == []


def test_a_cell_that_is_beaten_is_written_as_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the lab proves: here it is said of a cell that it is beaten."""

    def beaten(raw: Raw, *given: object) -> Compared:
        return replace(compared(raw, ()), wrong=(("proven is beaten", "exact", "proven 9, a plan of 8"),))

    monkeypatch.setattr(proofs, "compared", beaten)
    monkeypatch.setattr(proofs, "least", lambda raw, kind, methods: beaten(raw))
    outcome = proofs.attempt(2, 1, tmp_path)
    assert isinstance(outcome, Outcome)
    assert "exact: proven 9, a plan of 8" in outcome.broke
    assert outcome.group.startswith("proven is beaten: ")
    assert drawn(1, 2)["name"] in (tmp_path / "2.toml").read_text(encoding="utf-8")
