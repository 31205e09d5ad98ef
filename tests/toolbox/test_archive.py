"""An archive brings policies whole, or is refused in words before anything is kept."""

import hashlib
import json
import stat
from collections.abc import Callable, Iterable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.toolbox import archive
from lab.toolbox.archive import MANIFEST, pack, take_in, unpack
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode
from lab.toolbox.registry import Toolbox
from lab.toolbox.versions import Saved

Make = Callable[..., Policy]
Entries = list[tuple[ZipInfo, bytes]]


@pytest.fixture
def toolbox(tmp_path: Path) -> Toolbox:
    return Toolbox(tmp_path / "toolbox")


@pytest.fixture
def refused(tmp_path: Path) -> Callable[..., str]:
    """What is said of an archive that is not taken: of its bytes, or of entries that are zipped as they are."""

    def say(content: bytes | Entries) -> str:
        path = tmp_path / "given.zip"
        path.write_bytes(content if isinstance(content, bytes) else zipped(content))
        with pytest.raises(BadInput) as caught:
            unpack(path)
        said = str(caught.value)
        assert said.startswith(f"archive {path}: ")
        assert "\n" not in said
        return said

    return say


def entries_of(*policies: Policy) -> Entries:
    """A good archive's entries, to be changed."""
    with ZipFile(BytesIO(pack(policies)[0])) as good:
        return [(entry, good.read(entry)) for entry in good.infolist()]


def zipped(entries: Iterable[tuple[ZipInfo, bytes]]) -> bytes:
    out = BytesIO()
    with ZipFile(out, "w") as made:
        for entry, content in entries:
            made.writestr(entry, content)
    return out.getvalue()


def manifest_changed(entries: Entries, change: Callable[[Any], None]) -> Entries:
    head = json.loads(entries[0][1])
    change(head)
    return [(entries[0][0], json.dumps(head).encode()), *entries[1:]]


def named(name: str, content: bytes = b"x", **attributes: Any) -> tuple[ZipInfo, bytes]:
    entry = ZipInfo(name)
    for attribute, value in attributes.items():
        setattr(entry, attribute, value)
    return entry, content


# ---- what is packed comes out ---------------------------------------------------------------------------------------


def test_an_archive_is_the_same_each_time_and_plain(make_policy: Make) -> None:
    content, manifest = pack([make_policy(name="b"), make_policy(name="A side/2 ü")])
    assert content == pack([make_policy(name="A side/2 ü"), make_policy(name="b")])[0]
    with ZipFile(BytesIO(content)) as opened:
        assert [entry.filename for entry in opened.infolist()] == [
            MANIFEST,
            "a-side-2-33f1315d8c.safetensors",
            "b.safetensors",
        ]
        assert {(entry.compress_type, entry.date_time) for entry in opened.infolist()} == {
            (ZIP_STORED, (1980, 1, 1, 0, 0, 0))
        }
        head = json.loads(opened.read(MANIFEST))
        whole = opened.read("b.safetensors")
    assert whole == encode(make_policy(name="b"))
    assert head == manifest.model_dump()
    row = {"file": "b.safetensors", "name": "b", "bytes": len(whole), "sha256": hashlib.sha256(whole).hexdigest()}
    assert (head["format"], head["files"][1]) == ("teaching-lab-archive-1", row)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=20)
@given(
    st.lists(
        st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=30),
        min_size=1,
        max_size=5,
        unique=True,
    ),
    st.integers(0, 31),
)
def test_any_policies_come_through(tmp_path: Path, make_policy: Make, names: list[str], some: int) -> None:
    policies = [make_policy(name=name, seed=n) for n, name in enumerate(names) if some >> n & 1] or [
        make_policy(name=names[0])
    ]
    path = tmp_path / "given.zip"
    path.write_bytes(pack(policies)[0])
    came = {policy.name: encode(policy) for policy in unpack(path)}
    assert came == {policy.name: encode(policy) for policy in policies}


def test_nothing_and_twins_and_too_much_are_not_packed(make_policy: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match="there is no policy to export"):
        pack([])
    with pytest.raises(BadInput, match="two policies are called 'a'"):
        pack([make_policy(name="a"), make_policy(name="a", seed=9)])
    monkeypatch.setattr(archive, "MAX_BYTES", 1000)
    with pytest.raises(BadInput, match=r"1 policy file with \d+ bytes, allowed 10000 with 1000: name fewer policies"):
        pack([make_policy(name="a")])


