"""A toolbox elsewhere: in memory, and in an object store that a server on this machine plays."""

import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from typing import Any

import pytest

from lab.errors import BadInput, WorkFailed
from lab.toolbox import remote_place
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

MakePolicy = Callable[..., Policy]
SIGNATURE = "0123456789abcdef"


@pytest.fixture
def memory() -> Iterator[str]:
    """An address in this process's memory."""
    from fsspec.implementations.memory import MemoryFileSystem

    MemoryFileSystem.store.clear()
    yield "memory://box"
    MemoryFileSystem.store.clear()


@pytest.fixture(params=["memory", "bucket"])
def address(request: pytest.FixtureRequest) -> str:
    found: str = request.getfixturevalue(request.param)
    return found


def test_all_goes_as_in_a_folder(address: str, make_policy: MakePolicy) -> None:
    box = Toolbox(address)
    box.check()
    assert (box.list(), box.verify(), box.find("insert", SIGNATURE)) == ([], [], None)
    first = box.put(make_policy(1.0, final_steps=5))
    beside = box.put(make_policy(2.0, final_steps=7))
    assert (first.in_use, beside.in_use, beside.version) == (True, False, 2)
    assert beside.why_not == "the one in use takes 5 steps, it takes 7 steps"
    (row,) = Toolbox(address).list()
    assert (row["file"], row["version"], row["hash"]) == (f"{address}/insert.safetensors", 1, first.hash)
    assert box.load(row["file"]).q[0, 0] == 1.0
    assert box.load(box.save(make_policy(3.0, name="Other one"))).q[0, 0] == 3.0
    box.promote("insert", "2")
    found = Toolbox(address).find("insert", SIGNATURE, "insert")
    assert found is not None
    assert found.q[0, 0] == 2.0
    assert box.rollback("insert").number == 1
    assert [event["what"] for event in box.log("insert")] == ["learned", "learned", "promoted", "rolled back"]
    assert box.where(box.remove("insert")) == f"{address}/insert.safetensors"
    assert [row["name"] for row in box.list()] == ["Other one"]
    box.restore("insert")
    box.save_record("durations", "1 > 2", {"s": 2.5})
    assert Toolbox(address).load_record("durations", "1 > 2") == {"s": 2.5}
    assert [ok for _, ok, _ in Toolbox(address).verify()] == [True, True, True]
    shown = box.show("insert")
    assert shown["kept_bytes"] == sum(version["bytes"] for version in shown["kept_versions"]) > 0


