"""The source of a module and of all that it imports, found as the interpreter finds them: in a folder, a wheel or a zip."""

import ast
import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import Any

from platformdirs import user_cache_dir

from lab.errors import WorkFailed
from lab.files import json_of, read_limited, write_whole

MOST_KEPT = 1000  # modules whose imports are kept


@dataclass(frozen=True)
class Sources:
    """The text of each module, by name, and the libraries that these modules import, by the name they import them under."""

    texts: dict[str, str]
    libraries: frozenset[str]


def sources(roots: Sequence[str], without: Sequence[str] = (), *, inside: bool = True) -> Sources:
    """All modules of the roots' own packages that `roots` import, and the packages they lie in.

    `without`: packages and modules that are left out, with what only they import. inside: also what is imported inside
    functions, which may never be loaded. WorkFailed for a module whose source
    cannot be found, such as one that is there compiled only.
    """
    own = {root.partition(".")[0] for root in roots}
    known = _KnownImports()
    pending, texts, libraries = list(roots), dict[str, str](), set[str]()
    while pending:
        module = pending.pop()
        if module in texts or any(module == out or module.startswith(f"{out}.") for out in without):
            continue
        texts[module] = source(module)
        pending += [module.rpartition(".")[0]] if "." in module else []
        for target in known.of(module, texts[module], inside):
            if target.partition(".")[0] in own:
                pending.append(_module(target))
            else:
                libraries.add(target.partition(".")[0])
    known.keep()
    return Sources(dict(sorted(texts.items())), frozenset(libraries - sys.stdlib_module_names))


def source(module: str) -> str:
    """The text of one module; WorkFailed when it cannot be found."""
    spec = find_spec(module)
    text = getattr(spec.loader, "get_source", lambda name: None)(module) if spec is not None else None
    if text is None:
        raise WorkFailed(f"the source of the module '{module}' cannot be found")
    return str(text)


class _KnownImports:
    """What modules import, by their text, kept in the user's cache: to parse a hundred files takes a second.

    Where nothing can be read or written there, they are parsed each time.
    """

    def __init__(self) -> None:
        self._path = Path(user_cache_dir("teaching-lab", appauthor=False), "imports.json")
        self._used: dict[str, list[str]] = {}
        self._new = False
        try:
            found = json_of(read_limited(self._path))
        except (OSError, ValueError):
            found = {}
        self._kept: dict[str, Any] = found if isinstance(found, dict) else {}

    def of(self, module: str, text: str, inside: bool) -> list[str]:
        """The imports of a module with that text."""
        key = hashlib.sha256(f"{module} {inside} {text}".encode()).hexdigest()[:24]
        known = self._kept.get(key)
        if not (isinstance(known, list) and all(isinstance(name, str) for name in known)):
            known, self._new = [*_imports(module, text, inside)], True
        self._used[key] = known
        return known

    def keep(self) -> None:
        """Write what was new, and of the rest the newest."""
        if not self._new:
            return
        newest = dict([*self._kept.items()][-MOST_KEPT:]) | self._used
        with suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self._path, json.dumps(newest).encode())


@lru_cache(maxsize=256)
def _imports(module: str, text: str, inside: bool) -> tuple[str, ...]:
    """Absolute dotted names; of `from a import b` it is 'a.b', whether b is a module or not."""
    tree, found = ast.parse(text), list[str]()
    for node in _seen(tree) if inside else tree.body:
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = f"{'.' * node.level}{node.module or ''}"
            base = resolve_name(base, _package(module)) if node.level else base
            found += [f"{base}.{alias.name}" for alias in node.names]
    return tuple(found)


def _seen(tree: ast.AST) -> Iterator[ast.AST]:
    """What may be run: all but what only a type checker sees."""
    unseen = {id(only) for node in ast.walk(tree) if _is_type_checking(node) for only in ast.walk(node)}
    return (node for node in ast.walk(tree) if id(node) not in unseen)


def _package(module: str) -> str:
    spec = find_spec(module)
    return "" if spec is None else spec.parent or ""


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def _module(name: str) -> str:
    """The module that a dotted name of ours is, or lies in."""
    try:
        return name if find_spec(name) is not None else name.rpartition(".")[0]
    except ModuleNotFoundError:  # what is above it is no package
        return name.rpartition(".")[0]
