"""Archives of policies: zip files that are written reproducibly and checked completely when they are read."""

import hashlib
import json
import re
import stat
import struct
from collections import Counter
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Annotated, Literal, NamedTuple
from zipfile import ZIP_STORED, BadZipFile, ZipFile, ZipInfo

from annotated_types import Ge
from pydantic import BaseModel, ConfigDict, ValidationError

from lab.errors import BadInput, counted
from lab.files import MOST_BYTES, read_limited
from lab.toolbox.names import SUFFIX, hash_of, slug
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode, encode
from lab.toolbox.registry import Toolbox

FORMAT: Literal["teaching-lab-archive-1"] = "teaching-lab-archive-1"
MANIFEST = "manifest.json"
MAX_BYTES = MOST_BYTES  # of an archive, and of its contents, because nothing in it is compressed
MAX_FILES = 10_000
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the date of every file in an archive: the earliest that the format allows
_PLAIN_NAME = re.compile(r"[a-z0-9][a-z0-9-]*\.safetensors")
_ENCRYPTED = 0x1
_CENTRAL_HEADER = b"PK\x01\x02"  # precedes each entry of a zip file's directory
_BROKEN = (BadZipFile, NotImplementedError, RuntimeError, ValueError, EOFError, OverflowError, OSError, struct.error)

Policies = Sequence[Policy]


class Packed(BaseModel):
    """The row of one file in a manifest."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    file: str
    name: str
    bytes: Annotated[int, Ge(0)]
    sha256: str


class Manifest(BaseModel):
    """The manifest of an archive."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    format: Literal["teaching-lab-archive-1"] = FORMAT
    files: list[Packed]


class TakenIn(NamedTuple):
    """The names of imported policies: new ones, ones that replaced others, ones that were in the toolbox already."""

    imported: list[str]
    replaced: list[str]
    unchanged: list[str]


