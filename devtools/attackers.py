"""Attacks on the live page's server, as a process of its own: `python -m devtools.attackers KIND PORT SECONDS SEED SERVER [UID]`.

It reads the token from stdin, becomes the user UID before it begins, and prints one JSON document: how often it tried, and
`inside`, the requests that should not have been let in. SERVER is the lesson's process.
"""

import json
import os
import random
import socket
import sys
import time
from collections.abc import Callable, Iterator
from itertools import chain, product, repeat
from pathlib import Path
from select import select
from typing import Any

HOST = "127.0.0.1"
ANSWER_S = 5.0
AT_ONCE = 400  # connections that an attacker holds


class Attack:
    """One attacker. token: for attacks with it, and to check that nobody gets in without it; server: the lesson's process."""

    host = HOST

    def __init__(self, port: int, token: str, seconds: float, seed: int, server: int) -> None:
        self.port, self.token, self.server = port, token, server
        self.until_s = time.monotonic() + seconds
        self.chance = random.Random(seed)
        self.tries = 0
        self.inside: list[str] = []

    @property
    def goes_on(self) -> bool:
        """Whether there is time left."""
        return time.monotonic() < self.until_s

    def connect(self) -> socket.socket | None:
        """A connection, or None when the server accepts none."""
        self.tries += 1
        try:
            return socket.create_connection((self.host, self.port), timeout=ANSWER_S)
        except OSError:
            return None

    def say(self, connection: socket.socket, words: bytes) -> bool:
        """Send some bytes; return whether that was possible."""
        try:
            connection.sendall(words)
        except OSError:
            return False
        return True

    def asked(self, words: bytes, wait_s: float = ANSWER_S) -> bytes:
        """The beginning of the server's answer, b"" if it ends the connection, b"no answer" after `wait_s`."""
        connection = self.connect()
        if connection is None:
            return b""
        with connection:
            if not self.say(connection, words):
                return b""
            connection.settimeout(wait_s)
            try:
                return connection.recv(1 << 16)
            except TimeoutError:
                return b"no answer"
            except OSError:
                return b""


# ---- without the token


def matrix(attack: Attack) -> None:
    """Send requests with every combination of `cases`; only those of the server's own page may get in."""
    for method, path, token, host, origin in cases(attack):
        shown = f"{path}?token={token}" if token is not None else path
        words = f"{method} {shown} HTTP/1.1\r\n" + (f"Host: {host}\r\n" if host else "")
        if origin is not None:
            words += "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            words += "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n" + (f"Origin: {origin}\r\n" if origin else "")
        answer = attack.asked((words + "\r\n").encode("latin-1"))
        code = answer[9:12]
        ours = host in (f"{HOST}:{attack.port}", f"localhost:{attack.port}")
        allowed = token == attack.token and ours and origin in (None, "", f"http://{host}")
        if code in (b"200", b"101") and not allowed:
            attack.inside.append(f"{method} {path} token {token!r} host {host!r} origin {origin!r}: {code.decode()}")
        if answer == b"no answer":
            attack.inside.append(f"{method} {path} token {token!r} host {host!r}: no answer in {ANSWER_S:g} s")
        if token != attack.token and attack.token.encode() in answer:
            attack.inside.append(f"{method} {path} token {token!r}: the answer holds the token")


