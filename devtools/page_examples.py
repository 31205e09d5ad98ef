"""The examples on a page of the documentation: found, and run one after the other. Uses nothing that is not in every Python."""

import re
import subprocess
import sys
from pathlib import Path

BLOCK = re.compile(r"^```(python|sh)\n(\S.*?)^```", re.MULTILINE | re.DOTALL)  # one that begins indented is a fragment
COMMANDS_RUN = ("lessons", "quickstart")  # folders whose commands are run, too


def run(page: Path) -> None:
    """Runs a page's Python in this process and, in some folders, its commands in a shell; in the working folder.

    Whatever its Python raises; AssertionError, with what it said, when a command fails.
    """
    names: dict[str, object] = {"__name__": page.stem}
    for kind, block in BLOCK.findall(page.read_text(encoding="utf-8")):
        if kind == "python":
            exec(compile(block, str(page), "exec"), names)
        elif page.parent.name in COMMANDS_RUN:
            ran = subprocess.run(["bash", "-euo", "pipefail", "-c", block], capture_output=True, text=True, check=False)
            if ran.returncode:
                raise AssertionError(f"{page.name}: exit {ran.returncode}: {block}{ran.stderr[-2000:]}")


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        run(Path(argument))
