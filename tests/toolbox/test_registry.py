"""The toolbox keeps policies whole, finds what fits, and never loads what is damaged."""

import errno
import json
import os
import struct
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab import files
from lab.errors import BadInput, WorkFailed
from lab.toolbox.names import FORMAT
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

MakePolicy = Callable[..., Policy]
SIGNATURE = "0123456789abcdef"  # of the policies of `make_policy`


@pytest.fixture
def toolbox(tmp_path: Path) -> Toolbox:
    return Toolbox(tmp_path / "toolbox")


def assert_same(one: Policy, other: Policy) -> None:
    for field in fields(Policy):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


def test_what_is_saved_is_loaded(make_policy: MakePolicy, toolbox: Toolbox) -> None:
    for saved in (make_policy(), make_policy(name="Butter: side/2 ü", shape=(), final_steps=None, solved=False)):
        path = toolbox.save(saved)
        loaded = toolbox.load(path)
        assert_same(loaded, saved)
        assert (loaded.q.dtype.name, loaded.visits.dtype.name) == ("float64", "int64")
        assert (type(loaded.action_labels), type(loaded.shape)) == (tuple, tuple)
        assert path.parent == toolbox.folder
    assert len(list(toolbox.folder.glob("*.safetensors"))) == 2


def test_saving_again_replaces(make_policy: MakePolicy, toolbox: Toolbox) -> None:
    assert toolbox.save(make_policy()) == toolbox.save(make_policy(q=np.ones((4, 2))))
    found = toolbox.find("insert", SIGNATURE)
    assert found is not None
    assert found.q.tolist() == [[1.0, 1.0]] * 4


def test_find_takes_what_fits_solved_first_then_the_newest(make_policy: MakePolicy, toolbox: Toolbox) -> None:
    assert toolbox.find("insert", SIGNATURE) is None
    toolbox.save(make_policy(name="old", created="2024-01-01T00:00:00+00:00"))
    toolbox.save(make_policy(name="new", created="2024-06-01T00:00:00+00:00"))
    toolbox.save(make_policy(name="newest", created="2024-07-01T00:00:00+00:00", solved=False))
    toolbox.save(make_policy(name="elsewhere", signature="f" * 16))
    toolbox.save(make_policy(name="other", subtask="grasp"))
    found = [
        toolbox.find("insert", SIGNATURE),
        toolbox.find("insert", SIGNATURE, "old"),
        toolbox.find("insert", "e" * 16),
    ]
    assert [one and one.name for one in found] == ["new", "old", None]


def test_list_show_and_remove(make_policy: MakePolicy, toolbox: Toolbox) -> None:
    assert toolbox.list() == []
    toolbox.save(make_policy(name="Second one"))
    path = toolbox.save(make_policy())
    listed = {one["name"]: one for one in toolbox.list()}
    assert set(listed) == {"insert", "Second one"}
    assert listed["insert"] | {"states": 4, "actions": 2, "episodes": 2, "file": str(path)} == listed["insert"]
    assert {"subtask", "task", "signature", "created", "solved"} <= listed["insert"].keys()
    assert toolbox.show("insert")["curve"] == [21, 3]
    json.dumps(toolbox.show("Second one"))
    with pytest.raises(BadInput, match=r"unknown policy 'inser'.*did you mean 'insert'"):
        toolbox.show("inser")
    assert toolbox.remove("insert") == path
    assert [one["name"] for one in toolbox.list()] == ["Second one"]
    with pytest.raises(BadInput, match="unknown policy 'insert'"):
        toolbox.remove("insert")
    with pytest.raises(BadInput, match="unknown policy"):
        toolbox.remove("../../etc/passwd")


def header(content: bytes) -> tuple[dict[str, Any], bytes]:
    (length,) = struct.unpack("<Q", content[:8])
    return json.loads(content[8 : 8 + length]), content[8 + length :]


