"""A card tells a policy's life in Markdown, and its Python lines run."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.toolbox.card import Telling, card, last_evaluation, plain, python_lines, since
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode

EVALUATED: dict[str, Any] = {
    "time": "2026-05-03T09:08:07.123+00:00",
    "what": "evaluated",
    "version": 2,
    "hash": "1a2b3c4d5e6f",
    "skill": "insert at toaster",
    "task": "toast",
    "seed": 7,
    "scenes": 20,
    "successes": 17,
    "success_percent": 85.0,
    "ci95": [64.0, 94.8],
    "mean_sim_s": 8.0,
}
LEARNED = {"time": "2026-05-01T12:00:00.000+00:00", "what": "learned", "version": 2, "in_use": True, "episodes": 4}


@pytest.fixture
def learned(make_policy: Callable[..., Policy]) -> Policy:
    """In a row of three cells the right end is the goal: two steps."""
    table = np.array([[0.1, 0.8], [0.2, 1.5], [0.0, 0.0]])
    visits = np.array([[2, 5], [1, 4], [0, 0]], dtype=np.int64)
    return make_policy(
        name="insert_it",
        q=table,
        visits=visits,
        shape=(3,),
        learner={"learner": "q", "alpha": 0.95, "max_steps": 20},
        curve=[21, 9, 2, 2],
        guided=[False, True, False, False],
        optimal_steps=2,
        final_steps=2,
    )


def telling(**changed: Any) -> Telling:
    given = {
        "what": "down into the slot",
        "sha256": "ab" * 32,
        "file": "model.safetensors",
        "bring_in": "lab import it",
    }
    return Telling(**(given | changed))


def test_it_tells_what_was_learned_where_and_how(learned: Policy) -> None:
    text = card(learned, telling(pictures={"learning curve": "c.png", "value map": "v.png"}))
    assert text.startswith("# insert_it\n\nDown into the slot.\n")
    for line in (
        "| sub-task | insert |",
        "| states | 3, a grid of 3 |",
        "| actions | 2: left, right |",
        "| learned in | toast, seed 0 |",
        "| its path | 2 steps, the shortest takes 2: solved |",
        "| learner | q, alpha 0.95, max_steps 20 |",
        "| gate (when it asks) | ccrl |",
        "| advisor | expert: asked in 1 episode of 4, 3 helped steps |",
        "| warm-started from | nothing: it was learned from the beginning |",
        "| created | 2026-05-01 12:00 UTC with numpy 2.0 |",
        f"| SHA-256 of its file | {'ab' * 32} |",
        "![learning curve: steps of each episode](c.png)",
        "4 episodes, 1 of them guided by the advisor: 21, 9, 2, 2 steps. One that is broken off after 20 counts as 21.",
        "Nothing is noted of it since it was learned.",
        "lab import it",
        "- It was not evaluated in other scenes yet: lab toolbox evaluate does that.",
    ):
        assert f"{line}\n" in text, line
    assert "](v.png)" in text
    assert "It has visited 2 of 3 states." in text


def test_it_tells_of_one_that_came_from_another_and_reaches_nothing(make_policy: Callable[..., Policy]) -> None:
    lost = make_policy(
        shape=(),
        solved=False,
        final_steps=None,
        helped_steps=0,
        parent="insert@1a2b",
        scene="three cubes",
        advisor="none",
    )
    text = card(lost, telling())
    for line in (
        "| its path | it does not reach the goal, the shortest takes 3: not solved |",
        "| warm-started from | insert@1a2b |",
        "| learned in | toast, three cubes, seed 0 |",
        "| states | 4 |",
        "| advisor | none: no step was helped |",
        "Its states are no grid, so that there is no map of them.",
        "- It is not solved: see its path above.",
    ):
        assert f"{line}\n" in text, line
    assert "![" not in text


def test_it_tells_how_it_did_since() -> None:
    assert since([LEARNED, EVALUATED, {"time": "2026-05-04", "what": "used", "in": "lab run"}]).splitlines() == [
        "- 2026-05-01 12:00, version 2: learned: in use, episodes 4",
        "- 2026-05-03 09:08, version 2: evaluated in physics in 20 drawn scenes of toast from seed 7: "
        "17 succeeded, 85 % (95 % interval 64 to 95)",
        "- 2026-05-04: used: in lab run",
    ]
    many = since([LEARNED] * 25).splitlines()
    assert (len(many), many[0]) == (21, "- 5 earlier events")


def test_the_last_evaluation_counts(learned: Policy) -> None:
    later = EVALUATED | {"success_percent": 50.0}
    assert last_evaluation([EVALUATED, later, LEARNED]) == later
    assert last_evaluation([LEARNED, EVALUATED | {"success_percent": None}]) is None
    assert "was not evaluated" not in card(learned, telling(events=[later]))


def test_its_five_lines_of_python_run(learned: Policy, tmp_path: Path) -> None:
    (tmp_path / "model.safetensors").write_bytes(encode(learned))
    lines = python_lines(learned, "model.safetensors")
    assert len(lines.splitlines()) == 5
    assert f"```python\n{lines}\n```" in card(learned, telling())
    ran = subprocess.run([sys.executable, "-c", lines], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert ran.stdout == "right\n"


def test_a_strangers_words_are_no_mark_up() -> None:
    assert plain("a|b <script> [x](y) `c` *d*\n# e") == r"a\|b \<script\> \[x\](y) \`c\` \*d\*\\n# e"


@given(st.text(max_size=60))
def test_plain_text_is_one_line_without_bare_signs(text: str) -> None:
    shown = plain(text)
    assert shown.isprintable()
    for sign in "`*<>|[]&":
        assert shown.count(sign) == shown.count(f"\\{sign}")
