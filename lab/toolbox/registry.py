"""The toolbox: policies with their versions, and JSON records; files are written atomically, damaged ones are never loaded.

Records come first, as functions of a place; then the class `Toolbox`.
"""

import json
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, WorkFailed, check_value, unknown
from lab.files import json_of
from lab.toolbox import deferred
from lab.toolbox.folder_place import FilePlace, FolderPlace, read_file
from lab.toolbox.index import Index, Key, KnownPolicies, Row
from lab.toolbox.names import SUFFIX, TRASH, VERSIONS, default_address, hash_of, is_address, slug

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy
    from lab.toolbox.versions import Saved, Version, Versions


FOLDER = "records"
_SUFFIX = ".json"


def file_of(kind: str, key: str) -> str:
    """The name of a record's file in the toolbox."""
    return f"{FOLDER}/{slug(kind)}/{slug(key)}{_SUFFIX}"


def save(place: FilePlace, kind: str, key: str, record: dict[str, Any]) -> None:
    """Writes a record. Raises BadInput if it has no JSON form."""
    try:
        whole = {"kind": kind, "key": key, "hash": _hash(record), "record": record}
        text = json.dumps(whole, indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise BadInput(f"record '{key}' ({kind}): {error}") from error
    place.write(file_of(kind, key), text.encode())


def load(place: FilePlace, kind: str, key: str) -> dict[str, Any] | None:
    """The record of that kind and key, None if there is none. Raises BadInput if its file is damaged or was edited."""
    file = file_of(kind, key)
    folder, _, name = file.rpartition("/")
    if name not in place.names(folder):
        return None
    whole = _read(place, file)
    record: dict[str, Any] = whole["record"]
    return record if (whole["kind"], whole["key"]) == (kind, key) else None


def keys(place: FilePlace, kind: str) -> list[str]:
    """The keys of the sound records of a kind, sorted."""
    folder, found = f"{FOLDER}/{slug(kind)}", list[str]()
    for name in place.names(folder):
        with suppress(BadInput):
            found.append(str(_read(place, f"{folder}/{name}")["key"]))
    return sorted(found)


def faults(place: FilePlace) -> dict[str, str]:
    """The fault of each record's file by name, "" for sound ones."""
    faulty = {}
    for folder in place.folders(FOLDER):
        for name in sorted(place.names(f"{FOLDER}/{folder}")):
            file = f"{FOLDER}/{folder}/{name}"
            if name.endswith(_SUFFIX):
                try:
                    _read(place, file)
                    faulty[file] = ""
                except BadInput as error:
                    faulty[file] = str(error)
    return faulty


def _read(place: FilePlace, file: str) -> dict[str, Any]:
    try:
        whole = json_of(place.read(file))
    except (BadInput, ValueError, RecursionError) as error:
        raise BadInput(f"record file {place.where(file)}: {error}") from error
    if (
        not isinstance(whole, dict)
        or not isinstance(whole.get("record"), dict)
        or not {"kind", "key", "hash"} <= whole.keys()
    ):
        raise BadInput(f"record file {place.where(file)}: it must hold kind, key, hash and record")
    if whole["hash"] != _hash(whole["record"]):
        raise BadInput(f"record file {place.where(file)}: it does not hold what was written: it was changed")
    return whole


def _hash(record: dict[str, Any]) -> str:
    """The hash of a record, which does not depend on the layout of its file."""
    return hash_of(json.dumps(record, sort_keys=True).encode())


# ---- the toolbox ----------------------------------------------------------------------------------------------------


Rows = list[Row]
Words = list[str]
Report = list[tuple[Path, bool, str]]  # path, whether it is sound, what is wrong
LEFT_S = 600.0  # older drafts are leftovers: no running command takes so long to write a file
_NOT_LISTED = ("action_labels", "shape")
_MOST_NAMED = 12  # the most policies that an error lists; of more, it lists the nearest
_NEAREST = 5


class Toolbox:
    """Policies and records in a folder, or at an address that fsspec knows; a folder is created when something is first saved.

    where: the folder or address, default the user's own toolbox. The name of a policy stands for its version in use. A `Path` in
    `folder` names a file of the toolbox, also if that is remote.
    All methods raise BadInput if the place is no folder, cannot be read or cannot be written, and WorkFailed if it cannot be
    reached.

        >>> import lab, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     toolbox = lab.Toolbox(folder)
        ...     file = lab.teach("world-1", seed=1, episodes=60).keep(toolbox)
        ...     len(toolbox.list()), toolbox.load(file).task
        (1, 'world-1')
    """

    def __init__(self, where: Path | str | None = None):
        self.place = _place_of(where)
        self.folder = self.place.folder
        self.address = self.place.address
        self._root = self.place.where("x")[:-1]
        self._index = Index(self.place)
        self._tidied = False

    def check(self, to_write: bool = True) -> None:
        """Raises unless policies can be saved here or, without `to_write`, unless it can be a toolbox; creates nothing."""
        self.place.check(to_write)

    def save(self, policy: "Policy") -> Path:
        """The file of a policy that is saved now, and put in use unless the one in use is better."""
        return self.folder / self.put(policy).file

    def put(self, policy: "Policy") -> "Saved":
        """The result of saving a policy as `save` does: its file and version, and whether it is in use.

        Raises WorkFailed if a remote toolbox cannot be reached; then the policy is saved in a local folder that the error names.
        """
        if not self._tidied:
            self._tidied = True
            self.place.tidy(LEFT_S)
        try:
            return self._of(slug(policy.name)).put(policy)
        except WorkFailed as error:
            if self.place.alone:
                raise
            beside = Toolbox(self.folder.with_name(f"{self.folder.name}-unsent"))
            raise WorkFailed(f"{error}; it is kept in {beside.save(policy)}") from error

    def load(self, path: Path | str) -> "Policy":
        """The policy in a file of the toolbox or a local file. Raises BadInput, which names it, unless it is a sound policy."""
        check_value("path", path, Path, "Toolbox.load")
        inside = self._inside(path)
        try:
            content = read_file(Path(path)) if inside is None else self.place.read(inside)
        except BadInput as error:
            raise deferred.unreadable(str(path), error) from error
        return deferred.decode(content, str(path))

    def find(self, subtask: str, signature: str, name: str | None = None) -> "Policy | None":
        """The policy of a sub-task for exactly this problem, None if there is none.

        Solved policies come before unsolved ones, then newer ones before older ones. Damaged files are skipped; see `verify`.
        """
        rows = [
            row
            for row in self._rows()
            if (row["subtask"], row["signature"]) == (subtask, signature) and name in (None, row["name"])
        ]
        for row in sorted(rows, key=_worth, reverse=True):
            with suppress(BadInput):  # damaged or gone meanwhile
                return self.load(row["file"])
        return None

    def index(self) -> tuple[KnownPolicies, Words]:
        """(policies, faults): the result of `find` for every (sub-task, signature), and the fault of each damaged file."""
        best: dict[Key, Row] = {}
        for row in self._rows():
            key = (row["subtask"], row["signature"])
            best[key] = max(best.get(key, row), row, key=_worth)
        damaged = [row["damaged"] for row in self._index.rows().values() if "damaged" in row]
        return KnownPolicies(best, self.load), damaged

    def list(
        self,
        *,
        subtask: str | None = None,
        task: str | None = None,
        advisor: str | None = None,
        solved: bool | None = None,
    ) -> Rows:
        """The metadata, without curve and settings, of each sound policy in use, in the order of their files."""
        wanted = {"subtask": subtask, "task": task, "advisor": advisor, "solved": solved}
        filters = {field: value for field, value in wanted.items() if value is not None}
        rows = [row for row in self._rows() if all(row[field] == value for field, value in filters.items())]
        for row in rows:
            for field in _NOT_LISTED:
                del row[field]
        return rows

    def show(self, name: str) -> dict[str, Any]:
        """All metadata of a policy, its versions and its log. Raises BadInput for an unknown name or a damaged file."""
        stem = self._stem(name)
        versions = self._of(stem)
        file = self.place.where(versions.in_use_file)
        content = self._content(versions.in_use_file)
        policy, made = deferred.decode(content, file), hash_of(content)
        events, _ = versions.events()
        kept, sizes = versions.kept(), self.place.files(f"{VERSIONS}/{stem}")
        saved = {str(event.get("hash")): event["time"] for event in reversed(events)}
        return {
            **deferred.described(policy),
            "file": file,
            "version": kept[made].number if made in kept else None if kept else 1,
            "hash": made,
            "lineage": self._lineage(policy),
            "kept_versions": [
                {
                    "version": version.number,
                    "hash": version.hash,
                    "in_use": version.hash == made,
                    "saved": saved.get(version.hash),
                    "bytes": sizes[Path(version.file).name].size_bytes,
                }
                for version in kept.values()
            ],
            "kept_bytes": sum(state.size_bytes for state in sizes.values()),
            "events": events,
        }

    def _lineage(self, policy: "Policy") -> Rows:
        """A row for each ancestor by warm starts, the nearest first: name, hash, scene, and whether it is in this toolbox."""
        lineage: Rows = []
        seen, parent = set(), policy.parent
        while parent and parent not in seen:
            seen.add(parent)
            name, _, digits = parent.rpartition("@")
            versions, ancestor = self._of(slug(name)), None
            with suppress(BadInput):
                if (version := versions.kept().get(digits)) is not None:
                    ancestor = versions.read(version)
                elif (current := versions.in_use()) is not None and current.hash == digits:
                    ancestor = current.policy
            scene = "" if ancestor is None else ancestor.scene
            lineage.append({"name": name, "hash": digits, "scene": scene, "kept": ancestor is not None})
            parent = "" if ancestor is None else ancestor.parent
        return lineage

    def versions(self, name: str) -> "Versions":
        """The versions under a name. Raises BadInput for an unknown name."""
        return self._of(self._stem(name, also_removed=True))

    def promote(self, name: str, version: str) -> "Version":
        """Puts a version in use, given by number or hash, even if it is worse. Raises BadInput if there is no such version."""
        return self.versions(name).promote(version)

    def rollback(self, name: str) -> "Version":
        """Puts the previous version back in use. Raises BadInput if there was none."""
        return self.versions(name).rollback()

    def remove(self, name: str) -> Path:
        """The path of a policy (by name) or of a damaged file (by stem), after its removal; `restore` brings it back."""
        versions = self._of(self._stem(name))
        versions.remove()
        return self.folder / versions.in_use_file

    def restore(self, name: str) -> Path:
        """The path of the policy that was last removed under a name, after it was restored. Raises BadInput if there is none."""
        removed = {file.removesuffix(SUFFIX) for file in self.place.names(TRASH)}
        stem = next((stem for stem in (slug(name), name) if stem in removed), None)
        if stem is None:
            raise unknown("removed policy", name, removed, f"toolbox {self.address}")
        versions = self._of(stem)
        versions.restore()
        return self.folder / versions.in_use_file

    def log(self, name: str) -> Rows:
        """The events of the policies under a name, the oldest first: time, what, version, hash and more."""
        return self.versions(name).events()[0]

    def note(self, name: str, what: str, **facts: object) -> None:
        """Adds an event to the log of the policy in use, or of the version whose `hash` is given.

        An event "evaluated" with `success_percent` counts in the comparison of versions.
        """
        self.versions(name).note(what, **facts)

    def verify(self) -> Report:
        """(path, whether it is sound, the fault or "") for each policy in use and each record.

        Versions and logs have rows only if they are damaged.
        """
        report: Report = []
        stems = {file.removesuffix(SUFFIX) for file in self._files()}
        for stem in sorted(stems | set(self.place.folders(VERSIONS))):
            versions = self._of(stem)
            where = self.place.where(versions.in_use_file)
            if stem in stems:
                reason = ""
                try:
                    content = self._content(versions.in_use_file)
                    deferred.decode(content, where)
                    kept = versions.kept()  # looked up last: a version is kept before it is in use
                    if kept and hash_of(content) not in kept:
                        reason = str(
                            deferred.unreadable(where, ValueError("it is none of the kept versions: it was changed"))
                        )
                except BadInput as error:
                    reason = str(error)
                report.append((self.folder / versions.in_use_file, not reason, reason))
            report += [(self.folder / file, False, reason) for file, reason in versions.faults()]
        checked = faults(self.place).items()
        return report + [(self.folder / file, not reason, reason) for file, reason in checked]

    def repair(self) -> Words:
        """The files and folders that killed commands had left, after their removal."""
        return self.place.tidy(LEFT_S)

    def save_record(self, kind: str, key: str, record: dict[str, Any]) -> Path:
        """The path of a JSON record, such as the measured duration of a transfer, which is saved under its kind and key."""
        save(self.place, kind, key, record)
        return self.folder / file_of(kind, key)

    def load_record(self, kind: str, key: str) -> dict[str, Any] | None:
        """The record of that kind and key, None if there is none. Raises BadInput if its file is damaged or was edited."""
        return load(self.place, kind, key)

    def record_keys(self, kind: str) -> Words:
        """The keys of the sound records of a kind, sorted."""
        return keys(self.place, kind)

    def _content(self, file: str) -> bytes:
        try:
            return self.place.read(file)
        except BadInput as error:
            raise deferred.unreadable(self.place.where(file), error) from error

    def where(self, path: Path) -> str:
        """The full address of a path in the toolbox."""
        inside = self._inside(path)
        return str(path) if inside is None else self.place.where(inside)

    def _inside(self, path: Path | str) -> str | None:
        """The name in the place of a path or an address, None if it is elsewhere."""
        for root in (self._root, f"{self.folder}/"):
            if root and str(path).startswith(root):
                return str(path).removeprefix(root)
        return None

    def _of(self, stem: str) -> "Versions":
        return deferred.Versions(self.place, stem)

    def _rows(self) -> Rows:
        """Copies of the index's sound rows, each with its file."""
        rows = self._index.rows().items()
        return [{**row, "file": self._root + name} for name, row in rows if "damaged" not in row]

    def _files(self) -> set[str]:
        return {name for name in self.place.names() if name.endswith(SUFFIX)}

    def _stem(self, name: str, also_removed: bool = False) -> str:
        """The file stem of a policy in use or, with `also_removed`, of one with versions. Raises BadInput for an unknown name."""
        files = self._files()
        for stem in (slug(name), name):
            if f"{stem}{SUFFIX}" in files:
                return stem
        if also_removed and slug(name) in self.place.folders(VERSIONS):
            return slug(name)
        named = {row["name"]: file for file, row in self._index.rows().items() if "damaged" not in row}
        if name in named:
            return str(named[name]).removesuffix(SUFFIX)
        where = f"toolbox {self.address}"
        if len(named) <= _MOST_NAMED:
            raise unknown("policy", name, named, where)
        near = get_close_matches(name, named, n=_NEAREST, cutoff=0.5)
        hint = f"did you mean '{near[0]}'? near: {', '.join(near)}; " if near else ""
        raise BadInput(f"unknown policy '{name}' ({where}): {hint}lab toolbox list names all {len(named)} policies")


def _place_of(where: Path | str | None) -> FilePlace:
    """The place that a folder or an address names, default the user's own."""
    if where is not None:
        check_value("where", where, Path, "lab.Toolbox")
    text = default_address() if where is None else str(where)
    if text.startswith("file://"):
        text = text.removeprefix("file://")
    if is_address(text):
        return deferred.RemotePlace(text)
    return FolderPlace(Path(text))


def _worth(row: Row) -> tuple[bool, str]:
    return row["solved"], row["created"]