def forged(content: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    head, data = header(content)
    change(head)
    text = json.dumps(head).encode()
    return struct.pack("<Q", len(text)) + text + data


def with_field(name: str, value: str) -> Callable[[bytes], bytes]:
    return lambda content: forged(content, lambda head: head["__metadata__"].update({name: value}))


def with_tensor(name: str, **changed: Any) -> Callable[[bytes], bytes]:
    return lambda content: forged(content, lambda head: head[name].update(changed))


def resaved(**changed: Any) -> Callable[[bytes], bytes]:
    def save(content: bytes) -> bytes:
        from safetensors.numpy import load, save

        return save(load(content) | changed, header(content)[0]["__metadata__"])

    return save


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "truncated header": lambda content: content[:40],
    "truncated data": lambda content: content[:-1],
    "padded": lambda content: content + b"\0",
    "text": lambda content: b"not a policy at all",
    "zeros": lambda content: bytes(len(content)),
    "NaN": resaved(q=np.full((4, 2), np.nan)),
    "one infinity": resaved(q=np.array([[0.0, np.inf]] * 4)),
    "wrong shape": resaved(q=np.zeros((3, 2)), visits=np.zeros((3, 2), np.int64)),
    "flat": resaved(q=np.zeros(8)),
    "no states": resaved(q=np.zeros((0, 2)), visits=np.zeros((0, 2), np.int64)),
    "shapes differ": resaved(visits=np.zeros((2, 4), np.int64)),
    "float32": resaved(q=np.zeros((4, 2), np.float32)),
    "int32 visits": resaved(visits=np.zeros((4, 2), np.int32)),
    "negative visits": resaved(visits=np.full((4, 2), -1)),
    "extra tensor": resaved(more=np.zeros(1)),
    "terabytes": with_tensor("q", shape=[1 << 40, 1 << 40]),
    "bytes beyond the end": with_tensor("q", data_offsets=[0, 1 << 50]),
    "unknown type": with_tensor("q", dtype="F65"),
    "bfloat": with_tensor("q", dtype="BF16", shape=[8, 4]),
    "header longer than the file": lambda content: struct.pack("<Q", 1 << 60) + content[8:],
    "other format": with_field("format", "policy-0"),
    "no metadata": lambda content: forged(content, lambda head: head.pop("__metadata__")),
    "field missing": lambda content: forged(content, lambda head: head["__metadata__"].pop("curve")),
    "field no JSON": with_field("curve", "[1, 2"),
    "field of the wrong type": with_field("curve", '"long"'),
    "NaN in a field": with_field("learner", '{"alpha": NaN}'),
    "deep JSON": with_field("learner", "[" * 100_000),
    "huge number": with_field("seed", "9" * 10_000),
    "start outside": with_field("start", "4"),
    "labels of another table": with_field("action_labels", '["up"]'),
    "bad signature": with_field("signature", '"0123"'),
    "bad date": with_field("created", '"yesterday"'),
    "truth for a number": with_field("start", "true"),
}


def assert_refused(toolbox: Toolbox, path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        toolbox.load(path)
    assert str(caught.value).startswith(f"policy file {path}: ")
    assert "\n" not in str(caught.value)
    sound = toolbox.find("insert", SIGNATURE)
    assert sound is not None
    assert sound.name == "sound"
    assert [one["name"] for one in toolbox.list()] == ["sound"]
    report = {where.name: (ok, reason) for where, ok, reason in toolbox.verify()}
    assert report["sound.safetensors"] == (True, "")
    assert report[path.name] == (False, str(caught.value))


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_named_skipped_and_reported(make_policy: MakePolicy, toolbox: Toolbox, damage: str) -> None:
    toolbox.save(make_policy(name="sound", created="2023-01-01T00:00:00+00:00"))
    path = toolbox.save(make_policy())
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    assert_refused(toolbox, path)
    assert toolbox.remove("insert") == path


def test_the_undamaged_forgery_loads(make_policy: MakePolicy, toolbox: Toolbox) -> None:
    path = toolbox.save(make_policy())
    path.write_bytes(with_field("format", FORMAT)(path.read_bytes()))
    assert_same(toolbox.load(path), make_policy())


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_cut_or_padding_is_refused(make_policy: MakePolicy, toolbox: Toolbox, data: st.DataObject) -> None:
    toolbox.save(make_policy(name="sound"))
    path = toolbox.save(make_policy(name="insert"))
    whole = path.read_bytes()
    cut = data.draw(st.integers(0, len(whole) - 1), label="cut")
    padding = data.draw(st.binary(min_size=1, max_size=40), label="padding")
    for damaged in (whole[:cut], whole + padding, whole[:cut] + padding + whole[cut:]):
        path.write_bytes(damaged)
        assert_refused(toolbox, path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0), value=st.integers(0, 255))
