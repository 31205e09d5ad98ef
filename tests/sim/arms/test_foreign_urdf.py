"""URDFs of arms from elsewhere: where they are settled."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lab.sim.arms import foreign_urdf
from lab.sim.urdf_reader import floats


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


def test_a_quarter_turn_of_few_digits_is_one(tmp_path: Path) -> None:
    """1.5708 and 3.1416 are meant exactly; 1.57 and 0.3 may be what was measured."""
    (tmp_path / "arm.urdf").write_text(
        '<robot name="arm"><link name="foot"/><link name="hand"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        '<joint name="turn" type="revolute"><parent link="foot"/><child link="hand"/>'
        '<origin xyz="0 0 0.1" rpy="-1.5708 3.1416 1.57"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="10" velocity="1"/></joint></robot>'
    )
    origin = foreign_urdf.settled(tmp_path / "arm.urdf", tmp_path).joints["turn"].find("origin")
    assert floats(origin, "rpy", "") == (-np.pi / 2, np.pi, 1.57)
