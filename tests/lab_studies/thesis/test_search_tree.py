"""The picture of a search tree: all nodes with their words, where they should be, the way to the optimum bold."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Stage, Station
from lab_studies.thesis import search_tree as tree
from lab_studies.thesis.search_tree import Branch, branch_picture, branches_of

SVG = "{http://www.w3.org/2000/svg}"
# Two parts: 1 first is best (9 s), 2 first is cut off later or reached again.
SMALL = (
    Branch(None, "start", "0 s", "both in", optimal=True),
    Branch(0, "a 1 > oven", "2 s", "1 in oven", optimal=True),
    Branch(1, "a 1 > out", "9 s", "all out", "finished", True),
    Branch(1, "a 2 > buffer", "5 s", "2 in buffer", "dominated"),
    Branch(0, "a 2 > oven", "3 s", "2 in oven"),
    Branch(4, "a 2 > out", "10 s", "1 left", "bound"),
    Branch(4, "a 1 > buffer", "6 s", "none can move", "deadlock"),
    Branch(4, "a 1 > cellar", "7 s", "dark there", "too dark"),
)


def words(path: Path) -> tuple[list[str], list[str]]:
    """The texts and the tooltips of an SVG file."""
    root = ElementTree.parse(path).getroot()
    texts = ["".join(text.itertext()).strip() for text in root.iter(f"{SVG}text")]
    return texts, [title.text or "" for title in root.iter(f"{SVG}title")]


def drawn(folder: Path, branches: Sequence[Branch], near: bool = False) -> tuple[list[str], list[str]]:
    (folder / "tree.svg").write_bytes(branch_picture(branches, title="the tree", near=near))
    return words(folder / "tree.svg")


def chain(length: int, leaves: int) -> list[Branch]:
    """Moves one after the other, each with so many ways that were cut off."""
    branches = [Branch(None, "start", "0 s", "", optimal=True)]
    for move in range(length):
        parent = max(index for index, branch in enumerate(branches) if branch.optimal)
        branches += [Branch(parent, f"cut {move}", "1 s", "", "bound")] * leaves
        branches.append(Branch(parent, f"go {move}", "1 s", "", optimal=True))
    return branches


def test_same_data_same_bytes() -> None:
    assert branch_picture(SMALL) == branch_picture(SMALL)


def test_every_node_has_its_words_and_its_tip(tmp_path: Path) -> None:
    texts, tips = drawn(tmp_path, SMALL)
    assert tips == [branch.says for branch in SMALL]
    assert {"the tree", "start", "a 1 > oven", "2 s", "a 1 > cellar"} <= set(texts)
    assert texts.count("1 move") == texts.count("2 moves") == 2  # above and below
    assert "3 moves" not in texts


def test_the_legend_counts_what_became_of_the_nodes(tmp_path: Path) -> None:
    texts, _ = drawn(tmp_path, SMALL)
    assert {
        "on the way to the optimum (3)",
        "branched (1)",
        "cut off: cannot be better (1)",
        "cut off: the same was reached no later (1)",
        "deadlock (1)",
        "cut off: too dark (1)",
    } <= set(texts)
    assert not [text for text in texts if text.startswith("finished")]


def test_near_the_optimum_the_rest_is_counted(tmp_path: Path) -> None:
    texts, tips = drawn(tmp_path, SMALL, near=True)
    assert tips == ["both in", "1 in oven", "all out", "2 in buffer", "2 in oven"]
    assert "3 s (+3 nodes)" in texts
    assert "0 s" in texts


def test_one_node(tmp_path: Path) -> None:
    texts, tips = drawn(tmp_path, [Branch(None, "start", "0 s", "all out", "finished")])
    assert tips == ["all out"]
    assert "finished, no sooner (1)" in texts


def test_many_leaves_get_small_boxes_with_one_line(tmp_path: Path) -> None:
    texts, _ = drawn(tmp_path, chain(5, 10))
    assert "cut 4, 1 s" in texts
    texts, _ = drawn(tmp_path, chain(1, 3))
    assert {"cut 0", "1 s"} <= set(texts)


def test_a_tree_that_is_too_large(tmp_path: Path) -> None:
    large = chain(1, tree.MAX_NODES)
    with pytest.raises(BadInput, match="3002 nodes: allowed are 3000"):
        drawn(tmp_path, large)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("branches", "says"),
    [
        ([], "no nodes"),
        ([Branch(0, "", "", "")], "node 0 has parent 0"),
        ([SMALL[0], Branch(None, "", "", "")], "node 1 has parent None"),
        ([SMALL[0], Branch(1, "", "", "")], "node 1 has parent 1"),
        ([SMALL[0], Branch(-1, "", "", "")], "node 1 has parent -1"),
    ],
)
def test_what_is_no_tree(tmp_path: Path, branches: list[Branch], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        branch_picture(branches)


@given(st.lists(st.integers(0, 99), max_size=60))
def test_no_two_nodes_share_a_place_and_parents_are_amid_their_children(numbers: list[int]) -> None:
    parents = [None, *(number % (index + 1) for index, number in enumerate(numbers))]
    columns, rows = tree.layout([Branch(parent, "", "", "") for parent in parents])
    assert len(set(zip(columns, rows, strict=True))) == len(parents)
    for index, parent in enumerate(parents[1:], 1):
        assert parent is not None
        assert columns[index] == columns[parent] + 1
    for node in set(parents[1:]):
        own = [row for row, parent in zip(rows, parents, strict=True) if parent == node]
        assert rows[node or 0] == (min(own) + max(own)) / 2
    leaves = [row for index, row in enumerate(rows) if index not in parents]
    assert sorted(leaves) == list(range(len(leaves)))


def test_nodes_of_a_search_in_words(tmp_path: Path) -> None:
    """Two parts in -> oven (10 s) -> out, each move 1 s empty and 2 s loaded: the oven holds one, 1 goes first."""
    stations = (Station("in", "storage", 2), Station("oven", "machine", 1, 10.0), Station("out", "storage", 2))
    table = np.ones((3, 3)) - np.eye(3)
    cell = Cell.alike(stations, (Stage("in"), Stage("oven"), Stage("out")), table, 2 * table, "in", 2)
    nodes = [((), ""), ((1,), ""), ((1, 1), ""), ((2,), "dominated"), ((1, 1, 2), ""), ((1, 1, 2, 2), "finished")]
    branches = branches_of(cell, nodes, (1, 1, 2, 2))
    assert [branch.parent for branch in branches] == [None, 0, 1, 0, 2, 4]
    assert [branch.move for branch in branches[:3]] == ["start", "toast 1 → oven", "toast 1 → out"]
    assert [branch.when for branch in branches] == ["0 s", "2 s", "14 s", "2 s", "17 s", "29 s"]
    assert [branch.optimal for branch in branches] == [True, True, True, False, True, True]
    assert branches[4].says == "after [1, 1, 2], 17 s: toast 1 at out, toast 2 at oven"
    texts, _ = drawn(tmp_path, branches)
    assert {"on the way to the optimum (5)", "cut off: the same was reached no later (1)"} <= set(texts)
    with pytest.raises(BadInput, match=r"node \[1, 1\] comes before its parent \[1\]"):
        branches_of(cell, [((), ""), ((1, 1), "")], ())
    with pytest.raises(BadInput, match="'oven' full"):
        branches_of(cell, [*nodes, ((1, 2), "")], ())
