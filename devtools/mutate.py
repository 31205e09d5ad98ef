"""Damaged files: mutations of bytes, lines, values and trees, the same for the same seed."""

import io
import json
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from random import Random
from typing import Any

MOST_BYTES = 8_000_000  # a mutated file is cut to this size
NUMBERS = (
    *("nan", "inf", "-inf", "-1", "0", "-0.0", "1e400", "-1e400", "1e308", "1e-320", "9" * 400, str(-(2**63)), "9" * 5000),
    *(str(2**63), "0x10", "1_000", "1e3", "2.5", "", "1.2.3", "NaN", "Infinity", "true", "null", "1000000", "10000000000"),
)  # fmt: skip
TEXTS = (
    *("", " ", "\x00", "\x1b[2J\x07", "a\nb", "x" * 10_000, "../../x", "/etc/passwd", "..", ".", "C:\\x", "é\u202e", "\ud800"),
    *("-1", "nan", "None", "%s%n", "{0}", "[[", "'", '"', "\\", "toast", "a" * 300 + "/b", "\ufeff", "=cmd", "<!ENTITY x>"),
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    *(None, True, False, -1, 0, 1, 2, 2**31, 2**63, -(2**63), 10**400, 1e308, -1e308, 1e-320, 0.5, float("nan"), float("inf")),
    *([], {}, [[]], [1, "x", None], {"x": 1}, {"kind": []}, [0] * 3000, "1", *TEXTS),
)  # fmt: skip
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_STRING = re.compile(rb"\"(?:[^\"\\\n]|\\.)*\"|'[^'\n]*'")
_KEY = re.compile(rb"[\"']?[A-Za-z_][\w-]*[\"']?(?=\s*[=:])")
_VALUE = re.compile(rb"(?<=[=:,\[{(])\s*(?:[^\s,\]})=:]+|\[[^\[\]]*\])")

Mutation = Callable[[bytes, Random], bytes]


def mutated(content: bytes, kind: str, chance: Random) -> tuple[bytes, str]:
    """A file's bytes after one to three mutations that fit its kind, and the names of the mutations."""
    names = []
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        name = chance.choice(FITTING[kind])
        names.append(name)
        content = MUTATIONS[name](content, chance)[:MOST_BYTES]
    return content, " + ".join(names)


# ---- bytes


def _flip(content: bytes, chance: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 8, 64)) if content else 0):
        changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
    return bytes(changed)


def _cut(content: bytes, chance: Random) -> bytes:
    return content[: chance.randrange(len(content) + 1)]


