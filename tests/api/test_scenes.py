"""`lab.show`: what has a scene is shown, what has none is refused."""

import pytest

import lab


def test_a_world_is_a_page_of_its_own() -> None:
    page = lab.show(lab.world("S.\n.G", "square"))
    assert "square; shortest path: 2 moves" in page.html
    assert page.html.startswith("<!DOCTYPE html>")


def test_a_cell_has_no_scene() -> None:
    with pytest.raises(lab.BadInput, match="it is a cell, which has no scene"):
        lab.show("toast-case-2")
