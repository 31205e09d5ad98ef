"""Members from a file that the user names: "./mine.py:MyGate"."""

import sys
from collections.abc import Callable, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from os.path import isfile
from pathlib import Path
from typing import Any

from lab.errors import BadInput, unknown
from lab.plugins.family import Family

_files: dict[str, tuple[str, str]] = {}  # by a member's name: the kind of its family, and the words it was named by


def is_file_word(word: str) -> bool:
    """Whether a word names an object in a file: "./mine.py:MyGate"."""
    path, colon, name = word.rpartition(":")
    return bool(colon) and path.endswith(".py") and name.isidentifier()


def take(
    families: Family[Any] | Sequence[Family[Any]], word: str, tell: Callable[[str], None] = lambda line: None
) -> str:
    """Load the object that "./mine.py:MyGate" names into its family, of several the first that it fits; its name there,
    "mine.MyGate".

    Only for words that the user has typed: its code runs, which `tell` hears before. Any other word is given back as it is.
    BadInput when there is no such file or object, when its code fails, and when it is no member.
    """
    if not is_file_word(word):
        return word
    path, _, name = word.rpartition(":")
    file = Path(path)
    if not isfile(file):
        raise BadInput(f"{word}: there is no file '{path}'")
    own = f"{file.stem}.{name}"
    if own in _files:
        return own
    tell(f"runs the code of {file.resolve()}")
    module = _run(file, word)
    if not hasattr(module, name):
        raise unknown("object", name, [one for one in vars(module) if not one.startswith("_")], str(file))
    faults = []
    for family in [families] if isinstance(families, Family) else families:
        try:
            family.adopted(own, getattr(module, name), str(file))
        except BadInput as error:
            faults.append(str(error))
            continue
        _files[own] = family.kind, f"{file.resolve()}:{name}"
        return own
    raise BadInput(f"{word}: {', or '.join(faults)}")


def from_file(kind: str, name: str, where: str) -> BadInput | None:
    """The error for a name like "mine.MyGate", whose file was not named this time; None for any other name."""
    stem, dot, thing = name.partition(".")
    if not (dot and stem.isidentifier() and thing.isidentifier()):
        return None
    again = f"name it again, such as --{kind} ./{stem}.py:{thing} (lab replay: --own ./{stem}.py:{thing})"
    return BadInput(f"{kind} '{name}' ({where}): it came from a file, whose code is not run unasked: {again}")


def _run(file: Path, word: str) -> Any:
    """The module of a file, which is run."""
    called = f"lab_file_{file.stem}"
    spec = spec_from_file_location(called, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[called] = module  # dataclasses look their own module up
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[called]
        raise BadInput(f"{word}: its code fails: {type(error).__name__}: {error}") from None
    return module


def files_taken() -> dict[str, tuple[str, str]]:
    """The members that came from files, by name: the kind of their family, and the words for `take`, in another process."""
    return dict(_files)
