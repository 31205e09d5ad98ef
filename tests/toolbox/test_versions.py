"""Versions of a name: which one is in use, what is kept beside, and the way back."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput, WorkFailed
from lab.files import read_limited
from lab.toolbox import folder_place
from lab.toolbox.names import hash_of
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode
from lab.toolbox.registry import Toolbox
from lab.toolbox.versions import does_worse, event, in_use_before, line_of, read_events, success_percents

MakePolicy = Callable[..., Policy]
KILLS = 10
EACH = 100  # saves of each of two writers


@pytest.fixture
def box(tmp_path: Path) -> Toolbox:
    return Toolbox(tmp_path / "box")


def in_use(box: Toolbox, name: str = "insert") -> float:
    current = box.versions(name).in_use()
    assert current is not None
    return float(current.policy.q[0, 0])


@pytest.mark.parametrize(
    ("new", "old", "percents", "why"),
    [
        ({}, {}, (None, None), ""),
        ({"solved": False}, {}, (99.0, 1.0), "the one in use is solved"),
        ({}, {"solved": False}, (1.0, 99.0), ""),
        ({}, {}, (80.0, 95.0), "the one in use succeeds in 95 %, it in 80 %"),
        ({"final_steps": 9}, {}, (95.0, 80.0), ""),
        ({"final_steps": 9}, {}, (95.0, None), "the one in use takes 3 steps, it takes 9 steps"),
        ({"final_steps": 9}, {}, (80.0, 80.0), "the one in use takes 3 steps, it takes 9 steps"),
        ({"final_steps": None}, {}, (None, None), "the one in use takes 3 steps, it does not reach the goal"),
        ({"final_steps": None}, {"final_steps": None}, (None, None), ""),
        ({"final_steps": 9}, {"signature": "f" * 16}, (1.0, 99.0), ""),  # another problem: they cannot be compared
        ({"final_steps": 6, "optimal_steps": 6}, {"final_steps": 4, "optimal_steps": 3}, (None, None), ""),
    ],
)
def test_what_does_worse(
    make_policy: MakePolicy,
    new: dict[str, object],
    old: dict[str, object],
    percents: tuple[float | None, float | None],
    why: str,
) -> None:
    assert does_worse(make_policy(**new), make_policy(**old), *percents) == why


def test_what_does_worse_is_kept_beside_and_said(box: Toolbox, make_policy: MakePolicy) -> None:
    first = box.put(make_policy(1.0, final_steps=5))
    worse = box.put(make_policy(2.0, final_steps=7))
    assert (first.file, first.version, first.in_use) == ("insert.safetensors", 1, True)
    assert (worse.file, worse.version, worse.in_use) == (f"versions/insert/0002-{worse.hash}.safetensors", 2, False)
    assert worse.why_not == "the one in use takes 5 steps, it takes 7 steps"
    assert (
        box.save(make_policy(3.0, final_steps=7))
        == box.folder / f"versions/insert/0003-{hash_of(encode(make_policy(3.0, final_steps=7)))}.safetensors"
    )
    assert in_use(box) == 1.0
    better = box.put(make_policy(4.0, final_steps=4))
    assert (better.in_use, in_use(box)) == (True, 4.0)
    told = [(event["what"], event["version"], event["in_use"]) for event in box.log("insert")]
    assert told == [("learned", 1, True), ("learned", 2, False), ("learned", 3, False), ("learned", 4, True)]
    assert box.log("insert")[1]["why_not"] == worse.why_not


def test_what_was_evaluated_is_compared_by_that(box: Toolbox, make_policy: MakePolicy) -> None:
    shaky, steady = box.put(make_policy(1.0, final_steps=3)), box.put(make_policy(2.0, final_steps=9))
    box.note("insert", "evaluated", hash=shaky.hash, success_percent=40)
    box.note("insert", "evaluated", hash=steady.hash, success_percent=100)
    assert in_use(box) == 1.0
    assert box.put(make_policy(2.0, final_steps=9)).in_use
    assert (in_use(box), box.put(make_policy(1.0, final_steps=3)).why_not) == (
        2.0,
        "the one in use succeeds in 100 %, it in 40 %",
    )


def test_the_same_is_not_kept_twice(box: Toolbox, make_policy: MakePolicy) -> None:
    for _ in range(3):
        assert box.put(make_policy(1.0)).version == 1
    assert len(box.log("insert")) == 1
    assert [row["version"] for row in box.show("insert")["kept_versions"]] == [1]


def test_how_it_was_learned_is_told(box: Toolbox, make_policy: MakePolicy) -> None:
    box.save(make_policy(1.0, curve=[9, 5], guided=[False, True]))
    box.save(make_policy(2.0, curve=[9, 5, 4], guided=[False, True, True]))
    box.save(make_policy(3.0, curve=[8], guided=[True]))
    box.save(make_policy(4.0, parent="grasp@0123456789ab", scene="toast, cubes A moved"))
    told = [(event["what"], event.get("parent"), event.get("scene")) for event in box.log("insert")]
    warm = ("warm-started", "grasp@0123456789ab", "toast, cubes A moved")
    assert told == [("learned", None, None), ("continued", None, None), ("learned", None, None), warm]


def test_promote_and_rollback(box: Toolbox, make_policy: MakePolicy) -> None:
    saved = [box.put(make_policy(number, final_steps=10 - number)) for number in range(3)]
    with pytest.raises(BadInput, match=r"no version '9'; there are: 1 \("):
        box.promote("insert", "9")
    with pytest.raises(BadInput, match="no version ''"):
        box.promote("insert", "")
    assert box.promote("insert", "1").hash == saved[0].hash
    assert in_use(box) == 0.0
    assert box.promote("insert", saved[2].hash[:6].upper()).number == 3
    assert [in_use(box), *(box.rollback("insert").number for _ in range(3)), in_use(box)] == [2.0, 1, 3, 2, 1.0]
    box.rollback("insert")
    with pytest.raises(BadInput, match=r"insert.safetensors: nothing was in use before"):
        box.rollback("insert")
    assert {row["version"]: row["in_use"] for row in box.show("insert")["kept_versions"]} == {
        1: True,
        2: False,
        3: False,
    }


def test_a_damaged_version_is_never_put_in_use(box: Toolbox, make_policy: MakePolicy) -> None:
    first = box.put(make_policy(1.0))
    box.save(make_policy(2.0))
    path = box.folder / f"versions/insert/0001-{first.hash}.safetensors"
    whole = path.read_bytes()
    path.write_bytes(encode(make_policy(5.0)))  # sound, but another one
    uses: tuple[Callable[[], object], ...] = (lambda: box.promote("insert", "1"), lambda: box.rollback("insert"))
    for use in uses:
        with pytest.raises(BadInput, match=r"0001-.*its hash is .*: damaged"):
            use()
    assert in_use(box) == 2.0
    assert [(where, ok) for where, ok, _ in box.verify()] == [(box.folder / "insert.safetensors", True), (path, False)]
    box.save(make_policy(1.0))  # learned again, it is whole again
    assert path.read_bytes() == whole
    assert all(ok for _, ok, _ in box.verify())


def test_other_bytes_of_the_same_hash_are_refused(
    box: Toolbox, make_policy: MakePolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.toolbox.versions.hash_of", lambda content: "0" * 12)
    box.save(make_policy(1.0))
    with pytest.raises(WorkFailed, match="it has the same hash and other bytes"):
        box.save(make_policy(2.0))
    assert in_use(box) == 1.0


def test_a_toolbox_from_before_versions_goes_on(box: Toolbox, make_policy: MakePolicy) -> None:
    box.folder.mkdir()
    (box.folder / "insert.safetensors").write_bytes(encode(make_policy(1.0)))
    (row,) = box.list()
    assert (row["version"], row["hash"]) == (1, hash_of(encode(make_policy(1.0))))
    assert [ok for _, ok, _ in box.verify()] == [True]
    assert (box.show("insert")["kept_versions"], box.log("insert")) == ([], [])
    box.save(make_policy(2.0))
    assert [(event["what"], event["version"]) for event in box.log("insert")] == [("found", 1), ("learned", 2)]
    assert (box.rollback("insert").number, in_use(box)) == (1, 1.0)


def test_a_damaged_one_in_use_is_replaced_and_its_versions_stay(box: Toolbox, make_policy: MakePolicy) -> None:
    path = box.save(make_policy(1.0, final_steps=3))
    path.write_bytes(path.read_bytes()[:-1])
    assert box.put(make_policy(2.0, final_steps=9)).in_use
    assert box.promote("insert", "1").number == 1
    assert in_use(box) == 1.0


def test_one_that_may_not_be_read_is_not_replaced(
    box: Toolbox, make_policy: MakePolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    box.save(make_policy(1.0))
    plain = read_limited

    def refuse(path: Path, most: int) -> bytes:
        if path.name == "insert.safetensors":
            raise OSError(5, "Input/output error")
        return plain(path, most)

    with monkeypatch.context() as patch:
        patch.setattr(folder_place, "read_limited", refuse)
        with pytest.raises(BadInput, match=r"policy file .*insert.safetensors: Input/output error"):
            box.save(make_policy(2.0, final_steps=9))
    assert in_use(box) == 1.0


def test_a_file_that_is_none_of_its_versions_is_reported(box: Toolbox, make_policy: MakePolicy) -> None:
    path = box.save(make_policy(1.0))
    path.write_bytes(encode(make_policy(2.0)))
    assert box.verify() == [(path, False, f"policy file {path}: it is none of the kept versions: it was changed")]
    box.save(make_policy(3.0))
    assert [version.number for version in box.versions("insert").kept().values()] == [1, 2, 3]
    assert all(ok for _, ok, _ in box.verify())


def test_remove_and_restore(box: Toolbox, make_policy: MakePolicy) -> None:
    with pytest.raises(BadInput, match=r"unknown removed policy 'insert' \(toolbox .*known: none"):
        box.restore("insert")
    path = box.save(make_policy(1.0))
    assert box.remove("insert") == path
    assert not path.exists()
    assert [event["what"] for event in box.log("insert")] == ["learned", "removed"]
    assert (box.restore("insert"), in_use(box)) == (path, 1.0)
    box.remove("insert")
    box.save(make_policy(2.0))
    with pytest.raises(BadInput, match=r"one is in use; promote chooses among its versions"):
        box.restore("insert")
    box.remove("insert")
    assert box.rollback("insert").number == 2  # what was in use before
    with pytest.raises(BadInput, match=r"unknown removed policy '../insert'"):
        box.restore("../insert")


def test_notes(box: Toolbox, make_policy: MakePolicy) -> None:
    saved = box.put(make_policy(1.0))
    box.note("insert", "used", run="toast", succeeded=True)
    note = box.log("insert")[-1]
    assert {**note, "time": ""} == {
        "time": "",
        "what": "used",
        "version": 1,
        "hash": saved.hash,
        "run": "toast",
        "succeeded": True,
    }
    with pytest.raises(BadInput, match="unknown policy 'grasp'"):
        box.note("grasp", "used")
    log = box.folder / "log" / "insert.jsonl"
    log.write_bytes(b"{half a li\n" + log.read_bytes())
    assert [event["what"] for event in box.log("insert")] == ["learned", "used"]
    assert [(where, reason) for where, ok, reason in box.verify() if not ok] == [(log, f"log {log}: damaged lines: 1")]


def test_lineage(box: Toolbox, make_policy: MakePolicy) -> None:
    first = box.put(make_policy(1.0, name="Old one", scene="toast", parent="lost@aaaabbbbcccc"))
    second = box.put(make_policy(2.0, name="second", scene="moved", parent=f"Old one@{first.hash}"))
    box.put(make_policy(3.0, name="third", parent=f"second@{second.hash}"))
    assert box.show("third")["lineage"] == [
        {"name": "second", "hash": second.hash, "scene": "moved", "kept": True},
        {"name": "Old one", "hash": first.hash, "scene": "toast", "kept": True},
        {"name": "lost", "hash": "aaaabbbbcccc", "scene": "", "kept": False},
    ]
    assert box.show("Old one")["lineage"] == box.show("third")["lineage"][2:]


def run(root: Path, *words: str) -> "subprocess.Popen[str]":
    """A script of its own process, which has one thread only and may be forked."""
    command = [sys.executable, str(root / "tests" / "toolbox" / "writing.py"), *words]
    return subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": str(root)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def ended(process: "subprocess.Popen[str]") -> str:
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    return out


def test_two_processes_write_at_once_and_nothing_is_lost(box: Toolbox, root: Path) -> None:
    writers = [run(root, "save", str(box.folder), str(seed), str(EACH), "5") for seed in (1, 2)]
    told = [entry.split("@") for writer in writers for entry in json.loads(ended(writer))]
    assert len(told) == 2 * EACH
    for name in {name for name, _ in told}:
        versions = box.versions(name)
        kept, saved = versions.kept(), {digits for other, digits in told if other == name}
        assert kept.keys() == saved == {event["hash"] for event in box.log(name)}
        assert [version.number for version in kept.values()] == list(range(1, len(kept) + 1))
        best = min((not policy.solved, policy.final_steps) for policy in map(versions.read, kept.values()))
        current = versions.in_use()
        assert current is not None
        assert (not current.policy.solved, current.policy.final_steps) == best
    assert all(ok for _, ok, _ in box.verify())


def test_killed_at_any_moment_nothing_is_lost_or_damaged(box: Toolbox, root: Path) -> None:
    kills = os.environ.get("LAB_KILLS", str(KILLS))
    counts = json.loads(ended(run(root, "kill", str(box.folder), kills)))
    assert counts.pop("saves") >= counts.pop("kills") == int(kills)
    assert set(counts.values()) == {0}, counts


# ---- history ----------------------------------------------------------------------------------------------------------


def put(digits: str) -> dict[str, Any]:
    return {"what": "learned", "hash": digits, "in_use": True}


def test_what_is_written_is_read_and_damaged_lines_are_numbered() -> None:
    lines = [
        line_of(event("used", runs=2)),
        b"",
        b'{"time": "now"',
        b"[1]",
        b'{"time": 1, "what": "x"}',
        b"\xff",
        b"[" * 9999,
        b'{"time": "", "what": "", "x": NaN}',
    ]
    events, damaged = read_events(lines)
    assert [(read["what"], read["runs"]) for read in events] == [("used", 2)]
    assert damaged == [3, 4, 5, 6, 7, 8]
    for fact in (float("nan"), object()):
        with pytest.raises(BadInput, match="log entry 'used'"):
            line_of(event("used", fact=fact))


def test_the_last_evaluation_of_a_version_counts() -> None:
    told = [
        ("evaluated", "a", 50),
        ("evaluated", "b", 90.5),
        ("used", "a", 1),
        ("evaluated", "a", 75),
        ("evaluated", "c", "?"),
    ]
    lines = [line_of(event(what, hash=digits, success_percent=value)) for what, digits, value in told]
    assert success_percents([*lines, b'{"evaluated"']) == {"a": 75.0, "b": 90.5}


@pytest.mark.parametrize(
    ("events", "current", "before"),
    [
        ([], None, []),
        ([], "a", []),
        ([put("a"), put("b"), put("c")], "c", ["b", "a"]),
        ([put("a"), put("a"), put("b")], "b", ["a"]),
        ([put("a"), put("b") | {"in_use": False}], "a", []),
        ([put("a"), put("b"), put("a")], "a", ["b", "a"]),
        ([put("a"), put("b"), put("a"), {"what": "rolled back", "hash": "b"}], "b", ["a"]),
        ([{"what": "rolled back", "hash": "b"}], "b", []),  # of a log whose beginning is lost
        ([put("a")], "b", ["a"]),  # a crash came before the log was written
        ([put("a"), put("b"), {"what": "removed", "hash": "b"}], None, ["b", "a"]),
    ],
)
def test_what_was_in_use_before(events: list[dict[str, Any]], current: str | None, before: list[str]) -> None:
    assert in_use_before(events, current) == before
    assert in_use_before(json.loads(json.dumps(events)), current) == before
