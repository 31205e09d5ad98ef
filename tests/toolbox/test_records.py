"""Measured records in a toolbox."""

import json
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.toolbox.registry import Toolbox


@pytest.fixture
def toolbox(tmp_path: Path) -> Toolbox:
    return Toolbox(tmp_path / "toolbox")


def test_records(toolbox: Toolbox) -> None:
    assert toolbox.load_record("transfer", "1 -> 3") is None
    path = toolbox.save_record("transfer", "1 -> 3", {"duration_s": 4.25, "loaded": True})
    toolbox.save_record("transfer", "1 - 3", {"duration_s": 9.0})
    assert toolbox.load_record("transfer", "1 -> 3") == {"duration_s": 4.25, "loaded": True}
    assert toolbox.load_record("butter", "1 -> 3") is None
    assert [ok for _, ok, _ in toolbox.verify()] == [True, True]
    for damaged in (
        path.read_bytes()[:-2],
        b"",
        b"[]",
        b'{"record": 1}',
        b'{"kind": 1, "key": 2, "record": {"a": NaN}}',
    ):
        path.write_bytes(damaged)
        with pytest.raises(BadInput, match=r"^record file .*transfer"):
            toolbox.load_record("transfer", "1 -> 3")
        assert {where: ok for where, ok, _ in toolbox.verify()}[path] is False
    for bad in ({"x": float("nan")}, {"x": object()}):
        with pytest.raises(BadInput, match="record '1 -> 3'"):
            toolbox.save_record("transfer", "1 -> 3", bad)


def test_the_keys_of_a_kind(toolbox: Toolbox) -> None:
    """Sorted, as they were given; a damaged record has none."""
    assert toolbox.record_keys("transfer") == []
    for key in ("b c", "a"):
        toolbox.save_record("transfer", key, {})
    toolbox.save_record("butter", "d", {})
    assert toolbox.record_keys("transfer") == ["a", "b c"]
    toolbox.save_record("transfer", "e", {}).write_bytes(b"{")
    assert toolbox.record_keys("transfer") == ["a", "b c"]


def test_an_edited_record_is_known_as_such(toolbox: Toolbox) -> None:
    """However well it reads; one that is only laid out anew is sound."""
    path = toolbox.save_record("transfer", "1 -> 3", {"plate > oven": 4.25, "oven > plate": 3.0})
    whole = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(whole | {"record": dict(reversed(whole["record"].items()))}), encoding="utf-8")
    assert toolbox.load_record("transfer", "1 -> 3") == whole["record"]
    path.write_text(json.dumps(whole | {"record": whole["record"] | {"moon > plate": 4.0}}), encoding="utf-8")
    ((_, sound, why),) = toolbox.verify()
    assert (sound, why) == (False, f"record file {path}: it does not hold what was written: it was changed")
    with pytest.raises(BadInput, match=r"it was changed$"):
        toolbox.load_record("transfer", "1 -> 3")
