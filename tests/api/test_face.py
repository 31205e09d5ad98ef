"""`import lab`: what it lists is there, and it loads nothing before it is touched."""

import subprocess
import sys

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
    assert told == lab._MODULES


def test_importing_it_loads_nothing() -> None:
    code = "import sys, lab; print(sorted({name.partition('.')[0] for name in sys.modules} & {'numpy', 'pydantic', 'numba'}))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
