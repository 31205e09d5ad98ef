"""A toolbox in a folder: what is written stays in it, and nothing half written is seen."""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.toolbox.folder_place import FolderPlace
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

MakePolicy = Callable[..., Policy]


@pytest.fixture
def place(tmp_path: Path) -> FolderPlace:
    return FolderPlace(tmp_path / "box")


def test_files_and_logs(place: FolderPlace) -> None:
    assert (place.names(), place.names("a"), place.lines("log/a"), place.exists("a")) == ([], [], [], False)
    place.write("a/b", b"1", drafts="c")
    place.write("a/b", b"22")
    (place.folder / "c" / ".b.1.tmp").touch()
    place.sweep("c")
    assert (place.names("a"), place.read("a/b"), list((place.folder / "c").iterdir())) == (["b"], b"22", [])
    assert (place.files("a")["b"].size_bytes, place.folders("")) == (2, ["a", "c"])
    place.move("a/b", "d/e")
    assert (place.names("a"), place.names("d")) == ([], ["e"])
    for line in (b"one", b"two"):
        place.append("log/a", line)
    with (place.folder / "log" / "a").open("ab") as log:
        log.write(b'{"cut": o')  # by a crash
    assert place.lines("log/a") == [b"one", b"two"]
    place.append("log/a", b"three")
    assert place.lines("log/a") == [b"one", b"two", b"three"]
    with (place.folder / "log" / "a").open("ab") as log:
        log.write(b'{"all": 4}')  # but the line's end
    assert place.lines("log/a") == [b"one", b"two", b"three", b'{"all": 4}']
    place.append("log/a", b"five")
    assert place.lines("log/a") == [b"one", b"two", b"three", b'{"all": 4}', b"five"]


def test_a_stamp_changes_with_the_file_and_is_not_trusted_when_fresh(place: FolderPlace) -> None:
    place.write("a", b"1")
    assert place.files()["a"].stamp == ""
    before = place.folder.stat()
    os.utime(place.folder / "a", ns=(before.st_mtime_ns, before.st_mtime_ns))
    while not (first := place.files()["a"].stamp):
        pass
    assert place.files()["a"].stamp == first
    place.write("a", b"2")
    os.utime(place.folder / "a", ns=(before.st_mtime_ns, before.st_mtime_ns))  # as an unpacked archive would
    while not (second := place.files()["a"].stamp):
        pass
    assert second != first


def test_links_are_not_followed_out_of_it(tmp_path: Path, make_policy: MakePolicy) -> None:
    box, other = Toolbox(tmp_path / "box"), Toolbox(tmp_path / "other")
    box.save(make_policy(1.0))
    path = other.save(make_policy(2.0, name="foreign"))
    (box.folder / "foreign.safetensors").symlink_to(path)
    assert [row["name"] for row in box.list()] == ["insert"]
    ((_, _, reason),) = [row for row in box.verify() if not row[1]]
    assert reason.endswith(f"foreign.safetensors: it leads out of the toolbox {box.folder}")
    (box.folder / "versions" / "grasp").symlink_to(tmp_path / "other")
    (box.folder / "records").symlink_to(tmp_path / "other")
    before = {file: file.read_bytes() for file in other.folder.rglob("*") if file.is_file()}
    uses = (partial(box.save, make_policy(name="grasp")), partial(box.save_record, "durations", "1 > 2", {}))
    for use in uses:
        with pytest.raises(BadInput, match="it leads out of the toolbox"):
            use()
    assert {file: file.read_bytes() for file in other.folder.rglob("*") if file.is_file()} == before
    log = box.folder / "log" / "butter.jsonl"
    log.symlink_to(tmp_path / "log of another")
    with pytest.raises(BadInput, match="cannot write"):
        box.save(make_policy(name="butter"))
    assert not (tmp_path / "log of another").exists()


def test_a_toolbox_that_is_a_link_itself_is_one(tmp_path: Path, make_policy: MakePolicy) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "box").symlink_to(tmp_path / "real")
    box = Toolbox(tmp_path / "box")
    assert box.load(box.save(make_policy(1.0))).q[0, 0] == 1.0
    assert (tmp_path / "real" / "insert.safetensors").is_file()


@pytest.mark.parametrize("name", ["../out", "a/../../out", "/etc/passwd"])
def test_names_never_lead_out(place: FolderPlace, name: str) -> None:
    place.write("inside", b"")
    for use in (lambda: place.read(name), lambda: place.write(name, b""), lambda: place.append(name, b"")):
        with pytest.raises(BadInput, match="it leads out of the toolbox"):
            use()


def test_what_killed_commands_left_goes(tmp_path: Path, make_policy: MakePolicy) -> None:
    """With the next policy that is kept, or when it is asked for; never what may still be at work."""
    box = Toolbox(tmp_path / "box")
    box.save(make_policy())
    sound = {path for path in box.folder.rglob("*") if path.is_file()}
    drafts = [box.folder / place / ".insert.0a1b2c3d.tmp" for place in (".", "records/durations", "versions/grasp")]
    folders = [box.folder / "sessions" / name for name in ("maze-1", "maze-2", "maze-3", "maze-4")]
    own = box.folder / ".mine.tmp"  # not of our making
    for path in (*drafts, own, folders[3] / "events.jsonl", folders[3] / "begun" / "insert.safetensors"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"half")
    folders[2].mkdir()
    (folders[2] / "events.jsonl").write_bytes(b"a line\n")
    for folder in folders[:2]:
        folder.mkdir()
    fresh = (drafts[1], folders[1])
    for path in {*drafts, own, *folders} - {*fresh}:
        os.utime(path, (0, 0))
    assert sorted(box.repair()) == sorted(str(path) for path in (drafts[0], drafts[2], folders[0], folders[3]))
    assert {path for path in box.folder.rglob("*") if path.is_file()} == {
        *sound,
        own,
        drafts[1],
        folders[2] / "events.jsonl",
    }
    for path in fresh:
        os.utime(path, (0, 0))
    Toolbox(box.folder).save(make_policy(name="grasp"))
    assert not any(path.exists() for path in fresh)
    assert box.repair() == []
