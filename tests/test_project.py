"""What the project says of itself: what wheel and sdist take, dependencies, version, the README's set-up commands, .ci/run."""

import os
import re
import subprocess
import sys
import tomllib
from itertools import chain
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest
from packaging.requirements import Requirement

import lab


@pytest.fixture(scope="module")
def project(root: Path) -> dict[str, Any]:
    with (root / "pyproject.toml").open("rb") as file:
        return tomllib.load(file)


def test_wheel_and_sdist_take_both_folders(project: dict[str, Any], root: Path) -> None:
    targets = project["tool"]["hatch"]["build"]["targets"]
    into = targets["wheel"]["force-include"]
    assert into == {name: f"lab/_data/{name}" for name in ("tasks", "assets")}
    assert {f"/{name}" for name in into} < set(targets["sdist"]["include"])
    assert targets["wheel"]["packages"] == ["lab", "lab_studies"]
    assert all((root / name.strip("/")).exists() for name in (*into, *targets["sdist"]["include"]))


def test_dependencies_have_lower_bounds_and_no_upper_ones(project: dict[str, Any]) -> None:
    extras = project["project"]["optional-dependencies"]
    own = project["project"]["name"]
    for line in [*project["project"]["dependencies"], *chain.from_iterable(extras.values())]:
        if line.startswith(own):  # the lab itself, with other extras of its own
            name, _, others = line.removesuffix("]").partition("[")
            assert name == own, line
            assert {*others.split(",")} < extras.keys(), line
        else:
            bounds = line.partition(";")[0]
            assert bounds.count(">=") == 1, line
            assert not set(bounds) & set("<!~,"), line


@pytest.mark.parametrize("machine", ["x86_64", "AMD64", "arm64", "aarch64"])
@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_one_engine_is_installed_on_every_system_and_never_both(
    project: dict[str, Any], version: str, system: str, machine: str
) -> None:
    """Both are the same files, so that two would overwrite each other."""
    here = {"python_version": version, "sys_platform": system, "platform_machine": machine}
    engines = [
        wanted.name
        for wanted in map(Requirement, project["project"]["dependencies"])
        if wanted.name.startswith("pybullet") and wanted.marker is not None and wanted.marker.evaluate(here)
    ]
    plain = system == "linux" and (machine != "x86_64" or version == "3.11")
    assert engines == ["pybullet" if plain else "pybullet-arm64"]


def test_one_version_stands_everywhere(project: dict[str, Any], root: Path) -> None:
    assert "version" in project["project"]["dynamic"]
    assert lab.__version__.count(".") == 2
    assert f"\nversion: {lab.__version__}\n" in (root / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## [{lab.__version__}]" in (root / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("mark", ["run-command", "test-command"])
def test_the_readme_has_each_set_up_command_on_one_line(root: Path, mark: str) -> None:
    _, found, rest = (root / "README.md").read_text(encoding="utf-8").partition(f"<!-- {mark} -->\n```sh\n")
    assert found, f"README.md: no fenced block follows <!-- {mark} -->"
    command = rest.partition("\n```")[0]
    assert "\n" not in command
    assert command.startswith("python3 -m venv ")


def test_each_extra_is_tried_alone(project: dict[str, Any], root: Path) -> None:
    """By .ci/plain_wheel.py; those of developers are tried by all else that .ci/run does, and PyTorch is too large."""
    extras = set(project["project"]["optional-dependencies"])
    assert run_path(str(root / ".ci" / "plain_wheel.py"))["EXTRAS"].keys() == extras - {"docs", "test", "dev", "deep"}


def test_the_newest_python_runs_the_first_case_of_each_test(root: Path) -> None:
    """One of each function in a file, also where it has many: what .ci/run asks for there."""
    assert "--first-cases" in (root / ".ci" / "run").read_text(encoding="utf-8")
    file = Path("tests", "test_errors.py")
    asked = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--collect-only", "-q", "--first-cases"]
    plain = os.environ | {"PYTEST_ADDOPTS": ""}  # those of .ci/run count lines
    ran = subprocess.run([*asked, str(file)], cwd=root, env=plain, capture_output=True, text=True, check=True)
    collected = re.findall(r"::(\w+)", ran.stdout)
    source = (root / file).read_text(encoding="utf-8")
    assert "parametrize" in source
    assert collected == re.findall(r"^def (test_\w+)", source, re.MULTILINE)


def test_an_interpreter_is_found_on_path_and_where_pyenv_keeps_it(root: Path, tmp_path: Path) -> None:
    """One of each version, and none that ends with an error, as pyenv's shims of other versions do."""
    name = f"python3.{sys.version_info[1]}"
    shims, kept = tmp_path / "shims", tmp_path / "versions" / f"{name.removeprefix('python')}.99" / "bin"
    shims.mkdir()
    kept.mkdir(parents=True)
    (shims / name).write_text("#!/bin/sh\nexit 127\n")
    (shims / name).chmod(0o755)
    working = f'#!/bin/sh\nexec "{sys.executable}" "$@"\n'
    (kept / "python3").write_text(working)
    (kept / "python3").chmod(0o755)
    lines = (root / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("pythons()"))
    function = "\n".join(lines[first : lines.index("}", first) + 1])

    def found() -> list[str]:
        ran = subprocess.run(
            ["/bin/bash", "-euo", "pipefail", "-c", f"{function}\npythons"],
            env={"PATH": str(shims), "PYENV_ROOT": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        return ran.stdout.splitlines()

    assert found() == [sys.executable]
    (kept / "python3").unlink()
    assert found() == []
    (shims / name).write_text(working)
    assert found() == [sys.executable]
