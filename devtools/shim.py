"""The shim under a command (`write_shim.c`), which counts its writes, and kills it or refuses a call at a chosen call."""

import shutil
import struct
import subprocess
from dataclasses import dataclass
from pathlib import Path

KINDS = {
    "open": "o",
    "write": "w",
    "sync": "s",
    "rename": "r",
    "unlink": "u",
    "make a folder": "m",
    "cut": "t",
    "link": "l",
}
_COUNTS = struct.Struct(f"{len(KINDS) + 1}I")


@dataclass(frozen=True)
class Strike:
    """A disturbance of a command. kinds: letters of KINDS; at: the number of the call among these, from 1.

    what: "before", "after" or "half", when it is killed, or an errno that the call gives; always: also at later calls.
    """

    kinds: str
    at: int
    what: str
    always: bool = False

    def __str__(self) -> str:
        names = " or ".join(name for name, letter in KINDS.items() if letter in self.kinds)
        done = f"errno {self.what}{' from then on' * self.always}" if self.what.isdigit() else f"killed {self.what}"
        return f"{names} {self.at}: {done}"


def built_shim(folder: Path) -> Path:
    """The path of the shim's library, which is compiled into a folder once. Raises RuntimeError if that fails."""
    library, compiler = folder / "write_shim.so", shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError(
            "the shim must be compiled, and there is no gcc: install one (apt-get install gcc libc6-dev)"
        )
    if not library.exists():
        source, half = Path(__file__).with_name("write_shim.c"), library.with_suffix(".half")
        made = subprocess.run(
            [compiler, "-O2", "-shared", "-fPIC", "-o", half, source, "-ldl"], capture_output=True, text=True
        )
        if made.returncode:
            raise RuntimeError(f"the shim cannot be compiled: {' '.join(made.stderr.split())[:300]}")
        half.replace(library)
    return library


def shim_environment(library: Path, under: Path, counts: Path, strike: Strike | None = None) -> dict[str, str]:
    """The environment variables that load and instruct the shim; counts: the file of its counters, which is reset."""
    counts.write_bytes(bytes(_COUNTS.size))
    said = {"LD_PRELOAD": str(library), "LAB_SHIM_UNDER": str(under.resolve()), "LAB_SHIM_COUNTS": str(counts)}
    if strike is not None:
        said |= {"LAB_SHIM_KINDS": strike.kinds, "LAB_SHIM_AT": str(strike.at), "LAB_SHIM_DO": strike.what}
        said |= {"LAB_SHIM_ALWAYS": "1"} if strike.always else {}
    return said


def shim_counts(counts: Path) -> dict[str, int]:
    """The number of calls of each kind, by its letter."""
    return dict(zip(KINDS.values(), _COUNTS.unpack(counts.read_bytes()), strict=False))