# ---- what is refused ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        (named("../../.bashrc"), "'../../.bashrc' leads out of the folder"),
        (named("/etc/passwd"), "'/etc/passwd' leads out of the folder"),
        (named("..\\x.safetensors"), "leads out of the folder"),
        (named("C:x.safetensors"), "'C:x.safetensors' leads out of the folder"),
        (
            named("link.safetensors", external_attr=(stat.S_IFLNK | 0o777) << 16),
            "'link.safetensors' is a symbolic link",
        ),
        (
            named("pipe.safetensors", external_attr=(stat.S_IFIFO | 0o777) << 16),
            "'pipe.safetensors' is no regular file",
        ),
        (named("folder/", b""), "'folder/' is no regular file"),
        (named("in/folder.safetensors"), "'in/folder.safetensors' is no name of a policy's file"),
        (named("run.sh"), "'run.sh' is no name of a policy's file"),
        (named("zeros.safetensors", bytes(10**6), compress_type=ZIP_DEFLATED), "'zeros.safetensors' is compressed"),
        (named("more.safetensors"), "'more.safetensors' is not listed: manifest.json lists 1 file"),
        (named("a.safetensors"), "it holds a file twice: 'a.safetensors'"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_what_no_archive_of_the_lab_holds(
    refused: Callable[..., str], make_policy: Make, extra: tuple[ZipInfo, bytes], said: str
) -> None:
    assert said in refused([*entries_of(make_policy(name="a")), extra])


def test_what_is_no_archive_of_the_lab(refused: Callable[..., str], make_policy: Make, tmp_path: Path) -> None:
    assert "it is no zip file, or a damaged one" in refused(b"")
    assert "it is no zip file, or a damaged one" in refused(encode(make_policy(name="a")))
    assert "it holds no manifest.json: it is no archive of the lab" in refused(entries_of(make_policy(name="a"))[1:])
    for path, said in (("nowhere.zip", "there is no such file"), ("", "it is no regular file")):
        with pytest.raises(BadInput, match=said):
            unpack(tmp_path / path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda head: head.update(format="teaching-lab-archive-2"), "has the format 'teaching-lab-archive-2', allowed"),
        (lambda head: head.pop("format"), "has the format 'None'"),
        (lambda head: head.update(files=7), "manifest.json: files: Input should be a valid array"),
        (lambda head: head["files"][0].update(run="me"), "manifest.json: files.0.run: Extra inputs are not permitted"),
        (lambda head: head["files"][0].update(bytes=3), "manifest.json says 3"),
        (lambda head: head["files"][0].update(sha256="0" * 64), "manifest.json says 000000000000..."),
        (lambda head: head["files"][0].update(name="b"), "holds the policy 'a', manifest.json says 'b'"),
        (lambda head: head["files"].append(head["files"][0]), "manifest.json lists a file twice: 'a.safetensors'"),
        (lambda head: head["files"].append({**head["files"][0], "file": "b"}), "lists a policy twice: 'a'"),
        (lambda head: head["files"].append({**head["files"][0], "file": "b", "name": "b"}), "'b' is missing"),
    ],
)
def test_a_manifest_that_lies(
    refused: Callable[..., str], make_policy: Make, change: Callable[[Any], None], said: str
) -> None:
    assert said in refused(manifest_changed(entries_of(make_policy(name="a")), change))


def test_a_manifest_that_cannot_be_read(refused: Callable[..., str], make_policy: Make) -> None:
    (manifest, _), *rest = entries_of(make_policy(name="a"))
    for text in (b"{", b"\xff", b"[" * 100_000):
        assert "manifest.json is not valid JSON" in refused([(manifest, text), *rest])
    assert "has the format '[]'" in refused([(manifest, b"[]"), *rest])


def test_a_file_that_is_no_sound_policy(refused: Callable[..., str], make_policy: Make) -> None:
    bad = encode(make_policy(name="a")).replace(b'"shape":[4,2]', b'"shape":[2,4]', 1)
    row = {"file": "a.safetensors", "name": "a", "bytes": len(bad), "sha256": hashlib.sha256(bad).hexdigest()}
    head = {"format": archive.FORMAT, "files": [row]}
    said = refused([named(MANIFEST, json.dumps(head).encode()), named("a.safetensors", bad)])
    assert said.endswith("policy file a.safetensors: policy 'a': visits have shape (4, 2), q has (2, 4)")


def test_an_encrypted_file(refused: Callable[..., str], make_policy: Make) -> None:
    content = bytearray(pack([make_policy(name="a")])[0])
    for mark, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.rindex(mark) + flags] |= 1
    assert "'a.safetensors' is encrypted" in refused(bytes(content))


def test_files_that_share_their_bytes(refused: Callable[..., str], make_policy: Make) -> None:
    """A bomb that needs no compression: every entry of the directory points at the same large file."""
    content = pack([make_policy(name="a", curve=[3] * 9000, guided=[False] * 9000)])[0]
    at = content.rindex(b"PK\x01\x02")
    end = content.rindex(b"PK\x05\x06")
    one = content[at:end]
    many = b"".join(one.replace(b"a.safetensors", b"%c.safetensors" % letter) for letter in b"bcdefgh")
    tail = bytearray(content[end:])
    tail[8:10] = tail[10:12] = (9).to_bytes(2, "little")
    tail[12:16] = (int.from_bytes(tail[12:16], "little") + len(many)).to_bytes(4, "little")
    said = refused(content[:end] + many + bytes(tail))
    assert "they overlap" in said


