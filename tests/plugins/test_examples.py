"""The examples, as an outsider uses them: from a file, from an installed package, and held to the contracts that ship."""

import os
import subprocess
import sys
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

from lab.testing import check_advisor, check_doubt, check_gate, check_learner, check_sequencer, check_study

EXAMPLES = Path(__file__).resolve().parent.parent.parent / "examples"
RUN = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"


def loaded(name: str) -> Any:
    spec = spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def lab(folder: Path, *words: str, on_path: Path | None = None) -> "subprocess.CompletedProcess[str]":
    """The command in a process of its own, with a folder of installed packages on its path."""
    places = [str(EXAMPLES.parent), *([] if on_path is None else [str(on_path), str(EXAMPLES)])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(places), "COLUMNS": "200"}
    environment["LAB_TOOLBOX"] = str(folder / "toolbox")
    return subprocess.run(
        [sys.executable, "-c", RUN, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example package as pip leaves it, and beside it a package with a member that cannot be loaded in each family."""
    site = tmp_path_factory.mktemp("site")
    points = tomllib.loads((EXAMPLES / "plugin" / "pyproject.toml").read_text())["project"]["entry-points"]
    faulty = {
        "teaching_lab.gates": {"no-module": "nowhere:Gate", "no-gate": "own_study:hints", "ccrl": "own_gate:WhileLost"},
        "teaching_lab.learners": {"no-learner": "own_gate:WhileLost"},
        "teaching_lab.advisors": {"no-advisor": "own_gate:WhileLost"},
        "teaching_lab.doubts": {"no-doubt": "own_gate:WhileLost", "distance": "own_doubt:Hesitation"},
        "teaching_lab.sequencers": {"no-method": "own_gate:NoSuchThing"},
        "teaching_lab.studies": {"no-study": "own_gate:WhileLost"},
        "teaching_lab.skills": {"no-skill": "own_study:hints"},
    }
    for name, groups in {"lab_extras": points, "faulty": faulty}.items():
        info = site / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [
            f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in own.items())
            for group, own in groups.items()
        ]
        (info / "entry_points.txt").write_text("\n".join(lines))
    return site


def test_each_is_short() -> None:
    for path in sorted(EXAMPLES.glob("**/own_*.py")):
        assert len(path.read_text().splitlines()) < 40, path


def test_each_keeps_its_contract() -> None:
    check_gate(loaded("own_gate").WhileLost)
    check_advisor(loaded("own_advisor").towards_the_goal)
    check_doubt(loaded("own_doubt").Hesitation)
    check_learner(loaded("own_learner").ExpectedSarsa)
    check_sequencer(loaded("own_sequencer").last_first)
    check_study(loaded("own_study").hints)


def test_a_file_is_enough(tmp_path: Path) -> None:
    words = "--gate", f"{EXAMPLES}/own_gate.py:WhileLost", "--learner", f"{EXAMPLES}/own_learner.py:ExpectedSarsa"
    ran = lab(tmp_path, "teach", "world-1", *words, "--episodes", "20", "--json")
    assert '"gate": "own_gate.WhileLost"' in ran.stdout
    assert ran.stderr.count("lab: runs the code of ") == 2


def test_an_installed_package_is_known_everywhere(package: Path, tmp_path: Path) -> None:
    told = lab(tmp_path, "teach", "--help", on_path=package)
    for name in ("while-lost: Asks while the last five", "expected-sarsa", "towards-the-goal", "return"):
        assert name in told.stdout
    words = "--gate", "while-lost", "--learner", "expected-sarsa", "--advisor", "towards-the-goal"
    taught = lab(tmp_path, "teach", "world-1", *words, "--episodes", "30", "--json", on_path=package)
    assert '"advisor": "towards-the-goal"' in taught.stdout, taught.stderr
    wrong = lab(tmp_path, "teach", "world-1", "--gate", "while-lots", on_path=package)
    assert "did you mean 'while-lost'?" in wrong.stderr
    ordered = lab(tmp_path, "sequence", "toast", "--case", "II", "--method", "last-first", "--json", on_path=package)
    assert '"method": "last-first"' in ordered.stdout, ordered.stderr
    assert "How many hints" in lab(tmp_path, "study", "list", on_path=package).stdout
    assert "hesitation" in lab(tmp_path, "clone", "--help", on_path=package).stdout


def test_what_is_faulty_is_named_and_left_out(package: Path, tmp_path: Path) -> None:
    told = lab(tmp_path, "teach", "--help", on_path=package)
    assert told.returncode == 0
    lines = told.stderr.splitlines()
    for name, why in (
        ("no-module", "ModuleNotFoundError: No module named 'nowhere'"),
        ("no-gate", "wanted a subclass of lab.Gate"),
        ("ccrl", "the name 'ccrl' is taken"),
        ("no-learner", "wanted a subclass of lab.Update"),
        ("no-advisor", "wanted a function of a request"),
        ("no-skill", "wanted a subclass of lab.skills.Skill"),
    ):
        (line,) = (line for line in lines if f"'{name}' of package 'faulty'" in line)
        assert line.startswith("lab: ")
        assert line.endswith(why) or why in line
        assert name == "ccrl" or f" {name}," not in told.stdout
    told = lab(tmp_path, "clone", "--help", on_path=package)
    assert "'no-doubt' of package 'faulty' (own_gate:WhileLost) is left out: " in told.stderr
    assert (
        "'distance' of package 'faulty' (own_doubt:Hesitation) is left out: the name 'distance' is taken" in told.stderr
    )
    assert lab(tmp_path, "--help", on_path=package).stderr == ""
    quiet = lab(tmp_path, "teach", "world-1", "--gate", "ccrl", "--episodes", "5", on_path=package)
    assert "package" not in quiet.stderr  # what ships is found without looking


def test_a_session_with_ones_own_code_is_told_again_when_it_is_named(tmp_path: Path) -> None:
    gate = f"{EXAMPLES}/own_gate.py:WhileLost"
    assert (
        lab(tmp_path, "teach", "world-1", "--gate", gate, "--episodes", "20", "--out", "kept", "--json").returncode == 1
    )
    refused = lab(tmp_path, "replay", "kept", "--json")
    assert "its code is not run unasked" in refused.stderr.replace("whose code is not", "its code is not")
    assert refused.returncode == 2
    told = lab(tmp_path, "replay", "kept", "--own", gate, "--json")
    assert told.returncode == 0, told.stderr


def test_whose_code_failed_is_said(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import lab\nclass Mine(lab.Gate):\n    def opens(self, episode, steps):\n        return 1 / 0\n"
    )
    ran = lab(tmp_path, "teach", "world-1", "--gate", "./mine.py:Mine")
    assert ran.returncode == 1
    assert (
        ran.stderr.splitlines()[-1] == "lab: the code of mine.py failed in line 4: ZeroDivisionError: division by zero"
    )
