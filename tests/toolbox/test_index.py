"""The index: a list reads what changed and nothing else, and never says what is not so any more."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lab.toolbox.folder_place import FolderPlace
from lab.toolbox.index import FILE, KnownPolicies
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode
from lab.toolbox.registry import Toolbox

MakePolicy = Callable[..., Policy]
SIGNATURE = "0123456789abcdef"
COUNT = 50
EVEN = sorted(range(0, COUNT, 2), key=lambda number: f"skill-{number}.safetensors")  # as files are listed
SETTLED_S = 0.06  # after which a file's times tell whether it changed


@pytest.fixture
def box(tmp_path: Path, make_policy: MakePolicy) -> Toolbox:
    """Fifty policies of a toolbox from before versions, and their index."""
    made = Toolbox(tmp_path / "box")
    made.folder.mkdir()
    for number in range(COUNT):
        held = make_policy(number, name=f"skill-{number}", subtask=("insert", "grasp")[number % 2])
        (made.folder / f"skill-{number}.safetensors").write_bytes(encode(held))
    time.sleep(SETTLED_S)
    made.list()
    assert (made.folder / FILE).is_file()
    return made


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The files that are read."""
    found: list[str] = []
    plain = FolderPlace.read

    def noted(self: FolderPlace, name: str) -> bytes:
        found.append(name)
        return plain(self, name)

    monkeypatch.setattr(FolderPlace, "read", noted)
    return found


def test_only_what_changed_is_read(box: Toolbox, reads: list[str], make_policy: MakePolicy) -> None:
    again = Toolbox(box.folder)
    assert len(again.list()) == COUNT
    assert reads == []
    box.save(make_policy(77.0, name="skill-3"))
    reads.clear()
    assert {row["name"]: row["version"] for row in again.list()}["skill-3"] == 2
    assert reads == ["skill-3.safetensors"]
    reads.clear()
    box.remove("skill-4")
    assert len(Toolbox(box.folder).list()) == COUNT - 1


@pytest.mark.parametrize(
    "damage", [b"", b"{}", b'{"crc32": "00000000", "index": {"rows": {}, "stamps": {}}}', None, "cut", "changed"]
)
def test_a_lost_or_damaged_index_is_made_again(box: Toolbox, damage: bytes | str | None, reads: list[str]) -> None:
    rows, path = box.list(), box.folder / FILE
    whole = path.read_bytes()
    assert json.loads(whole)["index"]["rows"].keys() == {f"skill-{n}.safetensors" for n in range(COUNT)}
    if damage is None:
        path.unlink()
    elif isinstance(damage, bytes):
        path.write_bytes(damage)
    else:
        path.write_bytes(whole[:-30] if damage == "cut" else whole.replace(b'"solved": true', b'"solved": fals', 1))
    assert Toolbox(box.folder).list() == rows
    assert len(reads) == COUNT
    assert path.read_bytes() == whole


def test_a_change_that_keeps_size_and_time_is_seen(box: Toolbox) -> None:
    path = box.folder / "skill-5.safetensors"
    at, content = path.stat(), path.read_bytes()
    assert content.count(np.float64(5.0).tobytes()) == 8
    path.write_bytes(content.replace(np.float64(5.0).tobytes(), np.float64("nan").tobytes()))
    os.utime(path, ns=(at.st_atime_ns, at.st_mtime_ns))
    for one in (box, Toolbox(box.folder)):
        assert "skill-5" not in [row["name"] for row in one.list()]
        assert len(one.index()[1]) == 1


def test_a_toolbox_that_may_only_be_read_is_listed(box: Toolbox, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*args: object) -> None:
        raise PermissionError(13, "Permission denied")

    (box.folder / FILE).unlink()
    monkeypatch.setattr("lab.toolbox.index.write_whole", refuse)
    assert len(Toolbox(box.folder).list()) == COUNT


def test_few_policies_need_none(tmp_path: Path, make_policy: MakePolicy) -> None:
    """Nothing is written into a folder that was only looked at."""
    few = Toolbox(tmp_path / "few")
    few.save(make_policy())
    before = sorted(few.folder.rglob("*"))
    time.sleep(SETTLED_S)
    assert len(few.list()) == 1
    assert sorted(few.folder.rglob("*")) == before


def test_listing_loads_no_numerical_library(box: Toolbox, root: Path) -> None:
    import subprocess
    import sys

    code = (
        "import sys; from lab.toolbox.registry import Toolbox; rows = Toolbox(sys.argv[1]).list(); "
        "sys.exit(len(rows) != 50 or any(name in sys.modules for name in ('numpy', 'pydantic', 'safetensors')))"
    )
    ran = subprocess.run([sys.executable, "-c", code, str(box.folder)], cwd=root, check=False)
    assert ran.returncode == 0


def test_those_alike_are_solved_have_the_tables_size_and_come_newest_first(
    box: Toolbox, reads: list[str], make_policy: MakePolicy
) -> None:
    six = {"q": np.zeros((6, 2)), "visits": np.zeros((6, 2), np.int64), "shape": (6,)}
    box.save(make_policy(name="newer", created="2026-07-01T00:00:00+00:00", signature="1" * 16))
    box.save(make_policy(name="unsolved", solved=False, signature="2" * 16))
    box.save(make_policy(name="larger", signature="3" * 16, **six))
    known, _ = box.index()
    reads.clear()
    names = [name for _, name in known.alike("insert", 4, 2)]
    assert (names[0], len(names), reads) == ("newer", 2, [])
    assert known.alike("insert", 6, 2) == [(("insert", "3" * 16), "larger")]
    assert known.alike("butter", 4, 2) == []
    known["butter", SIGNATURE] = make_policy(name="mine", subtask="butter")
    assert known.alike("butter", 4, 2) == [(("butter", SIGNATURE), "mine")]


def test_what_is_known_is_read_when_it_is_asked_for(box: Toolbox, reads: list[str], make_policy: MakePolicy) -> None:
    known, damaged = box.index()
    assert (damaged, set(known), len(known)) == ([], {("insert", SIGNATURE), ("grasp", SIGNATURE)}, 2)
    assert reads == []
    assert known["insert", SIGNATURE].subtask == "insert"
    assert known["insert", SIGNATURE] is known["insert", SIGNATURE]
    assert len(reads) == 1
    assert known.get(("insert", "f" * 16)) is None
    own = make_policy(9.0)
    known["butter", SIGNATURE] = known["insert", SIGNATURE] = own
    assert (len(known), known["insert", SIGNATURE] is own) == (3, True)
    del known["butter", SIGNATURE]
    with pytest.raises(KeyError):
        del known["butter", SIGNATURE]
    assert ("butter", SIGNATURE) not in known


def test_what_is_gone_by_then_is_not_known(box: Toolbox) -> None:
    known, _ = box.index()
    for row in box.list():
        Path(row["file"]).unlink()
    assert known.get(("insert", SIGNATURE)) is None
    assert isinstance(known, KnownPolicies)
