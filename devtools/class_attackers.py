"""Attacks on a class, as a process of its own: `python -m devtools.class_attackers KIND SECONDS SEED [UID]`.

It reads a `Target` from stdin as JSON, becomes the user UID before it begins, and prints one JSON document: how often it tried,
`inside`, what should not have been let in, seen, carried out or lost, and figures.
"""

import json
import os
import random
import socket
import ssl
import struct
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, count, product
from pathlib import Path
from typing import Any

from devtools.attackers import ANSWER_S, Attack, flood, garbage, half, slowly, unread

UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
)
LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"
MOST_CODES = 300  # wrong codes that a class may look at in one attack
MARKUP = "<img src=x onerror=alert(1)><script>alert(1)</script>\u202e\u2066\x1b[2J\x00'\"&"


@dataclass(frozen=True)
class Target:
    """The attacked class. key: of the attacker's own seat; secrets: by what they are, which nobody else may get to see.

    folder, server: of the class, and its process.
    """

    host: str
    port: int
    secured: bool
    code: str
    teacher: str
    key: str
    name: str
    secrets: dict[str, str]
    folder: str
    server: int


class ClassAttack(Attack):
    """One attacker of a class: a stranger, or with `Target.key` a pupil."""

    def __init__(self, target: Target, seconds: float, seed: int) -> None:
        super().__init__(target.port, target.teacher, seconds, seed, target.server)
        self.target, self.host = target, target.host
        self.figures: dict[str, float] = {}
        self.scheme = "https" if target.secured else "http"
        self.here = f"{target.host}:{target.port}"
        self.tls = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        self.tls.check_hostname, self.tls.verify_mode = False, ssl.CERT_NONE

    def connect(self) -> socket.socket | None:
        """A connection, over TLS where the class is, from a drawn address of this computer; None if none is accepted."""
        self.tries += 1
        own = f"127.{self.chance.randrange(1, 255)}.{self.chance.randrange(1, 255)}.{self.chance.randrange(1, 255)}"
        try:
            plain = socket.create_connection((self.host, self.port), ANSWER_S, (own, 0))
            plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return self.tls.wrap_socket(plain) if self.target.secured else plain
        except OSError:
            return None

    def get_in(self, what: str) -> None:
        """Note something that should not have happened."""
        if len(self.inside) < 20:
            self.inside.append(what)

    def looked_at(self, seen: bytes, where: str) -> bytes:
        """What was received, in which no secret may be."""
        for name, secret in self.target.secrets.items():
            if secret.encode() in seen:
                self.get_in(f"{where}: holds {name}")
        return seen

    def posted(self, body: bytes, **headers: str) -> bytes:
        """The answer to a request to join."""
        head = {"Host": self.here, "Content-Length": str(len(body)), **headers}
        lines = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in head.items())
        answer = self.asked(f"POST /join HTTP/1.1\r\n{lines}\r\n".encode() + body)
        if answer[9:10] == b"5":
            self.get_in(f"a request to join with {body[:60]!r} is answered {answer[:40]!r}")
        return self.looked_at(answer, f"POST /join {body[:40]!r}")

    def page(self, path: str = "") -> Any:
        """An open websocket, by default of the attacker's own seat; None if it is refused."""
        from websockets.sync.client import connect

        self.tries += 1
        address = f"{self.scheme.replace('http', 'ws')}://{self.here}{path or self.own}"
        try:
            return connect(
                address,
                ssl=self.tls if self.target.secured else None,
                max_size=None,
                open_timeout=ANSWER_S,
                close_timeout=0.1,
                proxy=None,
            )
        except Exception:
            return None

    @property
    def own(self) -> str:
        """The websocket of the attacker's own seat."""
        return f"/desk/frames?token={self.target.key}"

    def raw_page(self) -> socket.socket | None:
        """A connection on which a websocket of the attacker's own seat is open, frames of which are bytes."""
        connection = self.connect()
        if connection is None:
            return None
        ask = f"GET {self.own} HTTP/1.1\r\nHost: {self.here}\r\n{UPGRADE}\r\n"
        connection.settimeout(ANSWER_S)
        try:
            connection.sendall(ask.encode())
            if connection.recv(16)[9:12] == b"101":
                return connection
        except OSError:
            pass
        connection.close()
        return None


def frame(content: bytes, kind: int, last: bool = True) -> bytes:
    """A frame of a websocket's client, masked with zeros."""
    size = len(content)
    head = bytes([kind | (0x80 if last else 0)])
    if size < 126:
        return head + bytes([0x80 | size]) + bytes(4) + content
    return head + b"\xfe" + struct.pack("!H", size) + bytes(4) + content