def test_a_file_without_a_name(refused: Callable[..., str], make_policy: Make) -> None:
    content = pack([make_policy(name="a")])[0]
    at = content.rindex(b"PK\x01\x02")  # the last file of the list at its end
    name = content[at + 28 : at + 30]
    empty = content[: at + 46] + b"\0" + content[at + 47 :]
    assert name != b"\0\0"
    assert "it holds a file without a name" in refused(empty)


def test_too_much(
    refused: Callable[..., str], make_policy: Make, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    content = pack([make_policy(name="a"), make_policy(name="b"), make_policy(name="c")])[0]
    monkeypatch.setattr(archive, "MAX_FILES", 2)
    assert "it holds more than 3 files" in refused(content)
    monkeypatch.setattr(archive, "MAX_BYTES", 100)
    with pytest.raises(BadInput, match="bytes, allowed are 100"):
        unpack(tmp_path / "given.zip")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=300)
@given(st.data())
def test_any_flipped_byte_is_refused_or_harmless(tmp_path: Path, make_policy: Make, data: st.DataObject) -> None:
    policies = [make_policy(name="a"), make_policy(name="b", seed=5)]
    content = bytearray(pack(policies)[0])
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    path = tmp_path / "given.zip"
    path.write_bytes(content)
    try:
        came = unpack(path)
    except BadInput:
        return
    assert [encode(policy) for policy in came] == [encode(policy) for policy in policies]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(st.data())
def test_any_cut_or_padded_archive_is_refused_or_harmless(
    tmp_path: Path, make_policy: Make, data: st.DataObject
) -> None:
    content = pack([make_policy(name="a")])[0]
    cut = content[data.draw(st.integers(0, len(content))) :] if data.draw(st.booleans()) else content
    path = tmp_path / "given.zip"
    path.write_bytes(data.draw(st.binary(max_size=30)) + cut[: data.draw(st.integers(0, len(cut)))])
    try:
        (came,) = unpack(path)
    except BadInput:
        return
    assert encode(came) == encode(make_policy(name="a"))


# ---- into a toolbox -------------------------------------------------------------------------------------------------


def names_in(toolbox: Toolbox) -> dict[str, int]:
    return {row["name"]: row["seed"] for row in toolbox.list()}


def test_new_ones_are_kept_and_the_same_ones_stay(toolbox: Toolbox, make_policy: Make) -> None:
    assert take_in(toolbox, [make_policy(name="a"), make_policy(name="b")], replace=False) == (["a", "b"], [], [])
    assert take_in(toolbox, [make_policy(name="c"), make_policy(name="a")], replace=False) == (["c"], [], ["a"])
    assert names_in(toolbox) == {"a": 0, "b": 0, "c": 0}


def test_another_policy_of_that_name_is_replaced_only_when_asked(toolbox: Toolbox, make_policy: Make) -> None:
    take_in(toolbox, [make_policy(name="a"), make_policy(name="b")], replace=False)
    new = [replace(make_policy(name=name, seed=5), created="2025-01-01T00:00:00+00:00") for name in ("c", "b", "a")]
    with pytest.raises(BadInput, match=r"'b' and 1 more are there already with other content: --replace"):
        take_in(toolbox, new, replace=False)
    assert names_in(toolbox) == {"a": 0, "b": 0}
    assert take_in(toolbox, new, replace=True) == (["c"], ["b", "a"], [])
    assert names_in(toolbox) == {"a": 5, "b": 5, "c": 5}


def test_what_is_replaced_is_in_use_even_if_it_does_worse_and_the_other_is_kept(
    toolbox: Toolbox, make_policy: Make
) -> None:
    take_in(toolbox, [make_policy(name="a")], replace=False)
    take_in(toolbox, [make_policy(name="a", seed=5, solved=False)], replace=True)
    assert names_in(toolbox) == {"a": 5}
    toolbox.rollback("a")
    assert names_in(toolbox) == {"a": 0}


def test_all_or_none_are_kept(toolbox: Toolbox, make_policy: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    take_in(toolbox, [make_policy(name="b")], replace=False)

    def put(self: Toolbox, policy: Policy, whole: Callable[..., Saved] = Toolbox.put) -> Saved:
        if policy.name == "c":
            assert names_in(self) == {"a": 0, "b": 5}
            raise KeyboardInterrupt
        return whole(self, policy)

    monkeypatch.setattr(Toolbox, "put", put)
    with pytest.raises(KeyboardInterrupt):
        take_in(toolbox, [make_policy(name="a"), make_policy(name="b", seed=5), make_policy(name="c")], replace=True)
    assert names_in(toolbox) == {"b": 0}
    found = toolbox.find("insert", "0123456789abcdef")
    assert found is not None
    np.testing.assert_array_equal(found.q, make_policy(name="b").q)


def test_a_toolbox_that_cannot_be_written(tmp_path: Path, make_policy: Make) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match="is a file, a folder is needed"):
        take_in(Toolbox(tmp_path / "file" / "box"), [make_policy(name="a")], replace=False)
