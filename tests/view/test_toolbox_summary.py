"""What `lab toolbox` shows, from its JSON documents."""

from io import StringIO
from typing import Any

from rich.console import Console, RenderableType

from lab.view.toolbox_summary import log_summary, policy_summary, toolbox_summary, verify_summary


def shown(what: RenderableType, width: int = 120) -> list[str]:
    console = Console(file=StringIO(), width=width, color_system=None, highlight=False)
    console.print(what)
    assert isinstance(console.file, StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


EVENTS: list[dict[str, Any]] = [
    {
        "time": "2026-01-02T03:04:05",
        "what": "learned",
        "version": 3,
        "hash": "444455556666",
        "in_use": True,
        "solved": True,
    },
    {
        "time": "2026-01-02T04:04:05",
        "what": "learned",
        "version": 4,
        "hash": "7777",
        "why_not": "it is worse",
        "solved": None,
    },
]


def test_a_log() -> None:
    assert shown(log_summary({"name": "x", "events": []})) == ["nothing happened yet"]
    assert shown(log_summary({"name": "x", "events": EVENTS})) == [
        "2026-01-02 03:04  learned version 3 (444455556666): solved yes",
        "2026-01-02 04:04  learned version 4 (7777): kept beside: it is worse, solved none",
    ]


POLICY: dict[str, Any] = {
    "name": "insert 1a2b",
    "subtask": "insert",
    "task": "toast",
    "solved": True,
    "signature": "1a2b",
    "created": "2026-01-02T03:04:05.678+00:00",
    "curve": [9, 5, 4],
    "guided": [False, True, True],
    "learner": {"learner": "q", "alpha": 0.5},
    "gate": {"gate": "never"},
    "versions": {"numpy": "2"},
    "action_labels": ("up", "down"),
    "shape": (2, 3),
    "version": 3,
    "lineage": [
        {"name": "insert old", "hash": "aaaabbbbcccc", "scene": "toast", "kept": True},
        {"name": "insert first", "hash": "ddddeeeeffff", "scene": "", "kept": False},
    ],
    "kept_versions": [
        {"version": 2, "hash": "111122223333", "saved": None, "in_use": False, "bytes": 1000},
        {"version": 3, "hash": "444455556666", "saved": "2026-01-02T03:04:05", "in_use": True, "bytes": 20000},
    ],
    "kept_bytes": 21000,
    "events": EVENTS,
}


def test_a_toolbox() -> None:
    assert shown(toolbox_summary({"folder": "/box", "policies": []})) == ["nothing in /box"]
    assert shown(toolbox_summary({"folder": "/box", "policies": [POLICY, POLICY | {"solved": False}]})) == [
        "name         subtask  task   solved  version  signature  created",
        "insert 1a2b  insert   toast  yes     3        1a2b       2026-01-02 03:04",
        "insert 1a2b  insert   toast  no      3        1a2b       2026-01-02 03:04",
    ]


def test_a_policy() -> None:
    lines = [" ".join(line.split()) for line in shown(policy_summary(POLICY))]
    assert "learner learner q, alpha 0.5" in lines
    assert "guided 2 episodes, the first 2, the last 3" in lines
    assert "action labels up, down" in lines
    assert "shape 2, 3" in lines
    assert any(line.startswith("curve █") and line.endswith("4 to 9 steps") for line in lines)
    assert lines[-8:-2] == [
        "warm-started from insert old@aaaabbbbcccc, learned in toast",
        "warm-started from insert first@ddddeeeeffff, not kept here",
        "",
        "2 versions kept, 0.02 MB",
        "2 111122223333",
        "3 444455556666 2026-01-02 03:04 in use",
    ]
    fresh = [" ".join(line.split()) for line in shown(policy_summary(POLICY | {"curve": [], "guided": []}))]
    assert "guided 0 episodes" in fresh


def test_a_verified_toolbox() -> None:
    rows = [{"file": "/box/a", "ok": True, "reason": ""}, {"file": "/box/b", "ok": False, "reason": "/box/b: cut off"}]
    assert shown(verify_summary({"folder": "/box", "files": rows, "damaged": 1})) == [
        "1 of 2 files in /box are sound",
        "/box/b: cut off",
    ]


def test_a_long_name_is_whole_in_a_narrow_list() -> None:
    name = "transfer-plate-to-insert-with-slice-and-lid"
    row = {"name": name, "subtask": "transfer plate to insert", "task": "toast", "solved": True, "version": 1}
    box = {"folder": "box", "policies": [row | {"signature": 16 * "f", "created": "2026-01-02T03:04:05"}]}
    assert any(line.startswith(name) for line in shown(toolbox_summary(box), 80))
