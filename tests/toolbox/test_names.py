"""What things in a toolbox are called."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.toolbox.names import default_address, default_folder, is_address, slug
from lab.toolbox.registry import Toolbox


@given(st.text(max_size=120))
def test_file_names_stay_in_the_folder(name: str) -> None:
    stem = slug(name)
    assert stem
    assert set(stem) <= set("abcdefghijklmnopqrstuvwxyz0123456789-")
    assert len(stem) <= 80


def test_different_names_never_share_a_file() -> None:
    assert len({slug(name) for name in ("a b", "a-b", "A-b", "a/b", "../a-b", "a" * 61, "a" * 62, ".", "ü", "ö")}) == 10
    assert slug("insert-2") == "insert-2"


def test_the_default_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path))
    assert default_folder() == Toolbox().folder == tmp_path
    monkeypatch.delenv("LAB_TOOLBOX")
    assert default_folder().parts[-2:] == ("teaching-lab", "toolbox")


def test_the_default_may_be_an_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_TOOLBOX", "memory://box")
    assert default_address() == Toolbox().address == "memory://box"
    assert default_folder().parts[-2:] == ("teaching-lab", "toolbox")
    monkeypatch.delenv("LAB_TOOLBOX")
    assert default_address() == str(default_folder())


def test_addresses_and_folders() -> None:
    assert all(map(is_address, ("s3://bucket/lab", "memory://", "gs://b")))
    assert not any(map(is_address, ("box", "/a/b", "./s3:/b", "C:\\box", "simplecache::s3://b/c")))


@pytest.mark.parametrize("name", ["con", "nul", "aux", "prn", "com1", "lpt9"])
def test_a_device_of_windows_is_no_files_name(name: str) -> None:
    assert slug(name).startswith(f"{name}-")
    assert slug(f"{name}-1") == f"{name}-1"
