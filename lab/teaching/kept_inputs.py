"""What a session was learned on, kept in its folder: copies of its files, or the problem itself, and versions.

With these a session is replayed on another machine, or after its files were changed. Nothing of them is run, and no name in them
leads out of the folder.
"""

import hashlib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from json import dumps
from pathlib import Path
from platform import python_version
from typing import Annotated, Any, Final, Literal

from pydantic import StringConstraints

from lab.errors import BadInput
from lab.files import code_key, is_file, read_limited, within, write_whole
from lab.learning.problem import Problem
from lab.plugins.code_file import files_taken
from lab.tasks.grid_world import RANDOM
from lab.tasks.record import read_json
from lab.tasks.task_file import find
from lab.teaching import problem_file
from lab.version import __version__

FILE = "versions.json"
FORMAT: Final = "teaching-lab versions 1"
INPUTS = "inputs"  # the folder of the copies
TABLE = "problem.safetensors"  # in it: the problem, where it came from no file
MOST_BYTES = 1 << 20  # of versions.json
MOST_COPIED, MOST_FILES = 32 << 20, 200  # bytes and files of one session
LIBRARIES = ("gymnasium", "numba", "numpy", "opencv-python-headless", "pybullet", "pybullet-arm64", "scipy")
FAMILIES = {"gates": "gate", "learners": "learner", "advisors": "advisor", "problems": "problem", "modules": "module"}
_NAMED = re.compile(r'filename\s*=\s*"([^"]+)"')  # of a mesh in a URDF

Sha256 = Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
CodeHash = Annotated[str, StringConstraints(pattern="^[0-9a-f]{16,64}$")]


@dataclass(frozen=True)
class OwnCode:
    """Code of the user's own that a session ran: the kind of its family, its file's name, and its SHA-256.

    Of a module, sha256 is the key of its source and of what that imports, see `lab.files.code_key`.
    """

    kind: Literal["gates", "learners", "advisors", "problems", "modules"]
    file: str
    sha256: CodeHash


@dataclass(frozen=True)
class CopiedFiles:
    """The copies for one option: the name of the file that it means, and the SHA-256 of that and of the files that it names."""

    file: str
    sha256: dict[str, Sha256]


@dataclass(frozen=True)
class KeptInputs:
    """The content of versions.json.

    inputs: the copies by option, in the folder `inputs/OPTION`; table: the SHA-256 of the problem's file, None if there is none;
    code: own code by the name of the member or module; left_out: what was not copied, and why.
    """

    format: Literal["teaching-lab versions 1"]
    lab: str
    python: str
    libraries: dict[str, str]
    inputs: dict[str, CopiedFiles] = field(default_factory=dict)
    table: Sha256 | None = None
    code: dict[str, OwnCode] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)


# ---- writing -----------------------------------------------------------------------------------------------------------


def keep_inputs(
    folder: Path,
    named: Mapping[str, str],
    problem: Problem | None = None,
    members: Sequence[str] = (),
    module: str = "",
) -> None:
    """Write what a session is learned on into its folder.

    named: the task, world or file of each option that names one; problem: what is learned, if it comes from no file; members:
    names that may be those of own code; module: the module that the session imports, "" for none.
    Raises BadInput if it cannot be written.
    """
    inputs, left_out = dict[str, CopiedFiles](), list[str]()
    try:
        for option, word in named.items():
            contents = _contents(word)
            if not contents:
                continue
            if len(contents) > MOST_FILES or sum(map(len, contents.values())) > MOST_COPIED:
                left_out.append(f"{option} '{word}': more than {MOST_FILES} files or {MOST_COPIED} bytes")
                continue
            for name, content in contents.items():
                _write(folder / INPUTS / option / name, content)
            inputs[option] = CopiedFiles(next(iter(contents)), {name: _sha(text) for name, text in contents.items()})
        table = None if problem is None else problem_file.encode(problem)
        if table is not None:
            _write(folder / INPUTS / TABLE, table)
        elif problem is not None:
            left_out.append(f"problem '{problem.name}': its steps are made by code, or it is too large")
        libraries = {name: found for name in LIBRARIES if (found := _version(name))}
        code = dict(_code(members, module))
        kept = KeptInputs(
            FORMAT,
            __version__,
            python_version(),
            libraries,
            inputs,
            None if table is None else _sha(table),
            code,
            left_out,
        )
        write_whole(folder / FILE, (dumps(asdict(kept), indent=1) + "\n").encode())
    except OSError as error:
        raise BadInput(f"session '{folder}': what it is learned on cannot be kept: {error.strerror or error}") from None


def sha256_of(words: Iterable[str]) -> str:
    """A SHA-256 over the files of tasks, worlds or other files, and over those that they name; the same for none of them."""
    hashes = [sorted((name, _sha(content)) for name, content in _contents(word).items()) for word in words]
    return _sha(dumps(hashes).encode())


def _contents(word: str) -> dict[str, bytes]:
    """The content of a task, world or other file, the first, and of the files in its folder that it names; {} for no file."""
    if word.startswith(RANDOM):
        return {}
    try:
        path = find(word)
    except BadInput:
        return {}
    contents: dict[str, bytes] = {}
    waiting, root = [path.resolve()], path.resolve().parent
    while waiting and len(contents) <= MOST_FILES:
        file = waiting.pop()
        name = file.relative_to(root).as_posix()
        if name in contents:
            continue
        contents[name] = content = read_limited(file, MOST_COPIED)
        for other in _named_in(file, content):
            found = within(root, other, file.parent if file.suffix == ".urdf" else root)
            if found is not None and is_file(found):
                waiting.append(found)
    return contents


