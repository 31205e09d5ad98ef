"""`lab operate --page` with nobody at a terminal: the page's commands go on after the pipe has ended, until it is left."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

Opens = Callable[..., AbstractContextManager[Any]]
CODE = "import sys; sys.argv[0] = 'lab'; from lab.cli import main; main()"


def test_the_page_operates_after_the_end_of_the_pipe(opens: Opens, root: Path, tmp_path: Path) -> None:
    words = ["operate", "toast", "--toasts", "1", "--page", "--speed", "max", "--json", "--out", str(tmp_path)]
    with subprocess.Popen(
        [sys.executable, "-c", CODE, *words],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as ran:
        assert ran.stdin is not None
        assert ran.stderr is not None
        ran.stdin.write("gresp\n")  # refused: that ends no session with a page
        ran.stdin.close()
        ran.stdin = None
        url = next(found[0] for line in ran.stderr if (found := re.search(r"http://\S+token=\S+", line)))
        with opens(SimpleNamespace(url=url)) as page:
            page.hear_until(lambda seat: seat.get("run") and seat["run"]["said"] == 1 and not seat["run"]["busy"])
            assert "insert" in page.seat["run"]["names"]["learn"]
            page.say({"command": "jog +z 20"})
            page.hear_until(lambda seat: seat["run"]["said"] == 2)
            page.say({"command": "quit"})
            out, _ = ran.communicate(timeout=60)
    assert ran.returncode == 0
    assert [(row["words"], bool(row["refused"])) for row in json.loads(out)["commands"]] == [
        ("gresp", True),
        ("jog +z 20", False),
    ]
