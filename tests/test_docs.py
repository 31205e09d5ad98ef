"""The documentation's examples are run, page by page, in an empty folder; its tables are those of the code."""

import re
from pathlib import Path

import pytest

import lab
from lab.learning.settings import SETTINGS

DOCS = Path(__file__).resolve().parent.parent / "docs"
BLOCK = re.compile(r"^```python\n(\S.*?)^```", re.MULTILINE | re.DOTALL)  # one that begins indented is a fragment
PAGES = [page for page in sorted(DOCS.glob("**/*.md")) if BLOCK.search(page.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_examples_of_a_page_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": page.stem}
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        exec(compile(block, str(page), "exec"), names)


def test_the_stable_names_are_those_of_the_package() -> None:
    told = (DOCS / "api.md").read_text(encoding="utf-8").split("## Stable names")[1]
    rows = [line.split("|")[1] for line in told.splitlines() if line.startswith("| `")]
    assert sorted(name for row in rows for name in re.findall(r"`(\w+)`", row)) == sorted(lab.__all__)


def test_every_setting_is_told() -> None:
    """docs/settings.md holds a line for each setting of learner and gate, as `lab.learning.settings` describes it."""
    told = (DOCS / "settings.md").read_text(encoding="utf-8").splitlines()
    for name, setting in SETTINGS.items():
        default = str(setting.default).lower() if isinstance(setting.default, bool) else setting.default
        assert f"| `{name}` | {setting.meaning} | {setting.allowed} | {default} |" in told
