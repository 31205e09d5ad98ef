"""What things in a toolbox are called, and where it is when nobody says."""

import hashlib
import os
import re
from pathlib import Path

FORMAT = "teaching-lab-policy-1"
SUFFIX = ".safetensors"
MAX_SLUG_LENGTH = 60
HASH_DIGITS = 12
SESSIONS = "sessions"  # the folder for the journals of lessons, on this machine
JOURNAL, BEGUN = "events.jsonl", "begun"  # in the folder of a session: its journal, the policy that it went on from
VERSIONS, LOG, TRASH = "versions", "log", "trash"  # the folders in a toolbox
_DEVICE = re.compile(r"con|prn|aux|nul|(com|lpt)\d")  # no name of a file on Windows
_ADDRESS = re.compile(r"[a-z][a-z0-9+.-]*://")


def default_folder() -> Path:
    """The folder "toolbox" in the user's data folder; LAB_TOOLBOX if that names a folder."""
    named = os.environ.get("LAB_TOOLBOX")
    if named and not is_address(named):
        return Path(named)
    from platformdirs import user_data_dir

    return Path(user_data_dir("teaching-lab", appauthor=False)) / "toolbox"


def default_address() -> str:
    """Where the toolbox is when nobody says: LAB_TOOLBOX if it is set, a folder or an address, else the data folder."""
    return os.environ.get("LAB_TOOLBOX") or str(default_folder())


def is_address(text: str) -> bool:
    """Whether it is an address such as s3://bucket/lab, and not a folder."""
    return _ADDRESS.match(text) is not None


def slug(name: str) -> str:
    """A file stem for any name: plain lower-case ones stay, others are cleaned and get a hash that keeps them apart."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:MAX_SLUG_LENGTH]
    if plain and plain == name and not _DEVICE.fullmatch(plain):
        return plain
    return f"{plain or 'policy'}-{hashlib.sha256(name.encode('utf-8', 'replace')).hexdigest()[:10]}"


def hash_of(content: bytes) -> str:
    """What a policy's file is known by: the first 12 hex digits of its SHA-256."""
    return hashlib.sha256(content).hexdigest()[:HASH_DIGITS]