# ---- a stranger: another user of the computer, or another computer in the network


def requests(attack: ClassAttack) -> None:
    """Send requests of every kind without a right: paths, methods, tokens, hosts and origins."""
    endless = chain.from_iterable(cases(attack) for _ in count())
    while attack.goes_on:
        method, path, token, host, origin = next(endless)
        shown = path if token is None else f"{path}?token={token}&pupil=1"
        words = f"{method} {shown} HTTP/1.1\r\n" + (f"Host: {host}\r\n" if host else "")
        words += (UPGRADE if origin is not None else "") + (f"Origin: {origin}\r\n" if origin else "")
        answer = attack.looked_at(attack.asked((words + "\r\n").encode("latin-1")), f"{method} {path}")
        case = f"{method} {path} token {token!r} host {host!r} origin {origin!r}"
        if answer[9:12] == b"101" or (answer[9:12] == b"200" and "class.csv" in path):
            attack.get_in(f"{case}: {answer[9:12].decode()}")
        if answer[9:12] == b"200" and host.rpartition(":")[0] not in (attack.host, "localhost"):
            attack.get_in(f"{case}: {answer[9:12].decode()}")
        if answer == b"no answer" or answer[9:10] == b"5":
            attack.get_in(f"{case}: {answer[:20]!r}")


def cases(attack: ClassAttack) -> Iterator[tuple[str, str, str | None, str, str | None]]:
    """The cases of `requests`: method, path, token, host, and the origin of a websocket (None: no websocket)."""
    right, here = attack.target.teacher, attack.here
    hosts = (here, "evil.example", f"{attack.host}.evil.example:{attack.port}", f"evil.example@{here}", "", "0.0.0.0")
    tokens = (None, "", right[:-1], right + "A", right.swapcase(), f"{right}%00", "*", attack.target.code)
    out = ("class.json", "key.pem", "class.csv", "01-Ada/lesson-1/events.jsonl", "../../etc/passwd")
    ways = (
        "/{}",
        "/desk/{}",
        "/teacher/{}",
        "/../{}",
        "/desk/../../{}",
        "/%2e%2e/{}",
        "/desk/..%2f{}",
        "/desk/..%5c{}",
        "//{}",
    )
    paths = [way.format(name) for way in ways for name in out]
    pages = ("/", "/desk/", "/teacher/", "/teacher/frames", "/desk/frames", "/teacher/class.csv", "/frames")
    for path in paths:
        yield "GET", path, attack.chance.choice(tokens), here, None
    for path, token, host in product(pages, tokens, hosts):
        yield "GET", path, token, host, None
    origins = ("", f"{attack.scheme}://{here}", "http://evil.example", "null", f"https://{here}.evil.example")
    for path, token, host, origin in product(("/teacher/frames", "/desk/frames"), tokens, hosts, origins):
        yield "GET", path, token, host, origin
    for method, path in product(
        ("HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", "X" * 99), pages
    ):
        yield method, path, attack.chance.choice(tokens), here, None


def codes(attack: ClassAttack) -> None:
    """Try codes from many addresses, as fast as they are answered."""
    looked = 0
    while attack.goes_on:
        connection = attack.connect()
        if connection is None:
            continue
        with connection:
            for _ in range(20):
                code = "".join(attack.chance.choice(LETTERS) for _ in range(6))
                body = json.dumps({"code": code}).encode()
                attack.tries += 1
                head = f"POST /join HTTP/1.1\r\nHost: {attack.here}\r\nContent-Length: {len(body)}\r\n\r\n"
                try:
                    connection.sendall(head.encode() + body)
                    answer = connection.recv(1 << 16)
                    while answer and not answer.endswith(b"}"):
                        answer += connection.recv(1 << 16)
                except OSError:
                    break
                looked += answer[9:12] == b"403"
                if answer[9:12] == b"200":
                    attack.get_in(f"the code {code} was taken")
    attack.figures["codes looked at"] = looked
    if looked > MOST_CODES:
        attack.get_in(f"{looked} codes were looked at")


