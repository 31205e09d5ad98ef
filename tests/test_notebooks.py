"""The notebooks in examples/ run from top to bottom, and show pictures and pages."""

import json
import os
import re
import threading
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))


def ran(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The notebook after it was run; the questions of a teaching page are answered with the learner's own choice."""
    import nbformat
    from nbclient import NotebookClient

    class Answering(NotebookClient):
        def process_message(self, msg: dict[str, Any], cell: Any, cell_index: int) -> Any:
            page = re.search('<iframe src="([^"]+)"', msg["content"].get("data", {}).get("text/html", ""))
            if page is not None:
                threading.Thread(target=agree, args=[page[1]], daemon=True).start()
            return super().process_message(msg, cell, cell_index)

    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(folder))
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(folder)}}
    Answering(notebook, timeout=120, kernel_name="python3", resources=resources).execute()
    if kept := os.environ.get("LAB_DOCS_NOTEBOOKS"):  # to be looked at
        nbformat.write(notebook, Path(kept) / path.name)
    return notebook


def agree(url: str) -> None:
    """Answer all questions of the teaching page at an address, until it is closed."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect

    with connect(url.replace("http", "ws").replace("/?", "/frames?"), max_size=None) as socket:
        try:
            while True:
                question = json.loads(socket.recv(timeout=300)).get("seat", {}).get("question")
                if question is not None:
                    socket.send(json.dumps({"answer": {"question": question["number"], "action": question["own"]}}))
        except ConnectionClosed:
            return


def shown_by(notebook: Any) -> list[dict[str, Any]]:
    """What its cells show."""
    return [output["data"] for cell in notebook.cells for output in cell.get("outputs", ()) if "data" in output]


@pytest.mark.filterwarnings("ignore")  # the kernel's own
def test_the_first_lesson_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = shown_by(ran(EXAMPLES / "first_lesson.ipynb", tmp_path, monkeypatch))
    assert any("<iframe srcdoc" in data.get("text/html", "") for data in shown)  # a scene in 3D
    assert any("<svg" in data.get("text/html", "") for data in shown)
    assert any("image/png" in data for data in shown)


@pytest.mark.filterwarnings("ignore")  # the kernel's own
def test_a_lesson_is_taught_in_a_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = ran(EXAMPLES / "be_the_advisor.ipynb", tmp_path, monkeypatch)
    shown = shown_by(notebook)
    assert any("advice: it asked in" in data.get("text/html", "") for data in shown)  # its receipt
    assert any("image/png" in data for data in shown)
    assert "token=" not in json.dumps(notebook)


def test_they_ship_without_outputs() -> None:
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") for cell in cells), path