def cases(attack: Attack) -> Iterator[tuple[str, str, str | None, str, str | None]]:
    """The cases of `matrix`: method, path, token, host, and the origin of a websocket (None: no websocket)."""
    right, here = attack.token, f"{HOST}:{attack.port}"
    hosts = (
        here,
        f"localhost:{attack.port}",
        "evil.example",
        f"{HOST}.evil.example",
        f"evil.example@{here}",
        "",
        "0.0.0.0",
    )
    tokens = (None, "", right[:-1], right + "A", right.swapcase(), f"{right}%00", "*", right)
    for path, token, host in product(
        ("/", "/frames", "/page.js", "/../etc/passwd", "/%2e%2e/x", "//", "/frames/"), tokens, hosts
    ):
        yield "GET", path, token, host, None
    for token, host, origin in product(
        tokens, hosts, ("", f"http://{here}", f"https://{here}", "http://evil.example", "null", "file://")
    ):
        yield "GET", "/frames", token, host, origin
    methods = ("HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "PATCH", "get", "PRI", "X" * 100)
    for method, path, token in product(methods, ("/", "/frames", "*", f"http://{here}/"), tokens[:-1]):
        yield method, path, token, here, None


def flood(attack: Attack, words: bytes = b"", again: bytes = b"") -> None:
    """Hold as many connections as possible, each of which sends `words`, and `again` from time to time."""
    held: list[tuple[socket.socket, Iterator[bytes]]] = []
    while attack.goes_on:
        opened = socket.socket()
        opened.setblocking(False)
        opened.connect_ex((attack.host, attack.port))
        attack.tries += 1
        held.append((opened, chain([words], repeat(again))))
        other, says = held[attack.chance.randrange(len(held))]
        if words and select([], [other], [], 0)[1] and not attack.say(other, next(says)):
            held = [pair for pair in held if pair[0] is not other]
            other.close()
        if len(held) > AT_ONCE:
            held.pop(0)[0].close()


def half(attack: Attack) -> None:
    """Send half a request on each connection, and nothing more."""
    flood(attack, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")


def slowly(attack: Attack) -> None:
    """Send a request that never ends, a byte at a time, on each connection."""
    flood(attack, b"GET / HTTP/1.1\r\n", b"X")


def unread(attack: Attack) -> None:
    """Send thousands of requests on each connection, and read no answer."""
    flood(attack, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 1000)


def large(attack: Attack) -> None:
    """Send heads and bodies without end."""
    begun = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    while attack.goes_on:
        connection = attack.connect()
        if connection is None:
            continue
        with connection:
            chunked = attack.chance.random() < 0.5
            attack.say(connection, begun if chunked else b"GET / HTTP/1.1\r\nX: ")
            while attack.goes_on and attack.say(
                connection, (b"10000\r\n" + b"x" * 65536 + b"\r\n") if chunked else b"x" * 65536
            ):
                pass


def garbage(attack: Attack) -> None:
    """Send other protocols and noise."""
    openings = (
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\r\n" * 1000,
        b"\0" * 1000,
    )
    while attack.goes_on:
        answer = attack.asked(attack.chance.choice((*openings, attack.chance.randbytes(500))), 0.05)
        if answer[9:12] in (b"200", b"101"):
            attack.inside.append(f"noise was answered {answer[:40]!r}")


def spy(attack: Attack) -> None:
    """Look for the token in whatever another user can read of the process and its files, which lie in `SPIED`."""
    process = Path(f"/proc/{attack.server}")
    for name in ("cmdline", "environ", "comm", "stat", "maps"):
        _search(attack, process / name)
    home = Path(os.environ.get("SPIED", os.devnull))
    for folder, _, files in os.walk(home):
        for name in files:
            _search(attack, Path(folder, name))


def _search(attack: Attack, file: Path) -> None:
    attack.tries += 1
    try:
        if attack.token.encode() in file.read_bytes():
            attack.inside.append(f"{file} holds the token")
    except OSError:
        return


# ---- with the token: a broken page, or a guest who may only look


def _page(attack: Attack) -> Any:
    from websockets.sync.client import connect

    attack.tries += 1
    try:
        return connect(f"ws://{HOST}:{attack.port}/frames?token={attack.token}", max_size=None, open_timeout=ANSWER_S)
    except Exception:
        return None


def pages(attack: Attack) -> None:
    """Open and close pages, more than are allowed."""
    held: list[Any] = []
    while attack.goes_on:
        held.append(_page(attack))
        if len(held) > 40:
            for page in filter(None, held[:20]):
                page.close_socket()
            held = held[20:]


def chatter(attack: Attack) -> None:
    """Send messages of all kinds, answers and commands among them, from a page without the seat."""
    things: list[Any] = [
        None,
        True,
        -1,
        1e308,
        10**400,
        "x",
        "skip",
        "undo",
        "quit",
        "stop",
        "take",
        "give",
        [],
        {},
        [0] * 2000,
        "\x1b[2J",
    ]
    keys = ["answer", "question", "action", "word", "path", "seat", "layer", "replay", "command", "\0"]

    def drawn(depth: int = 0) -> Any:
        if depth < 3 and attack.chance.random() < 0.6:
            return {attack.chance.choice(keys): drawn(depth + 1) for _ in range(attack.chance.randint(1, 2))}
        return attack.chance.choice([*things, attack.chance.randint(0, 100)])

    while attack.goes_on:
        page = _page(attack)
        if page is None:
            continue
        try:
            for _ in range(100):
                attack.tries += 1
                wild = attack.chance.random() < 0.1
                page.send(
                    attack.chance.randbytes(99) if wild else json.dumps(drawn()).replace('{"seat": "take"}', "[" * 3000)
                )
        except Exception:
            continue
        finally:
            page.close_socket()


def silent(attack: Attack) -> None:
    """Open pages that read nothing and send pings."""
    frames = (b"\x89\xfd\0\0\0\0" + bytes(125)) * 100
    ask = f"GET /frames?token={attack.token} HTTP/1.1\r\nHost: {HOST}:{attack.port}\r\nUpgrade: websocket\r\n"
    ask += "Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    flood(attack, ask.encode(), frames)


ATTACKS: dict[str, tuple[Callable[[Attack], None], str]] = {
    "matrix": (matrix, "requests of every kind without a right"),
    "flood": (flood, "bare connections"),
    "half": (half, "half requests"),
    "slowly": (slowly, "requests a byte at a time"),
    "unread": (unread, "answers that nobody reads"),
    "large": (large, "heads and bodies without end"),
    "garbage": (garbage, "other protocols and noise"),
    "spy": (spy, "files and processes that hold the token"),
    "pages": (pages, "with the token: pages that come and go"),
    "chatter": (chatter, "with the token: messages of all kinds"),
    "silent": (silent, "with the token: pages that read nothing"),
}


def main(kind: str, port: str, seconds: str, seed: str, server: str, uid: str = "") -> None:
    """Attack, and print the number of tries and what got in."""
    import websockets.sync.client  # noqa: F401  # loaded now, because the other user may not be able to read it

    "".encode("idna")  # loads the codec, for the same reason
    token = sys.stdin.read().strip()
    if uid:
        os.setgroups([])
        os.setgid(int(uid))
        os.setuid(int(uid))
    attack = Attack(int(port), token, float(seconds), int(seed), int(server))
    ATTACKS[kind][0](attack)
    sys.stdout.write(json.dumps({"tries": attack.tries, "inside": attack.inside[:20]}) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
