"""The search that a file asks for."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.methods.carried_over_policy import FEATURES, CarriedPolicy
from lab.sequencing.search import Search, SrlSettings
from lab.tasks.sequencing import FORMAT, read_policy, search_for, write_policy
from lab.tasks.task_file import load_cell


def test_a_search_as_the_file_says_or_changed() -> None:
    settings = load_cell("toast-case-2").sequencing.model_copy(
        update={"episodes": 7, "alpha": 0.2, "discount": 0.8, "beta": 2.0, "reward_factor": "A", "state": "stations"}
    )
    srl = SrlSettings(0.2, 0.8, 2.0, "A", "pairs", "stations")
    assert search_for(settings) == Search(7, "makespan", NO_CHANCE, srl)
    changed = search_for(settings, episodes=3, objective="robot-idle", chance=Chance())
    assert changed == Search(3, "robot-idle", Chance(), srl)


# ---- carried policy ---------------------------------------------------------------------------------------------------


POLICY = CarriedPolicy({"delay": -1.5, "tail": 0.25}, "mean-tardiness", "three toasts")
HELD = {"format": FORMAT, "weights": {"delay": -1.5, "tail": 0.25}, "objective": "makespan", "learned_on": ""}


@given(
    weights=st.dictionaries(st.sampled_from([*FEATURES]), st.floats(-1e6, 1e6)),
    said=st.text(st.characters(exclude_categories=["Cs"])),
)
def test_it_is_read_as_it_was_written(
    tmp_path_factory: pytest.TempPathFactory, weights: dict[str, float], said: str
) -> None:
    path = tmp_path_factory.mktemp("policies") / "policy.json"
    policy = CarriedPolicy(weights, learned_on=said)
    write_policy(path, policy)
    first = path.read_bytes()
    assert read_policy(path) == policy
    write_policy(path, policy)
    assert path.read_bytes() == first


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "Invalid JSON"),
        ("{", "Invalid JSON"),
        ("[]", "Input should be an object"),
        (json.dumps(HELD)[:-9], "Invalid JSON"),
        (json.dumps(HELD | {"format": "carried-policy-0"}), "format: Input should be 'carried-policy-1'"),
        (json.dumps(HELD | {"weights": {"delay": "much"}}), "weights.delay: Input should be a valid number"),
        (json.dumps(HELD | {"weights": {"delay": float("inf")}}), "weights.delay: Input should be a finite number"),
        (json.dumps(HELD | {"weights": {"dely": 1.0}}), "unknown feature 'dely'"),
        (json.dumps(HELD | {"objective": "beauty"}), "unknown objective 'beauty'"),
        (json.dumps(HELD | {"more": 1}), "more: Extra inputs are not permitted"),
        (json.dumps({"format": FORMAT}), "weights: Field required"),
    ],
)
def test_what_is_damaged_is_told_in_a_line(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "policy.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput) as told:
        read_policy(path)
    assert str(told.value).startswith(f"policy {path} (--policy): {says}")
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("content", [b"\xff\xfe", None])
def test_what_cannot_be_read(tmp_path: Path, content: Any) -> None:
    path = tmp_path / "policy.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadInput, match=rf"^{path}: cannot be read: "):
        read_policy(path)
