"""The names of files and folders in a toolbox, and its default place."""

import hashlib
import os
import re
from pathlib import Path

FORMAT = "teaching-lab-policy-1"
SUFFIX = ".safetensors"
MAX_SLUG_LENGTH = 60
HASH_DIGITS = 12
SESSIONS = "sessions"  # the local folder of the journals of lessons
JOURNAL, BEGUN = "events.jsonl", "begun"  # in the folder of a session: its journal, the policy that it continued
VERSIONS, LOG, TRASH = "versions", "log", "trash"  # the folders in a toolbox
_DEVICE = re.compile(r"con|prn|aux|nul|(com|lpt)\d")  # names that no file can have on Windows
_ADDRESS = re.compile(r"[a-z][a-z0-9+.-]*://")


def default_folder() -> Path:
    """The default local folder: LAB_TOOLBOX if that names a folder, otherwise "toolbox" in the user's data folder."""
    named = os.environ.get("LAB_TOOLBOX")
    if named and not is_address(named):
        return Path(named)
    from platformdirs import user_data_dir

    return Path(user_data_dir("teaching-lab", appauthor=False)) / "toolbox"


def default_address() -> str:
    """The default place of the toolbox: LAB_TOOLBOX if it is set (a folder or an address), otherwise the default folder."""
    return os.environ.get("LAB_TOOLBOX") or str(default_folder())


def is_address(text: str) -> bool:
    """Whether the text is an address such as s3://bucket/lab, not a folder."""
    return _ADDRESS.match(text) is not None


def slug(name: str) -> str:
    """A file stem for any name: plain lower-case names are unchanged, others are simplified and get a hash to stay distinct."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:MAX_SLUG_LENGTH]
    if plain and plain == name and not _DEVICE.fullmatch(plain):
        return plain
    return f"{plain or 'policy'}-{hashlib.sha256(name.encode('utf-8', 'replace')).hexdigest()[:10]}"


def hash_of(content: bytes) -> str:
    """The short hash of a policy's file: the first 12 hex digits of its SHA-256."""
    return hashlib.sha256(content).hexdigest()[:HASH_DIGITS]
