"""Names and libraries that are loaded when they are touched, by a table."""

import math
import sys

import pytest

from lab import lazy
from lab.lazy import Library, load, loader


def test_a_name_is_found_where_the_table_says() -> None:
    found = loader("mine", {"math": ("pi", "floor as down")})
    assert (found("pi"), found("down")) == (math.pi, math.floor)


def test_a_module_is_loaded_when_one_of_its_names_is_touched(monkeypatch: pytest.MonkeyPatch) -> None:
    found = loader("mine", {"colorsys": ("hsv_to_rgb",), "math": ("pi",)})
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    found("pi")
    assert "colorsys" not in sys.modules
    assert found("hsv_to_rgb")(0.0, 0.0, 1.0) == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("name", ["tau", "floor"])
def test_any_other_name_is_none_of_the_module(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'mine' has no attribute '{name}'"):
        loader("mine", {"math": ("pi", "floor as down")})(name)


def test_a_library_is_loaded_when_one_of_its_names_is_touched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lazy, "LIBRARIES", {"xml": ("xml.sax.saxutils",)})
    for name in [name for name in sys.modules if name.partition(".")[0] == "xml"]:
        monkeypatch.delitem(sys.modules, name)
    library = Library("xml")
    assert "xml" not in sys.modules
    assert library.sax.saxutils.escape("<") == "&lt;"
    assert load(library) is sys.modules["xml"]
    with pytest.raises(AttributeError, match="module 'xml' has no attribute 'dom'"):
        _ = library.dom


def test_a_library_that_is_not_installed_is_missed_when_it_is_touched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lazy, "LIBRARIES", {"not_installed": ("not_installed.part",)})
    with pytest.raises(ModuleNotFoundError, match="No module named 'not_installed'"):
        _ = Library("not_installed").part
