"""Measured records in a toolbox."""

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
        assert toolbox.load_record("transfer", "1 -> 3") is None
        assert {where: ok for where, ok, _ in toolbox.verify()}[path] is False
    for bad in ({"x": float("nan")}, {"x": object()}):
        with pytest.raises(BadInput, match="record '1 -> 3'"):
            toolbox.save_record("transfer", "1 -> 3", bad)
