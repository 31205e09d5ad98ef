"""`import lab`: what it lists is there, and it loads nothing before it is touched."""

import re
import subprocess
import sys
from collections.abc import Callable

import pytest

import lab


def test_what_is_listed_is_there() -> None:
    for name in lab.__all__:
        assert getattr(lab, name).__module__.startswith("lab.") or name == "Steps", name
    assert sorted(lab.__all__) == sorted(lab._MODULES)
    assert {*lab.__all__} <= {*dir(lab)}


def test_the_lists_for_readers_of_types_are_the_same() -> None:
    """The imports under TYPE_CHECKING name what `__getattr__` finds, from the same modules."""
    import ast
    from pathlib import Path

    tree = ast.parse(Path(str(lab.__file__)).read_text(encoding="utf-8"))
    told = {
        alias.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("lab.")
        for alias in node.names
    }
    assert told == lab._MODULES | {"__version__": "lab.version"}


def test_importing_it_loads_nothing() -> None:
    code = "import sys, lab; print(sorted({name.partition('.')[0] for name in sys.modules} & {'numpy', 'pydantic', 'numba'}))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


MAZE = lab.world("S.#\n..G")
ASKED: dict[str, Callable[[], object]] = {
    "seed -1 (lab.teach): wanted a whole number, at least 0": lambda: lab.teach(MAZE, seed=-1),
    "task 3 (lab.teach): wanted text": lambda: lab.teach("grasp", task=3),  # type: ignore[arg-type]
    "unknown setting 'alpa' (learner and gate): did you mean 'alpha'?": lambda: lab.teach(MAZE, alpa=1),  # type: ignore[call-arg]
    "gates: 3: wanted a name or a class": lambda: lab.teach(MAZE, gate=3),  # type: ignore[arg-type]
    "too many positional arguments: wanted a function of a request": lambda: lab.teach(MAZE, advisor=lambda: 0),  # type: ignore[arg-type]
    "advisor <class 'object'>: wanted a name, a function of a request": lambda: lab.teach(MAZE, advisor=object),  # type: ignore[arg-type]
    "state 6 (world): wanted a whole number, at least 0, below 6": lambda: lab.teach(MAZE).act(6),
    "file 3 (save): wanted a path": lambda: lab.Page("").save(3),  # type: ignore[arg-type]
    "workers 0 (lab.compare): wanted a whole number": lambda: lab.compare(MAZE, workers=0),
    "sessions 0 (lab.study): wanted a whole number": lambda: lab.study("figure-9.4", sessions=0),
    "over 'alpha' (lab.tune): wanted a list of names": lambda: lab.tune(MAZE, over="alpha"),
    "accept 3 (lab.find): wanted a function of a proposal": lambda: lab.find(MAZE, accept=3),  # type: ignore[arg-type]
    "unknown method 'hexq' (--method)": lambda: lab.find(MAZE, method="hexq"),
    "toasts 'two' (lab.run): wanted a whole number": lambda: lab.run(toasts="two"),  # type: ignore[arg-type]
    "override 0 (lab.run): wanted a whole number, at least 10, at most 100": lambda: lab.run(override=0),
    "what 3 (lab.show): wanted a name or file": lambda: lab.show(3),  # type: ignore[arg-type]
    "gap 'a' (lab.sequence): wanted a number": lambda: lab.sequence("toast", gap="a"),  # type: ignore[arg-type]
    "threshold 'a' (watch): wanted a number": lambda: lab.watch(lambda seen: 0, threshold="a"),  # type: ignore[arg-type]
    "caught 5 (calibrate): wanted a number, at least 0, at most 1": lambda: lab.watch(abs).calibrate([], caught=5),
    "name '' (lab.world): wanted 1 to 40 letters": lambda: lab.world("S.G", name=""),
    "start (0.5, 0) (lab.grid): wanted a whole number": lambda: lab.grid((1, 2), [[0, 0]], (0.5, 0), (0, 1)),  # type: ignore[arg-type]
    "goal -1 (lab.Rewards): wanted a number, above 0": lambda: lab.Rewards(goal=-1),
    "successor 'a': wanted an array of int32": lambda: lab.TabularMDP("a", [[0]], [False], [False], 0, ("a",)),  # type: ignore[arg-type]
    "where 3 (lab.Toolbox): wanted a path": lambda: lab.Toolbox(3),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("message", ASKED)
def test_a_wrong_argument_is_refused_in_a_line(message: str) -> None:
    with pytest.raises(lab.BadInput, match=re.escape(message)) as refused:
        ASKED[message]()
    assert len(str(refused.value).splitlines()) == 1
