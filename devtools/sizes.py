"""Part `sizes`: the largest inputs that somebody may bring; each is rejected soon in a line, or is real work."""

import json
import shutil
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile

from devtools.commands import environment, lab
from devtools.parts import Outcome, Part
from lab.files import tasks_folder

REFUSED_S, REFUSED_MB = 5.0, 1000.0
LONGEST_S, WORK_MB = 900.0, 2000.0  # of real work: a world of a million cells takes 1.8 GB
WORLD = 'kind = "world"\nname = "w"\nshape = [5, 5]\nstart = [0, 0]\ngoal = [4, 4]\n'
TEN_MB = 9_900_000


class Size(NamedTuple):
    """A file, the function that writes it, and the command that reads it."""

    file: str
    write: Callable[[Path], None]
    words: str


def _policy(path: Path) -> None:
    """Write a gigabyte of zeros."""
    with path.open("wb") as file:
        file.truncate(1 << 30)


def _sound_head(path: Path) -> None:
    """Write a policy's header, and a table of a gigabyte of zeros."""
    states = (1 << 30) // 32
    head = {
        "__metadata__": {"format": "teaching-lab-policy-1"},
        "q": {"dtype": "F64", "shape": [states, 2], "data_offsets": [0, states * 16]},
        "visits": {"dtype": "I64", "shape": [states, 2], "data_offsets": [states * 16, states * 32]},
    }
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    with path.open("wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        file.truncate(8 + len(text) + states * 32)


def _many(begin: str, piece: Callable[[int], str], count: int, end: str = "") -> Callable[[Path], None]:
    """The writer of a file of `count` pieces between a begin and an end."""

    def write(path: Path) -> None:
        path.write_text(begin + "".join(map(piece, range(count))) + end, encoding="utf-8")

    return write


def _grid(columns: int, rows: int) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        free = "." * (columns - 1)
        path.write_text(f"S{free}\n" + f".{free}\n" * (rows - 2) + f"{free}G\n", encoding="utf-8")

    return write


def _toast(change: Callable[[str], str]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_text(change((tasks_folder() / "toast.toml").read_text(encoding="utf-8")), encoding="utf-8")

    return write


def _obstacles(count: int) -> Callable[[Path], None]:
    return _toast(
        lambda text: (
            text
            + "".join(
                f'\n[[obstacles]]\nname = "o{i}"\nposition_m = [{0.3 + i % 100 * 0.001}, {0.2 + i // 100 * 0.001}]\n'
                "size_m = [0.01, 0.01, 0.1]\n"
                for i in range(count)
            )
        )
    )


def _workspace(shape: str, cell_m: str) -> Callable[[Path], None]:
    return _toast(
        lambda text: text.replace("shape = [14, 18, 3]", f"shape = {shape}").replace(
            "cell_m = [0.12, 0.12, 0.12]", f"cell_m = {cell_m}"
        )
    )


def _cell(path: Path) -> None:
    """Write a cell of a hundred stations and fifty parts that each visit fourteen machines."""
    rng = Random(1)
    machines = [f"s{number}" for number in range(98)]
    lines = ['name = "large"', 'kind = "cell"', "parts = 50", "stations = ["]
    lines += [f'{{ name = "{name}", kind = "storage", capacity = 60 }},' for name in ("in", "out")]
    lines += [
        f'{{ name = "{name}", kind = "machine", capacity = 1, processing_s = {rng.randint(20, 90)} }},'
        for name in machines
    ]
    lines += ["]", "[robot]", 'start = "in"', "[[products]]", 'name = "thing"', "routes = ["]
    lines += [json.dumps(["in", *machines[14 * way : 14 * way + 14], "out"]) + "," for way in range(7)]
    lines += ["]", "[travel]"]
    stations = ["in", *machines, "out"]
    for station in stations:
        lines.append(
            f"{station} = {{ "
            + ", ".join(f"{target} = {rng.randint(5, 30)}" for target in stations if target != station)
            + " }"
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _zip_bomb(path: Path) -> None:
    """Write a megabyte that unpacks to a gigabyte."""
    with ZipFile(path, "w", ZIP_DEFLATED) as archive, archive.open("mine.safetensors", "w") as file:
        for _ in range(1 << 10):
            file.write(bytes(1 << 20))


def _png_bomb(path: Path) -> None:
    """Write a picture of 30,000 x 30,000 white pixels in three megabytes."""
    side = 30_000

    def chunk(name: bytes, content: bytes) -> bytes:
        body = name + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    packer = zlib.compressobj()
    row = b"\0" + b"\xff" * (3 * side)
    packed = b"".join(packer.compress(row) for _ in range(side)) + packer.flush()
    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b""))


SIZES = (
    *(
        Size("big.safetensors", write, words)
        for write in (_policy, _sound_head)
        for words in (
            "toolbox list --toolbox {folder}",
            "toolbox verify --toolbox {folder}",
            "toolbox show big --toolbox {folder}",
            "teach world-1 --advisor policy:{file} --episodes 3",
        )
    ),
    Size("keys.toml", _many(WORLD, lambda i: f"a{i}=1\n", 3_000_000), "task check {file}"),
    Size("keys-10.toml", _many(WORLD, lambda i: f"k{i:x}=1\n", TEN_MB // 10), "task check {file}"),
    Size("tables.toml", _many(WORLD, lambda i: f"[k{i:x}]\n", TEN_MB // 10), "task check {file}"),
    Size("lists.toml", _many(f"{WORLD}x=[", lambda i: "[],", TEN_MB // 3, "]\n"), "task check {file}"),
    Size("numbers.toml", _many(f"{WORLD}x=[", lambda i: "1,", TEN_MB // 2, "]\n"), "task check {file}"),
    Size("inline.toml", _many(f"{WORLD}x=[", lambda i: "{a=1},", TEN_MB // 6, "]\n"), "task check {file}"),
    Size("grid-100-mb.txt", _grid(10_000, 10_000), "teach {file} --episodes 2"),
    Size("grid-9-mb.txt", _grid(100, 90_000), "teach {file} --episodes 2"),
    Size("grid-100.txt", _grid(100, 100), "teach {file} --episodes 2"),
    Size("made.toml", lambda path: None, "teach random:100x100x100:0.3:1 --episodes 3"),
    Size("obstacles-5000.toml", _obstacles(5000), "task check {file}"),
    Size("obstacles-100.toml", _obstacles(100), "task check {file}"),
    Size("workspace-100.toml", _workspace("[100, 100, 100]", "[0.02, 0.02, 0.01]"), "task check {file}"),
    Size("workspace-50.toml", _workspace("[50, 60, 20]", "[0.03, 0.03, 0.02]"), "task check {file}"),
    Size("large.toml", _cell, "sequence {file} --method fifo --json"),
    Size("large.toml", _cell, "sequence {file} --episodes 10 --json"),
    Size("large.toml", _cell, "sequence {file} --method exact --json"),
    Size("bomb.zip", _zip_bomb, "toolbox import {file}"),
    Size("bomb.png", _png_bomb, "see {file} --task toast"),
)


def prepare(room: Path, seed: int) -> int:
    """The number of attempts, one for each of SIZES."""
    return len(SIZES)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Run one command on one large file."""
    size, folder = SIZES[number], room / str(number)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    file = folder / size.file
    size.write(file)
    words = [word.format(file=file, folder=folder) for word in size.words.split()]
    ended = lab(*words, cwd=folder, env=environment(folder), timeout_s=LONGEST_S)
    mb, broke = ended.peak_bytes / 1e6, ended.fault()
    if not broke and ended.code == 2 and ended.cpu_s > REFUSED_S:
        broke = f"refused after {ended.cpu_s:.1f} s of CPU time"
    if not broke and mb > (REFUSED_MB if ended.code == 2 else WORK_MB):
        broke = f"{mb:.0f} MB"
    said = ended.stderr.strip().splitlines()[-1][:300] if ended.code and ended.stderr.strip() else "done"
    shutil.rmtree(folder)
    case = f"{number}: lab {size.words.replace('{file}', size.file)}: exit {ended.code}: {said}"
    figures = {"CPU s": round(ended.cpu_s, 1), "MB": round(mb)}
    return Outcome("refused" if ended.code == 2 else "done", case, broke, 1, figures)


PART = Part(
    "the largest inputs", "rejected in a line in 5 s, under 1 GB, or real work under 2 GB", None, prepare, attempt
)
