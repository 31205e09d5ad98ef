"""The place at an address that fsspec knows, such as s3://bucket/lab, with a local cache of the files that were read."""

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from datetime import UTC, datetime
from pathlib import Path
from secrets import token_hex
from threading import Thread
from typing import Any, TypeVar

from platformdirs import user_cache_dir, user_data_dir

from lab.errors import BadInput, WorkFailed
from lab.files import write_whole
from lab.lazy import fsspec
from lab.optional import optional
from lab.toolbox.folder_place import MAX_FILE_BYTES, FileState, FolderPlace
from lab.toolbox.names import hash_of, slug

LIMIT_S = 30.0  # for one call
_AT_ONCE = 64  # files that are read in one call
_BUCKETS = {
    "s3",
    "s3a",
    "gs",
    "gcs",
    "az",
    "abfs",
    "abfss",
}  # protocols with buckets, in which folders need not be created
_STAMPS = ("ETag", "etag", "LastModified", "last_modified", "updated", "mtime", "modified", "created", "ino")
_OPTIONS: dict[str, dict[str, Any]] = {
    protocol: {"config_kwargs": {"connect_timeout": 5, "read_timeout": 20, "retries": {"max_attempts": 2}}}
    for protocol in ("s3", "s3a")
}
Result = TypeVar("Result")


