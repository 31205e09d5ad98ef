"""How much longer a run takes than its physics: wall time over the seconds inside `stepSimulation`, of all its processes.

    python -m devtools.step_share [--rounds 5] [TASK] [OPTIONS OF lab run]

A machine that is twice as slow takes twice as long for both, so the ratio compares where seconds do not. Each round runs
`lab run` twice in new interpreters: cold, with an empty toolbox, and warm, with what the first one kept.
"""

import argparse
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CLOCK = """
import mmap, os, struct, sys, time
from importlib.machinery import PathFinder

def clocked(module):
    step, folder = module.stepSimulation, os.environ["STEP_SHARE"]
    path = os.path.join(folder, str(os.getpid()))
    with open(path, "wb") as file:
        file.write(bytes(8))
    file = open(path, "r+b")
    kept, spent = mmap.mmap(file.fileno(), 8), 0.0
    def stepSimulation(*args, **kwargs):
        nonlocal spent
        began = time.perf_counter()
        step(*args, **kwargs)
        spent += time.perf_counter() - began
        struct.pack_into("d", kept, 0, spent)  # at once: a worker may be killed
    module.stepSimulation = stepSimulation

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name != "pybullet":
            return None
        spec = PathFinder.find_spec(name, path, target)
        run = spec.loader.exec_module
        def exec_module(module):
            run(module)
            clocked(module)
        spec.loader.exec_module = exec_module
        return spec

sys.meta_path.insert(0, Finder)
"""


def measured(arguments: list[str], folder: Path, toolbox: Path) -> tuple[float, float]:
    """Wall time [s] of one `lab run`, and the seconds that its processes spent in physics steps."""
    clocks = Path(tempfile.mkdtemp(dir=folder))
    environment = os.environ | {"STEP_SHARE": str(clocks), "LAB_TOOLBOX": str(toolbox)}
    environment["PYTHONPATH"] = os.pathsep.join([str(folder / "clock"), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [
        sys.executable,
        "-c",
        "from lab.cli import main; main()",
        "run",
        *arguments,
        "--out",
        str(clocks / "out"),
    ]
    began = time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wall_s = time.perf_counter() - began
    return wall_s, sum(struct.unpack("d", path.read_bytes())[0] for path in clocks.iterdir() if path.is_file())


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> None:
    """Print a line for each run, and the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    known, rest = parser.parse_known_args()
    ratios: dict[str, list[float]] = {"cold": [], "warm": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "clock").mkdir()
        (folder / "clock" / "sitecustomize.py").write_text(CLOCK, encoding="utf-8")
        for number in range(known.rounds):
            for kind, values in ratios.items():
                wall_s, steps_s = measured(rest or ["toast"], folder, folder / f"toolbox-{number}")
                values.append(wall_s / steps_s)
                _say(f"{kind}  {wall_s:6.2f} s  {steps_s:6.2f} s in steps  {values[-1]:.2f}")
    for kind, values in ratios.items():
        _say(f"{kind}: median {statistics.median(values):.2f}, from {min(values):.2f} to {max(values):.2f}")


if __name__ == "__main__":
    main()