def test_any_changed_byte_is_refused_or_still_a_sound_policy(
    make_policy: MakePolicy, toolbox: Toolbox, at: int, value: int
) -> None:
    path = toolbox.save(make_policy())
    content = bytearray(path.read_bytes())
    content[at % len(content)] = value
    path.write_bytes(content)
    try:
        loaded = toolbox.load(path)
    except BadInput:
        assert toolbox.find("insert", SIGNATURE) is None
    else:
        assert np.isfinite(loaded.q).all()
        assert loaded.q.shape == (4, 2)


def test_things_that_are_no_files(make_policy: MakePolicy, toolbox: Toolbox, tmp_path: Path) -> None:
    toolbox.save(make_policy(name="sound"))
    folder = toolbox.folder / "folder.safetensors"
    folder.mkdir()
    assert_refused(toolbox, folder)
    pipe = toolbox.folder / "pipe.safetensors"
    os.mkfifo(pipe)
    assert_refused(toolbox, pipe)
    with pytest.raises(BadInput, match="there is no such file"):
        toolbox.load(tmp_path / "missing.safetensors")


def test_a_folder_may_be_named_in_any_way(
    make_policy: MakePolicy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    other = Toolbox(tmp_path / "other").save(make_policy(name="other"))
    for where in (".", "box", tmp_path / "box", f"file://{tmp_path}/box", "./box/"):
        box = Toolbox(where)
        assert_same(box.load(box.save(make_policy())), make_policy())
        assert_same(box.load(box.list()[0]["file"]), make_policy())
        assert box.load(other).name == "other"
        assert box.where(box.remove("insert")) == str(box.folder / "insert.safetensors")


@pytest.mark.parametrize("fault", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
@pytest.mark.parametrize("where", ["fsync", "replace"])
def test_an_interrupted_write_leaves_the_old_file_and_no_other(
    make_policy: MakePolicy, toolbox: Toolbox, monkeypatch: pytest.MonkeyPatch, where: str, fault: BaseException
) -> None:
    def fail(*args: object) -> None:
        raise fault

    path = toolbox.save(make_policy())
    toolbox.save_record("transfer", "a b", {"duration_s": 2.0})
    before = {file: file.read_bytes() for file in toolbox.folder.rglob("*") if file.is_file()}
    assert path in before
    with monkeypatch.context() as patch:
        patch.setattr(os, where, fail)
        with pytest.raises((KeyboardInterrupt, WorkFailed)):
            toolbox.save(make_policy(solved=False))
        with pytest.raises((KeyboardInterrupt, WorkFailed)):
            toolbox.save_record("transfer", "a b", {"duration_s": 3.0})
    assert {file: file.read_bytes() for file in toolbox.folder.rglob("*") if file.is_file()} == before


def test_a_folder_that_is_a_file(make_policy: MakePolicy, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        toolbox = Toolbox(folder)
        with pytest.raises(BadInput, match="cannot write"):
            toolbox.save(make_policy())
        with pytest.raises(BadInput, match="cannot write"):
            toolbox.save_record("kind", "key", {})
    blocked = Toolbox(tmp_path / "file")
    for read in (blocked.list, blocked.verify):
        with pytest.raises(BadInput, match="it is a file, a folder is needed"):
            read()


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_a_folder_that_may_not_be_read_or_written(
    make_policy: MakePolicy, toolbox: Toolbox, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(*args: object, **named: object) -> None:
        raise OSError(number, os.strerror(number))

    toolbox.save(make_policy())
    with monkeypatch.context() as patch:
        patch.setattr(files, "write_whole", refuse)
        with pytest.raises(BadInput, match=f"cannot write .*: {os.strerror(number)}"):
            toolbox.save(make_policy(solved=False))
    monkeypatch.setattr(os, "scandir", refuse)
    for read in (toolbox.list, toolbox.verify, lambda: toolbox.find("insert", SIGNATURE)):
        with pytest.raises(BadInput, match=f"cannot read .*: {os.strerror(number)}"):
            read()