def pack(policies: Iterable[Policy]) -> tuple[bytes, Manifest]:
    """An archive's bytes, the same for the same policies, and its manifest.

    Raises BadInput if there are no policies, two of the same name, or more than an archive may hold.
    """
    named: dict[str, bytes] = {}
    for policy in policies:
        if policy.name in named:
            raise BadInput(f"archive: two policies are called '{policy.name}'")
        named[policy.name] = encode(policy)
    if not named:
        raise BadInput("archive: there is no policy to export")
    rows = [
        Packed(file=f"{slug(name)}{SUFFIX}", name=name, bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
        for name, content in sorted(named.items())
    ]
    manifest = Manifest(files=rows)
    written = BytesIO()
    with ZipFile(written, "w", ZIP_STORED) as archive:
        archive.writestr(_entry(MANIFEST), json.dumps(manifest.model_dump(), indent=1) + "\n")
        for row in rows:
            archive.writestr(_entry(row.file), named[row.name])
    if written.tell() > MAX_BYTES or len(rows) > MAX_FILES:
        raise BadInput(
            f"archive: {counted(len(rows), 'policy file')} with {written.tell()} bytes, "
            f"allowed {MAX_FILES} with {MAX_BYTES}: name fewer policies"
        )
    return written.getvalue(), manifest


def unpack(path: Path) -> Policies:
    """The policies of an archive, each of them checked; nothing is written.

    Raises BadInput, which names the file and the fault, for anything but a complete archive of the lab.
    """
    content = read_packed(path)
    if content.count(_CENTRAL_HEADER) > MAX_FILES + 1:
        raise BadInput(f"archive {path}: it holds more than {MAX_FILES + 1} files")
    try:
        with ZipFile(BytesIO(content)) as archive:
            entries = archive.infolist()
            for entry in entries:
                _check_entry(entry)
            return _checked(archive, entries, len(content))
    except BadInput as error:
        raise BadInput(f"archive {path}: {error}") from error
    except _BROKEN as error:
        why = "it is no zip file, or a damaged one"
        raise BadInput(f"archive {path}: {why} ({' '.join(str(error).split()) or type(error).__name__})") from error


def take_in(toolbox: Toolbox, policies: Policies, replace: bool) -> TakenIn:
    """The names of the policies, after all of them were saved in a toolbox.

    Raises BadInput if a name is taken by another policy and `replace` is false. On this and any other error none is saved.
    """
    toolbox.check()
    hashes = {row["name"]: row["hash"] for row in toolbox.list()}
    before = {policy.name: hashes[policy.name] for policy in policies if policy.name in hashes}
    unchanged = [policy.name for policy in policies if hash_of(encode(policy)) == before.get(policy.name)]
    coming = [policy for policy in policies if policy.name not in unchanged]
    taken = [policy.name for policy in coming if policy.name in before]
    if taken and not replace:
        are = f" and {len(taken) - 1} more are" if len(taken) > 1 else " is"
        raise BadInput(
            f"toolbox {toolbox.address}: '{taken[0]}'{are} there already with other content: "
            "--replace keeps what is imported in its place"
        )
    done: list[str] = []
    try:
        for policy in coming:
            done.append(policy.name)
            toolbox.promote(policy.name, toolbox.put(policy).hash)
    except BaseException:
        for name in done:
            _put_back(toolbox, name, before.get(name))
        raise
    return TakenIn([policy.name for policy in coming if policy.name not in before], taken, unchanged)


def _put_back(toolbox: Toolbox, name: str, before: str | None) -> None:
    """Puts the version that was in use back in use, or removes the policy if there was none."""
    if before is not None:
        toolbox.promote(name, before)
    elif any(row["name"] == name for row in toolbox.list()):
        toolbox.remove(name)


def _entry(name: str) -> ZipInfo:
    """The entry of a file, with fixed date, permissions and system, so that archives are reproducible."""
    entry = ZipInfo(name, _EPOCH)
    entry.create_system = 3
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    return entry


def read_packed(path: Path) -> bytes:
    """The bytes of a regular file. Raises BadInput if it cannot be read, or is larger than an archive may be."""
    try:
        return read_limited(path, MAX_BYTES)
    except FileNotFoundError:
        raise BadInput(f"file {path}: there is no such file") from None
    except OSError as error:
        raise BadInput(f"file {path}: it cannot be read: {error.strerror or error}") from error


def _check_entry(entry: ZipInfo) -> None:
    """Raises BadInput unless the entry is a regular file with a plain name, neither compressed nor encrypted."""
    name = entry.orig_filename
    if not entry.filename:
        raise BadInput("it holds a file without a name")
    if name.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", name) or name[1:2] == ":":
        raise BadInput(f"'{name}' leads out of the folder that it is unpacked in")
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind == stat.S_IFLNK:
        raise BadInput(f"'{name}' is a symbolic link")
    if entry.is_dir() or kind not in (0, stat.S_IFREG):
        raise BadInput(f"'{name}' is no regular file")
    if name != MANIFEST and not _PLAIN_NAME.fullmatch(name):
        raise BadInput(f"'{name}' is no name of a policy's file: wanted letters, digits and - before {SUFFIX}")
    if entry.flag_bits & _ENCRYPTED:
        raise BadInput(f"'{name}' is encrypted")
    if entry.compress_type != ZIP_STORED or entry.compress_size != entry.file_size:
        raise BadInput(f"'{name}' is compressed: the lab's archives store their files as they are")


def _checked(archive: ZipFile, entries: Sequence[ZipInfo], size: int) -> Policies:
    """The policies of an archive of `size` bytes. Raises BadInput unless it holds exactly what its manifest lists."""
    by_name = {entry.orig_filename: entry for entry in entries}
    if len(by_name) < len(entries):
        raise BadInput(f"it holds a file twice: '{_most_common(entry.orig_filename for entry in entries)}'")
    total = sum(entry.file_size for entry in entries)
    if total > size:
        raise BadInput(f"its files come to {total} bytes, the archive itself has {size}: they overlap")
    if MANIFEST not in by_name:
        raise BadInput(f"it holds no {MANIFEST}: it is no archive of the lab")
    rows = _manifest(archive.read(by_name[MANIFEST])).files
    listed = [row.file for row in rows]
    for what, found in (("file", listed), ("policy", [row.name for row in rows])):
        if len(set(found)) < len(found):
            raise BadInput(f"{MANIFEST} lists a {what} twice: '{_most_common(found)}'")
    for word, names in (("missing", set(listed) - set(by_name)), ("not listed", set(by_name) - {*listed, MANIFEST})):
        if names:
            raise BadInput(f"'{min(names)}' is {word}: {MANIFEST} lists {counted(len(rows), 'file')}")
    return [_policy(archive, by_name[row.file], row) for row in rows]


def _most_common(names: Iterable[str]) -> str:
    return Counter(names).most_common(1)[0][0]


def _manifest(content: bytes) -> Manifest:
    try:
        head = json.loads(content)
        if not isinstance(head, dict) or head.get("format") != FORMAT:
            form = head.get("format") if isinstance(head, dict) else head
            raise BadInput(f"{MANIFEST} has the format {str(form)[:60]!r}, allowed '{FORMAT}'")
        return Manifest.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadInput(f"{MANIFEST}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{MANIFEST} is not valid JSON: {error}") from None


def _policy(archive: ZipFile, entry: ZipInfo, row: Packed) -> Policy:
    """One policy. Raises BadInput unless its bytes and its name are those in the manifest."""
    if entry.file_size != row.bytes:
        raise BadInput(f"'{row.file}' has {entry.file_size} bytes, {MANIFEST} says {row.bytes}")
    content = archive.read(entry)
    digest = hashlib.sha256(content).hexdigest()
    if digest != row.sha256:
        raise BadInput(f"'{row.file}' has the SHA-256 {digest[:12]}..., {MANIFEST} says {row.sha256[:12]}...")
    policy = decode(content, row.file)
    if policy.name != row.name:
        raise BadInput(f"'{row.file}' holds the policy '{policy.name}', {MANIFEST} says '{row.name}'")
    return policy