def _drop(content: bytes, chance: Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    return content[:at] + content[at + chance.choice((1, 2, 8, 100, 1000)) :]


def _double(content: bytes, chance: Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    end = at + chance.choice((1, 4, 100, 5000))
    return content[:end] + content[at:end] * chance.choice((1, 2, 100)) + content[end:]


def _insert(content: bytes, chance: Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    things = (
        b"\0",
        b"\xff\xfe",
        b"\x1b[31m",
        b"\n",
        b"\r",
        b"\xed\xa0\x80",
        b"[" * 3000,
        b"{" * 3000,
        b'"',
        b"#",
        b" " * 5000,
    )
    return content[:at] + chance.choice((*things, chance.randbytes(chance.choice((1, 8, 300))))) + content[at:]


def _other_content(content: bytes, chance: Random) -> bytes:
    return chance.choice(
        (b"", b"\n", b"\0" * 1000, b"\xef\xbb\xbf" + content, content + content, content[::-1], b"[]", b"{}", b"null")
    )


def _overwrite(content: bytes, chance: Random) -> bytes:
    """The content with a number of 1 to 8 bytes somewhere, as in a damaged header."""
    wide = chance.choice((1, 2, 4, 8))
    at = chance.randrange(max(1, len(content) if chance.random() < 0.3 else min(len(content), 200)))
    number = chance.choice(
        (0, 1, (1 << 8 * wide) - 1, 1 << 8 * wide - 1, 1 << 8 * wide - 2, chance.getrandbits(8 * wide))
    )
    return content[:at] + number.to_bytes(wide, chance.choice(("big", "little"))) + content[at + wide :]


# ---- lines and words


def _lines(content: bytes, chance: Random) -> bytes:
    lines = content.split(b"\n")
    here, there = chance.randrange(len(lines)), chance.randrange(len(lines))
    what = chance.randrange(6)
    if what == 0:
        lines[here], lines[there] = lines[there], lines[here]
    elif what == 1:
        del lines[here]
    elif what == 2:
        lines.insert(there, lines[here])
    elif what == 3:
        lines[here:] = []
    elif what == 4:
        lines[here] = lines[here] * chance.choice((2, 50))
    else:
        lines[here:here] = [lines[here]] * chance.choice((10, 1000))
    return b"\n".join(lines)


def _replaced(content: bytes, chance: Random, pattern: re.Pattern[bytes], by: Callable[[bytes], bytes]) -> bytes:
    matches = list(pattern.finditer(content[:200_000]))
    if not matches:
        return _flip(content, chance)
    match = chance.choice(matches)
    return content[: match.start()] + by(match[0]) + content[match.end() :]


def _number(content: bytes, chance: Random) -> bytes:
    return _replaced(content, chance, _NUMBER, lambda old: chance.choice(NUMBERS).encode())


def _text(content: bytes, chance: Random) -> bytes:
    new = chance.choice(TEXTS).encode("utf-8", "surrogatepass")
    new = new if chance.random() < 0.5 else json.dumps(new.decode("utf-8", "replace"))[1:-1].encode()
    return _replaced(content, chance, _STRING, lambda old: old[:1] + new + old[-1:])


def _key(content: bytes, chance: Random) -> bytes:
    kinds: tuple[Callable[[bytes], bytes], ...] = (
        lambda old: b"",
        lambda old: old + b"x",
        lambda old: b"x" * 10_000,
        lambda old: old + b"." + old,
        lambda old: old + b" = 1\n" + old,
        lambda old: b'"\\u0000"',
        lambda old: b"__class__",
    )
    return _replaced(content, chance, _KEY, chance.choice(kinds))


def _type(content: bytes, chance: Random) -> bytes:
    deep = chance.choice((50, 900, 5000))
    things = (
        *(b"[]", b"{}", b'""', b"true", b"1", b"[[]]", b"[1, 2]", b'["x"]', b"{x = 1}", b'{"x": 1}', b"1979-05-27", b"12:00:00"),
        *(b"[" * deep + b"]" * deep, b'{"a":' * deep + b"1" + b"}" * deep, b"[" + b"0, " * 20_000 + b"0]", b"&a [*a, *a]"),
    )  # fmt: skip
    return _replaced(content, chance, _VALUE, lambda old: b" " + chance.choice(things))


# ---- trees


def _tree(held: Any, chance: Random) -> Any:
    """The JSON value with one node replaced, deleted, renamed or repeated."""
    places: list[tuple[Any, Any]] = []
    pending = [held]
    while pending and len(places) < 50_000:
        node = pending.pop()
        pairs = (
            list(node.items()) if isinstance(node, dict) else list(enumerate(node)) if isinstance(node, list) else []
        )
        places += [(node, key) for key, _ in pairs]
        pending += [value for _, value in pairs]
    if not places or chance.random() < 0.02:
        return chance.choice(VALUES)
    node, key = chance.choice(places)
    what = chance.random()
    if what < 0.6:
        node[key] = chance.choice(VALUES)
    elif what < 0.75:
        del node[key]
    elif isinstance(node, list):
        node[key:key] = [node[key]] * chance.choice((1, 1, 500))
    else:
        value = node.pop(key) if what < 0.9 else node[key]
        node[str(chance.choice((f"{key}x", *TEXTS)))] = value
    return held


def _json(content: bytes, chance: Random) -> bytes:
    try:
        return json.dumps(_tree(json.loads(content), chance)).encode()
    except (ValueError, RecursionError):
        return _number(content, chance)


def _json_line(content: bytes, chance: Random) -> bytes:
    lines = content.split(b"\n")
    at = chance.choice((0, chance.randrange(len(lines))))
    lines[at] = _json(lines[at], chance)
    return b"\n".join(lines)


def _sealed(content: bytes, chance: Random) -> bytes:
    """A toolbox's record with damaged content, and the hash of that content."""
    try:
        whole = json.loads(content)
        whole["record"] = _tree(whole["record"], chance)
        whole["hash"] = sha256(json.dumps(whole["record"], sort_keys=True).encode()).hexdigest()[
            : len(str(whole["hash"]))
        ]
        return json.dumps(whole).encode()
    except (ValueError, TypeError, KeyError, RecursionError):
        return _flip(content, chance)


def _tensors(content: bytes, chance: Random) -> bytes:
    """A safetensors file with a damaged header of the declared length."""
    try:
        (length,) = struct.unpack_from("<Q", content)
        head = json.loads(content[8 : 8 + length])
        metadata = head.get("__metadata__", {})
        if metadata and chance.random() < 0.7:
            name = chance.choice(sorted(metadata))
            with suppress(ValueError):
                metadata[name] = json.dumps(_tree({"": json.loads(metadata[name])}, chance).get(""))
        else:
            head = _tree(head, chance)
        new = json.dumps(head).encode()
        return struct.pack("<Q", len(new)) + new + content[8 + length :]
    except (struct.error, ValueError, AttributeError, TypeError, RecursionError):
        return _overwrite(content, chance)


def _numbers(content: bytes, chance: Random) -> bytes:
    """The content with a float in its second half replaced by an odd one."""
    odd = struct.pack("<d", chance.choice((float("nan"), float("inf"), -1e308, -0.0, 1e-320)))
    at = len(content) // 2 + 8 * chance.randrange(max(1, len(content) // 16))
    return content[:at] + odd + content[at + 8 :]


# ---- containers


def _members(content: bytes, chance: Random) -> bytes:
    """The zip file with one of its files damaged, renamed, doubled, left out, or replaced by a link or a bomb."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            files = [(entry, archive.read(entry)) for entry in archive.infolist()]
    except Exception:
        return _overwrite(content, chance)
    warnings.simplefilter("ignore", UserWarning)  # a name is doubled on purpose
    written = io.BytesIO()
    at, what = chance.randrange(len(files)) if files else 0, chance.randrange(9)
    with zipfile.ZipFile(written, "w") as archive:
        for number, (entry, data) in enumerate(files):
            info = zipfile.ZipInfo(entry.filename, (1980, 1, 1, 0, 0, 0))
            info.compress_type, info.external_attr = entry.compress_type, entry.external_attr
            if number == at:
                if what == 0:
                    continue
                if what == 1:
                    info.filename = chance.choice(
                        (*[text for text in TEXTS if text and "\ud800" not in text], "manifest.json")
                    )
                elif what == 2:
                    info.external_attr = 0o120777 << 16
                    data = b"/etc/passwd"
                elif what == 3:
                    data, info.compress_type = bytes(chance.choice((10**6, 10**8))), zipfile.ZIP_DEFLATED
                elif what == 4:
                    data = _array_bomb(chance)
                    info.compress_type = zipfile.ZIP_DEFLATED
                elif what == 5:
                    archive.writestr(info, data)
                else:
                    fitting = (
                        "json" if data[:1] == b"{" else "tensors" if b'"__metadata__"' in data[:2000] else "binary"
                    )
                    data = mutated(data, fitting, chance)[0]
            archive.writestr(info, data)
    return written.getvalue()


def _array_bomb(chance: Random) -> bytes:
    """A NumPy array whose header declares more than there is, or with very many zeros."""
    shape = chance.choice(((10**9,), (10**5, 10**5), (2**40, 7), (0,), (-1,), (10**8,)))
    head = repr(
        {"descr": chance.choice(("<f8", "|O", "<U1000", "|b1")), "fortran_order": False, "shape": shape}
    ).encode()
    head += b" " * (-(len(head) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + bytes(chance.choice((0, 1000, 10**8)))


def _chunks(content: bytes, chance: Random) -> bytes:
    """The PNG file with a damaged chunk and its right checksum, a wrong size, or a chunk that unpacks to 10 MB of zeros."""
    if not content.startswith(b"\x89PNG"):
        return _overwrite(content, chance)
    at, chunks = 8, []
    while at + 12 <= len(content):
        length = int.from_bytes(content[at : at + 4], "big")
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return _overwrite(content, chance)
    number, what = chance.randrange(len(chunks)), chance.randrange(5)
    name, data = chunks[number]
    if what == 0:
        sizes = (0, 1, 2, 600, 6000, 20_000, 40_000, 2**31 - 1, 2**32 - 1)
        wide, high = (chance.choice(sizes).to_bytes(4, "big") for _ in "ab")
        chunks[0] = chunks[0][0], wide + high + chunks[0][1][8:]
    elif what == 1:
        chunks[number] = name, zlib.compress(bytes(10**7))
    elif what == 2:
        del chunks[number]
    elif what == 3:
        chunks.insert(
            chance.randrange(len(chunks) + 1),
            (chance.choice((b"IDAT", b"PLTE", b"tRNS", b"zTXt", b"eXIf", b"IHDR")), data),
        )
    else:
        chunks[number] = name, _flip(data, chance)
    packed = (
        len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big") for name, data in chunks
    )
    return content[:8] + b"".join(packed)


MUTATIONS: dict[str, Mutation] = {
    "bits": _flip,
    "cut": _cut,
    "dropped": _drop,
    "doubled": _double,
    "inserted": _insert,
    "something else": _other_content,
    "overwritten": _overwrite,
    "lines": _lines,
    "number": _number,
    "text": _text,
    "key": _key,
    "type": _type,
    "tree": _json,
    "line's tree": _json_line,
    "sealed": _sealed,
    "head": _tensors,
    "floats": _numbers,
    "members": _members,
    "chunks": _chunks,
}
_BYTES = ("bits", "cut", "dropped", "doubled", "inserted", "something else")
_WORDS = (*_BYTES, *("lines", "number", "text", "key", "type") * 3)
FITTING = {  # kind of content -> the mutations of its files; those that readers notice later stand more often
    "text": _WORDS,
    "json": (*_WORDS, *("tree",) * 20),
    "json lines": (*_WORDS, *("line's tree",) * 20),
    "record": (*_WORDS, *("tree",) * 5, *("sealed",) * 15),
    "tensors": (*_BYTES, "overwritten", *("head",) * 10, *("floats",) * 2),
    "binary": (*_BYTES, *("overwritten", "floats") * 3),
    "zip": (*_BYTES, "overwritten", *("members",) * 10),
    "picture": (*_BYTES, "overwritten", *("chunks",) * 8),
}