class RemotePlace:
    """Files at an address. Sessions are in the local `folder`; the local `cache` may be deleted at any time.

    There is no lock: if two processes put a policy in use at once, `Versions` settles afterwards on the better one. A log is a
    folder of small files, one per event.
    """

    alone = False

    def __init__(self, address: str) -> None:
        self._protocol, _, path = address.partition("://")
        self.address = f"{self._protocol}://{path.rstrip('/')}"
        self.folder, self.cache = (
            Path(kind("teaching-lab", appauthor=False)) / "toolboxes" / slug(self.address)
            for kind in (user_data_dir, user_cache_dir)
        )
        self._fs, self._root = self._connected()

    def _connected(self) -> tuple[Any, str]:
        try:
            with optional(f"toolbox {self.address}"):
                options = {"use_listings_cache": False, **_OPTIONS.get(self._protocol, {})}
                fs, root = fsspec.core.url_to_fs(self.address, **options)
        except BadInput:
            raise
        except Exception as error:
            raise BadInput(f"toolbox {self.address}: {_reason(error)}") from error
        if self._protocol in _BUCKETS and not str(root).strip("/"):
            raise BadInput(f"toolbox {self.address}: it names no bucket, such as {self._protocol}://bucket/lab")
        return fs, str(root).rstrip("/")

    def check(self, to_write: bool = True) -> None:
        if self._listed("") or self._protocol not in _BUCKETS:
            return
        bucket = self._root.partition("/")[0]
        try:
            self._call("reached", self._fs.info, bucket)
        except FileNotFoundError:
            raise BadInput(f"toolbox {self.address}: there is no bucket '{bucket}'") from None
        except WorkFailed as error:
            if not isinstance(error.__cause__, PermissionError):  # a bucket may be writable without being listable
                raise

    def names(self, under: str = "") -> list[str]:
        return list(self.files(under))

    def files(self, under: str = "") -> dict[str, FileState]:
        rows = [row for row in self._listed(under) if row["type"] == "file"]
        return {
            name: FileState(int(row.get("size") or 0), _stamp(row))
            for row in rows
            if not (name := _last(row["name"])).startswith(".")
        }

    def folders(self, under: str) -> list[str]:
        return sorted(_last(row["name"]) for row in self._listed(under) if row["type"] == "directory")

    def tree(self, under: str) -> list[str]:
        try:
            listed: list[str] = self._call("listed", self._fs.find, self._path(under))
        except FileNotFoundError:
            return []
        root = f"{self._root.strip('/')}/".lstrip("/")
        return [path.strip("/").removeprefix(root) for path in listed]

    def _listed(self, under: str) -> list[dict[str, Any]]:
        try:
            rows: list[dict[str, Any]] = self._call("listed", self._fs.ls, self._path(under), detail=True)
        except FileNotFoundError:
            return []
        return [row for row in rows if row["name"].strip("/") != self._path(under).strip("/")]

    def exists(self, name: str) -> bool:
        try:
            self._call("reached", self._fs.info, self._path(name))
        except FileNotFoundError:
            return False
        return True

    def read(self, name: str) -> bytes:
        try:
            state = self._call("read", self._fs.info, self._path(name))
            if state["type"] != "file":
                raise BadInput("it is not a file")
            if state["size"] > MAX_FILE_BYTES:
                raise BadInput(f"it has {state['size']} bytes, allowed {MAX_FILE_BYTES}")
            cached = self._cached(name, _stamp(state))
            if cached is None:
                cached = self._call("read", self._fs.cat_file, self._path(name))
                self._cache(name, _stamp(state), cached)
        except FileNotFoundError:
            raise BadInput("there is no such file") from None
        return cached

    def read_many(self, states: Mapping[str, FileState]) -> Iterator[tuple[str, bytes | BadInput]]:
        missing = []
        for name, state in states.items():
            if (cached := self._cached(name, state.stamp)) is not None:
                yield name, cached
            elif state.size_bytes > MAX_FILE_BYTES:
                yield name, BadInput(f"it has {state.size_bytes} bytes, allowed {MAX_FILE_BYTES}")
            else:
                missing.append(name)
        for first in range(0, len(missing), _AT_ONCE):
            paths = {self._path(name): name for name in missing[first : first + _AT_ONCE]}
            contents = self._call("read", self._fs.cat, list(paths), on_error="return")
            for path, name in paths.items():
                content = contents.get(path)
                if isinstance(content, bytes):
                    self._cache(name, states[name].stamp, content)
                    yield name, content
                elif content is None or isinstance(content, FileNotFoundError):
                    yield name, BadInput("there is no such file")
                else:
                    raise WorkFailed(f"toolbox {self.address} cannot be read: {_reason(content)}")

    def write(self, name: str, content: bytes, drafts: str = "") -> None:
        path = self._path(name)
        if self._protocol not in _BUCKETS:
            self._call("written", self._fs.makedirs, path.rpartition("/")[0], exist_ok=True)
        try:
            self._call("written", self._fs.pipe_file, path, content)
        except FileNotFoundError as error:
            raise WorkFailed(f"toolbox {self.address}: {name} cannot be written: {_reason(error)}") from error

    def move(self, name: str, to: str) -> None:
        content = self.read(name)
        self.write(to, content)
        self._call("moved", self._fs.rm_file, self._path(name))

    def sweep(self, under: str) -> None:
        """Does nothing, because remote files are written atomically."""

    def tidy(self, older_s: float) -> list[str]:
        """Removes leftovers in the local folder; there are none at the address."""
        return FolderPlace(self.folder).tidy(older_s)

    def append(self, name: str, line: bytes) -> None:
        now = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
        self.write(f"{name}/{now}-{token_hex(4)}.json", line)

    def lines(self, name: str) -> list[bytes]:
        events = dict(self.read_many({f"{name}/{event}": state for event, state in self.files(name).items()}))
        return [content for _, content in sorted(events.items()) if isinstance(content, bytes)]

    def lock(self, name: str) -> AbstractContextManager[None]:
        return nullcontext()

    def where(self, name: str) -> str:
        return f"{self.address.removesuffix('/')}/{name}"

    def _path(self, name: str) -> str:
        if ".." in name.split("/"):
            raise BadInput(f"{name}: it leads out of the toolbox {self.address}")
        return f"{self._root}/{name}" if name else self._root

    def _call(self, verb: str, function: Callable[..., Result], *args: Any, **named: Any) -> Result:
        """The result of a function of the file system. Raises WorkFailed if it fails or takes longer than LIMIT_S.

        A FileNotFoundError is raised as it is.
        """
        results: list[Result] = []
        failures: list[BaseException] = []

        def run() -> None:
            try:
                results.append(function(*args, **named))
            except BaseException as error:
                failures.append(error)

        thread = Thread(target=run, daemon=True)  # a hanging call does not keep the process alive
        thread.start()
        thread.join(LIMIT_S)
        if failures and isinstance(failures[0], FileNotFoundError):
            raise failures[0]
        if not results:
            reason = _reason(failures[0]) if failures else f"no answer in {LIMIT_S:g} s"
            raise WorkFailed(f"toolbox {self.address} cannot be {verb}: {reason}") from next(iter(failures), None)
        return results[0]

    def _cached(self, name: str, stamp: str) -> bytes | None:
        """The cached bytes of a file with this stamp, None if there are none; the name of the cached file has their hash."""
        if not stamp:
            return None
        cached = None
        with suppress(OSError):
            for path in self._cache_folder(name).glob(f"{_cache_stem(name, stamp)}-*"):
                content = path.read_bytes()
                if path.name.endswith(hash_of(content)):
                    cached = content
        return cached

    def _cache(self, name: str, stamp: str, content: bytes) -> None:
        if not stamp:
            return
        with suppress(OSError):  # it is only a cache
            folder = self._cache_folder(name)
            folder.mkdir(parents=True, exist_ok=True)
            for old in folder.glob(f"{_cache_stem(name)}-*"):
                old.unlink(missing_ok=True)
            write_whole(folder / f"{_cache_stem(name, stamp)}-{hash_of(content)}", content)

    def _cache_folder(self, name: str) -> Path:
        return self.cache / "files" / _digest(name)[:2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def _cache_stem(name: str, stamp: str = "") -> str:
    return f"{_digest(name)}-{_digest(stamp)}" if stamp else _digest(name)


def _stamp(row: dict[str, Any]) -> str:
    """A stamp that changes with the file; "" if the file system provides none."""
    mark = next((row[mark] for mark in _STAMPS if row.get(mark) is not None), None)
    if isinstance(mark, datetime):
        mark = mark.timestamp()
    return "" if mark is None else f"{row.get('size')}-{mark}"


def _last(path: str) -> str:
    return path.rstrip("/").rpartition("/")[2]


def _reason(error: BaseException) -> str:
    """The text of an error in one line, without credentials in addresses."""
    text = " ".join(str(error).split()) or type(error).__name__
    return re.sub(r"//[^/@\s]+@", "//", text)