def test_what_was_read_once_is_not_read_again(
    address: str, make_policy: MakePolicy, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Toolbox(address).save(make_policy(1.0))
    rmtree(own_cache)  # it may be deleted at any time
    reads: list[str] = []
    plain = remote_place.RemotePlace._call

    def counted(self: Any, verb: str, function: Any, *args: Any, **named: Any) -> Any:
        if "cat" in function.__name__:
            reads.append(args[0])
        return plain(self, verb, function, *args, **named)

    monkeypatch.setattr(remote_place.RemotePlace, "_call", counted)
    for _ in range(2):
        box = Toolbox(address)
        assert box.load(box.list()[0]["file"]).q[0, 0] == 1.0
    assert len(reads) == 1
    (cached,) = (path for path in own_cache.rglob("*") if path.is_file() and path.name != "index.json")
    cached.write_bytes(cached.read_bytes()[:-8])  # a damaged cache is read past
    assert Toolbox(address).load(f"{address}/insert.safetensors").q[0, 0] == 1.0
    assert len(reads) == 2
    Toolbox(address).save(make_policy(2.0))
    assert Toolbox(address).load(f"{address}/insert.safetensors").q[0, 0] == 2.0


def test_of_two_that_write_at_once_the_better_one_is_in_use(
    memory: str, make_policy: MakePolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other one saves between this one's decision and its writing."""
    box, other = Toolbox(memory), Toolbox(memory)
    plain = remote_place.RemotePlace.write

    def late(self: Any, name: str, content: bytes, drafts: str = "") -> None:
        if name == "insert.safetensors" and self is box.place:
            monkeypatch.setattr(remote_place.RemotePlace, "write", plain)
            other.save(make_policy(2.0, final_steps=3))
        plain(self, name, content, drafts)

    monkeypatch.setattr(remote_place.RemotePlace, "write", late)
    box.save(make_policy(1.0, final_steps=9))
    found = Toolbox(memory).find("insert", SIGNATURE)
    assert found is not None
    assert found.final_steps == 3
    assert len(box.versions("insert").kept()) == 2


def test_a_session_is_kept_in_a_local_folder_that_is_no_cache(address: str, own_cache: Path, tmp_path: Path) -> None:
    box = Toolbox(address)
    assert box.folder.is_relative_to(tmp_path / "data")
    assert box.place.cache.is_relative_to(own_cache)
    assert Toolbox(f"{address}/other").folder != box.folder


def test_the_root_of_a_place_will_do(memory: str, make_policy: MakePolicy) -> None:
    box = Toolbox("memory://")
    names = {box.load(box.save(make_policy(1.0, name=f"skill-{number}"))).name for number in range(50)}
    rows = Toolbox("memory://").list()
    assert {row["name"]: row["version"] for row in rows} == dict.fromkeys(names, 1)
    assert rows[0]["file"] == "memory://skill-0.safetensors"


def test_many_are_read_at_once(address: str, make_policy: MakePolicy, monkeypatch: pytest.MonkeyPatch) -> None:
    box, names = Toolbox(address), {f"skill-{number:02}" for number in range(50)}
    for name in names:
        box.save(make_policy(1.0, name=name))
    box.place.write("skill-07.safetensors", b"cut off")
    rmtree(box.place.cache)
    calls: list[str] = []
    plain = remote_place.RemotePlace._call

    def noted(self: Any, verb: str, function: Any, *args: Any, **named: Any) -> Any:
        calls.append(function.__name__.lstrip("_"))
        return plain(self, verb, function, *args, **named)

    monkeypatch.setattr(remote_place.RemotePlace, "_call", noted)
    rows = Toolbox(address).list()
    assert ({row["name"] for row in rows}, {row["version"] for row in rows}) == (names - {"skill-07"}, {1})
    assert sorted(calls) == ["cat", "find", "ls"]
    calls.clear()
    assert Toolbox(address).list() == rows
    assert set(calls) == {"ls"}


def one_line(error: pytest.ExceptionInfo[Exception]) -> str:
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_bucket_that_is_not_there(bucket: str, make_policy: MakePolicy) -> None:
    with pytest.raises(BadInput) as error:
        Toolbox("s3://nowhere/box").check()
    assert one_line(error) == "toolbox s3://nowhere/box: there is no bucket 'nowhere'"
    with pytest.raises(WorkFailed, match=r"toolbox s3://nowhere/box: .* cannot be written"):
        Toolbox("s3://nowhere/box").save(make_policy())


def test_who_cannot_be_reached_is_named(bucket: str, make_policy: MakePolicy, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
    box = Toolbox("s3://lab/gone")
    began = time.monotonic()
    for use in (box.check, box.list):
        with pytest.raises(WorkFailed) as error:
            use()
        assert one_line(error).startswith("toolbox s3://lab/gone cannot be ")
        assert str(port) in one_line(error)
    assert time.monotonic() - began < remote_place.LIMIT_S
    with pytest.raises(WorkFailed, match="it is kept in ") as error:
        box.save(make_policy(4.0))
    kept = Path(one_line(error).partition("it is kept in ")[2])
    assert box.load(kept).q[0, 0] == 4.0


def test_who_never_answers_is_given_up(bucket: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote_place, "LIMIT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{silent.getsockname()[1]}")
        with pytest.raises(WorkFailed, match=r"toolbox s3://lab/silent cannot be listed: no answer in 0.3 s"):
            Toolbox("s3://lab/silent").list()


@pytest.mark.parametrize(
    ("address", "message"),
    [("nothing://x/y", r"toolbox nothing://x/y: .*nothing"), ("s3:///", r"toolbox s3:.* it names no bucket")],
)
def test_addresses_that_are_none(address: str, message: str) -> None:
    with pytest.raises((BadInput, WorkFailed), match=message):
        Toolbox(address).check()


def test_names_stay_in_the_place(memory: str, make_policy: MakePolicy) -> None:
    box = Toolbox(memory)
    box.save(replace(make_policy(), name="../../out"))
    with pytest.raises(BadInput, match="it leads out of the toolbox"):
        box.load(f"{memory}/../out.safetensors")
