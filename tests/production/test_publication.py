"""Cards and folders for the Hub: whole, with pictures that are there, and nothing left of another policy."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, coverage, grid
from lab.production.publication import publish, write_card
from lab.toolbox.hub_folder import read_folder
from lab.toolbox.policy import Origin, Policy
from lab.toolbox.policy_file import encode

Make = Callable[[TabularMDP], Policy]
BOARD = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))


@pytest.fixture
def make() -> Make:
    """A policy that was learned in a problem."""

    def learned(mdp: TabularMDP) -> Policy:
        learner, gate = LearnerSettings(episodes=8, max_steps=20), GateSettings()
        result = Session(mdp, learner, gate, None, np.random.default_rng(0)).run()
        return Policy.of(result, mdp, learner, gate, Origin("butter it", "cover", "toast", "none", 0))

    return learned


def files_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_card_with_its_pictures_and_its_file(tmp_path: Path, make: Make) -> None:
    files = write_card(make(BOARD), [], tmp_path / "new" / "card")
    folder = tmp_path / "new" / "card"
    assert files_in(folder) == {"card.md", "learning-curve.png", "value-map.png", "butter-it-987b1649d9.safetensors"}
    assert {Path(path).name for path in files.values()} == files_in(folder)
    text = (folder / "card.md").read_text()
    assert text.startswith("# butter it\n\nA surface is covered cell by cell, as with butter or by vacuuming.\n")
    for name in files_in(folder) - {"card.md"}:
        assert name in text
    assert "lab toolbox export 'butter it' --out skill.zip\n" in text


def test_a_folder_for_the_hub_is_read_again(tmp_path: Path, make: Make) -> None:
    policy, hub = make(BOARD), tmp_path / "hub"
    publish(policy, [], "apache-2.0", hub)
    pictures = {"learning-curve.png", "value-map.png"}
    assert files_in(hub) == {"README.md", "model.safetensors", "config.json", ".gitattributes"} | pictures
    assert (hub / "README.md").read_text().startswith('---\nlicense: "apache-2.0"\n')
    assert encode(read_folder(hub)) == encode(policy)


def test_no_picture_of_another_policy_is_left(tmp_path: Path, make: Make) -> None:
    (tmp_path / "mine.txt").touch()
    write_card(make(BOARD), [], tmp_path)
    write_card(make(coverage((2, 2))), [], tmp_path)
    assert "mine.txt" in files_in(tmp_path)
    assert "value-map.png" not in files_in(tmp_path)
    assert "Its states are no grid" in (tmp_path / "card.md").read_text()


def test_what_cannot_be_written_is_said_before_anything_is_drawn(tmp_path: Path, make: Make) -> None:
    before = files_in(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match=r"output folder .* is a file; give a folder"):
        write_card(make(BOARD), [], tmp_path / "file")
    with pytest.raises(BadInput, match="licence 'MIT'"):
        publish(make(BOARD), [], "MIT", tmp_path / "new")
    assert files_in(tmp_path) == before | {"file"}