def _named_in(file: Path, content: bytes) -> Iterator[str]:
    """What may be names of files in a task file or a URDF."""
    text = content.decode("utf-8", "replace")
    if file.suffix == ".urdf":
        yield from _NAMED.findall(text)
    elif file.suffix == ".toml":
        with suppress(tomllib.TOMLDecodeError, RecursionError):
            yield from (word for word in _texts(tomllib.loads(text)) if Path(word).suffix)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _texts(inner)


def _code(members: Sequence[str], module: str) -> Iterator[tuple[str, OwnCode]]:
    taken = files_taken()
    for name in dict.fromkeys(members):
        if name in taken:
            kind, word = taken[name]
            file = Path(word.rpartition(":")[0])
            yield name, OwnCode(kind, file.name, _sha(read_limited(file)))  # type: ignore[arg-type]  # one of FAMILIES
    if module:
        with suppress(BadInput):
            yield module, OwnCode("modules", module, code_key(module))


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return ""


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)


def _sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


# ---- reading -----------------------------------------------------------------------------------------------------------


def read_inputs(folder: Path) -> KeptInputs | None:
    """What a session's folder says that it was learned on; None for a folder without it. Raises BadInput if it is damaged."""
    path = folder / FILE
    if not is_file(path):
        return None
    return read_json(path, KeptInputs, f"'{path}'", "a file of a session's folder is wanted", MOST_BYTES)


def replaced(folder: Path, kept: KeptInputs, named: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """(the copies by option, a line for each) for the options whose file is gone or is not the one that was learned on.

    named: as in `keep_inputs`. Raises BadInput for a copy that is missing, was changed, or lies outside the folder.
    """
    paths, lines = dict[str, Any](), list[str]()
    for option, copied in kept.inputs.items():
        word = named.get(option)
        if word is None:
            continue
        try:
            now = _contents(word)
        except OSError:
            now = {}
        if {name: _sha(content) for name, content in now.items()} == copied.sha256:
            continue
        why = "is not the one that the session was learned on" if now else "is not here"
        paths[option] = str(_checked(folder, option, copied))
        lines.append(f"'{word}' {why}: the session's own copy is used")
    return paths, lines


def _checked(folder: Path, option: str, copied: CopiedFiles) -> Path:
    """The copy of an option's file, after a check of all its files."""
    place = folder / INPUTS / option
    if copied.file not in copied.sha256 or len(copied.sha256) > MOST_FILES:
        raise BadInput(f"'{folder / FILE}': inputs.{option}: a file of a session's folder is wanted")
    for name, sha256 in copied.sha256.items():
        path = within(place, name) if within(folder, f"{INPUTS}/{option}") == place.resolve() else None
        if path is None:
            raise BadInput(f"'{folder / FILE}': inputs.{option}: '{name}' leads out of the session's folder")
        _content(path, sha256)
    return place / copied.file


def _content(path: Path, sha256: str) -> bytes:
    try:
        content = read_limited(path, MOST_COPIED)
    except OSError as error:
        raise BadInput(f"the session's own copy '{path}' cannot be read: {error.strerror or error}") from None
    if _sha(content) != sha256:
        raise BadInput(f"the session's own copy '{path}' was changed: its SHA-256 is not the one in {FILE}")
    return content


def kept_table(folder: Path, kept: KeptInputs) -> Problem | None:
    """The problem that was kept as a table; None if there is none. Raises BadInput if it is damaged."""
    if kept.table is None:
        return None
    path = within(folder, f"{INPUTS}/{TABLE}")
    if path is None:
        raise BadInput(f"'{folder / INPUTS / TABLE}' leads out of the session's folder")
    return problem_file.decode(_content(path, kept.table), f"the session's own copy '{path}'")


def code_lines(kept: KeptInputs, from_table: bool = False) -> list[str]:
    """A line for each piece of own code that is not here, or is not the one that the session ran, with its SHA-256.

    from_table: whether the problem is that of the session's folder.
    """
    lines, taken = [], files_taken()
    for name, code in kept.code.items():
        what = f"{FAMILIES[code.kind]} '{name}'"
        if code.kind == "modules":
            now = ""
            with suppress(BadInput):
                now = code_key(name)
            if now != code.sha256:
                lines.append(f"{what} is not the one that the session ran ({code.sha256})")
        elif name not in taken:
            instead = ": the session's own copy of it is used" if from_table and code.kind == "problems" else ""
            lines.append(f"{what} is not here: it came from a file {code.file} with the SHA-256 {code.sha256}{instead}")
        elif _sha(read_limited(Path(taken[name][1].rpartition(":")[0]))) != code.sha256:
            lines.append(f"{what} is not the one that the session ran: its {code.file} had the SHA-256 {code.sha256}")
    return lines


def version_lines(kept: KeptInputs) -> list[str]:
    """A line that names the versions with which the session was made, where others are here; [] if none are."""
    made = {"lab": kept.lab} | kept.libraries
    here = {"lab": __version__} | {name: _version(name) for name in kept.libraries}
    other = [f"{name} {made[name]} ({here[name] or 'none'} here)" for name in made if made[name] != here[name]]
    return [f"the session was made with {', '.join(other)}"] if other else []
