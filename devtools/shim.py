"""The shim under a command (`write_shim.c`): what it writes is counted, and at a chosen call it is killed or refused."""

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
    """What befalls a command: at which call of which kinds (letters), and what: see `write_shim.c`; always: from then on."""

    kinds: str
    at: int
    what: str
    always: bool = False

    def __str__(self) -> str:
        names = " or ".join(name for name, letter in KINDS.items() if letter in self.kinds)
        done = f"errno {self.what}{' from then on' * self.always}" if self.what.isdigit() else f"killed {self.what}"
        return f"{names} {self.at}: {done}"


def built(folder: Path) -> Path:
    """The shim as a library in a folder; RuntimeError, in a line, where it cannot be compiled."""
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


def shimmed(library: Path, under: Path, counts: Path, strike: Strike | None = None) -> dict[str, str]:
    """What the environment of a command says to the shim; `counts`: the file that it counts in, made anew."""
    counts.write_bytes(bytes(_COUNTS.size))
    said = {"LD_PRELOAD": str(library), "LAB_SHIM_UNDER": str(under.resolve()), "LAB_SHIM_COUNTS": str(counts)}
    if strike is not None:
        said |= {"LAB_SHIM_KINDS": strike.kinds, "LAB_SHIM_AT": str(strike.at), "LAB_SHIM_DO": strike.what}
        said |= {"LAB_SHIM_ALWAYS": "1"} if strike.always else {}
    return said


def counted(counts: Path) -> dict[str, int]:
    """How many calls of each kind were made, by its letter."""
    return dict(zip(KINDS.values(), _COUNTS.unpack(counts.read_bytes()), strict=False))
