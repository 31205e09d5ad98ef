"""Lazy imports of what reads and writes policies, because `lab toolbox list` needs no numpy."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy
    from lab.toolbox.policy_file import decode, described, encode, unreadable
    from lab.toolbox.remote_place import RemotePlace
    from lab.toolbox.versions import Versions, version_of

TABLE = {
    "lab.toolbox.policy": ("Policy",),
    "lab.toolbox.policy_file": ("decode", "described", "encode", "unreadable"),
    "lab.toolbox.remote_place": ("RemotePlace",),
    "lab.toolbox.versions": ("Versions", "version_of"),
}

if not TYPE_CHECKING:  # so that mypy knows the names of the table alone
    __getattr__ = loader(__name__, TABLE)
