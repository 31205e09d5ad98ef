"""Members from a file that the user names: "./mine.py:MyGate"."""

import sys
from collections.abc import Callable, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from os.path import isfile
from pathlib import Path
from typing import Any

from lab.errors import BadInput, unknown
from lab.plugins.family import Family

_files: dict[str, tuple[str, str]] = {}  # name of a member -> kind of its family, and the word that named it


def is_file_word(word: str) -> bool:
    """Whether a word names an object in a file: "./mine.py:MyGate"."""
    path, colon, name = word.rpartition(":")
    return bool(colon) and path.endswith(".py") and name.isidentifier()


def take(
    families: Family[Any] | Sequence[Family[Any]], word: str, tell: Callable[[str], None] = lambda line: None
) -> str:
    """The name "mine.MyGate", under which the object that "./mine.py:MyGate" names is now in the first family that accepts it.

    Any other word is returned unchanged. The file's code runs, after `tell` was called with a line about it, so this is only for
    words that the user has typed. Raises BadInput if there is no such file or object, if its code fails, or if no family
    accepts the object.
    """
    if not is_file_word(word):
        return word
    path, _, name = word.rpartition(":")
    file = Path(path)
    if not isfile(file):
        raise BadInput(f"{word}: there is no file '{path}'")
    member_name = f"{file.stem}.{name}"
    if member_name in _files:
        return member_name
    tell(f"runs the code of {file.resolve()}")
    module = _run(file, word)
    if not hasattr(module, name):
        raise unknown(
            "object", name, [attribute for attribute in vars(module) if not attribute.startswith("_")], str(file)
        )
    faults = []
    for family in [families] if isinstance(families, Family) else families:
        try:
            family.adopted(member_name, getattr(module, name), str(file))
        except BadInput as error:
            faults.append(str(error))
            continue
        _files[member_name] = family.kind, f"{file.resolve()}:{name}"
        return member_name
    raise BadInput(f"{word}: {', or '.join(faults)}")


def from_file(kind: str, name: str, where: str) -> BadInput | None:
    """The error for a name such as "mine.MyGate" whose file was not named in this command; None for any other name."""
    stem, dot, thing = name.partition(".")
    if not (dot and stem.isidentifier() and thing.isidentifier()):
        return None
    again = f"name it again, such as --{kind} ./{stem}.py:{thing}"
    if kind != "rule":  # of a mentor, which no lesson has
        again += f" (lab replay: --own ./{stem}.py:{thing})"
    return BadInput(f"{kind} '{name}' ({where}): it came from a file, whose code is not run unasked: {again}")


def _run(file: Path, word: str) -> Any:
    """The module of a file, whose code is run. Raises BadInput if it fails."""
    called = f"lab_file_{file.stem}"
    spec = spec_from_file_location(called, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[called] = module  # dataclasses look up their own module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[called]
        raise BadInput(f"{word}: its code fails: {type(error).__name__}: {error}") from None
    return module


def files_taken() -> dict[str, tuple[str, str]]:
    """The members from files by name: kind of family, and the word with which another process can `take` them."""
    return dict(_files)
