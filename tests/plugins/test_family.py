"""Families: what ships is found at once, classes have names, names are taken once."""

import warnings

import pytest

from lab.errors import BadInput
from lab.plugins.family import Family, PluginFault, first_line, takes


def doubled(name: str, thing: object) -> str:
    if not isinstance(thing, type):
        raise BadInput("it is no class")
    return thing.__name__ * 2


def made() -> Family[str]:
    return Family("tests", {"own": "row"}, doubled)


def test_what_ships_is_found_and_listed() -> None:
    family = made()
    assert (family["own"], [*family], len(family), "other" in family) == ("row", ["own"], 1, False)
    with pytest.raises(KeyError):
        family["other"]


def test_a_class_is_a_member_by_its_name() -> None:
    family = made()
    assert family.named("own") == "own"
    assert family.named(int) == "int"
    assert family["int"] == "intint"
    assert "int" in family
    assert [*family] == ["own"]  # it is found, and not listed


def test_a_name_is_taken_once() -> None:
    family = made()
    family.adopted("new", int, "test")
    with pytest.raises(BadInput, match="the name 'new' is taken"):
        family.adopted("new", float, "test")
    with pytest.raises(BadInput, match="it is no class"):
        family.adopted("third", 3, "test")
    assert [*family] == ["own", "new"]


class Point:
    """An entry point."""

    dist = None
    value = "somewhere:thing"

    def __init__(self, name: str, thing: object):
        self.name, self._thing = name, thing

    def load(self) -> object:
        if isinstance(self._thing, BaseException):
            raise self._thing
        return self._thing


def test_what_a_package_adds_is_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [Point("new", int), Point("own", int), Point("bad", SystemExit(3))]
    asked = []

    def found(group: str) -> list[Point]:
        asked.append(group)
        return points

    monkeypatch.setattr("importlib.metadata.entry_points", found)
    family = made()
    assert family["own"] == "row"
    assert asked == []
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert [*family] == ["own", "new"]
    assert [one.category for one in told] == [PluginFault] * 2
    assert str(told[0].message) == "tests: 'own' of package '?' (somewhere:thing) is left out: the name 'own' is taken"
    assert [*family, *family] == ["own", "new"] * 2
    assert asked == ["teaching_lab.tests"]


def test_an_entry_point_may_give_many_members(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those before a faulty one stay; the faulty one is named."""
    points = [Point("package", {"first": int, "own": int})]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points)
    family = made()
    with pytest.warns(
        PluginFault, match=r"'own' of package '\?' \(somewhere:thing\) is left out: the name 'own' is taken"
    ):
        assert [*family] == ["own", "first"]


def test_help_and_arguments() -> None:
    assert first_line(Point) == "An entry point"
    assert takes(Point, "name", "thing")
    assert not takes(Point, "name")
