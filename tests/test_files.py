"""Files written whole or not at all, where a folder would be made, and the folders that ship, in a checkout and in a wheel."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from lab import files
from lab.errors import BadInput, WorkFailed
from lab.files import check_out, draft, is_file, json_of, nearest, read_limited, source_hash, within, write_whole
from lab.operating_system import lock


def test_a_file_is_written_and_replaced(tmp_path: Path) -> None:
    path = tmp_path / "file"
    for content in (b"one", b"", bytes(range(256))):
        write_whole(path, content)
        assert path.read_bytes() == content
        assert [p.name for p in path.parent.iterdir()] == ["file"]


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    write_whole(path, b"old")

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_writer_left_goes_and_what_another_one_is_writing_stays(tmp_path: Path) -> None:
    path = tmp_path / "file"
    left, busy, other = (tmp_path / f".{name}.tmp" for name in ("file.0a1b2c3d", "file.00000000", "other.0a1b2c3d"))
    for draft_file in (left, busy, other):
        draft_file.write_bytes(b"half")
    with busy.open("ab") as writing:
        lock(writing.fileno())
        write_whole(path, b"new")
    assert {*tmp_path.iterdir()} == {path, busy, other}
    write_whole(path, b"newer")
    assert {*tmp_path.iterdir()} == {path, other}


def test_a_folder_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file or directory"):
        write_whole(tmp_path / "no" / "file", b"")
    assert list(tmp_path.iterdir()) == []


def test_the_nearest_folder(tmp_path: Path) -> None:
    assert nearest(tmp_path) == nearest(tmp_path / "a" / "b") == tmp_path
    with pytest.raises(OSError, match="too long"):
        nearest(tmp_path / ("x" * 300))


def drafting(folder: Path) -> tuple[int, int]:
    """A process that writes a draft and waits to be killed: its number, and a pipe that ends with it."""
    ready, tell = os.pipe()
    pid = os.fork()
    if pid == 0:
        with draft(folder) as made:
            (made / "half").write_text("half")
            os.write(tell, b"x")
            signal.pause()
        os._exit(0)
    os.read(ready, 1)
    return pid, ready


def drafts(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if path.name.startswith(".run-") and path.is_dir()}


def test_a_draft_is_gone_in_the_end(tmp_path: Path) -> None:
    with draft(tmp_path) as made:
        (made / "file").write_text("x")
        assert drafts(tmp_path) == {made.name}
    with pytest.raises(KeyboardInterrupt), draft(tmp_path):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_a_killed_process_leaves_a_draft_that_the_next_one_clears(tmp_path: Path) -> None:
    (tmp_path / ".run-mine").mkdir()  # not the name of a draft
    killed, alive = drafting(tmp_path), drafting(tmp_path)
    os.kill(killed[0], signal.SIGKILL)
    os.waitpid(killed[0], 0)
    assert len(drafts(tmp_path)) == 3
    with draft(tmp_path) as made:
        left = drafts(tmp_path) - {made.name, ".run-mine"}
        assert len(left) == 1  # of the process that is still at it
        assert (tmp_path / left.pop() / "half").read_text() == "half"
    os.kill(alive[0], signal.SIGKILL)
    os.waitpid(alive[0], 0)
    with draft(tmp_path) as made:
        assert drafts(tmp_path) == {made.name, ".run-mine"}
    assert [path.name for path in tmp_path.iterdir()] == [".run-mine"]
    for _, ready in (killed, alive):
        os.close(ready)


def test_output_folders(tmp_path: Path) -> None:
    check_out(tmp_path / "a" / "b")
    assert os.listdir(tmp_path) == []
    (tmp_path / "file").write_text("mine")
    for wrong in ("file", "file/below", "x" * 300):
        with pytest.raises(BadInput, match=r"output folder '.*' .--out.: "):
            check_out(tmp_path / wrong)


# ---- the folders that ship ------------------------------------------------------------------------------------------


def test_this_checkout_ships_its_tasks_and_assets() -> None:
    assert (files.tasks_folder() / "toast.toml").is_file()
    assert (files.assets_folder() / "robot.urdf").is_file()


@pytest.mark.parametrize("name", ["tasks", "assets"])
def test_a_wheel_carries_its_folders_inside(tmp_path: Path, name: str) -> None:
    package = tmp_path / "site-packages" / "lab"
    inside = package / "_data" / name
    inside.mkdir(parents=True)
    assert files.find(name, package) == inside


def test_a_folder_beside_an_installed_package_is_somebody_elses(tmp_path: Path) -> None:
    package = tmp_path / "lab"
    (tmp_path / "tasks").mkdir()
    with pytest.raises(WorkFailed, match=r"looked for .*_data/tasks and .*install the lab again"):
        files.find("tasks", package)
    (tmp_path / "pyproject.toml").touch()
    assert files.find("tasks", package) == tmp_path / "tasks"


def test_every_file_that_ships_has_an_expected_kind() -> None:
    assert {p.suffix for p in files.tasks_folder().rglob("*") if p.is_file()} == {".toml"}
    assert {p.suffix for p in files.assets_folder().rglob("*") if p.is_file()} <= {
        ".urdf",
        ".obj",
        ".mtl",
        ".png",
        ".svg",
    }


def test_a_file_is_read_within_bounds(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    assert read_limited(path, 5) == b"12345"
    with pytest.raises(OSError, match="it has 5 bytes, allowed are 4"):
        read_limited(path, 4)
    with path.open("wb") as file:
        file.truncate(1 << 33)  # sparse: nothing of it is read
    with pytest.raises(OSError, match=f"it has {1 << 33} bytes, allowed are {1 << 28}"):
        read_limited(path)


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo], ids=["folder", "pipe"])
def test_only_a_regular_file_is_read(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "other")
    with pytest.raises(OSError, match="it is no regular file"):
        read_limited(tmp_path / "other")
    with pytest.raises(FileNotFoundError):
        read_limited(tmp_path / "none")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "Expecting value"),
        ("[NaN]", "NaN is not allowed"),
        ("-Infinity", "-Infinity is not allowed"),
        ("[-1e400]", "-1e400 is too large a number"),
        ("[" * 100_000, "nested too deeply"),
        ("1" * 5000, "limit"),
        (b"\xc3", "codec"),
    ],
)
def test_what_is_no_json_is_refused(text: str | bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        json_of(text)


def test_json_is_read() -> None:
    assert json_of('{"a": [1, null, "x"]}') == {"a": [1, None, "x"]}


def test_a_name_out_of_a_file_leads_nowhere_else(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "file").touch()
    (folder / "link").symlink_to("/etc")
    assert within(folder, "file") == folder / "file"
    assert within(folder, "below/other") == folder / "below" / "other"
    assert within(folder, "file", folder / "below") == folder / "below" / "file"
    for name in ("", ".", "..", "../x", "/etc/passwd", "link/passwd", "a\0b"):
        assert within(folder, name) is None, name


def test_what_can_be_no_name_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert is_file(tmp_path / "file")
    assert not any(is_file(tmp_path / name) for name in ("", "x" * 300, "a\0b", "file/below"))


def test_a_hash_of_sources_changes_with_every_source_and_its_place(tmp_path: Path) -> None:
    def hash_of(**texts: str) -> str:
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        for place, text in texts.items():
            path = folder / (place.replace("_in_", "/") + ".py")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        (folder / "notes.txt").write_text(folder.name)  # is no source
        return source_hash(folder)

    hashes = [
        hash_of(top="x = 1\n", room_in_low="y = 1\n"),
        hash_of(top="x = 2\n", room_in_low="y = 1\n"),
        hash_of(top="x = 1\n", room_in_low="y = 2\n"),
        hash_of(top="x = 1\n", low="y = 1\n"),
        hash_of(top="x = 1\n"),
        hash_of(top="x = 1\n", room_in_low=""),
    ]
    assert len(set(hashes)) == len(hashes)
    assert hash_of(top="x = 1\n", room_in_low="y = 1\n") == hashes[0]


def test_a_single_file_is_hashed_as_a_package_of_its_own(tmp_path: Path) -> None:
    hashes = []
    for text in ("x = 1\n", "x = 2\n"):
        (tmp_path / "mine.py").write_text(text)
        source_hash.cache_clear()
        hashes.append(source_hash(tmp_path / "mine.py"))
    assert hashes[0] != hashes[1]


def test_a_place_without_sources_has_no_hash(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "none"):
        with pytest.raises(WorkFailed, match="no Python source"):
            source_hash(place)