def bodies(attack: ClassAttack) -> None:
    """Send bodies of requests to join that are damaged, large, deep, or never end; hold those that never end."""
    wrong = attack.target.code[::-1]
    odd: list[Any] = [wrong + "\ud800", "\ud800", "\0", 10**100, [], {}, None, True, "é" * 200, MARKUP, wrong * 100]
    plain = [json.dumps({"code": code}).encode() for code in odd]
    plain += [
        b"",
        b"null",
        b"[]",
        b"[" * 2000,
        b'{"code":' * 200,
        b"\xff" * 99,
        b"x" * 99999,
        b'{"code": NaN}',
        b'{"name": 1}',
    ]
    held: list[socket.socket] = []
    while attack.goes_on:
        attack.posted(attack.chance.choice(plain))
        attack.posted(attack.chance.choice(plain), Content_Length="7")
        connection = attack.connect()
        if connection is not None:
            attack.say(
                connection, f"POST /join HTTP/1.1\r\nHost: {attack.here}\r\nContent-Length: 999\r\n\r\nx".encode()
            )
            held.append(connection)
        if len(held) > 400:
            held.pop(0).close()
    fresh = attack.asked(f"GET / HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode())
    if fresh[9:12] != b"200":
        attack.get_in(f"while {len(held)} bodies never end, another computer is answered {fresh[:20]!r}")


def downloads(attack: ClassAttack) -> None:
    """Ask for the largest file again and again, and read none of it; then another computer wants a page."""
    held: list[socket.socket] = []
    while attack.goes_on:
        connection = attack.connect()
        if connection is None:
            continue
        asks = f"GET /desk/main.min.js HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode() * 20
        attack.say(connection, asks)
        attack.tries += 19
        held.append(connection)
        if len(held) > 200:
            held.pop(0).close()
    fresh = attack.asked(f"GET / HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode())
    if fresh[9:12] != b"200":
        attack.get_in(f"while {len(held)} clients read nothing, another computer is answered {fresh[:20]!r}")


def handshakes(attack: ClassAttack) -> None:
    """Speak TLS badly: bare connections that never shake hands, plain HTTP, and old versions."""
    import warnings

    warnings.simplefilter("ignore")
    held: list[socket.socket] = []
    old = []
    for version in (ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        context.set_ciphers("ALL:@SECLEVEL=0")
        context.minimum_version = context.maximum_version = version
        old.append(context)
    while attack.goes_on:
        attack.tries += 1
        try:
            plain = socket.create_connection((attack.host, attack.port), ANSWER_S)
        except OSError:
            continue
        kind = attack.chance.random()
        if kind < 0.1 and attack.target.secured:
            try:
                with attack.chance.choice(old).wrap_socket(plain) as spoken:
                    attack.get_in(f"it speaks {spoken.version()}")
            except OSError:
                pass
        elif kind < 0.2:
            with plain:
                attack.say(plain, f"GET / HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode())
                plain.settimeout(0.2)
                try:
                    if attack.target.secured and plain.recv(99)[9:12] == b"200":
                        attack.get_in("it speaks plain HTTP where TLS is wanted")
                except OSError:
                    pass
        else:
            attack.say(plain, b"\x16\x03\x01" if kind < 0.6 else b"")
            held.append(plain)
            if len(held) > 3000:
                held.pop(0).close()
    attack.figures["half handshakes"] = len(held)
    fresh = attack.asked(f"GET / HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode())
    if fresh[9:12] != b"200":
        attack.get_in(f"while {len(held)} handshakes never end, another computer is answered {fresh[:20]!r}")


def spy(attack: ClassAttack) -> None:
    """Look for secrets in what another user can read of the class's processes and of its folder."""
    there = [Path(f"/proc/{attack.server}")]
    there += [folder for folder in Path("/proc").glob("[0-9]*") if parent_of(folder) == attack.server]
    files = [folder / name for folder in there for name in ("cmdline", "environ", "comm", "stat", "maps")]
    if os.getuid() != 0:
        files += [Path(folder, name) for folder, _, names in os.walk(attack.target.folder) for name in names]
        for name in ("class.json", "key.pem", "class.csv", "01-Ada/lesson-1/events.jsonl"):
            try:
                Path(attack.target.folder, name).read_bytes()
                attack.get_in(f"another user can read {name}")
            except OSError:
                pass
    for file in files:
        attack.tries += 1
        try:
            attack.looked_at(file.read_bytes(), str(file))
        except OSError:
            continue


def parent_of(process: Path) -> int:
    """The parent of a process, which is given by its folder in /proc; 0 if it has ended."""
    try:
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    except (OSError, ValueError):
        return 0


# ---- a pupil: a valid key, and a browser that is a program


def messages(attack: ClassAttack) -> None:
    """Flood the own seat with messages of all kinds: the teacher's, of other questions, deep, large, damaged."""
    things: list[Any] = [None, True, -1, 1e308, 10**400, "skip", "undo", "take", "give", [], {}, [0] * 1500, "\x1b[2J"]
    keys = [
        "answer",
        "question",
        "action",
        "word",
        "path",
        "seat",
        "layer",
        "replay",
        "command",
        "say",
        "agree",
        "do",
        "pupil",
        "\0",
    ]
    wishes = [
        {"do": "pause", "on": True},
        {"do": "end"},
        {"do": "next", "pupil": None},
        {"do": "hint", "pupil": 1, "text": "x"},
    ]
    wishes += [{"do": "help", "pupil": 1, "on": True}, {"do": "remove", "pupil": 1}, {"class": {"name": "Ada"}}]
    texts = ["[" * 3000, '{"a":' * 3000, "\ud83d" * 9, "x" * 65000, '"free": true']

    def drawn(depth: int = 0) -> Any:
        if depth < 3 and attack.chance.random() < 0.6:
            return {attack.chance.choice(keys): drawn(depth + 1) for _ in range(attack.chance.randint(1, 2))}
        return attack.chance.choice([*things, attack.chance.randint(0, 100)])

    while attack.goes_on:
        page = attack.page()
        if page is None:
            continue
        try:
            for number in range(200):
                attack.tries += 1
                kind = attack.chance.random()
                if kind < 0.1:
                    page.send(attack.chance.randbytes(99))
                elif kind < 0.2:
                    page.send(attack.chance.choice(texts).encode("utf-8", "replace").decode())
                elif kind < 0.4:
                    page.send(json.dumps(attack.chance.choice(wishes)))
                elif kind < 0.5:
                    page.send(json.dumps({"layer": attack.chance.randint(-(10**9), 10**9)}))
                elif kind < 0.7:
                    page.send(json.dumps({"answer": {"question": number, "action": attack.chance.randint(-1, 9)}}))
                else:
                    page.send(json.dumps(drawn()))
                if number % 20 == 0:
                    heard(attack, page)
        except Exception:
            continue
        finally:
            page.close_socket()


def heard(attack: ClassAttack, page: Any) -> None:
    """Read what a page was sent, in which nothing of another desk may be."""
    try:
        while True:
            text = page.recv(timeout=0.001)
            attack.looked_at(text if isinstance(text, bytes) else text.encode(), "the attacker's page")
            told = json.loads(text).get("class", {})
            if told and told["name"] != attack.target.name:
                attack.get_in(f"the attacker's page is told {told}")
    except TimeoutError:
        return


def frames(attack: ClassAttack) -> None:
    """Flood the own seat with frames that bring no message: pings, pongs, empty messages, fragments without end."""
    kinds = [
        frame(b"", 9) * 20000,
        frame(b"x" * 125, 9) * 2000,
        frame(b"", 10) * 20000,
        frame(b"", 1) * 20000,
        frame(b"a", 1, last=False) + frame(b"", 0, last=False) * 20000,
        frame(b"x" * 60000, 1) * 4,
    ]
    while attack.goes_on:
        page = attack.raw_page()
        if page is None:
            continue
        with page:
            flooded = attack.chance.choice(kinds)
            for _ in range(20):
                if not attack.goes_on or not attack.say(page, flooded):
                    break
                attack.tries += 1


def storms(attack: ClassAttack) -> None:
    """Open the own page again and again, and leave without a word."""
    while attack.goes_on:
        page = attack.raw_page()
        if page is not None:
            page.close()


def deaf(attack: ClassAttack) -> None:
    """Open pages that read nothing, and ask for as many answers as they can."""
    held: list[socket.socket] = []
    wrong = frame(b'{"answer": {"question": 0, "action": 0}}', 1) * 50
    while attack.goes_on:
        page = attack.raw_page()
        if page is not None:
            attack.say(page, wrong)
            attack.tries += 50
            held.append(page)
        if len(held) > 400:
            held.pop(0).close()


def neighbours(attack: ClassAttack) -> None:
    """Try to get at other desks, at the teacher's page and at the desks' own ports with the own key."""
    key, hashes = attack.target.key, []
    tokens = [
        f"{key}&pupil=1",
        f"x&token={key}&pupil=1",
        f"{key}&token=",
        key[::-1],
        f"{key}%26pupil%3D1",
        f"{key}&watch",
    ]
    ports = [
        int(row.split()[1][-4:], 16)
        for row in Path("/proc/net/tcp").read_text().splitlines()[1:]
        if row.split()[3] == "0A"
    ]
    while attack.goes_on:
        for token in tokens:
            page = attack.page(f"/desk/frames?token={token}")
            if page is not None:
                try:
                    for wish in (
                        {"do": "pause", "on": True},
                        {"seat": "take"},
                        {"answer": {"question": 1, "action": 0}},
                    ):
                        page.send(json.dumps(wish))
                    time.sleep(0.02)
                    heard(attack, page)
                except Exception:
                    hashes.append(token)
                page.close_socket()
            for path in ("/teacher/frames?token=", "/teacher/frames?pupil=1&token="):
                if attack.page(path + token) is not None:
                    attack.get_in(f"the teacher's page opens with the token {token!r}")
            table = attack.asked(
                f"GET /teacher/class.csv?token={token} HTTP/1.1\r\nHost: {attack.here}\r\n\r\n".encode()
            )
            if attack.looked_at(table, "class.csv")[9:12] == b"200":
                attack.get_in("class.csv comes with a pupil's key")
        for port in ports:
            if port == attack.port:
                continue
            attack.tries += 1
            try:
                with socket.create_connection(("127.0.0.1", port), 0.5) as desk:
                    desk.sendall(
                        f"GET /frames?token={key} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{UPGRADE}\r\n".encode()
                    )
                    if attack.looked_at(desk.recv(999), f"port {port}")[9:12] == b"101":
                        attack.get_in(f"a desk's port {port} opens with another token")
            except OSError:
                continue


def sentences(attack: ClassAttack) -> None:
    """Say sentences with markup, and answer and take back as fast as possible, so that the journal grows."""
    page: Any = None
    known: dict[str, Any] = {}
    turn = 0
    while attack.goes_on:
        if page is None:
            page = attack.page()
            continue
        try:
            parts = json.loads(page.recv(timeout=0.5))
            known |= parts.get("seat", {})
            question = known.get("question")
            if not question:
                continue
            turn += 1
            attack.tries += 1
            said: dict[str, Any] = {"action": question["moves"][0]["action"]}
            if turn % 3 == 0:
                said = {"say": MARKUP[:28] + " always go left at row 2"}
            elif turn % 3 == 1 and "undo" in question["words"]:
                said = {"word": "undo"}
            page.send(json.dumps({"answer": {"question": question["number"], **said}}))
        except TimeoutError:
            continue
        except Exception:
            page = None


def seats(attack: ClassAttack) -> None:
    """With the code: take every seat, under names with markup."""
    taken = 0
    while attack.goes_on:
        answer = attack.posted(json.dumps({"code": attack.target.code, "name": MARKUP[taken % 9 :]}).encode())
        taken += answer[9:12] == b"200"
    attack.figures["seats taken"] = taken


ATTACKS: dict[str, tuple[Callable[[ClassAttack], None], str]] = {
    "requests": (requests, "a stranger: requests without a right"),
    "codes": (codes, "a stranger: codes from many addresses"),
    "bodies": (bodies, "a stranger: bodies that are damaged or never end"),
    "downloads": (downloads, "a stranger: files that nobody reads"),
    "handshakes": (handshakes, "a stranger: half handshakes, plain HTTP, old TLS"),
    "bare": (flood, "a stranger: bare connections"),
    "half": (half, "a stranger: half requests"),
    "slowly": (slowly, "a stranger: requests a byte at a time"),
    "unread": (unread, "a stranger: answers that nobody reads"),
    "garbage": (garbage, "a stranger: other protocols and noise"),
    "spy": (spy, "a stranger: files and processes that hold secrets"),
    "messages": (messages, "a pupil: messages of all kinds"),
    "frames": (frames, "a pupil: pings and fragments without end"),
    "storms": (storms, "a pupil: pages that come and go"),
    "deaf": (deaf, "a pupil: pages that read nothing"),
    "neighbours": (neighbours, "a pupil: other desks, the teacher's page"),
    "sentences": (sentences, "a pupil: sentences and a growing journal"),
    "seats": (seats, "with the code: all seats taken"),
}


def main(kind: str, seconds: str, seed: str, uid: str = "") -> None:
    """Attack, and print the number of tries, what got in, and figures."""
    import websockets.sync.client  # noqa: F401  # loaded now, because the other user may not be able to read it

    "".encode("idna")  # loads the codec, for the same reason
    random.seed(0)
    target = Target(**json.load(sys.stdin))
    attack = ClassAttack(target, float(seconds), int(seed))
    if uid:
        os.setgroups([])
        os.setgid(int(uid))
        os.setuid(int(uid))
    ATTACKS[kind][0](attack)
    sys.stdout.write(json.dumps({"tries": attack.tries, "inside": attack.inside, "figures": attack.figures}) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
