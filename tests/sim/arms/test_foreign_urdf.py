"""URDFs of arms from elsewhere: where they are settled."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lab.sim.arms import foreign_urdf


@pytest.mark.skipif(sys.platform == "win32", reason="there a process cannot be asked after without ending it")
def test_folders_of_processes_that_are_gone_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of a process that ended; kept: one of this process, one whose name says none, and a link."""
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    kept = [tmp_path / f"lab-arms-{os.getpid()}-a", tmp_path / "lab-arms-mine-b"]
    for folder in (*kept, tmp_path / f"lab-arms-{gone.pid}-c"):
        folder.mkdir()
    (tmp_path / f"lab-arms-{gone.pid}-link").symlink_to(kept[1])
    monkeypatch.setattr(foreign_urdf, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with foreign_urdf._folder.__wrapped__() as mine:
        left = {path.name for path in tmp_path.iterdir()}
        assert left == {*(path.name for path in kept), f"lab-arms-{gone.pid}-link", Path(mine).name}
