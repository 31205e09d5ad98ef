"""The shipped folders: found in a checkout and in a wheel, and everything that the build needs is there."""

import tomllib
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

import lab
from lab import files as data
from lab.errors import WorkFailed


@pytest.fixture(scope="module")
def project(root: Path) -> dict[str, Any]:
    with (root / "pyproject.toml").open("rb") as file:
        return tomllib.load(file)


def test_this_checkout_ships_its_tasks_and_assets() -> None:
    assert (data.tasks_folder() / "toast.toml").is_file()
    assert (data.assets_folder() / "robot.urdf").is_file()


@pytest.mark.parametrize("name", ["tasks", "assets"])
def test_a_wheel_carries_its_folders_inside(tmp_path: Path, name: str) -> None:
    package = tmp_path / "site-packages" / "lab"
    inside = package / "_data" / name
    inside.mkdir(parents=True)
    assert data.find(name, package) == inside


def test_a_folder_beside_an_installed_package_is_somebody_elses(tmp_path: Path) -> None:
    package = tmp_path / "lab"
    (tmp_path / "tasks").mkdir()
    with pytest.raises(WorkFailed, match=r"looked for .*_data/tasks and .*install the lab again"):
        data.find("tasks", package)
    (tmp_path / "pyproject.toml").touch()
    assert data.find("tasks", package) == tmp_path / "tasks"


def test_wheel_and_sdist_take_both_folders(project: dict[str, Any], root: Path) -> None:
    targets = project["tool"]["hatch"]["build"]["targets"]
    into = targets["wheel"]["force-include"]
    assert into == {name: f"lab/_data/{name}" for name in ("tasks", "assets")}
    assert {f"/{name}" for name in into} < set(targets["sdist"]["include"])
    assert all((root / name).is_dir() for name in into)


def test_every_file_that_ships_has_an_expected_kind() -> None:
    assert {p.suffix for p in data.tasks_folder().rglob("*") if p.is_file()} == {".toml"}
    assert {p.suffix for p in data.assets_folder().rglob("*") if p.is_file()} <= {
        ".urdf",
        ".obj",
        ".mtl",
        ".png",
        ".svg",
    }


def test_dependencies_have_lower_bounds_and_no_upper_ones(project: dict[str, Any]) -> None:
    extras = project["project"]["optional-dependencies"]
    own = project["project"]["name"]
    for line in [*project["project"]["dependencies"], *chain.from_iterable(extras.values())]:
        if line.startswith(own):  # the lab itself, with other extras of its own
            name, _, others = line.removesuffix("]").partition("[")
            assert name == own, line
            assert {*others.split(",")} < extras.keys(), line
        else:
            assert line.count(">=") == 1, line
            assert not set(line) & set("<!~,"), line


def test_the_version_stands_once(project: dict[str, Any]) -> None:
    assert "version" in project["project"]["dynamic"]
    assert lab.__version__.count(".") == 2


@pytest.mark.parametrize("mark", ["run-command", "test-command"])
def test_the_readme_has_each_set_up_command_on_one_line(root: Path, mark: str) -> None:
    _, found, rest = (root / "README.md").read_text(encoding="utf-8").partition(f"<!-- {mark} -->\n```sh\n")
    assert found, f"README.md: no fenced block follows <!-- {mark} -->"
    command = rest.partition("\n```")[0]
    assert "\n" not in command
    assert command.startswith("python3.11 -m venv ")
