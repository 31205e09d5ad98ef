"""The documentation's examples are run, page by page, in an empty folder; its tables are those of the code."""

import doctest
import importlib
import os
import re
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

import lab
from devtools.page_examples import COMMANDS_RUN, run
from lab.cli.app import made
from lab.learning.settings import SETTINGS
from lab.skills import Skill
from lab.studies import STUDIES, Study

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
MADE = re.compile(r"^<!-- made: (\S+) -> (\S+) -->\n!\[.*?\]\((\S+)\)", re.MULTILINE)
KEPT = "LAB_DOCS_PICTURES"  # set: the pictures in docs/ are made anew by the pages that show them
PAGES = sorted(DOCS.glob("**/*.md"))
RUN = [page for page in PAGES if page.parent.name in COMMANDS_RUN or "```python\n" in page.read_text(encoding="utf-8")]
SHIM = f"""#!/bin/sh
exec {shlex.quote(sys.executable)} -c "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()" "$@"
"""


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=lambda page: page.stem)
def test_the_examples_of_a_page_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python on every page, commands in lessons and quick starts; the pictures that a page shows are there afterwards."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "lab").write_text(SHIM)
    (tmp_path / "bin" / "lab").chmod(0o755)
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    run(page)
    for made_as, kept, shown in MADE.findall(page.read_text(encoding="utf-8")):
        (file,) = work.glob(made_as)
        assert kept == shown
        assert (page.parent / kept).is_file() or KEPT in os.environ
        if KEPT in os.environ:
            shutil.copy(file, page.parent / kept)


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.stem)
def test_the_commands_on_a_page_can_be_said(page: Path) -> None:
    """Each `lab ...` names a command that there is, with options that it has."""
    top: Any = made()
    for line in re.findall(r"(?:^|`)(lab [^`\n|&]*)", page.read_text(encoding="utf-8"), re.MULTILINE):
        words = shlex.split(line.replace("'\\''", ""), comments=True)[1:]
        if not words or words[0] not in top.commands or words[-1].endswith("\\"):
            continue
        command = top
        while hasattr(command, "commands") and words and words[0] in command.commands:
            command = command.commands[words.pop(0)]
        command = command.load() if hasattr(command, "load") else command
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        for word in words:
            if word.startswith("--"):
                assert word.partition("=")[0] in known | {"--help"}, line


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.stem)
def test_the_pictures_of_a_page_are_there(page: Path) -> None:
    """The site's builder looks for pages and their headings, not for pictures."""
    for shown in re.findall(r"!\[.*?\]\((\S+?)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / shown).is_file(), shown


def test_the_site_has_every_page_and_no_other() -> None:
    told = re.findall(r"^ +- (?:\w+: )?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(told) == [path.relative_to(DOCS).as_posix() for path in PAGES]


def test_the_reference_names_what_is_there() -> None:
    """The builder leaves out, without a word, a member that a module does not have."""
    told = (DOCS / "reference.md").read_text(encoding="utf-8")
    rows = re.findall(r"^::: (\S+)\n    options: \{members: \[(.*)\]\}$", told, re.MULTILINE)
    assert len(rows) == told.count(":::")
    for module, members in rows:
        assert all(hasattr(importlib.import_module(module), name) for name in members.split(", ")), module


def test_the_stable_names_are_those_of_the_package() -> None:
    told = (DOCS / "reference.md").read_text(encoding="utf-8").split("## Stable names")[1]
    rows = [line.split("|")[1] for line in told.splitlines() if line.startswith("| `")]
    assert sorted(name for row in rows for name in re.findall(r"`(\w+)`", row)) == sorted(lab.__all__)


EXAMPLES = {name: getattr(lab, name) for name in lab.__all__ if name != "Steps"} | {"Skill": Skill, "Study": Study}


@pytest.mark.parametrize("name", [name for name, thing in EXAMPLES.items() if ">>>" in (thing.__doc__ or "")])
def test_the_example_of_a_public_name_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path))
    runner = doctest.DocTestRunner()
    (example,) = doctest.DocTestFinder(recurse=False).find(EXAMPLES[name], name, globs={})
    assert runner.run(example).failed == 0


def test_every_public_name_has_an_example() -> None:
    """`Steps` is a type of lists; the errors are caught as `LabError` is; two results are shown where they are made."""
    bare = {name for name, thing in EXAMPLES.items() if ">>>" not in (thing.__doc__ or "")}
    assert bare == {"BadInput", "WorkFailed", "GridWorld", "RunResult"}


def test_every_setting_is_told() -> None:
    """docs/settings.md holds a line for each setting of learner and gate, as `lab.learning.settings` describes it."""
    told = (DOCS / "settings.md").read_text(encoding="utf-8").splitlines()
    for name, setting in SETTINGS.items():
        default = str(setting.default).lower() if isinstance(setting.default, bool) else setting.default
        assert f"| `{name}` | {setting.meaning} | {setting.allowed} | {default} |" in told


def test_every_study_is_told() -> None:
    told = re.findall(r"`([\w.-]+)`", (DOCS / "studies.md").read_text(encoding="utf-8"))
    assert {*STUDIES} <= {*told}
