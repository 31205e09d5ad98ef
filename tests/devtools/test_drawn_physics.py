"""The harness's part `physics`: what is drawn, one that is refused before any work, and what counts as broken."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from devtools.commands import Ended
from devtools.drawn_cells import drawn_cell
from devtools.drawn_features import FEATURES
from devtools.drawn_parts import MESHES, SOLIDS
from devtools.drawn_physics import FORCE_N, MASS_KG, MOVED_M, SHIPPED, SPEED_M_S, TASKS, attempt, varied_task, verdict
from lab.tasks.robot_fields import MODELS
from lab.tasks.task_file import find, task_of_text

FMS = SHIPPED * TASKS.index("fms-arm")

NOT_HELD = "lab: robot.grip_force_n = 1: slice of 2 kg, friction 0.1, would slip\n"


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("seed", range(4))
def test_what_is_drawn_is_in_the_task(name: str, seed: int) -> None:
    text = find(name).read_text(encoding="utf-8")
    own, other = tomllib.loads(text), tomllib.loads(varied_task(text, np.random.default_rng(seed)))
    assert SPEED_M_S[0] <= other["robot"]["speed_m_s"] <= SPEED_M_S[1]
    assert other["robot"].get("grip_force_n", FORCE_N[0]) <= FORCE_N[1]
    assert all(MASS_KG[0] <= part["mass_kg"] <= MASS_KG[1] for part in other["parts"])
    assert other["parts"][0]["mass_kg"] != own["parts"][0]["mass_kg"]
    for here, there in zip(own["stations"], other["stations"], strict=True):
        assert there["pose"] == pytest.approx(here["pose"], abs=MOVED_M + 0.08)


def test_one_that_cannot_be_carried_is_refused_before_any_work(
    tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slippery pallets in a hurry: a rook would slide off."""
    monkeypatch.setenv("PYTHONPATH", str(root))
    outcome = attempt(FMS, 1001, tmp_path)
    assert (outcome.group, outcome.broke) == ("refused", "")
    assert "acceleration_m_s2 = 3.77: rook on pallet would slide: friction 0.1" in outcome.case


@pytest.mark.parametrize("form", [*SOLIDS, *MESHES])
def test_what_a_part_looks_like_is_a_closed_solid_as_narrow_as_asked(form: str) -> None:
    mesh: trimesh.Trimesh = (SOLIDS | MESHES)[form](np.random.default_rng(0), 0.03)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert mesh.extents[1] <= 0.03 + 1e-9


@pytest.mark.slow
def test_new_cells_are_task_files_and_have_each_arm_form_and_feature(tmp_path: Path) -> None:
    seen: set[str] = set()
    for seed in range(60):
        folder = tmp_path / str(seed)
        folder.mkdir()
        text, words = drawn_cell(np.random.default_rng(seed), folder)
        task = task_of_text(folder / "drawn.toml", text)
        assert all((folder / part.file).is_file() for part in task.parts if part.file)
        seen |= set(words.split(", "))
    assert seen >= {*MODELS, *SOLIDS, *MESHES, *FEATURES}


def test_a_seed_draws_the_same_cell(tmp_path: Path) -> None:
    one, other = (drawn_cell(np.random.default_rng(3), tmp_path) for _ in range(2))
    assert one == other


def ended(code: int, stderr: str = "", **document: object) -> Ended:
    return Ended(code, json.dumps({"parts": {"slice": 2}, "failure": None, **document}), stderr, 1.0, 0)


@pytest.mark.parametrize(
    ("ran", "check", "counts"),
    [
        (ended(0, delivered=2), ended(0), ("delivered", "")),
        (ended(1, "lab: slice 2 is lost\n", delivered=1, failure="slice 2 is lost"), ended(0),
         ("broke", "1 of 2 delivered: slice 2 is lost")),
        (ended(1, "lab: it fell\n", error="it fell"), ended(0), ("broke", "it fell")),
        (ended(2, NOT_HELD), ended(2, NOT_HELD), ("refused", "")),
        (ended(2, NOT_HELD), ended(0), ("refused", f"refused, but the check said otherwise: {NOT_HELD.strip()}")),
        (ended(-9), ended(0), ("broke", "exit -9, allowed 0, 1, 2, 130: ")),
    ],
)  # fmt: skip
def test_what_a_drawn_run_counts_as(ran: Ended, check: Ended, counts: tuple[str, str]) -> None:
    assert verdict(ran, lambda: check) == counts
