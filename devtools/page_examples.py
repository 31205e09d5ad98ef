"""Runs the examples on a page of the documentation one after the other, with the standard library alone."""

import re
import subprocess
import sys
from pathlib import Path

BLOCK = re.compile(r"^```(python|sh)\n(\S.*?)^```", re.MULTILINE | re.DOTALL)  # indented blocks are fragments, not run
COMMANDS_RUN = ("lessons", "quickstart")  # the folders of pages whose commands are run, too


def run(page: Path) -> None:
    """Run a page's Python in this process and, for pages of COMMANDS_RUN, its commands in a shell, in the working folder.

    Raises whatever the page's Python raises, and AssertionError with the output of a command that fails.
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
